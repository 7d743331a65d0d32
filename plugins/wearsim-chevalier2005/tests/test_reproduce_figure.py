"""Figures of the paper: completeness, computed data, marks of printed numbers."""

from __future__ import annotations

import re

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from scipy.integrate import trapezoid

from wearsim.report.panels import RED
from wearsim_chevalier2005.figure_panels import normal, smoothed
from wearsim_chevalier2005.figures import reproduction_figure
from wearsim_chevalier2005.study import Reproduction, reproduce

FIGURES = {
    *("7a", "7b", "7c", "8a", "8b", "9a", "9b", "11a", "11b"),
    *("12a", "12b", "13", "14", "15a", "15b", "16", "17a", "17b"),
}


@pytest.fixture(scope="module")
def results() -> Reproduction:
    return reproduce(320)


@pytest.fixture(scope="module")
def figure(results: Reproduction) -> Figure:
    return reproduction_figure(results)


def panel(figure: Figure, title: str) -> Axes:
    (axes,) = [axes for axes in figure.axes if axes.get_title(loc="left").startswith(title)]
    return axes


def marks(axes: Axes) -> list[tuple[float, float]]:
    """Return a point of every line that marks a printed number."""
    red = [line for line in axes.get_lines() if to_hex(line.get_color()) == RED]
    assert all(line.get_linestyle() == "--" for line in red)
    return [
        (float(np.ravel(line.get_xdata())[0]), float(np.ravel(line.get_ydata())[0])) for line in red
    ]


def test_all_figures_are_drawn(figure: Figure) -> None:
    titles = [axes.get_title(loc="left") for axes in figure.axes]
    numbers = {match[1] for title in titles if (match := re.match(r"Fig\. (\w+):", title))}
    assert numbers == FIGURES
    assert "10.1016/j.wear.2004.11.012" in figure.get_supxlabel()


def test_printed_numbers_are_marked(figure: Figure) -> None:
    powers = [0.127, 0.012, 0.29]
    for name in ("15a", "15b"):
        assert [x for x, _ in marks(panel(figure, f"Fig. {name}"))] == powers
    assert [x for x, _ in marks(panel(figure, "Fig. 16"))] == [0.068]
    assert marks(panel(figure, "Fig. 14: mean"))[0][1] == 0.127
    assert marks(panel(figure, "Fig. 14: mean"))[1][0] == 300
    assert [x for x, _ in marks(panel(figure, "Fig. 11b"))] == [-0.05, 0.05]
    assert [y for _, y in marks(panel(figure, "Fig. 9b"))] == [275.0, 307.0, 339.0]
    x, _ = marks(panel(figure, "Fig. 7b"))[0]
    assert 2.0 * x == pytest.approx(3.1)
    legends = [axes.get_legend() for axes in figure.axes if not axes.axison]
    assert "printed in the paper" in [text.get_text() for text in legends[0].get_texts()]  # type: ignore[union-attr]


def test_mean_problem_is_drawn(results: Reproduction, figure: Figure) -> None:
    line = panel(figure, "Fig. 8b").get_lines()[0]
    solution = results.mean.solution
    assert trapezoid(line.get_ydata(), line.get_xdata()) == pytest.approx(solution.power, rel=2e-3)
    assert line.get_ydata() == pytest.approx(solution.dissipation / 1e3)
    density = panel(figure, "Fig. 8a").collections[0].get_array()
    fields = results.mean.fields
    assert fields is not None
    assert np.max(density) == pytest.approx(fields.power_density.max() / 1e6)
    text = panel(figure, "Fig. 7a").get_legend().get_texts()[0].get_text()  # type: ignore[union-attr]
    part = float(re.findall(r"[\d.]+", text)[0])
    assert part == pytest.approx(100.0 * solution.adhesion_fraction, abs=5.0)


def test_white_and_uniform_friction_are_drawn(results: Reproduction, figure: Figure) -> None:
    smooth, rough = panel(figure, "Fig. 13").get_lines()
    assert smooth.get_ydata() == pytest.approx(results.mean.solution.dissipation / 1e3)
    assert rough.get_ydata() == pytest.approx(results.white_friction.solution.dissipation / 1e3)


def test_estimates_end_at_the_last_realisation(results: Reproduction, figure: Figure) -> None:
    for name, value in (
        ("mean", results.all_inputs.power.mean()),
        ("std", results.all_inputs.power.std(ddof=1)),
    ):
        line = panel(figure, f"Fig. 14: {name}").get_lines()[0]
        assert np.ravel(line.get_ydata())[-1] == pytest.approx(value)
        low, high = panel(figure, f"Fig. 14: {name}").get_ylim()
        assert low < value < high
    assert panel(figure, "Fig. 14: mean").get_ylim()[1] > 0.127


def test_classes_contain_all_realisations(figure: Figure) -> None:
    bars = panel(figure, "Fig. 15a").patches
    assert len(bars) == 30
    assert sum(bar.get_height() for bar in bars) == pytest.approx(1.0)  # type: ignore[attr-defined]


def test_profiles_mean_and_band_are_drawn(results: Reproduction, figure: Figure) -> None:
    assert len(panel(figure, "Fig. 17a").get_lines()) == results.all_inputs.count
    mean = panel(figure, "Fig. 17b").get_lines()[0]
    assert mean.get_ydata() == pytest.approx(results.all_inputs.dissipation.mean(axis=0) / 1e3)


def test_densities_have_unit_area_and_correct_moments() -> None:
    values = np.random.default_rng(1).normal(3.0, 0.5, 2500)
    across = np.linspace(-2.0, 8.0, 4001)
    for density in (smoothed(values, across), normal(values, across)):
        assert trapezoid(density, across) == pytest.approx(1.0, abs=1e-9)
        assert trapezoid(across * density, across) == pytest.approx(values.mean())
    widened = 1.0 + (1.06 * 2500**-0.2) ** 2
    second = trapezoid((across - values.mean()) ** 2 * smoothed(values, across), across)
    assert second == pytest.approx(values.var(ddof=1) * widened, rel=1e-3)


def test_two_realisations_can_be_drawn() -> None:
    few = reproduction_figure(reproduce(2))
    assert len(panel(few, "Fig. 17a").get_lines()) == 2
    assert len(marks(panel(few, "Fig. 14: mean"))) == 1  # the mark at 300 realisations is outside

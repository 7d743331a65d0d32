"""The figure of a dissipation study: drawn data against the results."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

from tests.report.drawn import dissipation_figure
from wearsim.report.figures import save_figure
from wearsim.scenario import load_scenario
from wearsim.studies.dissipation.monte_carlo import dissipation
from wearsim.studies.dissipation.result import DissipationResult
from wearsim.studies.dissipation.view import CLASSES, MOST_LINES

PAPER = Path(__file__).parents[2] / "scenarios" / "paper-monte-carlo.toml"


def study(count: int) -> DissipationResult:
    return dissipation(load_scenario(PAPER, {"contact.mx": 8, "contact.my": 12}), count)


@pytest.fixture(scope="module")
def result() -> DissipationResult:
    return study(300)


def panel(figure: Figure, title: str):
    (axes,) = [axes for axes in figure.axes if axes.get_title(loc="left").startswith(title)]
    return axes


@pytest.mark.parametrize(
    ("title", "value", "error"),
    [("Mean dissipated power", "mean", "mean_error"), ("Standard deviation", "std", "std_error")],
)
def test_estimates_are_drawn_with_their_error(result, title, value, error):
    axes, found = panel(dissipation_figure(result), title), result.convergence()
    assert axes.get_lines()[0].get_xdata().tolist() == found.count.tolist()
    np.testing.assert_array_equal(axes.get_lines()[0].get_ydata(), getattr(found, value))
    heights = axes.collections[0].get_paths()[0].vertices[:, 1]
    assert getattr(found, value)[-1] + getattr(found, error)[-1] in heights
    assert axes.get_ylabel().endswith("[W]")


def test_density_has_unit_area_and_a_normal_distribution(result):
    axes = panel(dissipation_figure(result), "Density")
    bars = axes.patches
    assert len(bars) == CLASSES
    assert sum(bar.get_width() * bar.get_height() for bar in bars) == pytest.approx(1.0)
    power = result.summaries["power"]
    x, y = axes.get_lines()[0].get_data()
    assert y.max() == pytest.approx(1 / (power.std * np.sqrt(2 * np.pi)), rel=1e-3)
    assert x[y.argmax()] == pytest.approx(power.mean, rel=0.01)


def test_realisations_are_drawn_in_engineering_units(result):
    axes = panel(dissipation_figure(result), f"Dissipated power per length, {MOST_LINES}")
    assert len(axes.get_lines()) == MOST_LINES
    x, y = axes.get_lines()[7].get_data()
    np.testing.assert_allclose(x, result.y * 1e3)
    np.testing.assert_allclose(y, result.dissipation[7] * 1e-3)


def test_band_is_that_of_the_file(result):
    axes = panel(dissipation_figure(result), "Mean and")
    mean, at_means = axes.get_lines()
    np.testing.assert_allclose(mean.get_ydata(), result.values("dissipation_mean") * 1e-3)
    np.testing.assert_allclose(
        at_means.get_ydata(), result.values("mean_problem_dissipation") * 1e-3
    )
    heights = axes.collections[0].get_paths()[0].vertices[:, 1]
    assert heights.max() == pytest.approx(result.values("dissipation_high").max() * 1e-3)


@pytest.mark.parametrize("count", [1, 2])
def test_few_realisations_can_be_drawn(tmp_path, count):
    save_figure(dissipation_figure(study(count)), tmp_path / "a.png")
    assert (tmp_path / "a.png").stat().st_size > 10_000


def steady(count: int) -> DissipationResult:
    """Return a study with equal realisations."""
    mean = {"distribution": "constant", "value": "300 N"}
    changes = {"load.normal_force": mean, "friction.coefficient": 0.1, "contact.mx": 8}
    zero = {"distribution": "disc", "radius": "1e-12 mrad"}
    changes |= {"creepage.longitudinal": 1e-3, "creepage.misalignment": zero, "contact.my": 12}
    return dissipation(load_scenario(PAPER, changes), count)


def test_density_is_drawn_above_zero_only(result):
    wide = replace(
        result.raw, variables={**result.raw.variables, "power": result.power - result.power.min()}
    )
    axes = panel(dissipation_figure(DissipationResult(wide)), "Density")
    assert axes.get_lines()[0].get_xdata().min() >= 0.0
    assert axes.get_xlim()[0] == 0.0


def test_constant_power_has_no_density_and_one_curve():
    found = steady(300)
    assert found.summaries["power"].is_constant
    figure = dissipation_figure(found)
    density = panel(figure, "Density")
    assert not density.patches
    assert not density.get_lines()
    assert f"{found.power[0]:.4g}" in density.texts[0].get_text()
    curves = panel(figure, "Dissipated power per length, equal in all")
    assert len(curves.get_lines()) == 1
    low, high = panel(figure, "Mean dissipated power").get_ylim()
    assert low < 0.0 < found.power[0] < high
    assert high == pytest.approx(2 * found.power[0])
    assert panel(figure, "Standard deviation").get_lines()[0].get_ydata().max() == 0.0

"""The figure of an ensemble: drawn data against the results."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from matplotlib.colors import to_hex

from tests.report.drawn import ensemble_figure
from tests.report.made_up_ensembles import INPUTS, made_up
from wearsim.report import figures
from wearsim.report.figures import save_figure
from wearsim.report.panels import GREY
from wearsim.studies.ensemble.panels import LINES
from wearsim.studies.ensemble.result import EnsembleResult
from wearsim.uq.estimation.estimates import Target


@pytest.fixture(scope="module")
def result():
    return made_up(400, seed=2)


@pytest.fixture(scope="module")
def figure(result):
    return ensemble_figure(result)


def panel(figure, title):
    (axes,) = [axes for axes in figure.axes if axes.get_title(loc="left").startswith(title)]
    return axes


def labelled(axes, label):
    (line,) = [line for line in axes.get_lines() if line.get_label() == label]
    return line


def test_course_has_median_mean_band_and_realisations(figure, result):
    axes, course = panel(figure, "Depth against"), result.course("depth")
    for label, values in (("median", course.quantiles[0.5]), ("mean", course.mean)):
        np.testing.assert_allclose(labelled(axes, label).get_ydata(), values * 1e6)
        np.testing.assert_allclose(labelled(axes, label).get_xdata(), course.passes / 1e6)
    assert axes.get_xlabel() == "million roller passes"
    thin = [line for line in axes.get_lines() if line.get_linewidth() < 1.0]
    assert len(thin) == LINES
    np.testing.assert_allclose(thin[3].get_ydata(), result.values("depth")[3] * 1e6)
    heights = axes.collections[0].get_paths()[0].vertices[:, 1]
    assert heights.max() == pytest.approx(course.quantiles[0.95].max() * 1e6)


def test_records_over_decades_have_logarithmic_axes(result):
    passes = np.array([0.0, 10.0, 1e3, 1e4, 1e5, 1e6])
    raw = replace(result.raw, variables={**result.raw.variables, "record_passes": passes})
    axes = panel(ensemble_figure(EnsembleResult(raw)), "Depth against")
    assert (axes.get_xscale(), axes.get_yscale()) == ("log", "log")
    assert labelled(axes, "median").get_xdata()[0] == 10.0


def test_density_has_unit_area_and_marks_the_estimates(figure, result):
    axes = panel(figure, "Depth at the end")
    area = sum(bar.get_width() * bar.get_height() for bar in axes.patches)
    assert area == pytest.approx(1.0)
    found = result.estimate("depth", -1, (0.05, 0.5, 0.95))
    marks = [line.get_xdata()[0] for line in axes.get_lines()]
    wanted = [found.mean, found.quantile(0.5), found.quantile(0.05), found.quantile(0.95)]
    np.testing.assert_allclose(marks, [item.value * 1e6 for item in wanted])


def test_convergence_ends_at_the_estimate_of_all(figure, result):
    axes, found = panel(figure, "Mean of depth"), result.estimate("depth").mean
    counts, values = axes.get_lines()[0].get_data()
    assert (counts[0], counts[-1]) == (1, 400)
    assert values[-1] == pytest.approx(found.value * 1e6)
    heights = axes.collections[0].get_paths()[0].vertices[:, 1]
    for end in (found.low, found.high):
        assert np.isclose(heights, end * 1e6).any()


@pytest.mark.parametrize("plan", ["monte-carlo", "sobol", "saltelli", "control-variate"])
def test_convergence_equals_estimates_of_fewer_realisations(plan):
    whole, target = made_up(100, plan, failed=[5]), Target.parse("depth.mean 1%")
    counts, found = whole.convergence(target)
    place = int(np.flatnonzero(counts >= 40)[0])
    last = int(whole.numbers[counts[place] - 1])
    status = np.where(np.arange(100) <= last, whole.raw.status, 0)
    part = EnsembleResult(replace(whole.raw, status=status))
    assert part.count == counts[place]
    assert found[place] == target.interval(part.estimate_for(target))


def test_target_is_drawn_for_its_statistic():
    figure = ensemble_figure(made_up(50, until="width.q95 2%"))
    axes = panel(figure, "95 % quantile of width")
    assert axes.get_ylabel() == "width [mm]"
    last = axes.get_lines()[0].get_ydata()[-1]
    ends = sorted(line.get_ydata()[0] for line in axes.get_lines()[-2:])
    assert ends == pytest.approx([0.98 * last, 1.02 * last])


def test_profile_is_drawn_downwards_with_its_band(figure, result):
    axes, band = panel(figure, "Worn profile"), result.band()
    line = labelled(axes, "mean")
    np.testing.assert_allclose(line.get_xdata(), band.y * 1e3)
    np.testing.assert_allclose(line.get_ydata(), -band.mean * 1e6)
    heights = axes.collections[0].get_paths()[0].vertices[:, 1]
    assert heights.min() == pytest.approx(-band.high.max() * 1e6)


def test_profile_of_some_realisations_has_their_number():
    axes = panel(ensemble_figure(made_up(60, kept=20)), "Worn profile")
    assert axes.get_title(loc="left").endswith("of the first 20")


def test_effects_are_bars_and_insignificant_ones_are_grey(figure, result):
    axes, effects = panel(figure, "Sobol indices"), result.sensitivity("depth")
    assert {item.name for item in effects} == set(INPUTS)
    assert [item.name for item in effects if item.without_effect] == ["roller.offset"]
    assert len(axes.patches) == len(effects)
    for bar, label, item in zip(axes.patches, axes.get_yticklabels(), effects, strict=True):
        assert bar.get_width() == pytest.approx(100.0 * item.first.value)
        assert (to_hex(bar.get_facecolor()) == GREY) == item.without_effect
        assert (label.get_text() == f"{item.name} (not significant)") == item.without_effect


def test_total_indices_are_drawn_for_saltelli():
    result = made_up(5 * 80, "saltelli")
    axes = panel(ensemble_figure(result), "Sobol indices")
    drawn = [line for line in axes.get_lines() if line.get_marker() == "D"]
    marks = [value for line in drawn for value in line.get_xdata()]
    totals = [100.0 * item.total.value for item in result.sensitivity("depth")]
    assert marks == pytest.approx(totals)


@pytest.mark.parametrize(
    ("example", "caption"),
    [
        ({"count": 1}, "1 realisation, monte-carlo"),
        ({"count": 2}, "2 realisations, monte-carlo"),
        ({"count": 5, "failed": [0, 4]}, "3 realisations (2 failed)"),
        ({"count": 30, "pending": 10}, "20 realisations of 30, monte-carlo"),
        ({"count": 20, "spread": 0.0}, "equal in all realisations"),
        ({"count": 3, "failed": [0, 1, 2]}, "0 realisations (3 failed)"),
        ({"count": 4, "pending": 4}, "0 realisations of 4"),
    ],
)
def test_any_ensemble_can_be_drawn(tmp_path, monkeypatch, example, caption):
    monkeypatch.setattr(figures, "DPI", 100)
    figure = ensemble_figure(made_up(**example))
    assert caption in figure.get_suptitle()
    save_figure(figure, tmp_path / "a.png")
    assert (tmp_path / "a.png").stat().st_size > 10_000


def test_constant_depth_has_no_density_and_no_effects():
    figure = ensemble_figure(made_up(20, spread=0.0))
    (text,) = panel(figure, "Depth at the end").texts
    assert re.fullmatch(r"20\.00 um in all 20: no density to draw", text.get_text())
    assert "equal in all realisations" in panel(figure, "Sobol indices").texts[0].get_text()
    convergence = panel(figure, "Mean of depth")
    low, high = convergence.get_ylim()
    assert low < 0.0
    assert high == pytest.approx(40.0)


@pytest.mark.parametrize("number", [2, 19, 20, 71, 72])
def test_ranges_of_figure_and_table_agree(number):
    result = made_up(number)
    figure = ensemble_figure(result)
    ends = [result.estimate("depth", -1, (p,)).quantile(p) for p in (0.05, 0.95)]
    is_known = all(np.isfinite(end.half_width) for end in ends)
    assert ("90 % range" in figure.get_suptitle()) == is_known
    course = panel(figure, "Depth against")
    assert bool(course.collections) == (number >= 20)  # one realisation beyond each end
    marked = [line.get_label() for line in panel(figure, "Depth at the end").get_lines()]
    assert ("5 % and 95 %" in marked) == (number >= 20)


def test_profile_of_few_realisations_has_their_extremes():
    result = made_up(5)
    axes = panel(ensemble_figure(result), "Worn profile")
    heights = axes.collections[0].get_paths()[0].vertices[:, 1]
    assert heights.min() == pytest.approx(-result.profiles.max() * 1e6)
    assert axes.collections[0].get_label() == "least to greatest"

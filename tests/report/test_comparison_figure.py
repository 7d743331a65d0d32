"""The figure of a comparison, and estimates with intervals as text."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg

from tests.report.drawn import comparison_figure
from tests.report.made_up_ensembles import made_up
from tests.studies.study_examples import short
from wearsim.report.figures import save_figure
from wearsim.report.text import cells, part_with_interval, with_interval
from wearsim.studies.comparison.compare import compare
from wearsim.studies.comparison.view import MOST_POINTS
from wearsim.studies.run import run as study
from wearsim.uq.estimation.intervals import UNKNOWN, Interval


@pytest.fixture(scope="module")
def comparison():
    run = study.run(short())
    results = [made_up(300, scale=0.1), made_up(300, scale=0.12), run]
    return compare(results, ["light", "heavy", "one"])


def curves(axes):
    return {line.get_label().split(" (")[0]: line for line in axes.get_lines()}


def test_ensembles_are_distribution_functions_and_runs_lines(comparison):
    axes = comparison_figure(comparison, "loads").axes[0]
    drawn = curves(axes)
    light, _, run = comparison.rows
    x, y = drawn["light"].get_data()
    np.testing.assert_allclose(x[1:], light.values * 1e6)
    np.testing.assert_allclose(y[1:], 100.0 * np.arange(1, 301) / 300)
    assert drawn["one"].get_xdata() == [run.value.value * 1e6] * 2
    (error,) = axes.patches
    assert error.get_x() == pytest.approx(run.value.low * 1e6)
    assert error.get_width() == pytest.approx((run.value.high - run.value.low) * 1e6)


def test_ranges_are_drawn_with_means_and_intervals(comparison):
    axes = comparison_figure(comparison).axes[1]
    light = comparison.rows[0]
    lines = [line.get_xdata() for line in axes.get_lines() if (line.get_ydata() == 0).all()]
    quantiles = dict(light.quantiles)
    for ends in (
        [quantiles[0.05].value, quantiles[0.95].value],
        [quantiles[0.5].value],
        [light.value.low, light.value.high],
        [light.value.value],
    ):
        wanted = 1e6 * np.array(ends)
        assert any(len(x) == len(wanted) and np.allclose(x, wanted) for x in lines)
    labels = [text.get_text() for text in axes.texts]
    assert labels[0] == "light (ensemble of 300)"
    share = part_with_interval(comparison.rows[1].deeper)
    assert labels[1:3] == [
        f"deeper than light in {share} of pairs of tests",
        "heavy (ensemble of 300)",
    ]
    assert labels[-1] == "one (run)"


def test_labels_and_titles_are_within_the_figure(comparison):
    names = [f"a long name of a file with many words {number}" for number in range(3)]
    rows = [replace(row, label=name) for row, name in zip(comparison.rows, names, strict=True)]
    figure = comparison_figure(replace(comparison, rows=tuple(rows)), "a long title " * 20)
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    width = figure.bbox.width
    left, right = figure.axes
    texts = [*figure.texts, right.xaxis.label, *right.texts]
    for text in texts:
        box = text.get_window_extent()
        assert box.x0 >= 0.0
        assert box.x1 <= width
    sizes = [axes.get_window_extent().width for axes in (left, right)]
    assert min(sizes) > 0.45 * width


def test_few_realisations_have_no_range():
    rows = [made_up(12, failed=[1, 2]), made_up(12)]
    _, right = comparison_figure(compare(rows, ["few", "more"])).axes
    assert "few (ensemble of 10 of 12, 2 failed)" in [text.get_text() for text in right.texts]
    assert "5 % to 95 %" not in right.get_xlabel()


def test_runs_are_drawn_with_their_difference(comparison):
    one = comparison.rows[2]
    other = study.run(short())
    left, axes = comparison_figure(compare([other, other], ["a", "b"])).axes
    assert left.get_title(loc="left") == "Depth against roller passes"
    assert left.get_ylabel() == "depth [um]"
    assert curves(left)["b"].get_ydata() == pytest.approx(other.depth * 1e6)
    assert axes.get_title(loc="left") == "Value and estimated error"
    assert any(text.get_text().startswith("equal (estimated errors") for text in axes.texts)
    assert one.difference is None  # for a run against an ensemble


def test_distribution_functions_have_a_limited_number_of_points():
    results = [made_up(3 * MOST_POINTS), made_up(3 * MOST_POINTS, scale=1.1)]
    found = compare(results, ["a", "b"], "width")
    axes = comparison_figure(found).axes[0]
    x, y = curves(axes)["a"].get_data()
    assert len(x) <= MOST_POINTS + 1
    assert (x[-1], y[-1]) == (found.rows[0].values[-1] * 1e3, 100.0)
    assert axes.get_xlabel() == "width at the end [mm]"


@pytest.mark.parametrize("number", [2, 9])
def test_any_comparison_can_be_drawn(tmp_path, number):
    results = [made_up(1), made_up(20, spread=0.0), *(made_up(30, seed=k) for k in range(number))]
    found = compare(results, [f"{k}" for k in range(len(results))])
    save_figure(comparison_figure(found), tmp_path / "a.png")
    assert (tmp_path / "a.png").stat().st_size > 10_000


@pytest.mark.parametrize(
    ("found", "unit", "text"),
    [
        (Interval(21.4873e-6, 21.0e-6, 21.98e-6), "um", "21.49 um [21.00, 21.98]"),
        (Interval(21.4873e-6, 21.4870e-6, 21.4876e-6), "um", "21.48730 um [21.48700, 21.48760]"),
        (Interval(21.4873e-6, 10e-6, 33e-6), "um", "21.5 um [10.0, 33.0]"),
        (Interval(1758.4, 1718.6, 1797.7), "J", "1758 J [1719, 1798]"),
        (Interval(-3e-7, -5e-7, 1e-7), "um", "-0.300 um [-0.500, 0.100]"),
        (Interval(3.0, 3.0, 3.0), "N", "3.000 N"),
        (Interval(3.0, -math.inf, math.inf), "N", "3.000 N (too few for an interval)"),
        (Interval(2e-12, 1e-12, 3e-12), "um", "2.000e-06 um [1.000e-06, 3.000e-06]"),
        (UNKNOWN, "N", "- (too few for an interval)"),
    ],
)
def test_digits_of_an_estimate_follow_its_interval(found, unit, text):
    assert with_interval(found, unit) == text


def test_table_cells_have_no_units():
    assert cells(Interval(21.4873e-6, 21.0e-6, 21.98e-6), "um") == ("21.49", "21.00..21.98")
    assert cells(Interval(3.0, 3.0, 3.0), "N") == ("3.000", "")
    assert cells(UNKNOWN, "N") == ("-", "too few")


def test_fractions_are_shown_in_per_cent():
    assert part_with_interval(Interval(0.571, 0.54, 0.6023)) == "57.1 % [54.0, 60.2]"
    assert part_with_interval(Interval(1.0, 1.0, 1.0)) == "100.0 %"
    assert part_with_interval(UNKNOWN) == "-"

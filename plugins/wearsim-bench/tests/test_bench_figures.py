"""Tables and figures of a benchmark, from artificial measurements."""

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.text import Text

from wearsim.report.figures import save_figure
from wearsim_bench.figures import table as bench_table
from wearsim_bench.figures.lines import spread
from wearsim_bench.figures.table import (
    column_heads,
    count_text,
    markdown,
    percent,
    selected,
    table_rows,
)
from wearsim_bench.figures.topic import bench_figure
from wearsim_bench.measure.machine import Machine
from wearsim_bench.measure.measurement import Effort, Measurement, Topic

MACHINE = Machine("a processor", 2, "3.12.1", {"numpy": "2.0"}, 1e-4, "2026-11-22")


def measured(method, setting, seconds, error, **keywords):
    return Measurement("hard cases", method, setting, seconds, {"power": error}, **keywords)


@pytest.fixture
def topic():
    items = (
        measured("strip", "21 strips", 1e-5, 1e-2, counts={"solves": 3.0, "warm_seconds": 2e-6}),
        measured("strip", "81 strips", 1e-4, 1e-3, default=True),
        measured("march", "21 strips", 1e-3, 2e-2),
        measured("march", "81 strips", 1e-2, 5e-3),
        Measurement("hard cases", "parabola", "81 strips", failed="no | parabola fits"),
    )
    counts = {"solves": "solves", "warm_seconds": "warm"}
    errors = {"power": "power, rms"}
    return Topic("contact", "One contact", "About.", "one contact", "power", errors, counts, items)


def test_long_table_has_front_default_and_best_settings(topic, monkeypatch):
    assert len(selected(topic, "hard cases")) == 5
    monkeypatch.setattr(bench_table, "FEW", 4)
    names = [(item.method, item.setting) for item in selected(topic, "hard cases")]
    kept = [("strip", "21 strips"), ("strip", "81 strips"), ("march", "81 strips")]
    assert names == [*kept, ("parabola", "81 strips")]
    assert len(table_rows(topic, "hard cases", 1e-4, whole=True)) == 5


def test_rows_have_times_errors_counts_and_marks(topic):
    first, second, third, _, failed = table_rows(topic, "hard cases", MACHINE.yardstick)
    expected = ("strip", "21 strips", "10 us", "0.1", "1.0 %", "3", "2 us", "*")
    assert first.cells == expected
    assert second.cells[-1] == "* default"
    assert third.cells[-1] == ""
    assert failed.cells == ("parabola", "81 strips", *["-"] * 5, "no | parabola fits")
    assert failed.failed
    assert not first.failed
    assert all(len(line.cells) == len(column_heads(topic)) for line in (first, failed))


def test_markdown_escapes_messages(topic):
    text = markdown(topic, MACHINE, Effort(quick=True, plugin="sponge"))
    rows = [line for line in text.splitlines() if line.startswith("|")]
    assert len(rows) == 7
    assert {line.replace(r"\|", "").count("|") for line in rows} == {9}
    assert "one yardstick is 100 us; best of 5; quick" in text
    assert "contact model sponge." in text
    assert "* Pareto front" in text


@pytest.mark.parametrize(
    ("name", "value", "text"),
    [
        ("solves", 161.0, "161"),
        ("peak_bytes", 321e6, "321 MB"),
        ("warm_seconds", 4e-5, "40 us"),
        ("order", 1.25, "1.25"),
        ("solves", None, "-"),
    ],
)
def test_counts_have_units(name, value, text):
    assert count_text(name, value) == text


def test_errors_are_percentages():
    assert [percent(value) for value in (0.00035, 1.0, 1e-15, None)] == [
        "0.035 %",
        "100 %",
        "rounding",
        "-",
    ]


def test_figure_shows_all_timed_methods(topic, tmp_path):
    figure = bench_figure(topic, MACHINE, Effort())
    axes = figure.axes[0]
    assert axes.get_legend_handles_labels()[1] == ["strip", "march", "Pareto front", "default"]
    assert [text.get_text() for text in axes.texts] == ["strip", "march"]
    assert [text.get_text() for text in figure.legends[0].get_texts()] == [
        "Pareto front",
        "default",
    ]
    x, y = figure.axes[0].lines[0].get_data()
    np.testing.assert_allclose(x, [1e-5, 1e-4])
    np.testing.assert_allclose(y, [1.0, 0.1])
    save_figure(figure, tmp_path / "contact.png")
    assert (tmp_path / "contact.png").stat().st_size > 10_000


def test_group_without_times_has_a_note():
    failed = Measurement("hard cases", "parabola", "81 strips", failed="none")
    topic = Topic("contact", "T", "", "one", "power", {"power": "p"}, {}, (failed,))
    text = bench_figure(topic, MACHINE, Effort()).axes[0].texts[0].get_text()
    assert "no measurements" in text


def test_growth_is_drawn_against_size():
    items = tuple(
        Measurement("strips", "slender", f"{n} strips", 1e-3 * n, {}, {"peak_bytes": 1e8 + n})
        for n in (41, 81, 161)
    )
    counts = {"peak_bytes": "memory"}
    topic = Topic("growth", "Growth", "", "one study", "depth", {"depth": "depth"}, counts, items)
    axes = bench_figure(topic, MACHINE, Effort()).axes[0]
    np.testing.assert_allclose(axes.lines[0].get_data(), [[41, 81, 161], [0.041, 0.081, 0.161]])
    assert axes.lines[1].get_ydata()[0] == pytest.approx(0.1)
    assert {text.get_text() for text in axes.texts} == {"time [s]", "memory [GB]"}
    assert "*" not in table_rows(topic, "strips", 1e-4)[0].cells


def test_savings_are_bars():
    items = (
        Measurement("full slip", "strip", "full slip", 1e-3, {"result": 0.0}, {"times": 2.5}),
        Measurement("full slip", "strip", "partial adhesion", 2.5e-3, {"result": 0.0}),
    )
    heads = {"times": "speed-up"}
    topic = Topic("savings", "S", "", "one call", "result", {"result": "result"}, heads, items)
    axes = bench_figure(topic, MACHINE, Effort()).axes[0]
    (bar,) = axes.patches
    assert (bar.get_x(), bar.get_x() + bar.get_width()) == (1.0, 2.5)
    assert axes.texts[0].get_text() == "2.5"
    assert axes.get_yticklabels()[0].get_text() == "full slip: strip, full slip"


def crowded(families, each, times=(1e-4, 3e-4, 5e-4)):
    """Return a topic with one group; the lines of the methods of a family coincide."""
    items = tuple(
        measured(f"family {family}, option {option}", f"{n} strips", times[n], 1e-2 / (1 + family))
        for family in range(families)
        for option in range(each)
        for n in range(len(times))
    )
    heads = {"power": "power, rms"}
    return Topic("contact", "One contact", "About.", "one contact", "power", heads, {}, items)


def overlap(boxes):
    """Return whether any two boxes overlap."""
    return any(
        one.overlaps(other) for place, one in enumerate(boxes) for other in boxes[place + 1 :]
    )


@pytest.mark.parametrize(
    ("families", "each", "panels"),
    [(4, 6, 4), (1, 5, 1), (2, 3, 1), (1, 2, 1)],
)
def test_many_methods_have_a_panel_for_each_family(families, each, panels):
    figure = bench_figure(crowded(families, each), MACHINE, Effort())
    assert len(figure.axes) == panels
    labels = [text.get_text() for axes in figure.axes for text in axes.texts]
    assert len(labels) == families * each
    if panels > 1:
        assert [axes.get_title(loc="left") for axes in figure.axes] == [
            f"family {number}" for number in range(families)
        ]
        assert labels[:each] == [f"option {number}" for number in range(each)]
        thin = [line for line in figure.axes[0].lines if line.get_linewidth() < 0.7]
        assert len(thin) == (families - 1) * each  # the other families
    colours = {line.get_color() for line in figure.axes[0].lines if line.get_marker() != "None"}
    assert len(colours) == each * families / panels


@pytest.mark.parametrize("times", [(2e-5, 3e-4, 7e-4), (1e-4, 2e-4, 3e-4), (1e-6, 1e-3, 1.0)])
def test_ticks_and_labels_do_not_overlap(times):
    figure = bench_figure(crowded(4, 7, times), MACHINE, Effort())
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    for axes in figure.axes:
        ticks = [
            tick.label1.get_window_extent()
            for tick in axes.xaxis.get_major_ticks()
            if tick.label1.get_text() and axes.bbox.x0 - 1 <= tick.label1.get_window_extent().x1
        ]
        shown = [box for box in ticks if axes.bbox.x0 <= 0.5 * (box.x0 + box.x1) <= axes.bbox.x1]
        assert len(shown) >= 2
        assert not overlap(shown)
        assert not overlap([Text.get_window_extent(text) for text in axes.texts])
    ends = [text.get_window_extent().x1 for axes in figure.axes for text in axes.texts]
    assert max(ends) <= figure.bbox.width


def test_labels_are_spread_within_the_panel():
    assert spread([0.1, 0.5], 0.1) == [0.1, 0.5]
    np.testing.assert_allclose(spread([0.5, 0.5, 0.5], 0.1), [0.5, 0.6, 0.7])
    np.testing.assert_allclose(spread([0.95, 0.97, 1.2], 0.1), [0.8, 0.9, 1.0])
    np.testing.assert_allclose(spread([-0.5, 0.0], 0.1), [0.0, 0.1])

"""Tables and figures of a benchmark, from artificial measurements."""

import numpy as np
import pytest

from wearsim.report.parts import save_figure
from wearsim_bench.figures import table as bench_table
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

MACHINE = Machine("a processor", 2, "3.12.1", {"numpy": "2.0"}, 1e-4)


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
    labels = figure.axes[0].get_legend_handles_labels()[1]
    assert labels == ["strip", "march", "Pareto front", "default"]
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
    assert "*" not in table_rows(topic, "strips", 1e-4)[0].cells


def test_savings_are_bars():
    items = (
        Measurement("full slip", "strip", "full slip", 1e-3, {"result": 0.0}, {"times": 2.5}),
        Measurement("full slip", "strip", "partial adhesion", 2.5e-3, {"result": 0.0}),
    )
    heads = {"times": "speed-up"}
    topic = Topic("savings", "S", "", "one call", "result", {"result": "result"}, heads, items)
    axes = bench_figure(topic, MACHINE, Effort()).axes[0]
    assert [bar.get_width() for bar in axes.patches] == [2.5]
    assert axes.get_yticklabels()[0].get_text() == "full slip: strip, full slip"

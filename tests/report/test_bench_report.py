"""Tables and figures of a benchmark, from measurements that are made up."""

import numpy as np
import pytest

from wearsim.bench.machine import Machine
from wearsim.bench.measured import Measurement, Topic
from wearsim.report.bench import bench_figure
from wearsim.report.bench_table import chosen, counted, heads, lines, markdown, percent
from wearsim.report.saving import save_figure

MACHINE = Machine("a processor", 2, "3.12.1", {"numpy": "2.0"}, 1e-4)


def measured(method, setting, seconds, error, **more):
    return Measurement("hard cases", method, setting, seconds, {"power": error}, **more)


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


def test_that_a_table_holds_the_front_the_default_and_the_best_of_every_method(topic):
    names = [(item.method, item.setting) for item in chosen(topic, "hard cases")]
    kept = [("strip", "21 strips"), ("strip", "81 strips"), ("march", "81 strips")]
    assert names == [*kept, ("parabola", "81 strips")]
    assert len(lines(topic, "hard cases", 1e-4, whole=True)) == 5


def test_that_lines_tell_times_errors_counts_and_marks(topic):
    first, second, third, failed = lines(topic, "hard cases", MACHINE.yardstick)
    told = ("strip", "21 strips", "10 us", "0.1", "1.0 %", "3", "2 us", "front")
    assert first.cells == told
    assert second.cells[-1] == "front, default"
    assert third.cells[-1] == ""
    assert failed.cells == ("parabola", "81 strips", *["-"] * 5, "no | parabola fits")
    assert all(len(line.cells) == len(heads(topic)) for line in (first, failed))


def test_that_markdown_survives_what_a_message_holds(topic):
    text = markdown(topic, MACHINE)
    rows = [line for line in text.splitlines() if line.startswith("|")]
    assert len(rows) == 6
    assert {line.replace(r"\|", "").count("|") for line in rows} == {9}
    assert "one yardstick is 100 us" in text


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
def test_that_counts_have_units(name, value, text):
    assert counted(name, value) == text


def test_that_errors_are_percentages():
    assert [percent(value) for value in (0.00035, 1.0, 1e-15, None)] == [
        "0.035 %",
        "100 %",
        "rounding",
        "-",
    ]


def test_that_the_figure_shows_every_method_that_has_a_time(topic, tmp_path):
    figure = bench_figure(topic, MACHINE)
    labels = figure.axes[0].get_legend_handles_labels()[1]
    assert labels == ["strip", "march", "none is better", "the default"]
    x, y = figure.axes[0].lines[0].get_data()
    np.testing.assert_allclose(x, [1e-5, 1e-4])
    np.testing.assert_allclose(y, [1.0, 0.1])
    save_figure(figure, tmp_path / "contact.png")
    assert (tmp_path / "contact.png").stat().st_size > 10_000


def test_that_a_group_without_any_time_says_so():
    failed = Measurement("hard cases", "parabola", "81 strips", failed="none")
    topic = Topic("contact", "T", "", "one", "power", {"power": "p"}, {}, (failed,))
    text = bench_figure(topic, MACHINE).axes[0].texts[0].get_text()
    assert "nothing could be measured" in text

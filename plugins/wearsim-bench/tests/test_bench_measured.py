"""Pareto front, validation of measurements, and the machine."""

import itertools
import json
import math
from dataclasses import replace
from datetime import date

import pytest
from hypothesis import given, strategies as st

from wearsim_bench.measure.machine import this_machine
from wearsim_bench.measure.measurement import Measurement, Topic, pareto

POINTS = st.lists(st.tuples(st.floats(1e-6, 10.0), st.floats(0.0, 1.0)), max_size=30)


def measured(seconds, error):
    return Measurement("problems", "method", "setting", seconds, {"power": error})


@given(POINTS)
def test_front_dominates_all_items(points):
    items = [measured(*point) for point in points]
    front = pareto(items, "power")
    for item in items:
        dominated = any(
            other.seconds <= item.seconds and other.errors["power"] <= item.errors["power"]
            for other in front
        )
        assert dominated  # items of the front individually
    for one, next_one in itertools.pairwise(front):
        assert one.seconds < next_one.seconds
        assert one.errors["power"] > next_one.errors["power"]


def test_items_without_time_or_error_are_not_on_the_front():
    untimed = Measurement("problems", "method", "setting", None, {"power": 0.0})
    other = Measurement("problems", "method", "setting", 1.0, {"width": 0.0})
    failed = Measurement("problems", "method", "setting", failed="no solution")
    assert pareto([untimed, other, failed], "power") == []


@pytest.mark.parametrize("error", [math.nan, math.inf, -1e-3])
def test_invalid_errors_are_refused(error):
    with pytest.raises(ValueError, match="the error 'power' is"):
        measured(1.0, error)
    invalid = Measurement("problems", "method", "setting").with_results(1.0, {"power": error})
    assert invalid.failed.startswith("the error 'power' is")
    assert (invalid.seconds, invalid.errors) == (None, {})
    assert pareto([invalid, measured(2.0, 0.1)], "power") == [measured(2.0, 0.1)]


@pytest.mark.parametrize("seconds", [math.nan, -1.0])
def test_invalid_times_are_refused(seconds):
    with pytest.raises(ValueError, match="the time is"):
        measured(seconds, 0.1)


def test_errors_below_the_floor_are_equal():
    coarse, fine, finest = (measured(*point) for point in ((1.0, 0.002), (2.0, 1e-3), (3.0, 0.0)))
    assert pareto([finest, fine, coarse], "power", floor=0.003) == [coarse]
    assert pareto([finest, fine, coarse], "power", floor=1e-3) == [coarse, fine]
    topic = Topic("t", "T", "", "one", "power", {"power": "power"}, {}, (coarse, fine), 0.003)
    data = topic.as_json()
    assert data["floor"] == 0.003
    assert [row["front"] for row in data["measurements"]] == [True, False]


def test_json_marks_the_front():
    items = tuple(measured(*point) for point in ((1.0, 0.1), (2.0, 0.2), (3.0, 0.05)))
    topic = Topic("t", "T", "", "one", "power", {"power": "power"}, {}, items)
    rows = topic.as_json()["measurements"]
    assert [row["front"] for row in rows] == [True, False, True]
    assert topic.groups == ["problems"]
    topic = replace(topic, details=("problems",), conclusions={"problems": "as expected"})
    assert Topic.from_json(json.loads(json.dumps(topic.as_json()))) == topic


def test_machine_is_named_and_measured():
    machine = this_machine(repetitions=1)
    assert f"{machine.cores} cores, Python 3." in str(machine)
    assert 1e-6 < machine.yardstick < 1.0
    assert date.fromisoformat(machine.date).year >= 2026

"""What none beats, and the machine that a benchmark names."""

import itertools
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from wearsim_bench.measure.machine import this_machine
from wearsim_bench.measure.measurement import Measurement, Topic, pareto

pytestmark = pytest.mark.bench

POINTS = st.lists(st.tuples(st.floats(1e-6, 10.0), st.floats(0.0, 1.0)), max_size=30)


def measured(seconds, error):
    return Measurement("problems", "method", "setting", seconds, {"power": error})


@given(POINTS)
def test_that_the_front_holds_those_that_none_beats(points):
    items = [measured(*point) for point in points]
    front = pareto(items, "power")
    for item in items:
        beaten = any(
            other.seconds <= item.seconds and other.errors["power"] <= item.errors["power"]
            for other in front
        )
        assert beaten  # by itself, if it is on the front
    for one, next_one in itertools.pairwise(front):
        assert one.seconds < next_one.seconds
        assert one.errors["power"] > next_one.errors["power"]


def test_that_what_has_no_time_or_no_such_error_is_on_no_front():
    untimed = Measurement("problems", "method", "setting", None, {"power": 0.0})
    other = Measurement("problems", "method", "setting", 1.0, {"width": 0.0})
    failed = Measurement("problems", "method", "setting", failed="no answer")
    assert pareto([untimed, other, failed], "power") == []


@pytest.mark.parametrize("error", [math.nan, math.inf, -1e-3])
def test_that_an_error_that_is_none_beats_nobody(error):
    with pytest.raises(ValueError, match="its error 'power' is"):
        measured(1.0, error)
    told = Measurement("problems", "method", "setting").found(1.0, {"power": error})
    assert told.failed.startswith("its error 'power' is")
    assert (told.seconds, told.errors) == (None, {})
    assert pareto([told, measured(2.0, 0.1)], "power") == [measured(2.0, 0.1)]


@pytest.mark.parametrize("seconds", [math.nan, -1.0])
def test_that_a_time_that_is_none_is_refused(seconds):
    with pytest.raises(ValueError, match="its time is"):
        measured(seconds, 0.1)


def test_that_none_is_better_than_the_truth_is_known():
    coarse, fine, finest = (measured(*point) for point in ((1.0, 0.002), (2.0, 1e-3), (3.0, 0.0)))
    assert pareto([finest, fine, coarse], "power", floor=0.003) == [coarse]
    assert pareto([finest, fine, coarse], "power", floor=1e-3) == [coarse, fine]
    topic = Topic("t", "T", "", "one", "power", {"power": "power"}, {}, (coarse, fine), 0.003)
    told = topic.as_json()
    assert told["floor"] == 0.003
    assert [row["front"] for row in told["measurements"]] == [True, False]


def test_that_a_topic_tells_what_is_on_its_fronts():
    items = tuple(measured(*point) for point in ((1.0, 0.1), (2.0, 0.2), (3.0, 0.05)))
    topic = Topic("t", "T", "", "one", "power", {"power": "power"}, {}, items)
    told = topic.as_json()["measurements"]
    assert [row["front"] for row in told] == [True, False, True]
    assert topic.groups == ["problems"]


def test_that_the_machine_is_named_and_measured():
    machine = this_machine(repetitions=1)
    assert f"{machine.cores} cores, Python 3." in str(machine)
    assert 1e-6 < machine.yardstick < 1.0

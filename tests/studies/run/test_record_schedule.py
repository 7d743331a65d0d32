"""Record schedules."""

from __future__ import annotations

import itertools
import math

import pytest
from hypothesis import given, settings, strategies as st
from study_examples import short

from wearsim.studies.schedule import MOST_RECORDS, RecordSchedule

LONG = 1e12  # passes of a first run that is not prolonged


def _all(schedule: RecordSchedule, stop: float) -> list[float]:
    """Return all records up to the end of the test, which is always recorded."""
    found = [0.0]
    while True:
        due = schedule.next_record(found[-1])
        assert due > found[-1]
        if due >= stop:
            return [*found, stop]
        found.append(due)


@given(stop=st.integers(2, 10**8), count=st.integers(1, 400), log=st.booleans())
@settings(deadline=None, max_examples=100)
def test_number_of_records_is_as_requested(stop: int, count: int, log: bool) -> None:
    schedule = RecordSchedule(0.0 if log else stop / count, float(stop), count)
    found = _all(schedule, stop)
    assert len(found) == count + 1
    for number, passes in enumerate(found[1:], start=1):
        exact = stop ** (number / count) if log else stop * number / count
        assert passes == pytest.approx(exact, rel=1e-12)
    assert found[-2] < stop * (1.0 - 1e-9)


@given(
    interval=st.floats(0.5, 1e6),
    start=st.floats(0.0, 1e6),
    base=st.floats(2.0, 1e8),
    count=st.integers(1, 1000),
    log=st.booleans(),
)
@settings(deadline=None, max_examples=100)
def test_next_record_is_within_one_interval(
    interval: float, start: float, base: float, count: int, log: bool
) -> None:
    schedule = RecordSchedule(0.0 if log else interval, base, count)
    passes = start
    for _ in range(12):
        due = schedule.next_record(passes)
        assert due > passes
        if log:
            ratio = base ** (1.0 / count)
            assert due <= max(passes, 1.0) * ratio * (1.0 + 1e-8)
        else:
            assert due <= passes + schedule.interval_at(passes) * (1.0 + 1e-8)
        passes = due


@given(interval=st.floats(0.1, 1e5), skipped=st.integers(1, 10**6))
@settings(deadline=None)
def test_equal_intervals_do_not_drift(interval: float, skipped: int) -> None:
    schedule = RecordSchedule(interval, LONG, 1)
    passes = skipped * interval
    for number in range(skipped + 1, skipped + 30):
        passes = schedule.next_record(passes)
        assert passes == pytest.approx(number * interval, rel=1e-12)


@given(interval=st.floats(1.0, 1e5), places=st.lists(st.floats(0.0, 1e5), min_size=1))
@settings(deadline=None)
def test_next_record_does_not_depend_on_position(interval: float, places: list[float]) -> None:
    schedule = RecordSchedule(interval, LONG, 1)
    for place in places:
        due = schedule.next_record(place)
        before = place + 0.5 * (due - place)
        assert schedule.next_record(before) == due


@pytest.mark.parametrize(
    ("outputs", "first"),
    [
        ({}, [1500.0, 3000.0]),
        ({"outputs.records": 3}, [2000.0, 4000.0]),
        ({"outputs.records": 2, "outputs.spacing": "log"}, [math.sqrt(6000.0), 6000.0]),
        ({"outputs.every_passes": 700}, [700.0, 1400.0]),
        ({"outputs.every": "2 s"}, [100.0, 200.0]),
        ({"outputs.every": "0.1 min"}, [300.0, 600.0]),
    ],
)
def test_scenario_sets_the_schedule(outputs: dict[str, object], first: list[float]) -> None:
    schedule = RecordSchedule.of(short(**outputs), 6000.0)
    found = [schedule.next_record(0.0)]
    found.append(schedule.next_record(found[0]))
    assert found == pytest.approx(first, rel=1e-14)


def test_default_is_twenty_records() -> None:
    from wearsim.scenario import parse_scenario

    text = short().text.replace("records = 4", "")
    scenario = parse_scenario(text, "rig.toml", {}.__getitem__)
    assert RecordSchedule.of(scenario, 6000.0).next_record(0.0) == 300.0


def test_test_of_one_pass_has_a_schedule() -> None:
    schedule = RecordSchedule.of(short(outputs__spacing="log"), 1.0)
    assert schedule.next_record(0.0) > 0.0


@pytest.mark.parametrize("speed", ["1000 rpm", "990 rpm", "333 rpm", "1234.5 rpm"])
@pytest.mark.parametrize("every", ["1 s", "1 min", "7.5 s"])
def test_whole_passes_are_recorded_without_round_off(speed: str, every: str) -> None:
    schedule = RecordSchedule.of(short(operation__speed=speed, outputs__every=every), LONG)
    passes = 0.0
    for _ in itertools.repeat(None, 2000):
        passes = schedule.next_record(passes)
        assert passes == round(passes) or abs(passes - round(passes)) > 1e-9


@given(
    interval=st.floats(0.5, 1e4),
    base=st.floats(10.0, 1e6),
    longer=st.floats(1.0, 1e5),
    pass_by_pass=st.booleans(),
)
@settings(deadline=None, max_examples=50)
def test_records_of_a_prolonged_test_are_bounded(
    interval: float, base: float, longer: float, pass_by_pass: bool
) -> None:
    schedule = RecordSchedule(interval, base, 1)
    end = longer * base
    most = max(MOST_RECORDS, 2.0 * base / interval)
    assert end / schedule.interval_at(end) <= most * (1.0 + 1e-9)
    doublings = math.log2(schedule.interval_at(end) / interval)
    assert doublings == round(doublings)
    # records that are due before the end, and kept then, are due in any longer interval
    due = schedule.due_after(0.0, pass_by_pass)
    longest = RecordSchedule(schedule.interval_at(end), base, 1)
    multiple = longest.due_after(0.0, pass_by_pass)
    assert schedule.is_kept(multiple, end)
    # a record may miss an interval by round-off
    assert schedule.is_kept(due, end) == (abs(due - multiple) <= 1e-9 * multiple)

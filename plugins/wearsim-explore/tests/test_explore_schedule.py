"""Order of computations: at most one of a session in flight, and only the newest waiting."""

from __future__ import annotations

from pathlib import Path

import pytest

from wearsim_explore.answers import Request, Stage
from wearsim_explore.design import Design
from wearsim_explore.schedule import Schedule

DESIGN = Design("", Path("rig.toml"))


def request(session: str, number: int, stage: Stage = "first") -> Request:
    return Request(session, number, stage, DESIGN, Path())


def started(schedule: Schedule) -> list[tuple[int, str, int]]:
    return [(worker, one.session, one.number) for worker, one in schedule.to_start()]


def test_only_the_newest_of_200_changes_waits() -> None:
    schedule = Schedule(2)
    for number in range(200):
        schedule.ask(request("a", number))
        schedule.to_start()
        assert len(schedule.running) <= 1
        assert len(schedule.waiting) <= 1
    assert schedule.running[0].number == 0
    assert schedule.finished(0, complete=True)
    assert started(schedule) == [(0, "a", 199)]
    assert not schedule.waiting


def test_sessions_take_turns() -> None:
    schedule = Schedule(1)
    for session in "abc":
        schedule.ask(request(session, 0))
    assert started(schedule) == [(0, "a", 0)]
    schedule.ask(request("a", 1))
    schedule.ask(request("b", 1))  # keeps its place
    order = []
    for _ in range(3):
        schedule.finished(0, complete=True)
        order += started(schedule)
    assert order == [(0, "b", 1), (0, "c", 0), (0, "a", 1)]


def test_refined_result_is_stopped_by_a_change() -> None:
    schedule = Schedule(1)
    schedule.ask(request("a", 0, "final"))
    schedule.to_start()
    schedule.ask(request("a", 1))
    assert schedule.to_stop() == [0]
    assert schedule.to_stop() == []  # once only
    assert not schedule.finished(0, complete=False)
    assert started(schedule) == [(0, "a", 1)]


def test_first_answer_goes_on_unless_it_takes_long() -> None:
    time = [0.0]
    schedule = Schedule(1, clock=lambda: time[0])
    schedule.ask(request("a", 0))
    schedule.to_start()
    schedule.ask(request("a", 1))
    assert schedule.to_stop() == []
    time[0] = 5.0
    schedule.ask(request("a", 2))
    assert schedule.to_stop() == [0]


def test_first_answer_goes_before_refined_ones_of_others() -> None:
    schedule = Schedule(1)
    schedule.ask(request("a", 0, "final"))
    schedule.to_start()
    schedule.ask(request("b", 0, "final"))
    schedule.ask(request("c", 0))
    assert schedule.to_stop() == [0]
    assert not schedule.finished(0, complete=False)
    assert started(schedule) == [(0, "c", 0)]
    # what was stopped for another session waits again
    assert [one.session for one in schedule.waiting.values()] == ["b", "a"]


def test_answer_that_nobody_waits_for_is_not_wanted() -> None:
    schedule = Schedule(1)
    schedule.ask(request("a", 0))
    schedule.to_start()
    schedule.forget("a")
    assert schedule.to_stop() == [0]
    assert not schedule.finished(0, complete=True)
    assert not schedule.waiting


@pytest.mark.parametrize("workers", [1, 2, 3])
def test_all_workers_are_used(workers: int) -> None:
    schedule = Schedule(workers)
    for session in "abcd":
        schedule.ask(request(session, 0))
    assert len(started(schedule)) == workers

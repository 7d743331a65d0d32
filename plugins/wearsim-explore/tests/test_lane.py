"""Order of computations: at most one of a session in flight, and only the newest waiting."""

from __future__ import annotations

from pathlib import Path

import pytest

from wearsim_explore.answers import Request, Stage
from wearsim_explore.design import Design
from wearsim_explore.lane import Lane

DESIGN = Design("", Path("rig.toml"))


def request(session: str, number: int, stage: Stage = "first") -> Request:
    return Request(session, number, stage, DESIGN, Path())


def started(lane: Lane) -> list[tuple[int, str, int]]:
    return [(worker, one.session, one.number) for worker, one in lane.to_start()]


def test_only_the_newest_of_200_changes_waits() -> None:
    lane = Lane(2)
    for number in range(200):
        lane.ask(request("a", number))
        lane.to_start()
        assert len(lane.running) <= 1
        assert len(lane.waiting) <= 1
    assert lane.running[0].number == 0
    assert lane.finished(0, complete=True)
    assert started(lane) == [(0, "a", 199)]
    assert not lane.waiting


def test_sessions_take_turns() -> None:
    lane = Lane(1)
    for session in "abc":
        lane.ask(request(session, 0))
    assert started(lane) == [(0, "a", 0)]
    lane.ask(request("a", 1))
    lane.ask(request("b", 1))  # keeps its place
    order = []
    for _ in range(3):
        lane.finished(0, complete=True)
        order += started(lane)
    assert order == [(0, "b", 1), (0, "c", 0), (0, "a", 1)]


def test_refined_result_is_stopped_by_a_change() -> None:
    lane = Lane(1)
    lane.ask(request("a", 0, "final"))
    lane.to_start()
    lane.ask(request("a", 1))
    assert lane.to_stop() == [0]
    assert lane.to_stop() == []  # it is told once
    assert not lane.finished(0, complete=False)
    assert started(lane) == [(0, "a", 1)]


def test_first_answer_goes_on_unless_it_takes_long() -> None:
    time = [0.0]
    lane = Lane(1, clock=lambda: time[0])
    lane.ask(request("a", 0))
    lane.to_start()
    lane.ask(request("a", 1))
    assert lane.to_stop() == []
    time[0] = 5.0
    lane.ask(request("a", 2))
    assert lane.to_stop() == [0]


def test_first_answer_goes_before_refined_ones_of_others() -> None:
    lane = Lane(1)
    lane.ask(request("a", 0, "final"))
    lane.to_start()
    lane.ask(request("b", 0, "final"))
    lane.ask(request("c", 0))
    assert lane.to_stop() == [0]
    assert not lane.finished(0, complete=False)
    assert started(lane) == [(0, "c", 0)]
    # what was stopped for another session waits again
    assert [one.session for one in lane.waiting.values()] == ["b", "a"]


def test_answer_that_nobody_waits_for_is_not_wanted() -> None:
    lane = Lane(1)
    lane.ask(request("a", 0))
    lane.to_start()
    lane.forget("a")
    assert lane.to_stop() == [0]
    assert not lane.finished(0, complete=True)
    assert not lane.waiting


@pytest.mark.parametrize("workers", [1, 2, 3])
def test_all_workers_are_used(workers: int) -> None:
    lane = Lane(workers)
    for session in "abcd":
        lane.ask(request(session, 0))
    assert len(started(lane)) == workers

"""Members that are stepped together, and what is observed of them on the way."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from wearsim.evolution.dividing import divided
from wearsim.evolution.implicit import ImplicitStepper
from wearsim.evolution.joining import Flock, joined_states, scene_of, state_of
from wearsim.evolution.state import WearState
from wearsim.evolution.together import Path, Together
from wearsim.studies.member_runs import Member, Observed, Row, observed_alone, rows_of_states
from wearsim.studies.recorder import stepped_aside
from wearsim.studies.schedule import RecordSchedule
from wearsim.types import FloatArray, IntArray


@dataclass(frozen=True)
class Due:
    """Records that fall due in one step of several tests, test by test and in their order.

    Parameters
    ----------
    place : ndarray of int, shape (records,)
        Of the test in its flock.
    source : ndarray of int, shape (records,)
        Which state of the path is recorded, or where the side step to the record begins.
    passes : ndarray, shape (records,)
        At which it falls due.
    """

    place: IntArray
    source: IntArray
    passes: FloatArray

    @classmethod
    def of(cls, path: Path, schedule: RecordSchedule, stop: float) -> Due:
        """Return what falls due on a path to the end of a test at `stop` passes."""
        found: list[tuple[int, int, float]] = []
        for place, states in enumerate(zip(*(flock.progress for flock in path), strict=True)):
            passes = [done for _, done in states]
            for source in range(len(path) - 1):
                first, last = passes[source], passes[source + 1]
                between, at_end = schedule.due_between(first, last, stop)
                found += [(place, source, due) for due in between]
                found += [(place, source + 1, last)] if at_end else []
        table = np.array(found).reshape(-1, 3)
        return cls(table[:, 0].astype(np.int64), table[:, 1].astype(np.int64), table[:, 2])


def observed(members: Sequence[Member]) -> list[Observed | Exception]:
    """Step through the tests of a group; return what was observed, or what ended them."""
    first = members[0]
    if isinstance(first.stepper, ImplicitStepper) and first.goes_together:
        return MemberGroup(members, first.stepper).run()
    try:
        return [observed_alone(first)]
    except Exception as error:  # it ends this test and no other
        return [error]


class MemberGroup:
    """Members that are stepped together.

    Parameters
    ----------
    members : sequence of Member
        Such as go with each other.
    stepper : ImplicitStepper
        Theirs.
    """

    def __init__(self, members: Sequence[Member], stepper: ImplicitStepper) -> None:
        scenario = members[0].draws.scenario
        self._stepper = stepper
        self._stop, self._schedule = members[0].stop, members[0].schedule
        self._threshold = scenario.outputs.width_threshold
        scenes = [member.scene for member in members]
        self._tests = Together(scenes, stepper, self._stop, scenario.evolution.max_steps)
        self._rows: list[list[Row]] = [[] for _ in members]
        self._found: dict[int, Observed] = {}

    def run(self) -> list[Observed | Exception]:
        """Step through the tests; return what was observed of each, or what ended it."""
        if self._tests.flock is not None:
            self._note(self._tests.flock)
        while self._tests.flock is not None:
            path = self._tests.sweep()
            if path is not None:
                self._record(path)
                self._finish(path[-1])
        failures = self._tests.failures
        return [failures.get(k) or self._found[k] for k in range(len(self._rows))]

    def _finish(self, flock: Flock) -> None:
        """Keep what the tests have come to that have reached their end."""
        for place, (number, passes) in enumerate(flock.progress):
            if passes >= self._stop:
                steps, rows = int(self._tests.steps[number]), self._rows[number]
                self._found[number] = Observed.of(rows, flock.state, place, steps)

    def _record(self, path: Path) -> None:
        """Record what falls due on a path, by side steps that lead nowhere where need be."""
        due = Due.of(path, self._schedule, self._stop)
        if not due.place.size:
            return
        start = path[0]
        states = joined_states([replace(flock.state, shadow=None) for flock in path])
        state = state_of(states, due.source * len(start.numbers) + due.place)
        scene = scene_of(start.scene, due.place)
        self._note(Flock(start.numbers[due.place], scene, state), due.passes)

    def _note(self, flock: Flock, passes: FloatArray | None = None) -> None:
        """Note the observables of tests, at `passes` where they are given."""

        def look(places: IntArray) -> list[Row]:
            some = flock.at(places)
            state = some.state if passes is None else self._stepped(some, passes[places])
            return rows_of_states(some.scene, state, self._threshold)

        done, failed = divided(look, np.arange(len(flock.numbers)))
        for places, rows in done:
            for number, row in zip(flock.numbers[places].tolist(), rows, strict=True):
                self._rows[number].append(row)
        self._tests.fail({int(flock.numbers[place]): error for place, error in failed.items()})

    def _stepped(self, flock: Flock, passes: FloatArray) -> WearState:
        """Return the states of tests at the passes given, by side steps where they are later."""
        now = np.asarray(flock.state.now)
        sides = np.flatnonzero(passes > now)
        if not sides.size:
            return flock.state
        some, later = flock.at(sides), passes[sides]
        step = self._stepper.side_step
        stepped = stepped_aside(step, some.scene, some.state, later - now[sides])
        order = np.arange(len(now))
        order[sides] = len(order) + np.arange(len(sides))
        return state_of(joined_states([flock.state, stepped.moved(later)]), order)

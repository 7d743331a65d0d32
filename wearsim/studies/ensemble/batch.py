"""The wear tests of an ensemble's members: stepped together where they can be, or one by one."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from wearsim.evolution.batch.bisect_failures import bisect_failures
from wearsim.evolution.batch.lockstep import Lockstep, Path, can_step_together
from wearsim.evolution.batch.per_realisation import sum_in_order
from wearsim.evolution.batch.stack import Stack, compatible, problem_of, stacked_states, state_of
from wearsim.evolution.integrate import evolve
from wearsim.evolution.problem import WearProblem
from wearsim.evolution.state import WearState, fresh_state
from wearsim.evolution.steppers.backward_euler import ImplicitStepper
from wearsim.evolution.steppers.base import Stepper
from wearsim.studies.run.draws import Draws
from wearsim.studies.run.output_schedule import RecordSchedule
from wearsim.studies.run.recorder import due_states, history_row, stepped_aside
from wearsim.types import FloatArray, IntArray

MAX_BATCH = 128  # more gain nothing

MOST_NUMBERS = 50_000  # strips of all contacts; some 100 arrays of so many numbers live at a time

Row = dict[str, float]


@dataclass(frozen=True)
class RealisationRun:
    """A realisation that is ready to be run.

    Parameters
    ----------
    number : int
    drawn : mapping of str to float or ndarray
        What was drawn for it, by the scenario's key [SI].
    draws : Draws
    problem : WearProblem
    stepper : Stepper
    """

    number: int
    drawn: Mapping[str, float | FloatArray]
    draws: Draws
    problem: WearProblem
    stepper: Stepper

    @property
    def stop(self) -> float:
        """Passes at the end of the test."""
        return float(self.draws.scenario.total_passes)

    @property
    def schedule(self) -> RecordSchedule:
        """When it is recorded."""
        return RecordSchedule.of(self.draws.scenario, self.stop)

    @property
    def can_be_batched(self) -> bool:
        """Whether it can be stepped together with others."""
        return can_step_together(self.problem, self.stepper)

    def can_join(self, other: RealisationRun) -> bool:
        """Tell whether it can be stepped together with one that can be stepped together."""
        return self._course == other._course and compatible(self.problem, other.problem)

    @property
    def _course(self) -> tuple[object, ...]:
        evolution, outputs = self.draws.scenario.evolution, self.draws.scenario.outputs
        return self.stop, self.schedule, outputs.width_threshold, evolution


@dataclass(frozen=True)
class Observed:
    """What a test has come to.

    Parameters
    ----------
    rows : list of dict
        What was observed at every record.
    scalars : dict of str to float
        Errors and effort.
    profile : ndarray, shape (strips,)
        Worn depth of the cylinder at the end [m].
    """

    rows: list[Row]
    scalars: dict[str, float]
    profile: FloatArray

    @classmethod
    def of(cls, rows: list[Row], end: WearState, place: int, steps: int) -> Observed:
        """Return what a test has come to whose end is one of the realisations of a state."""
        solves = end.solves if end.individual is None else end.individual.solves[place]
        scalars = {
            "depth_error": float(end.depth_error[place]),
            "volume_error": float(end.volume_error[place]),
            "steps": float(steps),
            "solves": float(solves),
        }
        return cls(rows, scalars, end.cylinder_depth[:, 0, place].mean(axis=0))


def grouped(members: Sequence[RealisationRun]) -> list[list[RealisationRun]]:
    """Return the members in groups that can be stepped together, or of one each."""
    groups: list[list[RealisationRun]] = []
    growing: list[list[RealisationRun]] = []
    for member in members:
        if not member.can_be_batched:
            groups.append([member])
            continue
        numbers = len(member.problem.roller) * member.problem.grid.strips
        most = min(MAX_BATCH, max(1, MOST_NUMBERS // numbers))
        found = next((g for g in growing if len(g) < most and member.can_join(g[0])), None)
        if found is None:
            found = []
            groups.append(found)
            growing.append(found)
        found.append(member)
    return groups


def observed_alone(member: RealisationRun) -> Observed:
    """Step through one test."""
    problem, stepper, schedule, stop = member.problem, member.stepper, member.schedule, member.stop
    scenario, state = member.draws.scenario, fresh_state(problem)
    threshold = scenario.outputs.width_threshold
    rows = rows_of_states(problem, state, threshold, stepper.pass_by_pass)
    for advance in evolve(
        problem, state, stepper, stop, schedule.next_record, scenario.evolution.max_steps
    ):
        for due in due_states(problem, stepper, schedule, advance, stop):
            rows += rows_of_states(problem, due, threshold, stepper.pass_by_pass)
        state = advance.end
    return Observed.of(rows, state, 0, state.steps)


def rows_of_states(
    problem: WearProblem, state: WearState, threshold: float, pass_by_pass: bool = False
) -> list[Row]:
    """Return the observables of every realisation of a state, one number each."""
    row: dict[str, Any] = history_row(problem, state, None, threshold, pass_by_pass)
    count = problem.kinematics.multiplicity[:, None]
    energy, time = row["dissipated_energy"], np.asarray(row["time"])
    begun = time > 0.0
    columns = {
        "depth": row["depth"],
        "width": row["width"],
        "worn_volume": row["worn_volume"],
        "roller_depth": row["roller_depth"].max(axis=0),
        "total_roller_worn_volume": sum_in_order(row["roller_worn_volume"] * count, axis=0),
        "dissipated_energy": energy,
        "mean_power": np.where(begun, energy / np.where(begun, time, 1.0), row["power"]),
        "power": row["power"],
        "normal_force": sum_in_order(row["normal_force"] * count, axis=0) / count.sum(),
        "peak_pressure": row["peak_pressure"].max(axis=0),
    }
    return [
        {name: float(column[v]) for name, column in columns.items()}
        for v in range(problem.shape[2])
    ]


@dataclass(frozen=True)
class Due:
    """Records that fall due in one step of several tests, test by test and in their order.

    Parameters
    ----------
    place : ndarray of int, shape (records,)
        Of the test in its stack.
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
        for place, states in enumerate(zip(*(stack.progress for stack in path), strict=True)):
            passes = [done for _, done in states]
            for source in range(len(path) - 1):
                first, last = passes[source], passes[source + 1]
                between, at_end = schedule.due_between(first, last, stop)
                found += [(place, source, due) for due in between]
                found += [(place, source + 1, last)] if at_end else []
        table = np.array(found).reshape(-1, 3)
        return cls(table[:, 0].astype(np.int64), table[:, 1].astype(np.int64), table[:, 2])


def observed(members: Sequence[RealisationRun]) -> list[Observed | Exception]:
    """Step through the tests of a group; return what was observed, or what ended them."""
    first = members[0]
    if isinstance(first.stepper, ImplicitStepper) and first.can_be_batched:
        return RealisationBatch(members, first.stepper).run()
    try:
        return [observed_alone(first)]
    except Exception as error:  # it ends this test and no other
        return [error]


class RealisationBatch:
    """RealisationRunner that are stepped together.

    Parameters
    ----------
    members : sequence of RealisationRun
        Such as go with each other.
    stepper : ImplicitStepper
        Theirs.
    """

    def __init__(self, members: Sequence[RealisationRun], stepper: ImplicitStepper) -> None:
        scenario = members[0].draws.scenario
        self._stepper = stepper
        self._stop, self._schedule = members[0].stop, members[0].schedule
        self._threshold = scenario.outputs.width_threshold
        problems = [member.problem for member in members]
        self._tests = Lockstep(problems, stepper, self._stop, scenario.evolution.max_steps)
        self._rows: list[list[Row]] = [[] for _ in members]
        self._found: dict[int, Observed] = {}

    def run(self) -> list[Observed | Exception]:
        """Step through the tests; return what was observed of each, or what ended it."""
        if self._tests.stack is not None:
            self._note(self._tests.stack)
        while self._tests.stack is not None:
            path = self._tests.sweep()
            if path is not None:
                self._record(path)
                self._finish(path[-1])
        failures = self._tests.failures
        return [failures.get(k) or self._found[k] for k in range(len(self._rows))]

    def _finish(self, stack: Stack) -> None:
        """Keep what the tests have come to that have reached their end."""
        for place, (number, passes) in enumerate(stack.progress):
            if passes >= self._stop:
                steps, rows = int(self._tests.steps[number]), self._rows[number]
                self._found[number] = Observed.of(rows, stack.state, place, steps)

    def _record(self, path: Path) -> None:
        """Record what falls due on a path, by side steps that lead nowhere where need be."""
        due = Due.of(path, self._schedule, self._stop)
        if not due.place.size:
            return
        start = path[0]
        states = stacked_states([replace(stack.state, coarse_step_solution=None) for stack in path])
        state = state_of(states, due.source * len(start.numbers) + due.place)
        problem = problem_of(start.problem, due.place)
        self._note(Stack(start.numbers[due.place], problem, state), due.passes)

    def _note(self, stack: Stack, passes: FloatArray | None = None) -> None:
        """Note the observables of tests, at `passes` where they are given."""

        def look(places: IntArray) -> list[Row]:
            some = stack.at(places)
            state = some.state if passes is None else self._stepped(some, passes[places])
            return rows_of_states(some.problem, state, self._threshold)

        done, failed = bisect_failures(look, np.arange(len(stack.numbers)))
        for places, rows in done:
            for number, row in zip(stack.numbers[places].tolist(), rows, strict=True):
                self._rows[number].append(row)
        self._tests.fail({int(stack.numbers[place]): error for place, error in failed.items()})

    def _stepped(self, stack: Stack, passes: FloatArray) -> WearState:
        """Return the states of tests at the passes given, by side steps where they are later."""
        now = np.asarray(stack.state.passes_done)
        sides = np.flatnonzero(passes > now)
        if not sides.size:
            return stack.state
        some, later = stack.at(sides), passes[sides]
        step = self._stepper.side_step
        stepped = stepped_aside(step, some.problem, some.state, later - now[sides])
        order = np.arange(len(now))
        order[sides] = len(order) + np.arange(len(sides))
        return state_of(stacked_states([stack.state, stepped.advanced_to(later)]), order)

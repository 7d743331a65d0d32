"""Wear tests of an ensemble's realisations, stepped in batches where possible."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
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
from wearsim.studies.run.recorder import RecordSchedule, due_states, history_row, take_side_step
from wearsim.types import FloatArray, IntArray

MAX_BATCH = 128  # realisations in one batch; larger batches are not faster

MAX_STRIPS = 50_000  # strips of all contacts of a batch; about 100 arrays of this size are in use

Observables = dict[str, float]


@dataclass(frozen=True)
class RealisationRun:
    """The wear test of one realisation, ready to be stepped.

    Parameters
    ----------
    number : int
    drawn : mapping of str to float or ndarray
        Values of the random inputs by the scenario's key [SI].
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
        """Schedule of the records."""
        return RecordSchedule.of(self.draws.scenario, self.stop)

    @property
    def can_be_batched(self) -> bool:
        """Whether the test can be stepped in a batch."""
        return can_step_together(self.problem, self.stepper)

    def can_join(self, other: RealisationRun) -> bool:
        """Return whether two tests that can be batched can be in one batch."""
        settings = [
            (one.stop, one.schedule, scenario.outputs.width_threshold, scenario.evolution)
            for one in (self, other)
            for scenario in (one.draws.scenario,)
        ]
        return settings[0] == settings[1] and compatible(self.problem, other.problem)


@dataclass(frozen=True)
class RunObservations:
    """Results of one wear test.

    Parameters
    ----------
    rows : list of dict
        Observables at every record.
    scalars : dict of str to float
        Error estimates, and numbers of steps and contact solutions.
    profile : ndarray, shape (strips,)
        Worn depth of the cylinder at the end [m].
    """

    rows: list[Observables]
    scalars: dict[str, float]
    profile: FloatArray

    @classmethod
    def of(cls, rows: list[Observables], end: WearState, place: int, steps: int) -> RunObservations:
        """Return the results of a test from the final state of its batch and its place there."""
        solves = end.solves if end.individual is None else end.individual.solves[place]
        scalars = {
            "depth_error": float(end.depth_error[place]),
            "volume_error": float(end.volume_error[place]),
            "steps": float(steps),
            "solves": float(solves),
        }
        return cls(rows, scalars, end.cylinder_depth[:, 0, place].mean(axis=0))


def batch_groups(runs: Sequence[RealisationRun]) -> list[list[RealisationRun]]:
    """Return the tests in groups that can be stepped in one batch, or of one test each."""
    groups: list[list[RealisationRun]] = []
    for run in runs:
        batched, strips = run.can_be_batched, len(run.problem.roller) * run.problem.grid.strips
        limit = min(MAX_BATCH, max(1, MAX_STRIPS // strips))
        for group in groups if batched else []:
            if len(group) < limit and group[0].can_be_batched and run.can_join(group[0]):
                group.append(run)
                break
        else:
            groups.append([run])
    return groups


def observe_single(run: RealisationRun) -> RunObservations:
    """Step through one test individually and return its results."""
    problem, stepper, schedule, stop = run.problem, run.stepper, run.schedule, run.stop
    scenario, state = run.draws.scenario, fresh_state(problem)
    threshold = scenario.outputs.width_threshold
    rows = observables_of(problem, state, threshold, stepper.pass_by_pass)
    for advance in evolve(
        problem, state, stepper, stop, schedule.next_record, scenario.evolution.max_steps
    ):
        for due in due_states(problem, stepper, schedule, advance, stop):
            rows += observables_of(problem, due, threshold, stepper.pass_by_pass)
        state = advance.end
    return RunObservations.of(rows, state, 0, state.steps)


def observables_of(
    problem: WearProblem, state: WearState, threshold: float, pass_by_pass: bool = False
) -> list[Observables]:
    """Return the observables of every realisation of a state."""
    row: dict[str, Any] = history_row(problem, state, None, threshold, pass_by_pass)
    count = problem.kinematics.multiplicity[:, None]
    energy, time = row["dissipated_energy"], np.asarray(row["time"])
    started = time > 0.0
    columns = {
        "depth": row["depth"],
        "width": row["width"],
        "worn_volume": row["worn_volume"],
        "roller_depth": row["roller_depth"].max(axis=0),
        "total_roller_worn_volume": sum_in_order(row["roller_worn_volume"] * count, axis=0),
        "dissipated_energy": energy,
        "mean_power": np.where(started, energy / np.where(started, time, 1.0), row["power"]),
        "power": row["power"],
        "normal_force": sum_in_order(row["normal_force"] * count, axis=0) / count.sum(),
        "peak_pressure": row["peak_pressure"].max(axis=0),
    }
    return [
        {name: float(column[v]) for name, column in columns.items()}
        for v in range(problem.shape[2])
    ]


def observe(runs: Sequence[RealisationRun]) -> list[RunObservations | Exception]:
    """Step through the tests of a group; return the results or the error of each."""
    first = runs[0]
    if isinstance(first.stepper, ImplicitStepper) and first.can_be_batched:
        return RealisationBatch(runs, first.stepper).run()
    try:
        return [observe_single(first)]
    except Exception as error:  # an error fails this realisation only
        return [error]


class RealisationBatch:
    """A batch of wear tests stepped together.

    Parameters
    ----------
    runs : sequence of RealisationRun
        Tests that can be in one batch.
    stepper : ImplicitStepper
        The stepper of all tests.
    """

    def __init__(self, runs: Sequence[RealisationRun], stepper: ImplicitStepper) -> None:
        scenario = runs[0].draws.scenario
        self._stepper = stepper
        self._stop, self._schedule = runs[0].stop, runs[0].schedule
        self._threshold = scenario.outputs.width_threshold
        problems = [run.problem for run in runs]
        self._tests = Lockstep(problems, stepper, self._stop, scenario.evolution.max_steps)
        self._rows: list[list[Observables]] = [[] for _ in runs]

    def run(self) -> list[RunObservations | Exception]:
        """Step through the tests; return the results or the error of each."""
        results: dict[int, RunObservations | Exception] = {}
        if self._tests.stack is not None:
            self._observe(self._tests.stack)
        while self._tests.stack is not None:
            path = self._tests.sweep()
            if path is None:
                continue
            self._record(path)
            for place, (number, passes) in enumerate(path[-1].progress):
                if passes >= self._stop:
                    steps, rows = int(self._tests.steps[number]), self._rows[number]
                    results[number] = RunObservations.of(rows, path[-1].state, place, steps)
        results |= self._tests.failures
        return [results[number] for number in range(len(self._rows))]

    def _record(self, path: Path) -> None:
        """Record all states due on a path, by side steps to those between two of its states."""
        due = [
            (place, source + at_end, passes)
            for place, states in enumerate(zip(*(stack.progress for stack in path), strict=True))
            for source, ((_, first), (_, last)) in enumerate(pairwise(states))
            for passes, at_end in self._schedule.due_between(first, last, self._stop)
        ]
        if not due:
            return
        table = np.array(due)
        places, sources = table[:, :2].T.astype(np.int64)
        start = path[0]
        states = stacked_states([replace(stack.state, coarse_step_solution=None) for stack in path])
        state = state_of(states, sources * len(start.numbers) + places)
        problem = problem_of(start.problem, places)
        self._observe(Stack(start.numbers[places], problem, state), table[:, 2])

    def _observe(self, stack: Stack, passes: FloatArray | None = None) -> None:
        """Append the observables of tests, at `passes` where given; fail tests that raise."""

        def observe_at(places: IntArray) -> list[Observables]:
            some = stack.at(places)
            state = some.state if passes is None else self._stepped(some, passes[places])
            return observables_of(some.problem, state, self._threshold)

        done, failed = bisect_failures(observe_at, np.arange(len(stack.numbers)))
        for places, rows in done:
            for number, row in zip(stack.numbers[places].tolist(), rows, strict=True):
                self._rows[number].append(row)
        self._tests.fail({int(stack.numbers[place]): error for place, error in failed.items()})

    def _stepped(self, stack: Stack, passes: FloatArray) -> WearState:
        """Return the states of tests at the given passes, by side steps to later ones."""
        now = np.asarray(stack.state.passes_done)
        later = np.flatnonzero(passes > now)
        if not later.size:
            return stack.state
        some, ends = stack.at(later), passes[later]
        step = self._stepper.side_step
        stepped = take_side_step(step, some.problem, some.state, ends - now[later])
        order = np.arange(len(now))
        order[later] = len(order) + np.arange(len(later))
        return state_of(stacked_states([stack.state, stepped.advanced_to(ends)]), order)

"""Keeps the history of a run and its recorded profiles; records never move a step."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from wearsim.errors import ContactError, StepError
from wearsim.evolution.batch.per_realisation import mean_along
from wearsim.evolution.error_control.error_estimates import Step
from wearsim.evolution.error_control.step_size import SMALLEST_STEP
from wearsim.evolution.observables import depth, width, worn_volume
from wearsim.evolution.problem import WearProblem
from wearsim.evolution.state import WearState
from wearsim.evolution.steppers.base import Advance, Stepper
from wearsim.evolution.steppers.single_step import (
    contacts_at,
    cylinder_depth_of,
    cylinder_volume_of,
    present_loads,
    solve_present,
)
from wearsim.studies.run.output_schedule import RecordSchedule
from wearsim.types import FloatArray, Number

Row = dict[str, object]


def history_row(
    problem: WearProblem,
    state: WearState,
    before: WearState | None,
    threshold: float,
    pass_by_pass: bool,
) -> Row:
    """Return the observables of a state; `threshold` [m] bounds the groove's width."""
    problem, state, loads = present_contacts(problem, state, pass_by_pass)
    realisations = range(problem.shape[2])
    worn = state.cylinder_depth
    power = problem.values_of(state.contacts, "power")
    row: Row = {
        "passes": state.passes_done,
        "time": problem.time(state.passes_done),
        "step_passes": 0.0 if before is None else state.passes_done - before.passes_done,
        "depth": cylinder_depth_of(state),
        "width": np.array(
            [width(problem.grid.y, worn[:, 0, v].max(axis=0), threshold) for v in realisations]
        ),
        "worn_volume": cylinder_volume_of(problem, state),
        "roller_depth": depth(state.roller_depth)[0],
        "roller_worn_volume": worn_volume(
            state.roller_depth[0], problem.grid.spacing, problem.kinematics.roller_radius
        ),
        "dissipated_energy": state.energy,
        "power": problem.total_power(power),
        "normal_force": mean_along(problem.per_roller(loads), axis=0)[0],
        "depth_error": state.depth_error,
        "volume_error": state.volume_error,
        "rejected": state.rejected,
        "solves": state.solves,
        "full_solves": state.full_solves,
    }
    peak = problem.values_of(state.contacts, "peak_pressure")
    row["peak_pressure"] = problem.per_roller(peak).max(axis=0)
    for name in ("approach", "longitudinal_creepage", "adhesion_fraction"):
        values = problem.values_of(state.contacts, name)
        row[name] = mean_along(problem.per_roller(values), axis=0)[0]
    return row


def at_record(problem: WearProblem, stepper: Stepper, start: WearState, passes: float) -> WearState:
    """Return the state at `passes`, reached from `start` by a step of its own that leads nowhere.

    A profile interpolated between two steps would not fit its contact: line loads feel a tenth of
    a micrometre. A side step does, and leaves the run as it is.
    """

    def step(problem: WearProblem, state: WearState, passes: Number) -> WearState:
        return stepper.side_step(problem, state, float(passes))

    return stepped_aside(step, problem, start, passes - start.passes).replaced(passes=passes)


def stepped_aside(step: Step, problem: WearProblem, state: WearState, passes: Number) -> WearState:
    """Return the state `passes` later by one side step, or by halves where there is no such step.

    Parameters
    ----------
    step : callable
        Takes a problem, a state and a number of passes to the state after them.
    problem : WearProblem
    state : WearState
    passes : float or ndarray, shape (realisations,)
        Halved for one test alone: what becomes of it must not hang on others.

    Raises
    ------
    StepError, ContactError
        If halves would be too short.
    """
    try:
        return step(problem, state, passes)
    except (StepError, ContactError):
        half = 0.5 * passes
        if np.size(half) > 1 or np.max(half) < SMALLEST_STEP:
            raise
    return stepped_aside(step, problem, stepped_aside(step, problem, state, half), half)


def present_contacts(
    problem: WearProblem, state: WearState, pass_by_pass: bool
) -> tuple[WearProblem, WearState, FloatArray]:
    """Return `state` with its contacts at the loads of this moment, their problem, and the loads.

    Where every pass draws its inputs one contact says little: contacts that stand for many passes
    take its place, so that a record holds the same whatever the stepper.
    """
    if problem.expectation is not None:
        problem, state = problem.expectation, state.replaced(contacts=())
    loads = present_loads(problem, state)
    solve = solve_present if pass_by_pass else contacts_at
    return problem, state.replaced(contacts=solve(problem, state, loads)), loads


def record_row(problem: WearProblem, state: WearState, pass_by_pass: bool) -> Row:
    """Return the profiles of a state and the contacts at the loads of this moment."""
    problem, state, _ = present_contacts(problem, state, pass_by_pass)
    row: Row = {
        "record_passes": state.passes,
        "record_time": problem.time(state.passes),
        "cylinder_depth_profile": state.cylinder_depth[:, 0],
        "roller_depth_profile": state.roller_depth[0],
    }
    for name in ("line_load", "half_length", "dissipation"):
        row[name] = problem.per_roller(problem.values_of(state.contacts, name))
    return row


def due_states(
    problem: WearProblem, stepper: Stepper, schedule: RecordSchedule, advance: Advance, stop: float
) -> list[WearState]:
    """Return the states that are to be recorded on the way of a step, in their order.

    Parameters
    ----------
    problem : WearProblem
    stepper : Stepper
        Takes the side steps to what falls due within the step.
    schedule : RecordSchedule
    advance : Advance
        The step.
    stop : float
        Passes at the end of the test, which is recorded too.
    """
    found = []
    for first, last in zip(advance.path[:-1], advance.path[1:], strict=True):
        between, at_end = schedule.due_between(
            first.passes, last.passes, stop, stepper.pass_by_pass
        )
        found += [at_record(problem, stepper, first, passes) for passes in between]
        found += [last] if at_end else []
    return found


class Recorder:
    """Collects history and records; what it shows is always that of a whole number of steps.

    Parameters
    ----------
    problem : WearProblem
    stepper : Stepper
        Takes the side steps to what falls due within a step.
    schedule : RecordSchedule
    threshold : float
        Depth that bounds the groove's width [m].
    state : WearState
        Where the run stands.
    history, records : mapping of str to ndarray, optional
        What an earlier part of the run collected; without it `state` is recorded as the first.
    """

    def __init__(
        self,
        problem: WearProblem,
        stepper: Stepper,
        schedule: RecordSchedule,
        threshold: float,
        state: WearState,
        history: Mapping[str, FloatArray] | None = None,
        records: Mapping[str, FloatArray] | None = None,
    ) -> None:
        self.problem = problem
        self.stepper = stepper
        self.schedule = schedule
        self.threshold = threshold
        self._history = _rows(history or {}) or [
            history_row(problem, state, None, threshold, stepper.pass_by_pass)
        ]
        self._records = _rows(records or {}) or [record_row(problem, state, stepper.pass_by_pass)]
        self._kept = len(self._history), len(self._records), state

    def add(self, advance: Advance, stop: float) -> None:
        """Take note of a step, and record what fell due on its way or at the end of the test."""
        start, end = advance.path[0], advance.end
        due = due_states(self.problem, self.stepper, self.schedule, advance, stop)
        pass_by_pass = self.stepper.pass_by_pass
        self._records += [record_row(self.problem, state, pass_by_pass) for state in due]
        self._history.append(history_row(self.problem, end, start, self.threshold, pass_by_pass))
        # one assignment: an interrupt in the lines above leaves the step before in force
        self._kept = len(self._history), len(self._records), end

    def drop_unfinished(self) -> None:
        """Forget what an interrupted `add` left behind."""
        del self._history[self._kept[0] :], self._records[self._kept[1] :]

    @property
    def state(self) -> WearState:
        """The state after the last step that was noted."""
        return self._kept[2]

    @property
    def history(self) -> dict[str, FloatArray]:
        """The history as arrays, first axis step."""
        return _columns(self._history)

    @property
    def records(self) -> dict[str, FloatArray]:
        """The records as arrays, first axis record."""
        return _columns(self._records)


def _rows(columns: Mapping[str, FloatArray]) -> list[Row]:
    count = len(next(iter(columns.values()))) if columns else 0
    return [{name: column[k] for name, column in columns.items()} for k in range(count)]


def _columns(rows: list[Row]) -> dict[str, FloatArray]:
    return {name: np.array([row[name] for row in rows]) for name in rows[0]} if rows else {}

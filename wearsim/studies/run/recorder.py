"""Events, record schedule, history and recorded profiles of wear tests."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np

from wearsim.errors import ContactError, SolverError, StepError
from wearsim.evolution.integrate import Advance
from wearsim.evolution.observables import (
    depth,
    errors_of_simultaneous_passes,
    groove_width,
    least_gaps,
    peak_pressures,
    present_contacts,
    volume,
    worn_descents,
)
from wearsim.evolution.problem import WearProblem
from wearsim.evolution.quantities import worn_volume
from wearsim.evolution.state import WearState, joined_states
from wearsim.evolution.steppers.base import Stepper
from wearsim.evolution.steppers.single_step import present_problem
from wearsim.evolution.strips import averaged, same_strips
from wearsim.studies.cam.observables import at_every_station, observables_of_track
from wearsim.studies.fatigue.observables import fatigue_history, fatigue_record
from wearsim.studies.run.schema import ALL_VARIABLES, ESTIMATED
from wearsim.studies.schedule import Due, RecordSchedule, due_records, state_at, states_at
from wearsim.types import FloatArray, Grid

#: means and sums over a turn of a cam
_OF_TURN = {
    *("roller_depth", "roller_worn_volume", "dissipated_energy", "power", "normal_force"),
    *("descent", "elastic_approach"),
}
ERRORS = "depth_error", "volume_error", "profile_error"
Variables = dict[str, FloatArray]
_WITHOUT_REALISATION = {n for n, item in ALL_VARIABLES.items() if "realisation" not in item.dims}
MOST_WAITING = 200_000  # strips of all contacts of the states that wait to be observed
#: what observables do not depend on
_NOT_OBSERVED = dict.fromkeys(
    (
        *("coarse_step_solution", "half_quadrature_solution", "wear_exponents", "past_wear"),
        *("whole_steps", "past_sums", "past_feedback", "stepping_error"),
    )
)


@dataclass(frozen=True)
class Started:
    """Start of a run, or its continuation from `from_passes`."""

    total_passes: float
    total_time: float
    from_passes: float
    stepper: str
    model: str


@dataclass(frozen=True)
class Stepped:
    """An accepted step; SI units, `depth` and `depth_error` of the cylinder."""

    passes: float
    total_passes: float
    time: float
    depth: float
    step_passes: float
    depth_error: float
    wall_seconds: float


@dataclass(frozen=True)
class Warned:
    """A warning for the user."""

    message: str


@dataclass(frozen=True)
class Checkpointed:
    """A checkpoint in the results file at `passes`."""

    path: str
    passes: float


@dataclass(frozen=True)
class Finished:
    """End of the run."""

    wall_seconds: float


Event: TypeAlias = Started | Stepped | Warned | Checkpointed | Finished


def history_row(
    stepper: Stepper, problem: WearProblem, state: WearState, threshold: float
) -> Variables:
    """Return the observables of every realisation; `threshold` [m] bounds the groove's width."""
    problem, state, loads = present_contacts(stepper, problem, state)
    present = present_problem(problem, state)
    elastic = problem.values_of(state.contacts, "approach") - least_gaps(
        present, present.gap(*state.depths)
    )
    approach = {
        "descent": worn_descents(present, state),
        "elastic_approach": np.where(loads > 0.0, elastic, 0.0),
    }

    simultaneous = errors_of_simultaneous_passes(stepper, problem, state)

    def per_roller(name: str) -> FloatArray:
        return problem.per_roller(problem.values_of(state.contacts, name))

    return {
        "passes": state.passes,
        "time": problem.time(state.passes),
        "depth": depth(problem, state),
        "width": groove_width(problem, state, threshold),
        "worn_volume": volume(problem, state),
        "roller_depth": state.roller_depth[0].max(axis=-1),
        "roller_worn_volume": worn_volume(
            state.roller_depth[0], problem.grid.spacing, problem.kinematics.roller_radius
        ),
        "dissipated_energy": state.energy,
        "power": problem.total_power(problem.values_of(state.contacts, "power")),
        "normal_force": problem.mean_over_turn(problem.per_roller(loads))[0],
        "depth_error_by_steps": state.depth_error + simultaneous[0],
        "volume_error_by_steps": state.volume_error + simultaneous[1],
        "profile_error_by_steps": state.profile_error + simultaneous[2],
        "rejected": state.rejected,
        "solves": state.solves,
        "full_solves": state.full_solves,
        "peak_pressure": peak_pressures(problem, state).max(axis=0),
        **{
            name: problem.mean_over_turn(per_roller(name))[0]
            for name in ("approach", "longitudinal_creepage", "adhesion_fraction")
        },
        **{n: problem.mean_over_turn(problem.per_roller(v))[0] for n, v in approach.items()},
        **observables_of_track(problem).history(state),
        **fatigue_history(problem, state),
    }


class History:
    """Observables of a single test at its start and after each of its steps.

    Where the contacts of a state carry the present loads, nothing is solved for its observables.
    They are then computed together with later states, as realisations of one problem.

    Parameters
    ----------
    stepper : Stepper
    threshold : float
        Depth that bounds the groove's width [m].
    columns : mapping of str to ndarray
        Observables of an earlier part of the test, first axis step.
    """

    def __init__(self, stepper: Stepper, threshold: float, columns: Variables) -> None:
        self._stepper, self._threshold = stepper, threshold
        #: parts of the history, first axis step, and states after them that wait to be observed:
        #: problem, state, and passes of the step before it
        self._parts: tuple[list[Variables], list[Any]] = [columns] if columns else [], []

    def __len__(self) -> int:
        computed, waiting = self._parts
        count = len(waiting)
        for columns in computed:
            count += columns["passes"].shape[0]
        return count

    def add(self, problem: WearProblem, state: WearState, before: WearState) -> None:
        """Add a state after a step from the state `before`, at the start of the test itself."""
        step, waiting = state.passes - before.passes, self._parts[1]
        waits = _carries_loads(self._stepper, problem, state)
        full = waiting and (waiting[0][0] is not problem or _is_full(state, len(waiting)))
        if full or (waiting and not waits):
            self.compute()
        if waits:
            self._parts[1].append((problem, state.replaced(**_NOT_OBSERVED), step))
        else:
            self._parts[0].append(self._observed(problem, state, step))

    def compute(self) -> Variables:
        """Return the history, first axis step; an interrupt leaves it as it is or computed."""
        computed, waiting = self._parts
        if waiting:
            problems, states, steps = zip(*waiting, strict=True)
            several = problems[0].at(np.zeros(len(waiting), dtype=np.int64))
            state, step = joined_states(states), np.concatenate(steps)
            computed = [*computed, self._observed(several, state, step)]
        if len(computed) > 1:
            computed = [{n: np.concatenate([part[n] for part in computed]) for n in computed[0]}]
        self._parts = computed, []
        return computed[0] if computed else {}

    def _observed(self, problem: WearProblem, state: WearState, step: FloatArray) -> Variables:
        return _with_tests_first(
            history_row(self._stepper, problem, state, self._threshold) | {"step_passes": step}
        )

    def shorten(self, count: int) -> None:
        """Keep the first rows only."""
        waiting = self._parts[1]
        del waiting[max(count + len(waiting) - len(self), 0) :]
        if len(self) > count:
            self._parts = [{n: v[:count] for n, v in self.compute().items()}], []


def _carries_loads(stepper: Stepper, problem: WearProblem, state: WearState) -> bool:
    """Return whether nothing is solved for the observables: the end of a step at constant load."""
    plain = not (problem.terms or problem.pauses or problem.has_nodes)
    track = problem.kinematics.track
    # the round-off of products of matrices depends on the number of realisations
    plain &= track.recorded is None and not track.inertia.size and not problem.varies
    return plain and state.past_spans is not None and not stepper.pass_by_pass


def _is_full(state: WearState, waiting: int) -> bool:
    """Return whether as many states wait as are observed together."""
    return (waiting + 1) * state.contacts.line_load.size > MOST_WAITING


def _with_tests_first(row: Variables) -> Variables:
    """Return values of several realisations in the form of the results file, one after another."""
    tests = {}
    for name, values in row.items():
        along_y = ALL_VARIABLES[name].dims[-1] == "y"
        axes = [*range(values.ndim)]
        tests[name] = values.transpose(axes.pop(-2 if along_y else -1), *axes)
        if name not in _WITHOUT_REALISATION:
            tests[name] = tests[name][..., None, :] if along_y else tests[name][..., None]
    return tests


def record_row(stepper: Stepper, problem: WearProblem, state: WearState) -> Variables:
    """Return the profiles of a state and the contacts at the present loads."""
    problem, state, _ = present_contacts(stepper, problem, state)
    return {
        "record_passes": state.passes,
        "record_time": problem.time(state.passes),
        "cylinder_depth_profile": at_every_station(problem, state.cylinder_depth[:, 0]),
        "roller_depth_profile": state.roller_depth[0],
        **{
            name: at_every_station(
                problem, problem.per_roller(problem.values_of(state.contacts, name))
            )
            for name in ("line_load", "half_length", "dissipation")
        },
        **observables_of_track(problem).record(state),
        **fatigue_record(problem, state),
    }


class Recorder:
    """History and records of a run, always consistent with a whole number of steps.

    Parameters
    ----------
    problem : WearProblem
    stepper : Stepper
        Takes the side steps to records within a step.
    schedule : RecordSchedule
    threshold : float
        Depth that bounds the groove's width [m].
    state : WearState
        The current state.
    history, records : mapping of str to ndarray, optional
        Those of an earlier part of the run; without them `state` is recorded first.
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
        self.stepper, self.schedule, self.threshold = stepper, schedule, threshold
        self._multiplicity = problem.kinematics.multiplicity
        self._by_energy = problem.linear_wear and bool(problem.wear_coefficients.any())
        sums = {
            *(name for error in ERRORS for name in (error, f"{error}_by_strips")),
            *(f"{name}_error" for name in ESTIMATED),
        }
        steps = {name: column for name, column in (history or {}).items() if name not in sums}
        self._history = History(stepper, threshold, steps)
        if not steps:
            self._history.add(problem, state, state)
        #: errors of the finished test due to its strips, see `strip_errors.strip_errors`
        self.strip_errors: FloatArray | None = None
        #: errors of observables of the finished test, see `observed_errors`
        self.observed_errors: Mapping[str, FloatArray] = {}
        first = records or _with_tests_first(record_row(stepper, problem, state))
        #: strips and row of each record, and after them those that wait: problem, state and passes
        self._records: list[Any] = [(problem.grid, row) for row in _rows(first)]
        self._kept = len(self._history), len(self._records), state, problem.grid

    def add(self, advance: Advance, stop: float) -> None:
        """Add a step to the history, and record the states due within it or at its end."""
        stepper, (before, *_, end) = self.stepper, advance.path
        for due in due_records(advance, self.schedule, stop, stepper.pass_by_pass):
            self._record(advance, due)
        self._history.add(advance.problem, end, before)
        # a single assignment: an interrupt before it leaves the previous step current
        self._kept = len(self._history), len(self._records), end, advance.problem.grid
        if (passes := float(end.passes[0])) > self.schedule.base:  # the test has been prolonged
            self._thin(passes)

    def end_at(self, advance: Advance, state: WearState, stop: float) -> None:
        """Record a state within a step as the end of the run, which resumes from the step's start.

        Parameters
        ----------
        advance : Advance
            The step, of a single test.
        state : WearState
            State of the test at its end.
        stop : float
            Passes at the end of the test without this stop.
        """
        stepper, start = self.stepper, advance.path[0]
        for due in due_records(advance, self.schedule, stop, stepper.pass_by_pass):
            if due[2] < state.passes[0]:
                self._record(advance, due)
        self._compute_records()
        self._records.append(self._row(advance.problem, advance.problem, state))
        self._history.add(advance.problem, state, start)
        self._kept = len(self._history), len(self._records), start, advance.problem.grid

    def _record(self, advance: Advance, due: Due) -> None:
        """Add a record; several side steps at constant load are taken together."""
        source, _, passes = due
        problem, state = advance.problem, advance.path[source]
        waiting = self._waiting
        if waiting and (waiting[0][0] is not problem or _is_full(state, len(waiting))):
            self._compute_records()
        if _carries_loads(self.stepper, problem, state):
            kept = state.replaced(coarse_step_solution=None, half_quadrature_solution=None)
            self._records.append((problem, kept, passes))
        else:
            self._compute_records()
            self._records.append(self._row(problem, *states_at(self.stepper, advance, [due])))

    @property
    def _waiting(self) -> list[tuple[WearProblem, WearState, float]]:
        return [record for record in self._records if record[2:]]

    def _row(
        self, problem: WearProblem, recorded: WearProblem, state: WearState
    ) -> tuple[Grid, Variables]:
        (row,) = _rows(_with_tests_first(record_row(self.stepper, recorded, state)))
        return problem.grid, row

    def _compute_records(self) -> list[tuple[Grid, Variables]]:
        """Return all records, computed; an interrupt leaves them as they are or computed."""
        if waiting := self._waiting:
            stepper, problem = self.stepper, waiting[0][0]
            starts, passes = (
                [record[1] for record in waiting],
                np.array([record[2] for record in waiting]),
            )
            several = problem.at(np.zeros(len(waiting), dtype=np.int64))
            try:
                state = state_at(stepper, several, joined_states(starts), passes)
            except (StepError, ContactError):  # a step that fails is halved for a single test
                singles = zip(starts, passes[:, None], strict=True)
                state = joined_states([state_at(stepper, problem, *record) for record in singles])
            contents = _with_tests_first(record_row(stepper, several, state))
            self._records[-len(waiting) :] = [(problem.grid, row) for row in _rows(contents)]
        return self._records

    def _thin(self, passes: float) -> None:
        """Drop the records that a prolonged test does not keep after some passes."""
        schedule = self.schedule
        if schedule.interval_at(passes) > schedule.interval:
            self._records = [
                (grid, row)
                for grid, row in self._compute_records()
                if schedule.is_kept(float(row["record_passes"]), passes)
            ]
            # an interrupt before this leaves a number beyond the end, and no row is unfinished
            self._kept = (self._kept[0], len(self._records), *self._kept[2:])

    def drop_unfinished(self) -> None:
        """Remove the rows of an interrupted `add`, and records whose side steps fail."""
        self._history.shorten(self._kept[0])
        del self._records[self._kept[1] :]
        try:
            self._compute_records()
        except SolverError:
            del self._records[-len(self._waiting) :]

    @property
    def state(self) -> WearState:
        """The state after the last step that was added."""
        return self._kept[2]

    @property
    def grid(self) -> Grid:
        """Strips of the state and of all records."""
        return self._kept[3]

    @property
    def history(self) -> dict[str, FloatArray]:
        """The history as arrays, first axis step.

        Errors are sums of those due to steps, to the stations of a cam and, where they are known,
        to strips.
        """
        columns = dict(self._history.compute())
        unknown = np.full((len(ERRORS), len(self._history)), np.nan)
        by_strips = unknown if self.strip_errors is None else self.strip_errors
        for name, part in zip(ERRORS, by_strips, strict=True):
            by_steps = columns[f"{name}_by_steps"]
            columns[f"{name}_by_strips"] = np.broadcast_to(part[:, None], by_steps.shape).copy()
            columns[name] = (
                by_steps + np.nan_to_num(part)[:, None] + columns.get(f"{name}_by_stations", 0.0)
            )
        of_turn = np.zeros(len(self._history))
        if "volume_error_by_stations" in columns:
            of_turn = self._of_volume(columns, "volume_error_by_stations")
        for name in self.observed:
            by_stations = np.nan_to_num(columns.get(f"{name}_error_by_stations", 0.0))
            if name in _OF_TURN:
                by_stations = np.abs(columns[name]) * of_turn.reshape(
                    -1, *(1,) * (columns[name].ndim - 1)
                )
            known = self.observed_errors.get(name, np.full_like(columns[name], np.nan))
            error = known + by_stations + columns.get(f"{name}_error_by_steps", 0.0)
            columns[f"{name}_error"] = np.minimum(error, np.pi) if name.endswith("angle") else error
        if self._by_energy and self.observed_errors:  # the volume is proportional to the energy
            columns["dissipated_energy_error"] = (
                columns["dissipated_energy"] * self._of_volume(columns, "volume_error")[:, None]
            )
        return columns

    def _of_volume(self, columns: Mapping[str, FloatArray], name: str) -> FloatArray:
        """Return an error of the volume worn off both bodies over that volume, (steps,)."""
        rollers = columns["roller_worn_volume"][..., 0] @ self._multiplicity
        total = columns["worn_volume"][:, 0] + rollers
        return np.asarray(columns[name][:, 0] / np.where(total > 0.0, total, np.inf))

    @property
    def observed(self) -> dict[str, FloatArray]:
        """The observables that have an estimated error besides depth and volume."""
        columns = self._history.compute()
        return {name: columns[name] for name in ESTIMATED if name in columns}

    def column(self, name: str) -> FloatArray:
        """Return a variable of the history except errors, first axis step."""
        return self._history.compute()[name]

    @property
    def last_record(self) -> Variables:
        """The last record, on the present strips."""
        grid, row = self._compute_records()[-1]
        return _on_grid(row, grid, self.grid)

    @property
    def records(self) -> dict[str, FloatArray]:
        """The records as arrays, first axis record.

        Those made before the strips have grown are averages over the present strips.
        """
        rows = [_on_grid(row, grid, self.grid) for grid, row in self._compute_records()]
        return {name: np.array([row[name] for row in rows]) for name in rows[0]}


def _on_grid(row: Variables, old: Grid, new: Grid) -> Variables:
    """Return a record on the strips of a later one."""
    if old is new or same_strips(old, new):
        return row
    along = {name for name in row if ALL_VARIABLES[name].dims[-1:] == ("y",)}
    return {n: averaged(v, old, new) if n in along else v for n, v in row.items()}


def _rows(columns: Mapping[str, FloatArray]) -> list[Variables]:
    """Return the rows of columns."""
    count = len(next(iter(columns.values())))
    return [{name: column[k] for name, column in columns.items()} for k in range(count)]

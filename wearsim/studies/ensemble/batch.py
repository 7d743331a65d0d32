"""Wear tests of an ensemble's realisations, joined and stepped in batches where possible."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from itertools import pairwise
from typing import TypeVar

import numpy as np

from wearsim.errors import StepError
from wearsim.evolution.contacts import fresh_state
from wearsim.evolution.error_estimates import greatest_depth
from wearsim.evolution.integrate import Advance, Evolution, bisect_failures
from wearsim.evolution.observables import errors_before_strips
from wearsim.evolution.observed_errors import observed_errors
from wearsim.evolution.problem import WearProblem
from wearsim.evolution.quantities import ContactInputs, sum_in_order
from wearsim.evolution.state import WearState
from wearsim.evolution.steppers.base import Stepper
from wearsim.evolution.steppers.implicit import ImplicitStepper
from wearsim.evolution.strip_errors import (
    Course,
    Observe,
    add_step,
    coarse_courses,
    strip_errors,
)
from wearsim.mechanics.numerics.piecewise_linear import Paths
from wearsim.plugins import BODIES
from wearsim.scenario import Scenario
from wearsim.studies.cam.observables import observables_of_track
from wearsim.studies.ensemble.batch_sizes import MOST_IN_BATCH
from wearsim.studies.failures import too_deep_failure
from wearsim.studies.fatigue.observables import fatigue_curves
from wearsim.studies.run.assemble import coarse_stepper
from wearsim.studies.run.recorder import history_row
from wearsim.studies.run.setup import Setup
from wearsim.studies.schedule import Due, RecordSchedule, due_records, states_at
from wearsim.types import FloatArray, Grid, IntArray

_RADII = ("cylinder_radius", "roller_radius", "rolling_speed")
_ARRAYS = ("from_apex", "roller", "weight", "roller_drop", "slip_profile")
MAX_STRIPS = 50_000  # strips of all contacts of a batch; about 100 arrays of this size are in use
SCALARS = ("depth_error", "volume_error", "steps", "solves")
Observables = dict[str, float]
T = TypeVar("T")


def can_step_together(problem: WearProblem, stepper: Stepper) -> bool:
    """Return whether a test can be stepped together with `compatible` ones.

    Tests with load terms, a bearing torque on a cylinder, inputs drawn at every pass, or a wear law
    that is not linear in the dissipation are stepped one at a time, as are those of other steppers,
    whose steps differ between tests in more than length.
    """
    return (
        isinstance(stepper, ImplicitStepper)
        and all(problem.wear_factors[body] is not None for body in BODIES)
        and not (problem.terms or problem.has_nodes)
        and not (problem.free and problem.shape[0] == 1)
        and problem.shape[2] == 1
    )


def compatible(one: WearProblem, other: WearProblem) -> bool:
    """Return whether two tests that can be stepped together can be joined in one problem.

    They share grid, model, kinematics and the arrays that do not depend on the realisation; the
    stations of a cam have the same angles.
    """
    first, second = one.kinematics, other.kinematics
    arrays = [(getattr(one, name), getattr(other, name)) for name in _ARRAYS]
    varying = [[(item.name, item.rollers) for item in problem.varying] for problem in (one, other)]
    paths = [[item.paths for item in problem.varying] for problem in (one, other)]
    return (
        one.grid is other.grid
        and one.model is other.model
        and one.tilt_shifts == other.tilt_shifts
        and one.iteration_tolerance == other.iteration_tolerance
        and np.array_equal(first.multiplicity, second.multiplicity)
        and all(a is b if a is None or b is None else np.array_equal(a, b) for a, b in arrays)
        and all(getattr(first, name) == getattr(second, name) for name in _RADII)
        and first.track.matches(second.track)
        and varying[0] == varying[1]
        and all(np.array_equal(a.time, b.time) for a, b in zip(*paths, strict=True))
        and (one.constant_load is None) == (other.constant_load is None)
        and [item.most for item in one.growth] == [item.most for item in other.growth]
    )


def joined_problem(problems: Sequence[WearProblem]) -> WearProblem:
    """Return one problem with the realisations of the given problems, all compatible."""
    columns = (
        np.concatenate([getattr(problem.inputs, item.name) for problem in problems], axis=1)
        for item in fields(ContactInputs)
    )
    return replace(
        problems[0],
        kinematics=problems[0].kinematics.joined([problem.kinematics for problem in problems]),
        laws=tuple(law for problem in problems for law in problem.laws),
        loads=tuple(load for problem in problems for load in problem.loads),
        flat_gap=np.concatenate([problem.flat_gap for problem in problems], axis=2),
        inputs=ContactInputs(*columns),
        growth=tuple(item for problem in problems for item in problem.growth),
        varying=tuple(
            replace(items[0], paths=Paths.joined([item.paths for item in items]))
            for items in zip(*(problem.varying for problem in problems), strict=True)
        ),
    )


@dataclass(frozen=True)
class RealisationRun:
    """The wear test of one realisation, ready to be stepped.

    Parameters
    ----------
    number : int
    drawn : mapping of str to float or ndarray
        Values of the random inputs by the scenario's key [SI].
    setup : Setup
    problem : WearProblem
    stepper : Stepper
    """

    number: int
    drawn: Mapping[str, float | FloatArray]
    setup: Setup
    problem: WearProblem
    stepper: Stepper

    @property
    def scenario(self) -> Scenario:
        """Scenario with the drawn values."""
        return self.setup.scenario

    @property
    def stop(self) -> float:
        """Passes at the end of the test."""
        return float(self.scenario.total_passes)

    @property
    def schedule(self) -> RecordSchedule:
        """Schedule of the records."""
        return RecordSchedule.of(self.scenario, self.stop)

    @property
    def can_be_batched(self) -> bool:
        """Whether the test can be stepped in a batch."""
        return can_step_together(self.problem, self.stepper)

    def can_join(self, other: RealisationRun) -> bool:
        """Return whether two tests that can be batched can be in one batch."""
        settings = [
            (run.stop, run.schedule, scenario.outputs.width_threshold, scenario.evolution)
            for run in (self, other)
            for scenario in (run.scenario,)
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
    curves : dict of str to ndarray
        At the end: "depth_profile", the worn depth of the cylinder or of a cam where it is
        deepest, shape (strips,) [m], and of a cam "lift_error_curve", shape (angles,) [m]; with
        fatigue those of `fatigue_curves`.
    grid : Grid
        Strips at the end.
    failure : StepError, optional
        Why the test ended where it became too deep; it then has no curves, and the later rows are
        nan.
    """

    rows: list[Observables]
    scalars: dict[str, float]
    curves: dict[str, FloatArray]
    grid: Grid
    failure: StepError | None = None


def batch_groups(runs: Sequence[RealisationRun]) -> list[list[RealisationRun]]:
    """Return the tests in groups that can be stepped in one batch, or of one test each."""
    groups: list[list[RealisationRun]] = []
    for run in runs:
        for group in groups if run.can_be_batched else []:
            if group[0].can_be_batched and run.can_join(group[0]):
                group.append(run)
                break
        else:
            groups.append([run])
    return [part for group in groups for part in _parts(group)]


def _parts(group: list[RealisationRun]) -> list[list[RealisationRun]]:
    """Divide tests that can be joined into batches of almost equal sizes."""
    problem = group[0].problem
    of_one = problem.contacts_each * problem.grid.strips
    limit = min(MOST_IN_BATCH, max(1, MAX_STRIPS // of_one))
    count = math.ceil(len(group) / limit)
    ends = [len(group) * part // count for part in range(count + 1)]
    return [group[start:end] for start, end in pairwise(ends)]


def observables_of(
    stepper: Stepper, problem: WearProblem, state: WearState, threshold: float
) -> list[Observables]:
    """Return the observables of every realisation of a state."""
    row = history_row(stepper, problem, state, threshold)
    count = problem.kinematics.multiplicity[:, None]
    energy, time = row["dissipated_energy"], row["time"]
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
        **observables_of_track(problem).of_ensemble(state, row),
    }
    if "damage" in row:
        columns |= {name: row[name] for name in ("damage", "pitting", "cylinder_damage")}
        columns["roller_damage"] = row["roller_damage"].max(axis=0)
    return [
        {name: float(column[v]) for name, column in columns.items()}
        for v in range(problem.shape[2])
    ]


def curves_at_end(
    problem: WearProblem, state: WearState, scenarios: Sequence[Scenario]
) -> list[dict[str, FloatArray]]:
    """Return the curves of `RunObservations` of every realisation of a state.

    Parameters
    ----------
    problem : WearProblem
    state : WearState
    scenarios : sequence of Scenario
        Scenario of each realisation.
    """
    curves = observables_of_track(problem).curves(state, scenarios)
    return [a | b for a, b in zip(fatigue_curves(problem, state), curves, strict=True)]


def scalars_of(stepper: Stepper, problem: WearProblem, state: WearState) -> list[dict[str, float]]:
    """Return the scalars of each realisation of a state by the names of `SCALARS`."""
    columns = {name: np.array(getattr(state, name), dtype=float) for name in SCALARS}
    errors = errors_before_strips(stepper, problem, state)
    columns["depth_error"], columns["volume_error"] = errors
    rows = zip(*(values.tolist() for values in columns.values()), strict=True)
    return [dict(zip(columns, row, strict=True)) for row in rows]


def in_group(
    step: Callable[[Sequence[RealisationRun]], list[T | Exception]],
    runs: Sequence[RealisationRun],
) -> list[T | Exception]:
    """Step through the tests of a group together; return the result or the error of each."""

    def part(places: IntArray) -> list[T | Exception]:
        return step([runs[place] for place in places])

    done, failed = bisect_failures(part, np.arange(len(runs)))
    results: dict[int, T | Exception] = dict(failed)
    for places, values in done:
        results.update(zip(places.tolist(), values, strict=True))
    return [results[place] for place in range(len(runs))]


def observe(runs: Sequence[RealisationRun]) -> list[RunObservations | Exception]:
    """Step through the tests of a group together; return the results or the error of each."""
    return in_group(_observed, runs)


def _observed(runs: Sequence[RealisationRun]) -> list[RunObservations | Exception]:
    """Step through tests together; an error outside of steps and records ends all of them."""
    stepper, stop, schedule = runs[0].stepper, runs[0].stop, runs[0].schedule
    scenario, problem = runs[0].scenario, joined_problem([run.problem for run in runs])
    threshold, steps = scenario.outputs.width_threshold, scenario.evolution.max_steps
    state = fresh_state(problem)
    tests = Evolution(problem, state, stepper, stop, steps, schedule.next_record)
    rows = [[row] for row in observables_of(stepper, problem, state, threshold)]
    results: dict[int, RunObservations | Exception] = {}
    with_courses = scenario.evolution.strip_error
    courses = [Course() for _ in runs]
    records = len(schedule.all_records(stop, stepper.pass_by_pass))
    for advance in tests:
        if with_courses:
            add_step(courses, advance)
        due = due_records(advance, schedule, stop, stepper.pass_by_pass)
        for part in [due] if runs[0].can_be_batched else [[record] for record in due]:
            tests.fail(_record(stepper, advance, part, threshold, rows))
        end, deep = advance.end, too_deep_tests(advance, scenario)
        for number, failure in deep.items():
            missing = [dict.fromkeys(rows[number][0], math.nan)] * (records - len(rows[number]))
            results[number] = RunObservations(
                rows[number] + missing, {}, {}, advance.problem.grid, failure
            )
        tests.end(deep)
        going = [number not in deep for number in advance.numbers.tolist()]
        over = np.flatnonzero((end.passes >= stop) & going)
        numbers = advance.numbers[over].tolist()
        if numbers:
            last = advance.problem.at(over), end.at(over)
            curves = curves_at_end(*last, [runs[number].scenario for number in numbers])
            for number, scalars, curve in zip(
                numbers, scalars_of(stepper, *last), curves, strict=True
            ):
                results[number] = RunObservations(rows[number], scalars, curve, last[0].grid)
    add_strip_errors(runs, problem, courses, results)
    results |= tests.failures
    return [results[number] for number in range(len(runs))]


def add_strip_errors(
    runs: Sequence[RealisationRun],
    problem: WearProblem,
    courses: Sequence[Course],
    results: Mapping[int, RunObservations | Exception],
    observe: Observe | None = None,
) -> dict[int, tuple[FloatArray, dict[str, FloatArray]]]:
    """Add the errors due to the strips to the results, by the same tests on coarse strips.

    Parameters
    ----------
    runs : sequence of RealisationRun
    problem : WearProblem
        Of all tests, on the strips with which they start.
    courses : sequence of Course
        Of each test.
    results : mapping of int to RunObservations or Exception
    observe : callable, optional
        Returns the observables that the courses have.

    Returns
    -------
    dict of int to tuple
        By number the added errors of depth [m], volume [m^3] and profile, shape (3,), and those
        of the observables by steps and strips at the end; none where they are not estimated.
    """
    stepper = coarse_stepper(runs[0].setup, problem)
    ended = [
        number
        for number, course in enumerate(courses)
        if course.passes
        and isinstance(result := results.get(number), RunObservations)
        and result.failure is None
    ]
    if stepper is None or not ended:
        return {}
    places, steps = np.array(ended), runs[0].scenario.evolution.max_steps
    needed = np.array([courses[number].passes[-1] for number in ended])
    added: dict[int, tuple[FloatArray, dict[str, FloatArray]]] = {}
    coarse = coarse_courses(problem.at(places), stepper, runs[0].stop, needed, steps, observe)
    for number, other in zip(ended, coarse, strict=True):
        course, result = courses[number], results[number]
        passes, sizes = np.array(course.passes), np.array(course.sizes).T
        by_strips = strip_errors(other, passes, sizes, course)
        errors = by_strips[:, -1]
        if isinstance(result, RunObservations) and np.isfinite(errors).all():
            stated = observed_errors(
                other,
                np.append(0.0, passes),
                {name: np.array(values) for name, values in course.observed.items()},
                np.pad(sizes, ((0, 0), (1, 0))),  # 0 at the start
                np.pad(by_strips, ((0, 0), (1, 0))),
                free=problem.free,
                cam=problem.shape[0] > 1,
            )
            added[number] = errors, {name: values[-1] for name, values in stated.items()}
            result.scalars["depth_error"] += float(errors[0])
            result.scalars["volume_error"] += float(errors[1])
    return added


def too_deep_tests(advance: Advance, scenario: Scenario, less: str = "") -> dict[int, StepError]:
    """Return the failures of tests that a step wears beyond the validity of the models, by number.

    Parameters
    ----------
    advance : Advance
        The step.
    scenario : Scenario
        Of any of the tests.
    less : str
        As in `too_deep_failure`.
    """
    depths = zip(
        advance.numbers.tolist(),
        greatest_depth(advance.end.depths).tolist(),
        advance.end.passes.tolist(),
        strict=True,
    )
    failures = {n: too_deep_failure(scenario, depth, passes, less) for n, depth, passes in depths}
    return {number: failure for number, failure in failures.items() if failure}


def _record(
    stepper: Stepper,
    advance: Advance,
    due: Sequence[Due],
    threshold: float,
    rows: list[list[Observables]],
) -> dict[int, Exception]:
    """Append the observables at records to the rows of their tests; return errors by test."""

    def observed(chosen: IntArray) -> list[Observables]:
        return observables_of(
            stepper, *states_at(stepper, advance, [due[number] for number in chosen]), threshold
        )

    done, failed = bisect_failures(observed, np.arange(len(due))) if due else ([], {})
    numbers = [int(advance.numbers[place]) for _, place, _ in due]
    for chosen, values in done:
        for number, row in zip(chosen.tolist(), values, strict=True):
            rows[numbers[number]].append(row)
    return {numbers[number]: error for number, error in failed.items()}

"""Tests stepped together until each reaches its first limit."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from wearsim.errors import StepError
from wearsim.evolution.contacts import fresh_state
from wearsim.evolution.error_estimates import greatest_depth
from wearsim.evolution.fatigue import effective_damage
from wearsim.evolution.integrate import Advance, Evolution, bisect_failures
from wearsim.evolution.limits import (
    Crossings,
    Limit,
    damage_of,
    first_crossings,
    ratios,
    take_side_step,
)
from wearsim.evolution.observables import (
    depth,
    errors_before_strips,
    extremes,
    lift_errors,
    peak_pressures,
)
from wearsim.evolution.observed_errors import OF_EDGES, edge_peaks, relative_crown_radius
from wearsim.evolution.problem import WearProblem
from wearsim.evolution.state import WearState
from wearsim.evolution.strip_errors import Course, add_observed, add_step
from wearsim.studies.ensemble.batch import (
    Observables,
    RealisationRun,
    RunObservations,
    add_strip_errors,
    curves_at_end,
    in_group,
    joined_problem,
    observables_of,
    scalars_of,
    too_deep_tests,
)
from wearsim.studies.failures import too_deep_failure
from wearsim.studies.fatigue.lives import course_of
from wearsim.studies.roller_ends import width_between_edges
from wearsim.studies.run.recorder import history_row
from wearsim.types import FloatArray, IntArray

LOCATED = 0.01  # relative error of a quantity at its limit, over the tolerance of the test
FLAT = 0.05  # log-slope below which the numerical error of a life is searched for
_LIMITS = "the limits in [limit]"  # which a test shall reach before it is too deep
_BACK = 0.01  # part of the passes over which the log-slope is taken


@dataclass(frozen=True)
class LifeRun(RunObservations):
    """Test of one realisation up to its first limit.

    There is a row of observables at the start, and one at the limit or the end. Among the scalars
    are the life with its numerical bounds, infinite if the test ends before, the number of the
    limit, and its angle.
    """

    @property
    def reached(self) -> bool:
        """Whether a limit was reached, and its numerical bounds are known."""
        return self.failure is None and all(
            math.isfinite(self.scalars[name]) for name in ("life", "life_high")
        )


@dataclass
class _Test:
    """A test in progress.

    It has its quantities over their limits after each step, its result, the number of its limit,
    the level of that quantity, over the limit, up to which it is followed, the log-slope of the
    limited quantity, and the relative peak of the pressure that the strips do not resolve.
    """

    history: list[tuple[float, FloatArray]] = field(default_factory=list)
    outcome: LifeRun | None = None
    limit: int = -1
    level: float = 1.0
    slope: float = 1.0
    edge_peak: float = 0.0
    damage: list[tuple[float, float]] = field(default_factory=list)


def observe_lives(
    runs: Sequence[RealisationRun], limits: Sequence[Limit]
) -> list[LifeRun | Exception]:
    """Step the tests of a group together to their limits; return the result or error of each."""
    return in_group(lambda part: _Group(part, limits).results(), runs)


class _Group:
    """Tests that are stepped together."""

    def __init__(self, runs: Sequence[RealisationRun], limits: Sequence[Limit]) -> None:
        scenario = runs[0].scenario
        self.runs, self.limits, self.stepper = runs, limits, runs[0].stepper
        self.threshold, self.stop = scenario.outputs.width_threshold, runs[0].stop
        self.located = LOCATED * scenario.evolution.tolerance
        self.problem = joined_problem([run.problem for run in runs])
        self.state = fresh_state(self.problem)
        self.evolution = Evolution(
            self.problem,
            self.state,
            self.stepper,
            self.stop,
            scenario.evolution.max_steps,
            lambda passes: self.stop,
        )
        self.tests = [_Test() for _ in runs]
        self.first_rows = self._observed(self.problem, self.state)
        if self.problem.fatigue and self.state.damage is not None:
            self.first_damage = effective_damage(self.problem, self.state.damage[2]).tolist()

    def results(self) -> list[LifeRun | Exception]:
        """Return the result or the error of each test."""
        start = self._ratios(self.problem, self.state)
        at_once = np.flatnonzero(start.max(axis=0) >= 1.0)
        for number in at_once.tolist():
            self.tests[number].limit = int(start[:, number].argmax())
            life = {"life": 0.0, "life_low": 0.0, "life_high": 0.0}
            self._finish(number, self.problem, self.state, number, life)
        self.evolution.end(at_once.tolist())
        with_courses = self.runs[0].scenario.evolution.strip_error
        courses = [Course() for _ in self.tests]
        add_observed(courses, range(len(courses)), self._by_limit(start))
        for advance in self.evolution:
            relative = self._ratios(advance.problem, advance.end)
            if with_courses:
                add_step(courses, advance)
                add_observed(courses, advance.numbers.tolist(), self._by_limit(relative))
            self._take(advance, relative)
        reached = {k: test.outcome for k, test in enumerate(self.tests) if test.outcome is not None}

        def observe(problem: WearProblem, state: WearState) -> dict[str, FloatArray]:
            return self._by_limit(self._ratios(problem, state))

        for number, (errors, observed) in add_strip_errors(
            self.runs, self.problem, courses, reached, observe
        ).items():
            cylinder, roller, volume = courses[number].sizes[-1].tolist()
            of_sizes = {"depth": errors[0] / max(cylinder, roller), "volume": errors[1] / volume}
            self._widen(number, observed | of_sizes)
        missing = AssertionError("a test has neither ended nor failed")
        failures = self.evolution.failures
        return [failures.get(k) or test.outcome or missing for k, test in enumerate(self.tests)]

    def _by_limit(self, relative: FloatArray) -> dict[str, FloatArray]:
        """Return quantities over their limits, (limits, tests), by the name of the quantity."""
        return {limit.quantity: values for limit, values in zip(self.limits, relative, strict=True)}

    def _take(self, advance: Advance, relative: FloatArray) -> None:
        """Locate the limits that are reached in a step, and end the tests that need no more.

        Parameters
        ----------
        advance : Advance
        relative : ndarray, shape (limits, tests)
            Quantities over their limits at the end of the step.
        """
        numbers = advance.numbers.tolist()
        passes = advance.end.passes.astype(float).tolist()
        for place, number in enumerate(numbers):
            self.tests[number].history.append((passes[place], relative[:, place]))
        if advance.problem.fatigue:
            damages = damage_of(advance.problem, advance.end).tolist()
            for number, *point in zip(numbers, passes, damages, strict=True):
                if self.tests[number].outcome is None:
                    self.tests[number].damage.append((point[0], point[1]))
        # the only state of a path may be known to be below all limits
        reached = (relative.max(axis=0) >= 1.0) | (len(advance.path) > 2)
        open_places = np.array(
            [
                k
                for k, number in enumerate(numbers)
                if self.tests[number].outcome is None and reached[k]
            ],
            dtype=np.int64,
        )

        def locate(chosen: IntArray) -> list[Crossings]:
            return first_crossings(
                self.limits, self.stepper, advance, open_places[chosen], self.located
            )

        # a step without crossings solves nothing
        done, failed = bisect_failures(locate, np.arange(len(open_places)))
        self.evolution.fail({numbers[open_places[k]]: error for k, error in failed.items()})
        for crossing in [crossing for _, crossings in done for crossing in crossings]:
            self._reached(advance, crossing)
        deep = too_deep_tests(advance, self.runs[0].scenario, _LIMITS)
        for place, number in enumerate(numbers):
            if number in deep and self.tests[number].outcome is None:
                self._finish(number, advance.problem, advance.end, place, {}, deep[number])
        self.evolution.end([number for number in numbers if self._is_over(number)])
        for place in np.flatnonzero(advance.end.passes >= self.stop).tolist():
            if self.tests[numbers[place]].outcome is None and numbers[place] not in failed:
                life = dict.fromkeys(("life", "life_low", "life_high"), math.inf)
                self._finish(numbers[place], advance.problem, advance.end, place, life)

    def _reached(self, advance: Advance, crossing: Crossings) -> None:
        """Store the tests that have reached a limit, with the numerical error of their lives."""
        state, problem = crossing.state, crossing.problem
        slope, of_depth = self._slopes(crossing)
        depths = greatest_depth(state.depths)
        by_stations = self._errors_by_stations(problem, state)
        error_of_depth, error_of_volume = errors_before_strips(self.stepper, problem, state)
        depth_error = error_of_depth / np.maximum(depth(problem, state), 1e-300)
        limits = [self.limits[number] for number in crossing.limit.tolist()]
        if any(limit.quantity == "peak pressure" for limit in limits):
            self._store_edge_peaks(advance.numbers[crossing.places].tolist(), problem, state)
        for place, number in enumerate(advance.numbers[crossing.places].tolist()):
            test = self.tests[number]
            test.limit = int(crossing.limit[place])
            limit, passes = limits[place], float(state.passes[place])
            if limit.unit == "m" and limit.quantity != "width":
                error = float(error_of_depth[place]) / limit.value
            elif limit.quantity == "volume":
                error = float(error_of_volume[place]) / limit.value
            else:  # by way of the passes that correspond to the error of the depth
                error = float(depth_error[place] * abs(slope[place]) / max(of_depth[place], FLAT))
            if limit.quantity in {"lift error", "peak pressure"}:
                error += float(by_stations[limit.quantity][place]) / limit.value
            test.slope = float(slope[place])
            if slope[place] >= FLAT:
                part = error / float(slope[place])
                low, high = passes * max(1.0 - part, 0.0), passes * (1.0 + part)
            else:
                low, high = self._crossing_of(test, 1.0 - error, passes), math.inf
                test.level = 1.0 + error
            life = {"life": passes, "life_low": low, "life_high": high}
            scenario, deepest = self.runs[number].scenario, float(depths[place])
            failure = too_deep_failure(scenario, deepest, passes, _LIMITS)
            self._finish(number, problem, state, place, life, failure)

    def _errors_by_stations(self, problem: WearProblem, state: WearState) -> dict[str, FloatArray]:
        """Return the errors due to the stations of a cam by quantity, (tests,) [SI]."""
        extreme_values = extremes(problem, state)
        lift = extreme_values["least_wear"].error + extreme_values["greatest_wear"].error
        errors = {
            "lift error": lift.max(axis=0),
            "peak pressure": extreme_values["peak_pressure"].error.max(axis=0),
        }
        return {name: np.nan_to_num(values) for name, values in errors.items()}

    def _store_edge_peaks(self, numbers: list[int], problem: WearProblem, state: WearState) -> None:
        """Store the peaks of the pressure of each test that its strips do not resolve."""
        row = history_row(self.stepper, problem, state, self.threshold)
        crown, width = relative_crown_radius(problem), width_between_edges(self.runs[0].scenario)
        for place, number in enumerate(numbers):
            observed = {name: row[name][None, ..., place] for name in ("width", *OF_EDGES)}
            radius = None if crown is None else crown[:, place]
            self.tests[number].edge_peak = float(
                edge_peaks(observed, radius, problem.grid.spacing, width).max()
            )

    def _widen(self, number: int, errors: Mapping[str, FloatArray]) -> None:
        """Add errors of quantities over their limits, by quantity, to the bounds of a life."""
        test = self.tests[number]
        if test.outcome is None or test.limit < 0:
            return
        scalars, quantity = test.outcome.scalars, self.limits[test.limit].quantity
        error = float(errors[quantity]) + (test.edge_peak if quantity == "peak pressure" else 0.0)
        added = scalars["life"] * error / max(test.slope, FLAT)
        scalars["life_low"] = max(scalars["life_low"] - added, 0.0)
        scalars["life_high"] += added

    def _is_over(self, number: int) -> bool:
        """Return whether the life of a test and its numerical bounds are known.

        A quantity that is nearly constant at its limit is followed to the limit plus its error.
        """
        test = self.tests[number]
        if test.outcome is None:
            return False
        if test.outcome.failure is not None:
            return True
        passes, relative = test.history[-1]
        scalars = test.outcome.scalars
        if math.isinf(scalars["life_high"]) and float(relative[test.limit]) >= test.level:
            scalars["life_high"] = passes
        return math.isfinite(scalars["life_high"])

    def _crossing_of(self, test: _Test, level: float, before: float) -> float:
        """Return the passes at which a quantity over its limit first reached a level."""
        last = (0.0, 0.0)
        for passes, relative in test.history:
            value = float(relative[test.limit])
            if value >= level:
                part = (level - last[1]) / (value - last[1]) if value > last[1] else 0.0
                return min(last[0] + part * (passes - last[0]), before)
            last = passes, value
        return before

    def _slopes(self, crossing: Crossings) -> tuple[FloatArray, FloatArray]:
        """Return the local log-slope of the limited quantity and of the depth, each (tests,)."""
        state, problem, start = crossing.state, crossing.problem, crossing.start
        back = np.maximum((1.0 - _BACK) * state.passes - start.passes, 0.0)
        earlier, moved = start, np.flatnonzero(back > 0.0)
        if moved.size and not self.stepper.pass_by_pass:
            some = problem.at(moved), start.at(moved), back[moved]
            step = partial(take_side_step, self.stepper.side_step)
            earlier = start.with_others(moved, step(*some))
        tests = np.arange(len(state.passes))
        with np.errstate(divide="ignore", invalid="ignore"):
            span = np.log(state.passes / earlier.passes)
            values = [
                self._ratios(problem, item)[crossing.limit, tests] for item in (state, earlier)
            ]
            depths = [depth(problem, item) for item in (state, earlier)]
            slopes = [np.log(after / before) / span for after, before in (values, depths)]
        # from the start of the test, a depth grows with the passes to the power 2/3
        slope, of_depth = (np.where(np.isfinite(item), item, 2.0 / 3.0) for item in slopes)
        return slope, of_depth

    def _finish(
        self,
        number: int,
        problems: WearProblem,
        states: WearState,
        place: int,
        life: dict[str, float],
        failure: StepError | None = None,
    ) -> None:
        """Store the result of a test that ends in the state of a problem at a place."""
        test, chosen = self.tests[number], np.array([place])
        problem, state = problems.at(chosen), states.at(chosen)
        rows = [self.first_rows[number], *self._observed(problem, state)]
        scalars = {
            **scalars_of(self.stepper, problem, state)[0],
            **life,
            "first_limit": float(test.limit),
            "limit_angle": self._angle(test.limit, problem, state),
        }
        (curves,) = curves_at_end(problem, state, [self.runs[number].scenario])
        if problem.fatigue:
            first, end = self.first_damage[number], float(state.passes[0])
            scalars |= {"damage_per_pass": first, "course_end": end}
            curves["damage_course"] = course_of(
                test.damage, (end, float(damage_of(problem, state)[0])), first
            )
        test.outcome = LifeRun(rows, scalars, curves, problem.grid, failure)

    def _angle(self, limit: int, problem: WearProblem, state: WearState) -> float:
        """Return the angle of a cam at which the limited quantity is greatest [rad], or nan."""
        if limit < 0:
            return math.nan
        if self.limits[limit].quantity == "peak pressure":
            values = peak_pressures(problem, state).max(axis=1)
        elif self.limits[limit].quantity == "lift error":
            values = np.abs(lift_errors(problem, state)).max(axis=1)
        else:
            values = state.cylinder_depth[:, 0].max(axis=-1)
        return float(problem.kinematics.track.greatest(values).angle[0])

    def _ratios(self, problem: WearProblem, state: WearState) -> FloatArray:
        return ratios(self.limits, self.stepper, problem, state)

    def _observed(self, problem: WearProblem, state: WearState) -> list[Observables]:
        return observables_of(self.stepper, problem, state, self.threshold)

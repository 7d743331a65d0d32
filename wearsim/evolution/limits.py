"""Limits at which a wear test stops, and the state at which tests first reach one."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from wearsim.errors import ContactError, StepError
from wearsim.evolution import observables
from wearsim.evolution.fatigue import effective_damage, fatigue_of
from wearsim.evolution.integrate import Advance
from wearsim.evolution.problem import WearProblem
from wearsim.evolution.state import WearState, joined_states
from wearsim.evolution.steppers.base import SMALLEST_STEP, Step, Stepper
from wearsim.quantities import NUMBER, quantity
from wearsim.types import FloatArray, IntArray
from wearsim.units import QuantityError, as_written

_EXAMPLES = (
    '"depth 50 um", "roller depth 5 um", "lift error 30 um", "volume 12 mm^3", "width 14 mm",'
    ' "peak pressure 900 MPa", "clearance 60 um", "damage 1", "12 h",'
    ' "2e6 passes" or "5e5 turns"'
)
_LOCATED = 1e-9  # relative error of the quantity at a limit
_MOST_TRIALS = 100
_POWER = 2.0 / 3.0  # exponent of the passes with which the depth of a fresh contact grows
SAME_VALUE = 1e-6  # relative difference of a value from a limit at which the limit is reached

#: SI unit, and name in the history, by the name of the quantity
_QUANTITIES: dict[str, tuple[str, str]] = {
    "depth": ("m", "depth"),
    "roller depth": ("m", "roller_depth"),
    "lift error": ("m", "lift_error"),
    "volume": ("m^3", "worn_volume"),
    "width": ("m", "width"),
    "peak pressure": ("Pa", "peak_pressure"),
    "clearance": ("m", "descent"),
    "damage": ("1", "damage"),
    "pitting": ("1", "pitting"),
    "time": ("s", "time"),
    "passes": ("1", "passes"),
}
#: quantities that end a life
OF_LIFE = tuple(name for name in _QUANTITIES if name not in {"time", "passes"})
#: functions that return the quantity of each realisation of a state
_VALUES: dict[str, Callable[[WearProblem, WearState], FloatArray]] = {
    "depth": observables.depth,
    "roller depth": observables.roller_depth,
    "lift error": observables.lift_error,
    "volume": observables.volume,
    "clearance": observables.clearance,
    "damage": lambda problem, state: damage_of(problem, state),  # noqa: PLW0108  (defined below)
    "pitting": lambda problem, state: fatigue_of(problem).pitting(damage_of(problem, state)),
    "time": lambda problem, state: problem.time(state.passes),
    "passes": lambda problem, state: state.passes,
}


#: quantities of tests with fatigue
OF_FATIGUE = "damage", "pitting"


def damage_of(problem: WearProblem, state: WearState) -> FloatArray:
    """Return the effective damage of the tests of a state with fatigue, (realisations,)."""
    return effective_damage(problem, np.asarray(state.damage)[0])


@dataclass(frozen=True)
class Limit:
    """Value of a quantity at which a wear test stops.

    Parameters
    ----------
    quantity : str
        Greatest worn depth of the cylinder, "depth", or of a roller, "roller depth" [m]; "lift
        error" of a cam, peak to peak [m]; worn "volume" of the cylinder [m^3]; "width" of the
        groove [m]; "peak pressure" [Pa]; "clearance", the worn descent of a roller [m]; effective
        "damage" by fatigue, and probability of "pitting"; simulated "time" [s]; roller "passes".
    value : float
        The limit, in SI.
    text : str
        The limit as written by the user.
    threshold : float
        Depth that bounds the width of the groove [m].
    """

    quantity: str
    value: float
    text: str
    threshold: float = 1e-6

    @classmethod
    def parse(cls, text: str | float, rollers: int = 1) -> Limit:
        """Return the limit of a text: "depth 50 um", "lift_error 30 um" or "lift_error=30um".

        Parameters
        ----------
        text : str or float
            A number is a time [s].
        rollers : int
            Roller passes in a turn of the cylinder or cam.

        Raises
        ------
        ValueError
            If it cannot be read, or the value is not above zero.
        """
        if not isinstance(text, str):
            text = f"{float(text)!r} s"
        named = re.fullmatch(r"\s*([A-Za-z_ ]+?)\s*=(.*)", text)
        words = f"{named[1]} {named[2]}" if named else text
        words = " ".join(re.sub("(?<=[A-Za-z])_(?=[A-Za-z])", " ", words).split())
        parts = re.fullmatch(r"([A-Za-z ]*?) ?([^A-Za-z ].*)", words)
        kind = parts[1].lower().removeprefix("worn ") if parts else "nothing"
        counted = re.fullmatch(rf"({NUMBER.pattern}) ?(?:roller )?(passes|turns)", words)
        if counted:
            if float(counted[1]) % 1.0:
                raise ValueError(f"'{text}' is not a whole number of {counted[2]}")
            kind, value = "passes", float(counted[1]) * (rollers if counted[2] == "turns" else 1)
        elif parts and kind in {"", *_QUANTITIES} - {"passes"}:
            try:
                value = _value(parts[2], _QUANTITIES[kind or "time"][0])
            except QuantityError as error:
                what = f": {error}" if kind else f", expected one such as {_EXAMPLES}"
                raise ValueError(f"'{text}' is not a limit{what}") from error
            kind = kind or "time"
        else:
            raise ValueError(f"'{text}' is not a limit, expected one such as {_EXAMPLES}")
        if not 0.0 < value < (1.0 if kind == "pitting" else np.inf):
            below = " and below one" if kind == "pitting" else ""
            raise ValueError(f"'{text}' is not a limit: it must be above zero{below}")
        return cls(kind, value, words)

    @property
    def unit(self) -> str:
        """SI unit of the value."""
        return _QUANTITIES[self.quantity][0]

    @property
    def variable(self) -> str:
        """Name of the quantity in the history of a run."""
        return _QUANTITIES[self.quantity][1]

    @property
    def key(self) -> str:
        """Name of the quantity in [limit] of a scenario, "roller_depth"."""
        return self.quantity.replace(" ", "_")

    def values(self, stepper: Stepper, problem: WearProblem, state: WearState) -> FloatArray:
        """Return the quantity of every realisation, shape (realisations,) [SI]."""
        if self.quantity == "width":
            return observables.groove_width(problem, state, self.threshold)
        if self.quantity == "peak pressure":
            return observables.peak_pressure(stepper, problem, state)
        return _VALUES[self.quantity](problem, state)

    def crossing(self, stepper: Stepper, advance: Advance, place: int) -> WearState | None:
        """Return the state of one test of a step where it first reaches the limit.

        Parameters
        ----------
        stepper : Stepper
        advance : Advance
            The step.
        place : int
            Place of the test in the step.

        Returns
        -------
        WearState or None
            With the error estimates of the end of the step; None if the limit is not reached.
        """
        crossings = first_crossings((self,), stepper, advance, np.array([place]))
        return crossings[0].state if crossings else None


def _value(text: str, unit: str) -> float:
    """Return the value of a limit in SI; a plain number has no unit."""
    if unit != "1":
        return quantity(text, unit)
    if not NUMBER.fullmatch(text):
        raise QuantityError("is not a plain number", as_written(text), "a number without unit")
    return float(text)


@dataclass(frozen=True, eq=False)
class Crossings:
    """Tests of a step at the first of their limits.

    Parameters
    ----------
    places : ndarray of int, shape (tests,)
        Places of the tests in the step.
    problem : WearProblem
        Their problem.
    state : WearState
        Their states, with the error estimates of the end of the step.
    limit : ndarray of int, shape (tests,)
        Number of the limit that is reached first.
    start : WearState
        A state of each test within the step, before its limit.
    """

    places: IntArray
    problem: WearProblem
    state: WearState
    limit: IntArray
    start: WearState


def ratios(
    limits: Sequence[Limit], stepper: Stepper, problem: WearProblem, state: WearState
) -> FloatArray:
    """Return each quantity over its limit, shape (limits, realisations)."""
    return np.array([limit.values(stepper, problem, state) / limit.value for limit in limits])


def first_crossings(
    limits: Sequence[Limit],
    stepper: Stepper,
    advance: Advance,
    places: IntArray,
    tolerance: float = _LOCATED,
) -> list[Crossings]:
    """Return the tests of a step that reach a limit, where they first do.

    States are located by side steps from the last state of the step before the limit, so that the
    integration can continue from the step without a change. The states do not depend on the other
    tests of the step.

    Parameters
    ----------
    limits : sequence of Limit
        The first that is reached counts.
    stepper : Stepper
    advance : Advance
        The step.
    places : ndarray of int
        Places of tests in the step that have not reached a limit before it.
    tolerance : float
        Relative error of the quantity at its limit, which is never below the limit.

    Raises
    ------
    StepError, ContactError
        If a side step fails.
    """
    crossings = []
    for before, after in pairwise(advance.path):
        problem, end = advance.problem.at(places), after.at(places)
        reached = ratios(limits, stepper, problem, end).max(axis=0) >= 1.0
        chosen = np.flatnonzero(reached)
        if not chosen.size:
            continue
        start = before.at(places[chosen]).replaced(
            coarse_step_solution=None, half_quadrature_solution=None
        )
        reaching = problem.at(chosen), start, end.at(chosen)
        locate = _first_passes if stepper.pass_by_pass else _between
        state = locate(limits, stepper, *reaching, tolerance)
        last = advance.end.at(places[chosen])
        state = state.replaced(depth_error=last.depth_error, volume_error=last.volume_error)
        first = ratios(limits, stepper, reaching[0], state).argmax(axis=0)
        crossings.append(Crossings(places[chosen], reaching[0], state, first, start))
        places = places[~reached]
        if not places.size:
            break
    return crossings


def _between(
    limits: Sequence[Limit],
    stepper: Stepper,
    problem: WearProblem,
    start: WearState,
    end: WearState,
    tolerance: float,
) -> WearState:
    """Return the states between two of each test at which it reaches a limit.

    The greatest quantity over its limit is located by regula falsi (Illinois) on log scales, with
    a bisection at every fifth trial.
    """
    done, span = start.passes, end.passes - start.passes
    if len(limits) == 1 and limits[0].quantity == "passes":
        located = take_side_step(stepper.side_step, problem, start, limits[0].value - done)
        return located.replaced(passes=np.full_like(done, limits[0].value))

    def trial(places: IntArray, passes: FloatArray) -> tuple[WearState, FloatArray]:
        tests = problem.at(places), start.at(places)
        state = take_side_step(stepper.side_step, *tests, passes)
        return state, _logs(limits, stepper, tests[0], state) - tolerance

    located = end.replaced(coarse_step_solution=None, half_quadrature_solution=None)
    low, high = (_logs(limits, stepper, problem, state) - tolerance for state in (start, end))
    active = np.flatnonzero(high > tolerance)
    before, after = np.zeros_like(span), span.copy()
    for count in range(_MOST_TRIALS):
        if not active.size:
            break
        first, last = (done + before)[active], (done + after)[active]
        known = np.isfinite(low[active]) & (first > 0.0)
        with np.errstate(divide="ignore", invalid="ignore"):
            part = low[active] / (low[active] - high[active])
            guess = np.where(
                known, first * (last / first) ** part, last * np.exp(-high[active] / _POWER)
            )
        margin, halved = 1e-3 * (last - first), count % 5 == 4
        unsure = ~known | halved
        middle = np.where(halved, 0.5 * (first + last), guess)
        guess = np.where(unsure, np.clip(middle, first + margin, last - margin), guess)
        length = guess - done[active]
        state, value = trial(active, length)
        beyond = value > 0.0
        up, down = active[beyond], active[~beyond]
        low[up] *= np.where(after[up] < span[up], 0.5, 1.0)
        high[down] *= np.where(before[down] > 0.0, 0.5, 1.0)
        after[up], high[up] = length[beyond], value[beyond]
        before[down], low[down] = length[~beyond], value[~beyond]
        ready = np.abs(value) <= tolerance
        ready |= beyond & (after - before <= 1e-13 * (done + after))[active]
        if ready.any():
            places = np.flatnonzero(ready)
            located = located.with_others(active[places], state.at(places))
        active = active[~ready]
    if active.size:
        raise StepError(f"a limit was not located after pass {done[active[0]]:.0f}")
    return located


def _logs(
    limits: Sequence[Limit], stepper: Stepper, problem: WearProblem, state: WearState
) -> FloatArray:
    with np.errstate(divide="ignore"):
        return np.asarray(np.log(ratios(limits, stepper, problem, state).max(axis=0)))


def _first_passes(
    limits: Sequence[Limit],
    stepper: Stepper,
    problem: WearProblem,
    start: WearState,
    end: WearState,
    tolerance: float,
) -> WearState:
    """Return the states after the first pass of each test that reaches a limit."""
    states = []
    for place in range(len(start.passes)):
        chosen = np.array([place])
        single, first, last = problem.at(chosen), start.at(chosen), end.at(chosen)
        while last.passes[0] - first.passes[0] > 1.0:
            half = np.array([float((last.passes[0] - first.passes[0]) // 2)])
            middle = stepper.side_step(single, first, half)
            if _logs(limits, stepper, single, middle)[0] >= 0.0:
                last = middle
            else:
                first = middle
        states.append(last)
    return joined_states(states)


def take_side_step(
    step: Step, problem: WearProblem, state: WearState, passes: FloatArray
) -> WearState:
    """Return the state `passes` later by one side step, or by halves if that step fails.

    A profile interpolated between two steps would not fit its contact. The run does not continue
    from a side step.

    Parameters
    ----------
    step : callable
        Takes a problem, a state and a number of passes to the state after them.
    problem : WearProblem
    state : WearState
    passes : ndarray, shape (realisations,)
        Halved only for a single test, whose result must not depend on others in its batch.

    Raises
    ------
    StepError, ContactError
        If halves would be too short.
    """
    try:
        return step(problem, state, passes)
    except (StepError, ContactError):
        half = 0.5 * passes
        if len(half) > 1 or half[0] < SMALLEST_STEP:
            raise
    return take_side_step(step, problem, take_side_step(step, problem, state, half), half)

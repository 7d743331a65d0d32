"""Limits at which a wear test stops, and the state at which a test first reaches one."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from wearsim.errors import ContactError, StepError
from wearsim.evolution.integrate import Advance
from wearsim.evolution.problem import WearProblem
from wearsim.evolution.quantities import mean_along, worn_volume
from wearsim.evolution.state import WearState
from wearsim.evolution.steppers.base import SMALLEST_STEP, Step, Stepper
from wearsim.quantities import NUMBER, quantity
from wearsim.types import FloatArray
from wearsim.units import QuantityError

_EXAMPLES = '"depth 50 um", "roller depth 5 um", "volume 12 mm^3", "12 h" or "2e6 passes"'
_LOCATED = 1e-9  # error of the passes at a limit, relative to the passes
SAME_VALUE = 1e-6  # relative difference of a value from a limit at which the limit is reached


def _depth(problem: WearProblem, state: WearState) -> FloatArray:
    return np.asarray(state.cylinder_depth.max(axis=(0, 1, 3)))


def _roller_depth(problem: WearProblem, state: WearState) -> FloatArray:
    return np.asarray(state.roller_depth.max(axis=(0, 1, 3)))


def _volume(problem: WearProblem, state: WearState) -> FloatArray:
    radius, spacing = problem.kinematics.track_radius, problem.grid.spacing
    volumes = worn_volume(state.cylinder_depth, spacing, radius)
    return np.asarray(mean_along(volumes, axis=0)[0, 0])


#: unit, name in the history, and value of a state by the name of the quantity
_QUANTITIES: dict[str, tuple[str, str, Callable[[WearProblem, WearState], FloatArray]]] = {
    "depth": ("m", "depth", _depth),
    "roller depth": ("m", "roller_depth", _roller_depth),
    "volume": ("m^3", "worn_volume", _volume),
    "time": ("s", "time", lambda problem, state: problem.time(state.passes)),
    "passes": ("1", "passes", lambda problem, state: state.passes),
}


@dataclass(frozen=True)
class Limit:
    """Value of a quantity at which a wear test stops.

    Parameters
    ----------
    quantity : {"depth", "roller depth", "volume", "time", "passes"}
        Greatest worn depth of the cylinder or of a roller [m], worn volume of the cylinder [m^3],
        simulated time [s] or roller passes; none of them decreases during a test.
    value : float
        The limit, in SI.
    text : str
        The limit as written by the user.
    """

    quantity: str
    value: float
    text: str

    @classmethod
    def parse(cls, text: str | float) -> Limit:
        """Return the limit of a text such as "depth 50 um"; a number is a time [s].

        Raises
        ------
        ValueError
            If it cannot be read, or the value is not above zero.
        """
        if not isinstance(text, str):
            text = f"{float(text)!r} s"
        words = " ".join(text.split())
        parts = re.fullmatch(r"([A-Za-z ]*?) ?([^A-Za-z ].*)", words)
        kind = parts[1].lower().removeprefix("worn ") if parts else "nothing"
        passes = re.fullmatch(rf"({NUMBER.pattern}) ?(?:roller )?passes", words)
        if passes:
            kind, value = "passes", float(passes[1])
            if value % 1.0:
                raise ValueError(f"'{text}' is not a whole number of passes")
        elif parts and kind in {"", "time", "depth", "roller depth", "volume"}:
            try:
                value = quantity(parts[2], _QUANTITIES[kind or "time"][0])
            except QuantityError as error:
                what = f": {error}" if kind else f", expected one such as {_EXAMPLES}"
                raise ValueError(f"'{text}' is not a limit{what}") from error
            kind = kind or "time"
        else:
            raise ValueError(f"'{text}' is not a limit, expected one such as {_EXAMPLES}")
        if not 0.0 < value < np.inf:
            raise ValueError(f"'{text}' is not a limit: it must be above zero")
        return cls(kind, value, words)

    @property
    def unit(self) -> str:
        """SI unit of the value."""
        return _QUANTITIES[self.quantity][0]

    @property
    def variable(self) -> str:
        """Name of the quantity in the history of a run."""
        return _QUANTITIES[self.quantity][1]

    def values(self, problem: WearProblem, state: WearState) -> FloatArray:
        """Return the quantity of every realisation, shape (realisations,) [SI]."""
        return _QUANTITIES[self.quantity][2](problem, state)

    def is_reached(self, problem: WearProblem, state: WearState) -> FloatArray:
        """Return whether each realisation has reached the limit, shape (realisations,)."""
        return np.asarray(self.values(problem, state) >= self.value)

    def crossing(self, stepper: Stepper, advance: Advance, place: int) -> WearState | None:
        """Return the state of one test of a step where it first reaches the limit.

        The state is located by side steps from the last state of the step before the limit, so that
        the integration can continue from the step without a change.

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
        chosen = np.array([place])
        problem = advance.problem.at(chosen)
        for before, after in pairwise(advance.path):
            end = after.at(chosen)
            if not self.is_reached(problem, end)[0]:
                continue
            start = before.at(chosen).replaced(
                coarse_step_solution=None, half_quadrature_solution=None
            )
            locate = self._first_pass if stepper.pass_by_pass else self._between
            found = locate(stepper, problem, start, end)
            last = advance.end.at(chosen)
            return found.replaced(depth_error=last.depth_error, volume_error=last.volume_error)
        return None

    def _between(
        self, stepper: Stepper, problem: WearProblem, start: WearState, end: WearState
    ) -> WearState:
        """Return the state between two states of a single test at which it reaches the limit."""
        from scipy.optimize import brentq  # noqa: PLC0415  (slow to load)

        span, states = float(end.passes[0] - start.passes[0]), {0.0: start}

        def missing(passes: float) -> float:
            if passes > 0.0:
                length = np.array([passes])
                states[passes] = take_side_step(stepper.side_step, problem, start, length)
            return float(self.values(problem, states[passes])[0] - self.value)

        if missing(span) < 0.0:  # after a single step instead of those that led to `end`
            return end
        if self.quantity == "passes":
            found = self.value - float(start.passes[0])
            missing(found)
            return states[found].replaced(passes=np.array([self.value]))
        found = brentq(missing, 0.0, span, xtol=_LOCATED * float(end.passes[0]))
        # the first state at which the limit is reached, and not the last before it
        reached = [n for n, s in states.items() if self.is_reached(problem, s)[0]]
        return states[min(reached, key=lambda n: abs(n - found))]

    def _first_pass(
        self, stepper: Stepper, problem: WearProblem, start: WearState, end: WearState
    ) -> WearState:
        """Return the state after the first pass of a single test that reaches the limit."""
        while end.passes[0] - start.passes[0] > 1.0:
            half = np.array([float((end.passes[0] - start.passes[0]) // 2)])
            middle = stepper.side_step(problem, start, half)
            if self.is_reached(problem, middle)[0]:
                end = middle
            else:
                start = middle
        return end


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

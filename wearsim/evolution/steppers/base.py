"""Interface of the steppers, and their step-size control."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import TypeAlias

import numpy as np

from wearsim.errors import ContactError, StepError
from wearsim.evolution.pauses import rest, step_or_rest
from wearsim.evolution.problem import WearProblem
from wearsim.evolution.state import WearState
from wearsim.evolution.steppers.damage import damage_excess, with_damage
from wearsim.types import FloatArray

SMALLEST_STEP = 1e-6  # passes; with a great wear factor ten passes wear a whole groove
_SMALLEST_PART = 1e-8  # of the passes done; with shorter steps a test would not end
SAFETY = 0.7  # part of its allowance that the next step aims at
SHRINK, GROW = 0.2, 5.0  # bounds on the ratio of successive steps
LENGTHS = 32  # of steps, in a range of a factor of two


def rounded_length(passes: float) -> float:
    """Return the nearest of the lengths that a controlled step may have [passes].

    Their ratio is 2^(1/32). A length that followed the error to the last bit would also follow its
    round-off, and later steps would amplify the difference: two runs that are equal but for the
    order of their sums, as a run and its mirror image, would differ by as much as their errors.
    """
    if not 0.0 < passes < math.inf:
        return passes
    return float(2.0 ** (round(LENGTHS * math.log2(passes)) / LENGTHS))


class Trial:
    """Search for the length of the next step of a test.

    Parameters
    ----------
    proposed : float
        Length of the first trial step [passes].
    forced : bool
        Whether every step has the proposed length, for any error.
    taper : float
        Greatest ratio of a proposed step to the passes left, for a step to the stop; before it,
        steps take half of the passes left.

    Attributes
    ----------
    proposed : float
        Length of the next trial step [passes]; after an accepted one that of the next step, not
        rounded.
    rejected : int
        Trial steps rejected.
    """

    def __init__(self, proposed: float, forced: bool, taper: float = 1.0) -> None:
        self.proposed, self.rejected = proposed if forced else rounded_length(proposed), 0
        self._forced, self._taper = forced, taper
        self._cause: StepError | ContactError | None = None

    def step(self, passes: float, stop: float) -> float:
        """Return the length of the next trial step from `passes` to `stop` at the latest.

        Raises
        ------
        StepError, ContactError
            If it would be too short.
        """
        shortest = max(SMALLEST_STEP, _SMALLEST_PART * passes)
        if self.proposed < shortest:
            cause = self._cause
            if cause and (isinstance(cause, ContactError) or cause.cause == "lost"):
                raise cause
            raise StepError(
                f"no step is short enough at pass {passes:.0f} (tried down to {shortest:.2g}"
                f" passes); {self._cause or 'the error does not fall with the step'}"
            )
        left = stop - passes
        if self._forced:
            return min(self.proposed, left)
        if self.proposed >= self._taper * left:
            return left
        # leave no very short step before the stop, and errors that have no time left to decay
        return 0.5 * left if self.proposed > 0.5 * left else self.proposed

    def reject(self, failure: StepError | ContactError, step: float) -> None:
        """Propose a shorter step after one that failed."""
        if self._cause is None or self._cause.cause != "lost":  # contacts fail close to zero load
            self._cause = failure
        self.proposed = 0.2 * step
        self.rejected += 1

    def accepts(self, excess: float, step: float, ratio: float) -> bool:
        """Return whether a step with such an excess of error is accepted; propose the next.

        Parameters
        ----------
        excess : float
            Error that the step adds, relative to its allowance.
        step : float
            Its length [passes].
        ratio : float
            Ratio of the next step to it, by the error.
        """
        if self._forced:
            return True
        chosen = step * max(SHRINK, ratio)
        if excess <= 1.0:
            # a step shortened by the stop does not limit the length of the next one
            self.proposed = max(chosen, self.proposed) if step < self.proposed else chosen
            return True
        self.rejected += 1
        self.proposed = min(rounded_length(chosen), 0.7 * step)
        return False


#: Function from a problem, a state and a number of passes to the state after them.
Step: TypeAlias = Callable[[WearProblem, WearState, FloatArray], WearState]


@dataclass(frozen=True)
class Attempt:
    """Result of a trial step.

    Parameters
    ----------
    path : tuple of WearState
        States after the start of the step: at intermediate points, if any, and at its end.
    excess : ndarray, shape (realisations,)
        Error that the step adds, relative to its allowance.
    ratio : ndarray, shape (realisations,)
        Ratio of the next step to this one, by the error.
    warning : str, optional
        Message to the user about this step.
    """

    path: tuple[WearState, ...]
    excess: FloatArray
    ratio: FloatArray
    warning: str | None = None


@dataclass(eq=False)
class Stepper(ABC):
    """Time integration scheme; a step depends on nothing but problem and `WearState`.

    Parameters
    ----------
    tolerance : float
        Required relative error of the final depth and worn volume.
    forced_step : float, optional
        Passes per step, instead of the step-size control.
    """

    tolerance: float
    forced_step: float | None = None

    #: whether every pass is a step: the run then stops at every record, and the number of steps
    #: does not depend on the records
    pass_by_pass = False
    #: see `Trial`; errors of strips that have just come into contact have not decayed at the stop
    taper = 1.0
    #: order of the scheme: a step adds an error that grows as the step to the power order + 1
    order = 1

    def started(self, problem: WearProblem, state: WearState) -> WearState:
        """Return the state from which the integration starts."""
        return state

    def ratio(self, excess: FloatArray) -> FloatArray:
        """Return the ratio of the next step to one with such an excess, shape (realisations,)."""
        # the error that a step adds grows as the step to the power order + 1
        with np.errstate(divide="ignore"):
            aim = SAFETY * excess ** (-1.0 / (self.order + 1))
        return np.minimum(GROW, aim)

    @abstractmethod
    def proposed(self, problem: WearProblem, state: WearState) -> FloatArray:
        """Return the length of the step to be tried first, shape (realisations,) [passes].

        Raises
        ------
        StepError
            If a forced step is too long.
        """

    @abstractmethod
    def scheme(self, problem: WearProblem, state: WearState) -> Step:
        """Return the scheme, called once at the start `state` of each step for all its parts."""

    @abstractmethod
    def attempt(
        self, problem: WearProblem, state: WearState, step: FloatArray, stop: float, scheme: Step
    ) -> Attempt:
        """Take a trial step and estimate the error that it adds.

        Parameters
        ----------
        problem : WearProblem
        state : WearState
        step : ndarray, shape (realisations,)
            Length of the step [passes].
        stop : float
            Passes at the end of the test.
        scheme : callable
            Result of `scheme`.

        Raises
        ------
        StepError, ContactError
            If the step is too long for one of the realisations.
        """

    def with_damage(self, problem: WearProblem, state: WearState, tried: Attempt) -> Attempt:
        """Return a trial step from `state` with the damage by fatigue, and its error."""
        path, excess = [state], np.array(0.0)
        for end in tried.path:
            damaged, effective = with_damage(problem, path[-1], end)
            path.append(damaged)
            excess = np.maximum(excess, damage_excess(effective, self.tolerance))
        with np.errstate(divide="ignore"):  # the error of the integral grows as the step cubed
            ratio = np.minimum(GROW, SAFETY * excess ** (-1.0 / 3.0))
        return Attempt(
            tuple(path[1:]),
            np.maximum(tried.excess, excess),
            np.minimum(tried.ratio, ratio),
            tried.warning,
        )

    def side_step(self, problem: WearProblem, state: WearState, passes: FloatArray) -> WearState:
        """Return the state `passes` passes later in one step, for a record between two steps.

        The integration does not continue from the state returned.
        """
        step = self.scheme(problem, state)
        if not self.pass_by_pass:  # which passes over pauses itself, also within a step
            step = partial(step_or_rest, step)
        end = step(problem, state, passes)
        return with_damage(problem, state, end)[0] if problem.fatigue else end

    def rest(
        self, problem: WearProblem, state: WearState, step: FloatArray, stop: float
    ) -> tuple[WearState, ...]:
        """Return the path of a step in a pause; parameters as of `attempt`."""
        return (rest(problem, state, step, stop),)

    def recorded(self, problem: WearProblem) -> WearProblem:
        """Return the problem whose contacts are recorded."""
        return problem

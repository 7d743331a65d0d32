"""Interface of the steppers."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

from wearsim.evolution.error_control.step_size import StepControl, Trial
from wearsim.evolution.problem import WearProblem
from wearsim.evolution.state import WearState
from wearsim.types import FloatArray

Step: TypeAlias = Callable[[WearProblem, WearState, FloatArray], WearState]
"""Function from a problem, a state and a number of passes to the state after them."""


@dataclass(frozen=True)
class Attempt:
    """Result of a trial step.

    Parameters
    ----------
    path : tuple of WearState
        States after the start of the step: at intermediate points, if any, and at its end.
    excess : ndarray, shape (realisations,)
        Error that the step adds, relative to its allowance.
    warning : str, optional
        Message to the user about this step.
    """

    path: tuple[WearState, ...]
    excess: FloatArray
    warning: str | None = None


class Stepper(ABC):
    """Time integration scheme; a step depends on nothing but problem and `WearState`.

    Parameters
    ----------
    control : StepControl
        Step-size control.
    forced_step : float, optional
        Passes per step, instead of the step-size control.
    """

    #: whether every pass is a step: the run then stops at every record, and the number of steps
    #: does not depend on the records
    pass_by_pass = False
    #: order of the scheme: a step adds an error that grows as the step to the power order + 1
    order = 1

    def __init__(self, control: StepControl, forced_step: float | None = None) -> None:
        self.control, self.forced_step = control, forced_step

    def trial(self, proposed: float) -> Trial:
        """Return the search for the length of a step, with the first trial [passes]."""
        return Trial(proposed, self.control, self.order, forced=self.forced_step is not None)

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

    def side_step(self, problem: WearProblem, state: WearState, passes: FloatArray) -> WearState:
        """Return the state `passes` passes later in one step, for a record between two steps.

        The integration does not continue from the state returned.
        """
        return self.scheme(problem, state)(problem, state, passes)

    def recorded(self, problem: WearProblem) -> WearProblem:
        """Return the problem whose contacts are recorded."""
        return problem

"""Interface of the steppers."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

from wearsim.evolution.problem import WearProblem
from wearsim.evolution.state import WearState


@dataclass(frozen=True)
class Advance:
    """One accepted step.

    Parameters
    ----------
    path : tuple of WearState
        States at the start of the step, at intermediate points if any, and at its end.
    warning : str, optional
        Message to the user about this step.
    """

    path: tuple[WearState, ...]
    warning: str | None = None

    @property
    def end(self) -> WearState:
        """The state after the step."""
        return self.path[-1]


class Stepper(ABC):
    """Time integration scheme; a step depends on nothing but problem and `WearState`."""

    #: whether every pass is a step: the run then stops at every record, and the number of steps
    #: does not depend on the records
    pass_by_pass = False

    @abstractmethod
    def advance(self, problem: WearProblem, state: WearState, stop: float) -> Advance:
        """Take one step that ends at `stop` passes at the latest.

        Raises
        ------
        StepError
            If no step is small enough.
        ContactError
            If a contact has no solution.
        """

    @abstractmethod
    def side_step(self, problem: WearProblem, state: WearState, passes: float) -> WearState:
        """Return the state `passes` passes later, for a record between two steps.

        The integration does not continue from the state returned.
        """


def fitted(step: float, left: float) -> float:
    """Return a step length that leaves no very short step before the stop, `left` passes ahead."""
    if step >= left:
        return left
    return 0.5 * left if step > 0.5 * left else step

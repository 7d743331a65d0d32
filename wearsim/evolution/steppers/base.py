"""What every stepper promises to the loop."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

from wearsim.evolution.problem import WearProblem
from wearsim.evolution.state import WearState


@dataclass(frozen=True)
class Advance:
    """One step that stands.

    Parameters
    ----------
    path : tuple of WearState
        The states the step went through, its start first and its end last.
    warning : str, optional
        What the user should know about this step.
    """

    path: tuple[WearState, ...]
    warning: str | None = None

    @property
    def end(self) -> WearState:
        """The state after the step."""
        return self.path[-1]


class Stepper(ABC):
    """Advances a wear test; all that a later step depends on is in the `WearState`."""

    #: whether every pass is a step by itself: the run then pauses where a record is due, and the
    #: number of steps is the test's own
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
        """Return the state `passes` passes later, for a record on the way; nothing follows it."""


def fitted(step: float, left: float) -> float:
    """Return a step that does not leave a sliver before the stop `left` passes away."""
    if step >= left:
        return left
    return 0.5 * left if step > 0.5 * left else step

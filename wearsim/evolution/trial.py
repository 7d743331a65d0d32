"""The search for a step that stands: how long the next try is, and when there is none."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from wearsim.errors import ContactError, StepError
from wearsim.evolution.control import StepControl
from wearsim.evolution.stepper import fitted

SMALLEST_STEP = 1e-6  # passes; a whole groove may be worn in ten
_SMALLEST_PART = 1e-8  # of the passes done: with shorter steps a test would never end


class Trial:
    """One test's way to its next step.

    Parameters
    ----------
    proposed : float
        Passes of the first try.
    control : StepControl
    order : int
        Of the scheme.
    forced : bool
        Whether every step is as long as proposed, whatever its error.
    state : callable
        Returns the state that the step is to leave, as named arrays, for an error.

    Attributes
    ----------
    proposed : float
        Passes of the next try, or of the next step once one stands.
    rejected : int
        Tries that did not stand.
    """

    def __init__(
        self,
        proposed: float,
        control: StepControl,
        order: int,
        forced: bool,
        state: Callable[[], dict[str, Any]],
    ) -> None:
        self.proposed, self.rejected = proposed, 0
        self._control, self._order, self._forced = control, order, forced
        self._state = state
        self._cause: StepError | ContactError | None = None

    def step(self, passes: float, stop: float) -> float:
        """Return the length of the next try from `passes`, which ends at `stop` at the latest.

        Raises
        ------
        StepError, ContactError
            If it would be too short.
        """
        shortest = max(SMALLEST_STEP, _SMALLEST_PART * passes)
        if self.proposed < shortest:
            if isinstance(self._cause, ContactError):
                raise self._cause
            raise StepError(
                f"no step is short enough at pass {passes:.0f} (tried down to {shortest:.2g}"
                f" passes); {self._cause or 'the error does not fall with the step'}",
                self._state(),
            )
        left = stop - passes
        return min(self.proposed, left) if self._forced else fitted(self.proposed, left)

    def refuse(self, failure: StepError | ContactError, step: float) -> None:
        """Take note that a step could not be made; a forced one must, and its error is raised."""
        if self._forced:
            raise failure
        self._cause, self.proposed = failure, 0.2 * step
        self.rejected += 1

    def stands(self, excess: float, step: float) -> bool:
        """Tell whether a step with such an excess of error stands; propose the next."""
        chosen = self._control.next_step(step, excess, self._order)
        if self._forced or excess <= 1.0:
            if not self._forced:
                # a step cut short by the stop says little about how long the next may be
                self.proposed = max(chosen, self.proposed) if step < self.proposed else chosen
            return True
        self.rejected += 1
        self.proposed = min(chosen, 0.7 * step)
        return False

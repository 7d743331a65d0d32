"""Step-size control: how long the next step may be, given the error of the last."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from wearsim.errors import ContactError, StepError
from wearsim.evolution.steppers.base import fitted

FLOOR = 0.02  # of the budget: what a step may always add, so that a run never stalls


@dataclass(frozen=True)
class StepControl:
    """Holds the error that each step adds to a part of what the tolerance leaves.

    Wear forgets: a groove that is too deep in one place carries less load there, so that errors of
    shape die out while the groove deepens. Hence a budget that is absolute in depth, and spent
    against the error that is there now, not against the sum of all that was.

    Parameters
    ----------
    tolerance : float
        Relative error asked of the final depth and worn volume.
    share : float
        Part of the tolerance that one step may spend.
    safety : float
        Part of its allowance that the next step aims at.
    shrink, grow : float
        Bounds on the change from one step to the next.
    """

    tolerance: float
    share: float = 0.7
    safety: float = 0.7
    shrink: float = 0.2
    grow: float = 5.0

    def allowance(self, reached: float, exponent: float, spent: float, part: float) -> float:
        """Return the error that a step may add.

        Parameters
        ----------
        reached : float
            Depth or volume at the step's end.
        exponent : float
            Lower bound of the exponent with which it will grow to the end.
        spent : float
            Its estimated error before the step.
        part : float
            Part of all passes done at the step's end.
        """
        budget = self.tolerance * reached / math.pow(part, exponent)
        return self.share * max(budget - spent, FLOOR * budget)

    def next_step(self, step: float, excess: float, order: int = 1) -> float:
        """Return the next step where this one's error was `excess` times its allowance.

        The error that a step adds grows as the step to the power order + 1.
        """
        factor = self.grow
        if excess > 0.0:
            factor = self.safety / math.pow(excess, 1.0 / (order + 1))
        return step * min(self.grow, max(self.shrink, factor))


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

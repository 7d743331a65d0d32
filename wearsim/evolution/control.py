"""Step-size control: how long the next step may be, given the error of the last."""

from __future__ import annotations

import math
from dataclasses import dataclass

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

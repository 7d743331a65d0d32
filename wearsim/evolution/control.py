"""Step-size control: how long the next step may be, given the error of the last."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class StepControl:
    """Holds the error that each step adds to a small part of the final depth.

    Wear forgets: a groove that is too deep in one place carries less load there, so that errors of
    shape die out while the groove deepens. Hence one allowance for all steps, absolute in depth.

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
    share: float = 0.3
    safety: float = 0.7
    shrink: float = 0.2
    grow: float = 5.0

    def allowance(self, depth: float, passes: float, stop: float) -> float:
        """Return the error [m] that a step to `depth` [m] at `passes` may add.

        The final depth is foretold with an exponent below that of any groove, so that it is not
        overrated.
        """
        return self.tolerance * self.share * depth * math.sqrt(stop / passes)

    def next_step(self, step: float, error: float, allowed: float) -> float:
        """Return the next step for a first-order scheme, whose local error grows as its square."""
        factor = self.grow if error == 0.0 else self.safety * (allowed / error) ** 0.5
        return step * min(self.grow, max(self.shrink, factor))

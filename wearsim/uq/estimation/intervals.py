"""Estimates with the interval in which the truth lies, as often as the confidence says."""

from __future__ import annotations

import math
from dataclasses import dataclass

from wearsim.uq.estimation.moments import CONFIDENCE


@dataclass(frozen=True)
class Interval:
    """An estimate and its confidence interval.

    Parameters
    ----------
    value : float
        The estimate, nan where there is none.
    low, high : float
        Ends of the interval of 95 % confidence, infinite where too little is known.
    """

    value: float
    low: float
    high: float

    @property
    def half_width(self) -> float:
        """Half of what lies between the ends."""
        return 0.5 * (self.high - self.low)

    def within(self, least: float, greatest: float) -> Interval:
        """Return the estimate with all its numbers brought into the range they can only have."""
        return Interval(
            *(min(max(end, least), greatest) for end in (self.value, self.low, self.high))
        )


UNKNOWN = Interval(math.nan, -math.inf, math.inf)
"""What too few realisations tell."""


def t_interval(value: float, error: float, degrees: float) -> Interval:
    """Return the interval of Student's t about an estimate.

    Parameters
    ----------
    value, error : float
        The estimate and its standard error.
    degrees : float
        Degrees of freedom of the error; infinite for the normal law.
    """
    reach = error * t_quantile(degrees)
    return Interval(value, value - reach, value + reach)


def t_quantile(degrees: float) -> float:
    """Return how many standard errors an interval reaches to either side, by Student's t."""
    from scipy.special import ndtri, stdtrit  # noqa: PLC0415  (slow to import)

    chance = 0.5 + 0.5 * CONFIDENCE
    return float(ndtri(chance) if math.isinf(degrees) else stdtrit(degrees, chance))

"""Estimates with confidence intervals."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np

from wearsim.types import FloatArray

CONFIDENCE = 0.95
"""Confidence of all intervals."""
ENDS = np.array([0.025, 0.975])
"""Probabilities of the ends of such an interval."""


@dataclass(frozen=True)
class Interval:
    """An estimate and its confidence interval.

    Parameters
    ----------
    value : float
        The estimate; nan if there is none.
    low, high : float
        Ends of the 95 % confidence interval; infinite if the sample is insufficient.
    """

    value: float
    low: float
    high: float

    @property
    def half_width(self) -> float:
        """Half the width of the interval."""
        return 0.5 * (self.high - self.low)

    def censored(self, most: float) -> Interval:
        """Return the estimate and the interval of a life, unknown beyond the censoring `most`."""
        if self.value <= most:
            return Interval(self.value, self.low, self.high if self.high <= most else math.inf)
        return Interval(math.nan, min(self.low, most), math.inf)

    def within(self, least: float, greatest: float) -> Interval:
        """Return the estimate and the interval restricted to the possible range of values."""
        return Interval(
            *(min(max(end, least), greatest) for end in (self.value, self.low, self.high))
        )


def arrays_of(intervals: Iterable[Interval]) -> FloatArray:
    """Return estimates and lower and upper ends of intervals, shape (3, intervals)."""
    ends = [(interval.value, interval.low, interval.high) for interval in intervals]
    return np.array(ends, dtype=np.float64).reshape(-1, 3).T


UNKNOWN = Interval(math.nan, -math.inf, math.inf)
"""Estimate for an insufficient sample."""


def t_interval(value: float, error: float, degrees: float) -> Interval:
    """Return the interval of Student's t distribution for an estimate.

    Parameters
    ----------
    value, error : float
        The estimate and its standard error.
    degrees : float
        Degrees of freedom of the error; infinite for the normal distribution.
    """
    reach = error * t_quantile(degrees)
    return Interval(value, value - reach, value + reach)


def t_quantile(degrees: float) -> float:
    """Return the ratio of an interval's half-width to the standard error, by Student's t."""
    from scipy.special import ndtri, stdtrit  # noqa: PLC0415  (slow to import)

    probability = 0.5 + 0.5 * CONFIDENCE
    return float(ndtri(probability) if math.isinf(degrees) else stdtrit(degrees, probability))


def bisect(
    outside: Callable[[float], bool], outer: float, inner: float, halvings: int
) -> tuple[float, float]:
    """Return the halved interval [outer, inner] that holds the boundary of a set.

    Parameters
    ----------
    outside : callable
        Whether a number is outside the set.
    outer, inner : float
        Numbers outside and inside the set.
    halvings : int
        Number of halvings.
    """
    for _ in range(halvings):
        middle = 0.5 * (outer + inner)
        outer, inner = (middle, inner) if outside(middle) else (outer, middle)
    return outer, inner

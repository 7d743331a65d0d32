"""Quantiles of weighted values, and ranks of their confidence limits."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np

from wearsim.types import FloatArray
from wearsim.uq.estimation.intervals import bisect
from wearsim.uq.estimation.moments import CONFIDENCE

_HALVINGS = 50  # of an interval of ranks, down to rounding


class WeightedDistribution:
    """Empirical distribution of weighted values.

    Parameters
    ----------
    values : ndarray, shape (n,)
        At least one value.
    weights : ndarray, shape (n,), optional
        Weights with the sum 1, 1/n by default; weights of a control variate may be negative.

    Notes
    -----
    With equal weights `quantile` is numpy's default (type 7 of Hyndman and Fan, The American
    Statistician 50 (1996), DOI 10.2307/2684934), and `at` assigns the j-th value to j/(n + 1), the
    mean probability below it.
    """

    def __init__(self, values: FloatArray, weights: FloatArray | None = None) -> None:
        order = np.argsort(values, kind="stable")
        count = len(values)
        self.ordered = values[order]
        if weights is None:
            self._middle = (np.arange(count) + 0.5) / count - 0.5
        else:
            middle = np.cumsum(weights[order]) - 0.5 * weights[order] - 0.5
            # negative weights must not decrease the distribution function
            self._middle = np.maximum.accumulate(middle)

    def quantile(self, probability: float) -> float:
        """Return the quantile of this probability, interpolated linearly between values."""
        count = len(self.ordered)
        if count == 1:
            return float(self.ordered[0])
        heights = 0.5 + self._middle * (count / (count - 1))
        return float(np.interp(probability, heights, self.ordered))

    def at(self, level: float) -> float:
        """Return the value at a mean probability; infinite beyond the first and last value."""
        count = len(self.ordered)
        heights = 0.5 + self._middle * (count / (count + 1))
        slack = 1e-9 / count  # for rounding at integer ranks
        if level < heights[0] - slack:
            return -math.inf
        if level > heights[-1] + slack:
            return math.inf
        return float(np.interp(level, heights, self.ordered))


@lru_cache(maxsize=4096)
def fractional_ranks(
    count: float, probability: float, confidence: float = CONFIDENCE
) -> tuple[float, float]:
    """Return the real ranks of the confidence limits of a quantile, for independent values.

    The probability below the value of rank r has the beta distribution with the parameters r and
    count - r + 1; between integer ranks this is a definition. The integer ranks of `order_ranks`
    enclose these; for small samples they hold the quantile more often than the confidence.

    Parameters
    ----------
    count : float
        Number of independent values, or the effective sample size.
    probability : float
        Probability of the quantile, between 0 and 1.
    confidence : float
        Probability that the interval holds the quantile.

    Returns
    -------
    low, high : float
        Ranks between 0 and `count` + 1; there is no value below rank 1 or above rank `count`.

    Notes
    -----
    Hutson, Journal of Applied Statistics 26 (1999), DOI 10.1080/02664769922458.
    """
    from scipy.special import betainc  # noqa: PLC0415  (slow to import, and rarely needed)

    def rank(chance: float) -> float:
        def too_low(rank: float) -> bool:
            return bool(betainc(rank, count + 1.0 - rank, probability) > chance)

        return 0.5 * sum(bisect(too_low, 0.0, count + 1.0, _HALVINGS))

    miss = 0.5 * (1.0 - confidence)
    return rank(1.0 - miss), rank(miss)

"""Quantiles of weighted values, and between which of them the true one lies."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np

from wearsim.types import FloatArray
from wearsim.uq.estimation.moments import CONFIDENCE

_HALVINGS = 50  # of an interval of ranks: to rounding


class WeightedDistribution:
    """The empirical law of values of which each stands for a part of all.

    Parameters
    ----------
    values : ndarray, shape (n,)
        One or more.
    weights : ndarray, shape (n,), optional
        Sum to 1; some may be negative, as those of a control variate. Without them all are 1/n.

    Notes
    -----
    With equal weights `quantile` is numpy's default (type 7 of Hyndman and Fan, The American
    Statistician 50 (1996), DOI 10.2307/2684934), and `at` puts the j-th value at j/(n + 1), the
    mean of what lies below it.
    """

    def __init__(self, values: FloatArray, weights: FloatArray | None = None) -> None:
        order = np.argsort(values, kind="stable")
        count = len(values)
        self.ordered = values[order]
        if weights is None:
            self._middle = (np.arange(count) + 0.5) / count - 0.5
        else:
            # negative weights must not let the law fall
            middle = np.cumsum(weights[order]) - 0.5 * weights[order] - 0.5
            self._middle = np.maximum.accumulate(middle)

    def quantile(self, probability: float) -> float:
        """Return the value that has this part of all below it, linear between values."""
        count = len(self.ordered)
        if count == 1:
            return float(self.ordered[0])
        heights = 0.5 + self._middle * (count / (count - 1))
        return float(np.interp(probability, heights, self.ordered))

    def at(self, level: float) -> float:
        """Return the value at a mean level, infinite beyond those of the first and the last."""
        count = len(self.ordered)
        heights = 0.5 + self._middle * (count / (count + 1))
        # a whole rank must not be lost to rounding
        slack = 1e-9 / count
        if level < heights[0] - slack:
            return -math.inf
        if level > heights[-1] + slack:
            return math.inf
        return float(np.interp(level, heights, self.ordered))


@lru_cache(maxsize=4096)
def fractional_ranks(
    count: float, probability: float, confidence: float = CONFIDENCE
) -> tuple[float, float]:
    """Return between which ranks of `count` independent values a quantile lies, as real numbers.

    The value of rank r has a part of all below it that follows the beta law of r and count - r + 1;
    between whole ranks that law is a definition. `order_ranks` has the whole ranks around, which
    hold the quantile more often than asked for where values are few.

    Parameters
    ----------
    count : float
        Independent values, or as many as the values at hand are worth.
    probability : float
        Of the quantile, between 0 and 1.
    confidence : float
        Probability that the interval holds the quantile.

    Returns
    -------
    low, high : float
        Ranks between 0 and `count` + 1; below 1 or above `count` there is no such value.

    Notes
    -----
    Hutson, Journal of Applied Statistics 26 (1999), DOI 10.1080/02664769922458.
    """
    from scipy.special import betainc  # noqa: PLC0415  (slow to import, and rarely needed)

    def rank(chance: float) -> float:
        low, high = 0.0, count + 1.0
        for _ in range(_HALVINGS):
            middle = 0.5 * (low + high)
            if betainc(middle, count + 1.0 - middle, probability) > chance:
                low = middle
            else:
                high = middle
        return 0.5 * (low + high)

    miss = 0.5 * (1.0 - confidence)
    return rank(1.0 - miss), rank(miss)

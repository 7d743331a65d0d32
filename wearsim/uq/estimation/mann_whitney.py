"""Comparison of two ensembles: probability of superiority, and paired differences."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from wearsim.types import FloatArray, IntArray
from wearsim.uq.estimation.estimates import Design, estimate
from wearsim.uq.estimation.intervals import UNKNOWN, Interval, bisect, t_quantile

FEWEST = 5  # least number of values for an error estimate
_NEAR_CERTAIN = 0.1  # distance from 0 and 1 below which the interval is widened
_HALVINGS = 60


def superiority(first: FloatArray, second: FloatArray) -> Interval:
    """Return the probability that a value of one ensemble is greater than one of another.

    Parameters
    ----------
    first, second : ndarray, shapes (n,) and (m,)
        Values of independent ensembles.

    Returns
    -------
    Interval
        P(first > second) + P(first = second)/2, between 0 and 1; unknown for fewer than 5 values.

    Notes
    -----
    The Mann-Whitney statistic, with the error of DeLong, DeLong and Clarke-Pearson, Biometrics 44
    (1988), DOI 10.2307/2531595, which assumes no distributions, on the logit scale, by Student's t
    with the degrees of freedom of Brunner and Munzel, Biometrical Journal 42 (2000). Within 0.1 of
    0 and 1 that error is uncertain, and 0 if the two ranges do not overlap; there the interval is
    extended to include that of method 5 of Newcombe, Statistics in Medicine 25 (2006), DOI
    10.1002/sim.2324.
    """
    n, m = len(first), len(second)
    if min(n, m) < FEWEST:
        return UNKNOWN
    of_first, of_second = part_below(first, second), 1.0 - part_below(second, first)
    chance = float(of_first.mean())
    parts = np.array([of_first.var(ddof=1) / n, of_second.var(ddof=1) / m])
    low = high = chance
    if parts.sum() > 0.0:
        degrees = float(parts.sum() ** 2 / (parts**2 / np.array([n - 1, m - 1])).sum())
        odds = chance / (1.0 - chance)
        reach = t_quantile(degrees) * math.sqrt(float(parts.sum())) / (chance * (1.0 - chance))
        low, high = (1.0 / (1.0 + math.exp(side) / odds) for side in (reach, -reach))
    if not _NEAR_CERTAIN < chance < 1.0 - _NEAR_CERTAIN:
        ends = _newcombe(chance, n, m)
        low, high = min(low, ends[0]), max(high, ends[1])
    return Interval(chance, low, high)


@dataclass(frozen=True)
class Paired:
    """Differences of two ensembles with common random numbers, realisation by realisation.

    Parameters
    ----------
    difference : Interval
        Mean of first minus second.
    share : Interval
        Share of the pairs in which the first is greater; equal pairs count one half.
    count : int
        Number of pairs.
    """

    difference: Interval
    share: Interval
    count: int


def paired(
    first: FloatArray,
    second: FloatArray,
    plan: Design = "monte-carlo",
    replicate: IntArray | None = None,
) -> Paired:
    """Return the differences of two ensembles with common random numbers.

    Parameters
    ----------
    first, second : ndarray, shape (n,)
        Values of the same realisations in the same order.
    plan, replicate
        Sampling design of both ensembles, as for `estimate`.

    Returns
    -------
    Paired
        The interval of the share is that of Wilson, Journal of the American Statistical
        Association 22 (1927), DOI 10.1080/01621459.1927.10502953, for independent pairs.

    Raises
    ------
    ValueError
        If the ensembles differ in their number of values.
    """
    count = len(first)
    if len(second) != count:
        raise ValueError(f"pairs need equally many values, got {count} and {len(second)}")
    differences = first - second
    difference = estimate(differences, (), plan, replicate).mean
    if count == 0:
        return Paired(difference, UNKNOWN, 0)
    share = float((differences > 0.0).mean() + 0.5 * (differences == 0.0).mean())
    square = t_quantile(math.inf) ** 2 / count
    middle = (share + 0.5 * square) / (1.0 + square)
    reach = math.sqrt(square * (share * (1.0 - share) + 0.25 * square)) / (1.0 + square)
    return Paired(difference, Interval(share, middle - reach, middle + reach).within(0, 1), count)


def part_below(values: FloatArray, others: FloatArray) -> FloatArray:
    """Return the share of `others` below each of `values`; equal ones count one half."""
    ordered = np.sort(others)
    ranks = np.searchsorted(ordered, values, "left") + np.searchsorted(ordered, values, "right")
    return np.asarray(ranks / (2.0 * len(others)))


def _newcombe(chance: float, n: int, m: int) -> tuple[float, float]:
    """Return the true probabilities for which `chance` is just within the error."""
    others = 0.5 * (n + m) - 1.0
    reach = t_quantile(math.inf)

    def too_far(true: float) -> bool:
        doubled = others * ((1.0 - true) / (2.0 - true) + true / (1.0 + true))
        return abs(chance - true) > reach * math.sqrt(
            true * (1.0 - true) * (1.0 + doubled) / (n * m)
        )

    low, high = (bisect(too_far, outer, chance, _HALVINGS)[1] for outer in (0.0, 1.0))
    return low, high

"""Lives counted in a sample, with censoring: survival, quantiles, probabilities, causes."""

from __future__ import annotations

import math
import warnings
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy

from wearsim.types import BoolArray, FloatArray, IntArray
from wearsim.uq.estimation.intervals import CONFIDENCE, UNKNOWN, Interval
from wearsim.uq.estimation.moments import order_ranks

_FEW = 3  # failures below which bounds are exact


@dataclass(frozen=True, eq=False)
class SurvivalCurve:
    """Estimated survival as a step function of the life.

    Parameters
    ----------
    life : ndarray, shape (m,)
        Lives at which the survival falls, ascending.
    survival, low, high : ndarray, shape (m,)
        Probability of a greater life, from each of `life` on, with its 95 % interval.
    """

    life: FloatArray
    survival: FloatArray
    low: FloatArray
    high: FloatArray


def survival_curve(life: FloatArray, observed: BoolArray) -> SurvivalCurve:
    """Return the survival by the method of Kaplan and Meier.

    Parameters
    ----------
    life : ndarray, shape (n,)
        Lives, and times at which lives are censored.
    observed : ndarray of bool, shape (n,)
        False where the life is censored, and longer than stated.

    Returns
    -------
    SurvivalCurve
        With pointwise log-log intervals; exact ones, after Clopper and Pearson, before the third
        life of a sample in which nothing is censored before it.

    Notes
    -----
    Kaplan and Meier, Journal of the American Statistical Association 53 (1958), DOI
    10.1080/01621459.1958.10501452. Log-log intervals: Borgan and Liestol, Scandinavian Journal of
    Statistics 17 (1990).

    Examples
    --------
    >>> curve = survival_curve(np.array([1.0, 2.0, 3.0, 4.0]), np.array([True, True, True, False]))
    >>> curve.survival
    array([0.75, 0.5 , 0.25])
    """
    if not observed.any():
        none = np.zeros(0)
        return SurvivalCurve(none, none, none, none)
    function = scipy.stats.ecdf(
        scipy.stats.CensoredData(uncensored=life[observed], right=life[~observed])
    ).sf
    with np.errstate(divide="ignore", invalid="ignore"), warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # undefined where the survival is 0 or 1
        band = function.confidence_interval(CONFIDENCE, method="log-log")
    ends = np.unique(life[observed])
    steps: list[Any] = [function, band.low, band.high]
    survival, low, high = (np.array(item.evaluate(ends)) for item in steps)
    low = np.where(np.isnan(low), 0.0, low)
    high = np.fmin.accumulate(np.where(np.isnan(high), 1.0, high))
    first_censored = life[~observed].min() if (~observed).any() else math.inf
    for place, end in enumerate(ends[:_FEW]):
        failures = int((life[observed] <= end).sum())
        if end < first_censored and failures < _FEW:
            exact = proportion(failures, len(life))
            low[place], high[place] = 1.0 - exact.high, 1.0 - exact.low
    return SurvivalCurve(ends, survival, low, high)


def proportion(count: int, of: int, confidence: float = CONFIDENCE) -> Interval:
    """Return a probability from a count, with the exact interval.

    Parameters
    ----------
    count, of : int
        Events, and independent trials.
    confidence : float

    Returns
    -------
    Interval

    Notes
    -----
    Clopper and Pearson, Biometrika 26 (1934), DOI 10.1093/biomet/26.4.404. With no event the
    upper end is 1 - (miss/2)^(1/of).

    Examples
    --------
    >>> found = proportion(0, 100)
    >>> print(f"{found.high:.4f}")
    0.0362
    """
    if of == 0:
        return UNKNOWN
    miss = 0.5 * (1.0 - confidence)
    low = float(scipy.special.betaincinv(count, of - count + 1, miss)) if count else 0.0
    high = float(scipy.special.betaincinv(count + 1, of - count, 1.0 - miss)) if count < of else 1.0
    return Interval(count / of, low, high)


def least_survival(trials: int, confidence: float = CONFIDENCE) -> float:
    """Return the one-sided lower bound of a survival when none of `trials` failed.

    Examples
    --------
    >>> print(f"{least_survival(29):.4f}")  # the fewest that show 90 %
    0.9019
    """
    return float((1.0 - confidence) ** (1.0 / trials))


def median_positions(count: int) -> FloatArray:
    """Return the median probabilities below the ordered lives of a sample, shape (count,).

    The life that is interpolated at a probability between them is above the true quantile as often
    as below.

    Notes
    -----
    Median of the beta distribution of the i-th order statistic (Johnson, Industrial Mathematics 2
    (1951)); Benard's (i - 0.3)/(n + 0.4) approximates it.

    Examples
    --------
    >>> median_positions(5).round(4)
    array([0.1294, 0.3138, 0.5   , 0.6862, 0.8706])
    """
    rank = np.arange(1.0, count + 1.0)
    return np.asarray(scipy.special.betaincinv(rank, count + 1.0 - rank, 0.5))


def median_rank(count: int, probability: float) -> float:
    """Return the rank, 1 to `count`, whose median probability is given; nan beyond the sample.

    Examples
    --------
    >>> median_rank(69, 0.01) >= 1.0, median_rank(68, 0.01)
    (True, nan)
    """
    positions = median_positions(count)
    if not count or not positions[0] <= probability <= positions[-1]:
        return math.nan
    return float(np.interp(probability, positions, np.arange(1.0, count + 1.0)))


def fewest_lives(probability: float) -> int:
    """Return the number of lives from which a quantile is estimated: 69 for B1, 7 for B10.

    Examples
    --------
    >>> fewest_lives(0.01), fewest_lives(0.1), fewest_lives(0.5)
    (69, 7, 1)
    """
    return math.ceil(math.log(0.5) / math.log1p(-min(probability, 1.0 - probability)) - 1e-9)


def life_quantile(life: FloatArray, observed: BoolArray, probability: float) -> Interval:
    """Return the life that a share of the specimens does not reach, such as B10.

    Parameters
    ----------
    life, observed : ndarray, shape (n,)
        As for `survival_curve`.
    probability : float
        Share that fails before, 0.1 for B10.

    Returns
    -------
    Interval
        Where nothing is censored below, the value is interpolated at the median positions of the
        ordered lives, and the ends are order statistics, which hold the quantile of any
        distribution with 95 % or more. An end for which there are too few lives is infinite; the
        value is nan if it is beyond the censoring, or if there are fewer than `fewest_lives`. If
        only the lower end is missing and a one-sided 95 % bound exists (29 lives for B10),
        `lower_bound` returns it.

    Notes
    -----
    With random censoring, the lives at which the survival and its log-log band cross
    1 - probability (Brookmeyer and Crowley, Biometrics 38 (1982), DOI 10.2307/2530286).
    """
    count = len(life)
    if not count:
        return UNKNOWN
    ordered, low_and_high = np.sort(life), order_ranks(count, probability)
    first_censored = float(life[~observed].min(initial=math.inf))
    low, high = (
        float(ordered[rank - 1]) if 1 <= rank <= count else math.copysign(math.inf, rank - 0.5)
        for rank in low_and_high
    )
    if high < first_censored or first_censored >= life[observed].max(initial=0.0):
        rank = median_rank(count, probability)
        middle = float(np.interp(rank, np.arange(1.0, count + 1.0), ordered))
        high = high if high < first_censored else math.inf
        return Interval(middle if middle < first_censored else math.nan, low, high)
    curve, level = survival_curve(life, observed), 1.0 - probability
    value, low, high = (
        min(curve.life[line <= level].tolist(), default=math.inf)
        for line in (curve.survival, curve.low, curve.high)
    )
    known = math.isfinite(value) and count >= fewest_lives(probability)
    return Interval(value if known else math.nan, min(low, value), high)


def lower_bound(life: FloatArray, observed: BoolArray, probability: float) -> float:
    """Return the one-sided 95 % lower bound of a quantile; -inf with too few lives.

    Examples
    --------
    >>> lives = np.arange(1.0, 30.0)
    >>> float(lower_bound(lives, lives > 0, 0.1))
    1.0
    """
    rank, _ = order_ranks(len(life), probability, 2.0 * CONFIDENCE - 1.0)
    ordered = np.sort(life)
    return float(ordered[rank - 1]) if rank > 0 and observed[np.argsort(life)[0]] else -math.inf


def probability_before(life: FloatArray, observed: BoolArray, target: float) -> Interval:
    """Return the probability of a life below a target.

    Parameters
    ----------
    life, observed : ndarray, shape (n,)
        As for `survival_curve`.
    target : float

    Returns
    -------
    Interval
        Exact where nothing is censored before the target, else of the survival; unknown where the
        sample ends before the target.
    """
    before = observed & (life < target)
    if not (~observed & (life < target)).any():
        return proportion(int(before.sum()), len(life))
    curve = survival_curve(life, observed)
    place = int(np.searchsorted(curve.life, target)) - 1
    if target > life.max():
        return UNKNOWN
    if place < 0:
        return proportion(0, int((life >= target).sum()))
    return Interval(*(1.0 - float(x[place]) for x in (curve.survival, curve.high, curve.low)))


def cumulative_incidence(
    life: FloatArray, cause: IntArray, causes: int
) -> tuple[FloatArray, FloatArray]:
    """Return the probability that a specimen has failed from each cause.

    Parameters
    ----------
    life : ndarray, shape (n,)
    cause : ndarray of int, shape (n,)
        Cause that ended the life first, from 0; -1 where it is censored.
    causes : int
        Number of causes.

    Returns
    -------
    life : ndarray, shape (m,)
        Lives at which something failed, ascending.
    incidence : ndarray, shape (causes, m)
        Their sum over the causes is 1 - survival.

    Notes
    -----
    Aalen and Johansen, Scandinavian Journal of Statistics 5 (1978). 1 - survival from one cause
    alone would count specimens that had already failed from another.

    Examples
    --------
    >>> cumulative_incidence(np.array([1.0, 2.0, 3.0]), np.array([0, 1, 0]), 2)[1][:, -1]
    array([0.66666667, 0.33333333])
    """
    ends = np.unique(life[cause >= 0])
    at_risk = len(life) - np.searchsorted(np.sort(life), ends)
    failed = np.array(
        [[((life == end) & (cause == k)).sum() for end in ends] for k in range(causes)]
    ).reshape(causes, len(ends))
    survival = np.concatenate([[1.0], np.cumprod(1.0 - failed.sum(axis=0) / at_risk)])
    return ends, np.cumsum(survival[:-1] * failed / at_risk, axis=1)

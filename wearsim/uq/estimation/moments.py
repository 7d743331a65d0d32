"""Moments and quantiles of independent realisations, with their standard errors."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from wearsim.types import FloatArray, IntArray
from wearsim.uq.estimation.intervals import CONFIDENCE, UNKNOWN, Interval, bisect

_SAME = 1e-9  # relative standard deviation below which values are constant
_BLOCK = 256  # rows summed at once, independent of the batch size
_HALVINGS = 50  # of an interval of ranks, down to rounding


@dataclass(frozen=True)
class Quantile(Interval):
    """An estimated quantile, interpolated linearly between order statistics.

    Parameters
    ----------
    probability : float
        Probability below it.
    """

    probability: float


@dataclass(frozen=True)
class Summary:
    """Estimates from realisations of one number; nan for too few or constant realisations.

    Parameters
    ----------
    count : int
        Number of realisations.
    mean, std : float
        Estimates of mean and standard deviation.
    mean_error, std_error : float
        Standard errors of both.
    skewness : float
        Estimate of the skewness.
    least, greatest : float
        Extremes.
    quantiles : tuple of Quantile
        The requested quantiles.
    mean_interval, std_interval : Interval
        Mean and standard deviation with their 95 % intervals, where they have been computed; see
        `wearsim.uq.estimation.estimates.estimate`.
    """

    count: int
    mean: float
    std: float
    mean_error: float
    std_error: float
    skewness: float
    least: float
    greatest: float
    quantiles: tuple[Quantile, ...]
    mean_interval: Interval = UNKNOWN
    std_interval: Interval = UNKNOWN

    @property
    def is_constant(self) -> bool:
        """Whether the realisations differ only by rounding; False for a single one."""
        return is_constant(self.mean, self.std)

    def quantile(self, probability: float) -> Quantile:
        """Return the quantile of this probability."""
        return next(item for item in self.quantiles if item.probability == probability)


@dataclass(frozen=True)
class Convergence:
    """Mean and standard deviation of the first n realisations, with their standard errors.

    Parameters
    ----------
    count : ndarray of int, shape (points,)
        Numbers n of realisations.
    mean, mean_error, std, std_error : ndarray, shape (points,)
        As in `Summary`.
    """

    count: IntArray
    mean: FloatArray
    mean_error: FloatArray
    std: FloatArray
    std_error: FloatArray


def summarise(values: FloatArray, probabilities: tuple[float, ...] = ()) -> Summary:
    """Return estimates from independent realisations of one number.

    Parameters
    ----------
    values : ndarray, shape (realisations,)
        At least one.
    probabilities : tuple of float
        Probabilities of the requested quantiles.

    Returns
    -------
    Summary

    Notes
    -----
    The standard error of the standard deviation s is sqrt((m4 - s^4 (n - 3)/(n - 1))/n)/(2 s), m4
    being the fourth central moment; it assumes no particular distribution.
    """
    count = len(values)
    last = converge(values, np.array([count]))
    deviation = values - float(values.mean())
    second, third = float((deviation**2).mean()), float((deviation**3).mean())
    mean, std = float(last.mean[0]), float(last.std[0])
    skewness = math.nan
    if count > 2 and second > 0.0 and not is_constant(mean, std):
        skewness = third / second**1.5 * math.sqrt(count * (count - 1.0)) / (count - 2.0)
    ordered = np.sort(values)
    return Summary(
        count=count,
        mean=mean,
        std=std,
        mean_error=float(last.mean_error[0]),
        std_error=float(last.std_error[0]),
        skewness=skewness,
        least=float(ordered[0]),
        greatest=float(ordered[-1]),
        quantiles=tuple(_quantile(ordered, probability) for probability in probabilities),
    )


def is_constant(mean: float, std: float, rounding: float = 0.0) -> bool:
    """Return whether values differ by no more than rounding.

    Parameters
    ----------
    mean, std : float
        Mean and standard deviation of the values; a std of nan, as of one value, gives False.
    rounding : float
        Absolute rounding error of values that are zero.

    Returns
    -------
    bool
    """
    return std <= max(_SAME * abs(mean), rounding)


def are_equal(values: FloatArray) -> bool:
    """Return whether values, shape (n,), differ by no more than rounding; False for a single one.

    See `is_constant`.
    """
    return len(values) > 1 and is_constant(float(values.mean()), float(values.std(ddof=1)))


def converge(values: FloatArray, counts: IntArray) -> Convergence:
    """Return mean and standard deviation as functions of the number of realisations.

    Parameters
    ----------
    values : ndarray, shape (realisations,)
        Values in the order of the realisations.
    counts : ndarray of int, shape (points,)
        Numbers of realisations, 1 or more.

    Returns
    -------
    Convergence
        The standard deviation and the errors of a single realisation are nan.
    """
    centre = float(values.mean())
    deviation = values - centre
    n = counts.astype(np.float64)
    # raw moments about a nearby value, which give the central moments without cancellation
    r1, r2, r3, r4 = (np.cumsum(deviation**power)[counts - 1] / n for power in (1, 2, 3, 4))
    second = np.maximum(r2 - r1**2, 0.0)
    fourth = np.maximum(r4 - 4.0 * r1 * r3 + 6.0 * r1**2 * r2 - 3.0 * r1**4, 0.0)
    several = np.where(n > 1.0, n, np.nan)
    variance = second * n / (several - 1.0)
    std = np.sqrt(variance)
    of_variance = np.maximum(fourth - variance**2 * (n - 3.0) / (several - 1.0), 0.0) / n
    spread = np.where(std > 0.0, std, 1.0)
    return Convergence(
        count=counts,
        mean=centre + r1,
        mean_error=std / np.sqrt(n),
        std=std,
        std_error=np.sqrt(of_variance) / (2.0 * spread) + 0.0 * several,
    )


def _quantile(ordered: FloatArray, probability: float) -> Quantile:
    low, high = order_ranks(len(ordered), probability)
    return Quantile(
        probability=probability,
        value=float(np.quantile(ordered, probability)),
        low=float(ordered[low - 1]) if low > 0 else -math.inf,
        high=float(ordered[high - 1]) if high <= len(ordered) else math.inf,
    )


def order_ranks(count: int, probability: float, confidence: float = CONFIDENCE) -> tuple[int, int]:
    """Return the ranks of the confidence limits of a quantile of any continuous distribution.

    The number of realisations below the quantile is binomial; the quantile is beyond each limit
    with a probability of at most (1 - confidence)/2.

    Parameters
    ----------
    count : int
        Number of realisations.
    probability : float
        Probability of the quantile, between 0 and 1.
    confidence : float
        Least probability that the interval holds the quantile.

    Returns
    -------
    low, high : int
        Ranks from 1 to `count`; 0 and `count` + 1 if there is no such order statistic.

    Notes
    -----
    David and Nagaraja, Order Statistics (2003), section 7.1.
    """
    low, high = fractional_ranks(float(count), probability, confidence)
    return math.floor(low), math.ceil(high)


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
        limits = bisect(
            lambda rank: bool(betainc(rank, count + 1.0 - rank, probability) > chance),
            0.0,
            count + 1.0,
            _HALVINGS,
        )
        return 0.5 * sum(limits)

    miss = 0.5 * (1.0 - confidence)
    return rank(1.0 - miss), rank(miss)


class RowMoments:
    """Mean and standard deviation of rows, bit for bit independent of the batch size.

    Parameters
    ----------
    columns : int
        Length of a row.

    Notes
    -----
    Chan, Golub, LeVeque, The American Statistician 37 (1983), DOI 10.1080/00031305.1983.10483115.
    """

    def __init__(self, columns: int) -> None:
        self._waiting = np.empty((_BLOCK, columns))
        self._held = 0
        self._merged: tuple[int, FloatArray, FloatArray] = (0, np.zeros(columns), np.zeros(columns))

    def add(self, rows: FloatArray) -> None:
        """Add rows, shape (rows, columns)."""
        while len(rows):
            part, rows = np.split(rows, [_BLOCK - self._held])
            self._waiting[self._held : self._held + len(part)] = part
            self._held += len(part)
            if self._held == _BLOCK:
                self._merged = _merge(self._merged, self._waiting)
                self._held = 0

    def mean_and_std(self) -> tuple[FloatArray, FloatArray]:
        """Return mean and standard deviation of the rows so far, each (columns,); nan for one."""
        waiting = self._waiting[: self._held]
        count, mean, square = _merge(self._merged, waiting) if self._held else self._merged
        variance = square / (count - 1) if count > 1 else np.full_like(mean, np.nan)
        return mean, np.sqrt(variance)


def _merge(
    so_far: tuple[int, FloatArray, FloatArray], rows: FloatArray
) -> tuple[int, FloatArray, FloatArray]:
    """Return count, mean and sum of squared deviations with `rows` added."""
    before, mean, square = so_far
    mean_of_rows = rows.mean(axis=0)
    square_of_rows = ((rows - mean_of_rows) ** 2).sum(axis=0)
    count, difference = before + len(rows), mean_of_rows - mean
    return (
        count,
        mean + difference * (len(rows) / count),
        square + square_of_rows + difference**2 * (before * len(rows) / count),
    )

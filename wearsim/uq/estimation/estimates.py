"""Estimates from the realisations of a sampling design, and targets for their accuracy."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, TypeAlias, get_args

import numpy as np

from wearsim.errors import unknown_name
from wearsim.types import FloatArray, IntArray
from wearsim.uq.estimation.intervals import UNKNOWN, Interval, t_interval, t_quantile
from wearsim.uq.estimation.moments import are_equal, fractional_ranks
from wearsim.uq.estimation.standard_errors import (
    Control,
    Controlled,
    Independent,
    PlanErrors,
    Replicated,
)

Design: TypeAlias = Literal[
    "monte-carlo", "latin-hypercube", "sobol", "saltelli", "control-variate"
]
#: Sampling designs for which estimates are available.
DESIGNS: tuple[Design, ...] = get_args(Design)

_MIN_DRAWS = 5  # independent draws below which the error of a std is not estimated
_STEP = 0.5  # least standard error of an empirical distribution function, in units of 1/n
_LARGEST = 1400.0  # twice the logarithm of a large finite float
_MIN_VARIANCE = 1e-12  # relative variance without one realisation that causes nearly all of it
_FEWEST = 32  # realisations; with fewer, an interval may be narrow by chance
_STATISTICS: dict[str, Literal["mean", "std"] | float] = {
    "mean": "mean",
    "std": "std",
    "median": 0.5,
}
LIFE = "life"  # the observable of targets such as "b10 3%"
_FORM_OF_LIFE = re.compile(r"[bB](?P<percent>\d*\.?\d+)\s+(?P<width>\d*\.?\d+)\s*%")
_FORM = re.compile(
    r"(?P<observable>[a-z][a-z_]*)\.(?P<what>mean|std|median|q(?P<percent>\d+(\.\d+)?))"
    r"\s+(?P<width>\d+(\.\d*)?|\.\d+)\s*%"
)


@dataclass(frozen=True)
class Estimate:
    """Estimates of the distribution of one number from its realisations.

    Parameters
    ----------
    count : int
        Number of realisations.
    mean, std : Interval
        Mean and standard deviation.
    quantiles : tuple of (float, Interval)
        Probability and quantile, in the requested order.
    least, greatest : float
        Extremes of the realisations; nan if there are none.
    method : str
        Method of the intervals, in words.
    variance_saved : float, optional
        Share of the variance that the control variate explains, if one is used.
    """

    count: int
    mean: Interval
    std: Interval
    quantiles: tuple[tuple[float, Interval], ...]
    least: float
    greatest: float
    method: str
    variance_saved: float | None = None

    def quantile(self, probability: float) -> Interval:
        """Return the quantile of one of the requested probabilities."""
        quantiles = dict(self.quantiles)
        if probability not in quantiles:
            raise unknown_name(
                f"{probability:g}",
                "a probability of this estimate, see the argument probabilities",
                (f"{known:g}" for known in quantiles),
            )
        return quantiles[probability]


def estimate(
    values: FloatArray,
    probabilities: Sequence[float] = (),
    plan: Design = "monte-carlo",
    replicate: IntArray | None = None,
    control: Control | None = None,
) -> Estimate:
    """Return estimates of the distribution of one number.

    Parameters
    ----------
    values : ndarray, shape (n,)
        Values of the successful realisations; for "saltelli", those of the blocks A and B.
    probabilities : sequence of float
        Probabilities of the requested quantiles, between 0 and 1.
    plan : {"monte-carlo", "latin-hypercube", "sobol", "saltelli", "control-variate"}
        Sampling design of the realisations.
    replicate : ndarray of int, shape (n,), optional
        Number of the independent sequence of each realisation; needed by "sobol".
    control : Control, optional
        The control variate of the same realisations; needed by "control-variate".

    Returns
    -------
    Estimate
        The std of one realisation is nan; interval ends for which the sample is insufficient are
        infinite. Intervals of equal values have the width 0.

    Raises
    ------
    ValueError
        If a value is not finite, or data that the design needs are missing or do not match.

    Notes
    -----
    Each design defines weights of the realisations and a standard error of any weighted mean, from
    the spread of independent realisations, the spread of the replicates' means, or the residuals of
    the regression on the control variate. These give

    - the mean, with an interval by Student's t;
    - the standard deviation, with an interval on its logarithmic scale from the jackknife
      pseudo-values of the log variance (Miller, Annals of Mathematical Statistics 39 (1968), DOI
      10.1214/aoms/1177698418), which for large samples agrees with that of the fourth moment;
    - the quantiles, with limits between two order statistics of the weighted empirical
      distribution. Their ranks are those of the effective number of independent values, for which
      the distribution function has the same error at the quantile: n for independent realisations.

    Coverage for log-normal values with a coefficient of variation of 0.26: mean 94.5 to 95.8 % of
    all ensembles with 20 realisations or more; standard deviation 92 to 93 % with 20 and 94.3 to
    95.7 % with 200 or more; quantiles 94.3 to 97.5 % with 200 or more, and up to 100 % with fewer
    or with an infinite end. There are two worse cases. If a single input determines the value,
    Sobol replicates differ mainly in their extremes: mean 93.5 %, standard deviation 91 %,
    quantiles 98 to 100 %. If a control variate determines nearly all of the value nonlinearly: mean
    90 % with 50 realisations, 94 % with 200 and 95 % with 1000.
    """
    errors = _errors(plan, values, replicate, control)
    if len(values) == 0:
        quantiles = tuple((probability, UNKNOWN) for probability in probabilities)
        return Estimate(0, UNKNOWN, UNKNOWN, quantiles, math.nan, math.nan, errors.method)
    if failed := int((~np.isfinite(values)).sum()):
        raise ValueError(f"{failed} of {len(values)} values are not finite; leave out failed ones")
    least, greatest, constant = float(values.min()), float(values.max()), are_equal(values)
    if constant:
        mean = Interval(*[float(values.mean())] * 3).within(least, greatest)
        std = Interval(0.0, 0.0, 0.0)
        quantiles = tuple((probability, mean) for probability in probabilities)
    else:
        mean, std = _mean_and_std(values, errors)
        distribution = WeightedDistribution(values, errors.weights)
        quantiles = tuple((p, _quantile(distribution, values, p, errors)) for p in probabilities)
    return Estimate(
        count=len(values),
        mean=mean,
        std=std,
        quantiles=quantiles,
        least=least,
        greatest=greatest,
        method=errors.method,
        variance_saved=None if constant else errors.variance_saved(values),
    )


def _errors(
    plan: Design, values: FloatArray, replicate: IntArray | None, control: Control | None
) -> PlanErrors:
    """Return the standard errors of a sampling design, after checking its data."""
    count = len(values)
    if plan not in DESIGNS:
        raise ValueError(f'unknown plan "{plan}", expected one of {", ".join(DESIGNS)}')
    if plan == "sobol":
        if replicate is None or len(replicate) != count:
            raise ValueError("a sobol plan needs the replicate of each realisation")
        return Replicated(replicate)
    if plan == "control-variate":
        if control is None or len(control.values) != count:
            raise ValueError("a control-variate plan needs the control of each realisation")
        if control.is_usable:
            return Controlled(control)
    words = {
        "control-variate": "independent realisations, too few or too similar for a control variate",
        "monte-carlo": "independent realisations",
        "latin-hypercube": "as for independent realisations, and therefore too wide",
        "saltelli": "independent realisations of the blocks A and B",
    }
    return Independent(count, words[plan])


def _mean_and_std(values: FloatArray, errors: PlanErrors) -> tuple[Interval, Interval]:
    """Return mean and standard deviation with their intervals."""
    centre = float(values.mean())
    deviation = values - centre
    offset = _weighted(errors, deviation)
    if errors.degrees < 1:
        return Interval(centre + offset, -math.inf, math.inf), Interval(math.nan, 0.0, math.inf)
    error = errors.error(deviation)
    square = (deviation - offset) ** 2
    # corrected for the error of the mean; positive for any weights
    plain = float(square.mean()) + error**2
    variance = plain * math.exp((_weighted(errors, square) - float(square.mean())) / plain)
    mean = t_interval(centre + offset, error, errors.degrees)
    return mean, _std_interval(math.sqrt(variance), deviation, errors)


def _std_interval(std: float, deviation: FloatArray, errors: PlanErrors) -> Interval:
    """Return the standard deviation with its interval, by pseudo-values of the log variance."""
    count, square = len(deviation), deviation**2
    unknown = Interval(std, 0.0, math.inf)
    if errors.draws < _MIN_DRAWS:
        return unknown
    variance = float(square.sum()) / (count - 1)
    # ratio of the variance without each realisation to the variance of all
    left = (count - 1 - count / (count - 1) * square / variance) / (count - 2)
    if left.min() < _MIN_VARIANCE:
        return unknown
    pseudo = -(count - 1.0) * np.log(left)
    reach, shift = t_quantile(errors.degrees) * errors.error(pseudo), float(pseudo.mean())
    low, high = (math.exp(0.5 * min(shift + side, _LARGEST)) for side in (-reach, reach))
    return Interval(std, std * min(low, 1.0), std * max(high, 1.0))


def _quantile(
    distribution: WeightedDistribution, values: FloatArray, probability: float, errors: PlanErrors
) -> Interval:
    """Return one quantile with its interval."""
    value = distribution.quantile(probability)
    count = float(len(values))
    if errors.degrees < 1:
        return Interval(value, -math.inf, math.inf)
    if not isinstance(errors, Independent):
        below = (values <= value).astype(np.float64)
        error = errors.error(below) * t_quantile(errors.degrees) / t_quantile(math.inf)
        count = probability * (1.0 - probability) / max(error, _STEP / count) ** 2
    low, high = (
        distribution.at(rank / (count + 1.0)) for rank in fractional_ranks(count, probability)
    )
    return Interval(value, min(low, value), max(high, value))


def _weighted(errors: PlanErrors, parts: FloatArray) -> float:
    return float(parts.mean() if errors.weights is None else errors.weights @ parts)


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
        self._middle = (np.arange(count) + 0.5) / count - 0.5
        if weights is not None:
            # negative weights must not decrease the distribution function
            self._middle = np.maximum.accumulate(
                np.cumsum(weights[order]) - 0.5 * weights[order] - 0.5
            )

    def quantile(self, probability: float) -> float:
        """Return the quantile of this probability, interpolated linearly between values."""
        count = len(self.ordered)
        heights = 0.5 + self._middle * (count / max(count - 1, 1))
        return float(np.interp(probability, heights, self.ordered))

    def at(self, level: float) -> float:
        """Return the value at a mean probability; infinite beyond the first and last value."""
        count = len(self.ordered)
        heights = 0.5 + self._middle * (count / (count + 1))
        beyond = level - float(np.clip(level, heights[0], heights[-1]))
        if abs(beyond) > 1e-9 / count:  # with a margin for rounding at integer ranks
            return math.copysign(math.inf, beyond)
        return float(np.interp(level, heights, self.ordered))


@dataclass(frozen=True)
class Target:
    """Target half-width of a confidence interval, relative to the estimate.

    Parameters
    ----------
    observable : str
        Name of the observable: "depth", or "life".
    statistic : {"mean", "std"} or float
        Estimated statistic; a number is the probability of a quantile, 0.1 for B10.
    width : float
        Half-width of the 95 % interval, relative to the estimate.
    """

    observable: str
    statistic: Literal["mean", "std"] | float
    width: float

    @classmethod
    def parse(cls, text: str) -> Target:
        """Return the target of a text such as "depth.mean 1%", "width.q97.5 5 %" or "b10 3%".

        Raises
        ------
        TypeError
            If it is no text.
        ValueError
            If the text is not a target.
        """
        if not isinstance(text, str):
            raise TypeError(f'a target must be a text such as "depth.mean 1%", got {text!r}')
        if of_life := _FORM_OF_LIFE.fullmatch(text.strip()):
            share, width = (float(of_life[name]) / 100.0 for name in ("percent", "width"))
            if 0.0 < share < 1.0 and width > 0.0:
                return cls(LIFE, share, width)
        match = _FORM.fullmatch(text.strip())
        if match is None:
            raise ValueError(
                f'cannot read the target "{text}": expected observable.statistic and a half-width,'
                ' as in "depth.mean 1%"; the statistic is mean, std, median, or a quantile in'
                " percent, q95"
            )
        width = float(match["width"]) / 100.0
        if not width > 0.0:
            raise ValueError(f'the target "{text}" has no width; give one above 0 %')
        statistic = _STATISTICS.get(match["what"]) or float(match["percent"]) / 100.0
        if isinstance(statistic, float) and not 0.0 < statistic < 1.0:
            raise ValueError(f'the quantile of the target "{text}" must be above q0 and below q100')
        return cls(match["observable"], statistic, width)

    @property
    def what(self) -> str:
        """Observable and statistic, "depth.mean", or the life, "b10"."""
        name = self.statistic
        if self.observable == LIFE:
            return f"b{100.0 * float(name):.12g}"
        return f"{self.observable}.{name if isinstance(name, str) else f'q{100.0 * name:.12g}'}"

    def __str__(self) -> str:
        """Return the text that `parse` accepts."""
        return f"{self.what} {100.0 * self.width:.12g}%"

    @property
    def probabilities(self) -> tuple[float, ...]:
        """Probabilities of the quantiles that the estimate must include."""
        return () if isinstance(self.statistic, str) else (self.statistic,)

    def interval(self, estimate: Estimate) -> Interval:
        """Return the interval of the statistic from an estimate of the observable."""
        if not isinstance(self.statistic, str):
            return estimate.quantile(self.statistic)
        return {"mean": estimate.mean, "std": estimate.std}[self.statistic]

    def achieved(self, estimate: Estimate) -> float:
        """Return the half-width relative to the estimate; infinite if it is unknown."""
        interval = self.interval(estimate)
        if interval.half_width == 0.0:
            return 0.0
        size = abs(interval.value)
        return interval.half_width / size if size > 0.0 else math.inf

    def reached(self, estimate: Estimate) -> bool:
        """Return whether the target is reached, with at least 32 realisations.

        Stopping as soon as the target is reached favours intervals that are narrow by chance: the
        coverage is 92 to 95 % for ensembles that stop between 80 and 700 realisations.
        """
        return estimate.count >= _FEWEST and self.achieved(estimate) <= self.width

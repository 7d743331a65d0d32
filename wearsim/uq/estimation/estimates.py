"""Estimates from the realisations of any plan, with intervals that hold for that plan."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, TypeAlias, get_args

import numpy as np

from wearsim.types import FloatArray, IntArray
from wearsim.uq.estimation.control_variate import Control, Controlled, is_usable
from wearsim.uq.estimation.intervals import UNKNOWN, Interval, t_interval, t_quantile
from wearsim.uq.estimation.moments import summarise
from wearsim.uq.estimation.quantiles import WeightedDistribution, fractional_ranks
from wearsim.uq.estimation.standard_errors import Independent, PlanErrors, Replicated

Design: TypeAlias = Literal[
    "monte-carlo", "latin-hypercube", "sobol", "saltelli", "control-variate"
]
DESIGNS: tuple[Design, ...] = get_args(Design)
"""Plans whose realisations can be judged."""

_FEWEST_DRAWS = 5  # independent draws below which the spread of a spread is not told
_STEP = 0.5  # least standard error of an empirical law, in steps of it
_LARGEST = 1400.0  # twice the logarithm of a number that still is one
_NOTHING_LEFT = 1e-12  # of the variance, where one realisation has it all


@dataclass(frozen=True)
class Estimate:
    """What the realisations of one number tell of its law.

    Parameters
    ----------
    count : int
        Realisations.
    mean, std : Interval
        Of the mean and of the standard deviation.
    quantiles : tuple of (float, Interval)
        Probability and quantile, as asked for.
    least, greatest : float
        Extremes of the realisations, nan where there are none.
    method : str
        What the intervals come from, in words.
    variance_saved : float, optional
        Part of the variance that the control variate explains, where one is of use.
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
        """Return the quantile of this probability, which must be among those asked for."""
        return dict(self.quantiles)[probability]


def estimate(
    values: FloatArray,
    probabilities: Sequence[float] = (),
    plan: Design = "monte-carlo",
    replicate: IntArray | None = None,
    control: Control | None = None,
) -> Estimate:
    """Return what the realisations of a plan tell of the law of one number.

    Parameters
    ----------
    values : ndarray, shape (n,)
        Of the realisations that ended well; of a "saltelli" plan, those of the blocks A and B.
    probabilities : sequence of float
        Of the quantiles wanted, between 0 and 1.
    plan : {"monte-carlo", "latin-hypercube", "sobol", "saltelli", "control-variate"}
        How the realisations were drawn.
    replicate : ndarray of int, shape (n,), optional
        Which of the independent sequences each realisation is of; needed by "sobol".
    control : Control, optional
        The control variate of the same realisations; needed by "control-variate".

    Returns
    -------
    Estimate
        With a std of nan where there is one realisation, and infinite ends where there are too
        few. Values that are all the same have intervals of no width.

    Raises
    ------
    ValueError
        If a value is not finite, or what the plan needs is missing or does not fit the values.

    Notes
    -----
    All plans give weights to the realisations, and a standard error to any weighted mean: by the
    spread of independent realisations, by that of the replicates' own means, or by the residuals of
    the regression on the control. From these follow

    - the mean, by Student's t;
    - the standard deviation, on the scale of its logarithm, by the error of the jackknife's
      pseudo-values of the log variance (Miller, Annals of Mathematical Statistics 39 (1968), DOI
      10.1214/aoms/1177698418), which is the fourth moment's for many realisations;
    - the quantiles, as ends between two order statistics of the weighted empirical law. Their ranks
      are those for as many independent values as would give the law the same error at the
      quantile: n of them for independent realisations.

    On log-normal values with a coefficient of variation of 0.26, intervals hold the mean in 94.5 to
    95.8 % of all ensembles from 20 realisations on, the standard deviation in 92 to 93 % at 20 and
    94.3 to 95.7 % from 200 on, and quantiles in 94.3 to 97.5 % from 200 on; with fewer, or an end
    that is infinite, up to 100 %. They are worse in two cases. Where one input alone decides the
    value, Sobol replicates differ by their extremes: the mean is held in 93.5 %, the standard
    deviation in 91 %, quantiles in 98 to 100 %. Where a control decides the value all but alone, by
    a curve, the mean is held in 90 % at 50 realisations, 94 % at 200 and 95 % at 1000.
    """
    errors = _errors(plan, values, replicate, control)
    if len(values) == 0:
        nothing = tuple((probability, UNKNOWN) for probability in probabilities)
        return Estimate(0, UNKNOWN, UNKNOWN, nothing, math.nan, math.nan, errors.method)
    if not np.isfinite(values).all():
        wrong = int(len(values) - np.isfinite(values).sum())
        raise ValueError(f"{wrong} of {len(values)} values are not finite; leave out failed ones")
    summary = summarise(values)
    if summary.is_constant:
        same = Interval(*[summary.mean] * 3).within(summary.least, summary.greatest)
        mean, std = same, Interval(0.0, 0.0, 0.0)
        quantiles = tuple((probability, same) for probability in probabilities)
    else:
        mean, std = _mean_and_std(values, errors)
        law = WeightedDistribution(values, errors.weights)
        quantiles = tuple((p, _quantile(law, values, p, errors)) for p in probabilities)
    return Estimate(
        count=summary.count,
        mean=mean,
        std=std,
        quantiles=quantiles,
        least=summary.least,
        greatest=summary.greatest,
        method=errors.method,
        variance_saved=None if summary.is_constant else errors.variance_saved(values),
    )


def _errors(
    plan: Design, values: FloatArray, replicate: IntArray | None, control: Control | None
) -> PlanErrors:
    """Return the standard errors of a plan, having refused what does not fit."""
    count = len(values)
    if plan not in DESIGNS:
        raise ValueError(f'unknown plan "{plan}", expected one of {", ".join(DESIGNS)}')
    if plan == "sobol":
        if replicate is None or len(replicate) != count:
            raise ValueError("a sobol plan needs the replicate of each of its realisations")
        return Replicated(replicate)
    if plan == "control-variate":
        if control is None or len(control.values) != count:
            raise ValueError("a control-variate plan needs the control of each realisation")
        if is_usable(control):
            return Controlled(control)
        return Independent(count, "independent realisations, too few or too alike for a control")
    words = {
        "monte-carlo": "independent realisations",
        "latin-hypercube": "as for independent realisations, and so too wide",
        "saltelli": "independent realisations of the blocks A and B",
    }
    return Independent(count, words[plan])


def _mean_and_std(values: FloatArray, errors: PlanErrors) -> tuple[Interval, Interval]:
    """Return mean and standard deviation."""
    centre = float(values.mean())
    apart = values - centre
    offset = _weighted(errors, apart)
    if errors.degrees < 1:
        unknown = Interval(math.nan, 0.0, math.inf)
        return Interval(centre + offset, -math.inf, math.inf), unknown
    error = errors.error(apart)
    square = (apart - offset) ** 2
    # what the mean's own error takes from the squares; and never below 0, whatever the weights
    plain = float(square.mean()) + error**2
    variance = plain * math.exp((_weighted(errors, square) - float(square.mean())) / plain)
    mean = t_interval(centre + offset, error, errors.degrees)
    return mean, _std_interval(math.sqrt(variance), apart, errors)


def _std_interval(std: float, apart: FloatArray, errors: PlanErrors) -> Interval:
    """Return the standard deviation with its interval, by pseudo-values of the log variance."""
    count, square = len(apart), apart**2
    unknown = Interval(std, 0.0, math.inf)
    if errors.draws < _FEWEST_DRAWS:
        return unknown
    variance = float(square.sum()) / (count - 1)
    # the variance without each realisation in turn, in parts of that of all
    left = (count - 1 - count / (count - 1) * square / variance) / (count - 2)
    if left.min() < _NOTHING_LEFT:
        return unknown
    pseudo = -(count - 1.0) * np.log(left)
    reach, shift = t_quantile(errors.degrees) * errors.error(pseudo), float(pseudo.mean())
    low, high = (math.exp(0.5 * min(shift + side, _LARGEST)) for side in (-reach, reach))
    return Interval(std, std * min(low, 1.0), std * max(high, 1.0))


def _quantile(
    law: WeightedDistribution, values: FloatArray, probability: float, errors: PlanErrors
) -> Interval:
    """Return one quantile."""
    value = law.quantile(probability)
    count = float(len(values))
    if errors.degrees < 1:
        return Interval(value, -math.inf, math.inf)
    if not isinstance(errors, Independent):
        below = (values <= value).astype(np.float64)
        error = max(
            errors.error(below) * t_quantile(errors.degrees) / t_quantile(math.inf), _STEP / count
        )
        count = probability * (1.0 - probability) / error**2
    low, high = (law.at(rank / (count + 1.0)) for rank in fractional_ranks(count, probability))
    return Interval(value, min(low, value), max(high, value))


def _weighted(errors: PlanErrors, parts: FloatArray) -> float:
    return float(parts.mean() if errors.weights is None else errors.weights @ parts)

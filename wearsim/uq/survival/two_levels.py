"""Lives where median and scatter of the wear factor are uncertain: two levels of probability.

With ln K ~ N(m, t^2) the probability of a life below n depends on m and n through m + ln n alone,
so that the lives for all (m, t) follow from one distribution for each t.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import scipy

from wearsim.types import FloatArray
from wearsim.uq.distributions.two_levels import TwoLevels, weighted_quantiles
from wearsim.uq.estimation.intervals import ENDS, UNKNOWN, Interval
from wearsim.uq.survival.distributions import FactorMixture, logit_interval
from wearsim.uq.survival.scores import ScoreFunction

_WIDE = 700.0  # greatest magnitude of a logarithm
_NODES = 121  # of ln life at which probabilities are tabulated for each scatter
_REACH = 8.0  # of these nodes beyond the realisations, in scatters
_LEAST = 1e-300  # probability
_HALVINGS = 48
_FARTHEST = 12.0  # life beyond the realisations, in scatters and as a logarithm
_NORMAL = 1.96
_SCORES = np.linspace(-2.5, 2.5, 11)  # of the sampling error, within an interval
_SHARES = np.exp(-0.5 * _SCORES**2) / np.exp(-0.5 * _SCORES**2).sum()


@dataclass(frozen=True)
class UncertainLife:
    """Life of a share of the machines, with what is not known of the wear factor.

    Parameters
    ----------
    predictive : float
        Life that the share of the machines does not reach, averaged over what is not known.
    plug_in : float
        The same with the median of m and of t, taken as known.
    low, high : float
        Ends of the 95 % credible interval of the life, by both parts.
    by_tests, by_realisations : float
        Variance of the logarithm of the life due to m and t, which more tests would remove, and due
        to the number of realisations.
    """

    predictive: float
    plug_in: float
    low: float
    high: float
    by_tests: float
    by_realisations: float

    @property
    def interval(self) -> Interval:
        """The predictive life with the credible interval; they hold it at small shares too."""
        low, high = min(self.low, self.predictive), max(self.high, self.predictive)
        return Interval(self.predictive, low, high)


class UncertainLives:
    """Distribution of lives for all medians and scatters of the wear factor.

    Parameters
    ----------
    mixture : FactorMixture
        Realisations with the predictive distribution of the wear factor.
    levels : TwoLevels
    """

    def __init__(self, mixture: FactorMixture, levels: TwoLevels) -> None:
        self.mixture, self.levels = mixture, levels
        self.scatters, self._owner = np.unique(levels.t, return_inverse=True)
        self._found: dict[float, UncertainLife] = {}

    def given(self, m: float, t: float) -> FactorMixture:
        """Return the lives for one median and scatter of the wear factor."""
        ends = np.array([-_WIDE, _WIDE])
        return replace(self.mixture, score=ScoreFunction(ends, (ends - m) / t, np.zeros(0)))

    def quantile(self, share: float) -> UncertainLife:
        """Return the life that a share of the machines does not reach."""
        if share not in self._found:
            self._found[share] = self._quantile(share)
        return self._found[share]

    def _quantile(self, share: float) -> UncertainLife:
        value, low, high = self._quantiles(share)
        with np.errstate(invalid="ignore"):  # where a life is never reached
            half = np.where(np.isfinite(high), 0.5 * (high - low), value - low)
        errors = (np.where(np.isfinite(value), half, 0.0) / _NORMAL)[self._owner]
        logs, weight = value[self._owner] - self.levels.m, self.levels.weight
        first, last = np.exp(weighted_quantiles(*_with_errors(logs, errors, weight), ENDS))
        middle = float(weight @ logs)
        return UncertainLife(
            self.mixture.quantile_of_mean(share),
            self.given(*self.levels.plug_in).quantile_of_mean(share),
            float(first),
            float(last),
            float(weight @ (logs - middle) ** 2) if math.isfinite(middle) else math.inf,
            float(weight @ errors**2),
        )

    def _quantiles(self, share: float) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return ln life of a share with m = 0 for each scatter, and the ends of its interval.

        The interval is computed as in `LifeDistribution.quantile`.
        """
        value = self._crossings(np.full(len(self.scatters), share))
        if self.mixture.exact:
            return value, value, value
        known = np.minimum(value, _WIDE)
        errors = (
            self.given(0.0, float(t)).error(math.exp(log), failed)
            for log, t, failed in zip(known, self.scatters, self._failed(known), strict=True)
        )
        ends = [logit_interval(share, *error) for error in errors]
        low, high = (
            np.array([getattr(interval, end) for interval in ends]) for end in ("low", "high")
        )
        return value, self._crossings(low), self._crossings(high)

    def _failed(self, log: FloatArray) -> FloatArray:
        """Return the probability of a life below exp(log), m = 0, shape (scatters, count)."""
        mixture, t = self.mixture, self.scatters[:, None]
        with np.errstate(divide="ignore"):
            kappa = np.log(mixture.kappa)
        moved = log[:, None] + t * mixture.shift - kappa
        return np.asarray(scipy.special.ndtr(moved / (t * mixture.spread)))

    def _crossings(self, level: FloatArray) -> FloatArray:
        """Return ln life, m = 0, at which the mean probability of each scatter reaches a level."""
        reach = _FARTHEST * (1.0 + self.scatters)
        low, high = self._logs.min() - reach, self._logs.max() + reach
        last = high.copy()
        for _ in range(_HALVINGS):
            middle = 0.5 * (low + high)
            below = self._failed(middle).mean(axis=1) < level
            low, high = np.where(below, middle, low), np.where(below, high, middle)
        return np.where(high < last, high, math.inf)

    @cached_property
    def _logs(self) -> FloatArray:
        """Logarithms of the finite kappa."""
        return np.log(self.mixture.kappa[self.mixture.is_finite])

    def probability_before(self, life: float) -> Interval:
        """Return the probability of a life below `life`, with its 95 % credible interval."""
        interval = self.mixture.probability_before(life)
        if not 0.0 < interval.value < 1.0:
            return interval
        chances = np.clip(self.probabilities(np.array([life]))[:, 0], _LEAST, 1.0 - 2.0**-53)
        logits, weight = np.log(chances / (1.0 - chances)), self.levels.weight
        if not 0.0 < interval.low <= interval.high < 1.0:
            return UNKNOWN
        sampled = [math.log(end / (1.0 - end)) for end in (interval.low, interval.high)]
        errors = np.full(len(logits), (sampled[1] - sampled[0]) / (2.0 * _NORMAL))
        ends = weighted_quantiles(*_with_errors(logits, errors, weight), ENDS)
        low, high = (1.0 / (1.0 + np.exp(-ends))).tolist()
        return Interval(interval.value, min(low, interval.value), max(high, interval.value))

    def probabilities(self, life: FloatArray) -> FloatArray:
        """Return the probability of a life below each of `life` for all (m, t), shape (rows, m)."""
        with np.errstate(divide="ignore"):
            log = self.levels.m[:, None] + np.log(life)
        failed = np.empty_like(log)
        for place, (nodes, scores) in enumerate(zip(*self._table, strict=True)):
            rows = self._owner == place
            failed[rows] = scipy.special.ndtr(np.interp(log[rows], nodes, scores))
        return failed

    @cached_property
    def _table(self) -> tuple[FloatArray, FloatArray]:
        """Values of ln life with m = 0, and normal scores of the probability of a shorter one.

        Both have the shape (scatters, nodes).
        """
        reach = _REACH * self.scatters
        nodes = np.linspace(self._logs.min() - reach, self._logs.max() + reach, _NODES, axis=1)
        chances = np.array([self._failed(column).mean(axis=1) for column in nodes.T]).T
        return nodes, scipy.special.ndtri(np.clip(chances, _LEAST, 1.0 - 2.0**-53))


def _with_errors(
    values: FloatArray, errors: FloatArray, weight: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return values with a normal error added, as more values, and their weights."""
    if not errors.any():
        return values, weight
    spread = values[:, None] + errors[:, None] * _SCORES
    return spread.ravel(), (weight[:, None] * _SHARES).ravel()

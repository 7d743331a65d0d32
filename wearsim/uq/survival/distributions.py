"""Distribution of lives as a mean over realisations: counted lives, and exact wear factors.

Where the worn state depends on the wear factor K and the passes n through K n alone, a realisation
that reaches its limit at K n = kappa has failed before n with the probability that K exceeds
kappa/n. The mean of these probabilities over the realisations integrates over K exactly.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from wearsim.types import FloatArray
from wearsim.uq.distributions.base import Distribution
from wearsim.uq.estimation.intervals import UNKNOWN, Interval, bisect, t_quantile

_HALVINGS = 50
_ROUNDING = 1e-12  # probability below which a mean over realisations is a matter of rounding
_WIDEST = 60.0  # range of ln life in which quantiles are sought, on both sides
_SCORES = np.linspace(-8.2, 8.2, 16_401)  # normal scores at which a quantile function is tabulated


def score_function(distribution: Distribution) -> Callable[[FloatArray], FloatArray]:
    """Return the normal score of the distribution function, for any quantile function.

    Parameters
    ----------
    distribution : Distribution
        Of a positive number.

    Returns
    -------
    callable
        Function of values, infinite outside the support; interpolated in the logarithm of the
        value, which is exact for a log-normal distribution.
    """
    from scipy.special import ndtr  # noqa: PLC0415  (slow to load)

    values = np.maximum(distribution.quantile(ndtr(_SCORES)), np.finfo(float).tiny)
    logs, first = np.unique(np.log(values), return_index=True)
    last = np.append(first[1:] - 1, len(_SCORES) - 1)  # a jump has the greater probability above

    def score(value: FloatArray) -> FloatArray:
        with np.errstate(divide="ignore"):
            log = np.log(value)
        return np.asarray(np.interp(log, logs, _SCORES[last], left=-math.inf, right=math.inf))

    return score


class LifeDistribution(ABC):
    """Distribution of lives, the mean over independent realisations.

    Attributes
    ----------
    count : int
        Number of realisations.
    exact : bool
        Whether nothing random is left to sample, so that one realisation is sufficient.
    """

    count: int
    exact: bool = False

    @abstractmethod
    def failed(self, life: FloatArray) -> FloatArray:
        """Return each realisation's probability of failure before `life`, (m,) to (count, m)."""

    def probability_before(self, life: float) -> Interval:
        """Return the probability of a life below `life`, with the sampling interval.

        Returns
        -------
        Interval
            Student's t on the logit scale; of zero width if nothing is sampled.
        """
        each = self.failed(np.array([life]))[:, 0]
        value = float(each.mean())
        if self.exact or not _ROUNDING < value < 1.0 - _ROUNDING:
            return Interval(value, value, value)
        if self.count < 2:
            return Interval(value, 0.0, 1.0)
        error = float(each.std(ddof=1)) / math.sqrt(self.count)
        return logit_interval(value, error, self.count - 1)

    def quantile(self, probability: float) -> Interval:
        """Return the life that a share does not reach; its ends invert `probability_before`."""
        value = self.quantile_of_mean(probability)
        if self.exact:
            return Interval(value, value, value)
        if self.count < 2:
            return Interval(value, 0.0, math.inf)
        low = self._crossing(lambda n: self.probability_before(n).high, probability)
        high = self._crossing(lambda n: self.probability_before(n).low, probability)
        return Interval(value, low, high)

    def quantile_of_mean(self, probability: float) -> float:
        """Return a quantile without its interval."""
        return self._crossing(lambda n: float(self.failed(np.array([n])).mean()), probability)

    @cached_property
    @abstractmethod
    def middle(self) -> float:
        """A life within the distribution."""

    def _crossing(self, probability_at: Callable[[float], float], level: float) -> float:
        """Return the least life at which a rising probability reaches a level."""
        start = math.log(self.middle)
        before, after = bisect(
            lambda log: probability_at(math.exp(log)) < level,
            start - _WIDEST,
            start + _WIDEST,
            _HALVINGS,
        )
        if after > start + _WIDEST - 1e-6:
            return math.inf
        return 0.0 if before < start - _WIDEST + 1e-6 else math.exp(after)


def logit_interval(value: float, error: float, degrees: float) -> Interval:
    """Return the interval of a probability by Student's t on the logit scale."""
    if not 0.0 < value < 1.0:
        return Interval(value, value, value) if error == 0.0 else UNKNOWN.within(0.0, 1.0)
    odds = value / (1.0 - value)
    reach = math.exp(min(t_quantile(degrees) * error / (value * (1.0 - value)), 700.0))
    return Interval(value, odds / (odds + reach), odds * reach / (1.0 + odds * reach))


@dataclass(frozen=True, eq=False)
class FactorMixture(LifeDistribution):
    """Lives of realisations with the wear factor integrated exactly.

    Parameters
    ----------
    kappa : ndarray, shape (n,)
        Wear factor times passes at the limit; 0 where reached at once, infinite if never.
    score : callable
        Normal score of the distribution function of the wear factor, see `score_function`.
    shift : ndarray, shape (n,)
        Mean of that score given the other draws of a realisation; 0 without rank correlation.
    spread : float
        Its standard deviation given the other draws; 1 without rank correlation.
    exact : bool
        Whether nothing else is random.

    Examples
    --------
    >>> from scipy.stats import lognorm
    >>> class WearFactor(Distribution):
    ...     def quantile(self, probability):
    ...         return lognorm.ppf(probability, np.log(1.5), scale=1.1e-11)
    >>> mixture = FactorMixture(np.array([1.571349e-5]), score_function(WearFactor()), exact=True)
    >>> print(f"{mixture.quantile(0.1).value:.0f} {mixture.quantile(0.5).value:.0f}")
    849591 1428499
    """

    kappa: FloatArray
    score: Callable[[FloatArray], FloatArray]
    shift: FloatArray | float = 0.0
    spread: float = 1.0
    exact: bool = False

    @property
    def count(self) -> int:  # type: ignore[override]
        """Number of realisations."""
        return len(self.kappa)

    @cached_property
    def middle(self) -> float:
        """A life within the distribution: that of the median wear factor."""
        finite = self.kappa[np.isfinite(self.kappa) & (self.kappa > 0.0)]
        if not len(finite):
            return 1.0
        from scipy.optimize import brentq  # noqa: PLC0415  (slow to load)

        log = brentq(lambda x: min(max(float(self.score(np.exp(x))), -9.0), 9.0), -700.0, 700.0)
        return float(np.median(finite) / math.exp(log))

    def failed(self, life: FloatArray) -> FloatArray:
        """Return each realisation's probability of failure before `life`, (m,) to (count, m)."""
        from scipy.special import ndtr  # noqa: PLC0415  (slow to load)

        with np.errstate(divide="ignore", invalid="ignore"):  # a life of 0 is no failure before it
            factor = self.kappa[:, None] / life
        shift = np.broadcast_to(np.asarray(self.shift), self.kappa.shape)[:, None]
        return np.asarray(ndtr((shift - self.score(factor)) / self.spread))


@dataclass(frozen=True, eq=False)
class CountedLives(LifeDistribution):
    """Lives as they are, each a step of the distribution; censored ones are infinite.

    Parameters
    ----------
    life : ndarray, shape (n,)
    """

    life: FloatArray

    @property
    def count(self) -> int:  # type: ignore[override]
        """Number of realisations."""
        return len(self.life)

    @cached_property
    def middle(self) -> float:
        """The median of the finite lives."""
        finite = self.life[np.isfinite(self.life) & (self.life > 0.0)]
        return float(np.median(finite)) if len(finite) else 1.0

    def failed(self, life: FloatArray) -> FloatArray:
        """Return whether each realisation has failed before `life`, (m,) to (count, m)."""
        return np.asarray((self.life[:, None] < life).astype(float))

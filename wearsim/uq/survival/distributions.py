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
import scipy

from wearsim.types import BoolArray, FloatArray
from wearsim.uq.estimation.intervals import Interval, bisect, t_quantile
from wearsim.uq.survival.effective import (
    Fits,
    caution,
    effective_number,
    fits_of,
    predicted_number,
)
from wearsim.uq.survival.scores import ScoreFunction

_HALVINGS = 50
_ROUNDING = 1e-12  # relative, of a mean of probabilities
_ABOVE = 1e-12  # relative distance of a life from a step before it
_WIDEST = 60.0  # range of ln life in which quantiles are sought, on both sides


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
        failed = self.failed(np.array([life]))[:, 0]
        value = float(failed.mean())
        if self.exact:
            return Interval(value, value, value)
        if self.count < 2:
            return Interval(value, 0.0, 1.0)
        return logit_interval(value, *self.error(life, failed))

    def error(self, life: float, failed: FloatArray) -> tuple[float, float]:
        """Return the standard error of the mean probability, and its degrees of freedom.

        Parameters
        ----------
        life : float
        failed : ndarray, shape (count,)
            Probabilities of failure before it.
        """
        return float(failed.std(ddof=1)) / math.sqrt(self.count), self.count - 1

    def quantile(self, probability: float) -> Interval:
        """Return the life that a share does not reach.

        Notes
        -----
        The ends are the lives at which the mean probability has the ends of its interval at the
        estimate (Woodruff, Journal of the American Statistical Association 47 (1952), DOI
        10.1080/01621459.1952.10483443).
        """
        value = self.quantile_of_mean(probability)
        if self.exact:
            return Interval(value, value, value)
        if self.count < 2:
            return Interval(value, 0.0, math.inf)
        reach = math.exp(_WIDEST)
        # just above, so that a step of the probability is included
        life = min(max(value, self.middle / reach), self.middle * reach) * (1.0 + _ABOVE)
        error, degrees = self.error(life, self.failed(np.array([life]))[:, 0])
        ends = logit_interval(probability, error, degrees)
        low = self.quantile_of_mean(ends.low)
        high = self.quantile_of_mean(ends.high) if ends.high < 1.0 else math.inf
        return Interval(value, min(low, value), max(high, value))

    def quantile_of_mean(self, probability: float) -> float:
        """Return a quantile without its interval."""
        return self._crossing(
            lambda n: float(self.failed(np.array([n])).mean()), probability * (1.0 - _ROUNDING)
        )

    @cached_property
    @abstractmethod
    def middle(self) -> float:
        """A life within the distribution."""

    @property
    @abstractmethod
    def steps(self) -> FloatArray:
        """Lives at which the probability of a realisation has a step, in any order."""

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
    if error == 0.0:
        return Interval(value, value, value)
    if not 0.0 < value < 1.0 or math.isinf(error):
        return Interval(value, 0.0, 1.0)
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
    score : ScoreFunction
        Normal score of the distribution function of the wear factor.
    shift : ndarray, shape (n,)
        Mean of that score given the other draws of a realisation; 0 without rank correlation.
    spread : float
        Its standard deviation given the other draws; 1 without rank correlation.
    exact : bool
        Whether nothing else is random.

    Examples
    --------
    >>> from scipy.stats import lognorm
    >>> from wearsim.uq.distributions.base import Distribution
    >>> from wearsim.uq.survival.scores import score_function
    >>> class WearFactor(Distribution):
    ...     def quantile(self, probability):
    ...         return lognorm.ppf(probability, np.log(1.5), scale=1.1e-11)
    >>> mixture = FactorMixture(np.array([1.571349e-5]), score_function(WearFactor()), exact=True)
    >>> print(f"{mixture.quantile(0.1).value:.0f} {mixture.quantile(0.5).value:.0f}")
    849591 1428499
    """

    kappa: FloatArray
    score: ScoreFunction
    shift: FloatArray | float = 0.0
    spread: float = 1.0
    exact: bool = False

    @property
    def count(self) -> int:  # type: ignore[override]
        """Number of realisations."""
        return len(self.kappa)

    @cached_property
    def middle(self) -> float:
        """A life within the distribution, at the median wear factor."""
        finite = self.kappa[self.is_finite]
        return (
            float(np.median(finite) / math.exp(self.score.log_quantile(0.0)))
            if len(finite)
            else 1.0
        )

    @property
    def steps(self) -> FloatArray:
        """Lives of the finite realisations with each value of the factor that has a probability."""
        return np.unique(self.kappa[self.is_finite][:, None] / self.score.atoms)

    def failed(self, life: FloatArray) -> FloatArray:
        """Return each realisation's probability of failure before `life`, (m,) to (count, m)."""
        with np.errstate(divide="ignore", invalid="ignore"):  # a life of 0 is no failure before it
            factor = self.kappa[:, None] / life
        shift = np.broadcast_to(np.asarray(self.shift), self.kappa.shape)[:, None]
        return np.asarray(scipy.special.ndtr((shift - self.score(factor)) / self.spread))

    def error(self, life: float, failed: FloatArray) -> tuple[float, float]:
        """Return the standard error of the mean probability, and its degrees of freedom.

        The error is at least the one predicted by fits of ln kappa, since a sample rarely contains
        the realisations that cause most of the scatter of a small probability, and with a spread
        that is the greater the smaller the probability, see `caution`.
        """
        error, degrees = super().error(life, failed)
        mean = float(failed.mean())
        predicted = self._predicted(life, caution(mean))
        if predicted == 0.0:  # a probability below the least number
            return math.inf, 1.0
        error = max(error, min(mean, 1.0 - mean) / math.sqrt(predicted))
        return error, max(min(degrees, predicted - 1.0), 1.0)

    def effective_number(self, life: float) -> float:
        """Return the effective number of realisations of a probability of a life below `life`.

        It is the number of counted failures that would have the variation of the estimate,
        predicted with the upper limit of the spread of ln kappa; infinite if nothing is sampled.
        """
        if self.exact:
            return math.inf
        if self.count < 2:
            return 0.0
        failed = self.failed(np.array([life]))[:, 0]
        number = effective_number(self.count, float(failed.mean()), float(failed.var(ddof=1)))
        return min(number, self._predicted(life, 1.0))

    def _predicted(self, life: float, widened: float) -> float:
        """Return the effective number by the fits of ln kappa."""
        shares = float((self.kappa == 0.0).mean()), float(self.is_finite.mean())
        return predicted_number(
            self._fits.values(widened),
            lambda log: np.asarray(scipy.special.ndtr(-self.needed_score(log, life))),
            shares,
            self.count,
        )

    @cached_property
    def is_finite(self) -> BoolArray:
        """Whether each realisation reaches its limit, and not at once."""
        return np.isfinite(self.kappa) & (self.kappa > 0.0)

    @cached_property
    def log_kappa(self) -> tuple[FloatArray, BoolArray]:
        """Finite ln kappa over the median factor given the other draws, and which are finite."""
        chosen = self.is_finite
        shift = np.broadcast_to(np.asarray(self.shift), self.kappa.shape)[chosen]
        moved = self.score.log_quantile(shift) - self.score.log_quantile(0.0)
        return np.log(self.kappa[chosen]) - moved, chosen

    def needed_score(self, log_kappa: FloatArray, life: float) -> FloatArray:
        """Return the score that the wear factor must exceed for a failure before `life`."""
        return np.asarray(self.score(np.exp(log_kappa) / life) / self.spread)

    @cached_property
    def _fits(self) -> Fits:
        """Fits of ln kappa."""
        return fits_of(self.log_kappa[0])


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

    @property
    def steps(self) -> FloatArray:
        """The finite lives."""
        return self.life[np.isfinite(self.life)]

    def failed(self, life: FloatArray) -> FloatArray:
        """Return whether each realisation has failed before `life`, (m,) to (count, m)."""
        return np.asarray((self.life[:, None] < life).astype(float))

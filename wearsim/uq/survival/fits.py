"""Log-normal and Weibull distributions of lives, fitted by maximum likelihood."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np
import scipy

from wearsim.types import BoolArray, FloatArray
from wearsim.uq.estimation.intervals import Interval, t_interval
from wearsim.uq.survival.distributions import FactorMixture

Family: TypeAlias = Literal["log-normal", "Weibull"]
FAMILIES: tuple[Family, ...] = ("log-normal", "Weibull")

_DEVIANCE = 3.841458820694124  # 95 % quantile of chi-square with one degree of freedom
_STEPS = 60  # of Newton's method
_WIDEST = 1e3  # distance in standard errors at which the search for an end stops
_SCORES = np.linspace(-6.0, 6.0, 121)  # of the wear factor, in fits to its whole distribution
_SHARES = np.exp(-0.5 * _SCORES**2) / np.exp(-0.5 * _SCORES**2).sum()
_COMPARED = 401  # lives at which a fit is compared with them
_Terms: TypeAlias = Callable[[FloatArray, BoolArray], tuple[FloatArray, FloatArray, FloatArray]]


@dataclass(frozen=True)
class FittedLives:
    """Distribution of lives whose logarithm has a location and a scale.

    The scale parameter of a Weibull distribution is exp(mu), its shape 1/sigma; the median of a
    log-normal one is exp(mu).

    Parameters
    ----------
    family : {"log-normal", "Weibull"}
    mu, sigma : float
        Location and scale of the logarithm of the life.
    log_likelihood : float
        Of the lives, with their unit.
    """

    family: Family
    mu: float
    sigma: float
    log_likelihood: float

    @property
    def aic(self) -> float:
        """Akaike's information criterion; the family with the lower one fits better."""
        return 4.0 - 2.0 * self.log_likelihood

    def quantile(self, probability: float) -> float:
        """Return the life that a share `probability` does not reach."""
        return math.exp(self.mu + self.sigma * standard_score(self.family, probability))

    def probability_before(self, life: FloatArray) -> FloatArray:
        """Return the probability of a life below each of `life`, shape as `life`."""
        return standard_probability(self.family, self.score(life))

    def score(self, life: FloatArray) -> FloatArray:
        """Return the standardised logarithm of each of `life`, shape as `life`."""
        with np.errstate(divide="ignore"):
            return np.asarray((np.log(life) - self.mu) / self.sigma)

    @property
    def covariance(self) -> FloatArray:
        """Covariance of the estimates of mu and ln sigma, shape (2, 2)."""
        raise NotImplementedError

    def interval(self, probability: float) -> Interval:
        """Return a quantile with its 95 % interval."""
        raise NotImplementedError

    def score_error(self, life: FloatArray) -> FloatArray:
        """Return the standard error of the score of each of `life`, shape as `life`.

        Notes
        -----
        By the delta method (Meeker and Escobar, Statistical Methods for Reliability Data (1998),
        section 8.4), so that score +- 1.96 errors is a pointwise 95 % band on a probability plot.
        """
        gradient = np.stack([np.full(np.shape(life), -1.0 / self.sigma), -self.score(life)])
        square = np.einsum("i...,ij,j...->...", gradient, self.covariance, gradient)
        return np.asarray(np.sqrt(np.maximum(square, 0.0)))


def standard_score(family: Family, probability: float) -> float:
    """Return the standardised logarithm of the life that a share does not reach."""
    if family == "log-normal":
        return float(scipy.special.ndtri(probability))
    return math.log(-math.log1p(-probability))


def standard_probability(family: Family, score: FloatArray) -> FloatArray:
    """Return the probability of a smaller standardised logarithm, shape as `score`."""
    return np.asarray(
        scipy.special.ndtr(score) if family == "log-normal" else -np.expm1(-np.exp(score))
    )


@dataclass(frozen=True)
class LifeFit(FittedLives):
    """Distribution of lives fitted by maximum likelihood; parameters also as of `FittedLives`.

    Parameters
    ----------
    sample : _Sample
    """

    sample: _Sample

    @property
    def covariance(self) -> FloatArray:
        """Covariance of the estimates of mu and ln sigma, from the observed information."""
        curvature = self.sample.derivatives(self.mu, math.log(self.sigma), 0.0)[2]
        return np.asarray(np.linalg.inv(-curvature))

    def interval(self, probability: float) -> Interval:
        """Return a quantile with its likelihood-ratio interval.

        An end is infinite, or 0, where the likelihood does not fall sufficiently.

        Notes
        -----
        Meeker and Escobar, Statistical Methods for Reliability Data (1998), section 8.3.
        """
        w = standard_score(self.family, probability)
        best = self.mu + self.sigma * w
        at = math.log(self.sigma)
        information = -self.sample.derivatives(best, at, w)[2]
        error = math.sqrt(abs(information[1, 1] / np.linalg.det(information)))

        def excess(distance: float) -> float:
            nonlocal at  # near the maximum at the next distance too
            at, top = self.sample.profile(best + distance * error, at, w)
            return 2.0 * (self.log_likelihood - top) - _DEVIANCE

        ends = []
        for side in (-1.0, 1.0):
            far = side
            while excess(far) < 0.0 and abs(far) < _WIDEST:
                far *= 2.0
            if abs(far) < _WIDEST:
                near = 0.5 * far if abs(far) > 1.0 else 0.0
                ends.append(math.exp(best + error * scipy.optimize.brentq(excess, near, far)))
            else:
                ends.append(0.0 if side < 0.0 else math.inf)
        return Interval(math.exp(best), *ends)


@dataclass(frozen=True, eq=False)
class _Sample:
    """Logarithms of lives with the log-likelihood of a family, and optionally their weights."""

    family: Family
    logs: FloatArray
    observed: BoolArray
    weight: FloatArray | float = 1.0

    def derivatives(self, q: float, s: float, w: float) -> tuple[float, FloatArray, FloatArray]:
        """Return log-likelihood, gradient and second derivatives in q and s = ln sigma.

        The location is q - w sigma, so that q is the logarithm of the quantile with the score w.
        """
        v = (self.logs - q) * math.exp(-s)
        value, first, second = (
            self.weight * term for term in TERMS[self.family](v + w, self.observed)
        )
        failures = float((self.weight * self.observed).sum())
        ended = float((self.weight * np.where(self.observed, self.logs, 0.0)).sum())
        total = float(value.sum()) - failures * s - ended
        inverse, mixed = math.exp(-s), second * v + first
        gradient = np.array([-first.sum() * inverse, -(first * v).sum() - failures])
        across = mixed.sum() * inverse
        curvature = np.array([[second.sum() * inverse**2, across], [across, (mixed * v).sum()]])
        return total, gradient, curvature

    def profile(self, q: float, start: float, w: float) -> tuple[float, float]:
        """Return ln sigma of the greatest log-likelihood with the quantile q, and its value."""
        at, value = self._maximised(np.array([q, start]), w, [1])
        return float(at[1]), value

    def maximum(self, w: float = 0.0) -> tuple[FloatArray, float]:
        """Return location and ln sigma of the greatest log-likelihood, and its value."""
        observed = self.logs[self.observed]
        weight = np.broadcast_to(np.asarray(self.weight), self.logs.shape)
        middle = float(np.average(self.logs, weights=weight))
        return self._maximised(
            np.array([middle, math.log(max(float(observed.std()), 1e-12))]), w, [0, 1]
        )

    def _maximised(self, at: FloatArray, w: float, free: list[int]) -> tuple[FloatArray, float]:
        """Maximise the log-likelihood over some of its arguments by Newton's method."""
        at, which = at.copy(), np.ix_(free, free)
        value, gradient, curvature = self.derivatives(at[0], at[1], w)
        for _ in range(_STEPS):
            matrix, slope = -curvature[which], gradient[free]
            if np.linalg.eigvalsh(matrix)[0] <= 0.0:  # not concave here
                matrix = np.diag(np.abs(np.diag(matrix)) + np.abs(slope) + 1e-12)
            step = np.linalg.solve(matrix, slope)
            step *= min(1.0, 2.0 / max(abs(step[-1]), 1e-300))  # of ln sigma
            for _ in range(_STEPS):
                trial = at.copy()
                trial[free] += step
                with np.errstate(over="ignore", invalid="ignore"):
                    derivatives = self.derivatives(trial[0], trial[1], w)
                if derivatives[0] >= value or not np.any(
                    np.abs(step) > 1e-14 * (1.0 + np.abs(at[free]))
                ):
                    break
                step = 0.5 * step
            gain, at = derivatives[0] - value, trial
            value, gradient, curvature = derivatives
            if gain <= 1e-13 * (1.0 + abs(value)) and (np.abs(step) < 1e-9).all():
                break
        return at, value


def _normal(z: FloatArray, observed: BoolArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return log density, or log survival where censored, with two derivatives."""
    survival = scipy.special.log_ndtr(-z)
    density = -0.5 * z * z - 0.5 * math.log(2.0 * math.pi)
    hazard = np.exp(density - survival)
    return (
        np.where(observed, density, survival),
        np.where(observed, -z, -hazard),
        np.where(observed, -1.0, -hazard * (hazard - z)),
    )


def _extreme(z: FloatArray, observed: BoolArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    power = np.exp(z)
    return np.where(observed, z, 0.0) - power, observed - power, -power


#: log density, or log survival where censored, with two derivatives, of standardised logarithms
TERMS: dict[Family, _Terms] = {"log-normal": _normal, "Weibull": _extreme}


def fit_lives(family: Family, life: FloatArray, observed: BoolArray) -> LifeFit | None:
    """Fit a distribution to lives by maximum likelihood.

    Parameters
    ----------
    family : {"log-normal", "Weibull"}
    life : ndarray, shape (n,)
        Above zero; where censored, the time reached without failure.
    observed : ndarray of bool, shape (n,)
        False where censored.

    Returns
    -------
    LifeFit or None
        None without two different lives.

    Examples
    --------
    >>> lives = np.exp(np.linspace(-1.0, 1.0, 11))
    >>> fit = fit_lives("log-normal", lives, lives > 0)
    >>> print(f"{fit.mu:.3f} {fit.sigma:.3f}")
    0.000 0.632
    """
    if len(np.unique(life[observed])) < 2:
        return None
    sample = _Sample(family, np.log(life), np.asarray(observed, dtype=np.bool_))
    (mu, s), value = sample.maximum()
    return LifeFit(family, float(mu), math.exp(s), value, sample)


@dataclass(frozen=True)
class IntegratedFit(FittedLives):
    """Distribution fitted to lives whose wear factor is integrated exactly.

    Parameters
    ----------
    family, mu, sigma, log_likelihood
        As of `FittedLives`; the log likelihood is its expectation over the wear factor.
    sampling : ndarray, shape (2, 2)
        Covariance of the estimates of mu and ln sigma by the sampling of the realisations.
    degrees : float
        Its degrees of freedom.
    difference : float
        Greatest difference of its probabilities from the shares of the lives.
    """

    sampling: FloatArray
    degrees: float
    difference: float

    @property
    def covariance(self) -> FloatArray:
        """Covariance of the estimates of mu and ln sigma."""
        return self.sampling

    def interval(self, probability: float) -> Interval:
        """Return a quantile with its interval by Student's t of the logarithm."""
        w = standard_score(self.family, probability)
        gradient = np.array([1.0, self.sigma * w])
        error = math.sqrt(max(float(gradient @ self.covariance @ gradient), 0.0))
        best = self.mu + self.sigma * w
        ends = t_interval(best, error, self.degrees) if error else Interval(best, best, best)
        return Interval(*(math.exp(end) for end in (ends.value, ends.low, ends.high)))


def fit_mixture(family: Family, lives: FactorMixture) -> IntegratedFit | None:
    """Fit a distribution to lives whose wear factor is integrated exactly.

    The expected logarithm of the density is greatest: the likelihood of infinitely many wear
    factors for each realisation.

    Parameters
    ----------
    family : {"log-normal", "Weibull"}
    lives : FactorMixture

    Returns
    -------
    IntegratedFit or None
        None where a realisation fails at once or never, or all lives are equal.

    Notes
    -----
    The errors are those of an M-estimator over independent realisations, each with the mean of its
    score over the wear factor (White, Econometrica 50 (1982), DOI 10.2307/1912526).
    """
    if not lives.is_finite.all():
        return None
    shift = np.broadcast_to(np.asarray(lives.shift), lives.kappa.shape)
    factor = lives.score.log_quantile(shift[:, None] + lives.spread * _SCORES)
    logs = np.log(lives.kappa)[:, None] - factor
    count, weight = lives.count, np.broadcast_to(_SHARES, logs.shape)
    if np.ptp(logs) == 0.0:
        return None
    sample = _Sample(family, logs.ravel(), np.ones(logs.size, dtype=np.bool_), weight.ravel())
    (mu, s), value = sample.maximum()
    _, _, curvature = sample.derivatives(mu, s, 0.0)
    v = (logs - mu) * math.exp(-s)
    _, first, _ = TERMS[family](v, np.ones(v.shape, dtype=np.bool_))
    scores = np.stack([-(first * math.exp(-s)) @ _SHARES, -(first * v) @ _SHARES - 1.0])
    bread = np.linalg.inv(curvature)
    # with nothing else random there is no sampling error
    degrees = math.inf if lives.exact else max(count - 1.0, 1.0)
    meat = (scores @ scores.T) * (0.0 if lives.exact else count / degrees)
    fit = FittedLives(family, float(mu), math.exp(s), value)
    across = np.exp(np.quantile(logs, np.linspace(0.0, 1.0, _COMPARED)))
    difference = np.abs(fit.probability_before(across) - lives.failed(across).mean(axis=0)).max()
    return IntegratedFit(
        family, fit.mu, fit.sigma, value, bread @ meat @ bread, degrees, float(difference)
    )

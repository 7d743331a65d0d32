"""Log-normal and Weibull distributions of lives, fitted by maximum likelihood."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np

from wearsim.types import BoolArray, FloatArray
from wearsim.uq.estimation.intervals import UNKNOWN, Interval

Family: TypeAlias = Literal["log-normal", "Weibull"]
FAMILIES: tuple[Family, ...] = ("log-normal", "Weibull")

_DEVIANCE = 3.841458820694124  # 95 % quantile of chi-square with one degree of freedom
_STEPS = 60  # of Newton's method
_WIDEST = 1e3  # distance in standard errors at which the search for an end stops
_Terms: TypeAlias = Callable[[FloatArray, BoolArray], tuple[FloatArray, FloatArray, FloatArray]]


@dataclass(frozen=True)
class LifeFit:
    """Distribution of lives fitted by maximum likelihood.

    The logarithm of the life has the location mu and the scale sigma. The scale parameter of a
    Weibull distribution is exp(mu), its shape 1/sigma; the median of a log-normal one is exp(mu).

    Parameters
    ----------
    family : {"log-normal", "Weibull"}
    mu, sigma : float
    log_likelihood : float
        Of the lives, with their unit.
    sample : _Sample
    """

    family: Family
    mu: float
    sigma: float
    log_likelihood: float
    sample: _Sample

    @property
    def aic(self) -> float:
        """Akaike's information criterion; the family with the lower one fits better."""
        return 4.0 - 2.0 * self.log_likelihood

    def quantile(self, probability: float) -> float:
        """Return the life that a share `probability` does not reach."""
        return math.exp(self.mu + self.sigma * self.sample.score(probability))

    def probability_before(self, life: FloatArray) -> FloatArray:
        """Return the probability of a life below each of `life`, shape as `life`."""
        from scipy.special import ndtr  # noqa: PLC0415  (slow to load)

        with np.errstate(divide="ignore"):
            z = (np.log(life) - self.mu) / self.sigma
        return np.asarray(ndtr(z) if self.family == "log-normal" else -np.expm1(-np.exp(z)))

    def interval(self, probability: float) -> Interval:
        """Return a quantile with its likelihood-ratio interval.

        An end is infinite, or 0, where the likelihood does not fall sufficiently.

        Notes
        -----
        Meeker and Escobar, Statistical Methods for Reliability Data (1998), section 8.3.
        """
        from scipy.optimize import brentq  # noqa: PLC0415  (slow to load)

        w = self.sample.score(probability)
        best = self.mu + self.sigma * w
        _, gradient, curvature = self.sample.derivatives(best, math.log(self.sigma), w)
        del gradient
        information = -curvature
        error = math.sqrt(abs(information[1, 1] / np.linalg.det(information)))
        start = math.log(self.sigma)

        def excess(distance: float) -> float:
            top = self.sample.profile(best + distance * error, start, w)
            return 2.0 * (self.log_likelihood - top) - _DEVIANCE

        ends = []
        for side in (-1.0, 1.0):
            far = side
            while excess(far) < 0.0 and abs(far) < _WIDEST:
                far *= 2.0
            inside = abs(far) < _WIDEST
            at = brentq(excess, 0.5 * far if abs(far) > 1.0 else 0.0, far) if inside else math.nan
            ends.append(
                math.exp(best + at * error) if inside else (0.0 if side < 0.0 else math.inf)
            )
        return Interval(math.exp(best), *ends)


@dataclass(frozen=True, eq=False)
class _Sample:
    """Logarithms of lives with the log-likelihood of a family."""

    family: Family
    logs: FloatArray
    observed: BoolArray

    def score(self, probability: float) -> float:
        """Return the standardised logarithm of a quantile."""
        from scipy.special import ndtri  # noqa: PLC0415  (slow to load)

        if self.family == "log-normal":
            return float(ndtri(probability))
        return math.log(-math.log1p(-probability))

    def derivatives(self, q: float, s: float, w: float) -> tuple[float, FloatArray, FloatArray]:
        """Return log-likelihood, gradient and second derivatives in q and s = ln sigma.

        The location is q - w sigma, so that q is the logarithm of the quantile with the score w.
        """
        v = (self.logs - q) * math.exp(-s)
        value, first, second = _TERMS[self.family](v + w, self.observed)
        failures = int(self.observed.sum())
        total = float(value.sum()) - failures * s - float(self.logs[self.observed].sum())
        inverse, mixed = math.exp(-s), second * v + first
        gradient = np.array([-first.sum() * inverse, -(first * v).sum() - failures])
        across = mixed.sum() * inverse
        curvature = np.array([[second.sum() * inverse**2, across], [across, (mixed * v).sum()]])
        return total, gradient, curvature

    def profile(self, q: float, start: float, w: float) -> float:
        """Return the greatest log-likelihood with the quantile q."""
        return self._maximised(np.array([q, start]), w, [1])[1]

    def maximum(self, w: float = 0.0) -> tuple[FloatArray, float]:
        """Return location and ln sigma of the greatest log-likelihood, and its value."""
        found = self.logs[self.observed]
        start = np.array([self.logs.mean(), math.log(max(float(found.std()), 1e-12))])
        return self._maximised(start, w, [0, 1])

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
                    found = self.derivatives(trial[0], trial[1], w)
                if found[0] >= value or not np.any(np.abs(step) > 1e-14 * (1.0 + np.abs(at[free]))):
                    break
                step = 0.5 * step
            gain, at = found[0] - value, trial
            value, gradient, curvature = found
            if gain <= 1e-13 * (1.0 + abs(value)) and (np.abs(step) < 1e-9).all():
                break
        return at, value


def _normal(z: FloatArray, observed: BoolArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return log density, or log survival where censored, with two derivatives."""
    from scipy.special import log_ndtr  # noqa: PLC0415  (slow to load)

    survival = log_ndtr(-z)
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


_TERMS: dict[Family, _Terms] = {"log-normal": _normal, "Weibull": _extreme}


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


def fitted_quantile(fit: LifeFit | None, probability: float) -> Interval:
    """Return a quantile of a fit with its interval; unknown without a fit."""
    return UNKNOWN if fit is None else fit.interval(probability)

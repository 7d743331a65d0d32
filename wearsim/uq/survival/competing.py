"""Wear and pitting as competing risks of a life, with the wear factor integrated exactly.

At a wear factor K the damage of a realisation after n passes is D(n) = Psi(K n)/K, since a state
depends on K n alone; wear ends its life at n = kappa/K. With the Weibull slope e and the rate c of
pitting, -ln(1 - P_ref) at a damage of one, the probabilities are the means over the realisations of

    P(survive) = integral of f(K) 1[K n < kappa] exp(-c D(n)^e),
    P(pitting first) = integral of f(K) (1 - exp(-c D(min(n, kappa/K))^e)),
    P(wear first) = integral of f(K) 1[K n >= kappa] exp(-c D(kappa/K)^e).

Their sum is one. The integrals are taken over the distribution function of K by Gauss's quadrature,
in two parts with the border at K = kappa/n. Cause-specific incidences of pitting level off where
the damage does, since wear lowers the pressure.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache, cached_property
from typing import Any, Literal, NamedTuple

import numpy as np
import scipy

from wearsim.types import FloatArray
from wearsim.uq.estimation.intervals import Interval
from wearsim.uq.survival.distributions import logit_interval
from wearsim.uq.survival.effective import LEAST_NUMBER, effective_number
from wearsim.uq.survival.scores import ScoreFunction

POINTS, DECADES = 121, 6.0  # of a course, over the passes before its end
NODES = 32  # of the quadrature over each part of the distribution function
_EQUAL = 1e-10  # relative error of a life
_SHORTEST = 1e-30  # life below which it is zero, over the median one

Cause = Literal["both", "pitting", "wear", "without_wear"]
"""Ends of lives: the first of wear and pitting, each of them if it is first, pitting of bodies that
do not wear."""


def course_places() -> FloatArray:
    """Return the passes of a course over those at its end, geometric, shape (POINTS,)."""
    return np.asarray(10.0 ** np.linspace(-DECADES, 0.0, POINTS))


@cache
def _quadrature(nodes: int) -> tuple[FloatArray, FloatArray]:
    """Return places from 0 to 1 and weights of Gauss's quadrature."""
    x, weight = np.polynomial.legendre.leggauss(nodes)
    return 0.5 * (1.0 + x), 0.5 * weight


class Incidence(NamedTuple):
    """Probabilities of survival and, cause-specific, of pitting and of wear as the first end."""

    survival: Any
    pitting: Any
    wear: Any


@dataclass(frozen=True, eq=False)
class CompetingRisks:
    """Wear and pitting of realisations.

    Parameters
    ----------
    damage : ndarray, shape (realisations, POINTS)
        Effective damage along a test with the factor `reference`, at `course_places`.
    end : ndarray, shape (realisations,)
        Passes at the end of each course; the limit of wear where `worn`.
    worn : ndarray of bool, shape (realisations,)
        Whether the course ends at a limit of wear; no wear ends the others.
    rate : ndarray, shape (realisations,)
        Effective damage per pass without wear.
    slope : float
        Weibull slope e.
    probability : float
        Probability P_ref of pitting at a damage of one.
    score : ScoreFunction, optional
        Normal score of the distribution function of the wear factor; without it, lives are counted
        at the factor of each realisation.
    reference : float
        Wear factor of the courses.
    shift, spread : ndarray or float, float
        Of the score given the other inputs, see `FactorMixture`.
    alone : bool
        Whether nothing else is random, so that lives have no sampling error.
    """

    damage: FloatArray
    end: FloatArray
    worn: FloatArray
    rate: FloatArray
    slope: float
    probability: float
    score: ScoreFunction | None = None
    reference: float = 1.0
    shift: FloatArray | float = 0.0
    spread: float = 1.0
    alone: bool = False

    @property
    def constant(self) -> float:
        """Rate c of pitting."""
        return -math.log1p(-self.probability)

    def at(self, life: float, nodes: int = NODES) -> Incidence:
        """Return the probabilities at a life [passes], the means over the realisations.

        Parameters
        ----------
        life : float
            Infinite for the levels that the incidences reach.
        nodes : int
            Of the quadrature.
        """
        survival, _, wear = (float(part.mean()) for part in self.of_realisations(life, nodes))
        return Incidence(survival, 1.0 - survival - wear, wear)

    def of_realisations(self, life: float, nodes: int = NODES) -> Incidence:
        """Return the probabilities of `at` of each realisation, of shape (realisations,)."""
        if self.score is None:
            return self._counted(life)
        part, weight = _quadrature(nodes)
        border = self._below(self.end / life if life > 0.0 else np.full_like(self.end, np.inf))
        border = np.where(self.worn, border, 1.0)[:, None]
        if math.isinf(life):
            border = np.where(self.worn, 0.0, 1.0)[:, None]
        low = self._factors(border * part)
        high = self._factors(border + (1.0 - border) * part)
        alive = self._no_pit(np.minimum(life * low, self.end[:, None]), low)
        late = self._no_pit(np.broadcast_to(self.end[:, None], high.shape), high)
        survival = border[:, 0] * (alive @ weight)
        wear = (1.0 - border[:, 0]) * (late @ weight)
        return Incidence(survival, 1.0 - survival - wear, wear)

    def before(self, life: float, cause: Cause) -> FloatArray:
        """Return each realisation's probability of an end before a life, shape (realisations,)."""
        if cause == "without_wear":
            with np.errstate(invalid="ignore"):  # bodies without damage never pit
                damage = np.where(self.rate > 0.0, self.rate * life, 0.0)
            return np.asarray(-np.expm1(-self.constant * damage**self.slope))
        found = self.of_realisations(life)
        return np.asarray(1.0 - found.survival if cause == "both" else getattr(found, cause))

    def life(self, share: float, cause: Cause) -> Interval:
        """Return the life [passes] that a share of the specimens does not reach, with its interval.

        Parameters
        ----------
        share : float
            0.1 for B10.
        cause : str

        Returns
        -------
        Interval
            Infinite where the incidence levels off below the share. The ends are those of
            `LifeDistribution.quantile`; unknown if the effective number of realisations is too
            small.
        """
        value = self._reached(share, cause)
        if self.alone:
            return Interval(value, value, value)
        # just above, so that a step of the probability is included
        chances = self.before(value * (1.0 + _EQUAL), cause)
        count, mean = len(chances), float(chances.mean())
        variance = float(chances.var(ddof=1)) if count > 1 else math.inf
        few = effective_number(count, mean, variance) < LEAST_NUMBER
        if count < 2 or (few and self.score is not None):
            return Interval(value, 0.0, math.inf)
        ends = logit_interval(share, math.sqrt(variance / count), count - 1)
        low, high = self._reached(ends.low, cause), self._reached(ends.high, cause)
        return Interval(value, min(low, value), max(high, value))

    def _reached(self, share: float, cause: Cause) -> float:
        """Return the life at which the mean probability of an end reaches a share."""

        def excess(log: float) -> float:
            return float(self.before(math.exp(log), cause).mean()) - share

        if float(self.before(math.inf, cause).mean()) < share:
            return math.inf
        start = math.log(float(np.median(self.end)))
        low = high = start
        while excess(high) < 0.0:
            low, high = high, high + math.log(4.0)
        while excess(low) >= 0.0:
            low, high = low - math.log(4.0), low
            if low < start + math.log(_SHORTEST):
                return 0.0
        root = float(scipy.optimize.brentq(excess, low, high, xtol=0.5 * _EQUAL))
        return math.exp(root if excess(root) >= 0.0 else min(root + _EQUAL, high))

    def _counted(self, life: float) -> Incidence:
        """Return the probabilities of realisations at a life, with their own factors."""
        factors = np.ones((len(self.end), 1))
        ended = self.worn.astype(np.bool_) & (self.end <= life)
        alive = self._no_pit(np.minimum(life, self.end)[:, None], factors)[:, 0]
        survival, wear = alive * ~ended, alive * ended
        return Incidence(survival, 1.0 - survival - wear, wear)

    def _below(self, ratio: FloatArray) -> FloatArray:
        """Return the probability of a factor below `ratio` times the reference, (realisations,)."""
        assert self.score is not None
        return np.asarray(
            scipy.special.ndtr((self.score(ratio * self.reference) - self.shift) / self.spread)
        )

    def _factors(self, chance: FloatArray) -> FloatArray:
        """Return factors over the reference at probabilities, shape (realisations, nodes)."""
        assert self.score is not None
        shift = np.broadcast_to(np.asarray(self.shift), self.end.shape)[:, None]
        score = shift + self.spread * scipy.special.ndtri(np.clip(chance, 1e-300, 1.0 - 1e-16))
        return np.asarray(np.exp(self.score.log_quantile(score)) / self.reference)

    @cached_property
    def _logs(self) -> FloatArray:
        """Logarithms of the damage."""
        return np.log(np.maximum(self.damage, 1e-300))

    def _no_pit(self, passes: FloatArray, ratio: FloatArray) -> FloatArray:
        """Return the probability of no pit, (realisations, nodes).

        Parameters
        ----------
        passes : ndarray, shape (realisations, nodes)
            Passes at the reference factor.
        ratio : ndarray, shape (realisations, nodes)
            Factor over the reference.
        """
        step = DECADES / (POINTS - 1)
        least = self.end[:, None] * 10.0**-DECADES
        place = np.log10(np.maximum(passes, least) / least) / step
        first = np.minimum(place.astype(np.int64), POINTS - 2)
        rows = np.arange(len(self.end))[:, None]
        low, high = self._logs[rows, first], self._logs[rows, first + 1]
        damage = np.exp(low + (place - first) * (high - low))
        # before its first point, damage is proportional to the passes
        damage *= np.minimum(passes / least, 1.0) / ratio
        return np.asarray(np.exp(-self.constant * damage**self.slope))

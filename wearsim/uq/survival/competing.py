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
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import scipy

from wearsim.types import FloatArray
from wearsim.uq.survival.scores import ScoreFunction

POINTS, DECADES = 121, 6.0  # of a course, over the passes before its end
NODES = 32  # of the quadrature over each part of the distribution function
_HALVINGS = 200
_EQUAL = 1e-9  # relative width of an interval that holds a life


def course_places() -> FloatArray:
    """Return the passes of a course over those at its end, geometric, shape (POINTS,)."""
    return np.asarray(10.0 ** np.linspace(-DECADES, 0.0, POINTS))


class Incidence(NamedTuple):
    """Probabilities of survival and, cause-specific, of pitting and of wear as the first end."""

    survival: float
    pitting: float
    wear: float


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

    @property
    def constant(self) -> float:
        """Rate c of pitting."""
        return -math.log1p(-self.probability)

    def at(self, life: float, nodes: int = NODES) -> Incidence:
        """Return the probabilities at a life [passes].

        Parameters
        ----------
        life : float
            Infinite for the levels that the incidences reach.
        nodes : int
            Of the quadrature.
        """
        if self.score is None:
            return self._counted(life)
        x, weight = np.polynomial.legendre.leggauss(nodes)
        part, weight = 0.5 * (1.0 + x), 0.5 * weight
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
        means = float(survival.mean()), float(wear.mean())
        return Incidence(means[0], 1.0 - means[0] - means[1], means[1])

    def either(self, life: float) -> float:
        """Return the probability of an end by wear or by pitting before a life."""
        return 1.0 - self.at(life).survival

    def without_wear(self, life: float) -> float:
        """Return the probability of pitting before a life of bodies that do not wear."""
        survives = np.exp(-self.constant * (self.rate * life) ** self.slope)
        return float(1.0 - survives.mean())

    def life(self, share: float, incidence: Callable[[float], float]) -> float:
        """Return the life at which a rising incidence reaches a share; infinite if it never does.

        Parameters
        ----------
        share : float
        incidence : callable
            Function of the life [passes].
        """
        if incidence(math.inf) < share:
            return math.inf
        high = float(np.median(self.end))
        while incidence(high) < share:
            high *= 4.0
        low = 0.0
        for _ in range(_HALVINGS):
            middle = 0.5 * (low + high) if low == 0.0 else math.sqrt(low * high)
            low, high = (middle, high) if incidence(middle) < share else (low, middle)
            if high - low <= _EQUAL * high:
                break
        return high

    def _counted(self, life: float) -> Incidence:
        """Return the probabilities at a life with the factor of each realisation."""
        factors = np.ones((len(self.end), 1))
        ended = self.worn.astype(np.bool_) & (self.end <= life)
        passes = np.minimum(life, self.end)[:, None]
        alive = self._no_pit(passes, factors)[:, 0]
        survival, wear = float(np.mean(alive * ~ended)), float(np.mean(alive * ended))
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
        logs = np.log(np.maximum(self.damage, 1e-300))
        rows = np.arange(len(self.end))[:, None]
        low, high = logs[rows, first], logs[rows, first + 1]
        damage = np.exp(low + (place - first) * (high - low))
        # before its first point, damage is proportional to the passes
        damage *= np.minimum(passes / least, 1.0) / ratio
        return np.asarray(np.exp(-self.constant * damage**self.slope))

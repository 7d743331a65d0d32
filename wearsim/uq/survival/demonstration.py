"""Demonstration tests: specimens and duration that show a survival with a confidence.

With k failures allowed, n specimens show a survival R if at most k failures have a probability of
1 - C or less where the survival is just R. Tested for L times the life, specimens survive with the
probability S(L q), where q is the life at which the survival S of the simulated design is R: the
simulation gives the shape of the distribution, and its scale is what is shown.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import scipy

from wearsim.types import FloatArray
from wearsim.uq.survival.distributions import FactorMixture, LifeDistribution
from wearsim.uq.survival.two_levels import UncertainLives

MOST_SPECIMENS = 1_000_000
_DRAWS = 200  # of realisations, and of median and scatter of the wear factor
_SEED = 1959  # of these draws
_POINTS = 241  # of a curve
_TAIL = 6.0  # scores of a curve
_STEP = 1e-9  # of ln life to both sides of a step of the probability


def specimens(confidence: float, survival: FloatArray, failures: int = 0) -> int | None:
    """Return the fewest specimens that show a survival.

    Parameters
    ----------
    confidence : float
    survival : ndarray, shape (draws,)
        Probability that a specimen survives the test if the survival to show is just met; several
        values, equally probable, where it is not known.
    failures : int
        Number of failures that are allowed.

    Returns
    -------
    int or None
        None if it is greater than a million, or not known.

    Notes
    -----
    Without failures and for a known survival, ln(1 - C)/ln(survival) (Nelson, Applied Life Data
    Analysis (1982), chapter 6).

    Examples
    --------
    >>> [specimens(0.95, np.array([0.9]), failures) for failures in (0, 1, 2)]
    [29, 46, 61]
    """
    if not np.isfinite(survival).all():
        return None

    def chance(count: int) -> float:
        return float(scipy.special.bdtr(failures, count, 1.0 - survival).mean())

    low, high = failures, failures + 1
    while chance(high) > 1.0 - confidence:
        low, high = high, 2 * high
        if low >= MOST_SPECIMENS:
            return None
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (middle, high) if chance(middle) > 1.0 - confidence else (low, middle)
    return high


def pass_probability(count: int, failures: int, failed: FloatArray) -> FloatArray:
    """Return the probability of at most so many failures of specimens, shape as `failed`.

    Parameters
    ----------
    count, failures : int
        Specimens, and failures that are allowed.
    failed : ndarray
        Probability that a specimen fails in the test.
    """
    return np.asarray(scipy.special.bdtr(failures, count, failed))


@dataclass(frozen=True, eq=False)
class DrawnLives:
    """Distributions of lives that are equally probable, by what is not known of them.

    Parameters
    ----------
    logs, scores : ndarray, shape (draws, points)
        Logarithms of lives, and normal scores of the probability of a shorter one.
    shift : ndarray, shape (draws,)
        Mean of ln K by which the lives of a draw are shorter; 0 where it is known.
    most : float
        Life up to which they are known.
    """

    logs: FloatArray
    scores: FloatArray
    shift: FloatArray
    most: float

    def log_quantile(self, probability: float) -> FloatArray:
        """Return the logarithm of the life that a share does not reach, nan if it is not known."""
        score = float(scipy.special.ndtri(probability))
        pairs = zip(self.scores, self.logs, strict=True)
        log = np.array([np.interp(score, *pair, right=math.nan) for pair in pairs])
        return np.where(log - self.shift <= math.log(self.most), log - self.shift, math.nan)

    def failed(self, log: FloatArray) -> FloatArray:
        """Return the probability of a shorter life than exp(log) of each draw, shape (draws,)."""
        items = zip(log + self.shift, self.logs, self.scores, strict=True)
        chance = scipy.special.ndtr(np.array([np.interp(*item) for item in items]))
        return np.where(log <= math.log(self.most), chance, math.nan)


def drawn_lives(
    lives: LifeDistribution, uncertain: UncertainLives | None, most: float = math.inf
) -> DrawnLives:
    """Return distributions of lives by draws of the realisations and of the wear factor.

    Draws of designs with as many realisations are common: of the same realisations, if their
    numbers are the same, and of the same median and scatter.

    Parameters
    ----------
    lives : LifeDistribution
    uncertain : UncertainLives, optional
        For all medians and scatters of the wear factor, if they are not known.
    most : float
        Life up to which they are known.
    """
    rng = np.random.default_rng(_SEED)
    draws = _DRAWS if uncertain is not None or not lives.exact else 1
    sampled = draws > 1 and lives.count > 1 and not lives.exact
    counts = rng.multinomial(lives.count, np.full(lives.count, 1.0 / lives.count), draws)
    weights = counts / lives.count if sampled else np.full((draws, lives.count), 1.0 / lives.count)
    if uncertain is None:
        logs, failed = _curves(lives)
        rows = np.broadcast_to(logs, (draws, len(logs)))
        return DrawnLives(rows, _scores(weights @ failed), np.zeros(draws), most)
    levels, curves = uncertain.levels, []
    below = np.cumsum(levels.weight)
    places = np.searchsorted(below, (rng.permutation(draws) + 0.5) / draws * below[-1])
    for weight, t in zip(weights, levels.t[places], strict=True):
        logs, failed = _curves(uncertain.given(0.0, float(t)))
        curves.append((logs, _scores(weight @ failed)))
    rows, scores = (np.array(items) for items in zip(*curves, strict=True))
    return DrawnLives(rows, scores, levels.m[places], most)


def _curves(lives: LifeDistribution) -> tuple[FloatArray, FloatArray]:
    """Return logarithms of lives, and the probability of a shorter one of each realisation."""
    steps = lives.steps
    at = np.log(steps[(steps > 0.0) & np.isfinite(steps)])
    if isinstance(lives, FactorMixture) and lives.is_finite.any():
        log, reach = np.log(lives.kappa[lives.is_finite]), _TAIL + np.abs(lives.shift).max()
        low = float(log.min() - lives.score.log_quantile(reach))
        high = float(log.max() - lives.score.log_quantile(-reach))
    else:
        low, high = (float(at.min()) - 1.0, float(at.max()) + 1.0) if len(at) else (0.0, 1.0)
    logs = np.unique(np.concatenate([np.linspace(low, high, _POINTS), at - _STEP, at + _STEP]))
    return logs, lives.failed(np.exp(logs))


def _scores(failed: FloatArray) -> FloatArray:
    return np.asarray(scipy.special.ndtri(np.clip(failed, 1e-12, 1.0 - 1e-12)))

"""Anderson-Darling test of distributions fitted to lives, also where lives are censored."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from wearsim.types import BoolArray, FloatArray
from wearsim.uq.survival.fits import TERMS, Family, LifeFit, standard_probability

_SAMPLES = 1000  # simulated ones
_MOST = 100  # lives of a simulated sample
_STEPS = 30  # of Newton's method
_FEWEST = 8  # lives that ended
_SEED = 1952  # of simulated samples


class AndersonDarling(NamedTuple):
    """Statistic of Anderson and Darling, and the probability of a greater one if the fit holds."""

    statistic: float
    probability: float


def anderson_darling(fit: LifeFit) -> AndersonDarling | None:
    """Return the test of Anderson and Darling of a fitted distribution.

    Parameters
    ----------
    fit : LifeFit
        Lives may be censored, all at the same life.

    Returns
    -------
    AndersonDarling or None
        None with fewer than eight lives that ended, or lives that are censored at several ages.

    Notes
    -----
    With censored lives, the statistic of Pettitt and Stephens (Biometrika 63 (1976), DOI
    10.1093/biomet/63.2.291). The probability is that of 1000 simulated samples, each with its own
    fit, of at most 100 lives: that of more lives hardly differs.

    Examples
    --------
    >>> from wearsim.uq.survival.fits import fit_lives
    >>> lives = np.exp(np.linspace(-1.0, 1.0, 40))
    >>> found = anderson_darling(fit_lives("log-normal", lives, lives > 0))
    >>> print(f"{found.statistic:.2f} {found.probability:.2f}")
    0.46 0.28
    """
    sample = fit.sample
    ended, censored = sample.logs[sample.observed], sample.logs[~sample.observed]
    if len(ended) < _FEWEST or (len(censored) and np.ptp(censored) > 0.0):
        return None
    end = math.inf if not len(censored) else float((censored[0] - fit.mu) / fit.sigma)
    count, scores = len(sample.logs), np.sort((ended - fit.mu) / fit.sigma)
    statistic = _statistic(fit.family, scores, count, end)
    simulated = _simulated(fit.family, min(count, _MOST), round(end, 1))
    return AndersonDarling(statistic, float((simulated >= statistic).mean()))


def _statistic(family: Family, scores: FloatArray, count: int, end: float) -> float:
    """Return the statistic of ordered scores, those above `end` of `count` being censored."""
    below = np.clip(standard_probability(family, scores), 1e-300, 1.0 - 1e-16)
    failures, rank = len(scores), 2.0 * np.arange(1, len(scores) + 1) - 1.0
    total = -(rank @ (np.log(below) - np.log1p(-below))) / count - 2.0 * np.log1p(-below).sum()
    last = 1.0 if math.isinf(end) else float(standard_probability(family, np.array([end]))[0])
    left = count - failures
    beyond = left**2 * math.log1p(-last) if left else 0.0
    beyond += count**2 * last - (failures**2 * math.log(last) if failures else 0.0)
    return float(total - beyond / count)


@lru_cache(maxsize=64)
def _simulated(family: Family, count: int, end: float) -> FloatArray:
    """Return statistics of samples of the standard distribution, censored at a score."""
    from scipy.special import ndtri  # noqa: PLC0415  (slow to load)

    uniform = np.random.default_rng(_SEED).random((_SAMPLES, count))
    drawn = ndtri(uniform) if family == "log-normal" else np.log(-np.log1p(-uniform))
    drawn.sort(axis=1)
    observed = drawn <= end
    values = np.minimum(drawn, end)
    kept = observed.sum(axis=1) >= 2
    location, scale = _fitted(family, values[kept], observed[kept])
    fitted = zip(values[kept], observed[kept], location, scale, strict=True)
    return np.array(
        [
            _statistic(family, (row[seen] - mu) / sigma, count, (end - mu) / sigma)
            for row, seen, mu, sigma in fitted
        ]
    )


def _fitted(
    family: Family, values: FloatArray, observed: BoolArray
) -> tuple[FloatArray, FloatArray]:
    """Return location and scale of each sample by Newton's method, shapes (samples,).

    The log-likelihood is concave in 1/scale and location/scale.
    """
    failures = observed.sum(axis=1)
    slope, cut = np.ones(len(values)), np.zeros(len(values))  # score = slope * value - cut
    for _ in range(_STEPS):
        _, first, second = TERMS[family](slope[:, None] * values - cut[:, None], observed)
        gradient = np.stack(
            [(first * values).sum(axis=1) + failures / slope, -first.sum(axis=1)], axis=1
        )
        across = -(second * values).sum(axis=1)
        along = (second * values**2).sum(axis=1) - failures / slope**2
        matrix = np.array([[along, across], [across, second.sum(axis=1)]]).transpose(2, 0, 1)
        step = np.linalg.solve(matrix, -gradient[:, :, None])[:, :, 0]
        # the slope stays above a third of its value
        part = np.minimum(1.0, 0.67 * slope / np.maximum(-step[:, 0], 1e-300))
        slope, cut = slope + part * step[:, 0], cut + part * step[:, 1]
        if np.abs(step).max() < 1e-9:
            break
    return cut / slope, 1.0 / slope

"""Normal scores of a distribution function, exact where it has steps and gaps."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from wearsim.types import FloatArray
from wearsim.uq.distributions.base import Distribution

_GRID = np.linspace(-8.2, 8.2, 16_401)  # scores at which a quantile function is first tabulated
_TOLERANCE = 1e-8  # error of an interpolated score
_STEP = 0.3  # bend of an interval, relative to its rise, from which it has a step
_EQUAL = 1e-9  # rise of the logarithm below which an interval has no step
_NARROWEST = 1e-13  # interval of scores that is not divided further
_HALVINGS = 60
_ATOM = 1e-9  # probability from which equal quantiles are an atom


@dataclass(frozen=True, eq=False)
class ScoreFunction:
    """Normal score of a distribution function, from its quantile function.

    A call takes values, and returns the score of the probability of a value that is not above
    them. It is infinite outside the support.

    Parameters
    ----------
    logs, scores : ndarray, shape (points,)
        Logarithm of the quantiles and their normal scores, both ascending, interpolated between. An
        atom has two points, the first one below it by rounding.
    atoms : ndarray
        Values that have a probability above zero, ascending.
    """

    logs: FloatArray
    scores: FloatArray
    atoms: FloatArray

    def __call__(self, value: FloatArray) -> FloatArray:
        """Return the scores of positive values, shape as `value`."""
        with np.errstate(divide="ignore"):
            log = np.log(value)
        return np.asarray(np.interp(log, self.logs, self.scores, left=-math.inf, right=math.inf))

    def log_quantile(self, score: FloatArray | float) -> FloatArray:
        """Return the logarithm of the quantile of a normal score."""
        return np.asarray(np.interp(score, self.scores, self.logs))


def score_function(distribution: Distribution) -> ScoreFunction:
    """Return the normal score of the distribution function, for any quantile function.

    Parameters
    ----------
    distribution : Distribution
        Of a positive number: continuous, discrete or mixed, with or without gaps.

    Returns
    -------
    ScoreFunction
        Interpolated in the logarithm of the value, which is exact for a log-normal distribution.
        Intervals are halved until the interpolation is accurate to 1e-8, at steps to rounding.

    Examples
    --------
    >>> class Coin(Distribution):
    ...     def quantile(self, probability):
    ...         return np.where(probability <= 0.5, 1.0, 3.0)
    >>> score = score_function(Coin())
    >>> score(np.array([0.9, 1.0, 2.0, 3.0])).round(3), score.atoms
    (array([-inf, 0. , 0. , 8.2]), array([1., 3.]))
    """
    from scipy.special import ndtr  # noqa: PLC0415  (slow to load)

    def log_at(scores: FloatArray) -> FloatArray:
        values = np.asarray(distribution.quantile(ndtr(scores)), dtype=float)
        return np.asarray(np.log(np.maximum(values, np.finfo(float).tiny)))

    scores, logs = _GRID, np.maximum.accumulate(log_at(_GRID))
    added: list[tuple[FloatArray, FloatArray]] = [(scores, logs)]
    ends = scores[:-1], scores[1:], logs[:-1], logs[1:]
    for _ in range(_HALVINGS):
        first, last, below, above = ends
        middle = 0.5 * (first + last)
        log = np.clip(log_at(middle), below, above)
        rise, width = above - below, last - first
        with np.errstate(divide="ignore", invalid="ignore"):
            bent = np.where(rise > 0.0, np.abs(log - 0.5 * (below + above)) / rise, 0.0)
        spacing = _spacing(middle)
        rough = bent * width > np.maximum(_TOLERANCE, 4.0 * spacing)
        rough |= (bent > _STEP) & (rise > _EQUAL) & (width > np.maximum(_NARROWEST, 8.0 * spacing))
        if not rough.any():
            break
        added.append((middle[rough], log[rough]))
        halves = (first, middle, below, log), (middle, last, log, above)
        ends = tuple(  # type: ignore[assignment]
            np.concatenate([lower_half[rough], upper_half[rough]])
            for lower_half, upper_half in zip(*halves, strict=True)
        )
    scores, logs = (np.concatenate(items) for items in zip(*added, strict=True))
    order = np.argsort(scores, kind="stable")
    scores, logs = scores[order], np.maximum.accumulate(logs[order])
    # of equal quantiles, the first and the last are kept
    inner = np.append(False, np.append((logs[1:-1] == logs[:-2]) & (logs[1:-1] == logs[2:]), False))
    logs, scores = logs[~inner], scores[~inner]
    flat = np.flatnonzero(np.diff(logs) == 0.0)
    atoms = np.exp(logs[flat[ndtr(scores[flat + 1]) - ndtr(scores[flat]) > _ATOM]])
    logs[flat] = np.nextafter(logs[flat], -math.inf)
    return ScoreFunction(logs, scores, atoms)


def _spacing(score: FloatArray) -> FloatArray:
    """Return the difference of scores whose probabilities differ by the rounding of 1."""
    return np.asarray(np.finfo(float).eps * math.sqrt(2.0 * math.pi) * np.exp(0.5 * score**2))

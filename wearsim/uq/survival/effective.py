"""Effective number of realisations of a small probability, predicted from fits of ln kappa.

The mean of the probabilities of a sample hardly contains its rare, large terms, so that their
scatter cannot show how uncertain the mean is. Here ln kappa is a polynomial of a normal score,
fitted to the whole sample, and the scatter is that of the fit.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from wearsim.types import FloatArray

LEAST_NUMBER = 20.0  # effective number below which no probability is stated
_CONFIDENCE = 0.9  # of the upper limit of the spread, by which a probability is refused
_FEWEST = 8  # finite values for a fit with a quadratic term
_SCORES = np.linspace(-9.0, 9.0, 721)
_DENSITY = np.exp(-0.5 * _SCORES**2) / np.exp(-0.5 * _SCORES**2).sum()


def effective_number(count: int, mean: float, variance: float) -> float:
    """Return the number of counted events that would have the variation of a mean.

    Parameters
    ----------
    count : int
        Independent terms of the mean.
    mean, variance : float
        Of the terms, which are probabilities from 0 to 1. The variation is that of the less
        probable of event and opposite.

    Examples
    --------
    >>> print(f"{effective_number(400, 1e-4, 1e-8):.0f}")
    400
    """
    least = min(mean, 1.0 - mean)
    return math.inf if variance <= 0.0 else count * least**2 / variance


def fits_of(log: FloatArray, cautious: bool = False) -> list[FloatArray]:
    """Return fits of a sample as polynomials of a normal score, at equidistant scores.

    Parameters
    ----------
    log : ndarray, shape (n,)
        Finite values of ln kappa.
    cautious : bool
        Whether the spread is the upper 90 % limit of that of normal values, instead of its
        estimate.

    Returns
    -------
    list of ndarray
        A line by mean and standard deviation, and from 8 values on a parabola by least squares to
        the ordered values.
    """
    from scipy.special import gammaincinv, ndtri  # noqa: PLC0415  (slow to load)

    count = len(log)
    if count < 2:
        return [np.full_like(_SCORES, log.mean() if count else 0.0)]
    centre, found = float(log.mean()), [log.std(ddof=1) * _SCORES]
    if count >= _FEWEST:
        ordered, scores = np.sort(log) - centre, ndtri((np.arange(count) + 0.625) / (count + 0.25))
        found.append(np.polyval(np.polyfit(scores, ordered, 2), _SCORES))
    degrees = count - 1
    # of the chi-squared distribution of the variance
    lower = 2.0 * float(gammaincinv(0.5 * degrees, 1.0 - _CONFIDENCE)) / degrees
    widening = 1.0 / math.sqrt(lower) if cautious else 1.0
    return [centre + widening * one for one in found]


def predicted_number(
    fits: Sequence[FloatArray],
    probability: Callable[[FloatArray], FloatArray],
    shares: tuple[float, float],
    count: int,
) -> float:
    """Return the least effective number of the fits.

    Parameters
    ----------
    fits : sequence of ndarray
        See `fits_of`.
    probability : callable
        Probability of failure for values of ln kappa.
    shares : (float, float)
        Share of the sample with a probability of one, and share with that of the fits; that of the
        others is zero.
    count : int
        Realisations.
    """
    sure, fitted = shares
    numbers = []
    for fit in fits:
        each = probability(fit)
        inner = float(_DENSITY @ each)
        mean = sure + fitted * inner
        terms = fitted * float(_DENSITY @ (each - mean) ** 2)
        variance = sure * (1.0 - mean) ** 2 + terms + (1.0 - sure - fitted) * mean**2
        numbers.append(effective_number(count, mean, variance))
    return min(numbers)

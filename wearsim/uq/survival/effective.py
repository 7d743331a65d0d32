"""Effective number of realisations of a small probability, predicted from fits of ln kappa.

The mean of the probabilities of a sample hardly contains its rare, large terms, so that their
scatter cannot show how uncertain the mean is. Here ln kappa is a polynomial of a normal score,
fitted to the whole sample, and the scatter is that of the fit.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from wearsim.types import FloatArray

LEAST_NUMBER = 20.0  # effective number below which no probability is stated
_CONFIDENCE = 0.9  # of the upper limit of the spread, by which a probability is refused
_WIDENED = 0.01, 0.05  # probabilities to which and from which the spread is widened for intervals
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
    return math.inf if variance <= 0.0 else count * min(mean, 1.0 - mean) ** 2 / variance


class Fits(NamedTuple):
    """Fits of a sample as polynomials of a normal score.

    Parameters
    ----------
    centre : float
        Mean of the sample.
    shapes : list of ndarray
        Differences from it at equidistant scores.
    widening : float
        Upper 90 % limit of the spread of normal values over its estimate.
    """

    centre: float
    shapes: list[FloatArray]
    widening: float

    def values(self, caution: float) -> list[FloatArray]:
        """Return the values of each fit at equidistant scores.

        Parameters
        ----------
        caution : float
            0 for the estimated spread, 1 for its upper limit.
        """
        return [self.centre + self.widening**caution * shape for shape in self.shapes]


def fits_of(log: FloatArray) -> Fits:
    """Return fits of a sample: by mean and standard deviation, from 8 values on also by a parabola.

    Parameters
    ----------
    log : ndarray, shape (n,)
        Finite values of ln kappa.
    """
    from scipy.special import gammaincinv, ndtri  # noqa: PLC0415  (slow to load)

    count = len(log)
    if count < 2:
        return Fits(float(log.mean()) if count else 0.0, [np.zeros_like(_SCORES)], 1.0)
    centre, fits = float(log.mean()), [log.std(ddof=1) * _SCORES]
    if count >= _FEWEST:
        ordered, scores = np.sort(log) - centre, ndtri((np.arange(count) + 0.625) / (count + 0.25))
        fits.append(np.polyval(np.polyfit(scores, ordered, 2), _SCORES))
    degrees = count - 1
    # of the chi-squared distribution of the variance
    lower = 2.0 * float(gammaincinv(0.5 * degrees, 1.0 - _CONFIDENCE)) / degrees
    return Fits(centre, fits, 1.0 / math.sqrt(lower))


def caution(probability: float) -> float:
    """Return how far the spread of the fits is widened towards its limit for an interval.

    A small probability is stated where the spread of the sample is small, also by chance; that of a
    probability in the bulk of the sample is shown by the sample itself.
    """
    least = max(min(probability, 1.0 - probability), 1e-300)
    return float(np.interp(math.log(least), np.log(_WIDENED), [1.0, 0.0]))


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
        See `Fits.values`.
    probability : callable
        Probability of failure for values of ln kappa.
    shares : (float, float)
        Share of the sample with a probability of one, and share with that of the fits; that of the
        others is zero.
    count : int
        Realisations.
    """
    (sure, fitted), numbers = shares, []
    for fit in fits:
        failed = probability(fit)
        mean = sure + fitted * float(_DENSITY @ failed)
        terms = fitted * float(_DENSITY @ (failed - mean) ** 2)
        variance = sure * (1.0 - mean) ** 2 + terms + (1.0 - sure - fitted) * mean**2
        numbers.append(effective_number(count, mean, variance))
    return min(numbers)

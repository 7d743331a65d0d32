"""Base classes of distributions, and maximum entropy with closed quantile functions."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from functools import cached_property

import numpy as np

from wearsim.types import FloatArray

_STEEP = 40.0  # fall of the log density from which values near the upper end cannot be drawn


class Distribution(ABC):
    """Distribution of a random number, given by its quantile function; values in SI units."""

    @abstractmethod
    def quantile(self, probability: FloatArray) -> FloatArray:
        """Return the quantiles.

        Parameters
        ----------
        probability : ndarray
            0 to 1; the quantiles at 0 and 1 are the ends of the support, which may be infinite.

        Returns
        -------
        ndarray, shape as `probability`
        """

    @cached_property
    def support(self) -> tuple[float, float]:
        """Minimum and maximum."""
        low, high = self.quantile(np.array([0.0, 1.0]))
        return float(low), float(high)

    @cached_property
    def mean(self) -> float:
        """Mean, by default integrated over the quantiles."""
        return self._moments[0]

    @cached_property
    def std(self) -> float:
        """Standard deviation, by default integrated over the quantiles."""
        return self._moments[1]

    @cached_property
    def _moments(self) -> tuple[float, float]:
        # in normal scores, as functions of which common quantile functions are smooth
        from scipy.special import ndtr  # noqa: PLC0415  (slow to import, and rarely needed)

        scores, weights = np.polynomial.hermite_e.hermegauss(120)
        # the weights in the tails vanish, but an infinite end of the support would dominate
        values = self.quantile(np.clip(ndtr(scores), 2.0**-53, 1.0 - 2.0**-53))
        weights /= weights.sum()
        mean = float(np.dot(weights, values))
        return mean, float(np.sqrt(np.dot(weights, (values - mean) ** 2)))

    @property
    def warnings(self) -> tuple[str, ...]:
        """Warnings about the validity, for the user."""
        return ()


class MaxentDistribution(Distribution):
    """A distribution with density ``exp(-l0 - l1 x - l2 g(x))``, g being x^2 or log x.

    Attributes
    ----------
    family : str
        Name of the family of distributions.
    support : tuple of float
        Least and greatest value.
    mean, std : float
        Mean and standard deviation.
    multipliers : tuple of float
        l0, l1 and l2, in the unit of the values.
    third : {"x^2", "log x"}
        The function g.
    antimode : tuple of float or None
        Interior minimum of the density, and the probability above it; None if there is none.
    """

    family: str
    multipliers: tuple[float, float, float]
    third: str = "x^2"
    antimode: tuple[float, float] | None = None

    @property
    def parent(self) -> tuple[float, float] | None:
        """Mean and standard deviation of the normal distribution before truncation, or None."""
        _, l1, l2 = self.multipliers
        return None if self.third != "x^2" or l2 <= 0.0 else (-0.5 * l1 / l2, math.sqrt(0.5 / l2))

    @property
    def warnings(self) -> tuple[str, ...]:
        """Notes for the user on the validity of the distribution."""
        if self.antimode is None:
            return ()
        least, above = self.antimode
        share, end = min((above, self.support[1]), (1.0 - above, self.support[0]))
        text = (
            f"the density has a minimum at {least:.4g} and increases towards both ends of the"
            f" support, as required for a std of {self.std:.4g}:"
            f" {'a spike' if share < 0.1 else 'a peak'} with a probability of {share:.2g} is at"
            f" the end {end:g}; a smaller std would give a single peak"
        )
        return (text,)

    @property
    def bulk(self) -> tuple[float, float]:
        """Interval with 99.9 % of the probability, extended to a nearby end of the support."""
        first, last = (float(value) for value in self.quantile(np.array([5e-4, 1.0 - 5e-4])))
        low, high = self.support
        near = 0.25 * (last - first)
        return low if first - low < near else first, high if high - last < near else last

    def quantile(self, probability: FloatArray) -> FloatArray:
        """Return the quantiles of the given probabilities.

        Parameters
        ----------
        probability : ndarray
            0 to 1; 0 and 1 give the ends of the support.

        Returns
        -------
        ndarray, shape as `probability`
        """
        below = np.asarray(probability, dtype=np.float64)
        flat = below.ravel()
        with np.errstate(divide="ignore"):  # an infinite end of the support
            values = self.inverse(flat, 1.0 - flat)
        low, high = self.support
        values = np.where(flat == 0.0, low, np.where(flat == 1.0, high, values))
        return np.clip(values, low, high).reshape(below.shape)

    def density(self, x: FloatArray) -> FloatArray:
        """Return the density at `x`, zero outside the support, shape as `x`."""
        x = np.asarray(x, dtype=np.float64)
        inside = (x >= self.support[0]) & (x <= self.support[1])
        return np.where(inside, np.exp(self.log_density(np.where(inside, x, self.mean))), 0.0)

    @abstractmethod
    def inverse(self, below: FloatArray, above: FloatArray) -> FloatArray:
        """Return quantiles, shape (draws,), from the probabilities below and above them."""

    def log_density(self, x: FloatArray) -> FloatArray:
        """Return the logarithm of the density at `x`, which must be within the support."""
        return quadratic(x, *self._exponent)

    def _set_exponent(self, centre: float, top: float, slope: float, bend: float) -> None:
        """Set the coefficients of the log density, see `quadratic`."""
        self._exponent = centre, top, slope, bend
        l0 = bend * centre * centre - slope * centre - top
        self.multipliers = (l0, slope - 2.0 * bend * centre, bend)


def quadratic(x: FloatArray, centre: float, top: float, slope: float, bend: float) -> FloatArray:
    """Return ``top - slope (x - centre) - bend (x - centre)^2``."""
    return top - (slope + bend * (x - centre)) * (x - centre)


class Uniform(MaxentDistribution):
    """Uniform distribution: maximum entropy for a bounded support only."""

    family = "uniform"

    def __init__(self, low: float, high: float) -> None:
        self.support = (low, high)
        self.mean = low + 0.5 * (high - low)
        self.std = (high - low) / math.sqrt(12.0)
        self._set_exponent(0.0, -math.log(high - low), 0.0, 0.0)

    def inverse(self, below: FloatArray, above: FloatArray) -> FloatArray:
        """Return quantiles, shape (draws,), from the probabilities below and above them."""
        low, high = self.support
        return np.where(below < 0.5, low + (high - low) * below, high - (high - low) * above)


class Exponential(MaxentDistribution):
    """Exponential distribution from a finite lower end, optionally truncated at an upper end.

    Parameters
    ----------
    low, high : float
        Support; `high` may be infinite.
    rate : float
        Decrease of the log density per unit, above zero.
    mean, std : float
        Mean and standard deviation, which must agree with the other parameters.
    """

    def __init__(self, low: float, high: float, rate: float, mean: float, std: float) -> None:
        self.family = "truncated exponential" if math.isfinite(high) else "exponential"
        self.support, self.mean, self.std, self._rate = (low, high), mean, std, rate
        self._fall = rate * (high - low)
        self._set_exponent(low, math.log(rate) - math.log(-math.expm1(-self._fall)), rate, 0.0)

    def inverse(self, below: FloatArray, above: FloatArray) -> FloatArray:
        """Return quantiles, shape (draws,), from the probabilities below and above them."""
        low, high = self.support
        lower = low - np.log1p(np.minimum(below, 0.5) * math.expm1(-self._fall)) / self._rate
        if self._fall < _STEEP:  # the distance from the upper end without cancellation
            upper = high - np.log1p(above * math.expm1(self._fall)) / self._rate
        else:
            upper = low - np.log(above + below * math.exp(-self._fall)) / self._rate
        return np.where(below < 0.5, lower, upper)


class Mirrored(MaxentDistribution):
    """The distribution of -x for a given distribution of x."""

    def __init__(self, original: MaxentDistribution) -> None:
        self._original = original
        self.family, self.std, self.mean = original.family, original.std, -original.mean
        self.support = (-original.support[1], -original.support[0])
        l0, l1, l2 = original.multipliers
        self.multipliers = (l0, -l1, l2)
        if original.antimode is not None:
            self.antimode = -original.antimode[0], 1.0 - original.antimode[1]

    def inverse(self, below: FloatArray, above: FloatArray) -> FloatArray:
        """Return quantiles, shape (draws,), from the probabilities below and above them."""
        return -self._original.inverse(above, below)

    def log_density(self, x: FloatArray) -> FloatArray:
        """Return the logarithm of the density at `x`, which must be within the support."""
        return self._original.log_density(-x)

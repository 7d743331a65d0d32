"""What a law of maximum entropy can tell, and the laws whose quantiles have closed forms."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod

import numpy as np

from wearsim.types import FloatArray
from wearsim.uq.distributions.quantile_table import NOTHING_LEFT


class MaxentDistribution(ABC):
    """A law with density ``exp(-l0 - l1 x - l2 g(x))`` on its support, g being x^2 or log x.

    Attributes
    ----------
    family : str
        What it is called.
    support : tuple of float
        Least and greatest value.
    mean, std : float
        Mean and standard deviation.
    multipliers : tuple of float
        l0, l1 and l2, in the unit of the values.
    third : {"x^2", "log x"}
        What l2 multiplies.
    """

    family: str
    support: tuple[float, float]
    mean: float
    std: float
    multipliers: tuple[float, float, float]
    third: str = "x^2"

    @property
    def parent(self) -> tuple[float, float] | None:
        """Mean and standard deviation of the normal law that it is cut from, if there is one."""
        return None

    @property
    def antimode(self) -> tuple[float, float] | None:
        """Where inside the support the density is least, and the probability above; or None."""
        return None

    @property
    def warnings(self) -> tuple[str, ...]:
        """What a user should know before trusting it."""
        if self.antimode is None:
            return ()
        least, above = self.antimode
        share, end = min((above, self.support[1]), (1.0 - above, self.support[0]))
        much = "a spike" if share < 0.1 else "a peak"
        told = (
            f"the density is least at {least:.4g} and rises to both ends of the support, to make"
            f" up a std of {self.std:.4g}: {much} with a probability of {share:.2g} lies at the"
            f" end {end:g}; a smaller std would give one peak alone"
        )
        return (told,)

    @property
    def bulk(self) -> tuple[float, float]:
        """Where nearly all of the law lies, and from an end of the support where that is near."""
        first, last = (float(value) for value in self.quantile(np.array([5e-4, 1.0 - 5e-4])))
        low, high = self.support
        near = 0.25 * (last - first)
        return low if first - low < near else first, high if high - last < near else last

    def quantile(self, probability: FloatArray) -> FloatArray:
        """Return the values below which a draw falls with these probabilities, 0 to 1.

        Parameters
        ----------
        probability : ndarray
            At 0 and 1 the ends of the support.

        Returns
        -------
        ndarray, shape as `probability`
        """
        below = np.asarray(probability, dtype=np.float64)
        flat = below.ravel()
        with np.errstate(divide="ignore"):  # an end that is infinite
            values = self.inverse(flat, 1.0 - flat)
        low, high = self.support
        values = np.where(flat == 0.0, low, np.where(flat == 1.0, high, values))
        return np.clip(values, low, high).reshape(below.shape)

    def density(self, x: FloatArray) -> FloatArray:
        """Return the density at `x`, zero outside the support, shape as `x`."""
        x = np.asarray(x, dtype=np.float64)
        low, high = self.support
        inside = (x >= low) & (x <= high)
        anywhere = min(max(self.mean, low), high)
        return np.where(inside, np.exp(self.log_density(np.where(inside, x, anywhere))), 0.0)

    @abstractmethod
    def inverse(self, below: FloatArray, above: FloatArray) -> FloatArray:
        """Return quantiles, shape (draws,), from probabilities below and above them."""

    @abstractmethod
    def log_density(self, x: FloatArray) -> FloatArray:
        """Return the log of the density at `x` within the support."""


class Uniform(MaxentDistribution):
    """All that is known is a bounded support."""

    family = "uniform"

    def __init__(self, low: float, high: float) -> None:
        self.support = (low, high)
        self.mean = low + 0.5 * (high - low)
        self.std = (high - low) / math.sqrt(12.0)
        self.multipliers = (math.log(high - low), 0.0, 0.0)

    def inverse(self, below: FloatArray, above: FloatArray) -> FloatArray:
        """Return quantiles, shape (draws,), from probabilities below and above them."""
        low, high = self.support
        return np.where(below < 0.5, low + (high - low) * below, high - (high - low) * above)

    def log_density(self, x: FloatArray) -> FloatArray:
        """Return the log of the density at `x` within the support."""
        return np.full_like(x, -self.multipliers[0])


class Exponential(MaxentDistribution):
    """The law ``exp(-rate x)`` from a finite lower end on, cut off at an upper one or not.

    Parameters
    ----------
    low, high : float
        Support; `high` may be infinite.
    rate : float
        Fall of the log density per unit, above zero.
    mean : float
        The mean that it has.
    """

    def __init__(self, low: float, high: float, rate: float, mean: float) -> None:
        self.family = "truncated exponential" if math.isfinite(high) else "exponential"
        self.support, self.mean, self._rate = (low, high), mean, rate
        self._fall = rate * (high - low)
        self.std = exponential_std(self._fall) / rate
        self._log_top = math.log(rate) - math.log(-math.expm1(-self._fall))
        self.multipliers = (0.0 - self._log_top - rate * low, rate, 0.0)

    def inverse(self, below: FloatArray, above: FloatArray) -> FloatArray:
        """Return quantiles, shape (draws,), from probabilities below and above them."""
        lower = np.log1p(np.minimum(below, 0.5) * math.expm1(-self._fall))
        upper = np.log(above + below * math.exp(-self._fall))
        return self.support[0] - np.where(below < 0.5, lower, upper) / self._rate

    def log_density(self, x: FloatArray) -> FloatArray:
        """Return the log of the density at `x` within the support."""
        return self._log_top - self._rate * (x - self.support[0])


def exponential_std(fall: float) -> float:
    """Return the standard deviation of exp(-x) on [0, fall]; that of exp(-x) itself is 1."""
    if fall < 0.1:  # the closed form cancels; what is left out is below 1e-15
        square = fall * fall
        return fall * math.sqrt(
            1.0 / 12.0 - square / 240.0 + square**2 / 6048.0 - square**3 / 172800.0
        )
    if fall > NOTHING_LEFT:
        return 1.0
    return math.sqrt(1.0 - (0.5 * fall / math.sinh(0.5 * fall)) ** 2)


def exponential_fall(mean: float) -> float:
    """Return `fall` such that exp(-fall t) on [0, 1] has this mean, above 0 and up to 1/2."""
    if mean < 0.02:
        return 1.0 / mean  # the far end weighs less than a float can tell
    fall = 12.0 * (0.5 - mean)
    for _ in range(100):
        if fall < 0.1:
            square = fall * fall
            series = 1.0 - square / 60.0 + square**2 / 2520.0 - square**3 / 100800.0
            here = 0.5 - fall / 12.0 * series
        else:
            here = 1.0 / fall - 1.0 / math.expm1(fall)
        change = (here - mean) * fall**2 / exponential_std(fall) ** 2 if fall > 0.0 else 0.0
        fall += change
        if abs(change) <= 4e-16 * fall:
            break
    return fall


class Mirrored(MaxentDistribution):
    """A law with its values' sign turned, for what is known towards an upper end."""

    def __init__(self, law: MaxentDistribution) -> None:
        self._law = law
        self.family, self.std, self.mean = law.family, law.std, -law.mean
        self.support = (-law.support[1], -law.support[0])
        l0, l1, l2 = law.multipliers
        self.multipliers = (l0, -l1, l2)

    @property
    def parent(self) -> tuple[float, float] | None:
        """Mean and standard deviation of the normal law that it is cut from, if there is one."""
        parent = self._law.parent
        return None if parent is None else (-parent[0], parent[1])

    @property
    def antimode(self) -> tuple[float, float] | None:
        """Where inside the support the density is least, and the probability above; or None."""
        antimode = self._law.antimode
        return None if antimode is None else (-antimode[0], 1.0 - antimode[1])

    def inverse(self, below: FloatArray, above: FloatArray) -> FloatArray:
        """Return quantiles, shape (draws,), from probabilities below and above them."""
        return -self._law.inverse(above, below)

    def log_density(self, x: FloatArray) -> FloatArray:
        """Return the log of the density at `x` within the support."""
        return self._law.log_density(-x)

"""Gamma distribution: maximum entropy on [0, inf) for a given mean and mean logarithm."""

from __future__ import annotations

import math
from functools import cached_property

import numpy as np

from wearsim.types import FloatArray
from wearsim.uq.distributions.base import MaxentDistribution
from wearsim.uq.distributions.quantile_table import InverseTable, Piece

_LARGE = 50.0  # shape above which digamma and logarithm cancel


class Gamma(MaxentDistribution):
    """The gamma distribution of given mean and mean logarithm.

    Parameters
    ----------
    mean, mean_log : float
        E{x} and E{log x}, less than the logarithm of the mean.
    """

    family = "gamma"
    third = "log x"

    def __init__(self, mean: float, mean_log: float) -> None:
        self.support, self.mean = (0.0, math.inf), mean
        self._shape = shape = gamma_shape(math.log(mean) - mean_log)
        self.std = mean / math.sqrt(shape)
        rate = shape / mean
        self.multipliers = (math.lgamma(shape) - shape * math.log(rate), rate, 1.0 - shape)

    @cached_property
    def _table(self) -> InverseTable:
        """Quantiles of log(x/mean)."""
        k = self._shape

        def log_density(y: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
            return k * (y - np.expm1(y)), -k * np.expm1(y), -k * np.exp(y)

        ends = (-math.inf, math.inf)
        pieces = [Piece(0.0, 1.0, log_density, end, lambda y: 0.5 + 0.1 * abs(y)) for end in ends]
        return InverseTable(pieces)

    def inverse(self, below: FloatArray, above: FloatArray) -> FloatArray:
        """Return quantiles, shape (draws,), from the probabilities below and above them."""
        return self.mean * np.exp(self._table.values(below, above))

    def log_density(self, x: FloatArray) -> FloatArray:
        """Return the logarithm of the density at `x`, which must be within the support."""
        y = np.log(np.maximum(x, 1e-300) / self.mean)
        logs = self._shape * (y - np.expm1(y)) - y
        return np.asarray(logs - self._table.log_total - math.log(self.mean))


def gamma_shape(gap: float) -> float:
    """Return the shape k of the gamma distribution with ``log k - digamma(k) = gap`` > 0."""
    from scipy.special import digamma, zeta  # noqa: PLC0415  (slow to import, rarely needed)

    root = math.sqrt((gap - 3.0) ** 2 + 24.0 * gap)
    shape = (3.0 - gap + root) / (12.0 * gap)  # within 1.5 %: Minka, Estimating a Gamma, 2002
    for _ in range(5):  # Newton's method for 1/k, in which the function is nearly linear
        if shape > _LARGE:  # asymptotic series, without cancellation
            series = 1.0 / 12.0 - 1.0 / (120.0 * shape**2) + 1.0 / (252.0 * shape**4)
            excess = 0.5 / shape - gap + series / shape**2
            slope = 0.5 + 1.0 / (6.0 * shape)
        else:
            excess = math.log(shape) - float(digamma(shape)) - gap
            slope = shape**2 * float(zeta(2.0, shape)) - shape
        shape = 1.0 / (1.0 / shape - excess / slope)
    return shape

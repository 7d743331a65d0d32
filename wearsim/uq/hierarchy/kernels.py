"""Likelihood of ln K of one test as a mixture, and its form when K itself scatters.

A test gives the likelihood of ln K as a mixture over the draws of its other inputs. Since the wear
depends on K and on the number of passes only through their product, another specimen with another
K would give the same function, shifted along ln K: the apparent ln K of a test, c, is distributed
about the true one with the density f(c - ln K) = L(ln K). If ln K ~ N(m, t^2), the density of
c - m is f convolved with N(0, t^2), which is a mixture again.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from wearsim.types import FloatArray

REACH = 9.0  # standard deviations that a table covers to either side
_NODES = 361
_MOST_PARTS = 200  # of a mixture that is tabulated
_LOG_2PI = float(np.log(2.0 * np.pi))


@dataclass(frozen=True)
class LikelihoodMixture:
    """Likelihood of ln K as a mixture of normal densities.

    Parameters
    ----------
    weight : ndarray, shape (parts,)
        Weights, whose sum is 1.
    centre, std : ndarray, shape (parts,)
        Mean and standard deviation of each part.
    variance_of_inputs : float
        Variance of ln K due to the other inputs.
    effective_size : float
        Effective number of draws, the inverse of the sum of squared weights.
    """

    weight: FloatArray
    centre: FloatArray
    std: FloatArray
    variance_of_inputs: float = 0.0
    effective_size: float = 1.0

    @classmethod
    def of(cls, log_weight: FloatArray, centre: FloatArray, std: FloatArray) -> LikelihoodMixture:
        """Return the mixture over draws, smoothed over the distances between them.

        The bandwidth is Silverman's, and the draws are moved towards their mean so that the
        variance is kept (West, J. R. Stat. Soc. B 55 (1993)).

        Parameters
        ----------
        log_weight, centre, std : ndarray, shape (draws,)
            Logarithm of the evidence of each draw, with any constant; mean and standard deviation
            of ln K for it.
        """
        weight = np.exp(log_weight - log_weight.max())
        kept = weight > 1e-12
        weight, centre, std = weight[kept] / weight[kept].sum(), centre[kept], std[kept]
        size = 1.0 / float(np.sum(weight**2))
        mean = float(weight @ centre)
        spread = float(np.sqrt(weight @ (centre - mean) ** 2))
        width = 0.9 * size**-0.2  # the size is at least one
        moved = mean + np.sqrt(1.0 - width**2) * (centre - mean)
        return cls(weight, moved, np.hypot(std, width * spread), spread**2, size)

    @property
    def mean(self) -> float:
        """Mean of ln K, the apparent value of the test."""
        return float(np.sum(self.weight * self.centre))

    @property
    def variance(self) -> float:
        """Variance of ln K, due to the other inputs and to the measurement."""
        return float(self.weight @ ((self.centre - self.mean) ** 2 + self.std**2))

    def quantile(self, probability: FloatArray) -> FloatArray:
        """Return quantiles of ln K for a flat prior, shape as `probability`."""
        reach = REACH * np.sqrt(self.variance)
        grid = np.linspace(self.mean - reach, self.mean + reach, 4001)
        below = np.zeros_like(grid)
        for weight, centre, std in zip(self.weight, self.centre, self.std, strict=True):
            below += weight * scipy.special.ndtr((grid - centre) / std)
        return np.interp(probability, below, grid)

    def deviations(self, uniform: FloatArray) -> FloatArray:
        """Return draws of the apparent ln K less the true one.

        Parameters
        ----------
        uniform : ndarray, shape (2, ...)
            Uniform numbers that choose the part and the value within it.
        """
        bound = np.cumsum(self.weight)
        part = np.minimum(np.searchsorted(bound, uniform[0]), len(bound) - 1)
        return np.asarray(
            self.mean - self.centre[part] + self.std[part] * scipy.special.ndtri(uniform[1])
        )

    def table(self, scatter: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the logarithm of the density of the apparent ln K about the mean m.

        Parameters
        ----------
        scatter : ndarray, shape (t,)
            Standard deviations t of ln K between specimens.

        Returns
        -------
        scale : ndarray, shape (t,)
            Standard deviation of the apparent ln K.
        log_density : ndarray, shape (t, nodes)
            At `REACH` scales below the mean to `REACH` above, equally spaced.
        """
        part = self._reduced()
        centre = self.mean - part.centre
        scale = np.sqrt(self.variance + scatter**2)
        nodes = np.linspace(-REACH, REACH, _NODES)
        log_density = np.empty((len(scatter), _NODES))
        for row, (t, unit) in enumerate(zip(scatter, scale, strict=True)):
            std = np.hypot(part.std, t)
            exponent = -0.5 * ((nodes[:, None] * unit - centre) / std) ** 2
            exponent += np.log(part.weight / std) - 0.5 * _LOG_2PI
            top = exponent.max(axis=1)
            log_density[row] = top + np.log(np.exp(exponent - top[:, None]).sum(axis=1))
        return scale, log_density

    def _reduced(self) -> LikelihoodMixture:
        """Return the mixture with neighbouring parts merged, mean and variance kept."""
        if len(self.weight) <= _MOST_PARTS:
            return self
        order = np.argsort(self.centre, kind="stable")
        starts = np.unique(np.linspace(0, len(order), _MOST_PARTS + 1).astype(np.int64)[:-1])
        weight = np.add.reduceat(self.weight[order], starts)
        centre = np.add.reduceat((self.weight * self.centre)[order], starts) / weight
        second = (self.weight * (self.std**2 + self.centre**2))[order]
        square = np.add.reduceat(second, starts) / weight - centre**2
        return LikelihoodMixture(weight, centre, np.sqrt(np.maximum(square, 1e-300)))

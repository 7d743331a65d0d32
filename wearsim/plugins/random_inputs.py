"""Base classes of random inputs: distributions, friction fields and processes."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from functools import cached_property
from typing import Literal, TypeAlias

import numpy as np

from wearsim.types import FloatArray

Frame: TypeAlias = Literal["contact", "cylinder", "roller"]

#: uniform random numbers of one stream, by first index and count; reproducible by index
Uniforms: TypeAlias = Callable[[int, int], FloatArray]


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


class JointDistribution(ABC):
    """Joint distribution of several random numbers, such as the misalignment angles of a roller.

    Attributes
    ----------
    components : tuple of str
        Keys of the scenario's table that are set, such as ("yaw", "tilt").
    dimension : int
        Number of independent uniform random numbers per realisation.
    """

    components: tuple[str, ...] = ()
    dimension: int = 1

    @abstractmethod
    def values(self, uniform: FloatArray) -> FloatArray:
        """Return the components, shape (draws, components), from uniforms (draws, dimension)."""

    @property
    @abstractmethod
    def mean(self) -> tuple[float, ...]:
        """Mean of each component."""

    @property
    @abstractmethod
    def reach(self) -> tuple[float, ...]:
        """Maximum magnitude of each component."""


class FrictionField(ABC):
    """Random field of the friction coefficient within one contact.

    Attributes
    ----------
    frame : {"contact", "cylinder", "roller"}
        Frame in which the field is fixed: the contact, or a body that carries it through.
    marginal : Distribution
        Distribution of the friction coefficient at a point.
    """

    frame: Frame = "contact"
    marginal: Distribution

    @abstractmethod
    def values(self, x: FloatArray, y: FloatArray, uniforms: Uniforms) -> FloatArray:
        """Return one realisation of the friction coefficient at given points.

        Parameters
        ----------
        x : ndarray, shape (points, strips)
            Position along rolling, starting at the leading edge [m].
        y : ndarray, shape (strips,)
            Axial position [m].
        uniforms : callable
            Stream of uniform random numbers of the realisation.

        Returns
        -------
        ndarray, shape (points, strips)
        """

    def unresolved(self, along: float, across: float) -> str | None:
        """Return why a grid of these spacings [m] does not resolve the field, or None."""
        return None

    @property
    def warnings(self) -> tuple[str, ...]:
        """Warnings about the validity, for the user."""
        return self.marginal.warnings


class Process(ABC):
    """Random process in time, linear between the points of an equally spaced time grid.

    Attributes
    ----------
    marginal : Distribution
        Distribution at a point of the time grid.
    spacing : float
        Spacing of the time grid [s].
    """

    marginal: Distribution
    spacing: float

    @abstractmethod
    def path(self, points: int, uniforms: Uniforms) -> FloatArray:
        """Return one realisation at the times 0, spacing, 2 spacing, ..., shape (points,).

        A longer path starts with the values of a shorter one, bit for bit.
        """

    @property
    def warnings(self) -> tuple[str, ...]:
        """Warnings about the validity, for the user."""
        return self.marginal.warnings

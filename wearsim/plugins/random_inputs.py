"""What a random input promises: a distribution, a joint one, a friction field or a process."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from functools import cached_property
from typing import Literal, TypeAlias

import numpy as np

from wearsim.types import FloatArray

Frame: TypeAlias = Literal["contact", "cylinder", "roller"]

Uniforms: TypeAlias = Callable[[int, int], FloatArray]
"""Uniform numbers of one stream, by first index and count; each index has one value for ever."""


class Distribution(ABC):
    """A random number, given by its quantile function; values are in SI."""

    @abstractmethod
    def quantile(self, probability: FloatArray) -> FloatArray:
        """Return the values below which a draw falls with these probabilities.

        Parameters
        ----------
        probability : ndarray
            0 to 1; at 0 and 1 the ends of the support, which may be infinite.

        Returns
        -------
        ndarray, shape as `probability`
        """

    @cached_property
    def support(self) -> tuple[float, float]:
        """Least and greatest value."""
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
        # in normal scores, where the quantile function of any common law is smooth
        from scipy.special import ndtr  # noqa: PLC0415  (slow to import, and rarely needed)

        scores, weights = np.polynomial.hermite_e.hermegauss(120)
        # far out the weights are nothing, but an infinite end of the support would be felt
        values = self.quantile(np.clip(ndtr(scores), 2.0**-53, 1.0 - 2.0**-53))
        weights = weights / weights.sum()
        mean = float(np.dot(weights, values))
        return mean, float(np.sqrt(np.dot(weights, (values - mean) ** 2)))

    @property
    def warnings(self) -> tuple[str, ...]:
        """What a user should know before trusting it."""
        return ()


class JointDistribution(ABC):
    """Several random numbers that are drawn together, such as the two angles of a roller's slack.

    Attributes
    ----------
    components : tuple of str
        The keys of the scenario's table that it sets, ("yaw", "tilt").
    dimension : int
        How many independent uniform numbers a draw takes.
    """

    components: tuple[str, ...] = ()
    dimension: int = 1

    @abstractmethod
    def values(self, uniform: FloatArray) -> FloatArray:
        """Return the components, shape (draws, components), from uniforms (draws, dimension)."""

    @property
    @abstractmethod
    def mean(self) -> tuple[float, ...]:
        """Mean of every component."""

    @property
    @abstractmethod
    def reach(self) -> tuple[float, ...]:
        """Greatest size of every component."""


class FrictionField(ABC):
    """A friction coefficient that differs from place to place within one contact.

    Attributes
    ----------
    frame : {"contact", "cylinder", "roller"}
        What the pattern is fixed to: it stays in the contact, or it rolls through with a body.
    marginal : Distribution
        Distribution of the friction coefficient at any one point.
    """

    frame: Frame = "contact"
    marginal: Distribution

    @abstractmethod
    def values(self, x: FloatArray, y: FloatArray, uniforms: Uniforms) -> FloatArray:
        """Return one realisation of the friction coefficient at given points.

        Parameters
        ----------
        x : ndarray, shape (points, strips)
            Position along rolling, from the leading edge on [m].
        y : ndarray, shape (strips,)
            Axial position [m].
        uniforms : callable
            The realisation's own stream of uniform numbers.

        Returns
        -------
        ndarray, shape (points, strips)
        """

    def unresolved(self, along: float, across: float) -> str | None:
        """Return what is wrong with a grid of these spacings [m], or None where it resolves it."""
        return None

    @property
    def warnings(self) -> tuple[str, ...]:
        """What a user should know before trusting it."""
        return self.marginal.warnings


class Process(ABC):
    """A random number that changes with time, on a time grid of its own.

    Attributes
    ----------
    marginal : Distribution
        Distribution at any one time.
    spacing : float
        Step of its time grid [s]; between its points it is linear.
    """

    marginal: Distribution
    spacing: float

    @abstractmethod
    def path(self, points: int, uniforms: Uniforms) -> FloatArray:
        """Return one realisation at the times 0, spacing, 2 spacing, ..., shape (points,).

        A longer path begins with the shorter one, bit for bit.
        """

    @property
    def warnings(self) -> tuple[str, ...]:
        """What a user should know before trusting it."""
        return self.marginal.warnings

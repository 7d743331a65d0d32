"""Base classes of random inputs: distributions, friction fields and processes."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Literal, TypeAlias

from wearsim.types import FloatArray
from wearsim.uq.distributions.base import Distribution as Distribution  # noqa: PLC0414  (exported)

Frame: TypeAlias = Literal["contact", "cylinder", "roller"]

#: uniform random numbers of one stream, by first index and count; reproducible by index
Uniforms: TypeAlias = Callable[[int, int], FloatArray]


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

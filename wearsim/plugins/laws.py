"""Base classes of the laws that plugins add: of wear, of fatigue, and of motion of a follower."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Literal, TypeAlias

from wearsim.types import ContactSolution, FloatArray

Body: TypeAlias = Literal["cylinder", "roller"]

BODIES: tuple[Body, ...] = ("cylinder", "roller")


class WearLaw(ABC):
    """Wear of both bodies as a function of a solved contact."""

    @abstractmethod
    def depth_per_pass(
        self, body: Body, solution: ContactSolution, rolling_speed: float
    ) -> FloatArray:
        """Return the depth worn off `body` in one pass, shape (strips,) [m]."""

    def depth_per_dissipation(self, body: Body, rolling_speed: float) -> float | None:
        """Return depth per pass over dissipation [m/(W/m)], or None if the law is not linear."""
        return None


class FatigueLaw(ABC):
    """Rolling-contact fatigue of one body: damage by an overrolling as a function of pressure."""

    @abstractmethod
    def damage_per_pass(self, pressure: FloatArray) -> FloatArray:
        """Return the damage that an overrolling adds, one over the life at its pressure.

        Parameters
        ----------
        pressure : ndarray, any shape
            Greatest pressure along each strip [Pa]; 0 where the bodies do not touch.

        Returns
        -------
        ndarray
            Same shape; 0 without pressure, and never less at a greater one.
        """


class MotionLaw(ABC):
    """Motion of a follower over one segment of a cam's turn.

    `breaks` are the angles from the segment's start [rad] where a derivative above the second
    jumps; the second derivative is continuous within a segment.
    """

    breaks: tuple[float, ...] = ()

    @abstractmethod
    def lift(self, angle: FloatArray) -> FloatArray:
        """Return lift and derivatives at angles from the segment's start [rad], shape (points,).

        Returns
        -------
        ndarray, shape (3, points)
            Lift above that at the segment's start [m, or rad of a swinging arm], and its first and
            second derivative by the angle.
        """

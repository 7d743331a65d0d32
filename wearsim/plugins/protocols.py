"""What a contact model, a wear law, a load and a load term promise: written down once, and kept."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Literal, TypeAlias

import numpy as np

from wearsim.types import (
    ContactSolution,
    FloatArray,
)

Body: TypeAlias = Literal["cylinder", "roller"]

BODIES: tuple[Body, ...] = ("cylinder", "roller")


class WearLaw(ABC):
    """Turns the dissipation of one pass into worn depth."""

    @abstractmethod
    def depth_per_pass(
        self, body: Body, solution: ContactSolution, rolling_speed: float
    ) -> FloatArray:
        """Return the depth that one pass wears off `body`, shape (strips,) [m]."""

    def depth_per_dissipation(self, body: Body, rolling_speed: float) -> float | None:
        """Return depth per pass over dissipation [m/(W/m)] where the law is linear, else None."""
        return None


class Load(ABC):
    """The load on a roller as a function of time, before any feedback.

    `stiffness` [N/m] is what the load loses per unit of the roller's descent into worn material.
    """

    stiffness: float = 0.0

    @property
    def span(self) -> tuple[float, float] | None:
        """First and last time the load is known at [s], or None if at all times."""
        return None

    @abstractmethod
    def force(self, time: FloatArray) -> FloatArray:
        """Return the load at each `time` [s], shape as `time` [N]."""

    @abstractmethod
    def mean(self, start: float, stop: float) -> float:
        """Return the exact mean of the load between two times [s] [N]."""

    def extremes(self, start: float, stop: float) -> tuple[float, float]:
        """Return the least and greatest load between two times [s] [N]; by default sampled."""
        forces = self.force(np.linspace(start, stop, 10_001))
        return float(forces.min()), float(forces.max())

    def deviation(self, start: float, stop: float) -> float:
        """Return the exact standard deviation of the load between two times [s] [N]."""
        return 0.0


class LoadTerm(ABC):
    """A term added to a load: one number of state per roller, its force [N], follows the power."""

    @abstractmethod
    def advance(self, state: FloatArray, power: FloatArray, duration: float) -> FloatArray:
        """Return the state, shape (rollers,), after `duration` [s] at constant `power` [W]."""

    @abstractmethod
    def mean_force(self, state: FloatArray, power: FloatArray, duration: float) -> FloatArray:
        """Return the term's mean over that time, shape (rollers,) [N]."""

    def lag(self) -> tuple[float, float] | None:
        """Return gain [N/W] and time constant [s] if the term is a first-order lag, else None.

        A first-order lag can follow the compiled per-pass loop; other terms fall back on Python.
        """
        return None

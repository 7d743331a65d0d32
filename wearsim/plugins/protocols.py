"""Base classes of wear laws, loads and load terms."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Literal, TypeAlias

import numpy as np

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


class Load(ABC):
    """Load on a roller as a function of time, before any feedback.

    `stiffness` [N/m] is the decrease of the load per displacement of the roller into worn material.
    """

    stiffness: float = 0.0

    @property
    def span(self) -> tuple[float, float] | None:
        """First and last time at which the load is known [s], or None if at all times."""
        return None

    @abstractmethod
    def force(self, time: FloatArray) -> FloatArray:
        """Return the load at each `time` [s], shape as `time` [N]."""

    @abstractmethod
    def mean(self, start: float, stop: float) -> float:
        """Return the exact mean of the load between two times [s] [N]."""

    def extremes(self, start: float, stop: float) -> tuple[float, float]:
        """Return the minimum and maximum load between two times [s] [N]; by default sampled."""
        forces = self.force(np.linspace(start, stop, 10_001))
        return float(forces.min()), float(forces.max())

    def deviation(self, start: float, stop: float) -> float:
        """Return the exact standard deviation of the load between two times [s] [N]."""
        return 0.0


class LoadTerm(ABC):
    """Term added to a load; its state is one force per roller [N] that follows the power."""

    @abstractmethod
    def advance(self, state: FloatArray, power: FloatArray, duration: float) -> FloatArray:
        """Return the state, shape (rollers,), after `duration` [s] at constant `power` [W]."""

    @abstractmethod
    def mean_force(self, state: FloatArray, power: FloatArray, duration: float) -> FloatArray:
        """Return the mean of the term over `duration` [s], shape (rollers,) [N]."""

    def lag(self) -> tuple[float, float] | None:
        """Return gain [N/W] and time constant [s] if the term is a first-order lag, else None.

        The compiled per-pass loop supports first-order lags only; other terms need Python.
        """
        return None

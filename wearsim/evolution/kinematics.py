"""Kinematics of rollers on a cylinder."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from wearsim.types import FloatArray


@dataclass(frozen=True)
class Kinematics:
    """Radii, speed and number of the rollers on the cylinder.

    Parameters
    ----------
    cylinder_radius, roller_radius, crown_radius : float
        Radii [m].
    rolling_speed : float
        Rolling velocity V [m/s].
    multiplicity : ndarray of int, shape (rollers,)
        Physical rollers represented by each roller of the problem; identical ones are merged.
    """

    cylinder_radius: float
    roller_radius: float
    crown_radius: float
    rolling_speed: float
    multiplicity: FloatArray

    @cached_property
    def physical_rollers(self) -> float:
        """Number of rollers on the cylinder."""
        return float(self.multiplicity.sum())

    @cached_property
    def pass_rate(self) -> float:
        """Roller passes per second, all rollers together."""
        return self.physical_rollers * (self.rolling_speed / (2.0 * np.pi * self.cylinder_radius))

    @cached_property
    def longitudinal_curvature(self) -> float:
        """Relative curvature along rolling [1/m]."""
        return 1.0 / self.cylinder_radius + 1.0 / self.roller_radius

    @cached_property
    def roller_share(self) -> float:
        """Overrollings of a point of one roller per pass of all rollers."""
        return self.cylinder_radius / self.roller_radius / self.physical_rollers

"""Inputs of the contacts of a wear problem, and kinematics of rollers on a cylinder."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import TypeAlias

import numpy as np

from wearsim.mechanics.numerics.piecewise_linear import PiecewiseLinear
from wearsim.types import FloatArray, IntArray


@dataclass(frozen=True)
class ContactInputs:
    """The inputs of the contacts of a problem.

    Every array has shape (contacts, realisations).

    Parameters
    ----------
    normal_force_offset : ndarray
        Force added to the load of the problem [N].
    friction : ndarray
        Friction coefficient mu.
    longitudinal : ndarray
        Mean longitudinal creepage.
    yaw, tilt : ndarray
        Angles of the roller about the contact normal and the rolling direction [rad].
    bearing_torque : ndarray
        Torque of the roller's bearing where the roller is free [N m].
    """

    normal_force_offset: FloatArray
    friction: FloatArray
    longitudinal: FloatArray
    yaw: FloatArray
    tilt: FloatArray
    bearing_torque: FloatArray

    @classmethod
    def uniform(cls, contacts: int, realisations: int = 1, **values: float) -> ContactInputs:
        """Return inputs that are equal for all contacts; zero where no value is given."""
        shape = (contacts, realisations)
        return cls(*(np.full(shape, values.get(item.name, 0.0)) for item in fields(cls)))

    def at(self, numbers: IntArray, axis: int = 0) -> ContactInputs:
        """Return the inputs of some contacts, or with axis 1 of some realisations, by number."""
        columns = (getattr(self, item.name) for item in fields(self))
        return ContactInputs(*(column.take(numbers, axis=axis) for column in columns))

    def with_values(self, values: Mapping[str, FloatArray]) -> ContactInputs:
        """Return these inputs with some of them replaced; arrays broadcast to the shape."""
        shape = self.friction.shape
        filled = {name: np.array(np.broadcast_to(array, shape)) for name, array in values.items()}
        return replace(self, **filled)

    def with_value_of(self, item: Varying, roller: IntArray, value: FloatArray) -> ContactInputs:
        """Return these inputs with the value of a process at the contacts it acts on.

        Parameters
        ----------
        item : Varying
        roller : ndarray of int, shape (contacts,)
            Roller of each contact.
        value : ndarray
            Value of the process; broadcasts to (contacts, realisations).
        """
        chosen = np.isin(roller, item.rollers)[:, None]
        return self.with_values({item.name: np.where(chosen, value, getattr(self, item.name))})


Redraw: TypeAlias = Callable[[ContactInputs, int], ContactInputs]
"""Function that draws the inputs of single passes.

Its arguments are the inputs of each pass's roller and the number of the first pass.
"""


@dataclass(frozen=True)
class Varying:
    """An input that follows a process in time.

    Parameters
    ----------
    name : str
        Field of `ContactInputs`.
    rollers : tuple of int
        Rollers of the problem that it acts on.
    paths : tuple of PiecewiseLinear
        Its value over time [s], one path per realisation.
    """

    name: str
    rollers: tuple[int, ...]
    paths: tuple[PiecewiseLinear, ...]


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

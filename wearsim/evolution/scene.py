"""A scene: everything about a wear test that does not change while it runs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from wearsim.plugins import BODIES, ContactModel, Load, LoadTerm, WearLaw
from wearsim.types import ContactSolution, Creepage, FloatArray, Grid, OperatingPoint


@dataclass(frozen=True)
class Kinematics:
    """How the rollers run on the cylinder.

    Parameters
    ----------
    cylinder_radius, roller_radius, crown_radius : float
        Radii [m].
    rolling_speed : float
        Rolling velocity V [m/s].
    multiplicity : ndarray of int, shape (rollers,)
        Physical rollers behind each roller of the scene; alike ones are merged.
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
        turns = self.rolling_speed / (2.0 * np.pi * self.cylinder_radius)
        return self.physical_rollers * turns

    @cached_property
    def longitudinal_curvature(self) -> float:
        """Relative curvature along rolling [1/m]."""
        return 1.0 / self.cylinder_radius + 1.0 / self.roller_radius

    @cached_property
    def cylinder_share(self) -> FloatArray:
        """Part of all passes that each roller of the scene makes, shape (rollers,)."""
        return self.multiplicity / self.physical_rollers

    @cached_property
    def roller_share(self) -> float:
        """Times a point of one roller is rolled over, per pass of all rollers."""
        return self.cylinder_radius / self.roller_radius / self.physical_rollers


@dataclass(frozen=True)
class Scene:
    """A wear test, ready to be stepped. Contacts are numbered (station, roller, realisation).

    Parameters
    ----------
    grid : Grid
        The strips.
    model : ContactModel
        Prepared for the grid.
    law : WearLaw
    load : Load
    terms : mapping of str to LoadTerm
        Terms added to the load, in a fixed order.
    kinematics : Kinematics
    nominal_gap : ndarray, shape (stations, rollers, realisations, strips)
        Gap before wear [m].
    creepages : sequence of Creepage, one per roller
    friction : float
        Friction coefficient mu.
    bearing_torque : float, optional
        Torque each roller's bearing takes [N m]; the creepage is prescribed where it is not given.
    rolling_radius : ndarray, shape (rollers, strips), optional
        Radius of the unworn rollers at every strip [m]; needed with a bearing torque.
    slip_profile : ndarray, shape (rollers, strips), optional
        Differential slip of the unworn bodies; worn depth adds to it. Without it creepage varies
        with spin alone.
    """

    grid: Grid
    model: ContactModel
    law: WearLaw
    load: Load
    terms: Mapping[str, LoadTerm]
    kinematics: Kinematics
    nominal_gap: FloatArray
    creepages: tuple[Creepage, ...]
    friction: float
    bearing_torque: float | None = None
    rolling_radius: FloatArray | None = None
    slip_profile: FloatArray | None = None

    @cached_property
    def shape(self) -> tuple[int, int, int]:
        """Leading axes: stations, rollers, realisations."""
        stations, rollers, realisations = self.nominal_gap.shape[:3]
        return stations, rollers, realisations

    @cached_property
    def contacts(self) -> tuple[tuple[int, int, int], ...]:
        """Station, roller and realisation of every contact, in their order."""
        stations, rollers, realisations = (range(count) for count in self.shape)
        return tuple((s, r, v) for s in stations for r in rollers for v in realisations)

    def time(self, passes: float) -> float:
        """Return the time at which `passes` roller passes are done [s]."""
        return passes / self.kinematics.pass_rate

    def gap(self, cylinder_depth: FloatArray, roller_depth: FloatArray) -> FloatArray:
        """Return the gap of every contact [m]; depths as in `WearState`."""
        return self.nominal_gap + cylinder_depth + roller_depth

    def descent(self, gap: FloatArray) -> FloatArray:
        """Return how far each roller has sunk into worn material, shape (S, R, N) [m].

        It is the rise of the least gap: rigid bodies would approach by that much. On one track it
        equals the worn depth.
        """
        risen: FloatArray = gap.min(axis=-1) - self.nominal_gap.min(axis=-1)
        return risen

    def point(
        self, roller: int, load: float, cylinder_depth: FloatArray, roller_depth: FloatArray
    ) -> OperatingPoint:
        """Return the operating point of one contact at its worn depths, shape (strips,) [m]."""
        creepage, radius = self.creepages[roller], None
        kinematics = self.kinematics
        if self.slip_profile is not None:
            variation = (
                self.slip_profile[roller]
                + roller_depth / kinematics.roller_radius
                - cylinder_depth / kinematics.cylinder_radius
            )
            creepage = Creepage(creepage.longitudinal, creepage.lateral, creepage.spin, variation)
        if self.rolling_radius is not None:
            radius = self.rolling_radius[roller] - roller_depth
        return OperatingPoint(
            normal_force=load,
            rolling_speed=kinematics.rolling_speed,
            creepage=creepage,
            friction=self.friction,
            bearing_torque=self.bearing_torque,
            rolling_radius=radius,
        )

    def wear_per_pass(self, contacts: Sequence[ContactSolution]) -> tuple[FloatArray, FloatArray]:
        """Return the depth one pass of each contact wears off either body, where it touches.

        Returns
        -------
        cylinder, roller : ndarray, shape (stations, rollers, realisations, strips)
            Depth per pass of that contact [m].
        """
        speed = self.kinematics.rolling_speed
        shape = (*self.shape, self.grid.strips)
        cylinder, roller = (
            np.array([self.law.depth_per_pass(body, c, speed) for c in contacts]).reshape(shape)
            for body in BODIES
        )
        return cylinder, roller

    def shared_wear(
        self, cylinder: FloatArray, roller: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Return depth per roller pass of the bodies, from that of the contacts.

        Every station of the cylinder is worn by all rollers in turn, every roller by all stations.

        Returns
        -------
        cylinder_rate : ndarray, shape (stations, 1, realisations, strips)
        roller_rate : ndarray, shape (1, rollers, realisations, strips)
            Depth per roller pass [m].
        """
        share = self.kinematics.cylinder_share[None, :, None, None]
        cylinder_rate = (cylinder * share).sum(axis=1, keepdims=True)
        roller_rate = roller.mean(axis=0, keepdims=True) * self.kinematics.roller_share
        return cylinder_rate, roller_rate

    def total_power(self, power: FloatArray) -> FloatArray:
        """Return the power of all physical rollers, shape (N,) [W], from (S, R, N)."""
        weight = self.kinematics.multiplicity[None, :, None]
        total: FloatArray = (power * weight).sum(axis=1).mean(axis=0)
        return total

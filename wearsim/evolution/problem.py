"""A problem: everything about a wear test that does not change while it runs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import overload

import numpy as np

from wearsim.contact_batch import BatchSolution, OperatingPoints, rows_of
from wearsim.evolution.batch.per_realisation import (
    each_between,
    mean_along,
    one_of,
    per_strip,
    sum_along,
    sum_in_order,
)
from wearsim.evolution.contact_inputs import ContactInputs, Redraw, Varying
from wearsim.evolution.kinematics import Kinematics
from wearsim.plugins import BODIES, Body, ContactModel, Load, LoadTerm, WearLaw
from wearsim.types import (
    ContactSolution,
    Creepage,
    FloatArray,
    Grid,
    IntArray,
    Number,
    OperatingPoint,
)


@dataclass(frozen=True)
class WearProblem:
    """A wear test, ready to be stepped.

    Contacts are numbered (station, contact, realisation). A roller has one contact, or several
    that stand for the passes it makes with inputs drawn anew: each counts by its weight.

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
    flat_gap : ndarray, shape (stations, rollers, realisations, strips)
        Gap of rollers without tilt before wear [m].
    from_apex : ndarray, shape (rollers, strips)
        Axial distance from each roller's apex [m].
    inputs : ContactInputs
        Inputs of every contact.
    roller : ndarray of int, shape (contacts,)
        The roller that makes each contact.
    weight : ndarray, shape (contacts,)
        Part of its roller's passes that each contact stands for.
    half : ndarray of int, shape (contacts,)
        0 or 1: which half of a roller's contacts each belongs to; either is a quadrature by itself.
    tilt_shifts : bool
        A tilt moves the contact over the crown.
    free : bool
        Rollers find their creepage from the bearing torque.
    slip_profile : ndarray, shape (rollers, strips), optional
        Differential slip of the unworn bodies without tilt; worn depth adds to it. Without it
        creepage varies with spin alone.
    varying : sequence of Varying
        Inputs that follow processes in time.
    redraw : callable, optional
        Draws the inputs of single passes, see `Redraw`.
    expectation : WearProblem, optional
        The same problem with contacts that stand for passes drawn one by one, to record by.
    iteration_tolerance : float
        Relative change of wear and loads below which the iterations of an implicit step end.
    stacked : tuple of WearProblem
        The problem of each realisation where several are stepped together, with its own loads, wear
        factors and paths in time. Empty: all realisations share those of this problem.
    """

    grid: Grid
    model: ContactModel
    law: WearLaw
    load: Load
    terms: Mapping[str, LoadTerm]
    kinematics: Kinematics
    flat_gap: FloatArray
    from_apex: FloatArray
    inputs: ContactInputs
    roller: IntArray
    weight: FloatArray
    half: IntArray
    tilt_shifts: bool = True
    free: bool = False
    slip_profile: FloatArray | None = None
    varying: tuple[Varying, ...] = ()
    redraw: Redraw | None = None
    expectation: WearProblem | None = None
    iteration_tolerance: float = 1e-8
    stacked: tuple[WearProblem, ...] = ()

    @cached_property
    def shape(self) -> tuple[int, int, int]:
        """Leading axes: stations, contacts, realisations."""
        stations, _, realisations = self.flat_gap.shape[:3]
        return stations, len(self.roller), realisations

    @cached_property
    def rollers(self) -> int:
        """Number of rollers of the problem."""
        return len(self.kinematics.multiplicity)

    @property
    def has_nodes(self) -> bool:
        """Whether a roller's passes are stood for by several contacts."""
        return len(self.roller) > self.rollers

    @cached_property
    def _roller_each(self) -> bool:
        """Whether every contact is a roller's only one, in the order of the rollers."""
        return np.array_equal(self.roller, np.arange(self.rollers))

    def at_contacts(self, values: FloatArray) -> FloatArray:
        """Return the values of the roller of each contact, (S, R, ...) to (S, C, ...)."""
        return values if self._roller_each else values[:, self.roller]

    @cached_property
    def halved(self) -> WearProblem:
        """The problem with the first half of every roller's contacts in the place of all."""
        chosen = np.flatnonzero(self.half == 0)
        return replace(
            self,
            inputs=self.inputs.at(chosen),
            roller=self.roller[chosen],
            weight=2.0 * self.weight[chosen],
            half=self.half[chosen],
        )

    @cached_property
    def contacts(self) -> tuple[tuple[int, int, int], ...]:
        """Station, contact and realisation of every contact, in their order."""
        stations, contacts, realisations = (range(count) for count in self.shape)
        return tuple((s, c, v) for s in stations for c in contacts for v in realisations)

    @cached_property
    def bodies(self) -> IntArray:
        """The station and the roller that each contact touches, shape (stations * contacts, 2)."""
        stations, contacts, _ = self.shape
        station, contact = np.divmod(np.arange(stations * contacts), contacts)
        return np.stack([station, self.roller[contact]], axis=1)

    @cached_property
    def nominal_gap(self) -> FloatArray:
        """Gap before wear, shape (stations, contacts, realisations, strips) [m].

        A tilted roller keeps its crown and turns about its apex: tilt adds a linear term, which
        moves the contact by R_crown times tilt.
        """
        gap = np.take(self.flat_gap, self.roller, axis=1)
        if self.tilt_shifts and self.inputs.tilt.any():
            gap = gap + self.inputs.tilt[:, :, None] * self.from_apex[self.roller][:, None, :]
        return gap

    @cached_property
    def _nominal_least(self) -> FloatArray:
        """Least gap of each contact before wear, shape (stations, contacts, realisations) [m]."""
        least: FloatArray = self.nominal_gap.min(axis=-1)
        return least

    @cached_property
    def spin(self) -> FloatArray:
        """Spin of every contact, shape (contacts, realisations) [1/m]."""
        spin: FloatArray = self.inputs.tilt / self.kinematics.roller_radius
        return spin

    @cached_property
    def cylinder_share(self) -> FloatArray:
        """Part of all passes that each contact makes, shape (contacts,)."""
        kinematics = self.kinematics
        share = kinematics.multiplicity[self.roller] * self.weight
        return np.asarray(share / kinematics.physical_rollers)

    @cached_property
    def _physical_contacts(self) -> FloatArray:
        """Physical rollers behind each contact, to go with (stations, contacts, realisations)."""
        each: FloatArray = self.cylinder_share * self.kinematics.physical_rollers
        return each[None, :, None]

    @cached_property
    def stiffness(self) -> Number:
        """What the load loses per descent [N/m]."""
        each = [problem.load.stiffness for problem in self.stacked]
        return np.array(each) if each else self.load.stiffness

    @cached_property
    def has_spring(self) -> bool:
        """Whether a load falls as its roller descends."""
        return bool(np.any(self.stiffness))

    @cached_property
    def has_feedback(self) -> bool:
        """Whether a load depends on what the contacts do."""
        return self.has_spring or bool(self.terms)

    def force(self, time: Number) -> Number:
        """Return the load at a time [s] [N]."""
        if not self.stacked:
            return float(self.load.force(np.array([time]))[0])
        times = np.broadcast_to(time, len(self.stacked))[:, None]
        forces = [
            problem.load.force(own)[0] for problem, own in zip(self.stacked, times, strict=True)
        ]
        return np.array(forces)

    def mean_load(self, start: Number, stop: Number) -> Number:
        """Return the exact mean of the load between two times [s] [N]."""
        if not self.stacked:
            return self.load.mean(one_of(start), one_of(stop))
        return each_between([problem.load.mean for problem in self.stacked], start, stop)

    def deviations(self, start: Number, stop: Number) -> list[tuple[str, tuple[int, ...], Number]]:
        """Return what varies between two times [s]: field, rollers and standard deviation."""
        problems, everyone = self.stacked or (self,), tuple(range(self.rollers))
        load = each_between([problem.load.deviation for problem in problems], start, stop)
        found: list[tuple[str, tuple[int, ...], Number]] = [("normal_force_offset", everyone, load)]
        for k, item in enumerate(self.varying):
            paths = [problem.varying[k].path.deviation for problem in problems]
            found.append((item.name, item.rollers, each_between(paths, start, stop)))
        return found

    def at_time(self, start: Number, stop: Number) -> WearProblem:
        """Return the problem with every process at its mean between two times [s]."""
        if not self.varying:
            return self
        inputs, problems = self.inputs, self.stacked or (self,)
        for k, item in enumerate(self.varying):
            chosen = np.isin(self.roller, item.rollers)[:, None]
            mean = each_between([problem.varying[k].path.mean for problem in problems], start, stop)
            values = np.where(chosen, mean, getattr(inputs, item.name))
            inputs = inputs.with_values({item.name: values})
        return replace(self, inputs=inputs, varying=())

    def single_passes(self, rollers: IntArray, first: int, times: FloatArray) -> WearProblem:
        """Return a problem whose contacts are passes number `first` on.

        Parameters
        ----------
        rollers : ndarray of int, shape (passes,)
            Which roller makes each pass.
        first : int
            Number of the first pass.
        times : ndarray, shape (passes,)
            When each is made [s].
        """
        inputs = self.inputs.at(rollers)
        for item in self.varying:
            chosen = np.isin(rollers, item.rollers)[:, None]
            now = item.path.at(times)[:, None]
            inputs = inputs.with_values(
                {item.name: np.where(chosen, now, getattr(inputs, item.name))}
            )
        if self.redraw is not None:
            inputs = self.redraw(inputs, first)
        alone = np.ones(len(rollers))
        return replace(self, inputs=inputs, roller=rollers, weight=alone, varying=())

    @overload
    def time(self, passes: float) -> float: ...

    @overload
    def time(self, passes: Number) -> Number: ...

    def time(self, passes: Number) -> Number:
        """Return the time at which `passes` roller passes are done [s]."""
        return passes / self.kinematics.pass_rate

    def gap(self, cylinder_depth: FloatArray, roller_depth: FloatArray) -> FloatArray:
        """Return the gap of every contact [m]; depths as in `WearState`."""
        return self.nominal_gap + cylinder_depth + self.at_contacts(roller_depth)

    def descent(self, gap: FloatArray) -> FloatArray:
        """Return how far each contact's roller has sunk into worn material, shape (S, C, N) [m].

        It is the rise of the least gap: rigid bodies would approach by that much. On one track it
        equals the worn depth.
        """
        risen: FloatArray = gap.min(axis=-1) - self._nominal_least
        return risen

    def _variation(
        self,
        roller: int | IntArray,
        spin: float | FloatArray,
        cylinder_depth: FloatArray,
        roller_depth: FloatArray,
    ) -> FloatArray | None:
        """Return how creepage varies over the strips, last axis strips, or None for spin alone.

        The tilt counts once in differential slip: as the shift of the contact away from the apex,
        or, where it shifts nothing, as the spin's -phi y.
        """
        if self.slip_profile is None:
            return None
        kinematics = self.kinematics
        variation: FloatArray = (
            self.slip_profile[roller]
            + roller_depth / kinematics.roller_radius
            - cylinder_depth / kinematics.cylinder_radius
        )
        return variation if self.tilt_shifts else variation - spin * self.from_apex[roller]

    def points(
        self, loads: FloatArray, cylinder_depth: FloatArray, roller_depth: FloatArray
    ) -> Sequence[OperatingPoint]:
        """Return the operating point of every contact.

        Parameters
        ----------
        loads : ndarray, shape (stations, contacts, realisations)
            Loads [N].
        cylinder_depth, roller_depth : ndarray
            Worn depths as in `WearState` [m].
        """
        if self.free:
            return [
                self.point(
                    c,
                    v,
                    float(loads[s, c, v]),
                    cylinder_depth[s, 0, v],
                    roller_depth[0, self.roller[c], v],
                )
                for s, c, v in self.contacts
            ]
        variation = self._variation(
            self.roller[None, :, None],
            self.spin[None, :, :, None],
            cylinder_depth,
            self.at_contacts(roller_depth),
        )
        if variation is not None:
            strips = self.grid.strips
            variation = np.broadcast_to(variation, (*self.shape, strips)).reshape(-1, strips)
        longitudinal, lateral, spin, friction = self._columns
        return OperatingPoints(
            normal_force=loads.ravel(),
            longitudinal=longitudinal,
            lateral=lateral,
            spin=spin,
            friction=friction,
            rolling_speed=self.kinematics.rolling_speed,
            variation=variation,
        )

    @cached_property
    def _columns(self) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Both creepages, spin and friction of the contacts in their order, (contacts,) each."""
        inputs = self.inputs
        longitudinal, lateral, spin, friction = (
            np.broadcast_to(column, self.shape).ravel()
            for column in (inputs.longitudinal, inputs.yaw, self.spin, inputs.friction)
        )
        return longitudinal, lateral, spin, friction

    def point(
        self,
        contact: int,
        realisation: int,
        load: float,
        cylinder_depth: FloatArray,
        roller_depth: FloatArray,
    ) -> OperatingPoint:
        """Return the operating point of one contact at its worn depths, shape (strips,) [m]."""
        kinematics, inputs, place = self.kinematics, self.inputs, (contact, realisation)
        spin, radius = float(self.spin[place]), None
        if self.free:
            s = self.from_apex[self.roller[contact]]
            radius = kinematics.roller_radius - s * s / (2.0 * kinematics.crown_radius)
            radius = radius - roller_depth
        return OperatingPoint(
            normal_force=load,
            rolling_speed=kinematics.rolling_speed,
            creepage=Creepage(
                float(inputs.longitudinal[place]),
                float(inputs.yaw[place]),
                spin,
                self._variation(int(self.roller[contact]), spin, cylinder_depth, roller_depth),
            ),
            friction=float(inputs.friction[place]),
            bearing_torque=float(inputs.bearing_torque[place]) if self.free else None,
            rolling_radius=radius,
        )

    def values_of(self, contacts: Sequence[ContactSolution], name: str) -> FloatArray:
        """Return the field `name` of all contacts, with the axes of `shape` first."""
        if isinstance(contacts, BatchSolution) and contacts.shape == self.shape:
            return contacts.stack(name)
        values = rows_of(contacts, name)
        return values.reshape(self.shape + values.shape[1:])

    def wear_per_pass(self, contacts: Sequence[ContactSolution]) -> tuple[FloatArray, FloatArray]:
        """Return the depth one pass of each contact wears off either body, where it touches.

        Returns
        -------
        cylinder, roller : ndarray, shape (stations, contacts, realisations, strips)
            Depth per pass of that contact [m].
        """
        dissipation = self.values_of(contacts, "dissipation")
        cylinder, roller = (self._depth_per_pass(body, contacts, dissipation) for body in BODIES)
        return cylinder, roller

    def _depth_per_pass(
        self,
        body: Body,
        contacts: Sequence[ContactSolution],
        dissipation: FloatArray,
        times: Number = 1.0,
    ) -> FloatArray:
        """Return the depth one pass of each contact wears off `body` [m], `times` over."""
        factor, speed = self.wear_factors[body], self.kinematics.rolling_speed
        if factor is None:
            depths = np.array([self.law.depth_per_pass(body, c, speed) for c in contacts])
            return times * depths.reshape(dissipation.shape)
        if isinstance(factor, float) and factor == 0.0:
            return np.zeros(dissipation.shape)
        return (times * per_strip(factor)) * dissipation

    @cached_property
    def wear_factors(self) -> dict[Body, Number | None]:
        """Depth per pass over dissipation of either body [m/(W/m)] where wear is linear in it."""
        return {body: self._wear_factor(body) for body in BODIES}

    def _wear_factor(self, body: Body) -> Number | None:
        problems, speed = self.stacked or (self,), self.kinematics.rolling_speed
        factors = [problem.law.depth_per_dissipation(body, speed) for problem in problems]
        known = [factor for factor in factors if factor is not None]
        if len(known) < len(factors):
            return None
        return np.array(known) if self.stacked else known[0]

    def shared_wear(
        self, cylinder: FloatArray, roller: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Return depth per roller pass of the bodies, from that of the contacts.

        Every station of the cylinder is worn by all contacts in turn, every roller by its own at
        all stations.

        Returns
        -------
        cylinder_rate : ndarray, shape (stations, 1, realisations, strips)
        roller_rate : ndarray, shape (1, rollers, realisations, strips)
            Depth per roller pass [m].
        """
        shares = self.wear_shares
        return self.sum_of_parts(cylinder * shares["cylinder"], roller * shares["roller"])

    @cached_property
    def wear_shares(self) -> dict[Body, FloatArray]:
        """Part that a pass of each contact has in the wear of either body per roller pass.

        To go with (stations, contacts, realisations, strips).
        """
        own = self.weight * self.kinematics.roller_share / self.shape[0]
        shares: dict[Body, FloatArray] = {"cylinder": self.cylinder_share, "roller": own}
        return {body: share[None, :, None, None] for body, share in shares.items()}

    def sum_of_parts(
        self, cylinder: FloatArray, roller: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Return the wear of the bodies from each contact's own part in it, as `shared_wear`."""
        return sum_along(cylinder, axis=1), sum_along(self.sum_of_roller(roller), axis=0)

    def wear_parts(
        self, contacts: Sequence[ContactSolution], passes: Number
    ) -> tuple[FloatArray, FloatArray]:
        """Return each contact's own part in the wear of the bodies over some passes [m].

        Returns
        -------
        cylinder, roller : ndarray, shape (stations, contacts, realisations, strips)
        """
        dissipation, length = self.values_of(contacts, "dissipation"), per_strip(passes)
        cylinder, roller = (
            self._depth_per_pass(body, contacts, dissipation, self.wear_shares[body] * length)
            for body in BODIES
        )
        return cylinder, roller

    def per_roller(self, values: FloatArray) -> FloatArray:
        """Return the weighted mean over each roller's contacts, (S, C, ...) to (S, R, ...)."""
        if not self.has_nodes:
            return values
        weighted = values * self.weight.reshape(1, -1, *(1,) * (values.ndim - 2))
        return self.sum_of_roller(weighted)

    def sum_of_roller(self, values: FloatArray) -> FloatArray:
        """Return the sum over each roller's contacts, (S, C, ...) to (S, R, ...)."""
        if self._roller_each:
            return values
        found = [values[:, self.roller == r].sum(axis=1) for r in range(self.rollers)]
        return np.stack(found, axis=1)

    def total_power(self, power: FloatArray) -> FloatArray:
        """Return the power of all physical rollers, shape (N,) [W], from (S, C, N)."""
        rollers = sum_in_order(power * self._physical_contacts, axis=1)
        total: FloatArray = mean_along(rollers, axis=0)[0]
        return total

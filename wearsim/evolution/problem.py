"""Wear problem: the part of a wear test that does not change from step to step."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import cycle
from typing import TYPE_CHECKING, Any

import numpy as np

from wearsim.contact_batch import ContactBatch, ContactBatchSolution
from wearsim.evolution.quantities import (
    ContactInputs,
    Kinematics,
    Varying,
    is_every,
    sum_along,
    sum_in_order,
    values_between,
)
from wearsim.plugins import BODIES, Body, ContactModel, Load, LoadTerm, WearLaw
from wearsim.types import BoolArray, FloatArray, Grid, IntArray

if TYPE_CHECKING:
    from wearsim.evolution.fatigue import Fatigue
    from wearsim.evolution.strips import Growth

UNEVEN = 3.0  # bend of a gap over its median from which it is not that of crowned bodies
#: properties that do not depend on the inputs of contacts, or on the tilt alone
_CONSTANTS = (
    *("shape", "body_rows", "volume_weights", "nominal_least_gap", "cylinder_share", "has_spring"),
    *("constant_load", "pauses", "greatest_load", "wear_coefficients", "power_weights"),
)
_OF_LOAD = {"normal_force_offset"}  # inputs on which no other constant value depends
_OF_GAP = "nominal_gap", "contact_gap", "nominal_least_gap", "has_crowned_gap"


@dataclass(frozen=True)
class WearProblem:
    """Wear tests without their state: bodies, contact model, loads, wear laws and contact inputs.

    The realisations are tests that share grid, model and kinematics; a single test is one
    realisation. Contacts are numbered (station, contact, realisation). A roller has one contact.
    Where inputs are drawn at every pass it has several, the nodes of a quadrature over its passes,
    each with a weight.

    Parameters
    ----------
    grid : Grid
        Strips across the track.
    model : ContactModel
        Contact model, built for the grid.
    laws : tuple of WearLaw
        Wear law of both bodies, one per realisation; none where contacts are only solved.
    loads : tuple of Load
        Normal load of every roller over time, one per realisation; one where none is stepped.
    terms : mapping of str to LoadTerm
        Terms added to the load, in a fixed order.
    kinematics : Kinematics
        Radii, speed and number of rollers.
    flat_gap : ndarray, shape (stations, rollers, realisations, strips)
        Gap of rollers without tilt before wear [m].
    from_apex : ndarray, shape (rollers, realisations or 1, strips)
        Axial distance of each strip from the roller's apex [m].
    inputs : ContactInputs
        Inputs of every contact.
    roller : ndarray of int, shape (contacts,)
        Roller of each contact.
    weight : ndarray, shape (contacts,)
        Fraction of its roller's passes that each contact represents.
    tilt_shifts : bool
        A tilt moves the contact over the crown.
    free : bool
        The creepage of the rollers follows from the bearing torque.
    roller_drop : ndarray, shape (rollers, realisations or 1, strips), optional
        Radius of the unworn rollers below their rolling radius [m]; only of free rollers.
    crowned : bool
        Whether the forms of the bodies along the axis are circular crowns.
    slip_profile : ndarray, shape (stations or 1, rollers, realisations or 1, strips), optional
        Differential slip of the unworn bodies without tilt, to which worn depth adds. If absent,
        creepage varies with spin alone.
    varying : sequence of Varying
        Inputs that are random processes in time.
    iteration_tolerance : float
        Relative change of wear and loads below which an implicit step has converged.
    passes_per_draw : float
        Passes that share one draw of the inputs drawn at every pass.
    quadrature_error : float
        Known part of the relative error of wear by the quadrature over inputs of every pass.
    growth : tuple of Growth
        How the strips of each realisation grow with its groove; none where they do not.
    fatigue : Fatigue, optional
        Fatigue of the bodies.
    """

    grid: Grid
    model: ContactModel
    laws: tuple[WearLaw, ...]
    loads: tuple[Load, ...]
    terms: Mapping[str, LoadTerm]
    kinematics: Kinematics
    flat_gap: FloatArray
    from_apex: FloatArray
    inputs: ContactInputs
    roller: IntArray
    weight: FloatArray
    tilt_shifts: bool = True
    free: bool = False
    roller_drop: FloatArray | None = None
    crowned: bool = True
    slip_profile: FloatArray | None = None
    varying: tuple[Varying, ...] = ()
    iteration_tolerance: float = 1e-8
    passes_per_draw: float = 1.0
    quadrature_error: float = 0.0
    growth: tuple[Growth, ...] = ()
    fatigue: Fatigue | None = None

    @cached_property
    def shape(self) -> tuple[int, int, int]:
        """Leading axes of contact arrays: stations, contacts, realisations."""
        stations, _, realisations = self.flat_gap.shape[:3]
        return stations, len(self.roller), realisations

    @cached_property
    def rollers(self) -> int:
        """Number of rollers of the problem; identical physical rollers are merged."""
        return len(self.kinematics.multiplicity)

    @cached_property
    def contacts_each(self) -> int:
        """Number of contacts of a realisation."""
        return self.shape[0] * self.shape[1]

    @cached_property
    def has_nodes(self) -> bool:
        """Whether several quadrature nodes represent the passes of a roller."""
        return len(self.roller) > self.rollers

    @cached_property
    def _one_contact_per_roller(self) -> bool:
        return np.array_equal(self.roller, np.arange(self.rollers))

    def at_contacts(self, values: FloatArray) -> FloatArray:
        """Return the value of each contact's roller: (S, R, ...) to (S, C, ...)."""
        return values if self._one_contact_per_roller else values[:, self.roller]

    def at(self, realisations: IntArray) -> WearProblem:
        """Return the problem of some realisations, by number and in that order."""
        if is_every(realisations, self.shape[2]):
            return self
        numbers = realisations.tolist()

        def part(values: FloatArray, axis: int) -> FloatArray:
            return values if values.shape[axis] == 1 else values.take(realisations, axis=axis)

        some = replace(
            self,
            laws=tuple(map(self.laws.__getitem__, numbers)),
            growth=tuple(map(self.growth.__getitem__, numbers)) if self.growth else (),
            loads=tuple(map(self.loads.__getitem__, numbers)),
            kinematics=self.kinematics.at(realisations),
            flat_gap=np.take(self.flat_gap, realisations, axis=2),
            from_apex=part(self.from_apex, 1),
            inputs=self.inputs.at(realisations, axis=1),
            roller_drop=None if self.roller_drop is None else part(self.roller_drop, 1),
            slip_profile=None if self.slip_profile is None else part(self.slip_profile, 2),
            varying=tuple(
                replace(item, paths=item.paths.at(realisations)) for item in self.varying
            ),
        )
        if self.constant_load is not None:  # the history takes many realisations of one test
            some.__dict__["constant_load"] = self.constant_load.take(realisations, axis=-1)
        if not self.pauses:
            some.__dict__["pauses"] = []
        return some

    @cached_property
    def bodies(self) -> IntArray:
        """Station and roller in each contact, shape (stations * contacts, 2)."""
        stations, contacts, _ = self.shape
        station, contact = np.divmod(np.arange(stations * contacts), contacts)
        return np.stack([station, self.roller[contact]], axis=1)

    @cached_property
    def body_rows(self) -> IntArray:
        """`bodies` counted together, the stations of the cylinder first, as in `stacked`."""
        return np.asarray(self.bodies + np.array([0, self.shape[0]]))

    @cached_property
    def volume_weights(self) -> FloatArray:
        """Kind and volume of the bodies of `WearState.stacked`, shape (2, stations + rollers).

        Row 0 is 1 for the cylinder or a station of the cam and 0 for a roller; row 1 is the worn
        volume of the body over the sum of its depths over the strips [m^2].
        """
        kinematics, stations = self.kinematics, self.shape[0]
        cylinder = np.broadcast_to(np.ravel(kinematics.track.track_radius) / stations, stations)
        rollers = kinematics.roller_radius * kinematics.multiplicity
        kinds = np.concatenate([np.ones(stations), np.zeros(self.rollers)])
        volumes = 2.0 * np.pi * self.grid.spacing * np.concatenate([cylinder, rollers])
        return np.array([kinds, volumes])

    @cached_property
    def nominal_least_gap(self) -> FloatArray:
        """Least gap before wear, shape (stations, contacts, realisations) [m]."""
        return np.asarray(self.nominal_gap.min(axis=-1))

    @cached_property
    def nominal_gap(self) -> FloatArray:
        """Gap before wear, shape (stations, contacts, realisations, strips) [m].

        A tilted roller keeps its crown and turns about its apex: tilt adds a linear term, which
        moves the contact by R_crown times tilt.
        """
        gap = self.at_contacts(self.flat_gap)
        if self.tilt_shifts and self.inputs.tilt.any():
            gap = gap + self.inputs.tilt[:, :, None] * self.from_apex[self.roller]
        return gap

    @cached_property
    def contact_gap(self) -> FloatArray:
        """Copy of `nominal_gap` for kernels, shape (contacts, strips) [m]."""
        shape = *self.shape, self.grid.strips
        return np.array(np.broadcast_to(self.nominal_gap, shape)).reshape(-1, shape[-1])

    @cached_property
    def contact_stiffness(self) -> FloatArray:
        """Loss of load per descent of each roller, 0 without springs, (contacts,) [N/m]."""
        stiffness = self.stiffness if self.has_spring else np.zeros(())
        return np.array(np.broadcast_to(stiffness, self.shape)).ravel()

    @cached_property
    def has_crowned_gap(self) -> bool:
        """Whether the gap before wear is that of crowned bodies in all strips.

        It is not where strips reach the ends of a roller, a rounding or a chamfer, on measured
        profiles, and with other forms along the axis than circular crowns.
        """
        bend = np.diff(self.nominal_gap, 2, axis=-1)
        if not self.crowned or bend.size == 0:  # of fewer than three strips
            return False
        return bool(((bend > 0.0) & (bend < UNEVEN * np.median(bend, -1, keepdims=True))).all())

    @cached_property
    def spin(self) -> FloatArray:
        """Spin of every contact, shape (contacts, realisations) [1/m]."""
        return self.inputs.tilt / self.kinematics.roller_radius

    @cached_property
    def nominal_batch(self) -> ContactBatch:
        """All contacts with the inputs that no step changes, on the unworn bodies without load."""
        columns: dict[str, FloatArray | float] = {
            "longitudinal_curvature": self.kinematics.track.longitudinal_curvature,
            "rolling_speed": self.kinematics.track.rolling_speed,
            "longitudinal": self.inputs.longitudinal,
            "lateral": self.inputs.yaw,
            "spin": self.spin,
            "friction": self.inputs.friction,
        }
        if self.free:
            columns |= self.kinematics.track.free_rolling(self.inputs)
        filled: dict[str, Any] = {
            n: np.broadcast_to(c, self.shape).flatten() for n, c in columns.items()
        }
        shape = (*self.shape, self.grid.strips)
        return ContactBatch(
            gap=np.broadcast_to(self.nominal_gap, shape).reshape(-1, shape[-1]),
            normal_force=np.zeros(math.prod(self.shape)),
            **filled,
            shape=self.shape,
        )

    @cached_property
    def cylinder_share(self) -> FloatArray:
        """Fraction of all passes made by each contact, shape (contacts,)."""
        passes = self.kinematics.multiplicity[self.roller] * self.weight
        return np.asarray(passes / self.kinematics.physical_rollers)

    @cached_property
    def stiffness(self) -> FloatArray:
        """Loss of load per descent, shape (realisations,), or (stations, 1, 1) of a cam [N/m]."""
        return self.kinematics.track.springs(np.array([load.stiffness for load in self.loads]))

    @cached_property
    def constant_load(self) -> FloatArray | None:
        """Load before feedback, if it is constant in all realisations; as `force`."""
        constant = all(load.constant for load in self.loads)
        return self._force(np.zeros(len(self.loads))) if constant else None

    @cached_property
    def varies(self) -> bool:
        """Whether load or inputs vary in time."""
        return self.constant_load is None or len(self.varying) > 0

    @cached_property
    def has_spring(self) -> bool:
        """Whether a load falls as its roller descends."""
        return bool(self.stiffness.any()) or self.kinematics.track.inertia.size > 0

    def feedback(self, displacement: FloatArray) -> FloatArray:
        """Return the decrease of the loads by displacements of the rollers, (S, C, N) [N]."""
        return self.kinematics.track.with_inertia(self.stiffness * displacement, displacement)

    @cached_property
    def pauses(self) -> list[FloatArray]:
        """Start and end of the pauses of each realisation, shape (pauses, 2) [passes]."""
        loads = self.loads if self.constant_load is None else ()  # a constant load has none
        pauses = [load.pauses * self.kinematics.pass_rate for load in loads]
        return pauses if any(map(len, pauses)) else []

    @cached_property
    def greatest_load(self) -> FloatArray:
        """Greatest load of a test with pauses, otherwise -inf, shape (realisations,) [N]."""
        greatest = [-np.inf] * len(self.loads)
        for place, load in enumerate(self.loads):
            if len(load.pauses):
                greatest[place] = load.extremes(*(load.span or (0.0, float(load.pauses.max()))))[1]
        return np.array(greatest)

    def force(self, time: FloatArray) -> FloatArray:
        """Return the load before feedback at a time [s], (N,), or (S, 1, N) on a cam [N]."""
        return self._force(time) if self.constant_load is None else self.constant_load

    def _force(self, time: FloatArray) -> FloatArray:
        pairs = zip(self.loads, time[:, None], strict=True)
        return self.at_stations(np.array([load.force(moment)[0] for load, moment in pairs]))

    def mean_force(self, start: FloatArray, stop: FloatArray) -> FloatArray:
        """Return the exact mean of the load before feedback between two times; as `force`."""
        return self.at_stations(values_between([load.mean for load in self.loads], start, stop))

    def at_stations(self, force: FloatArray) -> FloatArray:
        """Return the normal force at the stations under a load of each realisation, as `force`."""
        track = self.kinematics.track
        return force * track.load_factor + track.load_rest

    def at_time(self, start: FloatArray, stop: FloatArray) -> WearProblem:
        """Return the problem with every process at its mean between two times [s]."""
        if not self.varying:
            return self
        values: dict[str, FloatArray] = {}
        for item, chosen in zip(self.varying, self._varying_contacts, strict=True):
            mean = item.paths.mean(start, stop)
            before = values.get(item.name, getattr(self.inputs, item.name))
            values[item.name] = np.where(chosen, mean, before)
        return self.with_inputs(replace(self.inputs, **values))

    def with_inputs(self, inputs: ContactInputs) -> WearProblem:
        """Return the problem with constant inputs; values that do not depend on them are kept."""
        for name in _CONSTANTS if self.laws and self.linear_wear else ():
            getattr(self, name)  # computed once, for all problems with other inputs
        problem = object.__new__(WearProblem)
        before, after = vars(self.inputs), vars(inputs)
        changed = {name for name in after if after[name] is not before.get(name)}
        lost = {"constants", "varies", *(() if changed <= _OF_LOAD else ("nominal_batch", "spin"))}
        if "tilt" in changed and not np.array_equal(inputs.tilt, self.inputs.tilt):
            lost.update(_OF_GAP)
        problem.__dict__.update({n: v for n, v in self.__dict__.items() if n not in lost})
        problem.__dict__.update(inputs=inputs, varying=())
        return problem

    @cached_property
    def _varying_contacts(self) -> list[BoolArray]:
        """Whether each input of `varying` acts on each contact, shape (contacts, 1)."""
        return [np.isin(self.roller, item.rollers)[:, None] for item in self.varying]

    def time(self, passes: FloatArray) -> FloatArray:
        """Return the time at which `passes` roller passes are done [s]."""
        return passes / self.kinematics.pass_rate

    def gap(self, cylinder_depth: FloatArray, roller_depth: FloatArray) -> FloatArray:
        """Return the gap of every contact [m]; depths as in `WearState`."""
        return self.nominal_gap + cylinder_depth + self.at_contacts(roller_depth)

    def values_of(self, contacts: ContactBatchSolution, name: str) -> FloatArray:
        """Return the field `name` of all contacts, with the axes of `shape` first."""
        values: FloatArray = getattr(contacts, name)
        return values.reshape(self.shape + values.shape[1:])

    def wear_parts(self, contacts: ContactBatchSolution, passes: FloatArray | float) -> FloatArray:
        """Return the contribution of each contact to the wear of the bodies over some passes [m].

        Returns
        -------
        ndarray, shape (2, stations, contacts, realisations, strips)
            Wear of the cylinder and of the rollers.
        """
        per_strip = passes if isinstance(passes, float) else passes[..., None]
        if self.linear_wear:
            coefficients = self.wear_coefficients.reshape(2, *self.shape, 1)
            return np.asarray(coefficients * per_strip * self.values_of(contacts, "dissipation"))
        shares = self.wear_shares
        return self.depths_worn(contacts, {body: shares[body] * per_strip for body in BODIES})

    @cached_property
    def wear_coefficients(self) -> FloatArray:
        """Wear of both bodies by a contact per roller pass and dissipation, (2, contacts, 1)."""
        ones = np.ones((*self.shape, 1))
        pairs = [(self.wear_shares[body], self.wear_factors[body]) for body in BODIES]
        parts = [share * np.asarray(factor)[..., None] * ones for share, factor in pairs]
        return np.stack(parts).reshape(2, -1, 1)

    def depths_worn(
        self, contacts: ContactBatchSolution, passes: Mapping[Body, FloatArray | float]
    ) -> FloatArray:
        """Return the depth that `passes` passes of each contact wear off both bodies, as parts."""
        dissipation = self.values_of(contacts, "dissipation")
        parts = np.empty((len(BODIES), *dissipation.shape))
        for depth, body in zip(parts, BODIES, strict=True):
            factor = self.wear_factors[body]
            if factor is None:
                speed = self.kinematics.track.rolling_speed
                speeds = np.broadcast_to(speed, self.shape).ravel().tolist()
                points = zip(contacts, cycle(self.laws), speeds, strict=False)
                depths = np.array([law.depth_per_pass(body, c, v) for c, law, v in points])
                depth[:] = passes[body] * depths.reshape(dissipation.shape)
            else:
                np.multiply(passes[body] * factor[..., None], dissipation, out=depth)
        return parts

    @cached_property
    def wear_factors(self) -> dict[Body, FloatArray | None]:
        """Depth per pass and dissipation of either body, (N,), or (S, 1, N) of a cam [m/(W/m)].

        None if wear is not linear in the dissipation.
        """
        shape, of_bodies = (*self.kinematics.track.axes, len(self.laws)), {}
        speeds = np.broadcast_to(self.kinematics.track.rolling_speed, shape).ravel().tolist()
        for body in BODIES:
            pairs = zip(cycle(self.laws), speeds, strict=False)
            factors = [law.depth_per_dissipation(body, speed) for law, speed in pairs]
            of_bodies[body] = None if None in factors else np.array(factors).reshape(shape)
        return of_bodies

    @cached_property
    def linear_wear(self) -> bool:
        """Whether wear is linear in the dissipation."""
        return all(factor is not None for factor in self.wear_factors.values())

    @cached_property
    def cylinder_wear_share(self) -> FloatArray:
        """Part of the wear of a contact that is the cylinder's, at the first station, (N,).

        A half where wear is not linear in the dissipation.
        """
        if not self.linear_wear:
            return np.full(self.shape[2], 0.5)
        factors, shares = self.wear_factors, self.wear_shares
        cylinder, rollers = (shares[body].sum() * np.asarray(factors[body]) for body in BODIES)
        every = np.maximum(cylinder + rollers / self.rollers, np.finfo(float).tiny)
        return np.array(np.ravel(cylinder / every)[: self.shape[2]])

    @cached_property
    def wear_shares(self) -> dict[Body, FloatArray]:
        """Passes of each contact over a point of either body per roller pass.

        Broadcast to (stations, contacts, realisations, strips).
        """
        share = np.reshape(self.kinematics.roller_share, (-1, 1))
        roller = self.weight * share / self.shape[0]
        shares: dict[Body, FloatArray] = {"cylinder": self.cylinder_share[None], "roller": roller}
        return {body: share[:, :, None, None] for body, share in shares.items()}

    def sum_of_parts(
        self, cylinder: FloatArray, roller: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Return the wear of cylinder and rollers, shapes as in `WearState`, from `wear_parts`."""
        return sum_along(cylinder, axis=1), sum_along(self._sum_of_roller(roller), axis=0)

    def per_roller(self, values: FloatArray) -> FloatArray:
        """Return the weighted mean over each roller's contacts, (S, C, ...) to (S, R, ...)."""
        if not self.has_nodes:
            return values
        return self._sum_of_roller(values * self.weight.reshape(1, -1, *(1,) * (values.ndim - 2)))

    def _sum_of_roller(self, values: FloatArray) -> FloatArray:
        """Return the sum over each roller's contacts, (S, C, ...) to (S, R, ...)."""
        if self._one_contact_per_roller:
            return values
        return np.stack([values[:, self.roller == r].sum(axis=1) for r in range(self.rollers)], 1)

    def total_power(self, power: FloatArray) -> FloatArray:
        """Return the power of all physical rollers, shape (N,) [W], from (S, C, N)."""
        return sum_in_order(self.power_weights[:, None] * power.reshape(self.contacts_each, -1), 0)

    @cached_property
    def power_weights(self) -> FloatArray:
        """Part of the power of each contact in that of all physical rollers, shape (S * C,)."""
        of_stations = self.mean_over_turn(np.eye(self.shape[0]))[0]
        return np.outer(of_stations, self.cylinder_share * self.kinematics.physical_rollers).ravel()

    @cached_property
    def mean_over_turn(self) -> Callable[[FloatArray], FloatArray]:
        """Mean of values over the stations weighted by their time, first axis of length one."""
        return self.kinematics.track.mean_over_turn

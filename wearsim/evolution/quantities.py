"""Quantities of wear tests: inputs of contacts, kinematics, observables, sums over realisations."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from typing import Any, ClassVar, TypeAlias

import numpy as np

from wearsim.mechanics.cam import Extreme, Stations, greatest, greatest_value
from wearsim.mechanics.numerics.piecewise_linear import Paths
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

    @cached_property
    def mean_offset(self) -> FloatArray:
        """Mean of `normal_force_offset` over the contacts, shape (realisations,) [N]."""
        return np.asarray(self.normal_force_offset.mean(axis=0))

    def at(self, numbers: IntArray, axis: int = 0) -> ContactInputs:
        """Return the inputs of some contacts, or with axis 1 of some realisations, by number."""
        columns = (getattr(self, item.name) for item in fields(self))
        return ContactInputs(*(column.take(numbers, axis=axis) for column in columns))

    def with_values(self, values: Mapping[str, FloatArray]) -> ContactInputs:
        """Return these inputs with some of them replaced; arrays broadcast to the shape."""
        shape = self.friction.shape
        filled = {name: np.array(np.broadcast_to(array, shape)) for name, array in values.items()}
        return replace(self, **filled)


#: Function that draws the inputs of single passes.
#:
#: Its arguments are the inputs of each pass's roller and the number of the first pass.
Redraw: TypeAlias = Callable[[ContactInputs, int], ContactInputs]


@dataclass(frozen=True)
class Varying:
    """An input that follows a process in time.

    Parameters
    ----------
    name : str
        Field of `ContactInputs`.
    rollers : tuple of int
        Rollers of the problem that it acts on.
    paths : Paths
        Its value over time [s].
    """

    name: str
    rollers: tuple[int, ...]
    paths: Paths


@dataclass(frozen=True)
class OneStation:
    """The station of a cylinder, with the attributes that `CamStations` has for those of a cam.

    Parameters
    ----------
    longitudinal_curvature : float
        Relative curvature along rolling [1/m].
    rolling_speed, track_radius : float
        Rolling velocity V [m/s], and radius of the cylinder [m].
    """

    longitudinal_curvature: float
    rolling_speed: float
    track_radius: float
    load_factor: ClassVar[float] = 1.0
    load_rest: ClassVar[float] = 0.0
    pressure_angle: ClassVar[float] = 0.0
    inertia: ClassVar[FloatArray] = np.zeros((0, 0))
    skids: ClassVar[FloatArray] = np.zeros((0, 2))
    angles: ClassVar[None] = None
    whole: ClassVar[None] = None
    panels: ClassVar[None] = None
    relocated: ClassVar[None] = None
    recorded: ClassVar[None] = None
    axes: ClassVar[tuple[int, ...]] = ()
    places: ClassVar[IntArray] = np.zeros(1, dtype=np.int64)
    in_pass_loop: ClassVar[bool] = True  # of models that compile the passes

    def at(self, _realisations: IntArray) -> OneStation:
        """Return the station, which all realisations have."""
        return self

    def joined(self, _others: Sequence[Track]) -> OneStation:
        """Return the station of several tests, of which each `matches` this one."""
        return self

    def station(self, _number: int) -> tuple[float, ...]:
        """Return rolling velocity [m/s], part of a turn, and radius of the track [m]."""
        return self.rolling_speed, 1.0, self.track_radius

    def at_unworn(self, values: FloatArray) -> FloatArray:
        """Return the values."""
        return values

    def greatest(self, values: FloatArray) -> Extreme:
        """Return the value of the station, without an angle."""
        unknown = np.full(values.shape[1:], np.nan)
        return Extreme(self.greatest_value(values), unknown, unknown, unknown)

    def greatest_value(self, values: FloatArray) -> FloatArray:
        """Return the value of the station, the greatest along the first axis."""
        return np.asarray(values.max(axis=0))

    def mean_over_turn(self, values: FloatArray) -> FloatArray:
        """Return the value of the station; the first axis is kept."""
        return mean_along(values, axis=0)

    def springs(self, stiffness: FloatArray) -> FloatArray:
        """Return the loss of load per descent from those of the loads, (realisations,) [N/m]."""
        return stiffness

    def with_inertia(self, force: FloatArray, _displacement: FloatArray) -> FloatArray:
        """Return the decrease of the loads by springs, as there is no other [N]."""
        return force

    def free_rolling(self, inputs: ContactInputs) -> dict[str, FloatArray]:
        """Return the torque of free rollers [N m]."""
        return {"bearing_torque": inputs.bearing_torque}

    def over_radius(self, depth: FloatArray) -> FloatArray:
        """Return depths over the radius of curvature of the surface."""
        return depth / self.track_radius

    def matches(self, other: Track) -> bool:
        """Return whether tests on both tracks can be joined."""
        return self == other


@dataclass(frozen=True)
class CamStations:
    """Quantities that differ between the stations of a cam.

    Arrays have the shape (stations, 1, 1) or, where drawn values change them, (stations, 1,
    realisations).

    Parameters
    ----------
    angle, segment : ndarray
        Angle of the cam [rad], and number of the segment of its motion, from 1.
    rolling_speed, longitudinal_curvature, surface_curvature : ndarray
        Rolling velocity V [m/s], relative curvature along rolling and that of the cam [1/m].
    length, time_share : ndarray
        Length of the cam's surface [m] and part of a turn that each station represents.
    load_factor, load_rest : ndarray
        The normal force is the load of the problem times the factor, plus the rest [N].
    stiffness : ndarray
        Decrease of the normal force per displacement of the roller [N/m].
    inertia_torque : ndarray
        Torque that accelerates a free roller, added to that of its bearing [N m].
    skid : ndarray
        Longitudinal creepage where a free roller skids; not a number where it rolls.
    pressure_angle : ndarray
        Angle between the common normal and the path of the roller's centre [rad].
    inertia : ndarray, shape (stations, stations)
        Decrease of the normal forces by the follower's inertia per displacement of the roller at
        each station [N/m]; empty without this feedback.
    places : ndarray of int, shape (all stations,)
        Number of the station that is solved for each station along the angle; equal ones are
        solved once.
    whole : CamStations, optional
        All stations along the angle, where equal ones have been joined.
    panels : Stations, optional
        Panels and number of stations on each.
    skids : ndarray, shape (arcs, 2)
        Ends of the arcs in which a free roller skids [rad].
    relocated : callable, optional
        Returns the stations for changes of the normal force at the stations of the unworn cam,
        shape (all stations,) [N], where wear moves the skids.
    moved_skids : callable, optional
        Returns the `skids` alone for these changes, which takes a tenth of the time.
    recorded : ndarray, shape (stations of the unworn cam, all stations), optional
        Matrix to values at the stations of the unworn cam, where skids have moved.
    """

    angle: FloatArray
    segment: FloatArray
    rolling_speed: FloatArray
    longitudinal_curvature: FloatArray
    surface_curvature: FloatArray
    length: FloatArray
    time_share: FloatArray
    load_factor: FloatArray
    load_rest: FloatArray
    stiffness: FloatArray
    inertia_torque: FloatArray
    skid: FloatArray
    pressure_angle: FloatArray
    inertia: FloatArray
    places: IntArray
    whole: CamStations | None = None
    panels: Stations | None = None
    skids: FloatArray = field(default_factory=lambda: np.zeros((0, 2)))
    relocated: Callable[[FloatArray], CamStations] | None = None
    moved_skids: Callable[[FloatArray], FloatArray] | None = None
    recorded: FloatArray | None = None
    in_pass_loop: ClassVar[bool] = False

    @property
    def axes(self) -> tuple[int, ...]:
        """Leading axes of values of the stations."""
        return len(self.angle), 1

    @property
    def angles(self) -> FloatArray:
        """Angles of the stations [rad], shape (stations,)."""
        return self.angle[:, 0, 0]

    @property
    def track_radius(self) -> FloatArray:
        """Radius of the track whose volume each station represents, (stations, 1, 1) [m].

        The mean over the stations is the volume worn off the cam.
        """
        return len(self.length) * self.length / (2.0 * np.pi)

    @property
    def along(self) -> CamStations:
        """All stations along the angle."""
        return self.whole or self

    def at_unworn(self, values: FloatArray) -> FloatArray:
        """Return values of the stations, first axis, at all stations of the unworn cam."""
        along = values[self.places]
        return along if self.recorded is None else np.tensordot(self.recorded, along, axes=1)

    def greatest(self, values: FloatArray) -> Extreme:
        """Return the greatest value over the angle, of values of the stations, first axis.

        The interpolation between the stations is that of the exported surface of the cam. Without
        panels, at given angles, the greatest of the values is returned.
        """
        if self.panels is not None:
            return greatest(self.panels, values[self.places])
        angle = self.angle.ravel()[values.argmax(axis=0)]
        unknown = np.full(angle.shape, np.nan)
        return Extreme(values.max(axis=0), angle, unknown, unknown)

    def greatest_value(self, values: FloatArray) -> FloatArray:
        """Return the value of `greatest` alone."""
        if self.panels is None:
            return np.asarray(values.max(axis=0))
        return greatest_value(self.panels, values[self.places])

    def station(self, number: int) -> tuple[float, ...]:
        """Return rolling velocity [m/s], part of a turn, and radius of the track [m]."""
        columns = self.rolling_speed, self.time_share, self.length / (2.0 * np.pi)
        return tuple(float(column[number, 0, 0]) for column in columns)

    def at_angle(self, values: FloatArray, angle: float) -> FloatArray:
        """Return values of the stations, first axis, interpolated to an angle [rad]."""
        if self.panels is None:
            return np.asarray(values[np.abs(self.angle.ravel() - angle).argmin()])
        return np.asarray(self.panels.values_at_angles(values[self.places], np.array([angle]))[0])

    def at(self, realisations: IntArray) -> CamStations:
        """Return the stations of some realisations, by number and in that order."""
        drawn: dict[str, Any] = {
            item.name: array[:, :, realisations]
            for item in fields(self)
            if isinstance(array := getattr(self, item.name), np.ndarray) and array.shape[2:] > (1,)
        }
        return replace(self, **drawn)

    def free_rolling(self, inputs: ContactInputs) -> dict[str, FloatArray]:
        """Return torque [N m] and creepage of free rollers; a torque of nan where they skid."""
        skids = np.isfinite(self.skid)
        return {
            "bearing_torque": np.where(skids, np.nan, inputs.bearing_torque + self.inertia_torque),
            "longitudinal": np.where(skids, self.skid, inputs.longitudinal),
        }

    def springs(self, _stiffness: FloatArray) -> FloatArray:
        """Return the loss of load per descent, shape (stations, 1, 1) [N/m]."""
        return self.stiffness

    def with_inertia(self, force: FloatArray, displacement: FloatArray) -> FloatArray:
        """Return the decrease of the loads by springs, and through inertia by displacements [N]."""
        if not self.inertia.size or not np.ndim(displacement):
            return force + 0.0
        return force + np.tensordot(self.inertia, displacement, axes=1)

    def over_radius(self, depth: FloatArray) -> FloatArray:
        """Return depths, shape (stations, ..., strips), over the radius of curvature."""
        return np.asarray(depth * self.surface_curvature[..., None])

    def mean_over_turn(self, values: FloatArray) -> FloatArray:
        """Return the mean weighted by the time at the stations, first axis of length one."""
        share = self.time_share.reshape(-1, *(1,) * (values.ndim - 1))
        return sum_in_order(share * values, axis=0)[None]

    def matches(self, other: Track) -> bool:
        """Return whether tests can be joined: at equal, fixed stations without inertia."""
        return (
            self.relocated is None
            and other.relocated is None
            and self.inertia.size == other.inertia.size == 0
            and all(
                np.array_equal(getattr(first, name), getattr(second, name, ()))
                for first, second in ((self, other), (self.along, other.whole or other))
                for name in ("angle", "segment", "time_share", "length", "places")
            )
        )

    def joined(self, others: Sequence[Track]) -> CamStations:
        """Return the stations of several tests, of which each `matches` these."""
        differing, tests = dict[str, Any](), [self, *others]
        excluded = {"whole", "panels", "relocated", "moved_skids", "recorded"}
        for name in {item.name for item in fields(self)} - excluded:
            values = [getattr(test, name) for test in tests]
            if not all(np.array_equal(v, values[0], equal_nan=True) for v in values[1:]):
                differing[name] = np.concatenate(values, axis=2)
        whole = [test.whole for test in tests if test.whole]
        return replace(self, **differing, whole=whole[0].joined(whole[1:]) if whole else None)


Track: TypeAlias = OneStation | CamStations


@dataclass(frozen=True)
class Kinematics:
    """Radii, speed and number of the rollers on the cylinder, or on a cam.

    Parameters
    ----------
    cylinder_radius, roller_radius : float
        Radii [m]; that of the base circle of a cam.
    rolling_speed : float
        Rolling velocity V [m/s]; on a cam that of the base circle.
    multiplicity : ndarray of int, shape (rollers,)
        Physical rollers represented by each roller of the problem; identical ones are merged.
    track : OneStation or CamStations
        Station of the cylinder, or those of the cam.
    """

    cylinder_radius: float
    roller_radius: float
    rolling_speed: float
    multiplicity: FloatArray
    track: Track

    def at(self, realisations: IntArray) -> Kinematics:
        """Return the kinematics of some realisations, by number and in that order."""
        track = self.track.at(realisations)
        return self if track is self.track else replace(self, track=track)

    @classmethod
    def joined(cls, tests: Sequence[Kinematics]) -> Kinematics:
        """Return the kinematics of several tests with matching tracks."""
        first, *others = (test.track for test in tests)
        return replace(tests[0], track=first.joined(others))

    @cached_property
    def physical_rollers(self) -> float:
        """Number of rollers on the cylinder."""
        return float(self.multiplicity.sum())

    @cached_property
    def pass_rate(self) -> float:
        """Roller passes per second, all rollers together."""
        return self.physical_rollers * (self.rolling_speed / (2.0 * np.pi * self.cylinder_radius))

    @cached_property
    def roller_share(self) -> FloatArray | float:
        """Overrollings of a point of one roller per pass of all rollers.

        The mean over the stations is that of a turn of a cam; shape (stations, 1, 1).
        """
        return self.track.track_radius / self.roller_radius / self.physical_rollers


def worn_volume(worn: FloatArray, spacing: float, radius: FloatArray | float) -> FloatArray:
    """Return the worn volume of a body of revolution, 2 pi R times the worn area [m^3].

    First order in depth over radius: the volume for which Archard's wear law holds exactly.
    """
    return np.asarray(2.0 * np.pi * radius * worn.sum(axis=-1) * spacing)


def oscillation(line_load: FloatArray) -> float:
    """Return the strip-to-strip oscillation of a line load, relative to its peak.

    It is the median over the loaded strips of the size of the second difference: O(dy^2) for a
    smooth contact, of order one for loads that alternate between strips. The median excludes the
    edges of the contact and single kinks of the profile.
    """
    loaded = np.flatnonzero(line_load > 0.0)
    if len(loaded) < 3:
        return 0.0
    second = np.abs(np.diff(line_load[loaded[0] : loaded[-1] + 1], n=2))
    return float(np.median(second) / line_load.max())


def is_every(places: IntArray, count: int) -> bool:
    """Return whether places are those of all `count` realisations in their order."""
    return places.size == count and (count == 1 or bool((places == np.arange(count)).all()))


def values_between(
    values: Sequence[Callable[[float, float], float]], start: FloatArray, stop: FloatArray
) -> FloatArray:
    """Return ``values[v](start[v], stop[v])`` for each realisation v."""
    spans = zip(values, start.tolist(), stop.tolist(), strict=True)
    return np.array([value(first, last) for value, first, last in spans])


def sum_along(values: FloatArray, axis: int) -> FloatArray:
    """Return the sum along an axis, which is kept; a view if the axis has length one."""
    return values if values.shape[axis] == 1 else values.sum(axis=axis, keepdims=True)


def mean_along(values: FloatArray, axis: int) -> FloatArray:
    """Return the mean along an axis, which is kept; a view if the axis has length one.

    As `sum_in_order`, it does not depend on the batch size.
    """
    count = values.shape[axis]
    return values if count == 1 else np.expand_dims(sum_in_order(values, axis) / count, axis)


def sum_in_order(values: FloatArray, axis: int) -> FloatArray:
    """Return a sum with the same round-off for every batch size.

    The order in which numpy sums along an axis depends on the lengths of the other axes.
    """
    if values.shape[axis] == 1:
        return values.squeeze(axis)
    return np.asarray(np.add.accumulate(values, axis=axis).take(-1, axis=axis))

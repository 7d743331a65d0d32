"""Turn of a cam before wear: kinematics, loads and skid of the roller at any angle."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from functools import cached_property, lru_cache

import numpy as np

from wearsim.errors import InfeasibleCamError, Mistake, mistake_in
from wearsim.mechanics.cam import (
    Panel,
    RollerKinematics,
    Rolling,
    SkidArc,
    Stations,
    choose_stations,
    extreme,
    extremes,
    skid_arcs,
    surface_points,
)
from wearsim.models.loads import FollowerLoad
from wearsim.scenario import Scenario
from wearsim.studies.cam.path import path_of
from wearsim.studies.cam.point import Point
from wearsim.types import BoolArray, FloatArray

PART_OF_TOLERANCE = 0.25  # for the stations
LEAST_LOAD = 1e-4  # of the greatest, where the flank of a groove changes
_FINE = 1e-10  # tolerance of integrals over a turn
_SIGNS = np.array([1.0, -1.0])[:, None, None]  # of values whose greatest and least are searched


class CamTurn:
    """A turn of a scenario's cam.

    Parameters
    ----------
    scenario : Scenario
        With a cam; random inputs are at their means, or drawn.

    Raises
    ------
    ScenarioError
        If the cam is undercut, the follower jumps, or the roller cannot roll; only `checked`.
    """

    def __init__(self, scenario: Scenario) -> None:
        if scenario.cam is None:
            what = "is needed for the kinematics of a cam"
            raise mistake_in(scenario.file, what, "none", "a table [cam]", table="cam")
        self.scenario, self.cam = scenario, scenario.cam
        self._path = path_of(self.cam)
        self.speed = scenario.operation.speed
        load = scenario.load.built
        self.load = load if isinstance(load, FollowerLoad) else None
        self._constant = 0.0 if self.load else float(load.force(np.zeros(1))[0])
        self._worn: tuple[Stations, FloatArray] | None = None
        self._inner: dict[Panel, bool] = {}

    def worn(self, change: FloatArray) -> CamTurn:
        """Return the turn with the friction on the roller of a worn cam.

        Parameters
        ----------
        change : ndarray, shape (stations,)
            Change of the normal force by wear at the stations [N].
        """
        turn = CamTurn(self.scenario)
        turn._worn = self.stations, change
        return turn

    @property
    def is_worn(self) -> bool:
        """Whether the friction is that on a worn cam."""
        return self._worn is not None

    def carried(self, point: Point) -> FloatArray:
        """Return the normal force of the worn cam, not negative, at rows of rising angles [N]."""
        force = point.normal_force
        if self._worn is not None:
            stations, change = self._worn
            rows = point.angle.reshape(-1, point.angle.shape[-1])
            moved = [stations.values_at_angles(change, row) for row in rows]
            force = force + np.reshape(moved, force.shape)
        return np.asarray(np.maximum(force, 0.0))

    def effort(self, lift: FloatArray | Sequence[FloatArray], theta: FloatArray) -> FloatArray:
        """Return the force [N] or torque [N m] on the follower, positive on the outer flank."""
        if self.load is None:
            raise ValueError("the load is not that of a follower")
        static = self.load.static(lift[0], theta)
        return np.asarray(static + self.cam.inertia * self.speed**2 * lift[2])

    def point(self, lift: FloatArray, theta: FloatArray, inner: BoolArray | None = None) -> Point:
        """Return the state at lifts, shape (3, points), and angles [rad], shape (points,).

        The flank of a groove is that which the load presses on, unless it is given.
        """
        if inner is None or self.load is None:
            grooved = self.cam.groove and self.load is not None
            inner = self.effort(lift, theta) < 0.0 if grooved else np.zeros(len(theta), dtype=bool)
        return self._loaded(self.cam.follower.kinematics(lift, inner), theta, inner)

    def _loaded(self, kinematics: RollerKinematics, theta: FloatArray, inner: BoolArray) -> Point:
        """Return the state for a motion of the roller on the flanks `inner`."""
        follower = self.cam.follower
        lever = follower.lever * np.cos(kinematics.pressure_angle)
        if self.load is None:
            force = np.full(theta.shape, self._constant)
            effort, spring = force * follower.lever * np.cos(kinematics.pressure_angle), 0.0
        else:
            lift = kinematics.lift, kinematics.lift_per_rad, kinematics.lift_per_rad2
            effort = self.effort(lift, theta)
            force, spring = np.where(inner, -effort, effort) / lever, self.load.spring
            if self.cam.groove:  # it vanishes where the flank changes
                force = np.maximum(force, LEAST_LOAD * self._greatest_effort / follower.lever)
        return Point(
            theta, kinematics, inner, force, effort * kinematics.lift_per_rad, spring / lever**2
        )

    def at(self, panels: Sequence[Panel], theta: FloatArray) -> Point:
        """Return the state at angles within panels, shape (panels, points) [rad]."""
        inner = np.broadcast_to(self.is_inner(panels)[:, None], theta.shape)
        return self._loaded(self.rolling(panels, theta), theta, inner)

    def rolling(self, panels: Sequence[Panel], theta: FloatArray) -> RollerKinematics:
        """Return the motion of the roller at angles within panels, shape (panels, points) [rad]."""
        return self._path.at(panels, theta, self.is_inner(panels)[:, None])

    def is_inner(self, panels: Sequence[Panel]) -> BoolArray:
        """Return in which panels the roller touches the inner flank of a groove."""
        if self.load is None or not self.cam.groove:
            return np.zeros(len(panels), dtype=bool)
        for panel in panels:
            if panel not in self._inner:
                middle = np.array([0.5 * (panel.start + panel.stop)])
                self._inner[panel] = bool(self._effort_in(panel, middle)[0] < 0.0)
        return np.array([self._inner[panel] for panel in panels])

    @cached_property
    def _greatest_effort(self) -> float:
        """Greatest magnitude of the force [N] or torque [N m] on the follower."""
        theta = np.linspace(0.0, math.tau, 1441)
        return float(np.abs(self.effort(self.cam.motion.lift(theta), theta)).max())

    def at_angles(self, theta: FloatArray) -> Point:
        """Return the state at any angles [rad]; between two segments in the following one."""
        theta = np.asarray(theta, dtype=np.float64)
        return self.point(self.cam.motion.lift(theta), theta)

    @cached_property
    def panels(self) -> tuple[Panel, ...]:
        """Smooth parts of the turn, on each of which the roller touches one flank."""
        steady = self.load is None or not self.load.external
        panels = [panel._replace(dwell=panel.dwell and steady) for panel in self.cam.motion.panels]
        return tuple(part for panel in panels for part in self._flanks(panel))

    def _flanks(self, panel: Panel) -> Iterator[Panel]:
        """Yield the parts of a panel between changes of the flank."""
        if self.cam.groove and self.load is not None and not panel.dwell:
            theta = np.linspace(panel.start, panel.stop, 721)
            effort = self._effort_in(panel, theta)
            for place in np.flatnonzero(effort[:-1] * effort[1:] < 0.0):
                low, high = float(theta[place]), float(theta[place + 1])
                for _ in range(60):
                    middle = 0.5 * (low + high)
                    ends = self._effort_in(panel, np.array([low, middle]))
                    low, high = (middle, high) if ends[0] * ends[1] > 0.0 else (low, middle)
                yield panel._replace(stop=low)
                panel = panel._replace(start=low)
        yield panel

    def _effort_in(self, panel: Panel, theta: FloatArray) -> FloatArray:
        return self.effort(self.cam.motion.lift_in(panel.segment, theta), theta)

    @property
    def free(self) -> bool:
        """Whether the roller is driven by the cam alone."""
        return self.scenario.creepage.drive == "free"

    @cached_property
    def arcs(self) -> list[SkidArc]:
        """Arcs in which a free roller skids.

        Raises
        ------
        ScenarioError
            If the roller rolls nowhere.
        """
        inertia = self.scenario.roller.inertia
        if not self.free:
            return []
        if inertia == 0.0:
            ratio, theta = extreme(self.panels, self._demand)
            if ratio > 1.0:
                raise mistake_in(
                    self.scenario.file,
                    "exceeds the torque that friction transmits, and the roller stops at"
                    f" {math.degrees(theta):.4g} deg",
                    None,
                    "a smaller torque",
                    table="creepage",
                    key="bearing_torque",
                )
            return []
        scale = inertia * self.speed**2

        def rolling(panels: Sequence[Panel], theta: FloatArray) -> Rolling:
            point = self.at(panels, theta)
            kinematics, drag = point.kinematics, self.drag(point) / scale
            most = self._greatest_torque(point) / scale
            return Rolling(kinematics.spin, kinematics.spin_per_rad, drag, most)

        try:
            return skid_arcs(self.panels, rolling)
        except ValueError as error:
            remedy = "a smaller inertia, bearing torque or speed, or a greater load"
            place = {"table": "roller", "key": "inertia"}
            raise mistake_in(self.scenario.file, str(error), None, remedy, **place) from error

    def _greatest_torque(self, point: Point) -> FloatArray:
        """Return the greatest torque that friction transmits to the roller [N m]."""
        return np.asarray(
            self.scenario.friction.coefficient * self.carried(point) * self.scenario.roller.radius
        )

    def _demand(self, panels: Sequence[Panel], theta: FloatArray) -> FloatArray:
        """Return the traction of a rolling free roller, over the limit of friction."""
        point = self.at(panels, theta)
        return np.asarray(np.abs(self.torque(point)) / self._greatest_torque(point))

    @cached_property
    def parts(self) -> tuple[Panel, ...]:
        """Panels, split where a skid begins or ends."""
        parts = []
        for number, panel in enumerate(self.panels):
            ends = [
                float(edge)
                for arc in self.arcs
                if arc.panel == number
                for edge in (arc.theta[0], arc.theta[-1])
            ]
            for low, high in itertools.pairwise(sorted({panel.start, panel.stop, *ends})):
                if high - low > 1e-9:
                    rolls = np.isnan(self.slip(np.array([0.5 * (low + high)]))[0])
                    parts.append(
                        panel._replace(start=low, stop=high, dwell=panel.dwell and bool(rolls))
                    )
        return tuple(parts)

    def slip(self, theta: FloatArray, within: FloatArray | None = None) -> FloatArray:
        """Return the slip of the roller, its lack of speed relative to the cam's speed.

        Parameters
        ----------
        theta : ndarray
            Angles [rad].
        within : ndarray, shape of theta, optional
            Angles on the same side of an arc's end, by default `theta`.

        Returns
        -------
        ndarray, shape of theta
            Not a number where the roller rolls.
        """
        slips = np.full(theta.shape, np.nan)
        within = np.mod(theta, math.tau) if within is None else within
        for arc in self.arcs:
            inside = (within >= arc.theta[0]) & (within <= arc.theta[-1])
            slips[inside] = arc.slip_at(np.mod(theta[inside], math.tau))
        return slips

    @cached_property
    def _forces(self) -> list[tuple[float, float]]:
        """Greatest and least normal force [N], the latter negated, each with its angle [rad]."""
        return extremes(self.panels, lambda p, x: _SIGNS * self.at(p, x).normal_force)

    @property
    def normal_range(self) -> tuple[float, float]:
        """Least and greatest normal force of the turn [N]."""
        (greatest, _), (negated, _) = self._forces
        return -negated, greatest

    @property
    def _shape(self) -> list[tuple[float, float]]:
        """Greatest undercut, curvature and negated curvature, each with its angle [rad].

        They follow from the motion alone. The undercut is the curvature of the pitch curve times
        the roller's radius, 1 at a cusp; the others are relative curvatures along rolling [1/m].
        """

        def values(panels: Sequence[Panel], theta: FloatArray) -> FloatArray:
            kinematics = self.rolling(panels, theta)
            side = np.where(self.is_inner(panels)[:, None], -1.0, 1.0)
            undercut = side * kinematics.pitch_curvature * self.scenario.roller.radius
            return np.stack([undercut, *(_SIGNS * kinematics.relative_curvature)])

        return self._path.once(("shape", *self._sides), lambda: extremes(self.panels, values))

    @property
    def _greatest_radius(self) -> tuple[float, float]:
        """Greatest `radius` [m] and its angle [rad]."""
        return self._path.once(("radius", *self._sides), lambda: extreme(self.panels, self.radius))

    @property
    def _sides(self) -> tuple[tuple[Panel, bool], ...]:
        """Panels and whether the roller touches the inner flank, which decide its motion."""
        return tuple(zip(self.panels, self.is_inner(self.panels).tolist(), strict=True))

    @property
    def curvatures(self) -> tuple[float, float]:
        """Least and greatest relative curvature along rolling [1/m]."""
        _, (greatest, _), (negated, _) = self._shape
        return -negated, greatest

    @cached_property
    def greatest_demand(self) -> float:
        """Greatest traction of a rolling free roller, over the limit of friction; at most 1."""
        return min(extreme(self.panels, self._demand)[0], 1.0) if self.free else 0.0

    @cached_property
    def greatest_skid(self) -> float:
        """Greatest creepage of a skid, 0 without any."""
        pairs = ((arc.slip, self.at_angles(arc.theta).kinematics.travel) for arc in self.arcs)
        sizes = [np.abs(slip / travel).max() for slip, travel in pairs]
        return self.scenario.roller.radius * float(max(sizes, default=0.0))

    def drag(self, point: Point) -> FloatArray:
        """Return the torque of the bearing, against the roller's rotation [N m]."""
        creepage = self.scenario.creepage
        arm = 0.5 * creepage.bearing_friction * (creepage.bearing_diameter or 0.0)
        friction = arm * self.carried(point) if arm else np.zeros(point.angle.shape)
        return np.asarray((creepage.bearing_torque or 0.0) + friction)

    def torque(self, point: Point) -> FloatArray:
        """Return the torque that the traction gives the rolling roller [N m]."""
        torque = np.sign(point.kinematics.spin) * self.drag(point)
        rate = self.speed**2 * point.kinematics.spin_per_rad
        return np.asarray(torque + self.scenario.roller.inertia * rate)

    @cached_property
    def stations(self) -> Stations:
        """Stations of a run, by the tolerance of the scenario."""
        tolerance = PART_OF_TOLERANCE * self.scenario.evolution.tolerance
        return choose_stations(self.parts, self._represented, tolerance, self.cam.stations)

    @property
    def varies(self) -> bool:
        """Whether a run has more than one station."""
        return len(self.parts) > 1 or not (self.parts[0].dwell or self.cam.stations == 1)

    def _represented(self, panels: Sequence[Panel], theta: FloatArray) -> FloatArray:
        """Return what the stations must represent: depth in full slip, N ds, traction and slip."""
        point = self.at(panels, theta)
        force, travel = np.maximum(point.normal_force, 0.0), point.kinematics.travel
        # in a groove the load vanishes, where a power is not smooth
        depth = force if self.cam.groove else force ** (2.0 / 3.0)
        rows = [depth, force * travel, travel]
        if self.free:
            most = np.maximum(self._greatest_torque(point), 1e-300)
            middles = [[0.5 * (panel.start + panel.stop)] for panel in panels]
            slip = self.slip(theta, np.broadcast_to(middles, theta.shape))
            demand = np.clip(self.torque(point) / most, -1.0, 1.0)
            rows += [np.where(np.isnan(slip), 1.0 + demand, 1.0), np.nan_to_num(slip)]
        return np.stack(rows)

    def integral(self, quantity: str) -> float:
        """Return the integral of a quantity over the turn: "travel" or "load" (N ds)."""
        if quantity == "load":
            return self._integral(quantity)
        return self._path.once((quantity, *self._sides), lambda: self._integral(quantity))

    def _integral(self, quantity: str) -> float:
        loaded = quantity == "load"

        def values(panels: Sequence[Panel], theta: FloatArray) -> FloatArray:
            travel = self.rolling(panels, theta).travel
            return (self.at(panels, theta).normal_force * travel if loaded else travel)[None]

        fine = choose_stations(self.panels, values, _FINE)
        point = self.at_stations(fine)
        along = point.kinematics.travel * (point.normal_force if loaded else 1.0)
        parts = zip(fine.first, fine.numbers, strict=True)
        return float(sum(fine.weight[i : i + n] @ along[i : i + n] for i, n in parts))

    @property
    def mean_radius(self) -> float:
        """Radius of the cylinder on which a roller would roll as far in a turn [m]."""
        return self.integral("travel") / math.tau

    def loads_and_curvatures(self, load: float) -> list[tuple[float, float]]:
        """Return normal forces [N] and relative curvatures [1/m] at the stations of a run.

        The forces are those of the cam, whatever the load of a roller on a cylinder.
        """
        point = self.at_stations(self.stations)
        curvatures = point.kinematics.relative_curvature.tolist()
        return list(zip(point.normal_force.tolist(), curvatures, strict=True))

    def at_stations(self, stations: Stations) -> Point:
        """Return the state at stations, at both sides of a boundary between segments."""
        segments = np.array([panel.segment for panel in stations.panels])[stations.panel]
        lift = self.cam.motion.lift_in(segments, stations.angle)
        return self.point(lift, stations.angle, self.is_inner(stations.panels)[stations.panel])

    def checked(self) -> CamTurn:
        """Return the turn if the roller can follow it.

        Raises
        ------
        ScenarioError
            If the cam is undercut, the follower jumps or the roller rolls nowhere.
        """
        mistakes, radius = [], self.scenario.roller.radius
        sharpest, theta = self._shape[0]
        if sharpest >= 1.0 - 1e-9:
            flank = "inner flank" if self.at_angles(np.array([theta])).inner[0] else "cam"
            mistake = Mistake(
                "cam",
                "base_radius",
                f"the {flank} is undercut: the pitch curve needs a greater radius than the roller",
                f"{1e3 * radius / sharpest:.4g} mm at {self.place(theta)}",
                f"more than {1e3 * radius:.6g} mm, by a greater base_radius, a smaller roller or a"
                " gentler motion",
            )
            mistakes.append(mistake)
        mistakes += self._reach_mistakes()
        negated, theta = self._forces[1]
        if -negated <= 0.0 and not self.cam.groove:
            mistake = Mistake(
                "load",
                "preload",
                "the follower jumps, since the normal force falls to zero or below",
                f"{-negated:.4g} N at {self.place(theta)}",
                "more than 0 N, by a greater preload or stiffness, or a smaller speed or mass",
            )
            mistakes.append(mistake)
        if mistakes:
            raise InfeasibleCamError(self.scenario.file, mistakes, self.margins)
        self.arcs  # noqa: B018  (raises where the roller rolls nowhere)
        return self

    @cached_property
    def margins(self) -> dict[str, float]:
        """Distances from what a roller cannot follow, in SI; below zero if it cannot.

        ``undercut_margin``: least radius of the pitch curve where it is convex, less that of the
        roller, which is the least radius of the cam [m]; infinite without convex parts.
        ``least_normal_force`` [N], of a cam without a groove. ``pivot_margin``: distance of the
        pivot of an arm from the cam [m].
        """
        radius, margins = self.scenario.roller.radius, {}
        sharpest, _ = self._shape[0]
        margins["undercut_margin"] = radius / sharpest - radius if sharpest > 0.0 else math.inf
        if not self.cam.groove:
            margins["least_normal_force"] = self.normal_range[0]
        if self.cam.follower.swings and not self.cam.groove:
            margins["pivot_margin"] = self.cam.follower.centre_distance - self._greatest_radius[0]
        return margins

    def _reach_mistakes(self) -> list[Mistake]:
        """Return a mistake if the cam of a swinging arm reaches its pivot."""
        follower = self.cam.follower
        if not follower.swings or self.cam.groove:
            return []
        greatest, theta = self._greatest_radius
        if greatest < follower.centre_distance:
            return []
        got = f"{1e3 * greatest:.6g} mm at {self.place(theta)}"
        what = "the cam reaches the pivot of the arm: its greatest radius is"
        expected = f"less than {1e3 * follower.centre_distance:.6g} mm, follower.centre_distance"
        return [Mistake("cam", "base_radius", what, got, expected)]

    def radius(self, panels: Sequence[Panel], theta: FloatArray) -> FloatArray:
        """Return the distance of the cam's surface from its axis at angles within panels [m]."""
        x, y = surface_points(self.cam.follower, self.rolling(panels, theta), theta)[1]
        return np.asarray(np.hypot(x, y))

    def place(self, theta: float) -> str:
        """Return an angle and its segment in words."""
        motion = self.cam.motion
        number = int(motion.segment_at(np.array([theta]))[0])
        return f"{round(math.degrees(theta), 4) % 360.0:.4g} deg, {motion.segment_label(number)}"


@lru_cache(maxsize=16)
def unchecked_turn_of(scenario: Scenario) -> CamTurn:
    """Return the turn of a scenario's cam, which its roller need not be able to follow."""
    return CamTurn(scenario)


@lru_cache(maxsize=16)
def turn_of(scenario: Scenario) -> CamTurn:
    """Return the turn of a scenario's cam; errors as `CamTurn.checked`."""
    return unchecked_turn_of(scenario).checked()

"""Stations of a wear problem along the angle of a cam."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from wearsim.errors import mistake_in
from wearsim.evolution.contacts import GRIP
from wearsim.evolution.quantities import CamStations
from wearsim.mechanics.cam import moved_stations
from wearsim.studies.cam.checks import harmonic_depth, harmonic_limit
from wearsim.studies.cam.point import Point
from wearsim.studies.cam.turn import CamTurn
from wearsim.types import FloatArray

FEWEST_HARMONICS = 3
FOLLOWED = 0.8  # demand of friction on the unworn cam from which skids are followed through a run
_COMPARED = (
    *("rolling_speed", "longitudinal_curvature", "surface_curvature", "load_factor", "load_rest"),
    *("stiffness", "inertia_torque", "skid"),
)


def cam_stations(turn: CamTurn, theta: FloatArray | None = None) -> CamStations:
    """Return the stations of a run, or stations of equal weight at given angles.

    Parameters
    ----------
    turn : CamTurn
    theta : ndarray, shape (stations,), optional
        Angles [rad].
    """
    if theta is not None:
        weight = np.full(len(theta), math.tau / len(theta))
        segments = np.asarray(turn.cam.motion.segment_at(theta), dtype=np.float64)
        return _values(turn, turn.at_angles(theta), weight, segments, None)
    stations = turn.stations
    middles = np.array([0.5 * (panel.start + panel.stop) for panel in stations.panels])
    point = turn.at_stations(stations)
    segments = np.array([float(panel.segment) for panel in stations.panels])[stations.panel]
    stations_of_cam = replace(
        _values(turn, point, stations.weight, segments, middles[stations.panel]),
        panels=stations,
        skids=_skids(turn),
    )
    if turn.is_worn:
        return stations_of_cam
    if moves(turn, stations_of_cam):
        stations_of_cam = _movable(stations_of_cam, turn)
    start = turn.scenario.cylinder.start_surface
    differ = start is not None and start.varies
    return stations_of_cam if stations_of_cam.inertia.size or differ else joined(stations_of_cam)


def moves(turn: CamTurn, stations: CamStations) -> bool:
    """Return whether wear may move skids of the roller, so that they are located again in a run."""
    fed_back = stations.stiffness.any() or stations.inertia.size > 0
    free = turn.free and turn.scenario.roller.inertia > 0.0
    return bool(free and fed_back and (turn.arcs or turn.greatest_demand > FOLLOWED))


def _skids(turn: CamTurn) -> FloatArray:
    """Return the ends of the arcs in which the roller skids, shape (arcs, 2) [rad]."""
    return np.array([(arc.theta[0], arc.theta[-1]) for arc in turn.arcs]).reshape(-1, 2)


def _worn_skids(turn: CamTurn, change: FloatArray) -> FloatArray:
    """Return the skids for changes of the normal force; see `CamStations.moved_skids`."""
    return _skids(turn.worn(change))


def _movable(stations: CamStations, turn: CamTurn) -> CamStations:
    """Return stations that are located again as the unworn turn wears."""
    return replace(
        stations,
        relocated=partial(_relocated, turn),
        moved_skids=partial(_worn_skids, turn),
    )


def _relocated(turn: CamTurn, change: FloatArray) -> CamStations:
    """Return the stations for changes of the normal force; see `CamStations.relocated`."""
    moved = cam_stations(turn.worn(change))
    assert moved.panels is not None
    matrix, _, _ = moved_stations(moved.panels, turn.stations)
    return replace(_movable(moved, turn), recorded=matrix)


def joined(stations: CamStations) -> CamStations:
    """Return the stations, equal ones joined: of a dwell, or of a rise and its return."""
    columns = [
        *(getattr(stations, name).ravel() for name in _COMPARED),
        np.abs(stations.pressure_angle.ravel()),
    ]
    scales = [max(float(np.nanmax(np.abs(column), initial=0.0)), 1e-300) for column in columns]
    keys = np.stack(
        [np.nan_to_num(c / s, nan=9.0).round(10) for c, s in zip(columns, scales, strict=True)]
    )
    _, first, places = np.unique(keys, axis=1, return_index=True, return_inverse=True)
    order = np.argsort(first)  # in the order of the angle
    places, first = np.argsort(order)[places.ravel()], first[order]
    if len(first) == len(places):
        return stations
    names = (*_COMPARED, "angle", "segment", "pressure_angle")
    arrays = {name: getattr(stations, name)[first] for name in names}
    arrays |= {
        name: np.bincount(places, weights=getattr(stations, name).ravel())[:, None, None]
        for name in ("length", "time_share")
    }
    return replace(stations, **arrays, places=places, whole=stations)


def _values(
    turn: CamTurn,
    point: Point,
    weight: FloatArray,
    segments: FloatArray,
    within: FloatArray | None,
) -> CamStations:
    """Return the values at points with weights [rad]; `within` as in `CamTurn.slip`."""
    kinematics, count, roller = point.kinematics, len(point.angle), turn.scenario.roller
    factor, rest = np.ones(count), np.zeros(count)
    if turn.load is not None:
        lever = turn.cam.follower.lever * np.cos(kinematics.pressure_angle)
        factor = np.where(point.inner, -1.0, 1.0) / lever
        rest = point.normal_force - factor * turn.load.preload
    feedback = turn.load is not None and turn.load.feedback != "none"
    side = np.sign(kinematics.spin)
    bearing = turn.scenario.creepage.bearing_torque or 0.0
    most = GRIP * turn.scenario.friction.coefficient * turn.carried(point) * roller.radius
    torque = np.clip(side * turn.torque(point), -most, most) if turn.free else np.zeros(count)
    columns = {
        "angle": point.angle,
        "segment": segments + 1.0,
        "rolling_speed": turn.speed * kinematics.travel,
        "longitudinal_curvature": kinematics.relative_curvature,
        "surface_curvature": np.where(point.inner, -1.0, 1.0) * kinematics.curvature,
        "length": weight * kinematics.travel,
        "time_share": weight / math.tau,
        "load_factor": factor,
        "load_rest": rest,
        "stiffness": point.stiffness if feedback else np.zeros(count),
        "inertia_torque": torque - bearing,
        "pressure_angle": kinematics.pressure_angle,
        "skid": side * roller.radius * turn.slip(point.angle, within) / kinematics.travel,
    }
    arrays: dict[str, Any] = {name: np.array(a)[:, None, None] for name, a in columns.items()}
    inertia = np.zeros((0, 0))
    if turn.load is not None and turn.load.feedback == "inertia":
        inertia = _inertia(turn, point, weight)
    return CamStations(**arrays, inertia=inertia, places=np.arange(count))


def harmonics_of(turn: CamTurn, stations: int) -> int:
    """Return the number of harmonics of the lift error that act through the inertia.

    Raises
    ------
    ScenarioError
        If fewer than three are stable.
    """
    limit = harmonic_limit(turn, harmonic_depth(turn))
    if limit is None or limit >= FEWEST_HARMONICS:
        return math.floor(min(limit or math.inf, stations / 3.0))
    raise mistake_in(
        turn.scenario.file,
        "feedback of wear through the inertia is unstable above harmonic",
        f"{limit:.3g}",
        f'at least {FEWEST_HARMONICS}, or feedback = "static"',
        table="load",
        key="feedback",
    )


def _inertia(turn: CamTurn, point: Point, weight: FloatArray) -> FloatArray:
    """Return the decrease of the normal forces per displacement at each station, (S, S) [N/m].

    The lift error is fitted by its harmonics with the weights of the stations, as its second
    derivative would amplify the others.
    """
    order = np.arange(1, harmonics_of(turn, len(weight)) + 1)
    waves = np.outer(point.angle, order)
    basis = np.hstack([np.ones((len(weight), 1)), np.cos(waves), np.sin(waves)])
    root = np.sqrt(weight)[:, None]
    fit = np.linalg.pinv(root * basis) * root.T
    squares = np.concatenate([[0.0], -(order**2.0), -(order**2.0)])
    lever = turn.cam.follower.lever * np.cos(point.kinematics.pressure_angle)
    side = np.where(point.inner, -1.0, 1.0)
    curvature = (basis * squares) @ fit  # second derivative of the lift by the lift
    return np.asarray(
        turn.cam.inertia * turn.speed**2 * (side / lever)[:, None] * curvature * (side / lever)
    )

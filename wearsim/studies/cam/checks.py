"""Skids of a cam's roller, and warnings of valid but implausible cams."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from wearsim.mechanics.cam import extreme
from wearsim.studies.cam.turn import CamTurn

STEEP = {"translating": math.radians(30.0), "swinging": math.radians(45.0)}
SHARP = 2.0  # radius of the pitch curve over the roller's, below which the contact is warned
FEWEST_SWEEPS = 10.0  # of the contact around the roller in a life, below which it wears unevenly

_NEAR = 2.0  # ratio of the noise of a table to lift_tolerance

HARMONIC_DEPTH = 50e-6  # m, worn depth at which the harmonic limit is given without a depth limit


def harmonic_depth(turn: CamTurn) -> float:
    """Return the worn depth at which the harmonic limit is given: the depth limit, if any [m]."""
    return turn.scenario.limit.depth or HARMONIC_DEPTH


def harmonic_limit(turn: CamTurn, depth: float) -> float | None:
    """Return the harmonic up to which a worn depth is stable; None without inertia.

    A harmonic h of the depth d grows as exp(d (m omega^2 h^2 - k)/N), which is real below
    h* = sqrt((N/d + k)/(m omega^2)), with the least N of the turn.

    Parameters
    ----------
    turn : CamTurn
    depth : float
        Worn depth d [m].
    """
    lever, cam = turn.cam.follower.lever, turn.cam
    inertia = cam.inertia / lever**2 * turn.speed**2
    if inertia == 0.0 or turn.load is None:
        return None
    least = max(turn.normal_range[0], 0.0)
    return math.sqrt((least / depth + turn.load.spring / lever**2) / inertia)


@dataclass(frozen=True)
class Skid:
    """Arc in which a free roller skids: its ends [rad] and dissipated energy per turn [J]."""

    start: float
    stop: float
    energy: float


def skids_of(turn: CamTurn) -> tuple[Skid, ...]:
    """Return the skids with their energies, the sums over the stations of a run."""
    if not turn.arcs:
        return ()
    stations, scenario = turn.stations, turn.scenario
    point = turn.at_stations(stations)
    middles = np.array([0.5 * (panel.start + panel.stop) for panel in stations.panels])
    within = middles[stations.panel]
    slip = np.nan_to_num(np.abs(turn.slip(point.angle, within)))
    power = scenario.friction.coefficient * point.normal_force * scenario.roller.radius * slip
    skids: list[Skid] = []
    for arc in turn.arcs:
        start, stop = float(arc.theta[0]), float(arc.theta[-1])
        energy = float((stations.weight * power)[(within > start) & (within < stop)].sum())
        if skids and abs(skids[-1].stop - start) < 1e-12:
            energy, start = energy + skids[-1].energy, skids.pop().start
        skids.append(Skid(start, stop, energy))
    return tuple(skids)


def cam_warnings(
    turn: CamTurn, skids: tuple[Skid, ...] = (), sweeps: float | None = None
) -> list[str]:
    """Return warnings of a steep pressure angle, a sharp cam, skids and uneven roller wear."""
    follower, panels, warnings = turn.cam.follower, turn.panels, []
    limit = STEEP[follower.kind]
    angle, theta = extreme(panels, lambda p, x: np.abs(turn.at(p, x).kinematics.pressure_angle))
    if angle > limit:
        warnings.append(
            f"cam: the pressure angle reaches {math.degrees(angle):.4g} deg at"
            f" {turn.place(theta)}, more than {math.degrees(limit):g} deg"
        )
    radius = turn.scenario.roller.radius
    sharp, theta = extreme(panels, lambda p, x: turn.at(p, x).kinematics.pitch_curvature)
    if sharp * SHARP * radius > 1.0:
        warnings.append(
            f"cam: the radius of the pitch curve falls to {1e3 / sharp:.4g} mm at"
            f" {turn.place(theta)}, less than twice the roller's {1e3 * radius:.6g} mm"
        )
    warnings += noise_warnings(turn)
    warnings += [
        f"roller: it skids from {math.degrees(skid.start):.4g} to {math.degrees(skid.stop):.4g} deg"
        f" and dissipates {skid.energy:.4g} J per turn"
        for skid in skids
    ]
    if sweeps is not None and sweeps < FEWEST_SWEEPS:
        warnings.append(
            f"roller: the contact moves around it only {sweeps:.3g} times in a life; it may wear"
            " unevenly, while even wear is assumed"
        )
    return warnings


def _two_digits(value: float) -> str:
    return f"{float(f'{value:.2g}'):g}"


def noise_warnings(turn: CamTurn) -> list[str]:
    """Return warnings of the noise of a measured lift or surface, and of what it does to loads."""
    measured, cam = turn.cam.measured, turn.cam
    if measured is None:
        return []
    unit = "mrad" if cam.follower.swings else "mm"
    noise = f"{1e6 * measured.noise:.2g} {'u' + measured.unit}"
    effort = cam.inertia * turn.speed**2 / cam.follower.lever if turn.load else 0.0

    def effect(acceleration: float) -> str:
        force = f" and the force by {_two_digits(effort * acceleration)} N" if effort > 0.0 else ""
        return f"{_two_digits(1e3 * acceleration)} {unit}/rad^2{force}"

    text = (
        f"cam: the points of {measured.file} scatter by {noise} about the smoothing spline; a curve"
        f" through all of them would change the acceleration by {effect(measured.scatter)}, noise"
        f" still changes that of the spline by {effect(measured.error)} (root mean squares; the"
        f" greatest acceleration is {1e3 * measured.peak:.3g} {unit}/rad^2)"
    )
    warnings, stated = [text], measured.tolerance
    if stated is not None and not _NEAR**-1 < measured.noise / stated < _NEAR:
        warnings.append(
            f"cam: lift_tolerance is {1e6 * stated:.2g} u{measured.unit}, and the points of"
            f" {measured.file} scatter by {noise}: is one of them in other units?"
        )
    return warnings

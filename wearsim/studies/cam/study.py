"""Study of a cam before wear: motion, loads and contact along the angle."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

import numpy as np

from wearsim.contact_batch import ContactBatchSolution
from wearsim.evolution.contacts import unworn_contacts
from wearsim.mechanics.cam import Panel, extreme
from wearsim.mechanics.film import minimum_film
from wearsim.results.viewed import Viewed
from wearsim.scenario import Scenario
from wearsim.studies.automatic import with_chosen_model
from wearsim.studies.cam.checks import (
    Skid,
    cam_warnings,
    harmonic_depth,
    harmonic_limit,
    skids_of,
)
from wearsim.studies.cam.point import Point
from wearsim.studies.cam.turn import CamTurn, turn_of
from wearsim.studies.run.assemble import build_problem, prepared_model
from wearsim.studies.run.grid import contact_grid
from wearsim.studies.run.setup import Setup
from wearsim.types import FloatArray

_MOST_TEETH = 12  # greatest denominator of a ratio at which the same points of the roller meet


@dataclass(frozen=True, eq=False)
class CamStudy(Viewed):
    """Motion, loads and fresh contact of a cam.

    Parameters
    ----------
    turn : CamTurn
        The turn, which gives the state at any angle.
    point : Point
        State at the stations, arrays of shape (stations,).
    weight : ndarray, shape (stations,), optional
        Angles that the stations of a run represent [rad]; None for chosen angles.
    contacts : ContactBatchSolution
        Fresh contact at the stations, on the strips of the contact model.
    film : ndarray, shape (stations,), optional
        Least film thickness after Hamrock and Dowson [m]; None without a lubricant.
    peak_pressure, patch_length, patch_width : ndarray, shape (stations,)
        Of the fresh contact after Hertz [Pa], [m].
    perimeter : float
        Length of the cam's surface [m].
    load_integral : float
        Integral of N ds over a turn [N m].
    max_pressure_angle : tuple of float
        Greatest pressure angle, and the angle of the cam there [rad].
    max_radius : tuple of float
        Greatest distance of the cam's surface from its axis [m], and the angle there [rad].
    max_peak_pressure : tuple of float
        Greatest peak pressure of the fresh contact [Pa], and the angle there [rad].
    min_radius_of_curvature : float, optional
        Least radius of the convex parts of the cam [m]; None without any.
    harmonic_limit : float, optional
        Harmonic of the worn depth up to which wear is stable with the inertia of the follower.
    jump_speed : float, optional
        Speed at which the follower jumps [rad/s].
    winding_number : float
        Length of the cam's surface over the roller's circumference.
    winding_ratio : tuple of int
        Nearest ratio of small numbers.
    sweeps : float, optional
        Times that the contact moves around the roller in a life beyond that ratio.
    skids : tuple of Skid
        Arcs in which a free roller skids.
    warnings : tuple of str
    notes : tuple of str
        Notes on the scenario, with the automatic choice of a contact model.

    Examples
    --------
    >>> from wearsim.scenario.examples import shipped_scenario
    >>> study = wearsim.study_cam(shipped_scenario("cam-concentric"))
    >>> print(f"{study.perimeter * 1e3:.3f} mm, {study.winding_number:g}")
    157.080 mm, 1.25
    """

    turn: CamTurn
    point: Point
    weight: FloatArray | None
    contacts: ContactBatchSolution
    film: FloatArray | None
    peak_pressure: FloatArray
    patch_length: FloatArray
    patch_width: FloatArray
    perimeter: float
    load_integral: float
    max_pressure_angle: tuple[float, float]
    max_radius: tuple[float, float]
    max_peak_pressure: tuple[float, float]
    min_radius_of_curvature: float | None
    harmonic_limit: float | None
    jump_speed: float | None
    winding_number: float
    winding_ratio: tuple[int, int]
    sweeps: float | None
    skids: tuple[Skid, ...]
    warnings: tuple[str, ...]
    notes: tuple[str, ...]

    @property
    def title(self) -> str:
        """Title of the scenario."""
        return self.turn.scenario.title

    def __repr__(self) -> str:
        stations = f"{len(self.point.angle)} {'angles' if self.weight is None else 'stations'}"
        peak = float(self.peak_pressure.max()) / 1e6
        return f"<CamStudy '{self.title}': {stations}, up to {peak:.4g} MPa>"


def study_cam(
    scenario: Scenario | str | Path, angles: FloatArray | Sequence[float] | None = None
) -> CamStudy:
    """Return motion, loads and fresh contact of a scenario's cam.

    Parameters
    ----------
    scenario : Scenario or path
        A scenario with a cam, or its file.
    angles : ndarray, shape (points,), optional
        Angles of the cam, instead of the stations of a run [rad].

    Returns
    -------
    CamStudy

    Raises
    ------
    ScenarioError
        If there is no cam, it is undercut, the follower jumps or the roller cannot roll.
    ContactError
        If a contact has no solution.

    Examples
    --------
    >>> from wearsim.scenario.examples import shipped_scenario
    >>> study = wearsim.study_cam(shipped_scenario("cam-eccentric"), [0.0, 3.141592653589793])
    >>> print([f"{force:.6f} N" for force in study.point.normal_force])
    ['319.538258 N', '324.369394 N']
    """
    scenario = with_chosen_model(scenario, test=False)
    turn, chosen, weight = turn_of(scenario), None, None
    if angles is None:
        point, weight = turn.at_stations(turn.stations), turn.stations.weight
    else:
        chosen = np.asarray(angles, dtype=np.float64)
        point = turn.at_angles(chosen)
    setup = Setup(scenario)
    patches = setup.patches_at(point)
    grid = contact_grid(setup, turn.normal_range[1])
    problem = build_problem(setup, prepared_model(scenario, grid), grid, {}, angles=chosen)
    contacts = problem.model.solve(unworn_contacts(problem)).at(problem.kinematics.track.places)
    panels = turn.panels
    steepest = extreme(panels, lambda p, x: np.abs(turn.at(p, x).kinematics.pressure_angle))
    sharpest, _ = extreme(panels, lambda p, x: turn.at(p, x).kinematics.curvature)
    perimeter = turn.integral("travel")
    winding = perimeter / (math.tau * scenario.roller.radius)
    ratio = Fraction(winding).limit_denominator(_MOST_TEETH)
    sweeps = None
    if scenario.has_length:
        creep = np.asarray(contacts.longitudinal_creepage)
        share = np.full(len(creep), 1.0 / len(creep)) if weight is None else weight / math.tau
        drift = abs(winding * (1.0 - float(share @ creep)) - float(ratio))
        sweeps = drift * scenario.total_passes / scenario.operation.rollers
    skids = skids_of(turn)
    return CamStudy(
        turn,
        point,
        weight,
        contacts,
        _film(turn, point),
        np.array([patch.peak_pressure for patch in patches]),
        np.array([2.0 * patch.a for patch in patches]),
        np.array([2.0 * patch.b for patch in patches]),
        perimeter,
        turn.integral("load"),
        steepest,
        extreme(panels, turn.radius),
        extreme(panels, lambda p, x: peak_pressures(setup, turn.at(p, x))),
        1.0 / sharpest if sharpest > 0.0 else None,
        harmonic_limit(turn, harmonic_depth(turn)),
        _jump_speed(turn),
        winding,
        (ratio.numerator, ratio.denominator),
        sweeps,
        skids,
        tuple(cam_warnings(turn, skids, sweeps)),
        scenario.notes,
    )


def peak_pressures(setup: Setup, point: Point) -> FloatArray:
    """Return the peak pressure of the fresh contact after Hertz, shape as the angles [Pa]."""
    pressures = [patch.peak_pressure for patch in setup.patches_at(point)]
    return np.reshape(pressures, point.angle.shape)


def _film(turn: CamTurn, point: Point) -> FloatArray | None:
    """Return the film thickness at points, if there is a lubricant [m]."""
    scenario, lubricant = turn.scenario, turn.scenario.lubricant
    if lubricant is None:
        return None
    return minimum_film(
        turn.speed * point.kinematics.travel,
        point.normal_force,
        point.kinematics.relative_curvature,
        _across(scenario, point),
        scenario.pair.contact_modulus,
        lubricant.viscosity,
        lubricant.pressure_viscosity,
    )


def _across(scenario: Scenario, point: Point) -> float:
    """Return the relative curvature across the track for films, the least of the turn [1/m]."""
    gap = scenario.axial_gap
    if gap.is_crowned:
        return 1.0 / gap.radius_at(0.0)
    return 1.0 / max(gap.radius_at(patch.b) for patch in Setup(scenario).patches_at(point))


def _jump_speed(turn: CamTurn) -> float | None:
    """Return the speed at which the normal force falls to zero, if there is any [rad/s]."""
    load, cam = turn.load, turn.cam
    if load is None or cam.inertia == 0.0 or cam.groove:
        return None

    def ratio(panels: Sequence[Panel], theta: FloatArray) -> FloatArray:
        kinematics = turn.rolling(panels, theta)
        static = load.static(kinematics.lift, theta)
        return np.asarray(-cam.inertia * kinematics.lift_per_rad2 / static)

    greatest, _ = extreme(turn.panels, ratio)
    return 1.0 / math.sqrt(greatest) if greatest > 0.0 else None

"""Observables of a worn cam: extremes over the angle and their angles, curve of lift error."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from wearsim.evolution.observables import (
    extremes,
    lift_errors,
    peak_to_peak,
    volume_error_by_stations,
)
from wearsim.evolution.problem import WearProblem
from wearsim.evolution.state import WearState
from wearsim.mechanics.cam import Stations
from wearsim.types import FloatArray

CURVE_ANGLES = np.linspace(0.0, 2.0 * np.pi, 361)  # rad, of the lift error of an ensemble


def cam_history(problem: WearProblem, state: WearState) -> dict[str, FloatArray]:
    """Return the observables of a cam after a step; none of a cylinder."""
    at_extremes = extremes(problem, state)
    if not at_extremes:
        return {}
    least, greatest = at_extremes["least_wear"], at_extremes["greatest_wear"]
    return {
        "turns": state.passes / problem.kinematics.physical_rollers,
        "station_depth": at_every_station(problem, state.cylinder_depth[:, 0].max(axis=-1)),
        "peak_pressure": at_extremes["peak_pressure"].value,
        "lift_error": least.value + greatest.value,
        **{f"{name}_angle": extreme.angle for name, extreme in at_extremes.items()},
        "depth_error_by_stations": at_extremes["depth"].error,
        "volume_error_by_stations": volume_error_by_stations(problem, state),
        "peak_pressure_error_by_stations": at_extremes["peak_pressure"].error,
        "lift_error_error_by_stations": least.error + greatest.error,
        **{f"{n}_angle_error_by_stations": item.angle_error for n, item in at_extremes.items()},
    }


def cam_observables(
    problem: WearProblem, state: WearState, row: Mapping[str, FloatArray]
) -> dict[str, FloatArray]:
    """Return the observables of cams of an ensemble, shape (realisations,).

    Parameters
    ----------
    problem : WearProblem
    state : WearState
    row : mapping of str to ndarray
        Observables of the run, `cam_history` among them.
    """
    if "lift_error" not in row:
        return {}
    errors, first = lift_errors(problem, state), row["peak_pressure"].argmax(axis=0)[None]
    return {
        "lift_error": row["lift_error"].max(axis=0),
        "lift_error_angle": problem.kinematics.track.greatest(np.abs(errors).max(axis=1)).angle,
        "depth_angle": row["depth_angle"],
        "peak_pressure_angle": np.take_along_axis(row["peak_pressure_angle"], first, axis=0)[0],
    }


def lift_curves(
    problem: WearProblem, state: WearState, stations: Sequence[Stations]
) -> list[FloatArray]:
    """Return the lift error of each realisation at `CURVE_ANGLES` [m].

    Of several rollers it is the curve of the roller whose lift error varies most.

    Parameters
    ----------
    problem : WearProblem
    state : WearState
    stations : sequence of Stations
        Stations of each realisation.
    """
    track, errors = problem.kinematics.track, lift_errors(problem, state)
    roller = peak_to_peak(track, errors).argmax(axis=0)
    curves = track.at_unworn(errors)
    return [
        stations_of_test.values_at_angles(curves[:, roller[place], place], CURVE_ANGLES)
        for place, stations_of_test in enumerate(stations)
    ]


def cam_record(problem: WearProblem, state: WearState) -> dict[str, FloatArray]:
    """Return the curve of the lift error; nothing of a cylinder."""
    cam = problem.kinematics.cam
    return {} if cam is None else {"lift_error_curve": cam.at_unworn(lift_errors(problem, state))}


def at_every_station(problem: WearProblem, values: FloatArray) -> FloatArray:
    """Return values of the stations, first axis, along the angle of the unworn cam.

    They are not negative where they have been interpolated to its stations.
    """
    track = problem.kinematics.track
    at_stations = track.at_unworn(values)
    return at_stations if track.recorded is None else np.maximum(at_stations, 0.0)


def station_columns(problem: WearProblem) -> dict[str, FloatArray]:
    """Return the columns of the stations in the results file of a cam; none of a cylinder."""
    if problem.kinematics.cam is None:
        return {}
    cam = problem.kinematics.cam.along
    return {
        "station_angle": cam.angle.ravel(),
        "station_weight": 2.0 * np.pi * cam.time_share.ravel(),
        "station_length": cam.length.ravel(),
        "station_segment": cam.segment.ravel(),
        "pressure_angle": cam.pressure_angle.ravel(),
    }

"""Observables of a worn cam: depth and its angle, lift error, angle of the peak pressure."""

from __future__ import annotations

import numpy as np

from wearsim.evolution.observables import lift_errors, peak_to_peak
from wearsim.evolution.problem import WearProblem
from wearsim.evolution.state import WearState
from wearsim.types import FloatArray


def cam_history(problem: WearProblem, state: WearState) -> dict[str, FloatArray]:
    """Return the observables of a cam after a step; none of a cylinder."""
    cam = problem.kinematics.cam
    if cam is None:
        return {}
    angle = cam.angle.ravel()
    depth = state.cylinder_depth[:, 0].max(axis=-1)
    pressure = problem.per_roller(problem.values_of(state.contacts, "peak_pressure"))
    return {
        "turns": state.passes / problem.kinematics.physical_rollers,
        "station_depth": depth[cam.places],
        "depth_angle": angle[depth.argmax(axis=0)],
        "peak_pressure_angle": angle[pressure.argmax(axis=0)],
        "lift_error": peak_to_peak(cam, lift_errors(problem, state)),
    }


def cam_record(problem: WearProblem, state: WearState) -> dict[str, FloatArray]:
    """Return the curve of the lift error; nothing of a cylinder."""
    cam = problem.kinematics.cam
    return {} if cam is None else {"lift_error_curve": lift_errors(problem, state)[cam.places]}


def at_every_station(problem: WearProblem, values: FloatArray) -> FloatArray:
    """Return values of the stations, first axis, along the angle of a cam."""
    cam = problem.kinematics.cam
    return values if cam is None else values[cam.places]


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

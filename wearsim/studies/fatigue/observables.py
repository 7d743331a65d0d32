"""Observables of the damage by fatigue in a run: after each step, and at records."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from wearsim.evolution.fatigue import effective_damage, fatigue_of, greatest_damages
from wearsim.evolution.problem import WearProblem
from wearsim.evolution.state import WearState
from wearsim.mechanics.cam.stations import Stations
from wearsim.studies.cam.observables import CURVE_ANGLES, at_every_station
from wearsim.types import FloatArray


def fatigue_history(problem: WearProblem, state: WearState) -> dict[str, FloatArray]:
    """Return the observables of fatigue after a step; none of a test without it."""
    if state.damage is None:
        return {}
    damage, error = state.damage[:2]
    effective = effective_damage(problem, damage)
    cylinder, rollers = greatest_damages(problem, damage)
    history = {
        "damage": effective,
        "pitting": fatigue_of(problem).pitting(effective),
        "cylinder_damage": cylinder,
        "roller_damage": rollers,
        "damage_error_by_steps": effective_damage(problem, damage + error) - effective,
    }
    cam = problem.kinematics.cam
    if cam is not None:
        rows = damage[: problem.shape[0]].max(axis=-1)
        history["station_damage"] = at_every_station(problem, rows)
        history["damage_angle"] = cam.greatest(rows).angle
    return history


def fatigue_record(problem: WearProblem, state: WearState) -> dict[str, FloatArray]:
    """Return the damage of the bodies at a record; nothing of a test without fatigue."""
    if state.damage is None:
        return {}
    stations, damage = problem.shape[0], state.damage[0]
    return {
        "cylinder_damage_profile": at_every_station(problem, damage[:stations]),
        "roller_damage_profile": damage[stations:],
    }


def fatigue_curves(
    problem: WearProblem, state: WearState, stations: Sequence[Stations]
) -> list[dict[str, FloatArray]]:
    """Return the damage of each realisation across the track and, of a cam, along its angle.

    Parameters
    ----------
    problem : WearProblem
    state : WearState
    stations : sequence of Stations
        Stations of the unworn cam of each realisation; none of a cylinder.

    Returns
    -------
    list of dict
        "cylinder_damage_profile", of a cam where it is greatest, and "roller_damage_profile" of the
        most damaged roller, shape (strips,); "damage_curve" of a cam, shape (angles,). Without
        fatigue they are empty.
    """
    if state.damage is None:
        return [{} for _ in range(problem.shape[2])]
    damage, cam = state.damage[0], problem.kinematics.cam
    cylinder, rollers = damage[: problem.shape[0]], damage[problem.shape[0] :]
    worst = rollers.max(axis=-1).argmax(axis=0)
    curves = [
        {"cylinder_damage_profile": cylinder[0, v], "roller_damage_profile": rollers[worst[v], v]}
        for v in range(problem.shape[2])
    ]
    if cam is None:
        return curves
    rows = cylinder.max(axis=-1)
    along = at_every_station(problem, rows)
    for v, angle in enumerate(cam.greatest(rows).angle.tolist()):
        across = np.maximum(cam.at_angle(cylinder[:, v], angle), 0.0)
        at_angles = stations[v].values_at_angles(along[:, v], CURVE_ANGLES)
        curves[v] |= {"cylinder_damage_profile": across, "damage_curve": np.maximum(at_angles, 0.0)}
    return curves


def final_fatigue(last: Mapping[str, Any]) -> dict[str, FloatArray]:
    """Return the observables of fatigue at the end of a run by their keys in JSON.

    Parameters
    ----------
    last : mapping of str to ndarray
        Last row of the history, by variable.
    """
    if "damage" not in last:
        return {}
    names = "damage", "damage_error", "pitting", "cylinder_damage", "roller_damage"
    final = {name: np.asarray(last[name]) for name in names}
    final["roller_damage"] = final["roller_damage"].max(axis=0)
    if "damage_angle" in last:
        final["damage_angle_rad"] = np.asarray(last["damage_angle"])
    return final

"""Observables of the damage by fatigue in a run: after each step, and at records."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from wearsim.errors import WearsimError
from wearsim.evolution.fatigue import effective_damage, fatigue_of, greatest_damages
from wearsim.evolution.problem import WearProblem
from wearsim.evolution.state import WearState
from wearsim.studies.cam.observables import at_every_station
from wearsim.types import FloatArray

if TYPE_CHECKING:
    from wearsim.results.content import StudyResult
    from wearsim.scenario import Scenario


def fatigue_history(problem: WearProblem, state: WearState) -> dict[str, FloatArray]:
    """Return the observables of fatigue after a step; none of a test without it."""
    if state.damage is None:
        return {}
    damage, error = state.damage[:2]
    effective = effective_damage(problem, damage)
    cylinder, rollers = greatest_damages(problem, damage)
    return {
        "damage": effective,
        "pitting": fatigue_of(problem).pitting(effective),
        "cylinder_damage": cylinder,
        "roller_damage": rollers,
        "damage_error_by_steps": effective_damage(problem, damage + error) - effective,
    }


def fatigue_record(problem: WearProblem, state: WearState) -> dict[str, FloatArray]:
    """Return the damage of the bodies at a record; nothing of a test without fatigue."""
    if state.damage is None:
        return {}
    stations, damage = problem.shape[0], state.damage[0]
    return {
        "cylinder_damage_profile": at_every_station(problem, damage[:stations]),
        "roller_damage_profile": damage[stations:],
    }


def fatigue_curves(problem: WearProblem, state: WearState) -> list[dict[str, FloatArray]]:
    """Return the damage of each realisation across the track.

    Parameters
    ----------
    problem : WearProblem
    state : WearState

    Returns
    -------
    list of dict
        "cylinder_damage_profile", at the first station, and "roller_damage_profile" of the most
        damaged roller, shape (strips,). Without fatigue they are empty.
    """
    if state.damage is None:
        return [{} for _ in range(problem.shape[2])]
    damage = state.damage[0]
    cylinder, rollers = damage[: problem.shape[0]], damage[problem.shape[0] :]
    worst = rollers.max(axis=-1).argmax(axis=0)
    return [
        {"cylinder_damage_profile": cylinder[0, v], "roller_damage_profile": rollers[worst[v], v]}
        for v in range(problem.shape[2])
    ]


def fatigue_scenario(result: StudyResult[Any]) -> Scenario | None:
    """Return the scenario of a result; None without fatigue, or a plugin that is not installed."""
    try:
        return result.scenario if result.raw.fatigue else None
    except WearsimError:
        return None


def final_fatigue(result: StudyResult[Any], last: Mapping[str, Any]) -> dict[str, FloatArray]:
    """Return the observables of fatigue at the end of a run by their keys in JSON.

    The error of the probability of pitting is nan where the scenario cannot be read.

    Parameters
    ----------
    result : StudyResult
    last : mapping of str to ndarray
        Last row of the history, by variable.
    """
    if "damage" not in last:
        return {}
    damage, error, pitting = (
        np.asarray(last[name]) for name in ("damage", "damage_error", "pitting")
    )
    scenario = fatigue_scenario(result)
    slope = scenario.fatigue.slope if scenario is not None and scenario.fatigue else np.nan
    # P = 1 - (1 - P_ref)^(D^e) is differentiated by D; P may be one to round-off
    survival = np.maximum(1.0 - pitting, np.finfo(float).tiny)
    relative = np.divide(error, damage, out=np.zeros_like(error), where=damage > 0.0)
    names = "damage", "damage_error", "pitting", "cylinder_damage", "roller_damage"
    angle = {"damage_angle_rad": np.asarray(last.get("damage_angle"))}
    return {
        **{name: np.asarray(last[name]) for name in names},
        "pitting_error": -survival * np.log(survival) * slope * relative,
        "roller_damage": np.asarray(last["roller_damage"]).max(axis=0),
        **(angle if "damage_angle" in last else {}),
    }

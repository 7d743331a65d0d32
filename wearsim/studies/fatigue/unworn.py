"""Pitting without wear: lives by the pressures of the fresh contact, and stresses below it."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from wearsim.evolution.contacts import fresh_state
from wearsim.evolution.fatigue import effective_damage, greatest_damages
from wearsim.evolution.problem import WearProblem
from wearsim.mechanics.fatigue import ORTHOGONAL, greatest_von_mises
from wearsim.report.text import count, shown
from wearsim.scenario import Scenario
from wearsim.types import FloatArray


def lives_at(scenario: Scenario, pressure: FloatArray) -> FloatArray | None:
    """Return the life of points of the cylinder or the cam at constant pressures [passes].

    Parameters
    ----------
    scenario : Scenario
    pressure : ndarray
        Greatest pressures [Pa].

    Returns
    -------
    ndarray or None
        Same shape, infinite below an endurance pressure; None if this body does not pit.
    """
    choice = scenario.fatigue
    if choice is None or "cylinder" not in choice.laws:
        return None
    modulus = scenario.pair.contact_modulus
    damage = choice.laws["cylinder"].build(modulus).damage_per_pass(np.asarray(pressure))
    return np.where(damage > 0.0, 1.0 / np.where(damage > 0.0, damage, 1.0), np.inf)


def stresses_below(
    scenario: Scenario, pressure: FloatArray, half_length: FloatArray
) -> dict[str, tuple[str, FloatArray]]:
    """Return stresses below line contacts on the cylinder or the cam, without traction.

    Parameters
    ----------
    scenario : Scenario
    pressure, half_length : ndarray
        Greatest pressures [Pa] and half-lengths [m].

    Returns
    -------
    dict of str to tuple
        Unit and values of the greatest orthogonal shear stress and stress of von Mises, and their
        depths, by key.
    """
    stress, depth = greatest_von_mises(scenario.cylinder.material.poisson_ratio)
    return {
        "orthogonal_shear_Pa": ("Pa", ORTHOGONAL[0] * pressure),
        "orthogonal_shear_depth_m": ("m", ORTHOGONAL[1] * half_length),
        "von_mises_Pa": ("Pa", stress * pressure),
        "von_mises_depth_m": ("m", depth * half_length),
    }


def unworn_data(scenario: Scenario, problem: WearProblem) -> dict[str, Any] | None:
    """Return the lives of a test by pitting without wear, in roller passes; None without fatigue.

    Parameters
    ----------
    scenario : Scenario
    problem : WearProblem
        Of the test.
    """
    choice, state = scenario.fatigue, fresh_state(problem)
    if choice is None or state.damage is None:
        return None
    rate = state.damage[2]
    cylinder, rollers = greatest_damages(problem, rate)
    damages = {
        "passes": effective_damage(problem, rate),
        "cylinder_passes": cylinder,
        "roller_passes": rollers.max(axis=0),
    }
    of_cam = rate[: problem.shape[0]].max(axis=-1)
    angle = float(problem.kinematics.track.greatest(of_cam).angle[0])
    return {
        **{name: float(1.0 / n[0]) if n[0] > 0.0 else None for name, n in damages.items()},
        "probability": choice.probability,
        "sources": {body: law.source for body, law in choice.laws.items()},
        **({"angle_rad": angle} if math.isfinite(angle) else {}),  # not of a cylinder
    }


def unworn_text(data: dict[str, Any], body: str, unit: str, size: float) -> str:
    """Return the life of a test by pitting without wear in words.

    Parameters
    ----------
    data : dict
        From `unworn_data`.
    body, unit : str
        "cylinder" or "cam", and the unit of its life.
    size : float
        Roller passes in the unit.
    """

    def life(name: str) -> str:
        passes = data[name]
        return "infinite" if passes is None else f"{count(float(f'{passes / size:.3g}'))} {unit}"

    text = f"{life('passes')} to a probability of {100.0 * data['probability']:g} %"
    place = f" at {shown(data['angle_rad'], 'deg')}" if "angle_rad" in data else ""
    parts = [
        f"{name} {life(key)}{where}"
        for name, key, where in ((body, "cylinder_passes", place), ("roller", "roller_passes", ""))
        if data[key] is not None
    ]
    return (
        f"{text} ({', '.join(parts)})"
        if parts
        else "does not occur: no pressure is above endurance"
    )

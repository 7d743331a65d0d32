"""Damage by fatigue in a forecast: from the pressures on its grooves, and the passes to them.

A place that is worn has the pressure of its strip on the groove, at most the median of the strips,
since the ends of a groove of the forecast fit the roller too closely. Loads have their mean.
"""

from __future__ import annotations

import math

import numpy as np

from wearsim.contact_batch import ContactBatchSolution
from wearsim.evolution.fatigue import effective_damage, fatigue_of
from wearsim.evolution.problem import WearProblem
from wearsim.mechanics.fatigue import SHEAR_DEPTH
from wearsim.types import FloatArray

PLACES = 301  # across the track, at most
_TINY = 1e-300


def places_across(problem: WearProblem) -> FloatArray:
    """Return the axial positions at which damage is forecast, shape (places,) [m]."""
    y = problem.grid.y
    return y if len(y) <= PLACES else np.linspace(y[0], y[-1], PLACES)


def rates_across(
    problem: WearProblem, contacts: ContactBatchSolution, y: FloatArray, *, is_groove: bool
) -> FloatArray:
    """Return damage per roller pass of the cylinder and of each roller.

    Parameters
    ----------
    problem : WearProblem
        With fatigue, of one realisation.
    contacts : ContactBatchSolution
        In the problem's order.
    y : ndarray, shape (places,)
    is_groove : bool
        Whether the pressure of a strip is at most the median of its contact.

    Returns
    -------
    ndarray, shape (stations, 1 + rollers, places)
        That which the contacts at a station add, to the cylinder at this station.
    """
    load, length = (problem.values_of(contacts, name) for name in ("line_load", "half_length"))
    pressure = 2.0 / math.pi * load / np.maximum(length, _TINY)
    if is_groove:
        touching = np.where(pressure > 0.0, pressure, np.nan)
        pressure = np.minimum(pressure, np.nanmedian(touching, axis=-1, keepdims=True))
    rates = np.zeros((load.shape[0], 1 + problem.rollers, load.shape[-1]))
    for body, law in fatigue_of(problem).laws.items():
        part = (problem.wear_shares[body] * law.damage_per_pass(pressure))[:, :, 0]
        if body == "cylinder":
            rates[:, 0] = part.sum(axis=1)
            continue
        for number in range(problem.rollers):
            rates[:, 1 + number] = part[:, problem.roller == number].sum(axis=1)
    rows = rates.reshape(-1, rates.shape[-1])
    across = [np.interp(y, problem.grid.y, row, left=0.0, right=0.0) for row in rows]
    return np.reshape(across, (*rates.shape[:-1], len(y)))


def damage_after(
    problem: WearProblem, y: FloatArray, course: dict[str, FloatArray], end: float
) -> dict[str, float]:
    """Return effective "damage" and probability of "pitting" after some passes.

    Parameters
    ----------
    problem : WearProblem
        Of the run.
    y : ndarray, shape (places,)
    course : dict of str to ndarray
        "passes", worn depths "cylinder" and "roller" and half-lengths "length", shape (points,
        stations), and the rates "damage" from `rates_across` at these points.
    end : float
        Roller passes.
    """
    fatigue, rates, passes = fatigue_of(problem), course["damage"], course["passes"]
    steps = np.diff(passes, axis=0)
    lengths = np.diff(np.minimum(passes, end), axis=0)
    parts = np.where(steps > 0.0, lengths / np.where(steps > 0.0, steps, 1.0), 0.0)
    layer = SHEAR_DEPTH * np.maximum(course["length"][1:], _TINY)
    worn = np.stack([np.diff(course[body], axis=0) for body in ("cylinder", "roller")], axis=-1)
    removed = worn * (parts / layer)[..., None] if fatigue.remove else np.zeros_like(worn)
    removed = np.concatenate([removed, *[removed[..., 1:]] * (problem.rollers - 1)], axis=-1)
    damage = np.zeros_like(rates[0])
    for number in np.flatnonzero(lengths.any(axis=1)):
        first, last = rates[number], rates[number + 1]
        part, gone = parts[number][:, None, None], removed[number][..., None]
        added = lengths[number][:, None, None] * (first + 0.5 * part * (last - first))
        damage = damage * np.exp(-gone) + added * np.exp(-0.5 * gone)
    bodies = np.concatenate([damage[:, 0], damage[:, 1:].sum(axis=0)])
    strips = np.array([np.interp(problem.grid.y, y, row) for row in bodies])
    effective = effective_damage(problem, strips[:, None])
    return {"damage": float(effective[0]), "pitting": float(fatigue.pitting(effective)[0])}

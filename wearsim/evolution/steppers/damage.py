"""Damage by fatigue that a step adds, and the error of its integral over the passes.

Where the load varies within a step, damage per pass is not that at the mean load: the contacts are
solved under three loads with the mean and the variance of the load, on the profiles at the start
and at the end of the step.
"""

from __future__ import annotations

import numpy as np

from wearsim.evolution.contacts import contact_batch
from wearsim.evolution.fatigue import (
    damage_per_pass,
    effective_of_rows,
    fatigue_of,
    layer_thickness,
)
from wearsim.evolution.pauses import at_rest
from wearsim.evolution.problem import WearProblem
from wearsim.evolution.state import WearState
from wearsim.evolution.steppers.loads import displacement_at, mean_force, with_feedback
from wearsim.mechanics.fatigue import damage_of_step
from wearsim.mechanics.numerics.jit import kernel_input
from wearsim.types import FloatArray

_NORMAL = 3.0**0.5  # distance of the outer nodes from the mean, over the standard deviation
_LEAST = 1e-3  # load over its mean, at least: a contact without load has no solution
_ROUND_OFF = 1e-9
# error that a step may add, over the tolerance: a part of the damage that it adds, and of all
OF_STEP, OF_ALL = 1.0, 0.02


def with_damage(
    problem: WearProblem, start: WearState, end: WearState
) -> tuple[WearState, FloatArray]:
    """Return the state at the end of a step with the damage that the step adds.

    Parameters
    ----------
    problem : WearProblem
        With fatigue.
    start, end : WearState
        The states before and after the step.

    Returns
    -------
    end : WearState
    effective : ndarray, shape (3, realisations)
        Effective damage before and after the step, and the latter with the error of the step. On a
        cam it is that of the stations.
    """
    fatigue, passes = fatigue_of(problem), end.passes - start.passes
    damage, points = np.asarray(start.damage), np.asarray(start.damage_points)
    if problem.varies:
        first, last = (_of_varying_load(problem, start, state, passes) for state in (start, end))
    else:
        first, last = damage[2], damage_per_pass(problem, end.contacts)
    if problem.varies or problem.pauses:
        points = np.stack([np.full_like(points[0], np.nan), points[1]])
    if problem.pauses:
        passes = np.where(at_rest(problem, start.passes), 0.0, passes)
    strips = damage.shape[-1]
    removed = np.empty((0, strips))
    if fatigue.remove:
        removed = (end.stacked - start.stacked) / layer_thickness(problem, end.contacts)
    added, sums = damage_of_step(
        kernel_input(damage).reshape(4, -1, strips),
        kernel_input(first).reshape(-1, strips),
        kernel_input(last).reshape(-1, strips),
        removed.reshape(-1, strips),
        kernel_input(start.passes),
        kernel_input(passes),
        points,
        0.0 if fatigue.reference_area is None else fatigue.slope,
    )
    points = np.stack([start.passes, points[1]])
    end = end.replaced(damage=added.reshape(damage.shape), damage_points=points)
    return end, effective_of_rows(problem, sums.reshape(3, -1, len(passes)))


def damage_excess(effective: FloatArray, tolerance: float) -> FloatArray:
    """Return the error of the effective damage that a step adds, over its allowance, (N,).

    Parameters
    ----------
    effective : ndarray, shape (3, realisations)
        See `with_damage`.
    tolerance : float
        Required relative error of a test.
    """
    old, new, beyond = effective
    allowed = tolerance * (OF_STEP * np.maximum(new - old, 0.0) + OF_ALL * new)
    return np.asarray((beyond - new) / np.where(allowed > 0.0, allowed, np.inf))


def _of_varying_load(
    problem: WearProblem, start: WearState, state: WearState, passes: FloatArray
) -> FloatArray:
    """Return the mean damage per pass over a step under a varying load, on a state's profiles.

    Parameters
    ----------
    problem : WearProblem
    start : WearState
        State at the start of the step.
    state : WearState
        With profiles and contacts.
    passes : ndarray, shape (realisations,)
        Length of the step.
    """
    times = problem.time(start.passes), problem.time(start.passes + passes)
    here = problem.at_time(*times)
    displacement = displacement_at(here, [state.depths], np.zeros(()))
    mean = with_feedback(here, mean_force(here, start, passes), displacement, state.terms)
    damage = np.zeros(np.shape(start.stacked))
    for offset, weight in _load_nodes(problem, *times):
        if not weight.any():
            continue
        loads = mean + problem.kinematics.track.load_factor * offset
        loads = np.maximum(loads, _LEAST * np.abs(mean))
        contacts = here.model.solve(
            contact_batch(here, here.gap(*state.depths), loads, *state.depths), warm=state.contacts
        )
        damage += weight[:, None] * damage_per_pass(here, contacts)
    return damage


def _load_nodes(
    problem: WearProblem, start: FloatArray, stop: FloatArray
) -> list[tuple[FloatArray, FloatArray]]:
    """Return three loads with the mean and the variance of the load between two times.

    Parameters
    ----------
    problem : WearProblem
    start, stop : ndarray, shape (realisations,)
        Times [s].

    Returns
    -------
    list of tuple
        Load less the mean [N], and its weight, shape (realisations,) both. The outer loads are root
        three times the standard deviation away, as in Gauss's quadrature of a normal distribution,
        but within the extremes; a load of two levels has these two.
    """
    steps = zip(problem.loads, start.tolist(), stop.tolist(), strict=True)
    mean, deviation, low, high = np.array(
        [(load.mean(*t), load.deviation(*t), *load.extremes(*t)) for load, *t in steps]
    ).T
    variance, below, above = np.square(deviation), mean - low, high - mean
    for item in problem.varying:
        if item.name == "normal_force_offset":
            own = item.paths.deviation(start, stop)
            variance, reach = variance + np.square(own), _NORMAL * own
            below, above = below + reach, above + reach
    varies = (variance > 0.0) & (below > 0.0) & (above > 0.0)
    variance = np.where(varies, variance, 0.0)
    below, above = (np.where(varies, side, 1.0) for side in (below, above))
    normal = _NORMAL * np.sqrt(np.where(varies, variance, 1.0))
    left = np.minimum(below, normal)
    right = np.minimum(above, np.maximum(normal, variance / left))
    left = np.minimum(below, np.maximum(left, variance / right))
    weights = [variance / (side * (left + right)) for side in (left, right)]
    middle = np.maximum(1.0 - variance / (left * right), 0.0)
    # round-off of two levels leaves no third one
    middle = np.where(middle < _ROUND_OFF, 0.0, middle)
    total = weights[0] + weights[1] + middle
    nodes = [(-left, weights[0]), (np.zeros_like(left), middle), (right, weights[1])]
    return [(offset, weight / total) for offset, weight in nodes]

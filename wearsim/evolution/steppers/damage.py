"""Damage by fatigue that a step adds, and the error of its integral over the passes.

Where the load varies, both contacts have their pressures at the mean load of the step, in
proportion to the root of the load, which is exact on a worn profile, where the width of the contact
stays. The scatter of the load within the step counts by two loads of the same mean and standard
deviation.
"""

from __future__ import annotations

import numpy as np

from wearsim.evolution.fatigue import (
    damage_per_pass,
    effective_of_rows,
    fatigue_of,
    layer_thickness,
)
from wearsim.evolution.pauses import at_rest
from wearsim.evolution.problem import WearProblem
from wearsim.evolution.quantities import values_between
from wearsim.evolution.state import WearState
from wearsim.evolution.steppers.loads import displacement_at, mean_force, with_feedback
from wearsim.evolution.steppers.single_step import carried_loads
from wearsim.mechanics.fatigue import damage_of_step
from wearsim.types import FloatArray

_FARTHEST = 0.9  # greatest deviation of a load, over its mean
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
    fatigue, damage, points = fatigue_of(problem), start.damage, start.damage_points
    assert damage is not None
    assert points is not None
    passes = end.passes - start.passes
    before, scale = points
    varies = problem.constant_load is None or len(problem.varying) > 0
    if varies:
        first, last = (_of_varying_load(problem, start, one, passes) for one in (start, end))
    else:
        first, last = damage[2], damage_per_pass(problem, end.contacts)
    if varies or problem.pauses:
        before = np.full_like(before, np.nan)
    if problem.pauses:
        passes = np.where(at_rest(problem, start.passes), 0.0, passes)
    strips = damage.shape[-1]
    removed = np.empty((0, strips))
    if fatigue.remove:
        removed = (end.stacked - start.stacked) / layer_thickness(problem, end.contacts)
    added, sums = damage_of_step(
        np.stack([damage[0], damage[1], damage[3]]).reshape(3, -1, strips),
        np.stack([first, last]).reshape(2, -1, strips),
        removed.reshape(-1, strips),
        np.stack([start.passes, passes, before, scale]),
        0.0 if fatigue.reference_area is None else fatigue.slope,
    )
    end = end.replaced(
        damage=added.reshape(damage.shape), damage_points=np.stack([start.passes, scale])
    )
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
    force = mean_force(here, start, passes)
    mean = np.maximum(with_feedback(here, force, displacement, state.terms), 0.0)
    carried = carried_loads(problem, state.contacts)
    ratio = np.where(carried > 0.0, mean / np.where(carried > 0.0, carried, 1.0), 0.0)
    variance = np.square(values_between([load.deviation for load in problem.loads], *times))
    for item in problem.varying:
        if item.name == "normal_force_offset":
            own = values_between([path.deviation for path in item.paths], *times)
            acts = np.isin(problem.roller, item.rollers)[:, None]
            variance = variance + np.where(acts, np.square(own), 0.0)
    relative = np.sqrt(variance) / np.where(mean > 0.0, mean, np.inf)
    relative = np.minimum(relative, _FARTHEST)
    low, high = (
        damage_per_pass(problem, state.contacts, np.sqrt(ratio * (1.0 + sign * relative)))
        for sign in (-1.0, 1.0)
    )
    return np.asarray(0.5 * (low + high))

"""Loads by springs and energy in the step-size control: their errors, and a first change."""

from __future__ import annotations

import numpy as np

from wearsim.evolution.problem import WearProblem
from wearsim.evolution.state import HERTZ, WearState
from wearsim.evolution.steppers.loads import elastic_approaches, with_feedback
from wearsim.evolution.steppers.single_step import worn_depths
from wearsim.mechanics.numerics.multistep import MAX_ORDER, ROWS, next_steps
from wearsim.mechanics.numerics.step_errors import energy_steps
from wearsim.types import FloatArray, IntArray

LEAST_LOAD = 0.01  # of the load without feedback; the error of smaller loads is compared with it


def next_steps_of_loads(
    problem: WearProblem, end: WearState, part: FloatArray, aim: float, keep: float
) -> tuple[FloatArray, IntArray, FloatArray]:
    """Choose the next step by the error of the loads.

    A stiff spring multiplies the error of the depth: its load, which decays as the roller descends,
    is a small difference. The error is relative to each load, or to a small part of the load
    without feedback where it has decayed; root mean square over the contacts.

    Parameters
    ----------
    problem : WearProblem
    end : WearState
        State after the step.
    part, aim, keep
        As of `next_steps`.

    Returns
    -------
    ndarray, shape (2, realisations)
        Excess of error and ratio of the next step, as of `next_steps`.
    order : ndarray of int, shape (realisations,)
        Its order.
    displaced : ndarray, shape (realisations,)
        Greatest displacement of a roller that the error of its load corresponds to [m].
    """
    feedback, spans, orders = np.asarray(end.past_feedback), end.past.spans, np.asarray(end.order)
    whole = with_feedback(problem, problem.force(end.passes), np.zeros(()), ())
    scale = np.maximum(whole + feedback[0], LEAST_LOAD * whole)
    relative = (feedback / scale).reshape(ROWS, -1, scale.shape[-1], 1)
    order, of_loads = np.empty_like(orders), np.empty(relative.shape[1:])
    most, ones = np.full_like(orders, MAX_ORDER), np.ones_like(of_loads)
    steps = next_steps(relative, spans, ones, orders, part, aim, keep, most, ones, of_loads, order)
    errors = np.abs(of_loads.reshape(scale.shape) * scale)
    springs = np.broadcast_to(problem.stiffness, scale.shape)
    displaced = np.divide(errors, springs, out=np.zeros_like(errors), where=springs > 0.0)
    # differences that reach back to the start of the test hang on the estimated slope of the loads
    oldest, before = (np.take_along_axis(spans, orders[None] - back, axis=0)[0] for back in (0, 1))
    return steps, order, np.where(oldest > before, displaced.max(axis=(0, 1)), 0.0)


def next_steps_of_energy(
    start: WearState, end: WearState, tolerance: float, keep: float, most: IntArray
) -> tuple[FloatArray, IntArray]:
    """Choose the next step by the error of the energy, and thus of the worn volume.

    In partial slip the power depends on the line loads, which follow from differences of depths
    far below the error that a step may add to a profile. Such errors of the energy add up, since
    further wear does not correct them. A step may therefore add the tolerance of the energy of the
    step, or of a part of the mean energy over as many passes where that is more, as under a spring
    that has lost its load.

    Parameters
    ----------
    start, end : WearState
        States before and after the step.
    tolerance, keep, most
        Tolerance of the stepper; others as of `next_steps`.

    Returns
    -------
    ndarray, shape (2, realisations)
        Excess of error and ratio of the next step, as of `next_steps`.
    order : ndarray of int, shape (realisations,)
        Its order.
    """
    past, orders = end.past, np.asarray(end.order)
    order, about = np.empty_like(orders), (start.passes, end.passes, start.energy, end.energy)
    return energy_steps(past.sums, past.spans, *about, orders, tolerance, keep, most, order), order


def unloading(here: WearProblem, state: WearState, exposure: FloatArray) -> FloatArray:
    """Return the change of the loads by springs over the exposure, shape (S, C, N).

    By the work of the line load on the wear, the approach under a constant load increases by the
    mean of the wear weighted with the line load; the elastic approach is that of unworn bodies.
    """
    cylinder, roller = worn_depths(here, state.contacts, 1.0)
    line_load = here.values_of(state.contacts, "line_load")
    total = line_load.sum(axis=-1)
    descent = (line_load * (cylinder + here.at_contacts(roller))).sum(axis=-1) / total
    slope = HERTZ * np.maximum(elastic_approaches(here, state), 0.0) / (total * here.grid.spacing)
    return np.asarray(-here.feedback(descent) / (1.0 + here.stiffness * slope) / exposure)

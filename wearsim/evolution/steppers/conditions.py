"""Load and exposure of implicit steps."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from wearsim.evolution.contacts import at_least, computed_once
from wearsim.evolution.problem import WearProblem
from wearsim.evolution.state import WearState
from wearsim.evolution.steppers.loads import mean_force, smooth_loads, with_feedback
from wearsim.types import FloatArray


@dataclass(frozen=True)
class Conditions:
    """Prescribed conditions of a step.

    Wear is nearly proportional to the load and the friction coefficient. Their product, integrated
    over the passes, is the exposure; the formulas take it as independent variable, in which wear
    is smooth also where load and friction vary.

    Parameters
    ----------
    force : ndarray, shape (realisations,) or (stations, 1, realisations)
        Load before feedback for the solution at the end of the step [N].
    prescribed : ndarray, shape (stations, contacts, realisations)
        The same at all contacts [N].
    own, mean : ndarray, shape (realisations,)
        Exposure per pass in these conditions, and its mean over the step.
    """

    force: FloatArray
    prescribed: FloatArray
    own: FloatArray
    mean: FloatArray


def conditions_of(
    here: WearProblem, problem: WearProblem, state: WearState, passes: FloatArray
) -> Conditions:
    """Return the conditions of a step; `here` is the problem with processes at their means.

    The load is that at the end of the step where it varies smoothly, and else its mean.
    """
    if not problem.varies:
        return computed_once(_constant_conditions, problem)
    force = mean = mean_force(problem, state, passes)
    smooth = smooth_loads(problem, state.passes, passes)
    if smooth.any():
        force = np.where(smooth, problem.force(problem.time(state.passes + passes)), mean)
    exposures = exposure(here, problem, force), exposure(here, problem, mean)
    return Conditions(force, with_feedback(here, force, np.zeros(()), ()), *exposures)


def _constant_conditions(problem: WearProblem) -> Conditions:
    """Return the conditions of all steps where neither the load nor an input varies."""
    force = problem.force(np.zeros(len(problem.loads)))
    per_pass = exposure(problem, problem, force)
    return Conditions(force, with_feedback(problem, force, np.zeros(()), ()), per_pass, per_pass)


def exposure(here: WearProblem, problem: WearProblem, force: FloatArray) -> FloatArray:
    """Return the exposure per pass for a load before feedback, shape (realisations,) [N]."""
    if force.ndim > 1:  # of a cam
        force = problem.mean_over_turn(force)[0, 0]
    loads = at_least(problem, force + here.inputs.mean_offset)
    if problem.varying and any(item.name == "friction" for item in problem.varying):
        loads = loads * here.inputs.friction.mean(axis=0)
    return np.asarray(loads)

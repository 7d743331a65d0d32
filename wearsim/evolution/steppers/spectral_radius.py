"""How fast wear flattens the stiffest shape of a profile: the limit of explicit steps."""

from __future__ import annotations

from dataclasses import replace
from typing import TypeAlias

import numpy as np

from wearsim.errors import ContactError
from wearsim.evolution.problem import WearProblem
from wearsim.evolution.state import WearState
from wearsim.evolution.steppers.single_step import present_problem, solve_present
from wearsim.evolution.steppers.wear_increment import WearIncrement
from wearsim.types import FloatArray

MAX_POWER_ITERATIONS = 12
SETTLED = 0.1  # relative change from one iterate to the next, or from the last rate measured
#: cylinder and rollers, shapes as in `WearState`
Shape: TypeAlias = tuple[FloatArray, FloatArray]
SMALL = 1e-4  # of the approach: how much a profile is changed to see the wear change


def stability_limit(problem: WearProblem, state: WearState) -> float:
    """Return the longest step of Euler's method that is stable [passes].

    Returns
    -------
    float
        2 over the greatest rate of decay, infinite where nothing wears.
    """
    rate = float(decay_rates(problem, state).max())
    return 2.0 / rate if rate > 0.0 else np.inf


def decay_rates(problem: WearProblem, state: WearState) -> FloatArray:
    """Return how fast each realisation's stiffest shape decays, shape (realisations,) [1/pass].

    Power iteration on the fall of the wear per pass that a change of the profiles causes. It
    begins at the shape that alternates from strip to strip: no other is stiffer where the contact
    answers locally, and then its greatest growth, the maximum norm, is the rate at once. Where the
    contact does not, the first iterate leads to what it answers to.

    One iterate is enough where it finds the rate that the state carries. Where the model cannot
    solve a contact on the changed profiles, that rate is kept.
    """
    wear = WearIncrement(present_problem(problem, state), state.contacts, 1.0)
    loaded = problem.values_of(state.contacts, "line_load") > 0.0
    alternate = np.where(loaded.any(axis=(0, 1)), (-1.0) ** np.arange(problem.grid.strips), 0.0)
    # the bodies share a change of the gap as they share the wear
    cylinder, roller = (alternate * r.max(axis=-1, keepdims=True) for r in _rates_of(wear))
    shape = cylinder, roller
    rates = state.decay if state.decay is not None else np.zeros(problem.shape[2])
    if not any(part.any() for part in shape):
        return np.zeros_like(rates)
    for _ in range(MAX_POWER_ITERATIONS):
        before = rates
        try:
            shape = _fall(problem, state, wear, shape)
        except ContactError:
            if state.decay is None:
                raise
            return state.decay
        rates = _size(shape)
        if (np.abs(rates - before) <= SETTLED * rates).all():
            break
    return rates


def _rates_of(wear: WearIncrement) -> Shape:
    return wear.cylinder, wear.roller


def _size(shape: Shape) -> FloatArray:
    """Return the greatest change of either body, shape (realisations,)."""
    size: FloatArray = np.maximum(*(np.abs(part).max(axis=(0, 1, 3)) for part in shape))
    return size


def _fall(problem: WearProblem, state: WearState, wear: WearIncrement, shape: Shape) -> Shape:
    """Return the fall of the wear per pass for a change of the profiles of unit size.

    Parameters
    ----------
    problem : WearProblem
    state : WearState
    wear : WearIncrement
        Of one pass, by the contacts of the state.
    shape : tuple of ndarray
        Change of cylinder and rollers, of any size.
    """
    line_load = problem.values_of(state.contacts, "line_load")
    gap = problem.gap(state.cylinder_depth, state.roller_depth)
    approach = problem.values_of(state.contacts, "approach") - gap.min(axis=-1)
    step = SMALL * np.maximum(approach.min(axis=(0, 1)), 1e-12)
    size = _size(shape)
    factor = (step / np.where(size > 0.0, size, 1.0))[:, None]
    changed = replace(
        state,
        cylinder_depth=state.cylinder_depth + factor * shape[0],
        roller_depth=state.roller_depth + factor * shape[1],
    )
    # a spring, which answers to descent as a whole, is softer than the strips
    contacts = solve_present(problem, changed, line_load.sum(axis=-1) * problem.grid.spacing)
    new = WearIncrement(present_problem(problem, state), contacts, 1.0)
    cylinder, roller = (
        (old - now) / step[:, None]
        for old, now in zip(_rates_of(wear), _rates_of(new), strict=True)
    )
    return cylinder, roller

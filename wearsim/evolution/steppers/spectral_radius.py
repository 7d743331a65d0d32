"""Greatest decay rate of a profile by wear: the stability limit of explicit steps."""

from __future__ import annotations

import numpy as np

from wearsim.errors import ContactError
from wearsim.evolution.problem import WearProblem
from wearsim.evolution.state import Depths, WearState
from wearsim.evolution.steppers.single_step import carried_loads, present_problem, solve_present
from wearsim.evolution.steppers.wear_increment import WearIncrement
from wearsim.types import FloatArray

MAX_POWER_ITERATIONS = 12
RATE_TOLERANCE = 0.1  # relative change between iterates, or from the last measurement
PERTURBATION = 1e-4  # change of a profile for the finite difference, relative to the approach


def stability_limit(problem: WearProblem, state: WearState) -> FloatArray:
    """Return the longest stable step of Euler's method, shape (realisations,) [passes].

    Returns
    -------
    ndarray
        2 over the greatest decay rate, infinite without wear.
    """
    rates = decay_rates(problem, state)
    limits: FloatArray = 2.0 / np.where(rates > 0.0, rates, 1.0)
    return np.where(rates > 0.0, limits, np.inf)


def decay_rates(problem: WearProblem, state: WearState) -> FloatArray:
    """Return the greatest decay rate of a profile by wear, shape (realisations,) [1/pass].

    Power iteration on the decrease of the wear per pass due to a change of the profiles. The first
    iterate alternates from strip to strip. If the line load of a strip depends on its own gap
    alone, this profile decays fastest and its decrease, in the maximum norm, is the rate.
    Otherwise the iteration converges to the profile that decays fastest.

    One iteration is sufficient if it agrees with the rate stored in the state. If the model cannot
    solve a contact on the changed profiles, the stored rate is returned.
    """
    wear = WearIncrement(present_problem(problem, state), state.contacts, 1.0)
    loaded = problem.values_of(state.contacts, "line_load") > 0.0
    alternating = np.where(loaded.any(axis=(0, 1)), (-1.0) ** np.arange(problem.grid.strips), 0.0)
    # a change of the gap is divided between the bodies in the ratio of their wear
    cylinder, roller = (alternating * rate.max(axis=-1, keepdims=True) for rate in wear.depths)
    profile = cylinder, roller
    rates = state.decay if state.decay is not None else np.zeros(problem.shape[2])
    if not (cylinder.any() or roller.any()):
        return np.zeros_like(rates)
    for _ in range(MAX_POWER_ITERATIONS):
        before = rates
        try:
            profile = _decrease(problem, state, wear, profile)
        except ContactError:
            if state.decay is None:
                raise
            return state.decay
        rates = _maximum_norm(profile)
        if (np.abs(rates - before) <= RATE_TOLERANCE * rates).all():
            break
    return rates


def _maximum_norm(profile: Depths) -> FloatArray:
    """Return the greatest change of either body, shape (realisations,)."""
    return np.asarray(np.maximum(*(np.abs(part).max(axis=(0, 1, 3)) for part in profile)))


def _decrease(
    problem: WearProblem, state: WearState, wear: WearIncrement, profile: Depths
) -> Depths:
    """Return the decrease of the wear per pass due to a change of the profiles of unit size.

    Parameters
    ----------
    problem : WearProblem
    state : WearState
    wear : WearIncrement
        Wear of one pass with the contacts of the state.
    profile : tuple of ndarray
        Change of cylinder and rollers, of any size.
    """
    least_gap = problem.gap(*state.depths).min(axis=-1)
    approach = problem.values_of(state.contacts, "approach") - least_gap
    step = PERTURBATION * np.maximum(approach.min(axis=(0, 1)), 1e-12)
    size = _maximum_norm(profile)
    factor = (step / np.where(size > 0.0, size, 1.0))[:, None]
    changed = state.replaced(
        cylinder_depth=state.cylinder_depth + factor * profile[0],
        roller_depth=state.roller_depth + factor * profile[1],
    )
    # constant loads: the feedback of a spring on the total descent is weaker than that of strips
    contacts = solve_present(problem, changed, carried_loads(problem, state.contacts))
    new = WearIncrement(present_problem(problem, state), contacts, 1.0)
    cylinder, roller = (
        (old - now) / step[:, None] for old, now in zip(wear.depths, new.depths, strict=True)
    )
    return cylinder, roller

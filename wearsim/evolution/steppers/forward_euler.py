"""Explicit stepper: Euler's method below its stability limit, and that limit."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from wearsim.errors import ContactError, StepError
from wearsim.evolution.error_estimates import (
    COVER,
    excess,
    greatest_depth,
    state_difference,
    variation_bias,
    with_pass_errors,
)
from wearsim.evolution.pauses import without_load
from wearsim.evolution.problem import WearProblem
from wearsim.evolution.quantities import oscillation
from wearsim.evolution.state import Depths, WearState
from wearsim.evolution.steppers.base import Attempt, Step, Stepper
from wearsim.evolution.steppers.loads import (
    checked_loads,
    displacement_at,
    elastic_approach,
    mean_loads,
)
from wearsim.evolution.steppers.single_step import (
    carried_loads,
    contacts_at,
    explicit_step,
    present_problem,
    recovery_at,
    solve_present,
    worn_depths,
)
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
    return np.where(rates > 0.0, 2.0 / np.where(rates > 0.0, rates, 1.0), np.inf)


def decay_rates(problem: WearProblem, state: WearState) -> FloatArray:
    """Return the greatest decay rate of a profile by wear, shape (realisations,) [1/pass].

    Power iteration on the decrease of the wear per pass due to a change of the profiles. The first
    iterate alternates from strip to strip. If the line load of a strip depends on its own gap
    alone, this profile decays fastest and its decrease, in the maximum norm, is the rate.
    Otherwise the iteration converges to the profile that decays fastest.

    One iteration is sufficient if it agrees with the rate stored in the state. If the model cannot
    solve a contact on the changed profiles, the stored rate is returned.
    """
    wear = worn_depths(present_problem(problem, state), state.contacts, 1.0)
    loaded = problem.values_of(state.contacts, "line_load") > 0.0
    alternating = np.where(loaded.any(axis=(0, 1)), (-1.0) ** np.arange(problem.grid.strips), 0.0)
    # a change of the gap is divided between the bodies in the ratio of their wear
    cylinder, roller = (alternating * rate.max(axis=-1, keepdims=True) for rate in wear)
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
        rates = greatest_depth((np.abs(profile[0]), np.abs(profile[1])))
        if (np.abs(rates - before) <= RATE_TOLERANCE * rates).all():
            break
    return rates


def _decrease(problem: WearProblem, state: WearState, wear: Depths, profile: Depths) -> Depths:
    """Return the decrease of the wear per pass due to a change of the profiles of unit size.

    Parameters
    ----------
    problem : WearProblem
    state : WearState
    wear : tuple of ndarray
        Depths of one pass with the contacts of the state.
    profile : tuple of ndarray
        Change of cylinder and rollers, of any size.
    """
    step = PERTURBATION * np.maximum(elastic_approach(problem, state), 1e-12)
    size = greatest_depth((np.abs(profile[0]), np.abs(profile[1])))
    factor = (step / np.where(size > 0.0, size, 1.0))[:, None]
    changed = state.with_added((factor * profile[0], factor * profile[1]))
    # constant loads: the feedback of a spring on the total descent is weaker than that of strips
    contacts = solve_present(problem, changed, carried_loads(problem, state.contacts))
    new = worn_depths(present_problem(problem, state), contacts, 1.0)
    cylinder, roller = ((old - now) / step[:, None] for old, now in zip(wear, new, strict=True))
    return cylinder, roller


SAFETY = 0.5  # part of the stability limit that a step may take
OSCILLATING = 0.1  # second difference of the line load, relative to its peak, that gives a warning


@dataclass(eq=False)
class ExplicitStepper(Stepper):
    """Stepper that applies the wear rate of the step's start to the whole step.

    A bump of height h changes the line load by -k h, and wear then flattens it at the rate c k per
    pass. The step must stay below 2/(c k) for the stiffest profile that the strips can represent.

    Parameters
    ----------
    tolerance, forced_step
        As for `Stepper`; the stability limit applies in addition.
    allow_unstable : bool
        Allow a forced step beyond the stability limit.
    """

    allow_unstable: bool = False

    def proposed(self, problem: WearProblem, state: WearState) -> FloatArray:
        """Return the step of the step-size control, below the stability limit, or a forced step."""
        limit = stability_limit(problem, state)
        if self.forced_step is None:
            return np.minimum(np.where(state.step > 0.0, state.step, np.inf), SAFETY * limit)
        if self.forced_step > limit.min() and not self.allow_unstable:
            raise StepError(
                f"a step of {self.forced_step:g} passes exceeds the stability limit of"
                f" {limit.min():.4g} passes at pass {state.passes[0]:.0f}; lower evolution.step,"
                " set evolution.stepper = 'stabilised', or set evolution.allow_unstable = true",
                state.to_arrays(),
            )
        return np.full(limit.shape, self.forced_step)

    def scheme(self, problem: WearProblem, state: WearState) -> Step:
        """Return the explicit step."""
        return explicit_step

    def attempt(
        self, problem: WearProblem, state: WearState, step: FloatArray, stop: float, scheme: Step
    ) -> Attempt:
        """Take a step, and estimate its error by another one with the wear rate of its end."""
        end = scheme(problem, state, step)
        added = _errors(problem, state, end, step)
        over = excess(self.tolerance, problem, state, end, added, stop)
        if problem.has_nodes:
            end = with_pass_errors(problem, state, end, end, scheme, step)
        added = added + end.irreducible - state.irreducible
        passes = np.where(step == stop - state.passes, stop, end.passes)
        end = end.replaced(
            passes=passes,
            **{name: solution.replaced(passes=passes) for name, solution in end.auxiliary.items()},
            depth_error=state.depth_error + added[0],
            volume_error=state.volume_error + added[1],
            profile_error=state.profile_error + added[2],
            steps=state.steps + 1,
        )
        worst, warning = max(oscillation(contact.line_load) for contact in end.contacts), None
        # the few strips in contact next to a pause alternate without being unstable
        if worst >= OSCILLATING and not without_load(problem, passes).any():
            ratio = float((step / stability_limit(problem, state)).max())
            warning = (
                f"unstable: at pass {passes[0]:.0f} the line load alternates from strip to strip by"
                f" {worst:.0%} of its peak; the step of {step.max():.4g} passes is"
                f" {ratio:.2g} times the stability limit"
            )
        return Attempt((end,), over, self.ratio(over), warning)


def _errors(problem: WearProblem, start: WearState, end: WearState, step: FloatArray) -> FloatArray:
    """Return the errors that a step adds, as of `sizes`, shape (3, realisations).

    It is half the difference to a step with the wear rate of its end, plus the effect of the
    variation of load and processes within the step.
    """
    # processes at their means over the step, as in the step
    here = problem.at_time(problem.time(start.passes), problem.time(start.passes + step))
    displacement = displacement_at(here, (start.depths, end.depths), recovery_at(problem, end)[1])
    loads = checked_loads(start, mean_loads(here, start, step, displacement, end.contacts))
    solve = solve_present if problem.varying else contacts_at
    wear = worn_depths(here, solve(here, end, loads), step)
    errors = COVER * 0.5 * state_difference(problem, end, start.with_added(wear))
    bias = variation_bias(problem, end, start.passes, step)
    if bias is None:
        return errors
    return errors + COVER * state_difference(problem, end, end.with_added(bias[0]))

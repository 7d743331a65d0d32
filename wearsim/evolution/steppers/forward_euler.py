"""Explicit stepper: Euler's method below its stability limit."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from wearsim.errors import StepError
from wearsim.evolution.error_control.error_estimates import (
    COVER,
    excess,
    state_difference,
    variation_bias,
    with_added_depths,
    with_pass_errors,
)
from wearsim.evolution.error_control.step_size import StepControl
from wearsim.evolution.observables import oscillation
from wearsim.evolution.problem import WearProblem
from wearsim.evolution.state import WearState
from wearsim.evolution.steppers.base import Advance, Stepper, fitted
from wearsim.evolution.steppers.single_step import (
    contacts_at,
    explicit_step,
    mean_loads,
    solve_present,
)
from wearsim.evolution.steppers.spectral_radius import stability_limit
from wearsim.evolution.steppers.wear_increment import WearIncrement
from wearsim.types import FloatArray

SAFETY = 0.5  # part of the stability limit that a step may take
OSCILLATING = 0.1  # second difference of the line load, relative to its peak, that gives a warning


class ExplicitStepper(Stepper):
    """Stepper that applies the wear rate of the step's start to the whole step.

    A bump of height h changes the line load by -k h, and wear then flattens it at the rate c k per
    pass. The step must stay below 2/(c k) for the stiffest profile that the strips can represent.

    Parameters
    ----------
    control : StepControl
        Step-size control; the stability limit applies in addition.
    forced_step : float, optional
        Passes per step, instead of the step-size control.
    allow_unstable : bool
        Allow a forced step beyond the stability limit.
    """

    def __init__(
        self,
        control: StepControl,
        forced_step: float | None = None,
        allow_unstable: bool = False,
    ) -> None:
        self.control, self.forced_step = control, forced_step
        self.allow_unstable = allow_unstable

    def side_step(self, problem: WearProblem, state: WearState, passes: float) -> WearState:
        """Return the state `passes` passes later, in one step."""
        return explicit_step(problem, state, passes)

    def advance(self, problem: WearProblem, state: WearState, stop: float) -> Advance:
        """Take one step, below the stability limit and within the tolerance."""
        limit = stability_limit(problem, state)
        proposed = self.forced_step or min(state.step or np.inf, SAFETY * limit)
        if self.forced_step and self.forced_step > limit and not self.allow_unstable:
            raise StepError(
                f"a step of {self.forced_step:g} passes exceeds the stability limit of"
                f" {limit:.4g} passes at pass {state.passes:.0f}; lower evolution.step, set"
                " evolution.stepper = 'stabilised', or set evolution.allow_unstable = true",
                state.to_arrays(),
            )
        left, rejected = stop - state.passes, state.rejected
        while True:
            step = min(proposed, left) if self.forced_step else fitted(proposed, left)
            end = explicit_step(problem, state, step)
            added = _errors(problem, state, end, step)
            over = float(excess(self.control, problem, state, end, added, stop).max())
            chosen = self.control.next_step(step, over)
            if self.forced_step or over <= 1.0:
                break
            rejected += 1
            proposed = min(chosen, 0.7 * step)
        end = with_pass_errors(problem, state, end, end, explicit_step, step)
        added = added + end.irreducible - state.irreducible
        passes, half = stop if step == left else end.passes, end.half_quadrature_solution
        end = replace(
            end,
            passes=passes,
            half_quadrature_solution=None if half is None else replace(half, passes=passes),
            depth_error=state.depth_error + added[0],
            volume_error=state.volume_error + added[1],
            step=self.forced_step or (max(chosen, proposed) if step < proposed else chosen),
            steps=state.steps + 1,
            rejected=rejected,
        )
        worst = max(oscillation(contact.line_load) for contact in end.contacts)
        warning = (
            f"unstable: at pass {passes:.0f} the line load alternates from strip to strip by"
            f" {worst:.0%} of its peak; the step of {step:.4g} passes is"
            f" {step / limit:.2g} times the stability limit"
        )
        return Advance(path=(state, end), warning=None if worst < OSCILLATING else warning)


def _errors(problem: WearProblem, start: WearState, end: WearState, step: float) -> FloatArray:
    """Return the error that a step adds, in depth [m] and volume [m^3], shape (2, realisations).

    It is half the difference to a step with the wear rate of its end, plus the effect of the
    variation of load and processes within the step.
    """
    # processes at their means over the step, as in the step
    here = problem.at_time(problem.time(start.passes), problem.time(start.passes + step))
    depths = start.depths, end.depths
    loads = mean_loads(here, start, step, depths, here.values_of(end.contacts, "power"))
    solve = solve_present if problem.varying else contacts_at
    wear = WearIncrement(here, solve(here, end, loads), step)
    other = replace(
        end,
        cylinder_depth=start.cylinder_depth + wear.cylinder,
        roller_depth=start.roller_depth + wear.roller,
    )
    errors = COVER * 0.5 * state_difference(problem, end, other)
    bias = variation_bias(problem, end, start.passes, step)
    if bias is None:
        return errors
    return errors + COVER * state_difference(problem, end, with_added_depths(end, bias))

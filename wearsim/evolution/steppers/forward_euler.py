"""The explicit stepper: Euler's method, held under its limit of stability."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from wearsim.errors import StepError
from wearsim.evolution.error_control.error_estimates import (
    COVER,
    depth_between,
    excess,
    total_worn_volume,
    variation_error,
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

SAFETY = 0.5  # of the limit of stability
OSCILLATING = 0.1  # alternate strips differ by this part of the peak line load


class ExplicitStepper(Stepper):
    """Takes the wear rate of the step's start for the whole step.

    A bump of height h changes the line load by -k h and wear then flattens it at the rate c k per
    pass; the step must stay below 2/(c k) for the stiffest shape the strips can hold.

    Parameters
    ----------
    control : StepControl
        Step-size control; the limit of stability holds besides.
    forced_step : float, optional
        Passes per step, in place of the control's choice.
    allow_unstable : bool
        Let a forced step exceed the limit of stability.
    """

    def __init__(
        self,
        control: StepControl,
        forced_step: float | None = None,
        allow_unstable: bool = False,
    ) -> None:
        self.control = control
        self.forced_step = forced_step
        self.allow_unstable = allow_unstable

    def side_step(self, problem: WearProblem, state: WearState, passes: float) -> WearState:
        """Return the state `passes` passes later, in one step."""
        return explicit_step(problem, state, passes)

    def advance(self, problem: WearProblem, state: WearState, stop: float) -> Advance:
        """Take one step, under the limit of stability and within the tolerance."""
        limit = stability_limit(problem, state)
        proposed = self._proposal(state, limit)
        rejected = state.rejected
        while True:
            left = stop - state.passes
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
        passes = stop if step == left else end.passes
        end = replace(
            end,
            passes=passes,
            half_quadrature_solution=None
            if end.half_quadrature_solution is None
            else replace(end.half_quadrature_solution, passes=passes),
            depth_error=state.depth_error + added[0],
            volume_error=state.volume_error + added[1],
            step=self.forced_step or (max(chosen, proposed) if step < proposed else chosen),
            steps=state.steps + 1,
            rejected=rejected,
        )
        return Advance(path=(state, end), warning=_warning(end, step, limit))

    def _proposal(self, state: WearState, limit: float) -> float:
        if self.forced_step is None:
            return min(state.step or np.inf, SAFETY * limit)
        if self.forced_step > limit and not self.allow_unstable:
            raise StepError(
                f"a step of {self.forced_step:g} passes exceeds the limit of stability, which is"
                f" {limit:.4g} passes at pass {state.passes:.0f}; lower evolution.step, set"
                " evolution.stepper = 'stabilised', or set evolution.allow_unstable = true to see"
                " what happens",
                state.to_arrays(),
            )
        return self.forced_step


def _warning(end: WearState, step: float, limit: float) -> str | None:
    """Return what to say where the contacts have begun to oscillate."""
    worst = max(oscillation(contact.line_load) for contact in end.contacts)
    if worst < OSCILLATING:
        return None
    return (
        f"unstable: at pass {end.passes:.0f} the line load alternates from strip to strip by"
        f" {worst:.0%} of its peak; the step of {step:.4g} passes is"
        f" {step / limit:.2g} times the limit of stability"
    )


def _errors(problem: WearProblem, start: WearState, end: WearState, step: float) -> FloatArray:
    """Return half the difference to a step at the end's wear rate, and the load's spread.

    Shape (2, realisations): depth [m] and volume worn off both bodies [m^3].
    """
    # the processes at their means over the step, as the step itself took them
    here = problem.at_time(problem.time(start.passes), problem.time(start.passes + step))
    depths = start.depths, end.depths
    loads = mean_loads(here, start, step, depths, here.values_of(end.contacts, "power"))
    solve = solve_present if problem.varying else contacts_at
    again = WearIncrement(here, solve(here, end, loads), step)
    other = replace(
        end,
        cylinder_depth=start.cylinder_depth + again.cylinder,
        roller_depth=start.roller_depth + again.roller,
    )
    volumes = np.abs(total_worn_volume(problem, end) - total_worn_volume(problem, other))
    apart = np.array([depth_between(end, other), volumes])
    return COVER * 0.5 * apart + variation_error(problem, end, start.passes, step)

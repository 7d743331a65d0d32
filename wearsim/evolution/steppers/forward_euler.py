"""Explicit stepper: Euler's method below its stability limit."""

from __future__ import annotations

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
from wearsim.evolution.steppers.base import Attempt, Step, Stepper
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
    control, forced_step
        As for `Stepper`; the stability limit applies in addition.
    allow_unstable : bool
        Allow a forced step beyond the stability limit.
    """

    def __init__(
        self,
        control: StepControl,
        forced_step: float | None = None,
        allow_unstable: bool = False,
    ) -> None:
        super().__init__(control, forced_step)
        self.allow_unstable = allow_unstable

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
        over = excess(self.control, problem, state, end, added, stop)
        end = with_pass_errors(problem, state, end, end, scheme, step)
        added = added + end.irreducible - state.irreducible
        passes = np.where(step == stop - state.passes, stop, end.passes)
        end = end.replaced(
            passes=passes,
            **{name: solution.replaced(passes=passes) for name, solution in end.auxiliary.items()},
            depth_error=state.depth_error + added[0],
            volume_error=state.volume_error + added[1],
            steps=state.steps + 1,
        )
        worst = max(oscillation(contact.line_load) for contact in end.contacts)
        warning = None
        if worst >= OSCILLATING:
            ratio = float((step / stability_limit(problem, state)).max())
            warning = (
                f"unstable: at pass {passes[0]:.0f} the line load alternates from strip to strip by"
                f" {worst:.0%} of its peak; the step of {step.max():.4g} passes is"
                f" {ratio:.2g} times the stability limit"
            )
        return Attempt((end,), over, warning)


def _errors(problem: WearProblem, start: WearState, end: WearState, step: FloatArray) -> FloatArray:
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
    other = end.replaced(
        cylinder_depth=start.cylinder_depth + wear.cylinder,
        roller_depth=start.roller_depth + wear.roller,
    )
    errors = COVER * 0.5 * state_difference(problem, end, other)
    bias = variation_bias(problem, end, start.passes, step)
    if bias is None:
        return errors
    return errors + COVER * state_difference(problem, end, with_added_depths(end, bias))

"""Error estimation by step doubling, for any scheme with steps over many passes."""

from __future__ import annotations

import numpy as np

from wearsim.evolution.error_control.error_estimates import (
    COVER,
    FIRST_ORDER_COVER,
    biased_coarse_solution,
    depth_difference,
    excess,
    greatest_where_deep,
    variation_bias,
    volume_of,
    with_pass_errors,
)
from wearsim.evolution.problem import WearProblem
from wearsim.evolution.state import WearState
from wearsim.evolution.steppers.base import Attempt, Step, Stepper
from wearsim.types import FloatArray


class StepDoublingStepper(Stepper):
    """Stepper that takes two half steps, and one whole step for a coarse-step solution.

    The error estimate of the depth is the difference to the coarse-step solution, which has been
    stepped along since the start of the test: it contains the effect of all earlier errors on the
    present profile. The volumes of the two solutions may cross while both are wrong; the error
    estimate of the volume is therefore the sum of the absolute changes of the difference over all
    steps. The step-size control limits the error added by each step.
    """

    def proposed(self, problem: WearProblem, state: WearState) -> FloatArray:
        """Return the forced step, the one proposed after the last step, or a first step."""
        if self.forced_step is not None:
            return np.full(state.passes.shape, self.forced_step)
        if state.step.all():
            return state.step
        return np.where(state.step > 0.0, state.step, first_steps(problem, state))

    def attempt(
        self, problem: WearProblem, state: WearState, step: FloatArray, stop: float, scheme: Step
    ) -> Attempt:
        """Take a step as two halves and as a whole, and estimate the error that it adds."""
        coarse_start = state.coarse_step_solution or state
        half = scheme(problem, state, 0.5 * step)
        end = scheme(problem, half, 0.5 * step)
        coarse = scheme(problem, coarse_start, step)
        end = with_pass_errors(problem, state, end, coarse, scheme, step)
        bias = variation_bias(problem, end, state.passes, step)
        coarse = biased_coarse_solution(end, coarse, bias)
        passes = np.where(step == stop - state.passes, stop, end.passes)
        before, after = depth_difference(state, coarse_start), depth_difference(end, coarse)
        change = after[0] - before[0], after[1] - before[1]
        cover = FIRST_ORDER_COVER if self.order == 1 else COVER
        added = cover * np.array(
            [greatest_where_deep(end, change), np.abs(volume_of(problem, change))]
        )
        auxiliary = {
            name: solution.replaced(
                passes=passes, coarse_step_solution=None, half_quadrature_solution=None
            )
            for name, solution in {**end.auxiliary, "coarse_step_solution": coarse}.items()
        }
        fixed, fixed_before = end.irreducible, state.irreducible
        end = end.replaced(
            passes=passes,
            steps=state.steps + 1,
            solves=end.solves + coarse.solves - coarse_start.solves,
            depth_error=cover * greatest_where_deep(end, after) + fixed[0],
            volume_error=state.volume_error - fixed_before[1] + added[1] + fixed[1],
            **auxiliary,
        )
        reached = np.array([end.depth_error, end.volume_error]) - fixed
        over = excess(self.control, problem, state, end, added, stop, reached)
        return Attempt((half, end), over)


def first_steps(problem: WearProblem, state: WearState) -> FloatArray:
    """Return the passes that wear off a tenth of the elastic approach, shape (realisations,)."""
    cylinder, roller = problem.shared_wear(*problem.wear_per_pass(state.contacts))
    rate = (cylinder + roller).max(axis=(0, 1, 3))
    least_gap = problem.gap(*state.depths).min(axis=-1)
    approach = problem.values_of(state.contacts, "approach") - least_gap
    worn = np.where(rate > 0.0, rate, 1.0)
    return np.asarray(np.where(rate > 0.0, 0.1 * approach.min(axis=(0, 1)) / worn, np.inf))

"""Step doubling: error estimates by a solution with steps of twice the length."""

from __future__ import annotations

import numpy as np

from wearsim.evolution.error_estimates import (
    COVER,
    VARYING_COVER,
    biased_coarse_solution,
    excess,
    greatest_depth,
    sizes,
    variation_bias,
    with_pass_errors,
)
from wearsim.evolution.pauses import rest
from wearsim.evolution.problem import WearProblem
from wearsim.evolution.state import Depths, WearState
from wearsim.evolution.steppers.base import Attempt, Step, Stepper
from wearsim.evolution.steppers.loads import elastic_approaches
from wearsim.types import BoolArray, FloatArray

# least error of the greatest depth over that of the profile; it is about 0.6 times that one except
# where the difference crosses zero
LEAST = 0.3
NEGLIGIBLE = 0.15  # half the relative variance that is neglected, over the tolerance


class StepDoublingStepper(Stepper):
    """Stepper that takes two half steps, and one whole step for a coarse-step solution.

    The error estimate of the depth is the difference to the coarse-step solution, which has been
    stepped along since the start of the test: it contains the effect of all earlier errors on the
    present profile. The volumes of the two solutions may cross while both are wrong; the error
    estimate of the volume is therefore the sum of the absolute changes of the difference over all
    steps. The step-size control limits the error added by each step.
    """

    #: whether the scheme takes a smooth load at the end of the step instead of its mean
    follows_trends = False

    def proposed(self, problem: WearProblem, state: WearState) -> FloatArray:
        """Return the forced step, the one proposed after the last step, or a first step."""
        if self.forced_step is not None:
            return np.full(state.passes.shape, self.forced_step)
        if state.step.nonzero()[0].size == state.step.size:
            return state.step
        return np.where(state.step > 0.0, state.step, self.first_steps(problem, state))

    def first_steps(self, problem: WearProblem, state: WearState) -> FloatArray:
        """Return passes that wear off a tenth of an elastic approach, shape (realisations,).

        It is that of the contact that wears most: a cam may have contacts with almost no load.
        """
        parts = problem.wear_parts(state.contacts, 1.0)
        cylinder, roller = problem.sum_of_parts(*parts)
        rate = (cylinder + roller).max(axis=(0, 1, 3))
        own = (parts[0] + parts[1]).max(axis=-1).reshape(-1, rate.size)
        approaches = elastic_approaches(problem, state).reshape(own.shape)
        approach = approaches[own.argmax(axis=0), np.arange(rate.size)]
        worn = np.where(rate > 0.0, rate, 1.0)
        return np.asarray(np.where(rate > 0.0, 0.1 * approach / worn, np.inf))

    def attempt(
        self, problem: WearProblem, state: WearState, step: FloatArray, stop: float, scheme: Step
    ) -> Attempt:
        """Take a step as two halves and as a whole, and estimate the error that it adds."""
        path, added, reached, _ = self.doubled(problem, state, step, stop, scheme)
        over = excess(self.tolerance, problem, state, path[-1], added, stop, reached)
        return Attempt(path, over, self.ratio(over))

    def doubled(
        self, problem: WearProblem, state: WearState, step: FloatArray, stop: float, scheme: Step
    ) -> tuple[tuple[WearState, WearState], FloatArray, FloatArray, BoolArray]:
        """Take a step as two halves and as a whole; parameters as of `attempt`.

        Returns
        -------
        path : tuple of WearState
            States in the middle and at the end.
        added, reached : ndarray, shape (3, realisations)
            Errors, as of `sizes`, that the step adds and those at its end.
        varies : ndarray of bool, shape (realisations,)
            Whether load or inputs vary within the step other than by a trend that the scheme
            follows.
        """
        coarse_start = state.coarse_step_solution or state
        half = scheme(problem, state, 0.5 * step)
        end = scheme(problem, half, 0.5 * step)
        coarse = self.whole_step(problem, coarse_start, step, end, scheme)
        if problem.has_nodes:
            end = with_pass_errors(problem, state, end, coarse, scheme, step)
        bias = self.bias(problem, state, end, step)
        varies = np.zeros(len(step), dtype=np.bool_)
        if bias is not None:
            depths, energy, varies = bias
            end, coarse = (one.with_added(depths, energy) for one in (end, coarse))
            coarse = biased_coarse_solution(end, coarse, depths)
        passes = np.where(step == stop - state.passes, stop, end.passes)
        after = end.stacked - coarse.stacked
        change = after - (state.stacked - coarse_start.stacked)
        cover = COVER * np.where(varies, VARYING_COVER, 1.0)
        added, reached = (cover * np.abs(sizes(problem, end, one)) for one in (change, after))
        auxiliary = {
            name: solution.replaced(
                passes=passes, coarse_step_solution=None, half_quadrature_solution=None
            )
            for name, solution in {**end.auxiliary, "coarse_step_solution": coarse}.items()
        }
        fixed, fixed_before = end.irreducible, state.irreducible
        # the volumes of the two solutions may cross
        reached[1] = state.volume_error - fixed_before[1] + added[1]
        # the difference where the groove is deep may cross zero too
        least = LEAST * reached[2] * greatest_depth(end.depths)
        end = end.replaced(
            passes=passes,
            steps=state.steps + 1,
            solves=end.solves + coarse.solves - coarse_start.solves,
            depth_error=np.maximum(reached[0], least) + fixed[0],
            volume_error=reached[1] + fixed[1],
            profile_error=reached[2] + fixed[2],
            **auxiliary,
        )
        return (half, end), added, reached, varies

    def bias(
        self, problem: WearProblem, start: WearState, end: WearState, step: FloatArray
    ) -> tuple[Depths, FloatArray, BoolArray] | None:
        """Return the result of `variation_bias` for a step, as far as the tolerance needs it."""
        negligible = NEGLIGIBLE * self.tolerance
        return variation_bias(problem, end, start.passes, step, self.follows_trends, negligible)

    def whole_step(
        self, problem: WearProblem, start: WearState, step: FloatArray, end: WearState, scheme: Step
    ) -> WearState:
        """Return the solution by a whole step from `start`; `end` is that by two halves."""
        return scheme(problem, start, step)

    def rest(
        self, problem: WearProblem, state: WearState, step: FloatArray, stop: float
    ) -> tuple[WearState, ...]:
        """Return the states in the middle and at the end of a step in a pause."""
        return rest(problem, state, 0.5 * step, stop), rest(problem, state, step, stop)

"""Error estimation by step doubling, for any scheme with steps over many passes."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from wearsim.errors import ContactError, StepError
from wearsim.evolution.error_control.error_estimates import (
    COVER,
    FIRST_ORDER_COVER,
    Step,
    biased_coarse_solution,
    depth_difference,
    excess,
    greatest_where_deep,
    variation_bias,
    volume_of,
    with_pass_errors,
)
from wearsim.evolution.error_control.step_size import StepControl, Trial
from wearsim.evolution.problem import WearProblem
from wearsim.evolution.state import WearState
from wearsim.evolution.steppers.base import Advance, Stepper
from wearsim.types import FloatArray, Number


@dataclass(frozen=True)
class Attempt:
    """Result of a trial step.

    Parameters
    ----------
    half, end : WearState
        States in the middle and at the end of the step.
    excess : ndarray, shape (realisations,)
        Error that the step adds, relative to its allowance.
    """

    half: WearState
    end: WearState
    excess: FloatArray


class StepDoublingStepper(Stepper):
    """Stepper that takes two half steps, and one whole step for a coarse-step solution.

    The error estimate of the depth is the difference to the coarse-step solution, which has been
    stepped along since the start of the test: it contains the effect of all earlier errors on the
    present profile. The volumes of the two solutions may cross while both are wrong; the error
    estimate of the volume is therefore the sum of the absolute changes of the difference over all
    steps. The step-size control limits the error added by each step.

    Parameters
    ----------
    control : StepControl
        Step-size control.
    forced_step : float, optional
        Passes per step, instead of the step-size control.
    """

    #: order of the scheme: a step adds an error that grows as the step to the power order + 1
    order: int

    def __init__(self, control: StepControl, forced_step: float | None = None) -> None:
        self.control, self.forced_step = control, forced_step

    @abstractmethod
    def scheme(self, problem: WearProblem, state: WearState) -> Step:
        """Return the scheme, called once at the start `state` of each step for all its parts."""

    def side_step(self, problem: WearProblem, state: WearState, passes: Number) -> WearState:
        """Return the state `passes` passes later, in one step."""
        return self.scheme(problem, state)(problem, state, passes)

    def advance(self, problem: WearProblem, state: WearState, stop: float) -> Advance:
        """Take one step, shortened until the error that it adds is allowed."""
        scheme = self.scheme(problem, state)
        proposed = self.forced_step or state.step or float(first_steps(problem, state).min())
        trial = self.trial(proposed, state.to_arrays)
        while True:
            step = trial.step(state.passes, stop)
            try:
                tried = self.attempt(problem, state, step, stop, scheme)
            except (StepError, ContactError) as failure:
                trial.reject(failure, step)
                continue
            if trial.accepts(float(tried.excess.max()), step):
                end = tried.end.replaced(
                    step=trial.proposed,
                    steps=state.steps + 1,
                    rejected=state.rejected + trial.rejected,
                )
                return Advance(path=(state, tried.half, end))

    def trial(self, proposed: float, state: Callable[[], dict[str, Any]]) -> Trial:
        """Return the search for the length of a step, with the parameters of `Trial`."""
        return Trial(proposed, self.control, self.order, bool(self.forced_step), state)

    def attempt(
        self, problem: WearProblem, state: WearState, step: Number, stop: float, scheme: Step
    ) -> Attempt:
        """Take a step as two halves and as a whole, and estimate the error that it adds.

        Parameters
        ----------
        problem : WearProblem
        state : WearState
        step : float or ndarray, shape (realisations,)
            Length of the step [passes].
        stop : float
            Passes at the end of the test.
        scheme : callable
            Result of `scheme`.

        Raises
        ------
        StepError, ContactError
            If the step is too long for one of the realisations.
        """
        coarse_start = state.coarse_step_solution or state
        half = scheme(problem, state, 0.5 * step)
        end = scheme(problem, half, 0.5 * step)
        coarse = scheme(problem, coarse_start, step)
        end = with_pass_errors(problem, state, end, coarse, scheme, step)
        bias = variation_bias(problem, end, state.passes_done, step)
        coarse = biased_coarse_solution(end, coarse, bias)
        passes = np.where(step == stop - state.passes_done, stop, end.passes_done)
        end = end.advanced_to(passes, coarse.solves_since(coarse_start))
        before, after = depth_difference(state, coarse_start), depth_difference(end, coarse)
        change = after[0] - before[0], after[1] - before[1]
        cover = FIRST_ORDER_COVER if self.order == 1 else COVER
        added = cover * np.array(
            [greatest_where_deep(end, change), np.abs(volume_of(problem, change))]
        )
        auxiliary = {
            name: solution.advanced_to(
                end.passes_done, coarse_step_solution=None, half_quadrature_solution=None
            )
            for name, solution in {**end.auxiliary, "coarse_step_solution": coarse}.items()
        }
        fixed, fixed_before = end.irreducible, state.irreducible
        end = end.replaced(
            depth_error=cover * greatest_where_deep(end, after) + fixed[0],
            volume_error=state.volume_error - fixed_before[1] + added[1] + fixed[1],
            **auxiliary,
        )
        reached = np.array([end.depth_error, end.volume_error]) - fixed
        return Attempt(half, end, excess(self.control, problem, state, end, added, stop, reached))


def first_steps(problem: WearProblem, state: WearState) -> FloatArray:
    """Return the passes that wear off a tenth of the elastic approach, shape (realisations,)."""
    cylinder, roller = problem.shared_wear(*problem.wear_per_pass(state.contacts))
    rate = (cylinder + roller).max(axis=(0, 1, 3))
    least_gap = problem.gap(*state.depths).min(axis=-1)
    approach = problem.values_of(state.contacts, "approach") - least_gap
    worn = np.where(rate > 0.0, rate, 1.0)
    return np.asarray(np.where(rate > 0.0, 0.1 * approach.min(axis=(0, 1)) / worn, np.inf))

"""Steps whose error a coarser twin of the test tells: shared by every scheme that takes such."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass

import numpy as np

from wearsim.errors import ContactError, StepError
from wearsim.evolution.error_control.error_estimates import (
    COVER,
    FIRST_ORDER_COVER,
    Step,
    apart,
    biased_coarse_solution,
    excess,
    greatest_in,
    grooves,
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
    """A step that has been tried.

    Parameters
    ----------
    half, end : WearState
        The state in its middle and at its end.
    excess : ndarray, shape (realisations,)
        What it adds to the error over what it may add.
    """

    half: WearState
    end: WearState
    excess: FloatArray


class StepDoublingStepper(Stepper):
    """Takes every step in halves, and whole in a twin of the test that is stepped beside it.

    What sets the depths of the two apart is an estimate of the error of the test, with all that
    wear has forgotten of earlier errors. Their volumes may cross while both are wrong: there it is
    the sum of what every step has moved them apart, whatever its sign. What a step adds controls
    its size.

    Parameters
    ----------
    control : StepControl
        Step-size control.
    forced_step : float, optional
        Passes per step, in place of the control's choice.
    """

    #: of the scheme: a step adds an error that grows as the step to the power order + 1
    order: int

    def __init__(self, control: StepControl, forced_step: float | None = None) -> None:
        self.control = control
        self.forced_step = forced_step

    @abstractmethod
    def scheme(self, problem: WearProblem, state: WearState) -> Step:
        """Return what takes a problem, a state and a number of passes to the state after them.

        It is asked for once at the start `state` of each step, for all that is stepped there.
        """

    def side_step(self, problem: WearProblem, state: WearState, passes: Number) -> WearState:
        """Return the state `passes` passes later, in one step."""
        return self.scheme(problem, state)(problem, state, passes)

    def advance(self, problem: WearProblem, state: WearState, stop: float) -> Advance:
        """Take one step, shortened until what it adds to the error is allowed."""
        scheme, trial = self.scheme(problem, state), self.trial(problem, state)
        while True:
            step = trial.step(state.passes, stop)
            try:
                tried = self.attempt(problem, state, step, stop, scheme)
            except (StepError, ContactError) as failure:
                trial.refuse(failure, step)
                continue
            if trial.stands(float(tried.excess.max()), step):
                end = tried.end.replaced(
                    step=trial.proposed,
                    steps=state.steps + 1,
                    rejected=state.rejected + trial.rejected,
                )
                return Advance(path=(state, tried.half, end))

    def trial(self, problem: WearProblem, state: WearState) -> Trial:
        """Return the search for the next step of a test."""
        proposed = self.forced_step or state.step or float(first_steps(problem, state).min())
        return Trial(proposed, self.control, self.order, bool(self.forced_step), state.to_arrays)

    def attempt(
        self, problem: WearProblem, state: WearState, step: Number, stop: float, scheme: Step
    ) -> Attempt:
        """Take a step in halves and whole, and tell what it adds to the error.

        Parameters
        ----------
        problem : WearProblem
        state : WearState
        step : float or ndarray, shape (realisations,)
            Passes of the step.
        stop : float
            Passes at the end of the test.
        scheme : callable
            From `scheme`.

        Raises
        ------
        StepError, ContactError
            If the step is too long for one of the realisations.
        """
        twin = state.coarse_step_solution or state
        half = scheme(problem, state, 0.5 * step)
        end = scheme(problem, half, 0.5 * step)
        whole = scheme(problem, twin, step)
        end = with_pass_errors(problem, state, end, whole, scheme, step)
        whole = biased_coarse_solution(
            end, whole, variation_bias(problem, end, state.passes_done, step)
        )
        now = np.where(step == stop - state.passes_done, stop, end.passes_done)
        end = end.advanced_to(now, whole.solves_since(twin))
        end, added = _with_errors(problem, (state, twin), (end, whole), self.order)
        reached = np.array([end.depth_error, end.volume_error]) - end.irreducible
        over = excess(self.control, problem, state, end, added, stop, reached)
        return Attempt(half, end, over)


def _with_errors(
    problem: WearProblem,
    before: tuple[WearState, WearState],
    after: tuple[WearState, WearState],
    order: int,
) -> tuple[WearState, FloatArray]:
    """Return a test after a step, with its errors and its twin, and what the step adds to them.

    Parameters
    ----------
    problem : WearProblem
    before, after : tuple of WearState
        The test and its twin at the step's ends.
    order : int
        Of the scheme.

    Returns
    -------
    end : WearState
    added : ndarray, shape (2, realisations)
        How far the step moves the two apart, in depth [m] and volume [m^3], with the factor for
        safety.
    """
    (start, _), (end, whole) = before, after
    deep, first, last = grooves(end), apart(*before), apart(*after)
    moved = last[0] - first[0], last[1] - first[1]
    cover = FIRST_ORDER_COVER if order == 1 else COVER
    added = cover * np.array([greatest_in(deep, moved), np.abs(volume_of(problem, moved))])
    others = [state.irreducible for state in (start, end)]
    twins = {
        name: twin.advanced_to(
            end.passes_done, coarse_step_solution=None, half_quadrature_solution=None
        )
        for name, twin in (
            ("coarse_step_solution", whole),
            ("half_quadrature_solution", end.half_quadrature_solution),
        )
        if twin is not None
    }
    end = end.replaced(
        depth_error=cover * greatest_in(deep, last) + others[1][0],
        volume_error=start.volume_error - others[0][1] + added[1] + others[1][1],
        coarse_step_solution=twins["coarse_step_solution"],
        half_quadrature_solution=twins.get("half_quadrature_solution"),
    )
    return end, added


def first_steps(problem: WearProblem, state: WearState) -> FloatArray:
    """Return the passes that wear a tenth of the elastic approach off, shape (realisations,)."""
    cylinder, roller = problem.shared_wear(*problem.wear_per_pass(state.contacts))
    rate = (cylinder + roller).max(axis=(0, 1, 3))
    gap = problem.gap(state.cylinder_depth, state.roller_depth)
    approach = problem.values_of(state.contacts, "approach") - gap.min(axis=-1)
    worn = np.where(rate > 0.0, rate, 1.0)
    return np.asarray(np.where(rate > 0.0, 0.1 * approach.min(axis=(0, 1)) / worn, np.inf))

"""Step doubling, and the implicit stepper."""

from __future__ import annotations

import numpy as np

from wearsim.contact_batch import ContactBatch, ContactBatchSolution
from wearsim.errors import StepError
from wearsim.evolution.error_estimates import (
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
from wearsim.evolution.pauses import rest
from wearsim.evolution.problem import WearProblem
from wearsim.evolution.state import WearState, contact_batch
from wearsim.evolution.steppers.base import Attempt, Step, Stepper
from wearsim.evolution.steppers.loads import (
    checked_loads,
    corrected_loads,
    displacement_at,
    elastic_approach,
    elastic_approaches,
    fresh_approach,
    mean_force,
    mean_loads,
)
from wearsim.evolution.steppers.single_step import (
    REALISATION,
    WearIncrement,
    worn_state,
)
from wearsim.plugins import SharedWear
from wearsim.types import BoolArray, FloatArray


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
        over = excess(self.tolerance, problem, state, end, added, stop, reached)
        return Attempt((half, end), over)

    def rest(
        self, problem: WearProblem, state: WearState, step: FloatArray, stop: float
    ) -> tuple[WearState, ...]:
        """Return the states in the middle and at the end of a step in a pause."""
        return rest(problem, state, 0.5 * step, stop), rest(problem, state, step, stop)


def first_steps(problem: WearProblem, state: WearState) -> FloatArray:
    """Return the passes that wear off a tenth of the elastic approach, shape (realisations,)."""
    cylinder, roller = problem.shared_wear(*problem.wear_per_pass(state.contacts))
    rate = (cylinder + roller).max(axis=(0, 1, 3))
    worn = np.where(rate > 0.0, rate, 1.0)
    return np.asarray(np.where(rate > 0.0, 0.1 * elastic_approach(problem, state) / worn, np.inf))


MAX_FIXED_POINT = 60
RELAXATION_INTERVAL = 20  # iterations between relaxations of the tolerance by a factor of ten


class ImplicitStepper(StepDoublingStepper):
    """Stepper of first order that solves the contacts on the profiles at the end of each step.

    It is stable for any step length. The error of the coarse-step solution is about twice that of
    the test, so that the difference of the two is about the error of the test.
    """

    def scheme(self, problem: WearProblem, state: WearState) -> Step:
        """Return the implicit step."""
        return implicit_step


def _relative_change(new: FloatArray, old: FloatArray) -> FloatArray:
    """Return the greatest relative change per realisation, shape (N,), from (S, C, N, ...)."""
    axes = (0, 1, 3)[: new.ndim - 1]
    change, scale = np.abs(new - old).max(axis=axes), np.abs(new).max(axis=axes)
    scale[scale == 0.0] = np.inf
    return np.asarray(change / scale)


def implicit_step(problem: WearProblem, state: WearState, passes: FloatArray) -> WearState:
    """Step over `passes` passes with the contacts solved on the profiles at the step's end.

    The wear of the step enters the contact problem as a compliance, so that the step is stable for
    any length. Compliance, loads and creepage depend on the solution and are iterated; the force of
    a spring is that at the mean of the displacements at start and end. Where wear
    is not proportional to the line load, its exponent is estimated from successive iterates.
    Realisations that have converged are not solved again while others continue.

    Raises
    ------
    StepError
        If the iteration does not converge.
    """
    begin, varying = state.passes, bool(problem.varying)
    problem = problem.at_time(problem.time(begin), problem.time(begin + passes))
    gap = problem.gap(state.cylinder_depth, state.roller_depth)
    contacts = state.contacts
    wear = WearIncrement(problem, contacts, passes)
    ends = state.with_added(wear.depths)
    fresh, start, steady = _start_of_spring(problem, state, passes)
    displacement = displacement_at(problem, (state.depths, ends.depths), start)
    loads = checked_loads(state, mean_loads(problem, state, passes, displacement, contacts))
    active = np.ones(problem.shape[REALISATION], dtype=np.bool_)
    iterations = np.zeros(len(active), dtype=np.int64)
    for iteration in range(1, MAX_FIXED_POINT + 1):
        batch = contact_batch(problem, gap + wear.offset, loads, *ends.depths)
        solved = solve_compliant(problem, batch, wear.compliance, contacts, active)
        iterations += active
        new = WearIncrement(problem, solved, passes)
        ends = state.with_added(new.depths)
        predicted = wear.predicted_opening(problem.values_of(solved, "line_load"))
        change, new_loads = _relative_change(new.opening, predicted), loads
        if problem.has_spring or problem.terms:
            recovered, part = start, np.ones(())
            if problem.has_spring:
                recovered = fresh - elastic_approaches(problem, ends.replaced(contacts=solved))
                # a process may have changed the tilt, and a log the load, of the contacts at start
                part = np.where(steady & (not varying), 0.5, 1.0)
                recovered = (1.0 - part) * start + part * recovered
            displacement = displacement_at(problem, (state.depths, ends.depths), recovered)
            new_loads = mean_loads(problem, state, passes, displacement, solved)
            change = np.maximum(change, _relative_change(new_loads, loads))
            if problem.has_spring:
                rise = problem.values_of(solved, "approach") - gap.min(axis=-1)
                new_loads = corrected_loads(problem, loads, new_loads, rise, part)
            new_loads = checked_loads(state, new_loads)
        if problem.slip_profile is not None:
            change = np.maximum(change, _relative_change(new.cylinder, wear.cylinder))
        # strips at an edge may enter and leave the contact in turn: relax the tolerance slowly
        relaxation = 10.0 ** ((iteration - 1) // RELAXATION_INTERVAL)
        active &= ~(change < problem.iteration_tolerance * relaxation)
        if not np.count_nonzero(active):
            solves = state.solves + iterations * problem.contacts_each
            end = ends.replaced(solves=solves, contacts=solved)
            return worn_state(problem, end, passes, problem.values_of(solved, "power"))
        new.estimate_exponents(wear)
        contacts, wear, loads = solved, new, new_loads
    raise StepError(
        f"an implicit step of {passes[0]:.4g} passes from pass {begin[0]:.0f} did not"
        f" converge (last relative change {change.max():.1e})",
        state.to_arrays(),
    )


def _start_of_spring(
    problem: WearProblem, state: WearState, passes: FloatArray
) -> tuple[FloatArray, FloatArray, BoolArray]:
    """Return the elastic approach of unworn bodies and the recovery at the start of a step [m].

    Returns
    -------
    fresh : ndarray, shape (stations, contacts, realisations)
        See `fresh_approach`, under the mean load before feedback.
    recovered : ndarray, shape (stations, contacts, realisations)
        From the contacts of the state.
    steady : ndarray of bool, shape (realisations,)
        Whether the load before feedback is constant, so that the recovery is that of the start.
    """
    if not problem.has_spring:
        return np.zeros(()), np.zeros(()), np.zeros((), dtype=np.bool_)
    force = mean_force(problem, state, passes)
    fresh = fresh_approach(problem, state, force)
    steady = force == problem.force(problem.time(state.passes))
    return fresh, fresh - elastic_approaches(problem, state), steady


def solve_compliant(
    problem: WearProblem,
    batch: ContactBatch,
    wear: SharedWear,
    warm: ContactBatchSolution,
    active: BoolArray,
) -> ContactBatchSolution:
    """Solve the contacts of the active realisations; the others keep their solutions.

    Parameters
    ----------
    problem : WearProblem
    batch : ContactBatch
        The contacts, in the problem's order.
    wear : SharedWear
        Wear compliance with a first axis of realisations.
    warm : ContactBatchSolution
        Solutions to start from, in the problem's order.
    active : ndarray of bool, shape (realisations,)

    Returns
    -------
    ContactBatchSolution
        In the problem's order; those of inactive realisations are taken from `warm`.
    """
    model, realisations = problem.model, problem.shape[REALISATION]
    coupled = len(batch) // realisations
    everywhere = np.count_nonzero(active) == realisations
    if everywhere and coupled == 1:
        return model.solve(batch, wear.total.reshape(batch.gap.shape), None, warm)
    if everywhere and realisations == 1:
        return model.solve(batch, None, wear, warm)
    # the contacts of one realisation next to each other, which the problem has `realisations` apart
    numbers = np.flatnonzero(active)
    order = np.arange(len(batch)).reshape(coupled, realisations)[:, numbers].T.ravel()
    some, near, part = batch.at(order), warm.at(order), wear.at(numbers)
    if coupled == 1:
        solved = model.solve(some, part.total.reshape(some.gap.shape), None, near)
    else:
        solved = model.solve(some, None, part, near)
    return warm.with_others(order, solved)

"""Implicit stepper: backward Euler method by contact solves with wear compliance."""

from __future__ import annotations

import numpy as np

from wearsim.contact_batch import ContactBatch, ContactBatchSolution
from wearsim.errors import StepError
from wearsim.evolution.error_control.error_estimates import StepDoublingStepper
from wearsim.evolution.problem import WearProblem
from wearsim.evolution.state import WearState, contact_batch
from wearsim.evolution.steppers.base import Step
from wearsim.evolution.steppers.single_step import (
    REALISATION,
    WearIncrement,
    end_depths,
    end_loads,
    worn_state,
)
from wearsim.plugins import SharedWear
from wearsim.types import BoolArray, FloatArray

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
    any length. Compliance, loads and creepage depend on the solution and are iterated. Where wear
    is not proportional to the line load, its exponent is estimated from successive iterates.
    Realisations that have converged are not solved again while others continue.

    Raises
    ------
    StepError
        If the iteration does not converge.
    """
    begin = state.passes
    problem = problem.at_time(problem.time(begin), problem.time(begin + passes))
    gap = problem.gap(state.cylinder_depth, state.roller_depth)
    contacts = state.contacts
    wear = WearIncrement(problem, contacts, passes)
    ends = end_depths(state, wear)
    loads = end_loads(problem, state, passes, ends, contacts)
    active = np.ones(problem.shape[REALISATION], dtype=np.bool_)
    iterations = np.zeros(len(active), dtype=np.int64)
    for iteration in range(1, MAX_FIXED_POINT + 1):
        batch = contact_batch(problem, gap + wear.offset, loads, *ends)
        solved = solve_compliant(problem, batch, wear.compliance, contacts, active)
        iterations += active
        new = WearIncrement(problem, solved, passes)
        ends = end_depths(state, new)
        predicted = wear.predicted_opening(problem.values_of(solved, "line_load"))
        change, new_loads = _relative_change(new.opening, predicted), loads
        if problem.has_spring or problem.terms:
            new_loads = end_loads(problem, state, passes, ends, solved)
            change = np.maximum(change, _relative_change(new_loads, loads))
        if problem.slip_profile is not None:
            change = np.maximum(change, _relative_change(new.cylinder, wear.cylinder))
        # strips at an edge may enter and leave the contact in turn: relax the tolerance slowly
        relaxation = 10.0 ** ((iteration - 1) // RELAXATION_INTERVAL)
        active &= ~(change < problem.iteration_tolerance * relaxation)
        if not np.count_nonzero(active):
            solves = state.solves + iterations * problem.contacts_each
            begun = state.replaced(solves=solves, contacts=solved)
            return worn_state(problem, begun, passes, ends, problem.values_of(solved, "power"))
        new.estimate_exponents(wear)
        contacts, wear, loads = solved, new, new_loads
    raise StepError(
        f"an implicit step of {passes[0]:.4g} passes from pass {begin[0]:.0f} did not"
        f" converge (last relative change {change.max():.1e})",
        state.to_arrays(),
    )


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

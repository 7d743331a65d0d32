"""Implicit stepper: backward Euler method by contact solves with wear compliance."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from wearsim.contact_batch import OperatingPoints
from wearsim.errors import StepError
from wearsim.evolution.batch.per_realisation import first_of
from wearsim.evolution.error_control.error_estimates import Step
from wearsim.evolution.error_control.step_doubling import StepDoublingStepper
from wearsim.evolution.operating_points import operating_points
from wearsim.evolution.problem import WearProblem
from wearsim.evolution.state import Contacts, WearState, as_batch
from wearsim.evolution.steppers.single_step import REALISATION, end_depths, end_loads, worn_state
from wearsim.evolution.steppers.wear_increment import WearIncrement
from wearsim.plugins import SharedWear
from wearsim.types import BoolArray, FloatArray, IntArray, Number, OperatingPoint

MAX_FIXED_POINT = 60
RELAXATION_INTERVAL = 20  # iterations between relaxations of the tolerance by a factor of ten


class ImplicitStepper(StepDoublingStepper):
    """Stepper of first order that solves the contacts on the profiles at the end of each step.

    It is stable for any step length. The error of the coarse-step solution is about twice that of
    the test, so that the difference of the two is about the error of the test.
    """

    order = 1

    def scheme(self, problem: WearProblem, state: WearState) -> Step:
        """Return the implicit step."""
        return implicit_step


def _relative_change(new: FloatArray, old: FloatArray) -> FloatArray:
    """Return the greatest relative change per realisation, shape (N,), from (S, C, N, ...)."""
    axes = (0, 1, 3)[: new.ndim - 1]
    change, scale = np.abs(new - old).max(axis=axes), np.abs(new).max(axis=axes)
    scale[scale == 0.0] = np.inf
    return np.asarray(change / scale)


def implicit_step(problem: WearProblem, state: WearState, passes: Number) -> WearState:
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
    begin = state.passes_done
    problem = problem.at_time(problem.time(begin), problem.time(begin + passes))
    gap = problem.gap(state.cylinder_depth, state.roller_depth)
    contacts = state.contacts
    wear = WearIncrement(problem, contacts, passes)
    ends = end_depths(state, wear)
    loads = end_loads(problem, state, passes, ends, contacts)
    active = np.ones(problem.shape[REALISATION], dtype=np.bool_)
    iterations = np.zeros(len(active), dtype=np.int64)
    for iteration in range(1, MAX_FIXED_POINT + 1):
        points = operating_points(problem, loads, *ends)
        solved = solve_compliant(
            problem, gap + wear.offset, points, wear.compliance, contacts, active
        )
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
            solves = iterations * (len(solved) // len(active))
            begun = state.advanced_to(begin, solves, contacts=solved)
            return worn_state(problem, begun, passes, ends, problem.values_of(solved, "power"))
        new.estimate_exponents(wear)
        contacts, wear, loads = solved, new, new_loads
    raise StepError(
        f"an implicit step of {first_of(passes):.4g} passes from pass {first_of(begin):.0f} did not"
        f" converge (last relative change {change.max():.1e})",
        state.to_arrays(),
    )


def solve_compliant(
    problem: WearProblem,
    gap: FloatArray,
    points: Sequence[OperatingPoint],
    wear: SharedWear,
    warm: Contacts,
    active: BoolArray,
) -> Contacts:
    """Solve the contacts of the active realisations; the others keep their solutions.

    Parameters
    ----------
    problem : WearProblem
    gap : ndarray, shape (stations, contacts, realisations, strips)
        Gap of each contact [m].
    points : sequence of OperatingPoint
        One per contact, in the problem's order.
    wear : SharedWear
        Wear compliance with a first axis of realisations.
    warm : sequence of ContactSolution
        Solutions to start from, in the problem's order.
    active : ndarray of bool, shape (realisations,)

    Returns
    -------
    sequence of ContactSolution
        In the problem's order; those of inactive realisations are taken from `warm`.
    """
    if np.count_nonzero(active) == len(active):
        return _solve(problem, gap, points, wear, warm)
    numbers = np.flatnonzero(active)
    places = np.arange(len(points)).reshape(-1, len(active))[:, numbers].ravel()
    warm = as_batch(warm, problem.shape)
    solved = _solve(
        problem,
        np.take(gap, numbers, axis=REALISATION),
        _points_at(points, places),
        wear.at(numbers),
        warm.at(numbers),
    )
    return warm.with_others(numbers, as_batch(solved, (*problem.shape[:2], len(numbers))))


def _points_at(points: Sequence[OperatingPoint], places: IntArray) -> Sequence[OperatingPoint]:
    if isinstance(points, OperatingPoints):
        return points.at(places)
    return [points[place] for place in places]


def _solve(
    problem: WearProblem,
    gap: FloatArray,
    points: Sequence[OperatingPoint],
    wear: SharedWear,
    warm: Contacts,
) -> Contacts:
    """Solve the contacts of some realisations, in the order station, contact, realisation."""
    model, curvature = problem.model, problem.kinematics.longitudinal_curvature
    stations, contacts, realisations, strips = gap.shape
    coupled = stations * contacts
    if coupled == 1:
        return model.solve_batch(gap, curvature, points, wear.total.reshape(gap.shape), warm)
    sets = gap.reshape(coupled, realisations, strips).transpose(1, 0, 2)
    if realisations == 1:
        return model.solve_coupled_batch(sets, curvature, points, wear, warm)
    # the model expects the contacts of one realisation next to each other
    order = np.arange(len(points)).reshape(coupled, realisations).T.ravel()
    near = as_batch(warm, gap.shape[:-1]).with_axis_moved(REALISATION, 0)
    solved = model.solve_coupled_batch(sets, curvature, _points_at(points, order), wear, near)
    by_set = as_batch(solved, (realisations, stations, contacts))
    return by_set.with_axis_moved(0, REALISATION)

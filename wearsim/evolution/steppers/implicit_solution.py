"""Solution of the contacts at the end of an implicit step."""

from __future__ import annotations

from typing import Any

import numpy as np

from wearsim.contact_batch import ContactBatch, ContactBatchSolution
from wearsim.evolution.contacts import contact_batch
from wearsim.evolution.problem import WearProblem
from wearsim.evolution.state import Past, WearState, separated
from wearsim.evolution.steppers.conditions import Conditions
from wearsim.evolution.steppers.edges import FIELDS, have_groove
from wearsim.evolution.steppers.loads import (
    APPROACH_EXPONENT,
    advanced_terms,
    checked_loads,
    corrected_loads,
    fresh_approach,
    with_feedback,
)
from wearsim.evolution.steppers.single_step import (
    carried_loads,
    wear_of_contacts,
)
from wearsim.mechanics.numerics.implicit_step import (
    begin_step,
    compare_step,
    end_step,
    linearise_step,
)
from wearsim.mechanics.numerics.jit import kernel_input
from wearsim.mechanics.numerics.multistep import ROWS
from wearsim.plugins import SharedWear
from wearsim.types import BoolArray, FloatArray, IntArray

MAX_FIXED_POINT = 60
DAMPED_FROM = 10  # iterations; far fewer are usual
CONVERGED = 500.0  # change of wear over the whole depth, relative to the tolerance of iterations
# the same over the wear of the step, in partial slip: the dissipated power then depends on the line
# loads
OF_STEP = 5000.0
ADHERING = 0.1  # part of a contact that adheres from which it is in partial slip
LEAST_GUESS = 0.1  # first guess of a load over the one before; ratio of its iterates
# relative change of loads with a spring: part of that in the step, at most this over the tolerance
# of iterations
RESOLVED, LOADS_CONVERGED = 0.1, 100.0
# relative change of a load below which the exponent of the approach is round-off
MIN_LOAD_CHANGE = 1e-4
EXPONENTS = 0.3, 1.2  # bounds of the exponent of the approach as a power of the load
LOST = 1e-6  # load over that before the step, below which contact is lost
# load over that without feedback, below which a step takes off at most a known part: displacements
# of the roller are then not resolved by the depths
UNLOADED = 1e-10
RELAXATION_INTERVAL = 20  # iterations between relaxations of the tolerance by a factor of ten
MAX_LINEAR_EXPONENT = 1.0  # of dissipation as a power of line load; 1 in full sliding
MAX_EXPONENT = 50.0  # T gamma's wear law goes as the power 44 where catastrophic wear begins


def step_by_formula(
    problem: WearProblem,
    state: WearState,
    passes: FloatArray,
    conditions: Conditions,
    order: IntArray,
    near: ContactBatchSolution | None = None,
) -> tuple[WearState, BoolArray, FloatArray | None]:
    """Solve the equations of an implicit step.

    The equations are: depths = ``base + wear of worn_passes at the end``. The wear enters the
    contact problem as a compliance: it is linearised in the line load about an earlier solution.
    Exponents of the line load, loads and creepage depend on the solution and are iterated.
    Realisations that have converged are not solved again while others continue.

    Parameters
    ----------
    problem : WearProblem
        Problem with every process at its value for the step.
    state : WearState
        State at the start of the step.
    passes : ndarray, shape (realisations,)
        Length of the step.
    conditions : Conditions
    order : ndarray of int, shape (realisations,)
    near : ContactBatchSolution, optional
        Solutions from which the contact model starts, by default those at the start of the step.

    Returns
    -------
    end : WearState
        State after the step.
    decreased : ndarray of bool, shape (realisations,)
        Whether depths or energy decrease.
    unsolved : ndarray, shape (realisations,), or None
        Last relative change of the wear where the iteration did not converge, 0 where it did; None
        if it did in all tests.
    """
    past, contacts, depths = state.past, state.contacts, state.stacked
    bodies, gap = problem.body_rows, problem.contact_gap
    share, shape = problem.cylinder_wear_share, contacts.line_load.shape
    realisations, strips = passes.size, shape[1]
    # tests that resolve edges, whose depths or energy decrease, in a groove, and in progress
    resolved, decreased, in_groove, active = np.zeros((4, realisations), dtype=np.bool_)
    active[:] = True
    unsolved: FloatArray | None = None
    if past.part.size and not past.separation.size:  # strips in contact as wholes are counted
        in_groove[:] = have_groove(problem, state)
    # line loads and wear about which the wear is linearised
    line_load, wear = contacts.line_load, wear_of_contacts(problem, contacts)
    rows = np.empty((11, realisations))
    of_tests, energy, sizes = rows[:7], rows[7], rows[8:]
    rest, opening, depth = sizes
    # values of the step, and the differences after it
    of_sums = np.empty((ROWS + 1, *past.sums.shape[1:]))
    of_feedback = np.empty((ROWS + 1, *past.feedback.shape[1:]))
    sums, feedback = of_sums[0], of_feedback[0]
    work, of_each = np.empty((7, *depths.shape)), np.empty((8, *shape))
    of_bodies, worn, of_contacts, about = work[:6], work[6], of_each[:3], of_each[3:]
    compliance = np.empty((realisations, bodies.shape[0], 2, strips))
    begin_step(
        past.spans,
        order,
        passes,
        conditions.own,
        conditions.mean,
        past.wear,
        past.sums,
        past.feedback,
        depths,
        bodies,
        gap,
        kernel_input(contacts.approach),
        wear,
        share,
        past.separation,
        past.part,
        past.whole_steps,
        in_groove,
        resolved,
        of_tests,
        sums,
        feedback,
        of_bodies,
        of_contacts,
    )
    of_step = bodies, resolved, gap, depths, past.part, of_bodies, of_contacts
    base, guess = of_bodies[3], of_bodies[4]
    assert state.wear_exponents is not None
    of_strips = state.wear_exponents.copy()
    exponents = of_strips.reshape(shape)
    loads = LoadsOfStep(problem, state, conditions, passes, feedback)
    stations, iterations = problem.shape[0], np.zeros(realisations, dtype=np.int64)
    places: IntArray | None = None  # of the tests in progress, None for all
    most = MAX_LINEAR_EXPONENT if problem.linear_wear else MAX_EXPONENT
    for iteration in range(1, MAX_FIXED_POINT + 1):
        linearise_step(*of_step, line_load, wear, exponents, active, about, compliance)
        worn_depths = guess[:stations, None], guess[None, stations:]
        batch = contact_batch(problem, about[2], loads.used, *worn_depths)
        warm = contacts if near is None or iteration > 1 else near
        solved = solve_compliant(problem, batch, compliance, warm, places)
        iterations[active] = iteration
        new, apart = wear_of_contacts(problem, solved), solved.separation
        apart = (
            past.separation if apart is None or not past.separation.size else kernel_input(apart)
        )
        compare_step(
            *of_step,
            line_load,
            wear,
            exponents,
            about,
            compliance,
            solved.line_load,
            apart,
            new,
            of_tests[0],
            most,
            active,
            worn,
            sizes,
        )
        used, guess, change = guess, base + worn, rest
        # strips at an edge may enter and leave the contact in turn: relax the tolerance slowly
        relaxation = 10.0 ** ((iteration - 1) // RELAXATION_INTERVAL)
        if loads.vary:
            change = loads.moved(solved, active, change, opening, base, relaxation)
        if problem.slip_profile is not None:
            change = np.maximum(change, opening * (np.abs(guess - used).max(axis=(0, 2)) / depth))
        converged = problem.iteration_tolerance * relaxation
        most_change = CONVERGED * depth
        if np.maximum.reduce(solved.adhesion_fraction) > ADHERING:
            adhesion = solved.adhesion_fraction.reshape(problem.shape).max(axis=(0, 1))
            of_partial_slip = np.where(adhesion > ADHERING, OF_STEP * opening, np.inf)
            most_change = np.minimum(most_change, of_partial_slip)
        active &= ~(change <= converged * most_change)
        contacts = solved
        if iteration in {RELAXATION_INTERVAL, MAX_FIXED_POINT}:
            # with a relaxed tolerance a step without wear might pass where strips are cut
            stopped = active if iteration == MAX_FIXED_POINT else active & resolved
            if stopped.any():
                last = np.zeros(realisations) if unsolved is None else unsolved
                np.divide(change, depth, out=last, where=stopped)
                unsolved = np.nan_to_num(last, nan=np.inf, posinf=np.inf)
                active &= ~stopped
        places = active.nonzero()[0]
        if not places.size:
            break
        loads.used = loads.target
        if iteration < DAMPED_FROM:
            line_load, wear = solved.line_load, new
        else:  # strips at an edge enter and leave the contact in turn
            line_load, wear = 0.5 * (line_load + solved.line_load), 0.5 * (wear + new)
    of_depths = np.empty((ROWS + 1, *depths.shape))
    ends, past_wear = of_depths[0], of_depths[1:]
    fields = np.empty((3, *past.part.shape) if past.part.size else (0, 0, 0))
    spans, past_sums, past_feedback = of_tests[2:], of_sums[1:], of_feedback[1:]
    end_step(
        *of_step,
        past.separation,
        past.whole_steps,
        share,
        contacts.line_load,
        new,
        worn,
        of_tests,
        sums,
        loads.feedback if loads.vary else feedback,
        kernel_input(contacts.power),
        problem.power_weights / problem.kinematics.pass_rate,
        past.wear,
        past.sums,
        past.feedback,
        energy,
        ends,
        fields,
        past_wear,
        past_sums,
        past_feedback,
        decreased,
    )
    by_contact, edges = (*problem.shape, strips), past[4:]
    others: dict[str, Any] = {}
    if past.part.size:
        edges = (*fields,)
        others = dict(zip(FIELDS, fields.reshape(-1, *by_contact), strict=False))
        if not past.separation.size:
            edges, others["separation"] = (past.separation, *edges[1:]), None
    if loads.vary:
        others["past_feedback"] = past_feedback.reshape(ROWS, *problem.shape)
        others["terms"] = loads.terms(contacts)
    end = state.with_stacked(
        ends,
        Past(past_wear, past_sums, past_feedback, spans, *edges),
        contacts=contacts,
        solves=state.solves + iterations * problem.contacts_each,
        wear_exponents=of_strips,
        passes=state.passes + passes,
        energy=state.energy + energy,
        past_wear=past_wear,
        past_sums=past_sums[..., 0],
        past_spans=spans,
        order=order,
        **others,
    )
    return end, decreased, unsolved


class LoadsOfStep:
    """Loads of the contacts at the end of an implicit step.

    Parameters
    ----------
    problem, start, conditions, passes
        As of `step_by_formula`.
    feedback : ndarray, shape (rows, realisations, 1)
        Predicted part of the loads due to springs and load terms, without rows if there are none
        [N].

    Attributes
    ----------
    used, target : ndarray, shape (stations, contacts, realisations)
        Loads of the last solution, and loads closer to equilibrium [N].
    vary : bool
        Whether the loads depend on the solution.
    """

    def __init__(
        self,
        problem: WearProblem,
        start: WearState,
        conditions: Conditions,
        passes: FloatArray,
        feedback: FloatArray,
    ) -> None:
        self._problem, self._start, self._passes = problem, start, passes
        self._force, self._prescribed = conditions.force, conditions.prescribed
        self.used, self.vary = checked_loads(start, self._prescribed), feedback.size > 0
        self._shape = feedback.shape
        if self.vary:
            self._before = carried_loads(problem, start.contacts)
            self._exponent = np.full(self.used.shape, APPROACH_EXPONENT)
            self._last: tuple[FloatArray, FloatArray] | None = None
            least = LEAST_GUESS * np.minimum(self._prescribed, self._before)
            self.used = np.maximum(self._prescribed + feedback.reshape(problem.shape), least)
        self.target = self.used

    @property
    def feedback(self) -> FloatArray:
        """Part of the loads due to springs and load terms, (rows, realisations, 1) [N]."""
        return (self.target - self._prescribed).reshape(self._shape)

    def moved(
        self,
        solved: ContactBatchSolution,
        active: BoolArray,
        change: FloatArray,
        opening: FloatArray,
        base: FloatArray,
        relaxation: float,
    ) -> FloatArray:
        """Move `target` towards equilibrium with a solution, and return the change with it.

        Parameters
        ----------
        solved : ContactBatchSolution
        active : ndarray of bool, shape (realisations,)
            Realisations whose loads move: those that have converged do not depend on the others.
        change, opening : ndarray, shape (realisations,)
            Change of the wear, and the wear of both bodies of a contact, at most [m].
        base : ndarray
            As of `step_by_formula` [m].
        relaxation : float
            Factor on tolerances.
        """
        problem = self._problem
        self.target = np.where(active, self._equilibrium(solved, base), self.target)
        moved = np.abs(self.target / self.used - 1.0).max(axis=(0, 1))
        change = np.maximum(change, opening * moved)
        if problem.has_spring:
            # later loads follow this one, also where the wear of the step is small
            least, most = problem.iteration_tolerance * np.array([1.0, LOADS_CONVERGED])
            part = RESOLVED * np.abs(self.target / self._before - 1.0).max(axis=(0, 1))
            change[moved > np.clip(part, least, most) * relaxation] = np.inf
        return change

    def _equilibrium(self, solved: ContactBatchSolution, base: FloatArray) -> FloatArray:
        """Return loads closer to equilibrium than those of a solution, shape (S, C, N) [N]."""
        problem, displacement, approach = self._problem, np.zeros(()), np.zeros(())
        loads, before = self.used, self._before
        if problem.has_spring:
            # worn descent less the recovery of the elastic approach
            approach = problem.values_of(solved, "approach")
            fresh = fresh_approach(problem, self._start, self._force)
            displacement = approach - problem.nominal_least_gap - fresh
        target = with_feedback(problem, self._force, displacement, self.terms(solved))
        if not problem.has_spring:
            return np.maximum(target, LEAST_GUESS * loads)
        pressed = approach - problem.gap(*separated(base, problem.shape[0])).min(axis=-1)
        target = corrected_loads(problem, loads, target, pressed, self._slope(loads, pressed))
        unloaded = before < UNLOADED * self._prescribed
        target = np.maximum(target, np.where(unloaded, LEAST_GUESS * before, -np.inf))
        if not (target > 0.0).all():
            checked_loads(self._start, np.where(loads < LOST * before, target, 1.0))
        return np.maximum(target, LEAST_GUESS * loads)

    def _slope(self, loads: FloatArray, approach: FloatArray) -> FloatArray:
        """Return the exponent of the approach [m] as a power of the load [N], from two iterates."""
        if self._last is not None:
            rise = np.log(loads / self._last[0])
            usable = (np.abs(rise) > MIN_LOAD_CHANGE) & (approach > 0.0) & (self._last[1] > 0.0)
            ratio = np.divide(approach, self._last[1], out=np.ones_like(loads), where=usable)
            slope = np.log(ratio) / np.where(usable, rise, 1.0)
            self._exponent = np.where(usable, np.clip(slope, *EXPONENTS), self._exponent)
        self._last = loads, approach
        return self._exponent

    def terms(self, solved: ContactBatchSolution) -> FloatArray:
        """Return the load terms at the end of the step, shape (terms, rollers, realisations).

        They advance with the mean of the powers at its start and end.
        """
        problem, start = self._problem, self._start
        if not problem.terms:
            return start.terms
        powers = [
            problem.mean_over_turn(problem.per_roller(problem.values_of(contacts, "power")))[0]
            for contacts in (start.contacts, solved)
        ]
        power = 0.5 * (powers[0] + powers[1])
        return advanced_terms(problem, start, start.passes + self._passes, power)


def solve_compliant(
    problem: WearProblem,
    batch: ContactBatch,
    compliance: FloatArray,
    warm: ContactBatchSolution,
    places: IntArray | None,
) -> ContactBatchSolution:
    """Solve the contacts of some realisations; the others keep their solutions.

    Parameters
    ----------
    problem : WearProblem
    batch : ContactBatch
        The contacts, in the problem's order.
    compliance : ndarray, shape (realisations, contacts each, 2, strips)
        Wear compliance, as of `SharedWear`.
    warm : ContactBatchSolution
        Solutions to start from, in the problem's order.
    places : ndarray of int, optional
        Realisations to solve, by default all.

    Returns
    -------
    ContactBatchSolution
        In the problem's order; those of other realisations are taken from `warm`.
    """
    model, realisations, coupled = problem.model, len(compliance), problem.contacts_each
    every = places is None or places.size == realisations
    if every and coupled == 1:
        both = np.add.reduce(compliance, axis=2)
        return model.solve(batch, both.reshape(batch.gap.shape), None, warm)
    if every and realisations == 1:
        return model.solve(batch, None, SharedWear(problem.bodies, compliance), warm)
    numbers = np.arange(realisations) if places is None else places
    # the contacts of one realisation next to each other, which the problem has `realisations` apart
    order = np.arange(len(batch)).reshape(coupled, realisations)[:, numbers].T.ravel()
    some, near, part = batch.at(order), warm.at(order), compliance[numbers]
    if coupled == 1:
        solved = model.solve(some, part.sum(axis=2).reshape(some.gap.shape), None, near)
    else:
        solved = model.solve(some, None, SharedWear(problem.bodies, part), near)
    return warm.with_others(order, solved)

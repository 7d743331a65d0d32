"""Solution of the contacts at the end of an implicit step."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from wearsim.contact_batch import ContactBatch, ContactBatchSolution
from wearsim.errors import StepError
from wearsim.evolution.contacts import contact_batch
from wearsim.evolution.problem import WearProblem
from wearsim.evolution.state import WearState, separated
from wearsim.evolution.steppers.edges import edges_of_step
from wearsim.evolution.steppers.loads import (
    APPROACH_EXPONENT,
    advanced_terms,
    checked_loads,
    corrected_loads,
    fresh_approach,
    with_feedback,
)
from wearsim.evolution.steppers.single_step import REALISATION, carried_loads
from wearsim.mechanics.numerics.edge_strips import (
    EdgeStrips,
    compare_edges,
    end_edges,
    linearise_edges,
)
from wearsim.mechanics.numerics.jit import kernel_input
from wearsim.mechanics.numerics.linearised_wear import linearised_wear, wear_of_bodies
from wearsim.plugins import SharedWear
from wearsim.types import BoolArray, FloatArray

MAX_FIXED_POINT = 60
DAMPED_FROM = 10  # iterations; far fewer are usual
CONVERGED = 500.0  # change of wear over the whole depth, relative to the tolerance of iterations
# the same over the wear of the step, from this part of a contact that adheres on: the dissipated
# power then depends on the line loads
OF_STEP, ADHERING = 5000.0, 0.1
OF_EDGES = 10.0  # the same of strips partly in contact, over that of the others
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


class _Slope:
    """Exponent of the approach of each contact as a power of its load, from two iterates.

    Parameters
    ----------
    shape : tuple of int
        Shape of the loads: stations, contacts, realisations.
    """

    def __init__(self, shape: tuple[int, ...]) -> None:
        self._exponent = np.full(shape, APPROACH_EXPONENT)
        self._last: tuple[FloatArray, FloatArray] | None = None

    def exponent(self, loads: FloatArray, approach: FloatArray) -> FloatArray:
        """Return the exponent for an iterate with these loads [N] and approaches [m]."""
        if self._last is not None:
            rise = np.log(loads / self._last[0])
            usable = (np.abs(rise) > MIN_LOAD_CHANGE) & (approach > 0.0) & (self._last[1] > 0.0)
            ratio = np.divide(approach, self._last[1], out=np.ones_like(loads), where=usable)
            found = np.log(ratio) / np.where(usable, rise, 1.0)
            self._exponent = np.where(usable, np.clip(found, *EXPONENTS), self._exponent)
        self._last = loads, approach
        return self._exponent


class Solved(NamedTuple):
    """Solution of an implicit step.

    Parameters
    ----------
    end : WearState
        Depths, contacts, load terms and number of solves at the end.
    worn : ndarray, shape (stations + rollers, realisations, strips)
        Wear of the bodies by the formula [m].
    feedback : ndarray, shape (stations, contacts, realisations), optional
        Part of the loads due to springs and load terms, in equilibrium with them [N].
    parts : ndarray, shape (stations + rollers, realisations, strips), optional
        Part of each strip that is in contact, where edges are resolved within a strip.
    """

    end: WearState
    worn: FloatArray
    feedback: FloatArray | None
    parts: FloatArray | None


@dataclass(frozen=True)
class EndOfStep:
    """Equations of an implicit step: depths ``base + wear of worn_passes at the end``.

    Parameters
    ----------
    problem : WearProblem
        Problem with every process at its value for the step.
    start : WearState
        State at the start of the step.
    base, added : ndarray, shape (stations + rollers, realisations, strips)
        Depths without the wear at the end, and what they exceed those of the start by [m].
    force : ndarray, shape (realisations,) or (stations, 1, realisations)
        Load before feedback [N].
    passes : ndarray, shape (realisations,)
        Length of the step.
    worn_passes : ndarray, shape (realisations,)
        Passes of the wear at the end.
    scale : ndarray, shape as `base`, optional
        What they are multiplied by in strips that follow the formula of first order.
    """

    problem: WearProblem
    start: WearState
    base: FloatArray
    added: FloatArray
    force: FloatArray
    passes: FloatArray
    worn_passes: FloatArray
    scale: FloatArray | None = None

    def solved(self, guess: FloatArray, feedback: FloatArray | None) -> Solved:
        """Solve contacts, wear and loads together.

        The wear enters the contact problem as a compliance: it is linearised in the line load about
        an earlier solution. Exponents of the line load, loads and creepage depend on the solution
        and are iterated. Realisations that have converged are not solved again while others
        continue.

        Parameters
        ----------
        guess : ndarray
            Predicted depths, shape as `base` [m].
        feedback : ndarray, shape (stations, contacts, realisations), optional
            Predicted part of the loads due to springs and load terms, where there are any [N].

        Returns
        -------
        Solved

        Raises
        ------
        StepError
            If the iteration does not converge.
        """
        problem, start = self.problem, self.start
        prescribed = with_feedback(problem, self.force, np.zeros(()), ())
        loads = checked_loads(start, prescribed)
        if feedback is not None:
            before, slope = carried_loads(problem, start.contacts), _Slope(loads.shape)
            loads = np.maximum(prescribed + feedback, LEAST_GUESS * np.minimum(prescribed, before))
        target = loads
        stations, depths, contacts = problem.shape[0], guess, start.contacts
        edges = edges_of_step(problem, start, self.base, self.added)
        gap = problem.gap(*separated(self.base, stations))
        level = guess[problem.body_rows].sum(axis=1).reshape(-1, problem.grid.strips)
        # line loads and wear about which the wear is linearised
        line_load, wear = contacts.line_load, self._parts(contacts)
        shape = line_load.shape
        exponents = np.asarray(start.wear_exponents).reshape(shape)
        active = np.ones(problem.shape[REALISATION], dtype=np.bool_)
        iterations = np.zeros(len(active), dtype=np.int64)
        gaps, slopes, linear = gap.reshape(shape).copy(), np.ones(shape), np.empty(shape)
        worn = np.empty_like(self.base)
        # with a relaxed tolerance a step without wear might pass where strips are cut
        tries = MAX_FIXED_POINT if edges is None else RELAXATION_INTERVAL
        for iteration in range(1, tries + 1):
            if edges is not None:
                linearise_edges(edges, level, wear, gaps, slopes)
            opened = np.empty(shape)
            compliance = np.empty((len(active), len(problem.bodies), 2, shape[1]))
            constant = linearised_wear(
                line_load,
                wear,
                exponents,
                slopes,
                problem.body_rows,
                gaps,
                compliance,
                opened,
            )
            batch = contact_batch(problem, opened, loads, *separated(depths, stations))
            shared = SharedWear(problem.bodies, compliance)
            solved = solve_compliant(problem, batch, shared, contacts, active)
            iterations += active
            new, known, exponents = self._parts(solved), exponents, exponents.copy()
            rest, opening, depth = wear_of_bodies(
                solved.line_load,
                line_load,
                new,
                wear,
                compliance,
                constant,
                problem.body_rows,
                self.base,
                MAX_LINEAR_EXPONENT if problem.linear_wear else MAX_EXPONENT,
                slopes,
                exponents,
                worn,
                linear,
            )
            if edges is not None:
                assert solved.separation is not None
                apart, load = kernel_input(solved.separation), kernel_input(solved.line_load)
                of_edges = compare_edges(
                    edges, active, gaps, slopes, linear, apart, load, new, level
                )
                rest = np.maximum(rest, of_edges / OF_EDGES)
            if np.count_nonzero(active) < len(active):  # of realisations that have converged
                each = exponents.reshape(-1, len(active), shape[1])
                each[:, ~active] = known.reshape(each.shape)[:, ~active]
            used, depths, change = depths, self.base + worn, rest
            # strips at an edge may enter and leave the contact in turn: relax the tolerance slowly
            relaxation = 10.0 ** ((iteration - 1) // RELAXATION_INTERVAL)
            if feedback is not None:
                # loads of realisations that have converged must not depend on the others
                found = self._equilibrium(solved, loads, before, gap, slope)
                target = np.where(active, found, target)
                moved = np.abs(target / loads - 1.0).max(axis=(0, 1))
                change = np.maximum(change, opening * moved)
                if problem.has_spring:
                    # later loads follow this one, also where the wear of the step is small
                    least, most = problem.iteration_tolerance * np.array([1.0, LOADS_CONVERGED])
                    part = RESOLVED * np.abs(target / before - 1.0).max(axis=(0, 1))
                    change[moved > np.clip(part, least, most) * relaxation] = np.inf
            if problem.slip_profile is not None:
                moved = np.abs(depths - used).max(axis=(0, 2))
                change = np.maximum(change, opening * (moved / depth))
            converged = problem.iteration_tolerance * relaxation
            adhering = problem.values_of(solved, "adhesion_fraction").max(axis=(0, 1)) > ADHERING
            of_step = np.where(adhering, OF_STEP * opening, np.inf)
            active &= ~(change <= converged * np.minimum(CONVERGED * depth, of_step))
            if not np.count_nonzero(active):
                parts = None
                if edges is not None:
                    depths, parts, edge_state = self._ended(edges, level, solved, new, worn)
                cylinder, roller = separated(depths, stations)
                end = start.replaced(
                    cylinder_depth=cylinder,
                    roller_depth=roller,
                    **({} if edges is None else edge_state),
                    solves=start.solves + iterations * problem.contacts_each,
                    contacts=solved,
                    terms=self._terms(solved),
                    wear_exponents=exponents.reshape(*problem.shape, -1),
                )
                feedback = None if feedback is None else target - prescribed
                return Solved(end, worn, feedback, parts)
            contacts, loads = solved, target
            if iteration < DAMPED_FROM:
                line_load, wear = solved.line_load, new
            else:  # strips at an edge enter and leave the contact in turn
                line_load, wear = 0.5 * (line_load + solved.line_load), 0.5 * (wear + new)
        raise StepError(
            f"an implicit step of {self.passes[0]:.4g} passes from pass {start.passes[0]:.0f} did"
            f" not converge (last relative change {(change / depth).max():.1e})",
            start.to_arrays(),
        )

    def _ended(
        self,
        edges: EdgeStrips,
        level: FloatArray,
        solved: ContactBatchSolution,
        wear: FloatArray,
        worn: FloatArray,
    ) -> tuple[FloatArray, FloatArray, dict[str, FloatArray]]:
        """Return depths, `Solved.parts`, and fields of the state at the end of the step."""
        depths, parts = np.empty_like(worn), np.empty_like(worn)
        ended = np.empty((3, *level.shape))
        end_edges(edges, level, solved.line_load, wear, worn, depths, parts, ended)
        separation, part, whole_steps = ended.reshape(3, *self.problem.shape, -1)
        fields = {"separation": separation, "part": part, "whole_steps": whole_steps}
        return depths, parts, fields

    def _parts(self, contacts: ContactBatchSolution) -> FloatArray:
        """Return the contributions of the contacts to the wear, shape (2, contacts, strips) [m]."""
        parts = self.problem.wear_parts(contacts, self.worn_passes)
        parts = parts.reshape(2, *contacts.line_load.shape)
        if self.scale is None:
            return parts
        rows = self.problem.body_rows.T
        return np.asarray(parts * self.scale[rows].reshape(parts.shape))

    def _equilibrium(
        self,
        solved: ContactBatchSolution,
        loads: FloatArray,
        before: FloatArray,
        gap: FloatArray,
        slope: _Slope,
    ) -> FloatArray:
        """Return loads closer to equilibrium than those of a solution, shape (S, C, N) [N].

        `before` are the loads before the step.
        """
        problem, displacement, approach = self.problem, np.zeros(()), np.zeros(())
        if problem.has_spring:
            # worn descent less the recovery of the elastic approach
            approach = problem.values_of(solved, "approach")
            fresh = fresh_approach(problem, self.start, self.force)
            displacement = approach - problem.nominal_least_gap - fresh
        target = with_feedback(problem, self.force, displacement, self._terms(solved))
        if not problem.has_spring:
            return np.maximum(target, LEAST_GUESS * loads)
        pressed = approach - gap.min(axis=-1)
        exponent = slope.exponent(loads, pressed)
        target = corrected_loads(problem, loads, target, pressed, exponent)
        unloaded = before < UNLOADED * with_feedback(problem, self.force, np.zeros(()), ())
        target = np.maximum(target, np.where(unloaded, LEAST_GUESS * before, -np.inf))
        if not (target > 0.0).all():
            checked_loads(self.start, np.where(loads < LOST * before, target, 1.0))
        return np.maximum(target, LEAST_GUESS * loads)

    def _terms(self, solved: ContactBatchSolution) -> FloatArray:
        """Return the load terms at the end of the step, shape (terms, rollers, realisations).

        They advance with the mean of the powers at its start and end.
        """
        problem, start = self.problem, self.start
        if not problem.terms:
            return start.terms
        powers = [
            problem.mean_over_turn(problem.per_roller(problem.values_of(contacts, "power")))[0]
            for contacts in (start.contacts, solved)
        ]
        power = 0.5 * (powers[0] + powers[1])
        return advanced_terms(problem, start, start.passes + self.passes, power)


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

"""Wear of the bodies in one step, and loads, contacts and explicit step."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import cached_property

import numpy as np

from wearsim.contact_batch import ContactBatchSolution
from wearsim.errors import StepError
from wearsim.evolution.problem import WearProblem
from wearsim.evolution.quantities import values_between
from wearsim.evolution.state import LEAST_LOAD, Depths, WearState, contact_batch
from wearsim.mechanics.numerics.wear_exponent import estimate_exponents, ratio_to_load
from wearsim.plugins import SharedWear
from wearsim.types import FloatArray

MAX_LINEAR_EXPONENT = 1.0  # of dissipation as a power of line load; 1 in full sliding
MAX_EXPONENT = 50.0  # T gamma's wear law goes as the power 44 where catastrophic wear begins


class WearIncrement:
    """Depth worn off the bodies in a step of `passes` passes with given contacts.

    The wear u of each strip is linearised about the contact's line load q_0:
    u = (1 - e) u_0 + e (u_0/q_0) q, with the exponent e of u ~ q^e. The second term is a
    compliance, the first an offset independent of the line load.

    Parameters
    ----------
    problem : WearProblem
    contacts : ContactBatchSolution
    passes : float or ndarray, shape (realisations,)
        Length of the step.

    Attributes
    ----------
    depths : tuple of ndarray
        Depths of cylinder and rollers worn in the step, shapes as in `WearState` [m].
    cylinder, roller : ndarray
        The two depths.
    exponents : ndarray, shape (stations, contacts, realisations, strips), optional
        Exponent e of every strip, to be set before the first use of compliance or offset. If
        absent it is 1, which is exact in full sliding.
    """

    def __init__(
        self, problem: WearProblem, contacts: ContactBatchSolution, passes: FloatArray | float
    ) -> None:
        self._parts = problem.wear_parts(contacts, passes)
        self.depths = problem.sum_of_parts(*self._parts)
        self.cylinder, self.roller = self.depths
        self.exponents: FloatArray | None = None
        self.problem, self.contacts = problem, contacts

    @cached_property
    def compliance(self) -> SharedWear:
        """Wear compliance of the step, per realisation; contacts in the problem's order."""
        parts = self._parts
        if self.exponents is not None:
            parts = self.exponents * parts[0], self.exponents * parts[1]
        stations, contacts, realisations = self.problem.shape
        shape = realisations, stations * contacts, self.problem.grid.strips
        compliance = np.zeros((*shape[:2], 2, shape[2]))
        line_load = self.contacts.line_load
        for side, part in enumerate(parts):
            if np.count_nonzero(part):
                wear = np.ascontiguousarray(part).reshape(line_load.shape)
                ratio = ratio_to_load(wear, line_load).reshape(part.shape)
                compliance[:, :, side] = ratio.transpose(2, 0, 1, 3).reshape(shape)
        return SharedWear(self.problem.bodies, compliance)

    @cached_property
    def offset(self) -> FloatArray | float:
        """Opening independent of the line load, (stations, contacts, realisations, strips) [m]."""
        if self.exponents is None:
            return 0.0
        constant = 1.0 - self.exponents
        cylinder, roller = self.problem.sum_of_parts(*(constant * part for part in self._parts))
        return cylinder + self.problem.at_contacts(roller)

    @property
    def opening(self) -> FloatArray:
        """Gap that the step opens, shape (stations, contacts, realisations, strips) [m]."""
        return self.cylinder + self.problem.at_contacts(self.roller)

    def predicted_opening(self, line_load: FloatArray) -> FloatArray:
        """Return the opening of the linearised wear at a line load, shape as `opening` [m]."""
        stations, contacts, realisations, strips = line_load.shape
        flat = line_load.transpose(2, 0, 1, 3).reshape(realisations, -1, strips)
        opening = self.compliance.opening(flat)
        opening = opening.reshape(realisations, stations, contacts, strips).transpose(1, 2, 0, 3)
        return opening if self.exponents is None else opening + self.offset

    def estimate_exponents(self, old: WearIncrement) -> None:
        """Set the exponents from the changes of wear and line load since another increment.

        Strips without a change keep the exponent of the other increment, or 1.

        Parameters
        ----------
        old : WearIncrement
            Wear of another solution of the same contacts.
        """
        problem = self.problem
        shape = (*problem.shape, problem.grid.strips)
        self.exponents = np.ones(shape) if old.exponents is None else old.exponents.copy()
        load, new_load = old.contacts.line_load, self.contacts.line_load
        linear = problem.wear_factors["cylinder"] is not None
        estimate_exponents(
            load,
            new_load,
            (old._parts[0] + old._parts[1]).reshape(load.shape),
            (self._parts[0] + self._parts[1]).reshape(load.shape),
            MAX_LINEAR_EXPONENT if linear else MAX_EXPONENT,
            self.exponents.reshape(load.shape),
        )


REALISATION = 2  # axis of the realisations
SAME_LOAD = 1e-9  # relative change of a load below which a contact is not solved again


def mean_loads(
    problem: WearProblem,
    state: WearState,
    passes: FloatArray,
    depths: Sequence[Depths],
    contacts: ContactBatchSolution,
) -> FloatArray:
    """Return the mean load of each contact over a step, shape (S, C, N) [N].

    Processes are at their means over the step in `problem`. The load before feedback is integrated
    exactly. The spring takes the mean of the descents at the worn depths `depths`, usually those at
    the ends of the step, and each load term its exact mean at the constant power of `contacts`.
    """
    start, stop = problem.time(state.passes), problem.time(state.passes + passes)
    terms = []
    if problem.terms:
        power = problem.per_roller(problem.values_of(contacts, "power"))
        mean_power, duration = power.mean(axis=0), float((stop - start)[0])
        each = zip(problem.terms.values(), state.terms, strict=True)
        terms = [term.mean_force(value, mean_power, duration) for term, value in each]
    force = values_between([load.mean for load in problem.loads], start, stop)
    return _with_feedback(problem, state, force, depths, terms)


def _with_feedback(
    problem: WearProblem,
    state: WearState,
    force: FloatArray,
    depths: Sequence[Depths],
    terms: Iterable[FloatArray],
) -> FloatArray:
    """Return the loads for a load `force` before feedback; raise StepError unless positive."""
    loads = np.empty(problem.shape)
    loads[:] = force + problem.inputs.normal_force_offset
    if problem.has_spring:
        # the rise of the least gap, by which rigid bodies would approach; the depth on one track
        unworn = problem.nominal_gap.min(axis=-1)
        descents = [problem.gap(*worn).min(axis=-1) - unworn for worn in depths]
        loads -= problem.stiffness * np.mean(descents, axis=0)
    for term in terms:
        loads += term[problem.roller]
    if problem.pauses:
        # a spring that has descended lifts the roller while the load rises from a pause
        loads = np.maximum(loads, LEAST_LOAD * problem.greatest_load)
    if np.count_nonzero(loads > 0.0) < loads.size:
        raise StepError(
            f"contact is lost at pass {state.passes[0]:.0f}: the load has fallen to"
            f" {loads.min():.4g} N; the spring has run out of travel, or the recorded load or a"
            " random input falls to zero",
            {"normal_force": loads, "passes": state.passes},
        )
    return loads


def explicit_step(problem: WearProblem, state: WearState, passes: FloatArray) -> WearState:
    """Step over `passes` passes on the profiles of the step's start, under its mean load."""
    here = problem.at_time(problem.time(state.passes), problem.time(state.passes + passes))
    predicted = state.with_added(WearIncrement(here, state.contacts, passes).depths)
    mean = mean_loads(here, state, passes, (state.depths, predicted.depths), state.contacts)
    solve = solve_present if problem.varying else contacts_at
    contacts = solve(here, state, mean)
    solves = problem.contacts_each * (1 if contacts is state.contacts else 2)
    begun = state.replaced(contacts=contacts, solves=state.solves + solves)
    ends = begun.with_added(WearIncrement(here, contacts, passes).depths)
    worn = worn_state(here, ends, passes, here.values_of(contacts, "power"))
    return worn.replaced(contacts=solve_present(problem, worn, present_loads(problem, worn)))


def present_problem(problem: WearProblem, state: WearState) -> WearProblem:
    """Return the problem with every process at its value at the time of the state."""
    now = problem.time(state.passes)
    return problem.at_time(now, now)


def present_loads(problem: WearProblem, state: WearState) -> FloatArray:
    """Return the load of each contact at the time of the state, shape (S, C, N) [N]."""
    problem = present_problem(problem, state)
    force = problem.force(problem.time(state.passes))
    return _with_feedback(problem, state, force, [state.depths], state.terms)


def contacts_at(problem: WearProblem, state: WearState, loads: FloatArray) -> ContactBatchSolution:
    """Return the contacts on the present profiles under `loads`, shape (S, C, N) [N].

    A step over many passes leaves them solved on the profile at its end; contacts that carry
    these loads already are not solved again.
    """
    if problem.varying:
        return solve_present(problem, state, loads)
    carried = carried_loads(problem, state.contacts)
    difference = np.abs(carried - loads).max(axis=(0, 1))
    others = np.flatnonzero(difference > SAME_LOAD * loads.max(axis=(0, 1)))
    if not others.size:
        return state.contacts
    if others.size == loads.shape[REALISATION]:
        return solve_present(problem, state, loads)
    chosen, part = problem.at(others), state.at(others)
    solved = solve_present(chosen, part, np.take(loads, others, axis=REALISATION))
    return state.contacts.with_others(state.contacts_of(others), solved)


def carried_loads(problem: WearProblem, contacts: ContactBatchSolution) -> FloatArray:
    """Return the integral of the line load of each contact, shape (S, C, N) [N]."""
    return np.asarray(problem.values_of(contacts, "line_load").sum(axis=-1) * problem.grid.spacing)


def elastic_approach(problem: WearProblem, state: WearState) -> FloatArray:
    """Return the least elastic approach of the contacts, shape (realisations,) [m]."""
    least_gap = problem.gap(*state.depths).min(axis=-1)
    approach = problem.values_of(state.contacts, "approach") - least_gap
    return np.asarray(approach.min(axis=(0, 1)))


def solve_present(
    problem: WearProblem, state: WearState, loads: FloatArray, cold: bool = False
) -> ContactBatchSolution:
    """Solve every contact on the present profiles under `loads`, shape (S, C, N) [N].

    The solver starts from the contacts of the state unless `cold`.
    """
    problem = present_problem(problem, state)
    batch = contact_batch(problem, problem.gap(*state.depths), loads, *state.depths)
    return problem.model.solve(batch, warm=None if cold else state.contacts)


def worn_state(
    problem: WearProblem,
    state: WearState,
    passes: FloatArray,
    power: FloatArray,
) -> WearState:
    """Return the state at the end of a step.

    Parameters
    ----------
    problem : WearProblem
    state : WearState
        State at the step's start, with the contacts and worn depths that the state returned keeps.
    passes : ndarray, shape (realisations,)
        Length of the step.
    power : ndarray, shape (stations, contacts, realisations)
        Mean dissipated power of the step [W], of the same dissipation as the wear.
    """
    terms, begin = state.terms, state.passes
    if problem.terms:
        duration = float((problem.time(begin + passes) - problem.time(begin))[0])
        mean = problem.per_roller(power).mean(axis=0)
        each = zip(problem.terms.values(), terms, strict=True)
        terms = np.array([term.advance(value, mean, duration) for term, value in each])
    return state.replaced(
        passes=begin + passes,
        terms=terms,
        energy=state.energy + problem.total_power(power) * (passes / problem.kinematics.pass_rate),
    )

"""Wear of the bodies in one step, and loads, contacts and explicit step."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property, partial

import numpy as np

from wearsim.contact_batch import ContactBatchSolution
from wearsim.errors import StepError
from wearsim.evolution.problem import WearProblem
from wearsim.evolution.state import WearState, contact_batch
from wearsim.evolution.steppers.loads import (
    checked_loads,
    corrected_loads,
    displacement_at,
    elastic_approaches,
    fresh_approach,
    mean_loads,
    with_feedback,
)
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
MAX_LOAD_ITERATIONS = 40


def solve_loaded(
    problem: WearProblem,
    state: WearState,
    loads_at: Callable[[FloatArray], FloatArray],
    fresh: FloatArray,
    elastic: FloatArray | None,
    solve: Callable[[WearProblem, WearState, FloatArray], ContactBatchSolution],
) -> tuple[ContactBatchSolution, FloatArray, int]:
    """Solve every contact on the present profiles together with its load.

    A load with a spring depends on the elastic approach of the contact that it causes.

    Parameters
    ----------
    problem : WearProblem
        Problem with every process at the value for the solution.
    state : WearState
        Profiles, and contacts for the solver to start from.
    loads_at : callable
        Function from the displacement of the rollers [m] to the loads [N], (S, C, N) both.
    fresh : ndarray, shape (stations, contacts, realisations)
        Elastic approach of unworn bodies under the load before feedback, see `fresh_approach` [m].
    elastic : ndarray, shape (stations, contacts, realisations), optional
        First guess of the elastic approach, by default `fresh` [m].
    solve : callable
        Solves the contacts of a state the first time, `solve_present` or `contacts_at`.

    Returns
    -------
    contacts : ContactBatchSolution
    loads : ndarray, shape (stations, contacts, realisations)
    solves : int
        Number of solutions of all contacts.

    Raises
    ------
    StepError
        If a load is not positive, or the iteration does not converge.
    """
    first = fresh if elastic is None else elastic
    loads = loads_at(displacement_at(problem, [state.depths], fresh - first))
    contacts = solve(problem, state, checked_loads(state, loads))
    solves = int(contacts is not state.contacts)
    if not problem.has_spring:
        return contacts, loads, solves
    for _ in range(MAX_LOAD_ITERATIONS):
        state = state.replaced(contacts=contacts)
        elastic = elastic_approaches(problem, state)
        target = loads_at(displacement_at(problem, [state.depths], fresh - elastic))
        open_ = np.abs(target - loads) > problem.iteration_tolerance * loads
        if not np.count_nonzero(open_):
            return contacts, loads, solves
        loads = np.where(open_, corrected_loads(problem, loads, target, elastic, 1.0), loads)
        contacts = contacts_at(problem, state, checked_loads(state, loads))
        solves += 1
    raise StepError(
        f"the load of a spring and its contact did not converge at pass {state.passes[0]:.0f}",
        state.to_arrays(),
    )


def solve_at_present_loads(
    problem: WearProblem, state: WearState, elastic: FloatArray | None
) -> tuple[ContactBatchSolution, FloatArray, int]:
    """Solve every contact at the time of the state with its load; results as `solve_loaded`."""
    return _solve_now(problem, state, elastic, solve_present)


def solve_at_record(
    problem: WearProblem, state: WearState, *, on_profile: bool, cold: bool = False
) -> tuple[ContactBatchSolution, FloatArray]:
    """Return the contacts at the time of the state, and their loads [N].

    Parameters
    ----------
    problem : WearProblem
    state : WearState
    on_profile : bool
        Whether the contacts of the state are solutions on its profiles: those that carry their
        loads already are not solved again.
    cold : bool
        Whether the solver starts without the contacts of the state.
    """
    solve = contacts_at if on_profile else partial(solve_present, cold=cold)
    elastic = None
    if problem.has_spring and not cold:
        elastic = elastic_approaches(present_problem(problem, state), state)
    return _solve_now(problem, state, elastic, solve)[:2]


def _solve_now(
    problem: WearProblem,
    state: WearState,
    elastic: FloatArray | None,
    solve: Callable[[WearProblem, WearState, FloatArray], ContactBatchSolution],
) -> tuple[ContactBatchSolution, FloatArray, int]:
    """Solve the contacts with their loads at the time of the state; results as `solve_loaded`."""
    present = present_problem(problem, state)
    force = present.force(present.time(state.passes))

    def loads_at(displacement: FloatArray) -> FloatArray:
        return with_feedback(present, force, displacement, state.terms)

    if problem.varying and solve is contacts_at:
        solve = solve_present  # the contacts were solved with other values of the processes
    fresh = fresh_approach(present, state, force)
    return solve_loaded(present, state, loads_at, fresh, elastic, solve)


def recovery_at(problem: WearProblem, state: WearState) -> tuple[FloatArray, FloatArray]:
    """Return elastic approach and elastic recovery of contacts at the present loads [m].

    Both have the shape (S, C, N), and are zero without a spring.
    """
    if not problem.has_spring:
        return np.zeros(()), np.zeros(())
    present = present_problem(problem, state)
    elastic = elastic_approaches(present, state)
    return elastic, fresh_approach(
        present, state, present.force(present.time(state.passes))
    ) - elastic


def explicit_step(problem: WearProblem, state: WearState, passes: FloatArray) -> WearState:
    """Step over `passes` passes on the profiles of the step's start, under its mean load.

    The elastic recovery of the start applies to the mean load of the step.
    """
    here = problem.at_time(problem.time(state.passes), problem.time(state.passes + passes))
    predicted = state.with_added(WearIncrement(here, state.contacts, passes).depths)
    elastic, recovered = recovery_at(problem, state)
    displacement = displacement_at(here, (state.depths, predicted.depths), recovered)
    mean = mean_loads(here, state, passes, displacement, state.contacts)
    solve = solve_present if problem.varying else contacts_at
    contacts = solve(here, state, checked_loads(state, mean))
    begun = state.replaced(contacts=contacts)
    ends = begun.with_added(WearIncrement(here, contacts, passes).depths)
    worn = worn_state(here, ends, passes, here.values_of(contacts, "power"))
    ended, _, solves = solve_at_present_loads(problem, worn, elastic)
    solves = problem.contacts_each * (solves + (contacts is not state.contacts))
    return worn.replaced(contacts=ended, solves=state.solves + solves)


def present_problem(problem: WearProblem, state: WearState) -> WearProblem:
    """Return the problem with every process at its value at the time of the state."""
    now = problem.time(state.passes)
    return problem.at_time(now, now)


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

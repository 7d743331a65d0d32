"""Wear of the bodies in one step, and loads, contacts and explicit step."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np

from wearsim.contact_batch import ContactBatchSolution
from wearsim.errors import StepError
from wearsim.evolution.contacts import contact_batch
from wearsim.evolution.problem import WearProblem
from wearsim.evolution.quantities import sum_in_order
from wearsim.evolution.state import Depths, WearState
from wearsim.evolution.steppers.loads import (
    advanced_terms,
    checked_loads,
    corrected_loads,
    displacement_at,
    elastic_approaches,
    fresh_approach,
    mean_loads,
    with_feedback,
)
from wearsim.types import FloatArray

REALISATION = 2  # axis of the realisations
SAME_LOAD = 1e-9  # relative change of a load below which a contact is not solved again
MAX_LOAD_ITERATIONS = 60
NEWTON_ITERATIONS = 12  # usually half as many; later ones bisect
LEAST_CORRECTED = 0.1  # load after a correction, over that before it
LOST = 1e-6  # load over that of the first iteration, below which contact is lost


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
    difference = np.abs(carried_loads(problem, state.contacts) - loads).max(axis=(0, 1))
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
    if problem.has_spring and len(state.contacts) == loads.size:
        # a stiff spring may seem unloaded until the approach has converged
        loads = np.where(loads > 0.0, loads, carried_loads(problem, state.contacts))
    contacts = solve(problem, state, checked_loads(state, loads))
    first_loads, solves = loads, int(contacts is not state.contacts)
    if not problem.has_spring:
        return contacts, loads, solves
    tolerance = problem.iteration_tolerance
    low, high = np.zeros_like(loads), np.full_like(loads, np.inf)
    for iteration in range(MAX_LOAD_ITERATIONS):
        state = state.replaced(contacts=contacts)
        elastic = elastic_approaches(problem, state)
        target = loads_at(displacement_at(problem, [state.depths], fresh - elastic))
        low = np.where(target > loads, np.maximum(low, loads), low)
        high = np.where(target > loads, high, np.minimum(high, loads))
        # the approach of some models jumps where a strip comes into contact
        open_ = (np.abs(target - loads) > tolerance * loads) & (high - low > tolerance * loads)
        if not np.count_nonzero(open_):
            return contacts, loads, solves
        corrected = corrected_loads(problem, loads, target, elastic)
        # close to zero load the correction, linear in the approach, may lead below zero
        checked_loads(state, np.where(loads > LOST * first_loads, 1.0, corrected))
        corrected = np.maximum(corrected, LEAST_CORRECTED * loads)
        if iteration >= NEWTON_ITERATIONS:
            bounded = (low > 0.0) & (high < np.inf)
            corrected = np.where(bounded, np.sqrt(low * np.where(bounded, high, 1.0)), corrected)
        loads, solves = np.where(open_, corrected, loads), solves + 1
        contacts = contacts_at(problem, state, loads)
    raise StepError(
        f"the load of a spring and its contact did not converge at pass {state.passes[0]:.0f}",
        state.to_arrays(),
    )


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
    if on_profile and not problem.varies and problem.has_spring and state.past_spans is not None:
        # an implicit step has found contacts and loads in equilibrium
        return state.contacts, carried_loads(problem, state.contacts)
    solve = contacts_at if on_profile else partial(solve_present, cold=cold)
    elastic = None
    if problem.has_spring and not cold:
        elastic = elastic_approaches(present_problem(problem, state), state)
    return solve_at_present_loads(problem, state, elastic, solve)[:2]


def solve_at_present_loads(
    problem: WearProblem,
    state: WearState,
    elastic: FloatArray | None,
    solve: Callable[[WearProblem, WearState, FloatArray], ContactBatchSolution] = solve_present,
) -> tuple[ContactBatchSolution, FloatArray, int]:
    """Solve every contact at the time of the state with its load; results as `solve_loaded`."""
    present = present_problem(problem, state)
    force = present.force(present.time(state.passes))
    loads_at = partial(with_feedback, present, force, terms=state.terms)
    if problem.varying and solve is contacts_at:
        solve = solve_present  # the contacts were solved with other values of the processes
    return solve_loaded(
        present, state, loads_at, fresh_approach(present, state, force), elastic, solve
    )


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
    predicted = state.with_added(worn_depths(here, state.contacts, passes))
    elastic, recovered = recovery_at(problem, state)
    displacement = displacement_at(here, (state.depths, predicted.depths), recovered)
    mean = mean_loads(here, state, passes, displacement, state.contacts)
    solve = solve_present if problem.varying else contacts_at
    contacts = solve(here, state, checked_loads(state, mean))
    ends = state.replaced(contacts=contacts).with_added(worn_depths(here, contacts, passes))
    worn = worn_state(here, ends, passes, here.values_of(contacts, "power"))
    ended, _, solves = solve_at_present_loads(problem, worn, elastic)
    solves = problem.contacts_each * (solves + (contacts is not state.contacts))
    return worn.replaced(contacts=ended, solves=state.solves + solves)


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
    terms, stop = state.terms, state.passes + passes
    if problem.terms:
        terms = advanced_terms(
            problem, state, stop, problem.mean_over_turn(problem.per_roller(power))[0]
        )
    return state.replaced(
        passes=stop,
        terms=terms,
        energy=state.energy + problem.total_power(power) * (passes / problem.kinematics.pass_rate),
    )


def worn_depths(
    problem: WearProblem, contacts: ContactBatchSolution, passes: FloatArray | float
) -> Depths:
    """Return the depths that some passes of given contacts wear off cylinder and rollers [m]."""
    return problem.sum_of_parts(*problem.wear_parts(contacts, passes))


def wear_per_pass(
    problem: WearProblem, contacts: ContactBatchSolution
) -> tuple[FloatArray, FloatArray]:
    """Return depth [m] and energy [J] per roller pass, (stations + rollers, N, strips) and (N,)."""
    cylinder, roller = worn_depths(problem, contacts, 1.0)
    return np.concatenate([cylinder[:, 0], roller[0]]), energy_per_pass(problem, contacts)


def energy_per_pass(problem: WearProblem, contacts: ContactBatchSolution) -> FloatArray:
    """Return the energy that all contacts dissipate in a roller pass, shape (N,) [J]."""
    return np.asarray(problem.total_power(contacts.power) / problem.kinematics.pass_rate)


def wear_of_contacts(problem: WearProblem, contacts: ContactBatchSolution) -> FloatArray:
    """Return the wear of both bodies per pass by each contact, (2, contacts, strips) [m]."""
    if problem.linear_wear:
        return problem.wear_coefficients * contacts.dissipation
    return problem.wear_parts(contacts, 1.0).reshape(2, *contacts.line_load.shape)


def volumes_of(problem: WearProblem, depths: FloatArray) -> FloatArray:
    """Return the volume of depths of all bodies, as `WearState.stacked`, (realisations,) [m^3]."""
    return sum_in_order(problem.volume_weights[1][:, None] * np.add.reduce(depths, axis=-1), axis=0)

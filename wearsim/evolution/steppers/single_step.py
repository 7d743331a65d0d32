"""One step over many passes, implicit or explicit: pure functions from state to state."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from wearsim.errors import StepError
from wearsim.evolution.batch.per_realisation import one_of
from wearsim.evolution.batch.stack import problem_of, state_of
from wearsim.evolution.observables import depth, worn_volume
from wearsim.evolution.problem import WearProblem
from wearsim.evolution.state import Contacts, Depths, WearState, as_batch
from wearsim.evolution.steppers.compliant_contact import REALISATION, solve_compliant
from wearsim.evolution.steppers.wear_increment import WearIncrement, exponents_between
from wearsim.types import FloatArray, Number

MAX_FIXED_POINT = 60
PATIENCE = 20  # iterations after which ten times as much is allowed: strips at an edge come and go
SAME_LOAD = 1e-9  # relative change of a load that asks for no new solution


def mean_loads(
    problem: WearProblem,
    state: WearState,
    passes: Number,
    depths: Sequence[Depths],
    power: FloatArray,
) -> FloatArray:
    """Return the mean load of each contact over a step, shape (S, C, N) [N].

    The load itself is integrated exactly; the feedback takes the mean of the descents at worn
    `depths`, as a rule those at the step's ends, and each term its exact mean at constant `power`.
    """
    start, stop = problem.time(state.passes_done), problem.time(state.passes_done + passes)
    problem = problem.at_time(start, stop)
    loads = _loads(problem, problem.mean_load(start, stop))
    if problem.has_spring:
        descents = [problem.descent(problem.gap(*worn)) for worn in depths]
        loads -= problem.stiffness * np.mean(descents, axis=0)
    for number, term in enumerate(problem.terms.values()):
        # a station's power counts like any other's
        mean = problem.per_roller(power).mean(axis=0)
        duration = one_of(stop - start)
        loads += term.mean_force(state.terms[number], mean, duration)[problem.roller]
    return checked_loads(loads, state.passes_done)


def _loads(problem: WearProblem, force: Number) -> FloatArray:
    """Return the load of every contact before feedback where that of the problem is `force` [N]."""
    loads = np.empty(problem.shape)
    loads[:] = force + problem.inputs.normal_force_offset
    return loads


def checked_loads(loads: FloatArray, passes: Number) -> FloatArray:
    """Return `loads` if all are positive; a contact that has lost its load cannot go on."""
    if np.count_nonzero(loads > 0.0) < loads.size:
        raise StepError(
            f"contact is lost at pass {one_of(passes):.0f}: the load has fallen to"
            f" {loads.min():.4g} N; the spring has run out of travel, or the log or a draw falls to"
            " zero",
            {"normal_force": loads, "passes": passes},
        )
    return loads


def _differs(new: FloatArray, old: FloatArray) -> FloatArray:
    """Return the greatest change of each realisation, relative, from (S, C, N, ...)."""
    axes = (0, 1, 3)[: new.ndim - 1]
    change, scale = np.abs(new - old).max(axis=axes), np.abs(new).max(axis=axes)
    scale[scale == 0.0] = np.inf
    relative: FloatArray = change / scale
    return relative


def implicit_step(problem: WearProblem, state: WearState, passes: Number) -> WearState:
    """Step over `passes` passes with the contacts solved on the profiles at the step's end.

    The wear of the step enters the contact problem as a compliance, so that no step is too long
    for stability. Compliance, loads and creepage depend on the answer and are iterated; where wear
    is no multiple of the line load, its exponent is learnt from one iterate to the next. A
    realisation that has settled is let be while others go on.

    Raises
    ------
    StepError
        If they do not settle.
    """
    problem = problem.at_time(
        problem.time(state.passes_done), problem.time(state.passes_done + passes)
    )
    gap = problem.gap(state.cylinder_depth, state.roller_depth)
    contacts = state.contacts
    wearing = WearIncrement(problem, contacts, passes)
    ends = _ends(state, wearing)
    loads = _end_loads(problem, state, passes, ends, contacts)
    moving = np.ones(problem.shape[REALISATION], dtype=np.bool_)
    iterations = np.zeros(len(moving), dtype=np.int64)
    for iteration in range(1, MAX_FIXED_POINT + 1):
        points = problem.points(loads, *ends)
        open_gap, wear = gap + wearing.offset, wearing.compliance
        found = solve_compliant(problem, open_gap, points, wear, contacts, moving)
        iterations += moving
        new = WearIncrement(problem, found, passes)
        ends = _ends(state, new)
        foreseen = wearing.foreseen(problem.values_of(found, "line_load"))
        change, new_loads = _differs(new.opening, foreseen), loads
        if problem.has_feedback:
            new_loads = _end_loads(problem, state, passes, ends, found)
            change = np.maximum(change, _differs(new_loads, loads))
        if problem.slip_profile is not None:
            change = np.maximum(change, _differs(new.cylinder, wearing.cylinder))
        moving &= ~(change < problem.iteration_tolerance * 10.0 ** ((iteration - 1) // PATIENCE))
        if not np.count_nonzero(moving):
            power = problem.values_of(found, "power")
            solves = iterations * (len(found) // len(moving))
            begun = state.advanced_to(state.passes_done, solves, contacts=found)
            return worn_state(problem, begun, passes, ends, power)
        new.exponents = exponents_between(wearing, new)
        contacts, wearing, loads = found, new, new_loads
    raise StepError(
        f"an implicit step of {one_of(passes):.4g} passes from pass {one_of(state.passes_done):.0f} did not"
        f" settle (last change {change.max():.1e})",
        state.to_arrays(),
    )


def _ends(state: WearState, wearing: WearIncrement) -> Depths:
    """Return the worn depths at the end of a step."""
    return state.cylinder_depth + wearing.cylinder, state.roller_depth + wearing.roller


def _end_loads(
    problem: WearProblem, state: WearState, passes: Number, ends: Depths, contacts: Contacts
) -> FloatArray:
    """Return the mean loads of a step that leads to depths `ends`."""
    power = problem.values_of(contacts, "power")
    return mean_loads(problem, state, passes, (state.depths, ends), power)


def explicit_step(problem: WearProblem, state: WearState, passes: Number) -> WearState:
    """Step over `passes` passes on the profiles of the step's start, under its mean load."""
    here = problem.at_time(problem.time(state.passes), problem.time(state.passes + passes))
    foreseen = WearIncrement(here, state.contacts, passes)
    mean = _end_loads(here, state, passes, _ends(state, foreseen), state.contacts)
    solve = solve_present if problem.varying else contacts_at
    contacts = solve(here, state, mean)
    solves = len(contacts) if contacts is state.contacts else 2 * len(contacts)
    wearing, power = WearIncrement(here, contacts, passes), here.values_of(contacts, "power")
    begun = replace(state, contacts=contacts, solves=state.solves + solves)
    worn = worn_state(here, begun, passes, _ends(state, wearing), power)
    return replace(worn, contacts=solve_present(problem, worn, present_loads(problem, worn)))


def present_problem(problem: WearProblem, state: WearState) -> WearProblem:
    """Return the problem with every process at its value of this moment."""
    now = problem.time(state.passes_done)
    return problem.at_time(now, now)


def present_loads(problem: WearProblem, state: WearState) -> FloatArray:
    """Return the load of each contact at this moment, shape (S, C, N) [N]."""
    problem = present_problem(problem, state)
    loads = _loads(problem, problem.force(problem.time(state.passes_done)))
    if problem.has_spring:
        gap = problem.gap(state.cylinder_depth, state.roller_depth)
        loads -= problem.stiffness * problem.descent(gap)
    for number in range(len(problem.terms)):
        loads += problem.at_contacts(state.terms[number][None])[0]
    return checked_loads(loads, state.passes_done)


def contacts_at(problem: WearProblem, state: WearState, loads: FloatArray) -> Contacts:
    """Return the contacts on the present profiles under `loads`, shape (S, C, N) [N].

    A step over many passes leaves them solved on the profile it leads to; where they carry these
    loads already there is nothing left to solve.
    """
    if problem.varying:
        return solve_present(problem, state, loads)
    line_load = problem.values_of(state.contacts, "line_load")
    carried = line_load.sum(axis=-1) * problem.grid.spacing
    apart, most = np.abs(carried - loads).max(axis=(0, 1)), loads.max(axis=(0, 1))
    others = np.flatnonzero(apart > SAME_LOAD * most)
    if not others.size:
        return state.contacts
    if others.size == loads.shape[REALISATION]:
        return solve_present(problem, state, loads)
    chosen, part = problem_of(problem, others), state_of(state, others)
    found = solve_present(chosen, part, np.take(loads, others, axis=REALISATION))
    return state.batch.with_others(others, as_batch(found, chosen.shape))


def solve_present(problem: WearProblem, state: WearState, loads: FloatArray) -> Contacts:
    """Solve every contact on the present profiles under `loads`, shape (S, C, N) [N]."""
    problem = present_problem(problem, state)
    points = problem.points(loads, state.cylinder_depth, state.roller_depth)
    gap = problem.gap(state.cylinder_depth, state.roller_depth)
    return problem.model.solve_batch(
        gap, problem.kinematics.longitudinal_curvature, points, None, state.contacts or None
    )


def worn_state(
    problem: WearProblem,
    state: WearState,
    passes: Number,
    ends: Depths,
    power: FloatArray,
) -> WearState:
    """Return the state that a step leads to.

    Parameters
    ----------
    problem : WearProblem
    state : WearState
        Where the step began; its contacts stand in the state returned too.
    passes : float or ndarray, shape (realisations,)
        Length of the step.
    ends : tuple of ndarray
        Worn depths of cylinder and rollers at its end, shapes as in `WearState` [m].
    power : ndarray, shape (stations, contacts, realisations)
        Mean dissipated power of the step [W], of the same dissipation as the wear.
    """
    terms = state.terms
    if problem.terms:
        duration = one_of(
            problem.time(state.passes_done + passes) - problem.time(state.passes_done)
        )
        mean = problem.per_roller(power).mean(axis=0)
        each = enumerate(problem.terms.values())
        terms = np.array([term.advance(terms[number], mean, duration) for number, term in each])
    return state.advanced_to(
        state.passes_done + passes,
        cylinder_depth=ends[0],
        roller_depth=ends[1],
        terms=terms,
        energy=state.energy + problem.total_power(power) * (passes / problem.kinematics.pass_rate),
    )


def cylinder_depth_of(state: WearState) -> FloatArray:
    """Return the greatest worn depth of the cylinder, shape (realisations,) [m]."""
    greatest: FloatArray = depth(state.cylinder_depth).max(axis=(0, 1))
    return greatest


def cylinder_volume_of(problem: WearProblem, state: WearState) -> FloatArray:
    """Return the cylinder's worn volume, shape (realisations,) [m^3]; stations share it equally."""
    radius = problem.kinematics.cylinder_radius
    volume = worn_volume(state.cylinder_depth, problem.grid.spacing, radius)
    mean: FloatArray = volume.mean(axis=(0, 1))
    return mean

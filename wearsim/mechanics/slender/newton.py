"""Normal contact of slender patches: unknown line loads on strips.

Strip i of contact k has the gap z_i and is displaced by the line load of every strip j (see
`influence`):

    sum_j W_ij(a_j) q_j + c_i q_i + z_i = delta_k   where q_i > 0,
    a_j = sqrt(4 s_j q_j / (pi E* kappa)),   sum_i q_i dy = N_k,

with the relative curvature along rolling kappa, the interaction factor s of the half-lengths (see
`half_length`) and the wear compliance c of the separate contact. Newton's method with an active set
of strips in contact and the unknown approach delta uses the steps of `newton_step`.

Where contacts wear shared bodies, the gap of contact k opens by the wear that all contacts cause on
its bodies: the left-hand side is increased by D_i, the sum over its bodies and all l of their
contacts of c_l,i q_l,i. `body_wear` turns the steps of the separate contacts into the
coupled step.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from wearsim.mechanics.numerics.jit import borrowed, kept, kernel, subroutine
from wearsim.mechanics.numerics.lu import solve_factored
from wearsim.mechanics.slender.body_wear import (
    add_depths,
    factor_depths,
    fill_responses,
    fill_separate_step,
    new_depth_system,
    number_depths,
    solve_depths,
)
from wearsim.mechanics.slender.half_length import (
    SWEEPS,
    HalfLengths,
    fill_half_lengths,
    fill_log_scales,
    find_factors,
    new_half_lengths,
)
from wearsim.mechanics.slender.influence import HIGHEST
from wearsim.mechanics.slender.newton_step import (
    SMALL,
    NewtonState,
    add_approach,
    add_displacement,
    add_missing_load,
    complete_surface,
    correct_residual,
    factor_jacobian,
    fill_jacobian,
    fill_missing,
    fill_separation,
    has_large_step,
    new_newton_state,
    number_strips,
    predict_surface,
    rest_on_foundation,
    update_loads,
)
from wearsim.types import FloatArray, IntArray

CONVERGED, SINGULAR, TOO_FINE, NO_CONVERGENCE, NOT_FINITE = range(5)
CONTINUE = -1

# predicted change of the next step, relative to the greatest line load; where contacts wear, their
# wear compliance is iterated in each step of the wear test, and less accuracy is sufficient
TOLERANCE, WEAR_TOLERANCE = 3e-8, 1e-6
SHRINKING = 0.2  # ratio of successive steps up to which Jacobians may be reused
FIRST = 0.1  # assumed ratio of the second step to the first
MUCH = 0.05  # share of the load that starting line loads lack and a foundation corrects
AT_BEST = 0.005  # least assumed ratio of successive steps, as the Jacobian is approximate
GAP_TOLERANCE = 1e-8  # of the approach
FIRST_FOUNDATION = 8.0  # elastic compliance of strips without displacement, in 1/(pi E*)
FOUNDATION = 5.0  # the same of strips under the displacement of all
MAX_ITERATIONS = 100
CAUTIOUS = 12  # iterations after which the active set is changed cautiously
MARGIN = 6  # strips followed on either side of the loaded ones
FIRST_MARGIN = 20  # the same for a foundation, which may load many strips more than the start


class ContactSet(NamedTuple):
    """Contacts of a set: gap [m] and wear compliance [m/(N/m)] of the strips, loads [N].

    Also the strip width [m], 1/(pi E*) [1/Pa], and the table of `influence_table`.
    """

    gap: FloatArray
    compliance: FloatArray
    loads: FloatArray
    spacing: float
    unit: float
    table: FloatArray


@subroutine
def add_penetrated(
    k: int,
    left: int,
    right: int,
    iteration: int,
    unit: float,
    state: NewtonState,
    approach: FloatArray,
    line_load: FloatArray,
) -> bool:
    """Give a load to the penetrated strips of contact `k`, and return whether there are any.

    A strip starts with about the load of its penetration; a much greater one would be removed by
    the next step. After `CAUTIOUS` iterations few strips are added at a time, and the tolerance for
    penetration grows, so that a strip at the edge cannot alternate between in and out of contact.

    Parameters
    ----------
    left, right : int
        The first strip with a complete surface, and the one after the last.
    """
    surface = state.surface
    lowest, deepest = surface[k, left], 0.0
    for i in range(left, right):
        lowest = min(lowest, surface[k, i])
        if state.rows[k, i] < 0:
            deepest = max(deepest, approach[k] - surface[k, i])
    tolerance = GAP_TOLERANCE * 10.0 ** max(0, iteration // 20 - 1)
    scale = tolerance * max(abs(approach[k]), approach[k] - lowest)
    if deepest <= scale:
        return False
    limit = max(scale, 0.999 * deepest) if iteration > CAUTIOUS else scale
    for i in range(left, right):
        inside = approach[k] - surface[k, i]
        if state.rows[k, i] < 0 and inside > limit:
            line_load[k, i] = 0.1 * inside / unit
    state.fresh[k] = True
    return True


@subroutine
def check_convergence(
    iteration: int,
    tolerance: float,
    before: float,
    change: float,
    left: bool,
    these: ContactSet,
    members: Any,
    worn: Any,
    lengths: HalfLengths,
    state: NewtonState,
    approach: FloatArray,
    line_load: FloatArray,
) -> tuple[int, float]:
    """Add penetrated strips, mark contacts that need a new Jacobian and test for convergence.

    Unloaded strips are tested after a large change, and where the loaded ones have converged; those
    that are not followed are tested then only.

    Parameters
    ----------
    tolerance : float
        As of `solve_slender`.
    members, worn
        As of `start_strips`.
    before : float
        Change of the previous step, 0 if the active set was another one.
    change, left
        From `update_loads`.

    Returns
    -------
    status : int
        CONVERGED, CONTINUE or NOT_FINITE.
    change : float
        Greatest change relative to the greatest line load, 0 if the active set changed.
    """
    if not change < np.inf:
        return NOT_FINITE, change
    contacts, entered, unit = line_load.shape[0], False, these.unit
    shrinking = min(max(change / before, AT_BEST), 1.0) if before > 0.0 else FIRST
    if not shrinking < SHRINKING:
        state.fresh[:] = True
    small, converged = change <= SMALL, not left and change * shrinking < tolerance
    if (converged or not small) if iteration <= CAUTIOUS else (small and not left):
        for k in range(contacts):
            predict_surface(k, these.table, unit, lengths.log_ratio, state)
        if members is not None:
            add_depths(members, worn, state.change, state.surface)
        for k in range(contacts):
            first, end = state.left[k], state.right[k]
            entered |= add_penetrated(k, first, end, iteration, unit, state, approach, line_load)
    if left or entered or not converged:
        return CONTINUE, 0.0 if left or entered else change
    for k in range(contacts):
        first, end = complete_surface(k, approach[k], these.table, unit, line_load, lengths, state)
        entered |= add_penetrated(k, first, end, iteration, unit, state, approach, line_load)
    return (CONTINUE, 0.0) if entered else (CONVERGED, change)


@subroutine
def start_strips(
    these: ContactSet,
    members: Any,
    worn: Any,
    corrected: bool,
    line_load: FloatArray,
    state: NewtonState,
) -> bool:
    """Assign rows to the loaded strips of all contacts, and add the load that they lack.

    Parameters
    ----------
    members, worn
        `bodies` and `shared` of the set, or None.
    corrected : bool
        Whether a foundation corrects the line loads in any case.

    Returns
    -------
    bool
        Whether a foundation corrects the line loads.
    """
    gap, contacts = these.gap, line_load.shape[0]
    lowest, softness = state.lowest, state.softness
    for k in range(contacts):
        # relative to the least gap, as the displacements under a vanishing load would be lost in
        # the rounding of a deep groove
        lowest[k], state.fresh[k] = gap[k, 0], True
        for i in range(line_load.shape[1]):
            lowest[k] = min(lowest[k], gap[k, i])
            softness[k, i] = these.compliance[k, i]
            if members is not None:  # as if all contacts wore the same strips
                softness[k, i] += contacts * (worn[k, 0, i] + worn[k, 1, i])
            corrected = corrected or softness[k, i] > 0.0
        missing = add_missing_load(these.loads[k] / these.spacing, line_load[k])
        corrected = missing > MUCH or corrected
        number_strips(k, line_load, FIRST_MARGIN, state)
    return corrected


@subroutine
def rest_contacts(
    these: ContactSet,
    members: Any,
    worn: Any,
    displaced: bool,
    line_load: FloatArray,
    approach: FloatArray,
    lengths: HalfLengths,
    state: NewtonState,
) -> None:
    """Fill line loads and approaches of contacts on a foundation.

    Those with line loads keep them, unless the foundation lies under the displacement by these
    loads, `displaced`, for which one evaluation of s is sufficient. The other parameters are as of
    `start_strips`.
    """
    surface, softness, unit = state.surface, state.softness, these.unit
    soft, widest = (FOUNDATION if displaced else FIRST_FOUNDATION) * unit, -np.inf
    for k in range(line_load.shape[0]):
        for i in range(line_load.shape[1]):
            surface[k, i] = these.gap[k, i] - state.lowest[k]
            if displaced:
                own = these.compliance[k, i]
                surface[k, i] -= (soft + softness[k, i] - own) * line_load[k, i]
        if displaced:
            widest = max(widest, find_factors(k, line_load, False, 1, lengths))
    if members is not None and displaced:
        add_depths(members, worn, line_load, surface)
    for k in range(line_load.shape[0] if widest <= HIGHEST else 0):
        load, first, end = these.loads[k] / these.spacing, state.left[k], state.right[k]
        if displaced:
            add_displacement(k, first, end - 1, these.table, unit, line_load, lengths, state)
        if displaced or state.size[k] == 0:
            rest_on_foundation(k, surface, softness, soft, load, first, end, line_load, approach)


@subroutine
def factor_contacts(
    these: ContactSet,
    members: Any,
    worn: Any,
    system: Any,
    line_load: FloatArray,
    lengths: HalfLengths,
    state: NewtonState,
) -> tuple[int, bool]:
    """Fill surfaces and residuals of all contacts, and factor new Jacobians where needed.

    Parameters
    ----------
    system
        Equations of the shared bodies, or None; the others are as of `start_strips`.

    Returns
    -------
    status : int
        CONTINUE or the cause of failure.
    renewed : bool
        Whether a contact has a new Jacobian.
    """
    surface, unit, renewed = state.surface, these.unit, False
    for k in range(line_load.shape[0]):
        for i in range(line_load.shape[1]):
            own = these.compliance[k, i] * line_load[k, i]
            surface[k, i] = these.gap[k, i] - state.lowest[k] + own
        if state.fresh[k]:
            number_strips(k, line_load, MARGIN, state)
            renewed = True
    if members is not None:
        add_depths(members, worn, line_load, surface)
        if renewed:
            number_depths(members, these.compliance, worn, state, system, state.softness)
    for k in range(line_load.shape[0]):
        fresh = state.fresh[k]
        if find_factors(k, line_load, fresh, SWEEPS, lengths) > HIGHEST:
            return TOO_FINE, renewed
        if not fresh:
            first, last = state.left[k], state.right[k] - 1
            add_displacement(k, first, last, these.table, unit, line_load, lengths, state)
        else:
            fill_jacobian(k, these.table, unit, state.softness, line_load, lengths, state)
            if members is None:
                state.fresh[k] = not factor_jacobian(k, state)
            else:
                state.fresh[k] = not fill_responses(k, state, system)
        if state.fresh[k] or not abs(state.unit_load_sum[k]) > 0.0:
            return SINGULAR, renewed
        fill_missing(k, state)
    if members is not None and renewed and not factor_depths(worn, state, system):
        return SINGULAR, renewed
    return CONTINUE, renewed


@subroutine
def fill_steps(
    these: ContactSet,
    members: Any,
    worn: Any,
    system: Any,
    corrected: bool,
    line_load: FloatArray,
    approach: FloatArray,
    lengths: HalfLengths,
    state: NewtonState,
) -> None:
    """Fill steps and approaches of all contacts; parameters as of `factor_contacts`.

    Residuals are `corrected` by the nonlinear part of the last step.
    """
    for k in range(line_load.shape[0]):
        if corrected:
            correct_residual(k, these.table, these.unit, line_load, lengths, state)
        rise = 0.0
        if members is None:
            for row in range(state.size[k]):
                state.step[k, row] = state.missing[k, row]
            solve_factored(state.matrix[k], state.size[k], state.step[k])
        else:
            rise = fill_separate_step(k, state, system)
        add_approach(k, these.loads[k] / these.spacing, line_load, state, approach)
        approach[k] += rise
    if members is not None:
        solve_depths(worn, state, system, approach)


@kernel
def solve_slender(
    gap: FloatArray,
    compliance: FloatArray,
    bodies: Any,
    shared: Any,
    loads: FloatArray,
    longitudinal_curvature: FloatArray,
    spacing: float,
    contact_modulus: float,
    table: FloatArray,
    curvature_influence: FloatArray,
    tolerance: float,
    line_load: FloatArray,
    approach: FloatArray,
    half_length: FloatArray,
    separation: FloatArray,
    status: IntArray,
    iterations: IntArray,
) -> int:
    """Solve sets of slender contacts, from starting line loads.

    The contacts of a set are independent or wear shared bodies. Strips on an elastic foundation
    give line loads to a contact without a start, and correct starting line loads where bodies wear
    or the load differs much. A set that fails is solved again without start and correction. The
    kernel is compiled separately for independent contacts (`bodies` and `shared` None), without the
    parts for shared bodies.

    Parameters
    ----------
    gap : ndarray, shape (sets, contacts, strips)
        Gap [m].
    compliance : ndarray, shape (sets, contacts, strips)
        Wear compliance of the separate contacts: increase of gap per line load [m/(N/m)].
    bodies : ndarray of int, shape (contacts, 2), or None
        Bodies that each contact of a set shares with others, numbered from 0; -1 for none. Those of
        the first column have the lower numbers.
    shared : ndarray, shape (sets, contacts, 2, strips), or None
        Depth that a contact wears off those bodies per unit of line load [m/(N/m)].
    loads, longitudinal_curvature : ndarray, shape (sets, contacts)
        Loads N [N], kappa [1/m].
    spacing, contact_modulus : float
        Strip width [m], E* [Pa].
    table, curvature_influence : ndarray
        From `influence_table`, and from `curvature_table` or, for half-lengths without interaction
        of the strips, `no_table`.
    tolerance : float
        Predicted change of the next step, over the greatest line load, at which a set has
        converged.
    line_load : ndarray, shape (sets, contacts, strips)
        Starting line loads, all zero in a contact without a start; overwritten with q [N/m].
    approach : ndarray, shape (sets, contacts)
        Starting approaches; overwritten with delta [m].
    half_length : ndarray, shape (sets, contacts, strips)
        Filled: a [m].
    separation : ndarray, shape (sets, contacts, strips)
        Filled: distance between the deformed surfaces in strips without load [m].
    status, iterations : ndarray of int, shape (sets,)
        Filled: CONVERGED or the cause of failure; iterations of Newton's method.

    Returns
    -------
    int
        Number of contacts without a solution, or that reach their first or last strip.
    """
    contacts, n, failed = gap.shape[1], gap.shape[2], 0
    unit = 1.0 / (np.pi * contact_modulus)
    gap, compliance, loads, line_load, approach, table, half_length = borrowed(
        (gap, compliance, loads, line_load, approach, table, half_length)
    )
    owned = new_newton_state(contacts, n), new_half_lengths(curvature_influence, contacts)
    state, lengths = borrowed(owned)
    members: Any = None
    worn: Any = None
    system: Any = None
    if bodies is not None:
        depths = new_depth_system(bodies, n)
        members, worn, system = borrowed((bodies, shared, depths))
    for number in range(gap.shape[0]):
        total, delta = line_load[number], approach[number]
        wear: Any = None
        if bodies is not None:
            wear = worn[number]
        these = ContactSet(gap[number], compliance[number], loads[number], spacing, unit, table)
        fill_log_scales(contact_modulus, longitudinal_curvature[number], spacing, lengths.log_scale)
        started, finite = False, True
        for k in range(contacts):
            for i in range(n):
                started = started or total[k, i] > 0.0
                finite = finite and abs(gap[number, k, i]) < np.inf
        status[number], iterations[number] = NOT_FINITE, 0
        for attempt in range(2 if finite else 0):
            if attempt > 0:
                total[:] = 0.0
            corrected = start_strips(these, members, wear, not started, total, state)
            # a foundation gives loads to contacts without a start; another one, under the
            # displacements of these loads, brings them within a tenth in a quarter of the time of a
            # Jacobian. A second attempt does without
            for sweep in range(2 if corrected and attempt == 0 else 1):
                rest_contacts(these, members, wear, sweep > 0, total, delta, lengths, state)
            outcome, before, stale, iteration = CONTINUE, 0.0, 0.0, 0
            while outcome == CONTINUE:
                iteration += 1
                outcome, renewed = factor_contacts(
                    these, members, wear, system, total, lengths, state
                )
                if outcome != CONTINUE:
                    break
                fill_steps(these, members, wear, system, False, total, delta, lengths, state)
                if stale > SMALL or has_large_step(total, state):  # nonlinear part of large changes
                    fill_steps(these, members, wear, system, True, total, delta, lengths, state)
                change, left = update_loads(total, state, iteration > CAUTIOUS)
                stale = change if renewed else stale + change
                outcome, before = check_convergence(
                    *(iteration, tolerance, before, change, left, these, members, wear),
                    *(lengths, state, delta, total),
                )
                if outcome == CONTINUE and iteration == MAX_ITERATIONS:
                    outcome = NO_CONVERGENCE
            status[number], iterations[number] = outcome, iteration
            if outcome == CONVERGED:
                fill_half_lengths(spacing, total, lengths, half_length[number])
                for k in range(contacts):
                    fill_separation(k, gap[number], delta[k], total, state, separation[number])
                    delta[k] += state.lowest[k]
                break
        for k in range(contacts):
            at_end = total[k, 0] != 0.0 or total[k, n - 1] != 0.0
            failed += int(status[number] != CONVERGED or at_end)
    if bodies is not None:
        kept(depths)
    kept(owned)
    return failed

"""Slender contacts that wear bodies they share, all at once: `slender`, coupled.

The gap of contact k opens by what all contacts wear off the bodies that it touches,

    sum_j W_ij(a_j) q_j + c_i q_i + D_i + z_i = delta_k,   D_i = sum over its bodies and all l of
    their contacts c_l,i q_l,i,

and each of Newton's steps is a step of every contact by itself, from which `shared_bodies` makes
that of all together.
"""

from __future__ import annotations

import numpy as np

from wearsim.mechanics.numerics.jit import kernel
from wearsim.mechanics.numerics.lu import invert_factored
from wearsim.mechanics.slender.batch import attempts, forget_start
from wearsim.mechanics.slender.body_elimination import (
    add_depths,
    factor_depths,
    new_depths,
    solve_depths,
)
from wearsim.mechanics.slender.half_length import NEWTON_REACH, fill_half_lengths, new_lengths
from wearsim.mechanics.slender.influence import HIGHEST
from wearsim.mechanics.slender.newton import (
    CAUTIOUS,
    CONVERGED,
    GOING_ON,
    MAX_ITERATIONS,
    NO_CONVERGENCE,
    SINGULAR,
    TOO_FINE,
    least_gap,
    log_scale_of,
    settle,
    start_contact,
    update_loads,
)
from wearsim.mechanics.slender.newton_step import (
    Steps,
    add_beyond,
    displace,
    factor_jacobian,
    foresee,
    new_steps,
    take_step,
)
from wearsim.types import FloatArray, IntArray


@kernel
def _fill_responses(k: int, steps: Steps, response: FloatArray, lift: FloatArray) -> None:
    """Fill how contact `k`'s step and its approach follow its gap at held load."""
    size, unit_load = steps.size[k], steps.unit_load
    invert_factored(steps.matrix[k], size, steps.order[k], response[k])
    for column in range(size):
        total = 0.0
        for row in range(size):
            total += response[k, column, row]
        lift[k, column] = total / steps.risen[k]
        for row in range(size):
            response[k, column, row] -= unit_load[k, row] * lift[k, column]


@kernel
def solve_coupled(
    gap: FloatArray,
    own: FloatArray,
    members: IntArray,
    shared: FloatArray,
    loads: FloatArray,
    spacing: float,
    contact_modulus: float,
    longitudinal_curvature: float,
    table: FloatArray,
    bend: FloatArray,
    line_load: FloatArray,
    approach: FloatArray,
    half_length: FloatArray,
) -> tuple[int, int]:
    """Solve several coupled slender contacts, from the line loads given.

    Parameters
    ----------
    members : ndarray of int, shape (contacts, 2)
        Bodies that each contact shares with others, numbered from 0; -1 for none.
    shared : ndarray, shape (contacts, 2, strips)
        Depth that a contact wears off those bodies per unit of line load [m/(N/m)].
    gap, own, loads, spacing, contact_modulus, longitudinal_curvature, table, bend
        As in `slender.solve_slender`.
    line_load, approach, half_length
        Likewise.

    Returns
    -------
    status, iterations : int
        CONVERGED, or what went wrong.
    """
    contacts, n = gap.shape
    unit, before = 1.0 / (np.pi * contact_modulus), 0.0
    surface, work = np.empty((contacts, n)), np.empty((2, n))
    response, lift = np.empty((contacts, n, n)), np.empty((contacts, n))
    steps, depths = new_steps(contacts, n), new_depths(members, n)
    log_scale = log_scale_of(contact_modulus, longitudinal_curvature, spacing)
    lengths, lowest = new_lengths(contacts, bend, log_scale, NEWTON_REACH), np.empty(contacts)
    for k in range(contacts):
        for i in range(n):
            surface[k, i] = own[k, i] + shared[k, 0, i] + shared[k, 1, i]
        start_contact(k, gap, surface, contact_modulus, loads[k], spacing, line_load, approach)
        lowest[k] = least_gap(k, gap)
        approach[k] -= lowest[k]
    for iteration in range(1, MAX_ITERATIONS + 1):
        for k in range(contacts):
            for i in range(n):
                surface[k, i] = gap[k, i] - lowest[k]
        add_depths(members, shared, line_load, surface)
        renewed = False
        for k in range(contacts):
            widest = displace(k, own, table, unit, lengths, line_load, work, surface, steps)
            if widest > HIGHEST:
                return TOO_FINE, iteration
            if steps.fresh[k]:
                if not factor_jacobian(k, steps):
                    return SINGULAR, iteration
                _fill_responses(k, steps, response, lift)
                renewed = True
        if renewed and not factor_depths(members, shared, steps.rows, response, depths):
            return SINGULAR, iteration
        for again in range(2):
            for k in range(contacts):
                if again:
                    add_beyond(k, table, unit, line_load, lengths, steps)
                take_step(k, loads[k] / spacing, line_load, steps, approach)
            solve_depths(members, shared, steps.rows, response, lift, depths, steps.step, approach)
        change, left = update_loads(line_load, steps, iteration > CAUTIOUS)
        for k in range(contacts):
            foresee(k, surface, steps)
        add_depths(members, shared, steps.change, surface)
        status, before = settle(
            iteration, unit, before, change, left, surface, steps, approach, line_load
        )
        if status == CONVERGED:
            fill_half_lengths(spacing, line_load, lengths, half_length)
            for k in range(contacts):
                approach[k] += lowest[k]
        if status != GOING_ON:
            return status, iteration
    return NO_CONVERGENCE, MAX_ITERATIONS


@kernel
def solve_each_coupled(
    gap: FloatArray,
    own: FloatArray,
    members: IntArray,
    shared: FloatArray,
    loads: FloatArray,
    spacing: float,
    contact_modulus: float,
    longitudinal_curvature: float,
    table: FloatArray,
    bend: FloatArray,
    line_load: FloatArray,
    approach: FloatArray,
    half_length: FloatArray,
    status: IntArray,
    iterations: IntArray,
) -> None:
    """Solve sets of coupled contacts one by one, as `slender_each.solve_each` does uncoupled ones.

    Parameters
    ----------
    gap, own, members, shared, loads, line_load, approach, half_length : ndarray
        As in `solve_coupled`, with the axis of the sets first, except for `members`.
    spacing, contact_modulus, longitudinal_curvature, table, bend
        As in `solve_coupled`.
    status, iterations : ndarray of int, shape (sets,)
        Filled with what `solve_coupled` returns.
    """
    for m in range(gap.shape[0]):
        for attempt in range(attempts(line_load[m])):
            if attempt > 0:
                forget_start(line_load[m])
            status[m], iterations[m] = solve_coupled(
                gap[m],
                own[m],
                members,
                shared[m],
                loads[m],
                spacing,
                contact_modulus,
                longitudinal_curvature,
                table,
                bend,
                line_load[m],
                approach[m],
                half_length[m],
            )
            if status[m] == CONVERGED:
                break

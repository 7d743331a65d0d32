"""Slender contacts that wear bodies they share, all at once: `slender`, coupled.

The gap of contact k opens by what all contacts wear off the bodies that it touches,

    sum_j W_ij(a_j) q_j + c_i q_i + D_i + z_i = delta_k,   D_i = sum over its bodies and all l of
    their contacts c_l,i q_l,i,

and each of Newton's steps is a step of every contact by itself, from which `shared_bodies` makes
that of all together.
"""

from __future__ import annotations

import numpy as np

from wearsim.mechanics.half_length import fill_half_lengths, new_lengths
from wearsim.mechanics.influence import HIGHEST
from wearsim.mechanics.jit import kernel
from wearsim.mechanics.linear import solve_many_in_place
from wearsim.mechanics.shared_bodies import add_depths, solve_depths
from wearsim.mechanics.slender import (
    CONVERGED,
    GOING_ON,
    MAX_ITERATIONS,
    NO_CONVERGENCE,
    SINGULAR,
    TOO_FINE,
    log_scale_of,
    newton_system,
    settle,
    start_contact,
    take_step,
)
from wearsim.mechanics.slender_each import attempts, forget_start
from wearsim.types import FloatArray, IntArray


@kernel
def _ask_for_responses(size: int, matrix: FloatArray) -> None:
    """Append a unit rise of every strip's gap to the right-hand sides of a contact's system."""
    for row in range(size):
        for column in range(size):
            matrix[row, size + 2 + column] = 0.0
        matrix[row, size + 2 + row] = 1.0


@kernel
def _take_responses(
    k: int, size: int, risen: float, matrix: FloatArray, response: FloatArray, lift: FloatArray
) -> None:
    """Take from contact `k`'s solved system how its step and its approach follow its gap.

    `risen` is the rise of its load per approach, from `take_step`.
    """
    for column in range(size):
        total = 0.0
        for row in range(size):
            total += matrix[row, size + 2 + column]
        lift[k, column] = total / risen
        for row in range(size):
            fall = matrix[row, size + 2 + column] - matrix[row, size + 1] * lift[k, column]
            response[k, column, row] = fall


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
    unit = 1.0 / (np.pi * contact_modulus)
    index = np.empty((contacts, n), np.int64)
    surface, step = np.empty((contacts, n)), np.empty((contacts, n))
    response, lift = np.empty((contacts, n, n)), np.empty((contacts, n))
    work, matrix = np.empty((2, n)), np.empty((n, 2 + 2 * n))
    log_scale = log_scale_of(contact_modulus, longitudinal_curvature, spacing)
    lengths = new_lengths(contacts, bend, log_scale)
    for k in range(contacts):
        for i in range(n):
            surface[k, i] = own[k, i] + shared[k, 0, i] + shared[k, 1, i]
        start_contact(k, gap, surface, contact_modulus, loads[k], spacing, line_load, approach)
    for iteration in range(1, MAX_ITERATIONS + 1):
        for k in range(contacts):
            for i in range(n):
                surface[k, i] = gap[k, i]
        add_depths(members, shared, line_load, surface)
        for k in range(contacts):
            size, widest = newton_system(
                k, own, table, unit, lengths, line_load, index, work, surface, matrix
            )
            if widest > HIGHEST:
                return TOO_FINE, iteration
            _ask_for_responses(size, matrix)
            if not solve_many_in_place(matrix, size, 2 + 2 * size):
                return SINGULAR, iteration
            risen = take_step(k, size, loads[k] / spacing, line_load, matrix, step, approach)
            if risen == 0.0:
                return SINGULAR, iteration
            _take_responses(k, size, risen, matrix, response, lift)
        if not solve_depths(members, shared, index, response, step, lift, approach):
            return SINGULAR, iteration
        status = settle(iteration, unit, surface, index, step, approach, line_load)
        if status == CONVERGED:
            fill_half_lengths(spacing, line_load, lengths, half_length)
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

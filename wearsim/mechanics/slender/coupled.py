"""Normal contact of slender patches that wear shared bodies.

The gap of contact k opens by the wear that all contacts cause on its bodies,

    sum_j W_ij(a_j) q_j + c_i q_i + D_i + z_i = delta_k,   D_i = sum over its bodies and all l of
    their contacts c_l,i q_l,i.

Each step of Newton's method consists of the steps of the separate contacts (`newton`), which
`body_elimination` turns into the coupled step.
"""

from __future__ import annotations

import numpy as np

from wearsim.mechanics.numerics.jit import kernel, subroutine
from wearsim.mechanics.numerics.lu import invert_factored
from wearsim.mechanics.slender.body_elimination import (
    add_depths,
    factor_depths,
    new_depth_system,
    solve_depths,
)
from wearsim.mechanics.slender.half_length import NEWTON_REACH, fill_half_lengths, new_half_lengths
from wearsim.mechanics.slender.influence import HIGHEST
from wearsim.mechanics.slender.newton import (
    CAUTIOUS,
    CONTINUE,
    CONVERGED,
    MAX_ITERATIONS,
    NO_CONVERGENCE,
    SINGULAR,
    TOO_FINE,
    check_convergence,
    least_gap,
    log_scales_of,
    start_contact,
    update_loads,
)
from wearsim.mechanics.slender.newton_step import (
    NewtonState,
    correct_residual,
    displace,
    factor_jacobian,
    new_newton_state,
    predict_surface,
    take_step,
)
from wearsim.types import FloatArray, IntArray


@subroutine
def _fill_responses(
    k: int, state: NewtonState, response: FloatArray, approach_slope: FloatArray
) -> None:
    """Fill the derivatives of contact `k`'s step and approach by its gap at constant load."""
    size, unit_load = state.size[k], state.unit_load
    invert_factored(state.matrix[k], size, state.order[k], response[k])
    for column in range(size):
        total = 0.0
        for row in range(size):
            total += response[k, column, row]
        approach_slope[k, column] = total / state.unit_load_sum[k]
        for row in range(size):
            response[k, column, row] -= unit_load[k, row] * approach_slope[k, column]


@subroutine
def solve_coupled(
    gap: FloatArray,
    compliance: FloatArray,
    bodies: IntArray,
    shared: FloatArray,
    loads: FloatArray,
    longitudinal_curvature: FloatArray,
    spacing: float,
    contact_modulus: float,
    table: FloatArray,
    curvature_influence: FloatArray,
    line_load: FloatArray,
    approach: FloatArray,
    half_length: FloatArray,
) -> tuple[int, int]:
    """Solve several coupled slender contacts, from starting line loads.

    Parameters
    ----------
    bodies : ndarray of int, shape (contacts, 2)
        Bodies that each contact shares with others, numbered from 0; -1 for none.
    shared : ndarray, shape (contacts, 2, strips)
        Depth that a contact wears off those bodies per unit of line load [m/(N/m)].
    gap, compliance, loads, longitudinal_curvature, spacing, contact_modulus
        As in `newton.solve_slender`.
    table, curvature_influence, line_load, approach, half_length
        Likewise.

    Returns
    -------
    status, iterations : int
        CONVERGED or the cause of failure; iterations of Newton's method.
    """
    contacts, n = gap.shape
    unit, before = 1.0 / (np.pi * contact_modulus), 0.0
    surface, work = np.empty((contacts, n)), np.empty((2, n))
    response, approach_slope = np.empty((contacts, n, n)), np.empty((contacts, n))
    state, system = new_newton_state(contacts, n), new_depth_system(bodies, n)
    log_scale = log_scales_of(contact_modulus, longitudinal_curvature, spacing)
    lengths = new_half_lengths(curvature_influence, log_scale, NEWTON_REACH)
    lowest = np.empty(contacts)
    for k in range(contacts):
        for i in range(n):
            surface[k, i] = compliance[k, i] + shared[k, 0, i] + shared[k, 1, i]
        start_contact(k, gap, surface, contact_modulus, loads[k], spacing, line_load, approach)
        lowest[k] = least_gap(k, gap)
        approach[k] -= lowest[k]
    for iteration in range(1, MAX_ITERATIONS + 1):
        for k in range(contacts):
            for i in range(n):
                surface[k, i] = gap[k, i] - lowest[k]
        add_depths(bodies, shared, line_load, surface)
        renewed = False
        for k in range(contacts):
            widest = displace(k, compliance, table, unit, lengths, line_load, work, surface, state)
            if widest > HIGHEST:
                return TOO_FINE, iteration
            if state.fresh[k]:
                if not factor_jacobian(k, state):
                    return SINGULAR, iteration
                _fill_responses(k, state, response, approach_slope)
                renewed = True
        if renewed and not factor_depths(bodies, shared, state.rows, response, system):
            return SINGULAR, iteration
        for sweep in range(2):
            for k in range(contacts):
                if sweep:
                    correct_residual(k, table, unit, line_load, lengths, state)
                take_step(k, loads[k] / spacing, line_load, state, approach)
            solve_depths(
                bodies, shared, state.rows, response, approach_slope, system, state.step, approach
            )
        change, left = update_loads(line_load, state, iteration > CAUTIOUS)
        for k in range(contacts):
            predict_surface(k, surface, state)
        add_depths(bodies, shared, state.change, surface)
        status, before = check_convergence(
            iteration, unit, before, change, left, surface, state, approach, line_load
        )
        if status == CONVERGED:
            fill_half_lengths(spacing, line_load, lengths, half_length)
            for k in range(contacts):
                approach[k] += lowest[k]
        if status != CONTINUE:
            return status, iteration
    return NO_CONVERGENCE, MAX_ITERATIONS


@kernel
def solve_each_coupled(
    gap: FloatArray,
    compliance: FloatArray,
    bodies: IntArray,
    shared: FloatArray,
    loads: FloatArray,
    longitudinal_curvature: FloatArray,
    spacing: float,
    contact_modulus: float,
    table: FloatArray,
    curvature_influence: FloatArray,
    line_load: FloatArray,
    approach: FloatArray,
    half_length: FloatArray,
    status: IntArray,
    iterations: IntArray,
) -> None:
    """Solve sets of coupled contacts, as `newton.solve_each` does for independent contacts.

    Parameters
    ----------
    gap, compliance, bodies, shared, loads, longitudinal_curvature : ndarray
    line_load, approach, half_length : ndarray
        As in `solve_coupled`, with the axis of the sets first, except for `bodies`.
    spacing, contact_modulus, table, curvature_influence
        As in `solve_coupled`.
    status, iterations : ndarray of int, shape (sets,)
        Filled with the values that `solve_coupled` returns.
    """
    for number in range(gap.shape[0]):
        for attempt in range(2 if np.any(line_load[number]) else 1):
            if attempt > 0:
                line_load[number] = 0.0
            status[number], iterations[number] = solve_coupled(
                gap[number],
                compliance[number],
                bodies,
                shared[number],
                loads[number],
                longitudinal_curvature[number],
                spacing,
                contact_modulus,
                table,
                curvature_influence,
                line_load[number],
                approach[number],
                half_length[number],
            )
            if status[number] == CONVERGED:
                break

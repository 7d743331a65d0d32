"""Newton step of contacts that wear shared bodies, by elimination of the contacts.

A contact that is solved separately responds to a change D of its gap with dq = r - S D at constant
load. The worn depths of the shared bodies then solve

    D_b = sum over the contacts l of b of c_lb (r_l - S_l sum over its bodies b' of D_b'),

a system with one unknown per body and loaded strip, whatever the number of contacts. It is factored
once and reused while the matrices S are unchanged.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from wearsim.mechanics.numerics.jit import subroutine
from wearsim.mechanics.numerics.lu import factor_in_place, invert_factored, solve_factored
from wearsim.mechanics.slender.newton_step import NewtonState
from wearsim.types import FloatArray, IntArray

SIDES = 2  # a contact touches a cylinder and a roller


class DepthSystem(NamedTuple):
    """Factored linear system of the bodies' worn depths.

    `number` is the unknown of each body's strip, -1 for none, (bodies, strips). `matrix` is stored
    by columns, `order` is the order of its equations, `right` its right-hand side and `depth` its
    solution [m]. `response` is S of each contact by columns: decrease of the line load, by row, per
    increase of the gap, by row, at constant load (contacts, strips, strips) [N/m^2], and
    `approach_slope` the increase of the approach per increase of the gap (contacts, strips).
    """

    number: IntArray
    matrix: FloatArray
    order: IntArray
    right: FloatArray
    depth: FloatArray
    response: FloatArray
    approach_slope: FloatArray


@subroutine
def new_depth_system(bodies: IntArray, n: int) -> DepthSystem:
    """Return an empty `DepthSystem` for the shared `bodies`, (contacts, 2), with `n` strips."""
    count = bodies.max() + 1
    size = count * n
    return DepthSystem(
        np.empty((count, n), np.int64),
        np.empty((size, size)),
        np.empty(size, np.int64),
        np.empty(size),
        np.empty(size),
        np.empty((len(bodies), n, n)),
        np.empty((len(bodies), n)),
    )


@subroutine
def fill_responses(k: int, state: NewtonState, system: DepthSystem) -> None:
    """Fill the derivatives of contact `k`'s step and approach by its gap at constant load."""
    size, response, approach_slope = state.size[k], system.response, system.approach_slope
    invert_factored(state.matrix[k], size, state.order[k], response[k])
    for column in range(size):
        total = 0.0
        for row in range(size):
            total += response[k, column, row]
        approach_slope[k, column] = total / state.unit_load_sum[k]
        for row in range(size):
            response[k, column, row] -= state.unit_load[k, row] * approach_slope[k, column]


@subroutine
def add_depths(
    bodies: IntArray, shared: FloatArray, line_load: FloatArray, surface: FloatArray
) -> None:
    """Add the depth that all contacts wear off the shared bodies to `surface`.

    Parameters
    ----------
    bodies : ndarray of int, shape (contacts, 2)
        The shared bodies of each contact, -1 for none.
    shared : ndarray, shape (contacts, 2, strips)
        Depth of those bodies per unit of line load [m/(N/m)].
    line_load, surface : ndarray, shape (contacts, strips)
        Line load [N/m]; gap of each contact, updated [m].
    """
    contacts, n = line_load.shape
    depth = np.zeros((bodies.max() + 1, n))
    for k in range(contacts):
        for side in range(SIDES):
            b = bodies[k, side]
            if b >= 0:
                for i in range(n):
                    depth[b, i] += shared[k, side, i] * line_load[k, i]
    for k in range(contacts):
        for side in range(SIDES):
            b = bodies[k, side]
            if b >= 0:
                for i in range(n):
                    surface[k, i] += depth[b, i]


@subroutine
def _number_unknowns(
    bodies: IntArray, shared: FloatArray, index: IntArray, number: IntArray
) -> int:
    """Assign unknowns to the strips of bodies that wear under a contact, -1 to the others."""
    contacts, n = index.shape
    number[:] = -1
    for k in range(contacts):
        for side in range(SIDES):
            b = bodies[k, side]
            if b >= 0:
                for i in range(n):
                    if index[k, i] >= 0 and shared[k, side, i] > 0.0:
                        number[b, i] = 0
    count = 0
    for b in range(number.shape[0]):
        for i in range(n):
            if number[b, i] >= 0:
                number[b, i] = count
                count += 1
    return count


@subroutine
def factor_depths(
    bodies: IntArray, shared: FloatArray, index: IntArray, system: DepthSystem
) -> bool:
    """Assemble and factor the system of the bodies' depths.

    Parameters
    ----------
    bodies, shared
        As in `add_depths`.
    index : ndarray of int, shape (contacts, strips)
        Row of each strip in its contact, -1 outside the contact.
    system : DepthSystem
        Filled, with the responses of the contacts from `fill_responses`.

    Returns
    -------
    bool
        False if the system is singular.
    """
    count, matrix = _number_unknowns(bodies, shared, index, system.number), system.matrix
    for i in range(count):
        matrix[i, :count] = 0.0
        matrix[i, i] = 1.0
    for k in range(bodies.shape[0]):
        for side in range(SIDES):
            for other in range(SIDES):
                if bodies[k, side] >= 0 and bodies[k, other] >= 0:
                    _add_contact_terms(k, side, other, bodies, shared, index, system)
    return factor_in_place(matrix, count, system.order)


@subroutine
def solve_depths(
    bodies: IntArray,
    shared: FloatArray,
    index: IntArray,
    system: DepthSystem,
    step: FloatArray,
    approach: FloatArray,
) -> None:
    """Turn the separate steps of the contacts into the coupled step.

    Parameters
    ----------
    bodies, shared, index
        As in `factor_depths`.
    system : DepthSystem
        From `factor_depths`.
    step : ndarray, shape (contacts, strips)
        Change of line load by row [N/m]: r of the separate contact, replaced by the coupled one.
    approach : ndarray, shape (contacts,)
        Approach without the bodies' wear, replaced by the one with it [m].
    """
    contacts, n = index.shape
    right, number = system.right, system.number
    count = number.max() + 1
    right[:count] = 0.0
    for k in range(contacts):
        for side in range(SIDES):
            for i in range(n):
                if bodies[k, side] >= 0 and index[k, i] >= 0 and shared[k, side, i] > 0.0:
                    unknown = number[bodies[k, side], i]
                    right[unknown] += shared[k, side, i] * step[k, index[k, i]]
    solve_factored(system.matrix, count, system.order, right, system.depth)
    for k in range(contacts):
        _apply_body_wear(k, bodies, index, system, step, approach)


@subroutine
def _add_contact_terms(
    k: int,
    side: int,
    other: int,
    bodies: IntArray,
    shared: FloatArray,
    index: IntArray,
    system: DepthSystem,
) -> None:
    """Add the wear of contact `k`'s body on `side` per worn depth of its body on side `other`."""
    n, number = index.shape[1], system.number
    worn_body, opening_body = bodies[k, side], bodies[k, other]
    for j in range(n):
        column, unknown = index[k, j], number[opening_body, j]
        if column < 0 or unknown < 0:
            continue
        for i in range(n):
            row = index[k, i]
            if row >= 0 and shared[k, side, i] > 0.0:
                system.matrix[unknown, number[worn_body, i]] += (
                    shared[k, side, i] * system.response[k, column, row]
                )


@subroutine
def _apply_body_wear(
    k: int,
    bodies: IntArray,
    index: IntArray,
    system: DepthSystem,
    step: FloatArray,
    approach: FloatArray,
) -> None:
    """Correct the step and the approach of contact `k` for the worn depths of its bodies."""
    n, size = index.shape[1], index[k].max() + 1
    for i in range(n):
        column, opening = index[k, i], 0.0
        if column < 0:
            continue
        for side in range(SIDES):
            b = bodies[k, side]
            if b >= 0 and system.number[b, i] >= 0:
                opening += system.depth[system.number[b, i]]
        approach[k] += system.approach_slope[k, column] * opening
        for row in range(size):
            step[k, row] -= system.response[k, column, row] * opening

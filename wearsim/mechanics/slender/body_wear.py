"""Wear of bodies that several contacts share, eliminated from the steps of Newton's method.

The unknown worn depths of the shared bodies form one system of equations. With the responses of the
separate contacts to their gaps it turns their separate steps into the coupled step. A strip of a
body that only one contact touches is no unknown: its wear is a compliance of that contact.
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
    by columns, and `depth` is its solution [m]. `response` is S of each contact by columns:
    decrease of the line load, by row, per increase of the gap, by row, at constant load (contacts,
    strips, strips) [N/m^2], and `approach_slope` the increase of the approach per increase of the
    gap (contacts, strips).
    """

    number: IntArray
    matrix: FloatArray
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
        np.empty(size),
        np.empty((len(bodies), n, n)),
        np.empty((len(bodies), n)),
    )


@subroutine
def fill_responses(k: int, state: NewtonState, system: DepthSystem) -> None:
    """Fill the derivatives of contact `k`'s step and approach by its gap at constant load."""
    size, response, approach_slope = state.size[k], system.response, system.approach_slope
    unit_load, unit_load_sum = state.unit_load, state.unit_load_sum[k]
    invert_factored(state.matrix[k], size, response[k])
    for column in range(size):
        total = 0.0
        for row in range(size):
            total += response[k, column, row]
        approach_slope[k, column] = total / unit_load_sum
        for row in range(size):
            response[k, column, row] -= unit_load[k, row] * approach_slope[k, column]


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
def number_depths(
    bodies: IntArray,
    own: FloatArray,
    shared: FloatArray,
    state: NewtonState,
    system: DepthSystem,
    softness: FloatArray,
) -> None:
    """Assign unknowns to the strips of bodies that several contacts touch, -1 to the others.

    Parameters
    ----------
    bodies, shared
        As in `add_depths`.
    own : ndarray, shape (contacts, strips)
        Wear compliance of the separate contacts [m/(N/m)].
    state : NewtonState
        With the rows of the contacts. Contacts whose softness changes need a new Jacobian.
    system : DepthSystem
        Filled: `number`.
    softness : ndarray, shape (contacts, strips)
        Filled: wear compliance of each contact with that of the strips it alone touches [m/(N/m)].
    """
    number, place = system.number, state.place
    contacts, n = state.rows.shape
    number[:] = 0
    for k in range(contacts):
        for side in range(SIDES):
            b = bodies[k, side]
            for row in range(state.size[k] if b >= 0 else 0):
                number[b, place[k, row]] += 1
    count = 0
    for b in range(number.shape[0]):
        for i in range(n):
            several = number[b, i] > 1
            number[b, i] = count if several else -1
            count += int(several)
    for k in range(contacts):
        for row in range(state.size[k]):
            i = place[k, row]
            alone = own[k, i]
            for side in range(SIDES):
                b = bodies[k, side]
                if b >= 0 and number[b, i] < 0:
                    alone += shared[k, side, i]
            if softness[k, i] != alone:
                softness[k, i] = alone
                state.fresh[k] = True


@subroutine
def factor_depths(
    bodies: IntArray, shared: FloatArray, state: NewtonState, system: DepthSystem
) -> bool:
    """Assemble and factor the system of the bodies' depths.

    Parameters
    ----------
    bodies, shared
        As in `add_depths`.
    state : NewtonState
        With the rows of the contacts.
    system : DepthSystem
        Filled, with `number` and with the responses of the contacts from `fill_responses`.

    Returns
    -------
    bool
        False if the system is singular.
    """
    matrix, number, response, place = system.matrix, system.number, system.response, state.place
    count = number.max() + 1
    for i in range(count):
        for j in range(count):
            matrix[i, j] = 0.0
        matrix[i, i] = 1.0
    for k in range(bodies.shape[0]):
        size = state.size[k]
        for side in range(SIDES):
            for other in range(SIDES):
                worn, opened = bodies[k, side], bodies[k, other]
                for column in range(size if worn >= 0 and opened >= 0 else 0):
                    unknown = number[opened, place[k, column]]
                    for row in range(size if unknown >= 0 else 0):
                        i = place[k, row]
                        if number[worn, i] >= 0:
                            wear = shared[k, side, i] * response[k, column, row]
                            matrix[unknown, number[worn, i]] += wear
    return factor_in_place(matrix, count)


@subroutine
def solve_depths(
    bodies: IntArray,
    shared: FloatArray,
    state: NewtonState,
    system: DepthSystem,
    approach: FloatArray,
) -> None:
    """Turn the separate steps of the contacts into the coupled step.

    Parameters
    ----------
    bodies, shared
        As in `add_depths`.
    state : NewtonState
        With the steps of the separate contacts, replaced by the coupled ones.
    system : DepthSystem
        From `factor_depths`.
    approach : ndarray, shape (contacts,)
        Approach without the bodies' wear, replaced by the one with it [m].
    """
    depth, number, response = system.depth, system.number, system.response
    place, step, count = state.place, state.step, number.max() + 1
    for unknown in range(count):
        depth[unknown] = 0.0
    for k in range(bodies.shape[0]):
        for side in range(SIDES):
            b = bodies[k, side]
            for row in range(state.size[k] if b >= 0 else 0):
                i = place[k, row]
                if number[b, i] >= 0:
                    depth[number[b, i]] += shared[k, side, i] * step[k, row]
    solve_factored(system.matrix, count, depth)
    for k in range(bodies.shape[0]):
        size = state.size[k]
        for column in range(size):
            opening = 0.0
            for side in range(SIDES):
                b = bodies[k, side]
                if b >= 0 and number[b, place[k, column]] >= 0:
                    opening += depth[number[b, place[k, column]]]
            approach[k] += system.approach_slope[k, column] * opening
            for row in range(size if opening != 0.0 else 0):
                step[k, row] -= response[k, column, row] * opening

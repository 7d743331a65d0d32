"""Wear of bodies that several contacts share, eliminated from the steps of Newton's method.

The unknown worn depths of the shared bodies form one system of equations. With the responses of the
separate contacts to their gaps it turns their separate steps into the coupled step. A strip of a
body that only one contact touches is no unknown: its wear is a compliance of that contact.

As a contact touches one body of each kind, bodies of one kind, such as the stations of a cam, are
coupled only through those of the other, its rollers. The depths of the more numerous kind are
eliminated body by body; those of the other kind remain, the outer bodies.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from wearsim.mechanics.numerics.jit import subroutine
from wearsim.mechanics.numerics.lu import (
    PANEL,
    factor_in_place,
    invert_in_place,
    solve_factored,
    whole_panels,
)
from wearsim.mechanics.slender.newton_step import NewtonState
from wearsim.types import FloatArray, IntArray, SingleArray

SIDES = 2  # a contact touches a cylinder and a roller


class DepthSystem(NamedTuple):
    """Factored linear system of the bodies' worn depths.

    Its unknowns are stored by body where they are eliminated, and together for the outer bodies.
    Matrices are stored by columns.

    `number` is the unknown of each body's strip, counted within an eliminated body and over all
    outer bodies, -1 for none, (bodies, strips). `size` is the number of unknowns of each body, 0 of
    an outer one, and `total` that of all outer bodies, (1,). `touched` are the eliminated and the
    outer body of each contact, -1 for none, (contacts, 2), and `side` their columns in `bodies`.

    `block` holds the coefficients of the depths of an eliminated body in its own equations,
    (bodies, strips, strips), `across` its depths per depth of the outer bodies, negative, (bodies,
    unknowns, strips), and `outer` the system of the outer bodies after elimination. `depth`
    and `outer_depth` are the solution [m].

    `matrix` of the Newton state holds S of each contact by columns: decrease of the line load, by
    row, per increase of the gap, by row, at constant load [N/m^2]. `approach_slope` is the increase
    of the approach per increase of the gap (contacts, strips). `gap` [m], `change` [N/m], `unknown`
    and `softness` [m/(N/m)] are work space by row, the last two for both kinds of bodies.
    """

    number: IntArray
    size: IntArray
    touched: IntArray
    side: IntArray
    block: SingleArray
    across: SingleArray
    outer: SingleArray
    depth: SingleArray
    outer_depth: SingleArray
    total: IntArray
    approach_slope: SingleArray
    gap: SingleArray
    change: SingleArray
    unknown: IntArray
    softness: SingleArray


@subroutine
def new_depth_system(bodies: IntArray, n: int) -> DepthSystem:
    """Return an empty `DepthSystem` for the shared `bodies`, (contacts, 2), with `n` strips.

    The bodies of the first column have the lower numbers.
    """
    contacts, count = bodies.shape[0], bodies.max() + 1
    first = bodies[:, 0].max() + 1  # number of bodies in the first column
    inner = 0 if 2 * first >= count else 1
    m, size = whole_panels(n), whole_panels(min(first, count - first) * n)
    touched, side = np.empty((contacts, SIDES), np.int64), np.empty(SIDES, np.int64)
    side[0], side[1] = inner, 1 - inner
    for k in range(contacts):
        for kind in range(SIDES):
            touched[k, kind] = bodies[k, side[kind]]
    return DepthSystem(
        np.empty((count, n), np.int64),
        np.empty(count, np.int64),
        touched,
        side,
        np.empty((count, m, m), np.float32),
        np.empty((count, size, m), np.float32),
        np.empty((size, size), np.float32),
        np.empty((count, m), np.float32),
        np.empty(size, np.float32),
        np.zeros(1, np.int64),
        np.empty((contacts, n), np.float32),
        np.empty(m, np.float32),
        np.empty(n, np.float32),
        np.empty((SIDES, n), np.int64),
        np.empty((SIDES, n), np.float32),
    )


@subroutine
def fill_responses(k: int, state: NewtonState, system: DepthSystem) -> bool:
    """Replace the Jacobian of contact `k` by S, and fill the loads and the approach per gap.

    Returns False if the Jacobian is singular.
    """
    size, matrix, approach_slope = state.size[k], state.matrix, system.approach_slope
    unit_load, total = state.unit_load, 0.0
    if not invert_in_place(matrix[k], size):
        return False
    unit_load[k] = 0.0
    for column in range(size):
        s0 = s1 = s2 = s3 = np.float32(0.0)
        for row in range(0, size, PANEL):
            s0, s1 = s0 + matrix[k, column, row], s1 + matrix[k, column, row + 1]
            s2, s3 = s2 + matrix[k, column, row + 2], s3 + matrix[k, column, row + 3]
        approach_slope[k, column] = (s0 + s1) + (s2 + s3)
        total += float(approach_slope[k, column])
        for row in range(size):
            unit_load[k, row] += matrix[k, column, row]
    state.unit_load_sum[k] = total
    for column in range(size):
        approach_slope[k, column] /= total
        for row in range(size):
            matrix[k, column, row] -= unit_load[k, row] * approach_slope[k, column]
    return True


@subroutine
def open_gaps(k: int, state: NewtonState, system: DepthSystem, change: SingleArray) -> float:
    """Add the change of the line loads of contact `k`, by row, as its gaps open by `gap`.

    Returns the increase of the approach [m].
    """
    size, matrix, gap, rise = state.size[k], state.matrix, system.gap, 0.0
    for column in range(size, whole_panels(size)):
        gap[column] = 0.0
    for column in range(0, size, PANEL):
        c1, c2, c3 = column + 1, column + 2, column + 3
        g0, g1, g2, g3 = gap[column], gap[c1], gap[c2], gap[c3]
        for row in range(size):
            change[row] -= (matrix[k, column, row] * g0 + matrix[k, c1, row] * g1) + (
                matrix[k, c2, row] * g2 + matrix[k, c3, row] * g3
            )
    for column in range(size):
        rise += float(system.approach_slope[k, column] * gap[column])
    return rise


@subroutine
def fill_separate_step(k: int, state: NewtonState, system: DepthSystem) -> float:
    """Fill the step of contact `k` at constant load, and return its approach [m]."""
    for row in range(state.size[k]):
        system.gap[row], state.step[k, row] = -state.missing[k, row], 0.0
    return open_gaps(k, state, system, state.step[k])


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
    outer = 0
    for b in range(number.shape[0]):
        eliminated = False
        for k in range(contacts):
            eliminated = eliminated or system.touched[k, 0] == b
        count = 0 if eliminated else outer
        for i in range(n):
            several = number[b, i] > 1
            number[b, i] = count if several else -1
            count += int(several)
        system.size[b] = count if eliminated else 0
        outer = outer if eliminated else count
    system.total[0] = outer
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
def factor_depths(shared: FloatArray, state: NewtonState, system: DepthSystem) -> bool:
    """Assemble and factor the system of the bodies' depths.

    Parameters
    ----------
    shared
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
    number, size, across, outer = system.number, system.size, system.across, system.outer
    response, place, block = state.matrix, state.place, system.block
    unknown, softness = system.unknown, system.softness
    count = system.total[0]
    for u in range(count):
        for v in range(count):
            outer[u, v] = 0.0
        outer[u, u] = 1.0
    for b in range(len(size)):
        for u in range(size[b]):
            for v in range(size[b]):
                block[b, u, v] = 0.0
            block[b, u, u] = 1.0
        for u in range(count):
            for v in range(size[b]):
                across[b, u, v] = 0.0
    for k in range(len(response)):
        b, c, rows = system.touched[k, 0], system.touched[k, 1], state.size[k]
        for kind in range(SIDES):
            body, side = system.touched[k, kind], system.side[kind]
            for row in range(rows):  # a strip without an unknown adds 0 to the first one
                i = place[k, row]
                number_here = number[body, i] if body >= 0 else -1
                unknown[kind, row] = max(number_here, 0)
                softness[kind, row] = shared[k, side, i] if number_here >= 0 else 0.0
        for column in range(rows):
            j = place[k, column]
            opened = number[b, j] if b >= 0 else -1
            for row in range(rows if opened >= 0 else 0):
                block[b, opened, unknown[0, row]] += softness[0, row] * response[k, column, row]
            opened = number[c, j] if c >= 0 else -1
            for row in range(rows if opened >= 0 else 0):
                outer[opened, unknown[1, row]] += softness[1, row] * response[k, column, row]
            for row in range(rows if opened >= 0 and b >= 0 else 0):
                across[b, opened, unknown[0, row]] += softness[0, row] * response[k, column, row]
    for b in range(len(size)):
        if not factor_in_place(block[b], size[b]):
            return False
        for u in range(count):
            solve_factored(block[b], size[b], across[b, u])
    for k in range(len(response)):
        b = system.touched[k, 0]
        for u in range(count if b >= 0 else 0):
            subtract_outer_wear(k, shared, state, system, across[b, u], outer[u])
    return factor_in_place(outer, count)


@subroutine
def subtract_outer_wear(
    k: int,
    shared: FloatArray,
    state: NewtonState,
    system: DepthSystem,
    depth: SingleArray,
    result: SingleArray,
) -> None:
    """Subtract the wear of the outer body of contact `k` due to depths of its eliminated body.

    Parameters
    ----------
    shared, state, system
        As in `factor_depths`.
    depth : ndarray
        Depths of the eliminated body, by unknown.
    result : ndarray
        Wear of the outer bodies, by unknown; changed.
    """
    b, c, size, change = system.touched[k, 0], system.touched[k, 1], state.size[k], system.change
    number, place, outer_side = system.number, state.place, system.side[1]
    if c < 0:
        return
    for row in range(size):
        unknown = number[b, place[k, row]]
        system.gap[row], change[row] = depth[unknown] if unknown >= 0 else 0.0, 0.0
    open_gaps(k, state, system, change)
    for row in range(size):
        i = place[k, row]
        if number[c, i] >= 0:
            result[number[c, i]] += shared[k, outer_side, i] * change[row]


@subroutine
def solve_depths(
    shared: FloatArray,
    state: NewtonState,
    system: DepthSystem,
    approach: FloatArray,
) -> None:
    """Turn the separate steps of the contacts into the coupled step.

    Parameters
    ----------
    shared
        As in `add_depths`.
    state : NewtonState
        With the steps of the separate contacts, replaced by the coupled ones.
    system : DepthSystem
        From `factor_depths`.
    approach : ndarray, shape (contacts,)
        Approach without the bodies' wear, replaced by the one with it [m].
    """
    depth, outer_depth, number = system.depth, system.outer_depth, system.number
    place, step, size, count = state.place, state.step, system.size, system.total[0]
    depth[:] = 0.0
    outer_depth[:] = 0.0
    for k in range(len(step)):
        b, c = system.touched[k, 0], system.touched[k, 1]
        for row in range(state.size[k]):
            i = place[k, row]
            if b >= 0 and number[b, i] >= 0:
                depth[b, number[b, i]] += shared[k, system.side[0], i] * step[k, row]
            if c >= 0 and number[c, i] >= 0:
                outer_depth[number[c, i]] += shared[k, system.side[1], i] * step[k, row]
    for b in range(len(size)):
        solve_factored(system.block[b], size[b], depth[b])
    for k in range(len(step)):
        b = system.touched[k, 0]
        if b >= 0:
            subtract_outer_wear(k, shared, state, system, depth[b], outer_depth)
    solve_factored(system.outer, count, outer_depth)
    for b in range(len(size)):
        for u in range(count):
            for unknown in range(size[b]):
                depth[b, unknown] -= system.across[b, u, unknown] * outer_depth[u]
    for k in range(len(step)):
        b, c = system.touched[k, 0], system.touched[k, 1]
        for row in range(state.size[k]):
            i, opening = place[k, row], 0.0
            if b >= 0 and number[b, i] >= 0:
                opening += float(depth[b, number[b, i]])
            if c >= 0 and number[c, i] >= 0:
                opening += float(outer_depth[number[c, i]])
            system.gap[row] = opening
        approach[k] += open_gaps(k, state, system, step[k])

"""Newton's step for contacts that wear bodies they share, by elimination of the contacts.

Every contact by itself answers a change D of its gap with dq = r - S D, its load held. The depths
of the shared bodies then follow from

    D_b = sum over the contacts l of b of c_lb (r_l - S_l sum over its bodies b' of D_b'),

a system as large as the bodies have strips under load, however many contacts there are. It is
factored once for as long as the S serve.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from wearsim.mechanics.numerics.jit import kernel
from wearsim.mechanics.numerics.lu import factor_in_place, solve_factored
from wearsim.types import FloatArray, IntArray

SIDES = 2  # a contact touches a cylinder and a roller


class Depths(NamedTuple):
    """The factored system of the bodies' depths: number of every strip, -1 where it has no depth.

    The number (bodies, strips); how many there are (1,); the system by columns and the order of its
    equations; its right-hand side and its solution.
    """

    number: IntArray
    unknowns: IntArray
    matrix: FloatArray
    order: IntArray
    right: FloatArray
    depth: FloatArray


@kernel
def count_bodies(members: IntArray) -> int:
    """Return how many bodies contacts share, from their numbers, shape (contacts, 2)."""
    count = 0
    for k in range(members.shape[0]):
        for side in range(SIDES):
            count = max(count, members[k, side] + 1)
    return count


@kernel
def new_depths(members: IntArray, n: int) -> Depths:
    """Return the `Depths` of bodies with `n` strips that have no system yet."""
    bodies = count_bodies(members)
    most = bodies * n
    return Depths(
        np.empty((bodies, n), np.int64),
        np.zeros(1, np.int64),
        np.empty((most, most)),
        np.empty(most, np.int64),
        np.empty(most),
        np.empty(most),
    )


@kernel
def add_depths(
    members: IntArray, shared: FloatArray, line_load: FloatArray, surface: FloatArray
) -> None:
    """Add to every contact's `surface` what all contacts wear off its shared bodies.

    Parameters
    ----------
    members : ndarray of int, shape (contacts, 2)
        The shared bodies of each contact, -1 for none.
    shared : ndarray, shape (contacts, 2, strips)
        Depth of those bodies per unit of line load [m/(N/m)].
    line_load, surface : ndarray, shape (contacts, strips)
        [N/m]; [m], added to.
    """
    contacts, n = line_load.shape
    depth = np.zeros((count_bodies(members), n))
    for k in range(contacts):
        for side in range(SIDES):
            b = members[k, side]
            if b >= 0:
                for i in range(n):
                    depth[b, i] += shared[k, side, i] * line_load[k, i]
    for k in range(contacts):
        for side in range(SIDES):
            b = members[k, side]
            if b >= 0:
                for i in range(n):
                    surface[k, i] += depth[b, i]


@kernel
def _number_unknowns(
    members: IntArray, shared: FloatArray, index: IntArray, number: IntArray
) -> int:
    """Give the strips of bodies that wear under a contact their numbers, the others -1."""
    contacts, n = index.shape
    for b in range(number.shape[0]):
        for i in range(n):
            number[b, i] = -1
    for k in range(contacts):
        for side in range(SIDES):
            b = members[k, side]
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


@kernel
def factor_depths(
    members: IntArray, shared: FloatArray, index: IntArray, response: FloatArray, depths: Depths
) -> bool:
    """Set up and factor the system of the bodies' depths.

    Parameters
    ----------
    members, shared
        As in `add_depths`.
    index : ndarray of int, shape (contacts, strips)
        Row of every strip in its contact, -1 outside it.
    response : ndarray, shape (contacts, strips, strips)
        S by columns: fall of line load, by row, per rise of the gap, by row, at held load [N/m^2].
    depths : Depths
        Filled.

    Returns
    -------
    bool
        False if the system is singular.
    """
    count, matrix = _number_unknowns(members, shared, index, depths.number), depths.matrix
    depths.unknowns[0] = count
    for i in range(count):
        for j in range(count):
            matrix[i, j] = 0.0
        matrix[i, i] = 1.0
    for k in range(members.shape[0]):
        for side in range(SIDES):
            for other in range(SIDES):
                if members[k, side] >= 0 and members[k, other] >= 0:
                    _add_contact(k, side, other, members, shared, index, response, depths)
    return factor_in_place(matrix, count, depths.order)


@kernel
def solve_depths(
    members: IntArray,
    shared: FloatArray,
    index: IntArray,
    response: FloatArray,
    lift: FloatArray,
    depths: Depths,
    step: FloatArray,
    approach: FloatArray,
) -> None:
    """Turn each contact's own step into the step of all together.

    Parameters
    ----------
    members, shared, index, response
        As in `factor_depths`.
    lift : ndarray, shape (contacts, strips)
        Rise of the approach per rise of the gap, by row.
    depths : Depths
        From `factor_depths`.
    step : ndarray, shape (contacts, strips)
        Change of line load by row, r before and with the bodies' wear after [N/m].
    approach : ndarray, shape (contacts,)
        Approach without and with the bodies' wear [m].
    """
    contacts, n = index.shape
    count, right, number = depths.unknowns[0], depths.right, depths.number
    for place in range(count):
        right[place] = 0.0
    for k in range(contacts):
        for side in range(SIDES):
            for i in range(n):
                if members[k, side] >= 0 and index[k, i] >= 0 and shared[k, side, i] > 0.0:
                    place = number[members[k, side], i]
                    right[place] += shared[k, side, i] * step[k, index[k, i]]
    solve_factored(depths.matrix, count, depths.order, right, depths.depth)
    for k in range(contacts):
        _open_contact(k, members, index, response, lift, depths, step, approach)


@kernel
def _add_contact(
    k: int,
    side: int,
    other: int,
    members: IntArray,
    shared: FloatArray,
    index: IntArray,
    response: FloatArray,
    depths: Depths,
) -> None:
    """Add how contact `k` wears its body on one side while that on a side opens its gap."""
    n, number = index.shape[1], depths.number
    worn, opening = members[k, side], members[k, other]
    for j in range(n):
        column, place = index[k, j], number[opening, j]
        if column < 0 or place < 0:
            continue
        for i in range(n):
            row = index[k, i]
            if row >= 0 and shared[k, side, i] > 0.0:
                change = shared[k, side, i] * response[k, column, row]
                depths.matrix[place, number[worn, i]] += change


@kernel
def _open_contact(
    k: int,
    members: IntArray,
    index: IntArray,
    response: FloatArray,
    lift: FloatArray,
    depths: Depths,
    step: FloatArray,
    approach: FloatArray,
) -> None:
    """Take from contact `k`'s step and approach what the depths of its bodies change in them."""
    n, size = index.shape[1], 0
    for i in range(n):
        size = max(size, index[k, i] + 1)
    for i in range(n):
        column, opened = index[k, i], 0.0
        if column < 0:
            continue
        for side in range(SIDES):
            b = members[k, side]
            if b >= 0 and depths.number[b, i] >= 0:
                opened += depths.depth[depths.number[b, i]]
        approach[k] += lift[k, column] * opened
        for row in range(size):
            step[k, row] -= response[k, column, row] * opened

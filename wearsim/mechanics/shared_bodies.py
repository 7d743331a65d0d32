"""Newton's step for contacts that wear bodies they share, by elimination of the contacts.

Every contact by itself answers a change D of its gap with dq = r - S D, its load held. The depths
of the shared bodies then follow from

    D_b = sum over the contacts l of b of c_lb (r_l - S_l sum over its bodies b' of D_b'),

a system as large as the bodies have strips under load, however many contacts there are.
"""

from __future__ import annotations

import numpy as np

from wearsim.mechanics.jit import kernel
from wearsim.mechanics.linear import solve_in_place
from wearsim.types import FloatArray, IntArray

SIDES = 2  # a contact touches a cylinder and a roller


@kernel
def count_bodies(members: IntArray) -> int:
    """Return how many bodies contacts share, from their numbers, shape (contacts, 2)."""
    count = 0
    for k in range(members.shape[0]):
        for side in range(SIDES):
            count = max(count, members[k, side] + 1)
    return count


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
def solve_depths(
    members: IntArray,
    shared: FloatArray,
    index: IntArray,
    response: FloatArray,
    step: FloatArray,
    lift: FloatArray,
    approach: FloatArray,
) -> bool:
    """Turn each contact's own step into the step of all together.

    Parameters
    ----------
    members, shared
        As in `add_depths`.
    index : ndarray of int, shape (contacts, strips)
        Row of every strip in its contact, -1 outside it.
    response : ndarray, shape (contacts, strips, strips)
        S: fall of line load, by row, per rise of the gap, by row, at held load [N/m^2].
    step : ndarray, shape (contacts, strips)
        Change of line load by row, r before and with the bodies' wear after [N/m].
    lift : ndarray, shape (contacts, strips)
        Rise of the approach per rise of the gap, by row.
    approach : ndarray, shape (contacts,)
        Approach without and with the bodies' wear [m].

    Returns
    -------
    bool
        False if the system is singular.
    """
    contacts, n = index.shape
    number = np.empty((count_bodies(members), n), np.int64)
    count = _number_unknowns(members, shared, index, number)
    matrix = np.zeros((count, count + 1))
    for i in range(count):
        matrix[i, i] = 1.0
    for k in range(contacts):
        for side in range(SIDES):
            if members[k, side] >= 0:
                _add_contact(k, side, members, shared, index, number, response, step, matrix)
    if not solve_in_place(matrix, count, count + 1):
        return False
    change = np.empty(n)
    for k in range(contacts):
        size = _opened(k, members, index, number, matrix, change)
        for column in range(size):
            approach[k] += lift[k, column] * change[column]
            for row in range(size):
                step[k, row] -= response[k, column, row] * change[column]
    return True


@kernel
def _add_contact(
    k: int,
    side: int,
    members: IntArray,
    shared: FloatArray,
    index: IntArray,
    number: IntArray,
    response: FloatArray,
    step: FloatArray,
    matrix: FloatArray,
) -> None:
    """Add to the bodies' system what contact `k` wears off its body on one side."""
    n, last = index.shape[1], matrix.shape[0]
    b = members[k, side]
    for i in range(n):
        row, place = index[k, i], number[b, i]
        wear = shared[k, side, i]
        if row < 0 or place < 0 or wear == 0.0:
            continue
        matrix[place, last] += wear * step[k, row]
        for other in range(SIDES):
            b2 = members[k, other]
            if b2 < 0:
                continue
            for j in range(n):
                column = index[k, j]
                if column >= 0 and number[b2, j] >= 0:
                    matrix[place, number[b2, j]] += wear * response[k, column, row]


@kernel
def _opened(
    k: int,
    members: IntArray,
    index: IntArray,
    number: IntArray,
    matrix: FloatArray,
    change: FloatArray,
) -> int:
    """Fill the change of contact `k`'s gap by row; return the number of rows."""
    n, last, size = index.shape[1], matrix.shape[0], 0
    for i in range(n):
        row = index[k, i]
        if row < 0:
            continue
        size += 1
        change[row] = 0.0
        for side in range(SIDES):
            b = members[k, side]
            if b >= 0 and number[b, i] >= 0:
                change[row] += matrix[number[b, i], last]
    return size

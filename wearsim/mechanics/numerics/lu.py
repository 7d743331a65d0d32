"""Dense linear algebra small enough to own: the same bits whatever the BLAS and its threads.

A system is stored by its columns: ``matrix[j, i]`` is what unknown j contributes to equation i.
So every inner loop runs along a row in memory, and a row is a column of the system. Inner loops
that do not start at 0 count in unsigned numbers: numba then need not look out for negative indices,
and they are vectorised, which makes them three times faster.
"""

from __future__ import annotations

import numpy as np

from wearsim.mechanics.numerics.jit import kernel
from wearsim.types import FloatArray, IntArray

PANEL = 4  # unknowns taken off together; the loops over a panel's rows are written out for four


@kernel
def _pivot(matrix: FloatArray, size: int, k: int, order: IntArray) -> bool:
    """Exchange equations so that unknown `k` has its greatest coefficient in the k-th."""
    best = k
    for i in range(k + 1, size):
        if abs(matrix[k, i]) > abs(matrix[k, best]):
            best = i
    if best != k:
        order[k], order[best] = order[best], order[k]
        for j in range(size):
            held = matrix[j, k]
            matrix[j, k] = matrix[j, best]
            matrix[j, best] = held
    sound: bool = abs(matrix[k, k]) > 0.0
    return sound


@kernel
def _take_off_four(matrix: FloatArray, size: int, start: int) -> None:
    """Take a full panel's four unknowns off all that follow."""
    s1, s2, s3 = start + 1, start + 2, start + 3
    r0, r1, r2, r3 = matrix[start], matrix[s1], matrix[s2], matrix[s3]
    p0, p1, p2, p3 = 1.0 / r0[start], 1.0 / r1[s1], 1.0 / r2[s2], 1.0 / r3[s3]
    for i in range(start + PANEL, size):
        row = matrix[i]
        f0 = row[start] * p0
        f1 = (row[s1] - f0 * r0[s1]) * p1
        f2 = (row[s2] - f0 * r0[s2] - f1 * r1[s2]) * p2
        f3 = (row[s3] - f0 * r0[s3] - f1 * r1[s3] - f2 * r2[s3]) * p3
        row[start], row[s1], row[s2], row[s3] = f0, f1, f2, f3
        for j in range(np.uint64(start + PANEL), np.uint64(size)):
            row[j] -= (f0 * r0[j] + f1 * r1[j]) + (f2 * r2[j] + f3 * r3[j])


@kernel
def factor_in_place(matrix: FloatArray, size: int, order: IntArray) -> bool:
    """Factor a linear system by elimination with partial pivoting.

    Parameters
    ----------
    matrix : ndarray, shape (>= size, >= size)
        The system by columns; receives its factors.
    size : int
        Number of unknowns.
    order : ndarray of int, shape (>= size,)
        Receives the order in which the equations are taken.

    Returns
    -------
    bool
        False if a pivot vanished or is not a number.
    """
    for i in range(size):
        order[i] = i
    for start in range(0, size, PANEL):
        stop = min(start + PANEL, size)
        for k in range(start, stop):
            for p in range(start, k):
                factor = matrix[k, p] / matrix[p, p]
                matrix[k, p] = factor
                for j in range(np.uint64(p + 1), np.uint64(size)):
                    matrix[k, j] -= factor * matrix[p, j]
            if not _pivot(matrix, size, k, order):
                return False
        if stop < size:
            _take_off_four(matrix, size, start)
    return True


@kernel
def _subtract_rows(
    matrix: FloatArray, start: int, stop: int, first: int, last: int, solution: FloatArray
) -> None:
    """Take the rows of a panel, times its unknowns, off the entries from `first` to `last`."""
    if stop - start == PANEL:
        r0, r1, r2, r3 = matrix[start], matrix[start + 1], matrix[start + 2], matrix[start + 3]
        x0, x1, x2, x3 = (
            solution[start],
            solution[start + 1],
            solution[start + 2],
            solution[start + 3],
        )
        for j in range(np.uint64(first), np.uint64(last)):
            solution[j] -= (x0 * r0[j] + x1 * r1[j]) + (x2 * r2[j] + x3 * r3[j])
        return
    for k in range(start, stop):
        x0 = solution[k]
        for j in range(np.uint64(first), np.uint64(last)):
            solution[j] -= x0 * matrix[k, j]


@kernel
def solve_factored(
    matrix: FloatArray, size: int, order: IntArray, right: FloatArray, solution: FloatArray
) -> None:
    """Solve a linear system from its factors.

    Parameters
    ----------
    matrix, size, order
        As `factor_in_place` left them.
    right : ndarray, shape (>= size,)
        Right-hand side.
    solution : ndarray, shape (>= size,)
        Receives the solution; another array than `right`.
    """
    for k in range(size):
        solution[k] = right[order[k]]
    for start in range(0, size, PANEL):
        stop = min(start + PANEL, size)
        for k in range(start, stop):
            solution[k] /= matrix[k, k]
            for j in range(k + 1, stop):
                solution[j] -= solution[k] * matrix[k, j]
        _subtract_rows(matrix, start, stop, stop, size, solution)
    for start in range((size - 1) // PANEL * PANEL, -1, -PANEL):
        stop = min(start + PANEL, size)
        for k in range(stop - 1, start, -1):
            for j in range(start, k):
                solution[j] -= solution[k] * matrix[k, j]
        _subtract_rows(matrix, start, stop, 0, start, solution)


@kernel
def _combine_rows(
    matrix: FloatArray,
    size: int,
    i: int,
    first: int,
    last: int,
    order: IntArray,
    inverse: FloatArray,
) -> None:
    """Take the inverse's rows from `first` to `last`, times entries of row `i`, off its own row."""
    row, p = inverse[order[i]], first
    while p + 3 < last:
        f0, f1, f2, f3 = matrix[i, p], matrix[i, p + 1], matrix[i, p + 2], matrix[i, p + 3]
        r0, r1 = inverse[order[p]], inverse[order[p + 1]]
        r2, r3 = inverse[order[p + 2]], inverse[order[p + 3]]
        for j in range(size):
            row[j] -= (f0 * r0[j] + f1 * r1[j]) + (f2 * r2[j] + f3 * r3[j])
        p += PANEL
    while p < last:
        factor, other = matrix[i, p], inverse[order[p]]
        for j in range(size):
            row[j] -= factor * other[j]
        p += 1


@kernel
def invert_factored(matrix: FloatArray, size: int, order: IntArray, inverse: FloatArray) -> None:
    """Fill the inverse of a factored system, by columns as the system is.

    Parameters
    ----------
    matrix, size, order
        As `factor_in_place` left them.
    inverse : ndarray, shape (>= size, >= size)
        Receives in row c how the unknowns follow equation c's right-hand side.
    """
    for i in range(size):
        row = inverse[order[i]]
        for j in range(size):
            row[j] = 0.0
        row[i] = 1.0
        _combine_rows(matrix, size, i, 0, i, order, inverse)
    for i in range(size - 1, -1, -1):
        _combine_rows(matrix, size, i, i + 1, size, order, inverse)
        row, scale = inverse[order[i]], 1.0 / matrix[i, i]
        for j in range(size):
            row[j] *= scale

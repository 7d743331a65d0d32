"""Dense LU factorisation, with results that do not depend on the BLAS library and its threads.

A system is stored by columns: ``matrix[j, i]`` is the coefficient of unknown j in equation i. Every
inner loop thus runs along a row in memory, which is a column of the system. Inner loops that do not
start at 0 have unsigned indices: numba then omits the handling of negative indices, and the loops
are vectorised, which makes them three times faster.
"""

from __future__ import annotations

import numpy as np

from wearsim.mechanics.numerics.jit import subroutine
from wearsim.types import FloatArray, IntArray

PANEL = 4  # unknowns eliminated together; the loops over the rows of a panel are unrolled


@subroutine
def _pivot(matrix: FloatArray, size: int, k: int, order: IntArray) -> bool:
    """Exchange equations to bring the greatest coefficient of unknown `k` into the k-th one."""
    best = k
    for i in range(k + 1, size):
        if abs(matrix[k, i]) > abs(matrix[k, best]):
            best = i
    if best != k:
        order[k], order[best] = order[best], order[k]
        for j in range(size):
            matrix[j, k], matrix[j, best] = matrix[j, best], matrix[j, k]
    return bool(abs(matrix[k, k]) > 0.0)


@subroutine
def _eliminate_panel(matrix: FloatArray, size: int, start: int) -> None:
    """Eliminate the four unknowns of a full panel from all later columns."""
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


@subroutine
def factor_in_place(matrix: FloatArray, size: int, order: IntArray) -> bool:
    """Factor a linear system by elimination with partial pivoting.

    Parameters
    ----------
    matrix : ndarray, shape (>= size, >= size)
        The system by columns; overwritten with its factors.
    size : int
        Number of unknowns.
    order : ndarray of int, shape (>= size,)
        Filled: the order of the equations after pivoting.

    Returns
    -------
    bool
        False if a pivot is zero or not a number.
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
            _eliminate_panel(matrix, size, start)
    return True


@subroutine
def _subtract_rows(
    matrix: FloatArray, start: int, stop: int, first: int, last: int, solution: FloatArray
) -> None:
    """Subtract the rows of a panel times its unknowns from the entries `first` to `last`."""
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


@subroutine
def solve_factored(
    matrix: FloatArray, size: int, order: IntArray, right: FloatArray, solution: FloatArray
) -> None:
    """Solve a linear system from its factors.

    Parameters
    ----------
    matrix, size, order
        As filled by `factor_in_place`.
    right : ndarray, shape (>= size,)
        Right-hand side.
    solution : ndarray, shape (>= size,)
        Filled: the solution; must not be the array `right`.
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


@subroutine
def _combine_rows(
    matrix: FloatArray,
    size: int,
    i: int,
    first: int,
    last: int,
    order: IntArray,
    inverse: FloatArray,
) -> None:
    """Subtract the inverse's rows `first` to `last`, times entries of row `i`, from its row."""
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


@subroutine
def invert_factored(matrix: FloatArray, size: int, order: IntArray, inverse: FloatArray) -> None:
    """Fill the inverse of a factored system, stored by columns like the system.

    Parameters
    ----------
    matrix, size, order
        As filled by `factor_in_place`.
    inverse : ndarray, shape (>= size, >= size)
        Filled: row c is the derivative of the unknowns by the right-hand side of equation c.
    """
    for i in range(size):
        row = inverse[order[i]]
        row[:size] = 0.0
        row[i] = 1.0
        _combine_rows(matrix, size, i, 0, i, order, inverse)
    for i in range(size - 1, -1, -1):
        _combine_rows(matrix, size, i, i + 1, size, order, inverse)
        row, scale = inverse[order[i]], 1.0 / matrix[i, i]
        for j in range(size):
            row[j] *= scale

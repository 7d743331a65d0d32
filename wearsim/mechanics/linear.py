"""Dense linear algebra small enough to own: the same bits whatever the BLAS and its threads."""

from __future__ import annotations

from wearsim.mechanics.jit import kernel
from wearsim.types import FloatArray

MANY = 8  # right-hand sides from which whole rows are substituted
PANEL = 4  # columns eliminated together; the update below is written out for four


@kernel
def _factor_panel(matrix: FloatArray, size: int, width: int, start: int, stop: int) -> bool:
    """Eliminate columns `start` to `stop` within their panel, exchanging whole rows."""
    for k in range(start, stop):
        best = k
        for i in range(k + 1, size):
            if abs(matrix[i, k]) > abs(matrix[best, k]):
                best = i
        if best != k:
            for j in range(width):
                held = matrix[k, j]
                matrix[k, j] = matrix[best, j]
                matrix[best, j] = held
        pivot = matrix[k, k]
        if not abs(pivot) > 0.0:
            return False
        for i in range(k + 1, size):
            factor = matrix[i, k] / pivot
            matrix[i, k] = factor
            for j in range(k + 1, stop):
                matrix[i, j] -= factor * matrix[k, j]
    return True


@kernel
def _eliminate_four(matrix: FloatArray, size: int, width: int, start: int) -> None:
    """Take a full panel's four pivot rows off everything right of it and below."""
    r0, r1, r2, r3 = matrix[start], matrix[start + 1], matrix[start + 2], matrix[start + 3]
    first = start + PANEL
    for j in range(first, width):
        r1[j] -= r1[start] * r0[j]
        r2[j] -= r2[start] * r0[j] + r2[start + 1] * r1[j]
        r3[j] -= r3[start] * r0[j] + r3[start + 1] * r1[j] + r3[start + 2] * r2[j]
    for i in range(first, size):
        row = matrix[i]
        f0, f1, f2, f3 = row[start], row[start + 1], row[start + 2], row[start + 3]
        for j in range(first, width):
            row[j] -= f0 * r0[j] + f1 * r1[j] + f2 * r2[j] + f3 * r3[j]


@kernel
def _eliminate(matrix: FloatArray, size: int, width: int) -> bool:
    """Bring a system to its upper triangle, right-hand sides included."""
    for start in range(0, size, PANEL):
        stop = min(start + PANEL, size)
        if not _factor_panel(matrix, size, width, start, stop):
            return False
        if stop - start == PANEL:
            _eliminate_four(matrix, size, width, start)
        else:
            for k in range(start, stop):
                for i in range(k + 1, stop):
                    for j in range(stop, width):
                        matrix[i, j] -= matrix[i, k] * matrix[k, j]
    return True


@kernel
def solve_in_place(matrix: FloatArray, size: int, width: int) -> bool:
    """Solve a linear system by elimination with partial pivoting, right-hand sides appended.

    Parameters
    ----------
    matrix : ndarray, shape (>= size, >= width)
        The system in columns 0 to `size`, right-hand sides in columns `size` to `width`; the
        solutions stand in those columns afterwards.
    size : int
        Number of unknowns.
    width : int
        Unknowns and right-hand sides together.

    Returns
    -------
    bool
        False if a pivot vanished or is not a number.
    """
    if not _eliminate(matrix, size, width):
        return False
    for column in range(size, width):
        _substitute_back(matrix, size, column)
    return True


@kernel
def solve_many_in_place(matrix: FloatArray, size: int, width: int) -> bool:
    """Solve a linear system as `solve_in_place` does, quickly where right-hand sides are many."""
    if not _eliminate(matrix, size, width):
        return False
    if width - size < MANY:
        for column in range(size, width):
            _substitute_back(matrix, size, column)
    else:
        _substitute_rows_back(matrix, size, width)
    return True


@kernel
def _substitute_rows_back(matrix: FloatArray, size: int, width: int) -> None:
    """Solve the upper triangle for many right-hand sides at once, row by row."""
    for i in range(size - 1, -1, -1):
        row = matrix[i]
        k = i + 1
        while k + 3 < size:
            f0, f1, f2, f3 = row[k], row[k + 1], row[k + 2], row[k + 3]
            r0, r1, r2, r3 = matrix[k], matrix[k + 1], matrix[k + 2], matrix[k + 3]
            for j in range(size, width):
                row[j] -= (f0 * r0[j] + f1 * r1[j]) + (f2 * r2[j] + f3 * r3[j])
            k += 4
        while k < size:
            factor, other = row[k], matrix[k]
            for j in range(size, width):
                row[j] -= factor * other[j]
            k += 1
        pivot = row[i]
        for j in range(size, width):
            row[j] /= pivot


@kernel
def _substitute_back(matrix: FloatArray, size: int, column: int) -> None:
    """Solve the upper triangle for one right-hand side; four sums hide the adder's latency."""
    for i in range(size - 1, -1, -1):
        row = matrix[i]
        s0, s1, s2, s3 = 0.0, 0.0, 0.0, 0.0
        k = i + 1
        while k + 3 < size:
            s0 += row[k] * matrix[k, column]
            s1 += row[k + 1] * matrix[k + 1, column]
            s2 += row[k + 2] * matrix[k + 2, column]
            s3 += row[k + 3] * matrix[k + 3, column]
            k += 4
        while k < size:
            s0 += row[k] * matrix[k, column]
            k += 1
        row[column] = (row[column] - ((s0 + s1) + (s2 + s3))) / row[i]

"""Dense LU factorisation and inversion, with results that are independent of BLAS and its threads.

The matrices of contact problems have a positive definite symmetric part, so that elimination is
stable without pivoting, which would take a third of the time. Factors are of single precision, for
iterations with residuals of double precision; inverses have the precision of their system.

A system is stored by columns: ``matrix[j, i]`` is the coefficient of unknown j in equation i. Every
inner loop thus runs along a row in memory, which is a column of the system. Inner loops that do not
start at 0 have unsigned indices: numba then omits the handling of negative indices, and the loops
are vectorised, which makes them three times faster. Indices of both axes replace rows, and loops
replace calls, as numba counts the references to every row and argument.
"""

from __future__ import annotations

import numpy as np

from wearsim.mechanics.numerics.jit import (
    compile_alongside,
    kernel,
    subroutine,
    subroutine_of,
)
from wearsim.types import FloatArray, SingleArray

PANEL = 4  # unknowns eliminated together; the loops over the rows of a panel are unrolled
LANES = 8  # numbers of single precision in a vector; loops over whole vectors are faster


@subroutine
def whole_panels(size: int) -> int:
    """Return `size` rounded up to whole panels."""
    return (size + PANEL - 1) // PANEL * PANEL


def _subtract_rows(matrix: SingleArray, start: int, end: int) -> None:
    stop = start + PANEL
    f0, f1, f2, f3 = matrix[stop:end, start:stop].T[:, :, None]
    a, b, c, d = matrix[start:stop, stop:end]
    matrix[stop:end, stop:end] -= (f0 * a + f1 * b) + (f2 * c + f3 * d)


@subroutine_of(_subtract_rows)
def subtract_panel(matrix: SingleArray, start: int, end: int) -> None:
    """Subtract the rows of the panel from `start` on from those after it, with their factors."""
    s1, s2, s3, stop = start + 1, start + 2, start + 3, start + PANEL
    first = stop - (end - stop) % LANES  # perhaps that of the factors, which are thus stored again
    for i in range(stop, end, PANEL):  # several rows together, for which the panel is read once
        i1, i2, i3 = i + 1, i + 2, i + 3
        f0, f1, f2, f3 = matrix[i, start], matrix[i, s1], matrix[i, s2], matrix[i, s3]
        g0, g1, g2, g3 = matrix[i1, start], matrix[i1, s1], matrix[i1, s2], matrix[i1, s3]
        h0, h1, h2, h3 = matrix[i2, start], matrix[i2, s1], matrix[i2, s2], matrix[i2, s3]
        l0, l1, l2, l3 = matrix[i3, start], matrix[i3, s1], matrix[i3, s2], matrix[i3, s3]
        for j in range(np.uint64(first), np.uint64(end)):
            a, b, c, d = matrix[start, j], matrix[s1, j], matrix[s2, j], matrix[s3, j]
            matrix[i, j] -= (f0 * a + f1 * b) + (f2 * c + f3 * d)
            matrix[i1, j] -= (g0 * a + g1 * b) + (g2 * c + g3 * d)
            matrix[i2, j] -= (h0 * a + h1 * b) + (h2 * c + h3 * d)
            matrix[i3, j] -= (l0 * a + l1 * b) + (l2 * c + l3 * d)
        matrix[i, start], matrix[i, s1], matrix[i, s2], matrix[i, s3] = f0, f1, f2, f3
        matrix[i1, start], matrix[i1, s1], matrix[i1, s2], matrix[i1, s3] = g0, g1, g2, g3
        matrix[i2, start], matrix[i2, s1], matrix[i2, s2], matrix[i2, s3] = h0, h1, h2, h3
        matrix[i3, start], matrix[i3, s1], matrix[i3, s2], matrix[i3, s3] = l0, l1, l2, l3


@subroutine
def complete_panels(matrix: FloatArray | SingleArray, size: int) -> None:
    """Complete a system of `size` unknowns to whole panels by the identity."""
    end = whole_panels(size)
    for i in range(end):
        for j in range(size if i < size else 0, end):
            matrix[i, j] = 1.0 if i == j else 0.0


@kernel
def factor_in_place(matrix: SingleArray, size: int) -> bool:
    """Factor a linear system by elimination without pivoting.

    Parameters
    ----------
    matrix : ndarray of single precision, shape (>= whole_panels(size), >= whole_panels(size))
        The system by columns; overwritten with its factors, and with the reciprocals of the pivots
        on the diagonal. The last panel is completed by the identity.
    size : int
        Number of unknowns.

    Returns
    -------
    bool
        False if a pivot is zero or not a number.
    """
    end = whole_panels(size)
    complete_panels(matrix, size)
    for start in range(0, end, PANEL):
        stop = start + PANEL
        for k in range(start, stop):
            for p in range(start, k):
                factor = matrix[k, p] * matrix[p, p]
                matrix[k, p] = factor
                for j in range(np.uint64(p + 1), np.uint64(end)):
                    matrix[k, j] -= factor * matrix[p, j]
            if not abs(matrix[k, k]) > 0.0:
                return False
            matrix[k, k] = 1.0 / matrix[k, k]
        s1, s2, s3 = start + 1, start + 2, start + 3
        p0, p1, p2, p3 = matrix[start, start], matrix[s1, s1], matrix[s2, s2], matrix[s3, s3]
        u01, u02, u03 = matrix[start, s1], matrix[start, s2], matrix[start, s3]
        u12, u13, u23 = matrix[s1, s2], matrix[s1, s3], matrix[s2, s3]
        for i in range(np.uint64(stop), np.uint64(end)):
            f0 = matrix[i, start] * p0
            f1 = (matrix[i, s1] - f0 * u01) * p1
            f2 = (matrix[i, s2] - f0 * u02 - f1 * u12) * p2
            f3 = (matrix[i, s3] - f0 * u03 - f1 * u13 - f2 * u23) * p3
            matrix[i, start], matrix[i, s1], matrix[i, s2], matrix[i, s3] = f0, f1, f2, f3
        subtract_panel(matrix, start, end)
    return True


def _subtract_products(
    matrix: SingleArray, start: int, first: int, end: int, solution: SingleArray
) -> None:
    panel = solution[start : start + PANEL].copy()
    a, b, c, d = matrix[start : start + PANEL, first:end]
    solution[first:end] -= (panel[0] * a + panel[1] * b) + (panel[2] * c + panel[3] * d)
    solution[start : start + PANEL] = panel


@subroutine_of(_subtract_products)
def subtract_known(
    matrix: SingleArray, start: int, first: int, end: int, solution: SingleArray
) -> None:
    """Subtract the unknowns of the panel from `start` on from the equations `first` to `end`.

    Its own equations may be among these, and keep their solution.
    """
    s1, s2, s3 = start + 1, start + 2, start + 3
    x0, x1, x2, x3 = solution[start], solution[s1], solution[s2], solution[s3]
    for j in range(np.uint64(first), np.uint64(end)):
        solution[j] -= (x0 * matrix[start, j] + x1 * matrix[s1, j]) + (
            x2 * matrix[s2, j] + x3 * matrix[s3, j]
        )
    solution[start], solution[s1], solution[s2], solution[s3] = x0, x1, x2, x3


@kernel
def solve_factored(matrix: SingleArray, size: int, solution: SingleArray) -> None:
    """Solve a linear system from its factors.

    Parameters
    ----------
    matrix, size
        As filled by `factor_in_place`.
    solution : ndarray of single precision, shape (>= whole_panels(size),)
        Right-hand side; overwritten with the solution, and with 0 to the end of the last panel.
    """
    end = whole_panels(size)
    for k in range(size, end):
        solution[k] = 0.0
    for start in range(0, end, PANEL):
        stop = start + PANEL
        for k in range(start, stop):
            solution[k] *= matrix[k, k]
            for j in range(k + 1, stop):
                solution[j] -= solution[k] * matrix[k, j]
        subtract_known(matrix, start, stop - (end - stop) % LANES, end, solution)
    for start in range(end - PANEL, -1, -PANEL):
        for k in range(start + PANEL - 1, start, -1):
            for j in range(start, k):
                solution[j] -= solution[k] * matrix[k, j]
        subtract_known(matrix, start, 0, start + start % LANES, solution)


@subroutine
def invert_in_place(matrix: FloatArray | SingleArray, size: int) -> bool:
    """Invert a linear system by Gauss-Jordan elimination without pivoting.

    Where a system is solved often, the product with its inverse replaces the solution from factors.

    Parameters
    ----------
    matrix : ndarray, shape (>= whole_panels(size), >= whole_panels(size))
        The system by columns; overwritten with its inverse: row c is the derivative of the unknowns
        by the right-hand side of equation c. The last panel is completed by the identity.
    size : int
        Number of unknowns.

    Returns
    -------
    bool
        False if a pivot is zero or not a number.
    """
    end = whole_panels(size)
    complete_panels(matrix, size)
    for start in range(0, end, PANEL):
        for k in range(start, start + PANEL):
            if not abs(matrix[k, k]) > 0.0:
                return False
            inverse, matrix[k, k] = 1.0 / matrix[k, k], 1.0
            for j in range(end):
                matrix[k, j] *= inverse
            for i in range(start, start + PANEL):
                factor = matrix[i, k]
                if i != k:
                    matrix[i, k] = 0.0
                    for j in range(end):
                        matrix[i, j] -= factor * matrix[k, j]
        s1, s2, s3 = start + 1, start + 2, start + 3
        for i in range(0, end, PANEL):
            if i == start:
                continue
            i1, i2, i3 = i + 1, i + 2, i + 3
            f0, f1, f2, f3 = matrix[i, start], matrix[i, s1], matrix[i, s2], matrix[i, s3]
            g0, g1, g2, g3 = matrix[i1, start], matrix[i1, s1], matrix[i1, s2], matrix[i1, s3]
            h0, h1, h2, h3 = matrix[i2, start], matrix[i2, s1], matrix[i2, s2], matrix[i2, s3]
            l0, l1, l2, l3 = matrix[i3, start], matrix[i3, s1], matrix[i3, s2], matrix[i3, s3]
            for p in range(start, start + PANEL):
                matrix[i, p] = matrix[i1, p] = matrix[i2, p] = matrix[i3, p] = 0.0
            for j in range(end):
                a, b, c, d = matrix[start, j], matrix[s1, j], matrix[s2, j], matrix[s3, j]
                matrix[i, j] -= (f0 * a + f1 * b) + (f2 * c + f3 * d)
                matrix[i1, j] -= (g0 * a + g1 * b) + (g2 * c + g3 * d)
                matrix[i2, j] -= (h0 * a + h1 * b) + (h2 * c + h3 * d)
                matrix[i3, j] -= (l0 * a + l1 * b) + (l2 * c + l3 * d)
    return True


def compile_linear_systems() -> None:
    """Compile `factor_in_place` and `solve_factored` by a call for one unknown."""
    unit = np.ones((PANEL, PANEL), np.float32)
    factor_in_place(unit, 1)
    solve_factored(unit, 1, unit[0])


compile_alongside(
    "solve_slender", compile_linear_systems, "factor_in_place", "solve_factored", within=True
)

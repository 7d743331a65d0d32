"""Linear systems of single rows of elements, in compiled code and one thread, see `inner`."""

from typing import TypeAlias

import numba
import numpy as np
import numpy.typing as npt

from wearsim.types import IntArray

Singles: TypeAlias = npt.NDArray[np.float32]

LEAST = np.float32(1e-6)  # pivot, against division by zero


@numba.njit(cache=True, fastmath=True)
def factor(
    diagonal: Singles, influence: Singles, first: IntArray, last: IntArray, factors: Singles
) -> None:
    """Factor the systems I - D (I - B) of rows, by elimination without pivoting.

    The symmetric part of B is positive definite.

    Parameters
    ----------
    diagonal : ndarray of float32, shape (2, rows, columns)
        D of both components of the traction, between 0 and 1.
    influence : ndarray of float32, shape (2, 2 columns - 1)
        B for all distances of two elements.
    first, last : ndarray, shape (rows,)
        The columns in contact, to which the systems are restricted.
    factors : ndarray of float32, shape (2, rows, size, size)
        Overwritten with the factors, and with the reciprocals of the pivots on the diagonal.
    """
    columns = diagonal.shape[2]
    for component in range(2):
        for row in range(len(first)):
            matrix, count = factors[component, row], last[row] - first[row] + 1
            for i in range(count):
                scale = diagonal[component, row, first[row] + i]
                for j in range(count):
                    matrix[i, j] = scale * influence[component, i - j + columns - 1]
                matrix[i, i] += np.float32(1.0) - scale
            for k in range(count):
                pivot = np.float32(1.0) / max(matrix[k, k], LEAST)
                matrix[k, k] = pivot
                for i in range(k + 1, count):
                    part = matrix[i, k] * pivot
                    matrix[i, k] = part
                    for j in range(np.uint64(k + 1), np.uint64(count)):
                        matrix[i, j] -= part * matrix[k, j]


@numba.njit(cache=True, fastmath=True)
def solve(factors: Singles, field: Singles, first: IntArray, last: IntArray) -> None:
    """Solve the systems of `factor`; `field`, shape (2, rows, columns), is overwritten."""
    for component in range(2):
        for row in range(len(first)):
            matrix, start = factors[component, row], first[row]
            values, count = field[component, row], last[row] - first[row] + 1
            for i in range(count):
                total = values[start + i]
                for j in range(i):
                    total -= matrix[i, j] * values[start + j]
                values[start + i] = total
            for i in range(count - 1, -1, -1):
                total = values[start + i]
                for j in range(np.uint64(i + 1), np.uint64(count)):
                    total -= matrix[i, j] * values[start + j]
                values[start + i] = total * matrix[i, i]

"""The dense solver against LAPACK; systems are stored by columns."""

import numpy as np
import pytest

from wearsim.mechanics.numerics.lu import (
    factor_in_place,
    invert_in_place,
    solve_factored,
    whole_panels,
)


def solved(matrix, right):
    """Return the solution from a system with two more rows than whole panels, None if singular."""
    size, end = len(right), whole_panels(len(right))
    system, solution = np.full((end + 2, end + 2), np.nan, np.float32), np.full(end + 2, np.nan)
    system[:size, :size], solution = matrix.T, solution.astype(np.float32)
    solution[:size] = right
    if not factor_in_place(system, size):
        return None
    solve_factored(system, size, solution)
    for beyond in (system[end:], system[:, end:], solution[end:]):
        assert np.isnan(beyond).all()
    np.testing.assert_array_equal(solution[size:end], 0.0)
    return solution[:size]


def definite(size):
    """Return a random matrix with a positive definite symmetric part."""
    random = np.random.default_rng(size)
    root, skew = random.normal(size=(2, size, size))
    return root @ root.T + skew - skew.T + np.eye(size)


@pytest.mark.parametrize("size", [1, 2, 3, 4, 5, 7, 8, 16, 61])
def test_systems_of_any_size_are_solved_as_by_lapack(size):
    matrix, right = definite(size), np.random.default_rng(0).normal(size=size)
    expected = np.linalg.solve(matrix, right)
    error = 1e-6 * np.linalg.cond(matrix) * np.abs(expected).max()  # of single precision
    np.testing.assert_allclose(solved(matrix, right), expected, rtol=0.0, atol=error)


@pytest.mark.parametrize("size", [1, 2, 3, 4, 5, 18, 61])
def test_systems_are_inverted_as_by_lapack(size):
    matrix, end = definite(size), whole_panels(size)
    assert size <= end < size + 4
    inverse = np.full((end + 1, end + 1), np.nan)
    inverse[:size, :size] = matrix.T
    assert invert_in_place(inverse, size)
    np.testing.assert_allclose(inverse[:size, :size].T @ matrix, np.eye(size), atol=1e-11)
    np.testing.assert_array_equal(inverse[size:end, :end], np.eye(end)[size:])
    np.testing.assert_array_equal(inverse[:size, size:end], 0.0)
    assert np.isnan(inverse[end]).all()
    assert np.isnan(inverse[:, end]).all()


@pytest.mark.parametrize("bad", [0.0, np.nan])
def test_singular_or_undefined_system_is_detected(bad):
    assert solved(np.full((5, 5), bad), np.ones(5)) is None
    assert not invert_in_place(np.full((8, 8), bad), 5)

"""The dense solver against LAPACK; systems are stored by columns."""

import numpy as np
import pytest

from wearsim.mechanics.numerics.lu import (
    factor_in_place,
    invert_in_place,
    solve_factored,
    whole_panels,
)


def solved(system, size, right):
    """Return the solution of the leading block, or None if it is singular."""
    solution = np.zeros(len(system))
    solution[:size] = right[:size]
    if not factor_in_place(system, size):
        return None
    solve_factored(system, size, solution)
    return solution[:size]


def definite(size):
    """Return a random matrix with a positive definite symmetric part."""
    random = np.random.default_rng(size)
    root, skew = random.normal(size=(2, size, size))
    return root @ root.T + skew - skew.T + np.eye(size)


@pytest.mark.parametrize("size", [1, 2, 3, 4, 5, 7, 8, 16, 61])
def test_systems_of_any_size_are_solved_as_by_lapack(size):
    matrix, right = definite(size), np.random.default_rng(0).normal(size=size)
    solution = solved(matrix.T.copy(), size, right)
    np.testing.assert_allclose(solution, np.linalg.solve(matrix, right), rtol=1e-9)


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
    assert solved(np.full((5, 5), bad), 5, np.ones(5)) is None
    assert not invert_in_place(np.full((8, 8), bad), 5)


def test_only_the_leading_block_is_changed():
    system = np.arange(25.0).reshape(5, 5) + np.diag(np.full(5, 50.0))
    before = system.copy()
    solution = solved(system, 3, np.ones(5))
    np.testing.assert_array_equal(system[3:], before[3:])
    np.testing.assert_array_equal(system[:3, 3:], before[:3, 3:])
    np.testing.assert_allclose(solution, np.linalg.solve(before[:3, :3].T, np.ones(3)), rtol=1e-12)

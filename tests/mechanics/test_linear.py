"""The dense solver against LAPACK."""

import numpy as np
import pytest

from wearsim.mechanics.linear import solve_in_place, solve_many_in_place


@pytest.mark.parametrize("size", [1, 2, 3, 4, 5, 7, 8, 16, 61])
@pytest.mark.parametrize("sides", [1, 3, 12])
@pytest.mark.parametrize("solver", [solve_in_place, solve_many_in_place])
def test_that_systems_of_every_size_are_solved_like_lapack_does(solver, size, sides):
    random = np.random.default_rng(size)
    matrix, right = random.normal(size=(size, size)), random.normal(size=(size, sides))
    system = np.hstack([matrix, right])
    assert solver(system, size, size + sides)
    np.testing.assert_allclose(system[:, size:], np.linalg.solve(matrix, right), rtol=1e-9)


def test_that_a_zero_on_the_diagonal_is_pivoted_away():
    system = np.array([[0.0, 1.0, 2.0], [1.0, 0.0, 3.0]])
    assert solve_in_place(system, 2, 3)
    np.testing.assert_array_equal(system[:, 2], [3.0, 2.0])


@pytest.mark.parametrize("bad", [0.0, np.nan])
def test_that_a_singular_or_undefined_system_is_told(bad):
    system = np.full((5, 6), bad)
    assert not solve_in_place(system, 5, 6)


def test_that_only_the_leading_block_is_touched():
    system = np.arange(30.0).reshape(5, 6) + np.diag(np.full(5, 50.0), 0) @ np.eye(5, 6)
    before = system.copy()
    assert solve_in_place(system, 3, 4)
    np.testing.assert_array_equal(system[3:], before[3:])
    np.testing.assert_array_equal(system[:3, 4:], before[:3, 4:])
    expected = np.linalg.solve(before[:3, :3], before[:3, 3])
    np.testing.assert_allclose(system[:3, 3], expected, rtol=1e-12)

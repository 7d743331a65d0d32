"""Roots of several monotonic functions at once."""

from __future__ import annotations

import numpy as np
import pytest

from wearsim.mechanics.numerics.roots import bracketed_roots, secant_roots

# functions that are steep, flat and curved, with their roots
FUNCTIONS = [
    (lambda x: np.tanh(3.0 * x) - 0.999, np.arctanh(0.999) / 3.0),
    (lambda x: np.tanh(3.0 * x) + 1e-3, -np.arctanh(1e-3) / 3.0),
    (lambda x: x, 0.0),
    (lambda x: x**9 - 1e-3, 1e-3 ** (1.0 / 9.0)),
    (lambda x: np.exp(8.0 * x) - 30.0, np.log(30.0) / 8.0),
    (lambda x: np.arctan(50.0 * x) + 1.2, np.tan(-1.2) / 50.0),
]


@pytest.mark.parametrize("size", [1.0, 1e-6])
@pytest.mark.parametrize("first", [0.0, 0.3, 10.0])
def test_roots_of_several_functions(first, size):
    exact = size * np.array([root for _, root in FUNCTIONS])
    calls = []

    def roots_of(functions):
        def values(x):
            calls.append(x)
            return np.array([one(at / size) for one, at in zip(functions, x, strict=True)])

        low, high = np.full(len(functions), -2.0 * size), np.full(len(functions), 3.0 * size)
        return bracketed_roots(values, low, high, np.full(len(functions), first * size))

    found = roots_of([one for one, _ in FUNCTIONS])
    assert found == pytest.approx(exact, rel=1e-12, abs=1e-15 * size)
    calls.clear()
    for (one, _), root in zip(FUNCTIONS, found, strict=True):
        assert roots_of([one])[0] == root
    assert len(calls) < 12.5 * len(FUNCTIONS)  # bisection would take more than 40 of each


@pytest.mark.parametrize("size", [1.0, 1e-6])
@pytest.mark.parametrize(("distance", "most"), [(0.0, 3), (1e-3, 5), (0.05, 7)])
def test_secant_roots_near_the_guesses(distance, most, size):
    calls, target = [], np.array([-0.9, -1e-3, 0.0, 0.5, 0.9])

    def excess(x):
        calls.append(x)
        return np.tanh(3.0 * x / size) - target

    exact = size * np.arctanh(target) / 3.0
    found, converged = secant_roots(excess, exact + distance * size, np.full(5, 0.3 * size))
    assert converged.all()
    assert found == pytest.approx(exact, rel=1e-12, abs=1e-15 * size)
    assert len(calls) <= most


def test_secant_does_not_converge_where_a_function_is_flat():
    found, converged = secant_roots(
        lambda x: np.tanh(3.0 * x) - np.array([0.5, 2.0, 0.5]),
        np.array([0.1, 0.1, 20.0]),
        np.full(3, 0.3),
    )
    assert converged.tolist() == [True, False, False]
    alone = secant_roots(lambda x: np.tanh(3.0 * x) - 0.5, np.array([0.1]), np.full(1, 0.3))
    assert found[0] == alone[0][0]


@pytest.mark.parametrize("size", [1.0, 1e-6])
def test_secant_does_not_converge_far_from_the_guess(size):
    root = size * np.array([2.9, -2.9, 3.1, -3.1])
    found, converged = secant_roots(lambda x: x - root, np.zeros(4), np.full(4, 0.3 * size))
    assert converged.tolist() == [True, True, False, False]
    assert found[:2] == pytest.approx(root[:2], rel=1e-12)

"""Roots of several monotonic functions at once."""

from __future__ import annotations

import numpy as np
import pytest

from wearsim.mechanics.numerics.roots import bracketed_roots, secant_roots


@pytest.mark.parametrize("first", [0.0, 0.3, 10.0])
def test_roots_of_several_functions(first):
    calls = []
    target = np.array([-0.9, -1e-3, 0.0, 0.5, 0.999])

    def excess(x):
        calls.append(x)
        return np.tanh(3.0 * x) - target

    low, high = np.full(5, -2.0), np.full(5, 3.0)
    found = bracketed_roots(excess, low, high, np.full(5, first))
    assert found == pytest.approx(np.arctanh(target) / 3.0, rel=1e-12, abs=1e-15)
    assert len(calls) < 30


def test_one_function_does_not_change_another():
    def excess(x):
        return x**3 - np.array([0.1, 5.0])[: len(x)]

    both = bracketed_roots(excess, np.full(2, -3.0), np.full(2, 3.0), np.zeros(2))
    one = bracketed_roots(excess, np.full(1, -3.0), np.full(1, 3.0), np.zeros(1))
    assert both[0] == one[0]


def test_secant_roots_near_the_guesses():
    calls, target = [], np.array([-0.9, -1e-3, 0.0, 0.5, 0.9])

    def excess(x):
        calls.append(x)
        return np.tanh(3.0 * x) - target

    exact = np.arctanh(target) / 3.0
    found, converged = secant_roots(excess, exact + 1e-3, np.full(5, 0.3))
    assert converged.all()
    assert found == pytest.approx(exact, rel=1e-12, abs=1e-15)
    assert len(calls) < 7


def test_secant_does_not_converge_where_a_function_is_flat():
    found, converged = secant_roots(
        lambda x: np.tanh(3.0 * x) - np.array([0.5, 2.0, 0.5]),
        np.array([0.1, 0.1, 20.0]),
        np.full(3, 0.3),
    )
    assert converged.tolist() == [True, False, False]
    alone = secant_roots(lambda x: np.tanh(3.0 * x) - 0.5, np.array([0.1]), np.full(1, 0.3))
    assert found[0] == alone[0][0]

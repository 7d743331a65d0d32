"""Backward differentiation formulas in divided differences."""

import numpy as np
import pytest

from wearsim.mechanics.numerics.multistep import (
    GROW,
    LIMIT,
    MAX_ORDER,
    ROWS,
    SAFETY,
    extrapolated,
    first_differences,
    formulas,
    local_errors,
    new_differences,
    next_steps,
)

ORDERS = range(1, MAX_ORDER + 1)
ONE, NONE = np.ones(1), np.zeros(1)
POINTS = np.array([0.0, -0.11, -0.18, -0.32, -0.4, -0.47])


class Solution:
    """Solution of an equation y' = f(t, y), linear in y, that begins with exact points."""

    def __init__(self, exact, points=POINTS):
        table = [exact(points)]
        for k in range(1, ROWS):
            table.append((table[-1][:-1] - table[-1][1:]) / (points[:-k] - points[k:]))
        self.differences = np.array([0.0, *(row[0] for row in table[1:])]).reshape(ROWS, 1, 1, 1)
        self.spans = -points[1:, None]
        self.value = np.full((1, 1, 1), exact(points[0]))

    def step(self, length, order, constant, slope=0.0):
        """Take a step; the derivative at its end is ``constant + slope * y``."""
        weights, factor = np.empty((2, ROWS, 1)), np.empty(1)
        distances = np.empty((ROWS - 1, 1))
        formulas(self.spans, length * ONE, np.array([order]), NONE, weights, factor, distances)
        added, guess = np.empty((2, 1, 1, 1))
        for found, own in zip((added, guess), weights, strict=True):
            extrapolated(own, self.differences, found)
        new = (self.value + added + factor[0] * constant) / (1.0 - factor[0] * slope)
        change = new - self.value
        differences, self.differences = self.differences, np.empty_like(self.differences)
        new_differences(0.0 * new, change, NONE, differences, distances, self.differences)
        guess, self.value, self.spans = self.value + guess, new, distances
        return guess.item()


def errors_of(differences, spans, value, order):
    """Relative errors at each order, and the error of one solution at an order."""
    own = np.empty_like(value)
    sizes = local_errors(differences, spans, value, np.array([order]), np.ones_like(value), own)
    return sizes[:, 0], own


@pytest.mark.parametrize("order", ORDERS)
def test_formula_is_exact_for_polynomials_of_its_order(order):
    exact = np.polynomial.Polynomial([0.3, -0.7, 1.1, 2.0, -1.3][: order + 1])
    solution, t = Solution(exact), 0.0
    for length in (0.1, 0.14, 0.12, 0.17, 0.17, 0.07):
        t += length
        guess = solution.step(length, order, exact.deriv()(t))
        assert solution.value.item() == pytest.approx(exact(t), rel=1e-12)
        assert guess == pytest.approx(exact(t), rel=1e-12)


@pytest.mark.parametrize("order", ORDERS)
def test_formula_converges_with_its_order(order):
    def error(count):
        lengths = 1.0 + 0.3 * np.sin(np.arange(count))
        solution = Solution(lambda t: np.exp(-t), 10.0 * POINTS / count)
        for length in lengths / lengths.sum():
            solution.step(length, order, 0.0, slope=-1.0)
        return abs(solution.value.item() - np.exp(-1.0))

    assert np.log(error(40) / error(160)) / np.log(4.0) == pytest.approx(order, abs=0.15)


@pytest.mark.parametrize("order", ORDERS)
def test_local_error_is_that_of_a_step_from_exact_points(order):
    length = 0.05
    solution = Solution(lambda t: np.exp(-t), POINTS * 0.5)
    solution.step(length, order, -np.exp(-length))
    exact = np.exp(-length)
    sizes, own = errors_of(solution.differences, solution.spans, solution.value, order)
    errors = sizes * exact
    assert errors[order - 1] == pytest.approx(abs(solution.value.item() - exact), rel=0.2)
    # with its sign
    assert own.item() == pytest.approx(solution.value.item() - exact, rel=0.2)
    assert (np.diff(errors[: order + 1]) < 0.0).all()


def test_known_derivative_replaces_a_past_point():
    # the differences of a start with value and derivative are those of a double point
    solution = Solution(np.exp)
    solution.differences[2:] = 0.0
    solution.differences[1] = 1.0
    solution.spans[:] = np.inf
    solution.spans[0] = 0.0
    solution.step(0.01, 1, np.exp(0.01))
    errors, _ = errors_of(solution.differences, solution.spans, solution.value, 1)
    assert errors[0] == pytest.approx(0.5e-4, rel=0.02)
    assert not np.isfinite(errors[1:]).any()


def test_order_is_lowered_after_a_sudden_growth_of_the_step():
    spans = np.array([[1.0], [2.0], [3.0], [4.0], [5.0]])
    for length, order in ((1.4, 4), (1.8, 3), (2.2, 2), (3.0, 1)):
        weights, factor = np.empty((2, ROWS, 1)), np.empty(1)
        distances = np.empty((ROWS - 1, 1))
        formulas(spans, length * ONE, np.array([MAX_ORDER]), ONE, weights, factor, distances)
        assert np.count_nonzero(weights[0]) == order
        assert weights[:, 0].ravel().tolist() == [1.0, 1.0]
        assert distances.ravel() == pytest.approx([length, *(length + spans[:-1, 0])])


def test_missing_points_have_no_weights():
    spans = np.array([[1.0, np.inf], [2.5, np.inf], [np.inf] * 2, [np.inf] * 2, [np.inf] * 2])
    weights, factor = np.full((2, ROWS, 2), np.nan), np.empty(2)
    distances, start = np.empty((ROWS - 1, 2)), np.array([0.5, 0.0])
    formulas(spans, np.array([1.2, 0.7]), np.array([4, 4]), start, weights, factor, distances)
    # three points and one: formulas of third and of first order, without missing differences
    assert factor == pytest.approx([1.0 / (1 / 1.2 + 1 / 2.2 + 1 / 3.7), 0.7])
    assert weights[1, :3, 0] == pytest.approx([0.5, 1.2, 1.2 * 2.2])
    assert weights[1, :1, 1] == pytest.approx([0.0])
    assert not weights[:, 3:, 0].any()
    assert not weights[:, 1:, 1].any()


def test_missing_points_have_no_estimate():
    spans = np.array([[1.0], [2.0], [np.inf], [np.inf], [np.inf]])
    errors, _ = errors_of(np.ones((ROWS, 1, 1, 2)), spans, np.ones((1, 1, 2)), 1)
    assert np.isfinite(errors).tolist() == [True, False, False, False]


def chosen(sizes, order, part=1.0, aim=1.0, keep=0.9):
    """Excess, order and ratio of the next step after one with errors of given sizes."""
    known = len(sizes)
    spans = np.array([[1.0 + k] if k <= known else [np.inf] for k in range(ROWS - 1)])
    differences, value = np.zeros((ROWS, 1, 1, 1)), np.ones((1, 1, 1))
    differences[2:] = 1.0
    orders = np.array([order])
    unit = local_errors(differences, spans, value, orders, value, np.empty_like(value))
    for k, size in enumerate(sizes):
        differences[k + 2] = size / unit[k, 0]
    orders, own = np.array([0]), np.empty_like(value)
    most = np.array([MAX_ORDER])
    arguments = differences, spans, value, np.array([order]), part * ONE, aim, keep, most
    found = next_steps(*arguments, value, own, orders)
    return found[0, 0], orders[0], found[1, 0]


def test_next_step_would_meet_the_aim():
    excess, order, ratio = chosen([1e3, 0.5, 1e3, 1e3], 2)
    assert (excess, order) == (pytest.approx(0.5 / LIMIT), 2)
    assert ratio == pytest.approx(SAFETY * 0.5 ** (-1.0 / 3.0))


def test_error_is_compared_with_the_aim_over_the_part():
    excess, _, _ = chosen([1.0, 1e-4, 1.0, 1.0], 2, part=0.5, aim=1e-3)
    assert excess == pytest.approx(0.05 / LIMIT)


def test_order_changes_by_one_to_that_of_the_longest_step():
    assert chosen([0.1, 1.0, 1.0, 1e-9], 2)[1] == 1
    assert chosen([1.0, 1.0, 0.1, 1e-9], 2)[1] == 3


def test_order_is_lowered_for_clearly_longer_steps_only():
    assert chosen([1.05**-2, 1.0, 10.0, 10.0], 2)[1] == 2
    assert chosen([1.05**-2, 1.0, 10.0, 10.0], 2, keep=1.0)[1] == 1
    assert chosen([1.2**-2, 1.0, 10.0, 10.0], 2)[1] == 1
    # it is raised for any longer step
    assert chosen([10.0, 1.0, 1.05**-4, 10.0], 2)[1] == 3


def test_growth_is_limited_by_the_order():
    for order in ORDERS:
        sizes = [1.0, 1.0, 1.0, 1.0]
        sizes[order - 1] = 1e-15
        assert chosen(sizes, order)[1:] == (order, GROW[order - 1])


def test_first_steps_raise_the_order():
    assert chosen([], 1) == (0.0, 1, GROW[0])
    assert chosen([0.5], 1)[1] == 2
    assert chosen([5.0], 1)[:2] == (pytest.approx(5.0 / LIMIT), 1)


def test_local_errors_are_products_of_the_distances():
    spans = np.array([[1.0], [2.5], [4.0], [np.inf], [np.inf]])
    differences = np.arange(12.0).reshape(6, 1, 1, 2) + 1.0
    depths, parts, errors = np.array([[[3.0, 4.0]]]), np.array([[[1.0, 0.5]]]), np.ones((1, 1, 2))
    sizes = local_errors(differences, spans, depths, np.array([2]), parts, errors)
    for k in range(2):
        factor = np.prod(spans[: k + 1]) / (1.0 / spans[: k + 2]).sum()
        change = parts[0, 0] * differences[k + 2, 0, 0]
        assert sizes[k, 0] == pytest.approx(factor * np.linalg.norm(change) / 5.0)
        if k == 1:
            assert errors[0, 0] == pytest.approx(factor * change)
    assert np.isinf(sizes[2:, 0]).all()
    none = local_errors(differences, spans, 0.0 * depths, np.array([0]), parts, errors)
    assert none[:2, 0].tolist() == [0.0, 0.0]
    assert not errors.any()


def test_first_differences_are_the_rates_and_their_slopes():
    rates = np.array([[[2.0, 3.0], [4.0, 5.0]]])  # rows, solutions, columns
    found = first_differences(rates, np.array([2.0, 4.0]))
    assert found.shape == (6, 1, 2, 2)
    assert found[0].tolist() == rates.tolist()
    assert found[1, 0].tolist() == [[1.0, 1.5], [1.0, 1.25]]
    assert not found[2:].any()

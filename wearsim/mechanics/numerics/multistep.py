"""Backward differentiation formulas for unequal steps, in divided differences."""

from __future__ import annotations

import numpy as np

from wearsim.mechanics.numerics.jit import kernel, subroutine
from wearsim.types import FloatArray, IntArray

MAX_ORDER = 4
ROWS = MAX_ORDER + 2  # of the divided differences: the highest one is that of the error estimate
# greatest ratios of a step to the last one at order 2, 3 and 4, below those at which steps are
# unstable: 1 + sqrt(2), and 2.64 and 1.64 if only every second step grows
_RATIOS = (2.4, 1.9, 1.5)
LIMIT = 2.0  # error of an accepted step, relative to the one aimed at
SAFETY = 0.8  # ratio of the next step to the one that would meet the aim
GROW = (2.2, 2.2, 1.8, 1.45)  # greatest ratio of successive steps, by order


@subroutine
def formulas(
    spans: FloatArray,
    steps: FloatArray,
    orders: IntArray,
    start: FloatArray,
    weights: FloatArray,
    factor: FloatArray,
    distances: FloatArray,
) -> None:
    """Compute the formula of one step for each of several solutions.

    A solution is known by its value at the present point and its divided differences of order 1 to
    5 over the present and past points. The value y at the end of a step satisfies

        y - factor * y' = y_0 + sum_k weights[0, k] * difference_k,

    with the derivative y' at the end. The sum with ``weights[1]`` instead predicts y. Where a
    point is missing, or the step is much longer than the last one, the order is lower.

    Parameters
    ----------
    spans : ndarray, shape (5, solutions)
        Distances from the present point back to the past points, infinite where there is none; a
        point of distance zero stands for a known derivative at the present point.
    steps : ndarray, shape (solutions,)
        Length of the step.
    orders : ndarray of int, shape (solutions,)
        Order of the formula.
    start : ndarray, shape (solutions,)
        Value of both weights for k = 0.
    weights : ndarray, shape (2, 6, solutions)
        Result: weights of the formula and of the prediction.
    factor : ndarray, shape (solutions,)
        Result: factor of the derivative.
    distances : ndarray, shape (5, solutions)
        Result: `spans` of the end of the step.

    References
    ----------
    .. [1] E. Hairer, S.P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, 2nd ed.
       (1993), section III.5, DOI 10.1007/978-3-540-78862-1.
    """
    for v in range(len(steps)):
        step = steps[v]
        known = 1
        distances[0, v] = step
        for k in range(ROWS - 1):
            if np.isfinite(spans[k, v]):
                known += 1
            if k < ROWS - 2:
                distances[k + 1, v] = step + spans[k, v]
        order = min(orders[v], known)
        while order > 1 and step > _RATIOS[order - 2] * spans[0, v]:
            order -= 1
        inverse = 0.0
        for k in range(order):
            inverse += 1.0 / distances[k, v]
        factor[v] = 1.0 / inverse
        product, inverse = 1.0, 0.0
        for k in range(ROWS):
            weights[0, k, v] = product * (1.0 - factor[v] * inverse) if k < order else 0.0
            weights[1, k, v] = product if k <= order and k < known else 0.0
            if k < ROWS - 1:
                product *= distances[k, v]
                inverse += 1.0 / distances[k, v]
        weights[0, 0, v] = weights[1, 0, v] = start[v]


@subroutine
def extrapolated(weights: FloatArray, differences: FloatArray, sums: FloatArray) -> None:
    """Fill sums of divided differences with the weights of `formulas`.

    Parameters
    ----------
    weights : ndarray, shape (6, solutions)
        Those of the formula, or of the prediction.
    differences : ndarray, shape (6, rows, solutions, columns)
    sums : ndarray, shape (rows, solutions, columns)
        Result.
    """
    rows, solutions, columns = sums.shape
    for r in range(rows):
        for v in range(solutions):
            for i in range(columns):
                total = weights[0, v] * differences[0, r, v, i]
                for k in range(1, ROWS):
                    if weights[k, v] != 0.0:
                        total += weights[k, v] * differences[k, r, v, i]
                sums[r, v, i] = total


@subroutine
def new_differences(
    first: FloatArray,
    change: FloatArray,
    part: FloatArray,
    old: FloatArray,
    distances: FloatArray,
    new: FloatArray,
) -> None:
    """Fill the divided differences at the end of a step.

    Parameters
    ----------
    first : ndarray, shape (rows, solutions, columns)
        Content of row 0, which is no difference.
    change : ndarray, shape (rows, solutions, columns)
        Change of the values in the step, without `part` times that of row 0.
    part : ndarray, shape (solutions,)
    old : ndarray, shape (6, rows, solutions, columns)
        Divided differences at its start.
    distances : ndarray, shape (5, solutions)
        Distances from the end of the step back to the other points.
    new : ndarray, shape (6, rows, solutions, columns)
        Result.
    """
    _, rows, solutions, columns = old.shape
    for r in range(rows):
        for v in range(solutions):
            for i in range(columns):
                new[0, r, v, i] = first[r, v, i]
                value = change[r, v, i] + part[v] * (first[r, v, i] - old[0, r, v, i])
                value /= distances[0, v]
                new[1, r, v, i] = value
                for k in range(2, ROWS):
                    value = (value - old[k - 1, r, v, i]) / distances[k - 1, v]
                    new[k, r, v, i] = value


@subroutine
def local_errors(
    differences: FloatArray,
    spans: FloatArray,
    depths: FloatArray,
    orders: IntArray,
    parts: FloatArray,
    errors: FloatArray,
) -> FloatArray:
    """Return the relative error that the last step has added at each order.

    Parameters
    ----------
    differences : ndarray, shape (6, rows, solutions, columns)
    spans : ndarray, shape (5, solutions)
        Distances from the present point back to the past points.
    depths : ndarray, shape (rows, solutions, columns)
        Values at the present point.
    orders : ndarray of int, shape (solutions,)
        Order of the step.
    parts : ndarray, shape (rows, solutions, columns)
        Part of each error that counts, 0 to 1.
    errors : ndarray, shape (rows, solutions, columns)
        Result: error at this order, computed less true values.

    Returns
    -------
    ndarray, shape (4, solutions)
        Euclidean norm of the error at orders 1 to 4, over that of the values; infinite where
        points are missing.
    """
    _, rows, solutions, columns = differences.shape
    sizes = np.empty((MAX_ORDER, solutions))
    for v in range(solutions):
        size = 0.0
        for r in range(rows):
            for i in range(columns):
                size += depths[r, v, i] * depths[r, v, i]
                errors[r, v, i] = 0.0
        for k in range(MAX_ORDER):
            sizes[k, v] = np.inf
        product, inverse = 1.0, 0.0
        for k in range(MAX_ORDER):
            if not np.isfinite(spans[k + 1, v]):
                break
            product *= spans[k, v]
            inverse += 1.0 / spans[k, v]
            total = 0.0
            # the difference contains the error of the step itself
            factor = product / (inverse + 1.0 / spans[k + 1, v])
            for r in range(rows):
                for i in range(columns):
                    change = parts[r, v, i] * differences[k + 2, r, v, i]
                    total += change * change
                    if k < orders[v]:
                        errors[r, v, i] = factor * change
            sizes[k, v] = np.sqrt(total / size) * factor if size > 0.0 else 0.0
    return sizes


@kernel
def next_steps(
    differences: FloatArray,
    spans: FloatArray,
    depths: FloatArray,
    orders: IntArray,
    part: FloatArray,
    aim: float,
    keep: float,
    most: IntArray,
    parts: FloatArray,
    errors: FloatArray,
    next_orders: IntArray,
) -> FloatArray:
    """Return the excess of error of the last step, and order and length of the next one.

    Parameters
    ----------
    differences, spans, depths, orders
        As of `local_errors`.
    part : ndarray, shape (solutions,)
    aim : float
        Relative error that a step should add is ``aim / part``.
    keep : float
        Part of the length of a step at a lower order that is compared with those at other orders:
        below one, the order is lowered for clearly longer steps only.
    most : ndarray of int, shape (solutions,)
        Greatest order of the next step, at most `MAX_ORDER`.
    parts : ndarray, shape (rows, solutions, columns)
        As of `local_errors`.
    errors : ndarray, shape (rows, solutions, columns)
        Result: error of the step, as of `local_errors`.
    next_orders : ndarray of int, shape (solutions,)
        Result: order of the next step.

    Returns
    -------
    ndarray, shape (2, solutions)
        Error of the step relative to the greatest accepted one, zero where it is unknown, and
        ratio of the next step to it.
    """
    sizes = local_errors(differences, spans, depths, orders, parts, errors)
    steps = np.empty((2, len(part)))
    for v in range(len(part)):
        known, order = 0, orders[v]
        # without an estimate the order is kept
        excess, best, ratio, longest = 0.0, order, GROW[0], 0.0
        for k in range(MAX_ORDER):
            sizes[k, v] = sizes[k, v] * part[v] / aim
            known += np.isfinite(sizes[k, v])
        if known > 0:
            excess = sizes[min(order, known) - 1, v] / LIMIT
        known = min(known, most[v])
        for other in range(max(1, order - 1), min(order + 1, known) + 1):
            size = SAFETY * max(sizes[other - 1, v], 1e-12) ** (-1.0 / (other + 1))
            worth = keep * size if other < order else size
            if worth >= longest:
                longest, ratio, best = worth, size, other
        if 0 < known < order + 1 and order < most[v] and excess <= 1.0:
            best = order + 1  # the first steps have no estimate of the next order
        next_orders[v] = best
        steps[0, v], steps[1, v] = excess, min(ratio, GROW[best - 1])
    return steps


def first_differences(rates: FloatArray, exposure: FloatArray) -> FloatArray:
    """Return the differences of a solution with one point, from its change per pass."""
    differences = np.zeros((ROWS, *rates.shape))
    differences[0] = rates
    differences[1] = rates / exposure.reshape(-1, *(1,) * (rates.ndim - 2))
    return differences

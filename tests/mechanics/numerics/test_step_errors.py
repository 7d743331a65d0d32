"""Errors of an implicit step, interpreted, against plain formulas for each test.

A cylinder or a cam wears with a roller in two tests; the first one resolves edges within a strip.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

from wearsim.mechanics.numerics.implicit_step import WHOLE_PASSES
from wearsim.mechanics.numerics.linearised_wear import carried_errors
from wearsim.mechanics.numerics.multistep import MAX_ORDER, ROWS, next_steps
from wearsim.mechanics.numerics.step_errors import (
    BESIDE_YOUNG,
    COVER,
    EDGE_ORDER,
    EDGES,
    EDGES_EXPONENT,
    KEEP,
    LEAST_ENERGY,
    OF_VOLUME,
    OF_YOUNG,
    PART_EXPONENT,
    SHARE,
    YOUNG,
    assess_step,
    with_sum,
)
from wearsim.mechanics.numerics.young_strips import AT_START, OLD, WHOLE, mark_strips

TESTS, STRIPS, SIZE = 2, 7, 1e-6


class Step:
    """A step of two tests, with random errors and past points, on a cylinder or a cam."""

    def __init__(self, stations: int = 1) -> None:
        rng = np.random.default_rng(4)
        self.bodies = np.array([[station, stations] for station in range(stations)])
        self.shape, contacts = (stations + 1, TESTS, STRIPS), stations * TESTS
        self.orders = np.array([2, 3])
        self.spans = np.cumsum(10.0 + 90.0 * rng.random((ROWS - 1, TESTS)), axis=0)
        self.past = SIZE * 1e-3 * rng.standard_normal((ROWS, *self.shape))
        self.past[2:] *= 0.01
        self.past[0] = np.abs(self.past[0])
        self.past[0, :, :, 0] = 0.0
        self.sums = SIZE * 1e-6 * rng.standard_normal((ROWS, *self.shape[:2], 1))
        strips = contacts, STRIPS
        self.part = np.where(rng.random(strips) < 0.4, rng.random(strips), 1.0)
        self.part[::TESTS, :2], self.part[1::TESTS] = [0.0, 0.6], np.nan
        self.whole_steps = np.floor(9.0 * rng.random(strips))
        self.depths = SIZE * (1.0 + rng.random(self.shape))
        self.stepping = 1e-4 * SIZE * rng.standard_normal(self.shape)
        self.gap = SIZE * rng.random(strips)
        self.loads = 1e5 * rng.random(strips)
        self.exponents = 1.0 + rng.random(strips)
        self.wear = 1e-3 * SIZE * rng.random((2, *strips))
        self.approach = np.tile(SIZE * np.array([3.0, 4.0]), stations)
        self.stiffness = np.tile([0.0, 1e7], stations)
        self.displaced = SIZE * np.array([0.0, 0.02])
        self.volume_error = 1e-9 * SIZE * np.array([2.0, 3.0])
        self.irreducible = SIZE * np.array([[0.01, 0.02], [1e-9, 2e-9], [1e2, 3e2]])
        self.weights = np.array([[1.0] * stations + [0.5], [1e-6] * stations + [3e-7]])
        self.passes = np.array([2.0 * WHOLE_PASSES, 0.5 * WHOLE_PASSES])
        self.done, self.left = np.array([0.2, 0.6]), np.array([1.0, 0.4])
        self.begun, self.energy = np.array([300.0, 500.0]), np.array([4.0, 5.0])
        self.spent = np.array([1e-3, 0.02])  # in the step
        self.resolved = np.array([True, False])

    def assess(self):
        of_next, orders, estimates = np.empty((2, TESTS)), self.orders.copy(), np.empty((3, TESTS))
        errors = assess_step(
            1e-3, self.left, self.done, self.passes, self.begun, self.begun + self.passes,
            self.energy, self.energy + self.spent, self.displaced, self.volume_error,
            self.irreducible, self.stepping, self.depths, self.orders, self.spans, self.past,
            self.sums, self.part, self.whole_steps, self.bodies, self.gap, self.approach,
            self.loads, self.wear.copy(), self.exponents, self.stiffness, 1e-4, self.weights,
            of_next, orders, estimates,
        )  # fmt: skip
        return of_next, orders, errors, estimates


def error_of_sum(step: Step, b: int, v: int) -> float:
    """Return the error of the sum of the depths by the first term that a formula leaves out."""
    order = step.orders[v]
    spans = step.spans[: order + 1, v]
    factor = np.prod(spans[:order]) / (1.0 / spans).sum()
    return float(factor * step.sums[order + 1, b, v, 0])


@pytest.mark.parametrize("resolved", [[True, False], [True, True]])
def test_errors_of_strips_add_up_to_that_of_the_sum(resolved: list[bool]) -> None:
    step, rng = Step(), np.random.default_rng(5)
    errors, parts = SIZE * rng.standard_normal(step.shape), rng.random(step.shape)
    crossed = rng.random(step.shape) < 0.3
    parts[1, 0] = np.where(crossed[1, 0], parts[1, 0], 0.0)  # nothing that could be shifted
    arguments = crossed, np.array(resolved), step.sums, step.spans, step.orders
    found = with_sum(errors, parts, *arguments)
    for b in range(2):
        for v in range(TESTS):
            if not resolved[v]:
                np.testing.assert_array_equal(found[b, v], errors[b, v])
                continue
            assert not found[b, v, crossed[b, v]].any()
            free = ~crossed[b, v]
            shift = (found - errors)[b, v, free]
            if parts[b, v, free].any():
                total = error_of_sum(step, b, v)
                assert found[b, v].sum() == pytest.approx(total, rel=1e-9, abs=1e-12 * SIZE)
                per_part = shift / parts[b, v, free]
                np.testing.assert_allclose(per_part, per_part[0], rtol=1e-8)
            else:
                assert not shift.any()


def test_sum_without_past_points_has_no_error() -> None:
    step = Step()
    step.spans[1:] = np.inf
    errors, parts, none = np.zeros(step.shape), np.ones(step.shape), np.zeros(step.shape, bool)
    orders = np.ones(TESTS, np.int64)
    resolved = np.ones(TESTS, bool)
    found = with_sum(errors, parts, none, resolved, step.sums, step.spans, orders)
    assert not found.any()


@pytest.mark.parametrize("of_energy", [1e-12, 1e3])
@pytest.mark.parametrize("points", [2, 3, ROWS])
@pytest.mark.parametrize("stations", [1, 2])
def test_estimates_cover_errors_of_steps_edges_and_sums(
    stations: int, points: int, of_energy: float
) -> None:
    step = Step(stations)
    shape = step.shape
    step.sums[2:, -1] *= of_energy / SIZE
    step.spans[points - 1 :] = np.inf  # missing past points
    formulas, crossed = np.empty(shape, int), np.empty(shape, bool)
    parts, own, orders = np.empty(shape), np.empty(shape), np.empty(TESTS, np.int64)
    state = step.part, step.whole_steps, step.orders, step.past[0]
    mark_strips(step.bodies, step.resolved, *state, formulas, crossed, parts)
    young = formulas != OLD
    assert young[:, 0].any()
    assert crossed[:, 0].any()
    parts[young] *= YOUNG
    most = np.array([EDGE_ORDER, MAX_ORDER])
    scale = step.done ** np.array([EDGES_EXPONENT, PART_EXPONENT]) / step.left
    scale[0] /= BESIDE_YOUNG
    arguments = scale, SHARE * 1e-3, KEEP, most, parts, own, orders
    expected = next_steps(step.past, step.spans, step.depths, step.orders, *arguments)
    expected[0] *= step.left
    energy, by_energy = step.sums[:, -1:].copy(), np.empty(TESTS, np.int64)
    least = LEAST_ENERGY * (step.energy + step.spent) * step.passes / (step.begun + step.passes)
    worn, ones = np.maximum(step.spent, least)[None, :, None], np.ones((1, TESTS, 1))
    over, ratio = next_steps(
        *(energy, step.spans, worn, step.orders, np.ones(TESTS), 1e-3, KEEP, most, ones),
        *(np.empty((1, TESTS, 1)), by_energy),
    )
    governs = bool((ratio < expected[1]).all() and (over > expected[0]).all())
    assert governs == (of_energy > 1e-3) or points < ROWS
    orders = np.where(ratio < expected[1], by_energy, orders)
    expected = np.maximum(over, expected[0]), np.minimum(ratio, expected[1])
    own[:, 1] *= 2.0  # less than a whole pass
    added = with_sum(own, parts, crossed, step.resolved, step.sums, step.spans, step.orders)
    worn = step.wear * np.tile(step.passes, stations)[:, None]
    carried, sizes = carried_errors(
        step.stepping, added, step.loads, worn, step.exponents, step.approach, step.gap,
        step.depths, step.bodies, step.stiffness, 1e-4, step.weights,
    )  # fmt: skip
    found, next_orders, errors, estimates = step.assess()
    np.testing.assert_allclose(found, expected, rtol=1e-12)
    np.testing.assert_array_equal(next_orders, orders)
    np.testing.assert_allclose(errors, carried, rtol=1e-12)
    for v in range(TESTS):
        depth, volume, profile = sizes[:, v]
        deepest = step.depths[:, v].max()
        depth += step.displaced[v]
        if step.displaced[v] > 0.0:
            profile += step.displaced[v] / deepest
        if step.resolved[v]:
            spans = step.spans[:2, v]
            first_order = spans[0] / (1.0 / spans).sum() * step.past[2, :, v] * (points > 2)
            at_edge = np.where(crossed[:, v], own[:, v], 0.0)
            first_order *= np.where(formulas[:, v] == WHOLE, 1.0 - 2.0 * AT_START, 1.0)
            at_edge += np.where(young[:, v] & (step.past[0, :, v] > 0.0), first_order, 0.0)
            edges = EDGES * np.linalg.norm(at_edge) / np.linalg.norm(step.depths[:, v])
            profile = math.hypot(profile, edges)
            depth, volume = OF_YOUNG * depth, OF_YOUNG * volume
        least = step.irreducible[:, v]
        volume = COVER[1] * volume + step.volume_error[v]
        relative = volume / (step.weights[1] @ step.depths[:, v].sum(axis=1))
        depth = max(COVER[0] * depth, OF_VOLUME[0] * relative * deepest)
        profile = max(COVER[2] * profile, OF_VOLUME[1] * relative)
        wanted = np.array([depth, volume, profile]) + least
        np.testing.assert_allclose(estimates[:, v], wanted, rtol=1e-9)


def test_error_of_a_great_volume_is_one_of_depth_and_profile() -> None:
    step = Step()
    step.irreducible[:] = 0.0
    volumes = np.einsum("b,bvi->v", step.weights[1], step.depths)
    step.volume_error = 5000.0 * volumes
    estimates = step.assess()[3]
    relative = estimates[1] / volumes
    deepest = step.depths.max(axis=(0, 2))
    np.testing.assert_allclose(estimates[0], OF_VOLUME[0] * relative * deepest, rtol=1e-12)
    np.testing.assert_allclose(estimates[2], OF_VOLUME[1] * relative, rtol=1e-12)


def test_fresh_bodies_have_no_relative_errors() -> None:
    step = Step()
    step.displaced[:], step.depths[:] = 0.0, 0.0
    estimates = step.assess()[3]
    np.testing.assert_array_equal(estimates[2], step.irreducible[2])


def test_errors_of_depths_have_the_sum_of_the_errors_of_the_volume():
    rng = np.random.default_rng(8)
    errors, parts = rng.standard_normal((1, 3, 4)), rng.random((1, 3, 4))
    crossed = np.zeros((1, 3, 4), bool)
    crossed[0, 0, 2] = crossed[0, 2, 1] = True
    resolved = np.array([True, False, True])
    past = rng.standard_normal((6, 1, 3, 1))
    spans = np.array(
        [[1.0, 1.0, 0.5], [2.5, 2.0, 1.5], [4.0, 3.0, 2.5], [np.inf] * 3, [np.inf] * 3]
    )
    orders = np.array([2, 2, 3])
    found = with_sum(errors, parts, crossed, resolved, past, spans, orders)
    assert found[0, 1].tolist() == errors[0, 1].tolist()
    # of the highest order whose point is known: two
    for v in (0, 2):
        factor = np.prod(spans[:2, v]) / (1.0 / spans[:3, v]).sum()
        kept = ~crossed[0, v]
        assert found[0, v].sum() == pytest.approx(factor * past[3, 0, v, 0])
        moved = (found - errors)[0, v, kept] / parts[0, v, kept]
        assert moved == pytest.approx(np.full(kept.sum(), moved[0]))
        assert not found[0, v, ~kept].any()

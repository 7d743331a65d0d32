"""Parts of the solver of slender contacts, interpreted, against slow and readable references."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import brentq

from wearsim.mechanics.numerics.lu import solve_factored
from wearsim.mechanics.slender.body_wear import add_depths
from wearsim.mechanics.slender.half_length import fill_log_scales, find_factors, new_half_lengths
from wearsim.mechanics.slender.influence import curvature_table, influence_table, no_table
from wearsim.mechanics.slender.newton_step import (
    NewtonState,
    add_approach,
    add_displacement,
    add_missing_load,
    fill_jacobian,
    new_newton_state,
    number_strips,
    predict_surface,
    rest_on_foundation,
    update_loads,
)

STRIPS, SPACING, MODULUS, CURVATURE = 15, 2e-4, 1.15e11, 90.0
UNIT = 1.0 / (np.pi * MODULUS)
LENGTHS = {"coupled": curvature_table, "local": no_table}


def loaded() -> np.ndarray:
    """Return line loads of an ellipse, without load on the outer strips [N/m]."""
    y = np.linspace(-1.4, 1.4, STRIPS)
    return 4e4 * np.sqrt(np.maximum(1.0 - y**2, 0.0))[None]


class Contact:
    """Displacements of the strips of one contact, and the state of its solver."""

    def __init__(self, lengths: str) -> None:
        self.table = influence_table(STRIPS)
        self.lengths = new_half_lengths(LENGTHS[lengths](STRIPS), 1)
        fill_log_scales(MODULUS, np.array([CURVATURE]), SPACING, self.lengths.log_scale)
        self.state: NewtonState = new_newton_state(1, STRIPS)

    def displacement(self, line_load: np.ndarray) -> np.ndarray:
        """Return the displacement of all strips under line loads, with their half-lengths [m]."""
        state = self.state
        number_strips(0, line_load, STRIPS, state)
        find_factors(0, line_load, False, self.lengths)
        state.surface[0] = 0.0
        add_displacement(0, self.table, UNIT, line_load, self.lengths, state)
        return state.surface[0].copy()


@pytest.mark.parametrize("lengths", LENGTHS)
def test_jacobian_is_the_slope_of_the_displacements(lengths: str) -> None:
    contact, line_load = Contact(lengths), loaded()
    own = np.full((1, STRIPS), 2e-12)
    inside = np.flatnonzero(line_load[0] > 0.0)
    slopes = np.empty((len(inside), len(inside)))
    for column, j in enumerate(inside):
        ends = []
        for sign in (1.0, -1.0):
            moved = line_load.copy()
            moved[0, j] *= 1.0 + sign * 1e-5
            ends.append(contact.displacement(moved)[inside] + own[0, inside] * moved[0, inside])
        slopes[:, column] = (ends[0] - ends[1]) / (2e-5 * line_load[0, j])
    expected = contact.displacement(line_load)
    state = contact.state
    find_factors(0, line_load, True, contact.lengths)
    state.surface[0] = 0.0
    assert fill_jacobian(0, contact.table, UNIT, own, line_load, contact.lengths, state)
    np.testing.assert_allclose(state.surface[0], expected, rtol=1e-12)
    residual = np.linspace(-1e-6, 2e-6, len(inside))
    state.step[0, : len(inside)] = residual
    solve_factored(state.matrix[0], state.size[0], state.step[0])
    found = slopes @ state.step[0, : len(inside)]
    np.testing.assert_allclose(found, residual, atol=1e-4 * np.abs(residual).max())


def test_approach_keeps_the_load() -> None:
    contact, line_load = Contact("coupled"), loaded()
    state = contact.state
    number_strips(0, line_load, STRIPS, state)
    size = int(state.size[0])
    state.step[0, :size] = np.linspace(-5.0, 9.0, size)
    state.unit_load[0, :size] = np.linspace(1.0, 2.0, size)
    state.unit_load_sum[0] = state.unit_load[0, :size].sum()
    step, approach = state.step[0, :size].copy(), np.zeros(1)
    add_approach(0, 3e5, line_load, state, approach)
    np.testing.assert_allclose(line_load.sum() + state.step[0, :size].sum(), 3e5, rtol=1e-12)
    np.testing.assert_allclose(
        state.step[0, :size] - step, approach[0] * state.unit_load[0, :size], rtol=1e-9
    )


def test_strips_beside_loaded_ones_are_followed() -> None:
    state, line_load = new_newton_state(1, STRIPS), np.zeros((1, STRIPS))
    number_strips(0, line_load, 2, state)
    assert (state.size[0], state.left[0], state.right[0]) == (0, 0, STRIPS)
    line_load[0, 5] = 1.0
    number_strips(0, line_load, 2, state)
    assert (state.size[0], state.left[0], state.right[0]) == (1, 3, 8)
    assert state.rows[0].tolist() == [0 if i == 5 else -1 for i in range(STRIPS)]
    line_load[0, 1] = line_load[0, 13] = 2.0
    number_strips(0, line_load, 2, state)
    assert (state.size[0], state.left[0], state.right[0]) == (3, 0, STRIPS)
    assert state.place[0, :3].tolist() == [1, 5, 13]


@pytest.mark.parametrize("gap_in_contact", [False, True])
def test_surface_beside_the_contact_follows_the_loads(gap_in_contact: bool) -> None:
    contact, line_load = Contact("coupled"), loaded()
    if gap_in_contact:
        line_load[0, 7] = 0.0
    state, own = contact.state, np.zeros((1, STRIPS))
    number_strips(0, line_load, 1, state)
    find_factors(0, line_load, True, contact.lengths)
    state.surface[0] = 0.0
    assert fill_jacobian(0, contact.table, UNIT, own, line_load, contact.lengths, state)
    state.change[0] = np.where(line_load[0] > 0.0, 1e2 * np.arange(STRIPS), 0.0)
    surface = np.zeros((1, STRIPS))
    predict_surface(0, surface, state)
    size, left, right = int(state.size[0]), int(state.left[0]), int(state.right[0])
    inside = state.place[0, :size]
    expected = state.change[0, inside] @ state.outer[0, :size]
    beside = np.zeros(STRIPS, bool)
    beside[left : inside[0]] = beside[inside[-1] + 1 : right] = True
    if gap_in_contact:
        beside[left:right] = True
    assert beside.sum() == (right - left if gap_in_contact else 2)
    np.testing.assert_allclose(surface[0, beside], expected[beside], rtol=1e-12)
    assert not surface[0, ~beside].any()


def test_strips_in_tension_leave_the_contact() -> None:
    contact, line_load = Contact("coupled"), loaded()
    number_strips(0, line_load, STRIPS, contact.state)
    before, size = line_load.copy(), int(contact.state.size[0])
    contact.state.step[0, :size] = -0.5 * before[0, contact.state.place[0, 0]] * 1.5
    contact.state.step[0, 0] = -2.0 * before[0, contact.state.place[0, 0]]
    expected = before[0].copy()
    expected[contact.state.place[0, :size]] += contact.state.step[0, :size]
    change, left = update_loads(line_load, contact.state, False)
    assert left
    np.testing.assert_allclose(line_load[0], np.maximum(expected, 0.0), rtol=1e-12)
    np.testing.assert_allclose(contact.state.change[0], line_load[0] - before[0], rtol=1e-12)
    greatest = np.abs(line_load - before).max() / before.max()
    assert change == pytest.approx(greatest, rel=1e-12)


def test_foundation_carries_the_load() -> None:
    gap = 5.0 * np.linspace(-1e-3, 1e-3, STRIPS)[None] ** 2
    compliance, soft, load = np.linspace(0.0, 4e-12, STRIPS)[None], 2e-11, 2e5
    line_load, approach = np.zeros((1, STRIPS)), np.zeros(1)
    rest_on_foundation(0, gap, compliance, soft, load, 0, STRIPS, line_load, approach)

    def excess(level: float) -> float:
        return float((np.maximum(level - gap, 0.0) / (soft + compliance)).sum()) - load

    assert approach[0] == pytest.approx(brentq(excess, 0.0, 1e-3, xtol=1e-18), rel=1e-8)
    assert line_load.sum() == pytest.approx(load, rel=1e-8)


def test_missing_load_is_spread_evenly() -> None:
    line_load = loaded()[0]
    inside, total = line_load > 0.0, float(line_load.sum())
    before = line_load.copy()
    ratio = add_missing_load(1.02 * total, line_load)
    assert ratio == pytest.approx(0.02 / 1.02)
    added = (line_load - before)[inside]
    np.testing.assert_allclose(added, 0.02 * total / inside.sum(), rtol=1e-9)
    assert not line_load[~inside].any()


def test_wear_of_shared_bodies_opens_all_their_gaps() -> None:
    rng = np.random.default_rng(3)
    bodies = np.array([[0, 2], [0, -1], [1, 2], [-1, -1]])
    shared, line_load = rng.random((4, 2, STRIPS)), rng.random((4, STRIPS))
    surface = np.zeros((4, STRIPS))
    add_depths(bodies, shared, line_load, surface)
    for k in range(4):
        expected = np.zeros(STRIPS)
        for body in bodies[k][bodies[k] >= 0]:
            for contact, side in zip(*np.nonzero(bodies == body), strict=True):
                expected += shared[contact, side] * line_load[contact]
        np.testing.assert_allclose(surface[k], expected, rtol=1e-12)

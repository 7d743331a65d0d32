"""Parts of the solver of slender contacts, interpreted, against slow and readable references."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import brentq

from wearsim.mechanics.slender.body_wear import add_depths
from wearsim.mechanics.slender.half_length import (
    REACH,
    SWEEPS,
    add_length_slopes,
    fill_log_scales,
    find_factors,
    new_half_lengths,
)
from wearsim.mechanics.slender.influence import (
    curvature_table,
    influence_table,
    no_table,
    read_influence,
    read_value,
)
from wearsim.mechanics.slender.newton import CAUTIOUS, GAP_TOLERANCE, add_penetrated
from wearsim.mechanics.slender.newton_step import (
    REUSED,
    NewtonState,
    add_approach,
    add_displacement,
    add_missing_load,
    complete_surface,
    correct_residual,
    factor_jacobian,
    fill_jacobian,
    fill_missing,
    fill_separation,
    new_newton_state,
    number_strips,
    predict_surface,
    rest_on_foundation,
    update_loads,
)

SINGLE = 1e-5  # relative error of steps in single precision
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
        find_factors(0, line_load, False, SWEEPS, self.lengths)
        state.surface[0] = 0.0
        add_displacement(0, 0, STRIPS - 1, self.table, UNIT, line_load, self.lengths, state)
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
    find_factors(0, line_load, True, SWEEPS, contact.lengths)
    state.surface[0] = 0.0
    fill_jacobian(0, contact.table, UNIT, own, line_load, contact.lengths, state)
    np.testing.assert_allclose(state.surface[0], expected, rtol=1e-12)
    found = state.matrix[0, : len(inside), : len(inside)].T
    residual = np.linspace(-1e-6, 2e-6, len(inside))
    step = np.linalg.solve(found.astype(np.float64), residual)
    # derivatives of the half-lengths of strips beyond the reach are omitted
    np.testing.assert_allclose(slopes @ step, residual, atol=2e-4 * np.abs(residual).max())
    expected = np.linalg.solve(found.astype(np.float64), np.ones(len(inside)))
    assert factor_jacobian(0, state)
    np.testing.assert_allclose(state.unit_load[0, : len(inside)], expected, rtol=SINGLE)
    assert state.unit_load_sum[0] == pytest.approx(expected.sum(), rel=SINGLE)


@pytest.mark.parametrize("lengths", LENGTHS)
@pytest.mark.parametrize("inside", [range(3, 12), [2, 3, 4, 7, 8, 12], [7], range(STRIPS)])
def test_jacobian_has_the_tangents_of_the_table(lengths: str, inside: list[int]) -> None:
    contact, line_load, own = Contact(lengths), np.zeros((1, STRIPS)), np.ones((1, STRIPS))
    own *= 1e-12 * np.arange(STRIPS)
    line_load[0, inside] = 3e4 * (1.0 + np.random.default_rng(4).random(len(inside)))
    state, places, size = contact.state, np.arange(STRIPS), len(inside)
    number_strips(0, line_load, 2, state)
    find_factors(0, line_load, True, SWEEPS, contact.lengths)
    state.surface[0] = 1e-6
    fill_jacobian(0, contact.table, UNIT, own, line_load, contact.lengths, state)
    followed = slice(state.left[0], state.right[0])
    matrix, near = np.zeros((size, size)), np.zeros((REACH + 1, STRIPS))
    surface = np.full(STRIPS, 1e-6)
    for column, j in enumerate(inside):
        value, tangent = np.empty((2, STRIPS))
        tau = contact.lengths.log_ratio[0, j]
        read_influence(contact.table, tau, STRIPS, value, tangent)
        distance = np.abs(places - j)
        surface += UNIT * line_load[0, j] * value[distance]
        expected = UNIT * tangent[distance]
        matrix[column] = expected[inside]
        assert state.diagonal[0, column] == pytest.approx(UNIT * tangent[0], rel=1e-12)
        near[:, j] = UNIT * line_load[0, j] * (tangent - value)[: REACH + 1]
    np.testing.assert_allclose(state.surface[0, followed], surface[followed], rtol=1e-12)
    if lengths == "coupled":
        found = contact.lengths.near[: REACH + 1, 2 * REACH : -2 * REACH]
        scale = np.abs(near).max()
        np.testing.assert_allclose(found[:, inside], near[:, inside], atol=1e-12 * scale)
        add_length_slopes(0, line_load, state.rows, contact.lengths, matrix)
    matrix += np.diag(own[0, inside])
    scale = np.abs(matrix).max()
    found = state.matrix[0, :size, :size]
    np.testing.assert_allclose(found, matrix, atol=1e-7 * scale)  # single precision


def test_approach_keeps_the_load() -> None:
    contact, line_load = Contact("coupled"), loaded()
    state = contact.state
    number_strips(0, line_load, STRIPS, state)
    size = int(state.size[0])
    state.step[0, :size] = np.linspace(-5.0, 9.0, size)
    state.unit_load[0, :size] = np.linspace(1.0, 2.0, size)
    state.unit_load_sum[0] = state.unit_load[0, :size].astype(np.float64).sum()
    state.level[0] = 2e-6
    step, approach = state.step[0, :size].astype(np.float64), np.zeros(1)
    add_approach(0, 3e5, line_load, state, approach)
    added = state.step[0, :size] - step
    assert line_load.sum() + (step + added).sum() == pytest.approx(3e5, rel=1e-7)
    rise = (approach[0] - 2e-6) * state.unit_load[0, :size]
    np.testing.assert_allclose(added, rise, atol=1e-6 * np.abs(rise).max())


def test_residual_is_relative_to_the_mean_of_the_surface() -> None:
    state, line_load = new_newton_state(1, STRIPS), np.zeros((1, STRIPS))
    line_load[0, [3, 4, 7]] = 1.0
    number_strips(0, line_load, 1, state)
    state.surface[0] = 1e-6 * np.arange(STRIPS) ** 2
    fill_missing(0, state)
    surface = 1e-6 * np.array([9.0, 16.0, 49.0])
    assert state.level[0] == pytest.approx(surface.mean(), rel=1e-12)
    np.testing.assert_allclose(state.missing[0, :3], surface.mean() - surface, rtol=1e-9)


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
    state = contact.state
    number_strips(0, line_load, 1, state)
    find_factors(0, line_load, False, SWEEPS, contact.lengths)
    state.change[0] = np.where(line_load[0] > 0.0, 1e2 * np.arange(STRIPS), 0.0)
    state.surface[0] = 0.0
    predict_surface(0, contact.table, UNIT, contact.lengths.log_ratio, state)
    size, left, right = int(state.size[0]), int(state.left[0]), int(state.right[0])
    inside, expected = state.place[0, :size], np.zeros(STRIPS)
    for j in inside:
        value, tangent = np.empty((2, STRIPS))
        read_influence(contact.table, contact.lengths.log_ratio[0, j], STRIPS, value, tangent)
        expected += UNIT * state.change[0, j] * tangent[np.abs(np.arange(STRIPS) - j)]
    beside = np.zeros(STRIPS, bool)
    beside[left : inside[0]] = beside[inside[-1] + 1 : right] = True
    if gap_in_contact:
        beside[left:right] = True
    assert beside.sum() == (right - left if gap_in_contact else 2)
    np.testing.assert_allclose(state.surface[0, beside], expected[beside], rtol=1e-12)
    assert not state.surface[0, ~beside].any()


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


@pytest.mark.parametrize("load", [2e5, 1e3, 1e-3])
def test_foundation_carries_the_load(load: float) -> None:
    gap = 5.0 * np.linspace(-1e-3, 1e-3, STRIPS)[None] ** 2
    compliance, soft = np.linspace(0.0, 4e-12, STRIPS)[None], 2e-11
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


def full_displacement(contact: Contact, line_load: np.ndarray) -> np.ndarray:
    """Return the displacement of all strips, one loaded strip after the other [m]."""
    total = np.zeros(STRIPS)
    for j in np.flatnonzero(line_load[0]):
        for i in range(STRIPS):
            value = read_value(contact.table, contact.lengths.log_ratio[0, j], abs(i - j))
            total[i] += UNIT * line_load[0, j] * value
    return total


@pytest.mark.parametrize("reach", [(5, 11), (2, 11), (5, 14), (0, 12)])
def test_strips_that_may_be_penetrated_get_their_whole_surface(reach: tuple[int, int]) -> None:
    contact, line_load, state = Contact("local"), np.zeros((1, STRIPS)), new_newton_state(1, STRIPS)
    line_load[0, [6, 8]] = 3e4, 2e4
    number_strips(0, line_load, 1, state)
    find_factors(0, line_load, False, SWEEPS, contact.lengths)
    assert (state.left[0], state.right[0]) == (5, 10)
    places = np.arange(STRIPS)
    gap = np.where((places >= reach[0]) & (places < reach[1]), 1e-7 * places, 1e-3)
    gap[4] = gap[11] = 1e-3  # deep strips between those that may be penetrated
    followed = (places >= 5) & (places < 10)
    whole = full_displacement(contact, line_load)
    state.surface[0] = gap + np.where(followed, whole, 0.0)
    found = complete_surface(0, 1e-4, contact.table, UNIT, line_load, contact.lengths, state)
    near = np.flatnonzero((gap < 1e-4) & ~followed)
    first, end = min([5, *near]), max([9, *near]) + 1
    assert found == (first, end)
    known = gap + np.where((places >= first) & (places < end), whole, 0.0)
    np.testing.assert_allclose(state.surface[0], known, rtol=1e-12)


def test_residual_is_corrected_by_the_own_load_of_each_strip() -> None:
    contact, line_load, state = Contact("local"), loaded(), new_newton_state(1, STRIPS)
    number_strips(0, line_load, 1, state)
    find_factors(0, line_load, False, SWEEPS, contact.lengths)
    size, inside = int(state.size[0]), np.flatnonzero(line_load[0])
    state.step[0, :size] = line_load[0, inside] * np.linspace(-0.2, 0.3, size)
    state.step[0, 2] = 5.0 * line_load[0, inside[2]]  # far too great to be corrected
    state.diagonal[0, :size], state.missing[0, :size] = 2e-12, 1e-6
    correct_residual(0, contact.table, UNIT, line_load, contact.lengths, state)
    for row, j in enumerate(inside):
        old, step, tau = line_load[0, j], state.step[0, row], contact.lengths.log_ratio[0, j]
        known = 1e-6
        if row != 2:
            after = (old + step) * read_value(contact.table, tau + 0.5 * np.log1p(step / old), 0)
            known -= UNIT * (after - old * read_value(contact.table, tau, 0)) - 2e-12 * step
        assert state.missing[0, row] == pytest.approx(known, rel=1e-9)


def test_cautious_steps_reduce_loads_before_strips_leave() -> None:
    state, line_load = new_newton_state(1, STRIPS), np.zeros((1, STRIPS))
    line_load[0, 3:9] = 10.0, 0.9e-5, 8.0, 6.0, 4.0, 1.1e-5
    before = line_load.copy()
    number_strips(0, line_load, 1, state)
    state.fresh[0] = False
    state.step[0, :6] = 0.5, -1.0, -8.0, -7.0, 0.0, -1.0
    change, left = update_loads(line_load, state, True)
    # by a tenth at a time; a load far below the peak is removed
    assert line_load[0, 3:9].tolist() == pytest.approx([10.5, 0.0, 0.8, 0.6, 4.0, 1.1e-6])
    np.testing.assert_allclose(state.change, line_load - before)
    assert (change, left, state.fresh[0]) == (pytest.approx(0.72), True, True)
    state.fresh[0] = False
    number_strips(0, line_load, 1, state)
    state.step[0, :5] = 0.1, 0.1, 0.1, 0.1, 0.0
    assert update_loads(line_load, state, False) == (pytest.approx(0.1 / 10.5), False)
    assert not state.fresh[0]
    state.step[0, 0] = np.nan
    assert update_loads(line_load, state, False)[0] == np.inf


def test_only_contacts_that_change_much_have_a_new_jacobian() -> None:
    state, line_load = new_newton_state(3, STRIPS), np.zeros((3, STRIPS))
    line_load[:, 3:9] = 10.0, 12.0, 20.0, 12.0, 11.0, 10.0
    for k, part in enumerate((0.9, 1.0, 1.1)):
        number_strips(k, line_load, 1, state)
        state.step[k, :6] = part * REUSED * 20.0 * np.array([0.1, -0.2, 0.5, -1.0, 0.3, 0.0])
    state.fresh[:] = False
    change, left = update_loads(line_load, state, False)
    assert (change, left) == (pytest.approx(1.1 * REUSED), False)
    assert state.fresh.tolist() == [False, True, True]


def test_separation_is_that_of_the_deformed_surfaces() -> None:
    state, line_load = new_newton_state(1, STRIPS), np.zeros((1, STRIPS))
    line_load[0, 6:9] = 1.0
    number_strips(0, line_load, 2, state)
    gap = 1e-6 * (np.arange(STRIPS)[None] - 7.0) ** 2
    followed = (np.arange(STRIPS) >= 4) & (np.arange(STRIPS) < 11)
    pushed = 1e-6 * np.clip(np.arange(STRIPS), 4, 10) - 4e-6  # as the nearest followed strip
    state.surface[0], separation = gap[0] + pushed, np.full((1, STRIPS), -1.0)
    state.surface[0, ~followed] = np.nan
    fill_separation(0, gap, 4.5e-6, line_load, state, separation)
    known = np.maximum(gap[0] + pushed - 4.5e-6, 0.0)
    known[6:9] = 0.0
    np.testing.assert_allclose(separation[0], known, atol=1e-20)


def test_penetrated_strips_start_with_a_tenth_of_their_spring() -> None:
    state, approach = new_newton_state(1, STRIPS), np.array([5e-6])
    for iteration, chosen in ((1, [2, 3, 9]), (CAUTIOUS + 1, [9])):
        line_load = np.zeros((1, STRIPS))
        line_load[0, 5:8] = 1e4
        number_strips(0, line_load, STRIPS, state)
        state.surface[0] = 6e-6
        state.surface[0, [2, 3, 9, 5]] = 4e-6, 4.5e-6, 3e-6, 1e-6
        state.fresh[0] = False
        assert add_penetrated(0, 1, 12, iteration, UNIT, state, approach, line_load)
        known = np.zeros(STRIPS)
        known[5:8] = 1e4
        known[chosen] = 0.1 * (5e-6 - state.surface[0, chosen]) / UNIT
        np.testing.assert_allclose(line_load[0], known)
        assert state.fresh[0]
    # the tolerance is a part of the approach, or of its height above the least surface
    for lowest, size in ((1e-6, 5e-6), (-3e-6, 8e-6)):
        state.surface[0, 5] = lowest
        for part in (0.95, 1.05):
            state.surface[0, [2, 3, 9]] = 5e-6 - part * GAP_TOLERANCE * size
            arguments = UNIT, state, approach, line_load.copy()
            assert add_penetrated(0, 1, 12, 1, *arguments) == (part > 1.0)
    state.surface[0, [2, 3, 9, 5]] = 6e-6, 6e-6, 6e-6, 1e-6
    state.surface[0, 13] = 0.0  # its surface is not complete
    assert not add_penetrated(0, 1, 12, 1, UNIT, state, approach, line_load)
    # from the fortieth iteration on the tolerance is ten times as great
    state.surface[0, 2] = 5e-6 * (1.0 - 5.0 * GAP_TOLERANCE)
    assert add_penetrated(0, 1, 12, 39, UNIT, state, approach, line_load.copy())
    assert not add_penetrated(0, 1, 12, 40, UNIT, state, approach, line_load)

"""Chord method, interpreted: its anchor and remainder against differences of the displacement."""

from __future__ import annotations

import math

import numpy as np
import pytest

from wearsim.mechanics.slender.chord_method import (
    TAYLOR,
    ChordState,
    ContactConstants,
    Loads,
    fill_remainder,
    new_chord_state,
    set_anchor,
    solve_from_anchor,
    solve_fully,
)
from wearsim.mechanics.slender.half_length import REACH
from wearsim.mechanics.slender.influence import (
    curvature_table,
    influence_table,
    no_table,
    read_influence,
)
from wearsim.mechanics.slender.newton import CONVERGED, solve_slender
from wearsim.mechanics.slender.pass_loop import _fill_growth
from wearsim.mechanics.tangential.strip_interaction import strip_elasticity

STRIPS, SPACING, MODULUS = 11, 3e-4, 1.15e11
Y = SPACING * (np.arange(STRIPS) - STRIPS // 2)
CURVATURE = np.array([90.0, 110.0])
UNIT = 1.0 / (math.pi * MODULUS)


def constants(coupled: bool = False) -> ContactConstants:
    other = curvature_table(STRIPS) if coupled else no_table(STRIPS)
    elasticity = strip_elasticity(MODULUS, 8.1e10)
    return ContactConstants(
        SPACING, UNIT, MODULUS, CURVATURE, influence_table(STRIPS), other, elasticity
    )


def displacement(line_load: np.ndarray, g: int) -> np.ndarray:
    """Return the displacement of all strips by uncoupled strips, from the table of F."""
    half_length = np.sqrt(4.0 * line_load / (math.pi * MODULUS * CURVATURE[g]))
    table, total = influence_table(STRIPS), np.zeros(STRIPS)
    for j in np.flatnonzero(line_load > 0.0):
        value, tangent = np.empty((2, STRIPS))
        read_influence(table, math.log(half_length[j] / SPACING), STRIPS, value, tangent)
        total += UNIT * line_load[j] * value[np.abs(np.arange(STRIPS) - j)]
    return total


def jacobian(line_load: np.ndarray, g: int) -> np.ndarray:
    """Return its derivatives by the loads of the loaded strips, by differences."""
    columns = []
    for j in np.flatnonzero(line_load > 0.0):
        step = np.zeros(STRIPS)
        step[j] = 1e-5 * line_load[j]
        both = [displacement(line_load + side * step, g) for side in (1.0, -1.0)]
        columns.append((both[0] - both[1]) / (2.0 * step[j]))
    return np.array(columns).T


@pytest.fixture
def anchored() -> tuple[np.ndarray, ChordState, ContactConstants]:
    line_load = np.zeros((2, STRIPS))
    line_load[1, 2:9] = 1e5 * np.array([0.2, 0.6, 0.9, 1.0, 0.8, 0.5, 0.1])
    known = constants()
    state = new_chord_state(known, 2, STRIPS)
    assert set_anchor(1, line_load, known, state)
    return line_load, state, known


def test_anchor_holds_the_inverse_of_the_jacobian(anchored) -> None:
    line_load, state, _ = anchored
    whole = jacobian(line_load[1], 1)
    assert state.loaded[1] == 7
    assert state.active[1, :7].tolist() == list(range(2, 9))
    assert state.guard[1, :3].tolist() == [1, 9, -1]
    inner = np.linalg.inv(whole[2:9])
    assert pytest.approx(inner, rel=1e-6, abs=1e-6 * inner.max()) == state.inverse[1, :7, :7].T
    assert state.unit_load[1, :7] == pytest.approx(inner.sum(axis=1), rel=1e-6)
    assert state.guard_row[1, :2, :7] == pytest.approx(whole[[1, 9]], rel=1e-6)
    assert state.surface[1] == pytest.approx(displacement(line_load[1], 1), rel=1e-12)
    # separate regions of contact
    apart = np.zeros((2, STRIPS))
    apart[0, [0, 1, 5, 10]] = 1e4
    assert set_anchor(0, apart, constants(), state)
    assert state.active[0, :4].tolist() == [0, 1, 5, 10]
    assert state.guard[0, :5].tolist() == [2, 4, 6, 9, -1]
    rows = jacobian(apart[0], 0)[[2, 4, 6, 9]]
    assert state.guard_row[0, :4, :4] == pytest.approx(rows, rel=1e-6)
    full = np.full((2, STRIPS), 1e4)
    assert set_anchor(0, full, constants(), state)
    assert state.guard[0, 0] == -1


@pytest.mark.parametrize(
    ("change", "accuracy"), [(0.01, 0.02), (-0.01, 0.02), (0.3, 1e-9), (-0.3, 1e-9)]
)
def test_remainder_is_what_the_tangent_leaves(anchored, change: float, accuracy: float) -> None:
    line_load, state, known = anchored
    size = change * np.cos(np.arange(STRIPS)) if abs(change) < TAYLOR else change
    moved = line_load * (1.0 + size)
    zero = np.zeros((2, STRIPS))
    loads = Loads(moved, line_load, zero, np.zeros(2), np.zeros(2))
    fill_remainder(1, loads, known, state)
    tangent = jacobian(line_load[1], 1) @ (moved - line_load)[1, 2:9]
    left = displacement(moved[1], 1) - displacement(line_load[1], 1) - tangent
    allowed = accuracy * np.abs(left).max() + 1e-4 * np.abs(left).max() * (accuracy < 1e-3)
    assert state.remainder[1] == pytest.approx(left, abs=allowed)


def newton(gap: np.ndarray, load: float, g: int, known: ContactConstants) -> np.ndarray:
    """Return line loads by Newton's method."""
    shape = 1, 1, STRIPS
    line_load, approach, status = np.zeros(shape), np.zeros((1, 1)), np.zeros((2, 1), np.int64)
    options = np.full((1, 1), load), CURVATURE[g].reshape(1, 1), SPACING, MODULUS
    solve_slender(
        *(gap.reshape(shape), np.zeros(shape), None, None, *options),
        *(known.table, known.curvature_influence, line_load, approach),
        *(np.empty(shape), np.empty(shape), *status),
    )
    assert status[0] == CONVERGED
    return line_load[0, 0]


@pytest.mark.parametrize("coupled", [False, True])
@pytest.mark.parametrize("crown", [0.6, 0.8, 1.2, 5.0])
def test_solution_from_an_anchor_is_that_of_newtons_method(coupled: bool, crown: float) -> None:
    known, shape = constants(coupled), (2, STRIPS)
    loads = Loads(*np.zeros((3, *shape)), np.full(2, 1e-6), np.zeros(2))
    state = new_chord_state(known, 2, STRIPS)
    gap = crown * Y**2 + 1e-6
    state.gap[:] = gap
    assert not solve_from_anchor(1, 30.0, gap.min(), loads, known, state)
    assert solve_fully(1, 30.0, True, loads, known, state) == CONVERGED
    exact = newton(gap, 30.0, 1, known)
    assert loads.line_load[1] == pytest.approx(exact, rel=1e-6, abs=1e-6 * exact.max())
    assert (loads.anchor[1] == loads.line_load[1]).all()
    assert (loads.anchor_gap[1] == gap).all()
    assert loads.anchor_approach[1] == loads.approach[1]
    inside = exact > 0.0
    # a little more load on a gap that is a little tilted, within the contact
    tilted = gap + np.where(inside, 2e-6 * Y, 0.0)
    state.gap[:] = tilted
    assert solve_from_anchor(1, 30.1, tilted.min(), loads, known, state)
    exact = newton(tilted, 30.1, 1, known)
    assert loads.line_load[1] == pytest.approx(exact, abs=2e-5 * exact.max())
    assert loads.line_load[1].sum() * SPACING == pytest.approx(30.1, rel=1e-9)
    # a strip beside the contact that closes its gap needs a full solution
    elastic = loads.approach[1] - tilted.min()
    limit = loads.approach[1] - displacement(loads.line_load[1], 1)
    for guard in (np.flatnonzero(inside)[0] - 1, np.flatnonzero(inside)[-1] + 1):
        for side in () if coupled else (-1.0, 1.0):
            state.gap[:] = tilted
            state.gap[guard] = limit[guard] + side * 1e-4 * elastic
            closed = not solve_from_anchor(1, 30.1, tilted.min(), loads, known, state)
            assert closed == (side < 0.0)
    state.gap[:] = tilted
    assert not solve_from_anchor(1, 40.0, tilted.min(), loads, known, state)
    unanchored = Loads(*np.zeros((3, *shape)), np.full(2, 1e-6), np.zeros(2))
    assert solve_fully(1, 30.0, False, unanchored, known, state) == CONVERGED
    assert not unanchored.anchor.any()
    state.gap[3] = math.nan
    before = loads.line_load.copy()
    assert solve_fully(1, 30.0, True, loads, known, state) != CONVERGED
    assert (loads.line_load == before).all()


def test_growth_of_the_loads_is_a_logarithm() -> None:
    anchor = np.array([[0.0, 2.0, 3.0, 4.0, 0.0]])
    size = 5 + 4 * REACH
    for part in (1.015, 1.5):
        loads = Loads(
            anchor * [1.0, part, 0.99, 1.0, 1.0], anchor, anchor, np.zeros(1), np.zeros(1)
        )
        growth = np.full(size, 9.0)
        _fill_growth(0, 1, 3, loads, growth, size)
        known = np.zeros(size)
        known[2 * REACH + 1 : 2 * REACH + 4] = np.log([part, 0.99, 1.0])
        assert growth == pytest.approx(known, abs=1e-12)


def test_number_of_failed_sets_of_contacts_is_returned() -> None:
    known, gaps = constants(), np.stack([5.0 * Y**2, 5.0 * Y**2, 1e-3 * Y**2, 5.0 * Y**2])
    gaps[1, 3], gaps[3, 0] = math.inf, math.nan
    shape = 4, 1, STRIPS
    line_load, approach, status = np.zeros(shape), np.zeros((4, 1)), np.zeros((2, 4), np.int64)
    failed = solve_slender(
        *(gaps.reshape(shape), np.zeros(shape), None, None, np.full((4, 1), 30.0)),
        *(np.full((4, 1), 100.0), SPACING, MODULUS, known.table, known.curvature_influence),
        *(line_load, approach, np.empty(shape), np.empty(shape), *status),
    )
    # the second and the last gap are not finite, and the third contact reaches both ends
    assert failed == 3
    assert (status[0, [0, 2]] == CONVERGED).all()
    assert (status[0, [1, 3]] != CONVERGED).all()
    assert line_load[2, 0, 0] > 0.0
    assert line_load[0, 0, 0] == 0.0

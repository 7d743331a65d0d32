"""Chord method, interpreted: its anchor and remainder against differences of the displacement."""

from __future__ import annotations

import math

import numpy as np
import pytest

from wearsim.mechanics.slender.chord_method import (
    BAND,
    DOUBLED,
    STRAY,
    ChordState,
    ContactConstants,
    Loads,
    _has_penetrated_strip,
    _solve_chord,
    fill_remainder,
    new_chord_state,
    set_anchor,
    solve_from_anchor,
    solve_fully,
)
from wearsim.mechanics.slender.half_length import log_half_length
from wearsim.mechanics.slender.influence import (
    curvature_table,
    influence_table,
    no_table,
    read_influence,
)
from wearsim.mechanics.slender.newton import CONVERGED, NOT_FINITE, TOLERANCE, solve_slender
from wearsim.mechanics.tangential.strip_interaction import strip_elasticity

STRIPS, SPACING, MODULUS = 17, 3e-4, 1.15e11
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


def chord_state(known: ContactConstants) -> ChordState:
    """Return a state with its work space filled with numbers that a correct method ignores."""
    state = new_chord_state(known, 2, STRIPS)
    for array in (state.inverse, state.unit_load, state.guard_row, state.surface):
        array[:] = np.nan
    return state


@pytest.mark.parametrize(
    "places",
    [range(2, 9), [0, 1, 5, 8, STRIPS - 1], range(STRIPS), [0], [9, STRIPS - 1]],
    ids=["one patch", "at both ends", "all strips", "first strip", "last strip"],
)
def test_anchor_holds_the_inverse_of_the_jacobian(places: list[int]) -> None:
    line_load, known = np.zeros((2, STRIPS)), constants()
    inside = np.isin(np.arange(STRIPS), places)
    line_load[1, inside] = 1e5 * (0.2 + np.random.default_rng(2).random(inside.sum()))
    line_load[1, places[-1]] = 0.5  # far less than others
    state, count = chord_state(known), len(places)
    assert set_anchor(1, line_load, known, state)
    whole, beside = jacobian(line_load[1], 1), np.convolve(inside, [1, 0, 1], "same") > 0
    guards = np.flatnonzero(beside & ~inside)
    assert state.loaded[1] == count
    assert state.active[1, :count].tolist() == list(places)
    assert state.guard[1, : len(guards)].tolist() == guards.tolist()
    assert (state.guard[1, len(guards) : len(guards) + 1] == -1).all()
    inverse = np.linalg.inv(whole[inside])
    found = state.inverse[1, :count, :count].T
    np.testing.assert_allclose(found, inverse, atol=1e-6 * np.abs(inverse).max())
    np.testing.assert_allclose(state.unit_load[1, :count], found.sum(axis=1), rtol=1e-12)
    rows = state.guard_row[1, : len(guards), :count]
    np.testing.assert_allclose(rows, whole[guards], rtol=3e-5)
    np.testing.assert_allclose(state.surface[1], displacement(line_load[1], 1), rtol=1e-12)


def test_anchor_of_a_singular_contact_fails() -> None:
    known = constants()._replace(unit=0.0)
    assert not set_anchor(0, np.ones((2, STRIPS)), known, new_chord_state(known, 2, STRIPS))


def nonlinear(before: np.ndarray, after: np.ndarray, state: ChordState, g: int) -> np.ndarray:
    """Return the displacement beyond the tangent, up to the band beside each strip [m]."""
    total, places = np.zeros(STRIPS), np.arange(STRIPS)
    for j in np.flatnonzero(before[g]).tolist():
        read = []
        for line_load in (before, after):
            value, tangent = np.empty((2, STRIPS))
            tau = log_half_length(g, j, line_load, state.lengths)
            read_influence(influence_table(STRIPS), tau, STRIPS, value, tangent)
            read.append((value, tangent))
        (first, tangent), (last, _) = read
        beyond = after[g, j] * last - before[g, j] * first - tangent * (after - before)[g, j]
        distance = np.abs(places - j)
        total += UNIT * np.where(distance < BAND, beyond[distance], 0.0)
    return total


@pytest.mark.parametrize("coupled", [False, True])
@pytest.mark.parametrize("peak", [1e5, 1.0])
@pytest.mark.parametrize("span", [slice(2, 15), slice(0, STRIPS), slice(4, 5)])
def test_remainder_is_what_the_tangent_leaves(coupled: bool, peak: float, span: slice) -> None:
    known, zero = constants(coupled), np.zeros((2, STRIPS))
    line_load = zero.copy()
    line_load[1, span] = peak * (0.2 + np.random.default_rng(1).random(STRIPS))[span]
    state = chord_state(known)
    assert set_anchor(1, line_load, known, state)
    for change, accuracy in ((0.01, 1e-4), (-0.014, 1e-4), (0.3, 1e-9), (-0.3, 1e-9)):
        for shape in (np.ones(STRIPS), np.cos(np.arange(STRIPS)) ** 3):
            moved = line_load * (1.0 + change * shape)
            loads = Loads(moved, line_load, zero, np.zeros(2), np.zeros(2))
            state.remainder[1] = np.nan
            fill_remainder(1, loads, known, state)
            left = nonlinear(line_load, moved, state, 1)
            allowed = accuracy * np.abs(left).max()
            np.testing.assert_allclose(state.remainder[1], left, rtol=1e-4, atol=allowed)


@pytest.mark.parametrize("count", range(1, 10))
def test_strip_beside_the_contact_closes_its_gap(count: int) -> None:
    state, rng = new_chord_state(constants(), 2, STRIPS), np.random.default_rng(count)
    state.guard_row[:], state.change[:] = rng.standard_normal((STRIPS, STRIPS)), rng.random(STRIPS)
    state.loaded[1], (state.gap[:], state.surface[1]) = count, rng.random((2, STRIPS))
    state.guard[1, :3], state.guard[1, 3:] = [0, 4, 9], -1
    state.gap[-1] = -100.0  # no strip beside the contact
    surface = state.gap + state.surface[1]
    for r, i in enumerate([0, 4, 9]):
        surface[i] += state.guard_row[1, r, :count] @ state.change[:count]
    least = surface[[0, 4, 9]].min()
    assert not _has_penetrated_strip(1, least + 0.999e-6, 1e-6, state)
    assert _has_penetrated_strip(1, least + 1.001e-6, 1e-6, state)


class Chord:
    """Equations of the chord method with a random inverse."""

    def __init__(self, count: int) -> None:
        rng, shape = np.random.default_rng(count), (2, STRIPS)
        self.known, self.count = constants(), count
        self.state: ChordState = chord_state(self.known)
        self.places = np.sort(rng.permutation(STRIPS)[:count])
        self.state.loaded[1], self.state.active[1, :count] = count, self.places
        inverse = 1e9 * (np.eye(STRIPS) + 0.3 * rng.random((STRIPS, STRIPS)))
        self.state.inverse[1, :STRIPS, :STRIPS] = inverse
        self.state.gap[:] = 1e-6 * rng.random(STRIPS)
        self.state.unit_load[1] = 1e9 * (1.0 + rng.random(STRIPS))
        self.state.remainder[1] = 1e-8 * rng.random(STRIPS)
        self.loads = Loads(*(np.zeros(shape) for _ in range(3)), np.zeros(2), np.array([1.0, 3e-6]))
        self.loads.anchor[1, self.places] = 1e4 * (1.0 + rng.random(count))
        self.loads.anchor_gap[1] = self.state.gap + 2e-8 * rng.random(STRIPS)
        self.load = 1.0001 * SPACING * self.loads.anchor[1].sum()

    def change(self) -> tuple[np.ndarray, float]:
        """Return the change of the loads, and of the approach, by the equations."""
        count, state = self.count, self.state
        closer = (self.loads.anchor_gap[1] - state.gap - state.remainder[1])[self.places]
        fixed = state.inverse[1, :count, :count].T @ closer
        missing = self.load / SPACING - self.loads.anchor[1].sum() - fixed.sum()
        rise = missing / state.unit_load[1, :count].sum()
        return fixed + state.unit_load[1, :count] * rise, rise

    def solve(self) -> bool:
        return bool(_solve_chord(1, self.load, self.loads, self.known, self.state))


@pytest.mark.parametrize("count", range(1, 10))
def test_chord_equations_keep_the_load(count: int) -> None:
    chord = Chord(count)
    (change, rise), anchor = chord.change(), chord.loads.anchor[1, chord.places]
    assert chord.solve()
    found = chord.loads.line_load[1]
    np.testing.assert_allclose(found[chord.places], anchor + change, rtol=1e-12)
    np.testing.assert_allclose(chord.state.change[:count], change, rtol=1e-9)
    assert found.sum() * SPACING == pytest.approx(chord.load, rel=1e-12)
    assert chord.loads.approach[1] == pytest.approx(3e-6 + rise, rel=1e-12)


@pytest.mark.parametrize("size", [0.99, 1.01])
def test_chord_equations_end_far_from_the_anchor(size: float) -> None:
    chord = Chord(5)
    # the greatest change is a part of the greatest load
    change, anchor = chord.change()[0], chord.loads.anchor[1]
    allowed, peak = STRAY * anchor.max(), anchor.argmax()
    assert np.abs(change).max() < allowed
    chord.load += SPACING * 1.0
    step = chord.change()[0] - change  # by one newton per metre
    where = np.abs(step).argmax()
    chord.load += SPACING * ((size * allowed - change[where]) / step[where] - 1.0)
    assert np.abs(chord.change()[0]).max() == pytest.approx(size * allowed, rel=1e-3)
    assert chord.solve() == (size < 1.0)
    # or of the load of a strip that has little
    chord = Chord(5)
    place = next(one for one in range(5) if chord.places[one] != peak)
    change = chord.change()[0][place]
    anchor = chord.loads.anchor[1]
    anchor[chord.places[place]], before = (
        abs(change) / (size * DOUBLED),
        anchor[chord.places[place]],
    )
    chord.load += SPACING * (anchor[chord.places[place]] - before)
    assert chord.change()[0][place] == pytest.approx(change)
    assert chord.solve() == (size < 1.0)


def newton(gap: np.ndarray, load: float, g: int, known: ContactConstants) -> np.ndarray:
    """Return line loads by Newton's method."""
    shape = 1, 1, STRIPS
    line_load, approach, status = np.zeros(shape), np.zeros((1, 1)), np.zeros((2, 1), np.int64)
    options = np.full((1, 1), load), CURVATURE[g].reshape(1, 1), SPACING, MODULUS
    solve_slender(
        *(gap.reshape(shape), np.zeros(shape), None, None, *options),
        *(known.table, known.curvature_influence, TOLERANCE, line_load, approach),
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
    gap = crown * Y**2 + 0.02  # of a deep groove
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
    # the interaction of half-lengths is that of the anchor
    accuracy = 2e-5 if coupled else 1e-7
    assert loads.line_load[1] == pytest.approx(exact, rel=accuracy, abs=accuracy * exact.max())
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


def test_number_of_failed_sets_of_contacts_is_returned() -> None:
    ends = [5.0 * (Y - Y[0]) ** 2, 5.0 * (Y - Y[-1]) ** 2]
    gaps = np.stack([5.0 * Y**2, 5.0 * Y**2, 1e-3 * Y**2, 5.0 * Y**2, *ends])
    gaps[1, 3], gaps[3, 0] = math.inf, math.nan
    known, shape = constants(), (6, 1, STRIPS)
    line_load, approach, status = np.zeros(shape), np.zeros((6, 1)), np.zeros((2, 6), np.int64)
    failed = solve_slender(
        *(gaps.reshape(shape), np.zeros(shape), None, None, np.full((6, 1), 30.0)),
        *(
            np.full((6, 1), 100.0),
            SPACING,
            MODULUS,
            known.table,
            known.curvature_influence,
            TOLERANCE,
        ),
        *(line_load, approach, np.empty(shape), np.empty(shape), *status),
    )
    # two gaps are not finite, and three contacts reach one end or both
    assert failed == 5
    assert (status[0, [0, 2, 4, 5]] == CONVERGED).all()
    assert (status[0, [1, 3]] == NOT_FINITE).all()
    assert (status[1, [1, 3]] == 0).all()
    assert line_load[2, 0, 0] > 0.0
    assert line_load[0, 0, 0] == 0.0

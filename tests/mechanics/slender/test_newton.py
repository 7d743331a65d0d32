"""Parts of Newton's method for sets of contacts, interpreted, against their equations."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq

from wearsim.mechanics.slender.body_wear import new_depth_system
from wearsim.mechanics.slender.half_length import (
    SWEEPS,
    fill_log_scales,
    find_factors,
    new_half_lengths,
)
from wearsim.mechanics.slender.influence import curvature_table, influence_table, read_value
from wearsim.mechanics.slender.newton import (
    AT_BEST,
    CAUTIOUS,
    CONTINUE,
    CONVERGED,
    FIRST,
    FIRST_FOUNDATION,
    FIRST_MARGIN,
    FOUNDATION,
    MARGIN,
    MUCH,
    NOT_FINITE,
    SHRINKING,
    SINGULAR,
    TOLERANCE,
    TOO_FINE,
    ContactSet,
    check_convergence,
    factor_contacts,
    fill_steps,
    rest_contacts,
    start_strips,
)
from wearsim.mechanics.slender.newton_step import (
    SMALL,
    correct_residual,
    fill_jacobian,
    new_newton_state,
    number_strips,
)

SINGLE = 1e-5  # relative error of steps in single precision
STRIPS, SPACING, MODULUS, CURVATURE = 48, 1.3e-4, 1.15e11, np.array([90.0, 110.0])
UNIT, TABLE = 1.0 / (np.pi * MODULUS), influence_table(STRIPS)
Y = SPACING * (np.arange(STRIPS) - 22.0)
BODIES = np.array([[0, 1], [0, 2]])


class Contacts:
    """Two contacts that wear a cylinder and their own rollers, or separate bodies."""

    def __init__(self, shared: bool, spacing: float = SPACING, soft: float = 2e-12) -> None:
        rng = np.random.default_rng(7)
        self.gap = 3e-6 + np.array([[4.0], [7.0]]) * Y**2 + 1e-8 * rng.random((2, STRIPS))
        self.compliance = soft * rng.random((2, STRIPS))
        self.loads = np.array([30.0, 20.0])
        self.set = ContactSet(self.gap, self.compliance, self.loads, spacing, UNIT, TABLE)
        self.worn: Any = 1e-12 * rng.random((2, 2, STRIPS)) if shared else None
        self.members: Any = BODIES if shared else None
        self.system: Any = new_depth_system(BODIES, STRIPS) if shared else None
        self.state = new_newton_state(2, STRIPS)
        self.lengths = new_half_lengths(curvature_table(STRIPS), 2)
        fill_log_scales(MODULUS, CURVATURE, spacing, self.lengths.log_scale)
        self.line_load = 2e4 * np.maximum(1.0 - (Y / [[6e-4], [4e-4]]) ** 2, 0.0)
        self.approach = np.zeros(2)

    def start(self, corrected: bool = False) -> bool:
        arguments = self.set, self.members, self.worn
        return bool(start_strips(*arguments, corrected, self.line_load, self.state))

    def rest(self, displaced: bool) -> None:
        arguments = self.set, self.members, self.worn, displaced, self.line_load
        rest_contacts(*arguments, self.approach, self.lengths, self.state)

    def factor(self) -> tuple[int, bool]:
        arguments = self.set, self.members, self.worn, self.system, self.line_load
        status: tuple[int, bool] = factor_contacts(*arguments, self.lengths, self.state)
        return status

    def jacobian(self, k: int) -> np.ndarray:
        """Return the Jacobian of a separate contact, without strips that both contacts touch."""
        state, size = new_newton_state(2, STRIPS), int(self.state.size[k])
        number_strips(k, self.line_load, MARGIN, state)
        state.surface[:] = 0.0
        find_factors(k, self.line_load, True, SWEEPS, self.lengths)
        arguments = self.state.softness, self.line_load, self.lengths, state
        fill_jacobian(k, TABLE, UNIT, *arguments)
        found: np.ndarray = state.matrix[k, :size, :size].T.astype(np.float64)
        return found

    def wear(self, line_load: np.ndarray) -> np.ndarray:
        """Return how much the gaps open by the wear of the shared bodies [m]."""
        total = np.zeros((2, STRIPS))
        if self.worn is not None:
            total = self.worn[:, 1] * line_load + (self.worn[:, 0] * line_load).sum(axis=0)
        return total

    def displacement(self, line_load: np.ndarray, sweeps: int = SWEEPS) -> np.ndarray:
        """Return the displacement of all strips, with the half-lengths of the loads [m]."""
        total = np.zeros((2, STRIPS))
        for k in range(2):
            find_factors(k, line_load, False, sweeps, self.lengths)
            for j in np.flatnonzero(line_load[k]):
                tau = self.lengths.log_ratio[k, j]
                value = [read_value(TABLE, tau, abs(i - int(j))) for i in range(STRIPS)]
                total[k] += UNIT * line_load[k, j] * np.array(value)
        return total

    def surface(self, line_load: np.ndarray, sweeps: int = SWEEPS) -> np.ndarray:
        """Return gaps above their least one, with wear and displacement [m]."""
        above = self.gap - self.gap.min(axis=1, keepdims=True) + self.compliance * line_load
        found: np.ndarray = above + self.wear(line_load)
        found += self.displacement(line_load, sweeps)
        return found


def on_springs(gap: np.ndarray, soft: np.ndarray, load: float) -> tuple[np.ndarray, float]:
    """Return line loads and level of strips that are springs."""

    def total(level: float) -> float:
        return float((np.maximum(level - gap, 0.0) / soft).sum())

    level = brentq(lambda x: total(x) - load, gap.min(), gap.max() + load * soft.max(), xtol=1e-19)
    return np.maximum(level - gap, 0.0) / soft, level


@pytest.mark.parametrize("shared", [False, True])
def test_start_has_the_load_of_each_contact(shared: bool) -> None:
    these = Contacts(shared)
    before = these.line_load.copy()
    assert these.start()  # as there is wear
    state, inside = these.state, before > 0.0
    np.testing.assert_array_equal(state.lowest, these.gap.min(axis=1))
    assert state.fresh.all()
    softness = these.compliance + (2.0 * these.worn.sum(axis=1) if shared else 0.0)
    np.testing.assert_allclose(state.softness, softness, rtol=1e-14)
    for k in range(2):
        added = (these.line_load - before)[k, inside[k]]
        lacked = these.loads[k] / SPACING - before[k].sum()
        np.testing.assert_allclose(added, lacked / inside[k].sum(), rtol=1e-9)
        place = np.flatnonzero(inside[k])
        assert (state.left[k], state.right[k]) == (
            max(place[0] - FIRST_MARGIN, 0), min(place[-1] + 1 + FIRST_MARGIN, STRIPS)
        )  # fmt: skip


def test_foundation_corrects_starts_that_lack_much_of_the_load_or_wear() -> None:
    for missing in (0.9 * MUCH, 1.1 * MUCH):
        these = Contacts(False, soft=0.0)
        these.line_load *= these.loads[:, None] / SPACING / these.line_load.sum(axis=1)[:, None]
        assert not these.start()
        assert these.start(True)
        these.line_load[0] *= 1.0 - missing  # the second contact lacks nothing
        assert these.start() == (missing > MUCH)
    these = Contacts(True, soft=0.0)
    these.line_load *= these.loads[:, None] / SPACING / these.line_load.sum(axis=1)[:, None]
    assert these.start()


@pytest.mark.parametrize("shared", [False, True])
def test_contact_without_a_start_rests_on_springs(shared: bool) -> None:
    these = Contacts(shared)
    these.line_load[1] = 0.0
    these.start()
    before = these.line_load.copy()
    these.rest(False)
    np.testing.assert_array_equal(these.line_load[0], before[0])
    soft = FIRST_FOUNDATION * UNIT + these.state.softness[1]
    gap, load = these.gap[1] - these.gap[1].min(), these.loads[1] / SPACING
    known, level = on_springs(gap, soft, load)
    np.testing.assert_allclose(these.line_load[1], known, atol=1e-8 * known.max())
    assert these.approach[1] == pytest.approx(level, rel=1e-8)


@pytest.mark.parametrize("shared", [False, True])
def test_springs_under_the_displacement_correct_the_loads(shared: bool) -> None:
    these = Contacts(shared)
    these.start()
    start = these.line_load.copy()
    soft = FOUNDATION * UNIT + these.state.softness
    surface = these.surface(start, sweeps=1) - soft * start
    these.rest(True)
    for k in range(2):
        part = slice(these.state.left[k], these.state.right[k])
        load = these.loads[k] / SPACING
        known, level = on_springs(surface[k, part], soft[k, part], load)
        found = these.line_load[k, part]
        np.testing.assert_allclose(found, known, atol=1e-8 * known.max())
        assert these.approach[k] == pytest.approx(level, rel=1e-8)
    narrow = Contacts(shared, spacing=SPACING / 1000.0)
    narrow.start()
    before = narrow.line_load.copy()
    narrow.rest(True)  # strips far narrower than long keep their loads
    np.testing.assert_array_equal(narrow.line_load, before)


@pytest.mark.parametrize("shared", [False, True])
def test_residuals_are_those_of_the_deformed_surfaces(shared: bool) -> None:
    these = Contacts(shared)
    these.start()
    surface, state = these.surface(these.line_load), these.state
    assert these.factor() == (CONTINUE, True)
    assert not state.fresh.any()
    for k in range(2):
        size, place = int(state.size[k]), state.place[k]
        followed = slice(state.left[k], state.right[k])
        assert state.left[k] == place[0] - MARGIN
        np.testing.assert_allclose(state.surface[k, followed], surface[k, followed], rtol=1e-12)
        missing = surface[k, place[:size]].mean() - surface[k, place[:size]]
        np.testing.assert_allclose(state.missing[k, :size], missing, atol=1e-12 * surface[k].max())
        unit_load = np.linalg.solve(these.jacobian(k), np.ones(size))
        np.testing.assert_allclose(state.unit_load[k, :size], unit_load, rtol=SINGLE)
        assert state.unit_load_sum[k] == pytest.approx(unit_load.sum(), rel=SINGLE)
    # the same Jacobians are kept for other loads
    these.line_load *= 1.01
    surface, matrix = these.surface(these.line_load), state.matrix.copy()
    assert these.factor() == (CONTINUE, False)
    for k in range(2):
        size, place = int(state.size[k]), state.place[k]
        missing = surface[k, place[:size]].mean() - surface[k, place[:size]]
        np.testing.assert_allclose(state.missing[k, :size], missing, atol=1e-12 * surface[k].max())
        np.testing.assert_array_equal(state.matrix[k, :size, :size], matrix[k, :size, :size])


@pytest.mark.parametrize("corrected", [False, True])
@pytest.mark.parametrize("shared", [False, True])
def test_steps_solve_the_linearised_equations(shared: bool, corrected: bool) -> None:
    these = Contacts(shared)
    these.start()
    these.factor()
    state, step = these.state, np.zeros((2, STRIPS))
    state.step[:] = 0.02 * these.line_load.max()  # of the sweep before
    missing, size = state.missing.copy(), state.size.tolist()
    if corrected:
        for k in range(2):
            correct_residual(k, TABLE, UNIT, these.line_load, these.lengths, state)
        missing, state.missing[:] = state.missing.copy(), missing
    arguments = these.set, these.members, these.worn, these.system, corrected, these.line_load
    fill_steps(*arguments, these.approach, these.lengths, state)
    for k in range(2):
        step[k, state.place[k, : size[k]]] = state.step[k, : size[k]]
        load = (these.line_load + step)[k].sum() * SPACING
        assert load == pytest.approx(these.loads[k], rel=1e-7)
    opened = np.zeros(STRIPS)
    if shared:  # strips of the cylinder that both contacts touch
        both = (these.line_load > 0.0).all(axis=0)
        assert 0 < both.sum() < max(size)
        opened = both * (these.worn[:, 0] * step).sum(axis=0)
    for k in range(2):
        place = state.place[k, : size[k]]
        rise = these.approach[k] - state.level[k]
        found = these.jacobian(k) @ step[k, place] + opened[place] - rise
        error = SINGLE * np.abs(missing[k, : size[k]]).max()
        np.testing.assert_allclose(found, missing[k, : size[k]], rtol=0.0, atol=error)


def test_contacts_without_a_jacobian_are_refused() -> None:
    narrow = Contacts(False, spacing=SPACING / 1000.0)
    narrow.start()
    assert narrow.factor() == (TOO_FINE, True)
    for broken in ("unit_load_sum", "unit", "worn"):
        these = Contacts(broken == "worn")
        these.start()
        if broken == "unit":
            these.set = these.set._replace(unit=0.0, compliance=0.0 * these.compliance)
            these.state.softness[:], these.state.unit_load_sum[:] = 0.0, 1.0
        if broken == "worn":
            these.worn[:] = np.nan
        if broken == "unit_load_sum":
            these.factor()
            these.state.unit_load_sum[0] = 0.0
        assert these.factor() == (SINGULAR, broken != "unit_load_sum")


class Check:
    """Convergence of two separate contacts without penetrated strips."""

    def __init__(self, shared: bool = False) -> None:
        self.these = Contacts(shared)
        self.these.start()
        self.state, self.line_load = self.these.state, self.these.line_load
        for k in range(2):
            number_strips(k, self.line_load, MARGIN, self.state)
            find_factors(k, self.line_load, False, SWEEPS, self.these.lengths)
        self.state.surface[:], self.approach = 2e-6, np.array([1e-6, 1.5e-6])
        self.state.fresh[:], self.state.change[:] = False, 0.0

    def __call__(
        self, change: float, before: float = 0.0, iteration: int = 1, left: bool = False
    ) -> tuple[int, float]:
        result: tuple[int, float] = check_convergence(
            *(iteration, TOLERANCE, before, change, left, self.these.set),
            *(self.these.members, self.these.worn),
            *(self.these.lengths, self.state, self.approach, self.line_load),
        )
        return result


@pytest.mark.parametrize(
    ("before", "ratio"),
    [(0.0, FIRST), (1e-2, AT_BEST), (None, 0.3), (1e-12, 1.0)],
    ids=["first step", "fast", "linear", "growing"],
)
def test_predicted_change_of_the_next_step_ends_the_iteration(before: Any, ratio: float) -> None:
    check = Check()
    for size in (0.9, 1.1):
        change = size * TOLERANCE / ratio
        last = change / ratio if before is None else before
        expected = CONVERGED if size < 1.0 else CONTINUE
        assert check(change, last) == (expected, change)
    for change in (np.inf, np.nan):
        assert check(change)[0] == NOT_FINITE


def test_strips_that_leave_or_enter_prolong_the_iteration() -> None:
    check = Check()
    assert check(1e-12, left=True) == (CONTINUE, 0.0)
    for k in range(2):
        outer = check.state.left[k] + 1, check.state.left[k] - 2  # followed, and not followed
        for i in outer:
            check = Check()
            check.state.surface[k, i] = 0.5 * check.approach[k]
            assert check(1e-12) == (CONTINUE, 0.0)
            assert check.line_load[k, i] > 0.0
            assert check.state.fresh.tolist() == [k == 0, k == 1]
    # strips that are not followed are tested at the end only, the others after large changes too
    for outwards, change, added in ((2, 2.0 * SMALL, False), (-1, 2.0 * SMALL, True),
                                    (-1, 0.5 * SMALL, False)):  # fmt: skip
        check = Check()
        check.state.surface[0, check.state.left[0] - outwards] = 0.5 * check.approach[0]
        assert check(change) == (CONTINUE, 0.0 if added else change)


def test_unloaded_strips_are_tested_where_the_next_step_has_moved_them() -> None:
    for shared in (False, True):
        check = Check(shared)
        state, i = check.state, int(check.state.left[0]) + 1
        height = check.approach[0] - 2e-9  # the load of the second contact wears the cylinder
        state.surface[0, i], state.change[:] = height, 0.0
        check.these.worn = 1e-12 * np.ones((2, 2, STRIPS)) if shared else None
        state.change[1, i] = 3e3
        added = check(1e-12) == (CONTINUE, 0.0)
        assert added != shared


def test_cautious_iterations_add_strips_once_others_have_settled() -> None:
    for iteration, change, left, added in (
        (CAUTIOUS, 2e-3, True, True),
        (CAUTIOUS, 0.8 * SMALL, False, False),
        (CAUTIOUS + 1, 1.2 * SMALL, False, False),
        (CAUTIOUS + 1, 0.8 * SMALL, False, True),
        (CAUTIOUS + 1, 0.8 * SMALL, True, False),
    ):
        check = Check()
        i = int(check.state.left[0]) + 1
        check.state.surface[0, i] = 0.5 * check.approach[0]
        found = check(change, iteration=iteration, left=left)
        assert found == (CONTINUE, 0.0 if left or added else change)
        assert (check.line_load[0, i] > 0.0) == added


@pytest.mark.parametrize(
    ("change", "ratio"), [(0.3, 0.9 * SHRINKING), (0.3, 1.1 * SHRINKING), (1e-3, 0.25)]
)
def test_slow_convergence_renews_the_jacobian(change: float, ratio: float) -> None:
    check = Check()
    assert check(change, change / ratio) == (CONTINUE, change)
    renewed = ratio > SHRINKING
    assert check.state.fresh.tolist() == [renewed, renewed]

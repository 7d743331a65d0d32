"""Loop over roller passes, interpreted: each pass against its own equations.

The normal contact of a pass is compared with that of Newton's method, and its wear with that of
strip theory, for the gap, the load and the creepage that are computed here.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pytest

from wearsim.mechanics.slender.chord_method import ContactConstants, Loads, new_chord_state
from wearsim.mechanics.slender.influence import curvature_table, influence_table
from wearsim.mechanics.slender.newton import CONVERGED, solve_slender
from wearsim.mechanics.slender.pass_loop import UNLOADED, Passes, Wear, run_passes
from wearsim.mechanics.tangential.strip_interaction import strip_elasticity
from wearsim.mechanics.tangential.strip_theory import new_tractions, solve_strips

STRIPS, SPACING, MODULUS, SHEAR = 9, 3e-4, 1.15e11, 8.1e10
Y = SPACING * (np.arange(STRIPS) - STRIPS // 2)
CURVATURE, SPEED = np.array([90.0, 110.0]), np.array([2.0, 3.0])
ORDER = np.array([0, 1, 1])
CONSTANTS = ContactConstants(
    SPACING,
    1.0 / (np.pi * MODULUS),
    MODULUS,
    CURVATURE,
    influence_table(STRIPS),
    curvature_table(STRIPS),
    strip_elasticity(MODULUS, SHEAR),
)


@dataclass
class Loop:
    """Two contacts whose bodies wear, optionally with a spring and with load terms."""

    stiffness: float = 0.0
    rests: bool = False
    similar: bool = False
    terms: np.ndarray = field(default_factory=lambda: np.zeros((0, 2)))
    term_rates: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))
    load: float = 300.0

    def __post_init__(self) -> None:
        count = 6
        self.passes = Passes(
            self.load + 10.0 * np.arange(count),
            np.array([1e-3, 2e-4]) * (1.0 + 0.1 * np.arange(count)[:, None]),
            0.1 + 0.01 * np.arange(count),
            1e-4 * np.arange(count),
            0.2 * np.arange(count),
        )
        self.nominal = np.array([5.0, 6.0])[:, None] * Y**2 + 1e-6
        self.from_apex = np.stack([Y, 1.1 * Y])
        slips = np.stack([1e-4 * Y / Y[-1], -2e-4 * (Y / Y[-1]) ** 2])
        self.wear = Wear(
            slips,
            np.stack([Y, Y - 1e-4]),
            np.array([12.0, 15.0]),
            np.array([1e-11, 2e-11, 3e-11]),
            1e-7 * (1.0 + np.arange(STRIPS)),
            1e-8 * np.arange(2 * STRIPS).reshape(2, -1),
        )
        shape = 2, STRIPS
        self.loads = Loads(
            np.zeros(shape), np.zeros(shape), np.zeros(shape), np.full(2, 2e-6), np.zeros(2)
        )
        self.fresh, self.energy = np.full(count, 1e-6), np.zeros(2)

    def run(self, first: int, count: int = 1) -> tuple[int, int, int]:
        """Run some passes; return the status, and the numbers of passes done and solved in full."""
        chosen = slice(first, first + count)
        status: tuple[int, int, int] = run_passes(
            ORDER,
            first,
            Passes(*(one[chosen] for one in self.passes)),
            self.stiffness,
            self.fresh[chosen],
            self.rests,
            self.terms,
            self.term_rates,
            self.nominal,
            self.from_apex,
            SPEED,
            self.similar,
            CONSTANTS,
            self.wear,
            self.loads,
            new_chord_state(CONSTANTS, 2, STRIPS),
            self.energy,
        )
        return status

    def copies(self) -> dict[str, np.ndarray]:
        """Return the arrays that the passes change."""
        arrays = {**self.wear._asdict(), **self.loads._asdict()}
        arrays |= {"energy": self.energy, "terms": self.terms}
        return {name: array.copy() for name, array in arrays.items()}


def solved(gap: np.ndarray, load: float, g: int) -> tuple[np.ndarray, np.ndarray, float]:
    """Return line load [N/m], half-length [m] and approach [m] of one contact."""
    shape = 1, 1, STRIPS
    line_load, half_length, approach = np.zeros(shape), np.zeros(shape), np.zeros((1, 1))
    status: Any = np.zeros((2, 1), np.int64)
    solve_slender(
        gap.reshape(shape),
        np.zeros(shape),
        None,
        None,
        np.full((1, 1), load),
        CURVATURE[g].reshape(1, 1),
        SPACING,
        MODULUS,
        CONSTANTS.table,
        CONSTANTS.curvature_influence,
        line_load,
        approach,
        half_length,
        np.empty(shape),
        *status,
    )
    assert status[0] == CONVERGED
    return line_load[0, 0], half_length[0, 0], float(approach[0, 0])


def check_pass(loop: Loop, p: int, accuracy: float) -> None:
    """Run pass `p`, and compare it with its equations."""
    g, before = ORDER[p % 3], loop.copies()
    assert loop.run(p)[:2] == (CONVERGED, 1)
    unworn = loop.nominal[g] + loop.passes.tilt[p] * loop.from_apex[g]
    cylinder, roller = before["cylinder_depth"], before["roller_depth"][g]
    gap, after = unworn + cylinder + roller, loop.copies()
    # the load, which a spring and the terms change, and its contact
    zero = unworn.min() + loop.fresh[p]
    free = loop.passes.base_load[p] + before["terms"][:, g].sum()
    load = free - loop.stiffness * (after["approach"][g] - zero)
    assert after["line_load"][g].sum() * SPACING == pytest.approx(load, rel=max(accuracy, 2e-6))
    line_load, half_length, approach = solved(gap, after["line_load"][g].sum() * SPACING, g)
    peak = line_load.max()
    np.testing.assert_allclose(after["line_load"][g], line_load, atol=accuracy * peak)
    assert after["approach"][g] == pytest.approx(approach, rel=accuracy)
    # the creepage varies about its mean by load, and the work wears both bodies
    friction, spin = np.full(STRIPS, loop.passes.friction[p]), loop.passes.spin[p]
    slip = loop.wear.slip_base[g] - spin * loop.wear.spin_arm[g]
    slip = slip + loop.wear.slip_rates[0] * roller - loop.wear.slip_rates[1] * cylinder
    slip += loop.passes.creepage[p, 0] - (line_load @ slip) / line_load.sum()
    tractions, lateral = new_tractions(STRIPS), loop.passes.creepage[p, 1]
    solve_strips(
        half_length, line_load, friction, slip, lateral, spin, SPACING, CONSTANTS.elasticity,
        tractions,
    )  # fmt: skip
    work, other = tractions.work, 1 - g
    tolerance = accuracy * work.max()
    rates = loop.wear.depth_per_work
    worn = after["cylinder_depth"] - cylinder
    np.testing.assert_allclose(worn, rates[0] * work, atol=rates[0] * tolerance)
    worn = after["roller_depth"][g] - roller
    np.testing.assert_allclose(worn, rates[1 + g] * work, atol=rates[1 + g] * tolerance)
    power = SPEED[g] * SPACING * work.sum()
    added = after["energy"] - before["energy"]
    assert added[g] == pytest.approx(power, rel=accuracy)
    terms = before["terms"].copy()
    for t, (gain, *rate) in enumerate(loop.term_rates):
        terms[t, g] += rate[g] * (gain * power - terms[t, g])
    np.testing.assert_allclose(after["terms"], terms, rtol=accuracy)
    for name in ("roller_depth", "line_load", "anchor", "approach", "energy"):
        np.testing.assert_array_equal(after[name][other], before[name][other], name)


@pytest.mark.parametrize("p", [0, 2, 4])
def test_pass_agrees_with_its_equations(p: int) -> None:
    check_pass(Loop(), p, 1e-8)


@pytest.mark.parametrize("p", [0, 1])
def test_spring_and_terms_change_the_load_of_a_pass(p: int) -> None:
    rates = np.array([[2.0, 0.3, 0.4], [5.0, 0.2, 0.1]])
    terms = np.array([[4.0, -6.0], [1.0, 3.0]])
    check_pass(Loop(stiffness=2e7, terms=terms, term_rates=rates), p, 1e-8)


def test_stiff_spring_and_contact_share_their_displacement() -> None:
    check_pass(Loop(stiffness=3e8), 0, 1e-7)


def test_pass_from_an_anchor_is_no_full_solution() -> None:
    loop = Loop(similar=True)
    loop.passes.base_load[2], loop.passes.tilt[2] = (
        loop.passes.base_load[1] + 1.0,
        loop.passes.tilt[1],
    )
    assert loop.run(1) == (CONVERGED, 1, 1)
    assert loop.run(2) == (CONVERGED, 1, 0)


def test_pass_from_an_anchor_agrees_with_its_equations() -> None:
    loop = Loop(similar=True)
    assert loop.run(1) == (CONVERGED, 1, 1)
    np.testing.assert_array_equal(loop.loads.anchor[1], loop.loads.line_load[1])
    assert loop.loads.anchor_approach[1] == loop.loads.approach[1]
    anchor = loop.loads.anchor.copy()
    loop.passes.base_load[2] = loop.passes.base_load[1] + 1.0
    loop.passes.tilt[2] = loop.passes.tilt[1]
    check_pass(loop, 2, 2e-5)
    np.testing.assert_array_equal(loop.loads.anchor, anchor)  # it was used
    assert loop.loads.approach[1] > loop.loads.anchor_approach[1]


def test_far_from_the_anchor_it_is_moved() -> None:
    loop = Loop(similar=True)
    loop.run(1)
    anchor = loop.loads.anchor.copy()
    loop.passes.base_load[2] = 1.2 * loop.passes.base_load[1]
    check_pass(loop, 2, 1e-7)
    assert (loop.loads.anchor[1] > anchor[1]).any()


def test_passes_follow_each_other() -> None:
    whole, parts = Loop(load=200.0), Loop(load=200.0)
    assert whole.run(0, 4) == (CONVERGED, 4, 4)
    for p in range(4):
        parts.run(p)
    for name, array in whole.copies().items():
        np.testing.assert_array_equal(array, parts.copies()[name], name)


def test_pass_without_load_is_an_error_or_a_rest() -> None:
    rates, terms = np.array([[2.0, 0.25, 0.5]]), np.array([[1.0, -2.0]])
    loop = Loop(load=-50.0, terms=terms.copy(), term_rates=rates)
    before = loop.copies()
    assert loop.run(0, 2) == (UNLOADED, 0, 0)
    loop.rests = True
    assert loop.run(0, 2) == (CONVERGED, 2, 0)
    after = loop.copies()
    np.testing.assert_allclose(after.pop("terms"), terms * (1.0 - rates[:, 1:]), rtol=1e-14)
    for name, array in after.items():
        np.testing.assert_array_equal(array, before[name], name)


def test_spring_carries_no_load_beyond_its_length() -> None:
    loop = Loop(stiffness=1e9)
    loop.wear.cylinder_depth[:] += 1e-5
    assert loop.run(0)[0] == UNLOADED

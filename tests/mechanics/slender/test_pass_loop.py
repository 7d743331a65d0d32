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
from wearsim.mechanics.slender.half_length import REACH
from wearsim.mechanics.slender.influence import curvature_table, influence_table
from wearsim.mechanics.slender.newton import (
    CONVERGED,
    NO_CONVERGENCE,
    NOT_FINITE,
    SINGULAR,
    TOLERANCE,
    solve_slender,
)
from wearsim.mechanics.slender.pass_loop import (
    SMALL,
    UNLOADED,
    Passes,
    Wear,
    _fill_growth,
    _wear_strips,
    run_passes,
)
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
    crown: float = 5.0
    constants: ContactConstants = CONSTANTS

    def __post_init__(self) -> None:
        count = 6
        self.passes = Passes(
            self.load + 10.0 * np.arange(count),
            np.array([1e-3, 2e-4]) * (1.0 + 0.1 * np.arange(count)[:, None]),
            0.1 + 0.01 * np.arange(count),
            1e-4 * np.arange(count),
            0.2 * np.arange(count),
        )
        self.nominal = self.crown * np.array([1.0, 1.2])[:, None] * Y**2 + 1e-6
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
            self.constants,
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
        TOLERANCE,
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
    np.testing.assert_allclose(worn, rates[0] * work, rtol=3e-7, atol=rates[0] * tolerance)
    worn = after["roller_depth"][g] - roller
    atol = rates[1 + g] * tolerance
    np.testing.assert_allclose(worn, rates[1 + g] * work, rtol=3e-7, atol=atol)
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
@pytest.mark.parametrize("crown", [5.0, 0.02], ids=["in the middle", "on all strips"])
def test_pass_agrees_with_its_equations(crown: float, p: int) -> None:
    loop = Loop(crown=crown)
    check_pass(loop, p, 1e-8)
    assert (loop.loads.line_load[ORDER[p % 3]] > 0.0).all() == (crown < 1.0)


@pytest.mark.parametrize("p", [0, 1])
def test_spring_and_terms_change_the_load_of_a_pass(p: int) -> None:
    rates = np.array([[2.0, 0.3, 0.4], [5.0, 0.2, 0.1]])
    terms = np.array([[4.0, -6.0], [1.0, 3.0]])
    check_pass(Loop(stiffness=2e7, terms=terms, term_rates=rates), p, 1e-8)


@pytest.mark.parametrize(("load", "stiffness"), [(300.0, 2e7), (0.01, 1e4)])
def test_spring_of_a_worn_contact_has_a_smaller_load(load: float, stiffness: float) -> None:
    loop = Loop(load=load, stiffness=stiffness)
    loop.fresh[:] = 0.3e-6  # the bodies are worn by more
    check_pass(loop, 0, 2e-7)
    assert loop.loads.line_load[0].sum() * SPACING < load


def test_stiff_spring_and_contact_share_their_displacement() -> None:
    check_pass(Loop(stiffness=3e8), 0, 2e-7)


@pytest.mark.parametrize("crown", [5.0, 0.02], ids=["in the middle", "on all strips"])
def test_pass_from_an_anchor_is_no_full_solution(crown: float) -> None:
    loop = Loop(similar=True, crown=crown)
    loop.passes.base_load[2], loop.passes.tilt[2] = (
        loop.passes.base_load[1] + 1.0,
        loop.passes.tilt[1],
    )
    assert loop.run(1) == (CONVERGED, 1, 1)
    assert loop.run(2) == (CONVERGED, 1, 0)


def test_light_contact_is_solved_from_its_anchor() -> None:
    loop = Loop(similar=True, crown=30.0)
    loop.passes.base_load[:], loop.passes.tilt[:] = 1e-4, 0.0
    assert loop.run(1) == (CONVERGED, 1, 1)
    assert loop.loads.line_load.max() < 1.0
    assert loop.run(2) == (CONVERGED, 1, 0)


@pytest.mark.parametrize("crown", [5.0, 0.02], ids=["in the middle", "on all strips"])
def test_pass_from_an_anchor_agrees_with_its_equations(crown: float) -> None:
    loop = Loop(similar=True, crown=crown)
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
    check_pass(loop, 2, 2e-7)
    assert (loop.loads.anchor[1] > anchor[1]).any()


def test_passes_follow_each_other() -> None:
    whole, parts = Loop(load=200.0), Loop(load=200.0)
    assert whole.run(1, 4) == (CONVERGED, 4, 4)
    for p in range(1, 5):
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


def test_pass_with_load_by_its_terms_alone_rests_where_passes_may() -> None:
    rates, terms = np.array([[2.0, 0.25, 0.5]]), np.array([[300.0, 200.0]])
    loop = Loop(terms=terms.copy(), term_rates=rates)
    loop.passes.base_load[:2] = 0.0
    check_pass(loop, 0, 1e-8)
    loop.rests, before = True, loop.copies()
    assert loop.run(1) == (CONVERGED, 1, 0)
    after = loop.copies()
    np.testing.assert_allclose(after.pop("terms")[0, 1], 0.5 * terms[0, 1], rtol=1e-14)
    for name, array in after.items():
        np.testing.assert_array_equal(array, before[name], name)
    loop.passes.base_load[1] = 0.5  # a little load of its own
    assert loop.run(1) == (CONVERGED, 1, 1)


def test_spring_carries_no_load_beyond_its_length() -> None:
    loop = Loop(stiffness=1e9)
    loop.wear.cylinder_depth[:] += 1e-5
    assert loop.run(0)[0] == UNLOADED


def test_load_of_a_rigid_spring_does_not_converge() -> None:
    loop = Loop(stiffness=1e20)
    loop.wear.cylinder_depth[:], loop.wear.roller_depth[:] = 0.0, 0.0
    assert loop.run(0) == (NO_CONVERGENCE, 0, 0)


def test_contact_without_a_solution_ends_the_passes() -> None:
    loop = Loop()
    loop.nominal[1, 3] = np.inf
    assert loop.run(0, 3) == (NOT_FINITE, 1, 1)


def test_singular_anchor_is_refused() -> None:
    loop = Loop(similar=True, constants=CONSTANTS._replace(unit=0.0))
    loop.loads.anchor[1] = 1.0
    assert loop.run(0, 2) == (SINGULAR, 0, 0)


@pytest.mark.parametrize("size", [1.0, 1e-3])
@pytest.mark.parametrize("part", [0.99 * SMALL, -0.99 * SMALL, 1.5 * SMALL, 0.5])
def test_growth_of_the_loads_is_a_logarithm(part: float, size: float) -> None:
    for first, last in ((1, 3), (0, 4)):
        anchor, shape = np.zeros((2, 5)), np.array([3.0, 2.0, 3.0, 0.7, 0.9])
        anchor[1, first : last + 1] = size * shape[first : last + 1]
        relative = np.array([1.0 - part / 2.0, 1.0 + part, 0.985, 1.0, 1.0 - part / 3.0])
        loads = Loads(anchor * relative, anchor, anchor, np.zeros(2), np.zeros(2))
        growth, known = np.full(5 + 4 * REACH, 9.0), np.zeros(5 + 4 * REACH)
        _fill_growth(1, first, last, loads, growth, len(growth))
        inside = slice(first + 2 * REACH, last + 1 + 2 * REACH)
        known[inside] = np.log(relative)[first : last + 1]
        np.testing.assert_allclose(growth, known, atol=4e-13)


@pytest.mark.parametrize("size", [0.99 * SMALL, 3.0 * SMALL])
def test_half_lengths_of_an_anchored_contact_follow_the_loads(size: float) -> None:
    loop, state = Loop(), new_chord_state(CONSTANTS, 2, STRIPS)
    rng, line_load = np.random.default_rng(6), loop.loads.line_load
    line_load[1] = 1e5 * (1.0 + rng.random(9))
    state.loaded[1], state.active[1] = 9, np.arange(9)
    # ln q grows by one in one strip only, on which its neighbours depend
    loop.loads.anchor[1] = line_load[1]
    loop.loads.anchor[1, 4] *= np.exp(-1.0)
    growth = size * np.linspace(-1.0, 1.0, 9) * (np.abs(np.arange(9) - 4) <= REACH)
    for i in range(4 - REACH, 5 + REACH):
        state.lengths.slope[1, REACH + 4 - i, i + 2 * REACH] = growth[i]
    state.lengths.factor[1] = 0.5 + rng.random(9)
    for anchored in (True, False):
        state.work[:], state.tractions.work[:] = np.nan, np.nan
        passes = loop.passes, CONSTANTS, state, loop.wear
        _wear_strips(1, 0, loop.loads, anchored, *passes)
        grown = np.exp(growth) if anchored else np.ones(9)
        square = 4.0 * line_load[1] * state.lengths.factor[1] * grown
        known = np.sqrt(square / (np.pi * MODULUS * CURVATURE[1]))
        np.testing.assert_allclose(state.strip_inputs[0], known, rtol=7e-14)

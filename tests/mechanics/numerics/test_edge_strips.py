"""Kernels of strips that an edge crosses, interpreted, against plain formulas for each strip.

Two rollers wear a cylinder in three tests, of which the last one does not resolve edges.
"""

from __future__ import annotations

import numpy as np
import pytest

from wearsim.mechanics.numerics.edge_strips import (
    ELASTIC,
    ENTERED,
    FLAT,
    FULL,
    LEAST,
    NONE,
    SETTLED,
    EdgeStrips,
    by_others,
    compare_edges,
    edge_strips,
    end_edges,
    fill_resolved,
    fill_separations,
    linearise_edges,
    part_at,
    start_edges,
    sum_of_wear,
)
from wearsim.mechanics.numerics.young_strips import (
    FIRST_STEPS,
    OLD,
    PARTIAL,
    WHOLE,
    YOUNG_STEPS,
    mark_strips,
)

TESTS, STRIPS, ROLLERS = 3, 12, 2
CONTACTS, SIZE = ROLLERS * TESTS, 1e-6
ALL = np.ones(TESTS, np.bool_)
ROLLERS_OF_ONE = np.array([[0, 1], [0, 2]])
STATIONS = np.array([[0, 2], [1, 2]])  # of a cam that one roller passes


class Edges:
    """Strips with a random state, and their wear in a step."""

    def __init__(self, bodies: np.ndarray = ROLLERS_OF_ONE) -> None:
        rng = np.random.default_rng(8)
        self.bodies, self.shape = bodies, (3, TESTS, STRIPS)
        self.part = rng.random((CONTACTS, STRIPS))
        self.part[rng.random(self.part.shape) < 0.25] = 0.0
        self.part[rng.random(self.part.shape) < 0.25] = 1.0
        self.part[1, [0, -1]] = 0.0
        self.separation = np.where(self.part < 1.0, SIZE * rng.random(self.part.shape), 0.0)
        self.separation[:, ::2] *= 0.1  # some are far smaller than those ahead
        self.approach = SIZE * (2.0 + rng.random(CONTACTS))
        self.wear = SIZE * rng.random((2, CONTACTS, STRIPS)) * (self.part > 0.0)
        self.loads = np.where(rng.random(self.part.shape) < 0.7, 1.0 + self.part, 0.0)
        self.whole_steps = np.floor((SETTLED + 3.0) * rng.random(self.part.shape))
        self.resolved = np.array([True, True, False])
        of_bodies = SIZE * rng.random((6, *self.shape))
        gap = SIZE * rng.random(self.part.shape)
        depths = SIZE * rng.random(self.shape)
        self.strips: EdgeStrips = edge_strips(
            bodies, self.resolved, gap, depths, self.part, of_bodies, np.zeros((2, *gap.shape))
        )
        start_edges(self.strips, self.separation, self.approach)
        middle = self.strips.first + 0.5 * self.strips.rise
        self.level = middle + self.strips.rise * (rng.random(gap.shape) - 0.6)

    def each(self):
        """Yield contact, test and strip of the tests that resolve edges."""
        for k in range(CONTACTS):
            for i in range(STRIPS if self.resolved[k % TESTS] else 0):
                yield k, k % TESTS, i

    def of(self, values: np.ndarray, k: int, i: int) -> float:
        """Return the sum of depths of the two bodies of a contact."""
        return sum(values[b, k % TESTS, i] for b in self.bodies[k // TESTS])

    def sums(self, wear: np.ndarray) -> np.ndarray:
        found = np.zeros(self.shape)
        for c, pair in enumerate(self.bodies):
            for side, b in enumerate(pair):
                found[b] += wear[side, c * TESTS : (c + 1) * TESTS]
        return found

    def share(self, b: int, k: int, i: int) -> float:
        """Return the part of the wear by others that lowers a strip ahead of the edge too."""
        part = self.part[k, i]
        reached = max(self.strips.greatest[b, k % TESTS, i] - part, 0.0)
        return 1.0 if part >= 1.0 else reached / (1.0 - part)

    def others(self, k: int, i: int) -> tuple[float, float, float]:
        ahead = grown = joint = 0.0
        total = self.sums(self.wear)[:, k % TESTS, i]
        for side, b in enumerate(self.bodies[k // TESTS]):
            rest = total[b] - self.wear[side, k, i]
            if rest > 1e-9 * SIZE:
                share = self.share(b, k, i)
                ahead, joint = ahead + share * rest, joint + (1.0 - share) * rest
                added, own = self.strips.added[b, k % TESTS, i], self.wear[:, k, i]
                if own[1 - side] > 0.0:  # both bodies of this contact grow in the ratio of its wear
                    other = self.bodies[k // TESTS][1 - side]
                    by_this = self.strips.added[other, k % TESTS, i] * own[side] / own[1 - side]
                    grown += share * (rest + max(added - by_this, 0.0))
                else:
                    grown += share * rest / total[b] * (added + total[b])
        return ahead, grown, joint

    def part_of(self, k: int, i: int, level: float) -> float:
        if self.part[k, i] == 1.0:
            return 1.0
        beyond = level - self.strips.first[k, i] - self.others(k, i)[1]
        return float(np.clip(0.5 + beyond / self.strips.rise[k, i], 0.0, 1.0))

    def mean_wear(self, k: int, i: int, level: float) -> float:
        """Return the mean over a strip of the wear by the formula, at a depth in contact."""
        ahead = self.others(k, i)[0]
        return self.part_of(k, i, level) * (level - self.of(self.strips.base, k, i) - ahead)


@pytest.fixture
def edges() -> Edges:
    return Edges()


def test_rise_follows_from_the_separation(edges: Edges) -> None:
    strips = edges.strips
    for k, _, i in edges.each():
        part, apart = edges.part[k, i], edges.separation[k, i]
        depth = edges.of(strips.rows, k, i)
        rise = FLAT
        if 0.0 < part < 1.0:  # the parabola of the gap beyond the edge ends at the separation
            rise = 2.0 * apart / (1.0 - part) ** 2
        elif part == 0.0:
            beside = [j for j in (i - 1, i + 1) if 0 <= j < STRIPS]
            gaps = [strips.gap[k, j] + edges.of(strips.rows, k, j) for j in range(STRIPS)]
            elastic = ELASTIC * (edges.approach[k] - min(gaps))
            ahead = max([edges.separation[k, j] for j in beside] + [apart] * (len(beside) < 2))
            rise = ahead - apart
            if rise > 0.0:
                rise *= np.clip((NONE - elastic / rise) / (NONE - FULL), LEAST, 1.0)
            rise = min(rise, 2.0 * apart)
        assert strips.rise[k, i] == pytest.approx(max(rise, FLAT), rel=1e-12)
        expected = depth - 0.5 * strips.rise[k, i] * part**2
        assert strips.first[k, i] == pytest.approx(expected, rel=1e-12)
    for b in range(3):
        touching = [c for c, pair in enumerate(edges.bodies) if b in pair]
        for v in range(2):
            greatest = np.max([edges.part[c * TESTS + v] for c in touching], axis=0)
            np.testing.assert_array_equal(strips.greatest[b, v], greatest)


def test_bodies_of_a_cam_have_no_greatest_part() -> None:
    assert (Edges(STATIONS).strips.greatest == 1.0).all()


def test_wear_by_others_is_divided_at_the_edge(edges: Edges) -> None:
    sums = np.full(edges.shape, np.nan)
    active = np.array([True, False, True])
    sum_of_wear(edges.strips, active, edges.wear, sums)
    np.testing.assert_allclose(sums[:, 0], edges.sums(edges.wear)[:, 0], rtol=1e-14)
    assert np.isnan(sums[:, 1:]).all()  # finished, and without edges
    sum_of_wear(edges.strips, ALL, edges.wear, sums)
    np.testing.assert_allclose(sums[:, :2], edges.sums(edges.wear)[:, :2], rtol=1e-14)
    for k, _, i in edges.each():
        found = by_others(edges.strips, edges.wear, sums, k, i)
        ahead, grown, joint = edges.others(k, i)
        np.testing.assert_allclose(found, (ahead, grown, joint), rtol=1e-10, atol=1e-9 * SIZE)
        for level in (edges.level[k, i], edges.level[k, i] + 0.3 * SIZE):
            part = part_at(edges.strips, k, i, level, found[1])
            assert part == pytest.approx(edges.part_of(k, i, level), abs=1e-9)


def test_linearised_wear_has_value_and_slope_of_the_mean_wear(edges: Edges) -> None:
    gaps, slopes = np.empty(edges.level.shape), np.empty(edges.level.shape)
    linearise_edges(edges.strips, ALL, edges.level, edges.wear, gaps, slopes)
    scaled = np.zeros_like(edges.wear)
    for k, _, i in edges.each():
        if np.isfinite(slopes[k, i]):
            scaled[:, k, i] = (1.0 / slopes[k, i] - 1.0) * edges.wear[:, k, i]
    crossed = 0
    for k, v, i in edges.each():
        level, step = edges.level[k, i], 1e-5 * SIZE
        ahead, _, _ = edges.others(k, i)
        part, mean = edges.part_of(k, i, level), edges.mean_wear(k, i, level)
        opened = sum(
            edges.share(b, k, i) * (edges.sums(scaled)[b, v, i] - scaled[side, k, i])
            for side, b in enumerate(edges.bodies[k // TESTS])
        )
        without = gaps[k, i] - edges.strips.gap[k, i] + opened
        if part == 0.0:
            assert slopes[k, i] == np.inf
            expected = max(level, edges.of(edges.strips.rows, k, i))
        elif part == 1.0:
            assert slopes[k, i] == 1.0
            expected = edges.of(edges.strips.base, k, i)
        elif mean > 0.0:
            ends = [edges.mean_wear(k, i, level + sign * step) for sign in (1.0, -1.0)]
            assert slopes[k, i] == pytest.approx((ends[0] - ends[1]) / (2.0 * step), rel=1e-6)
            # wear = slope * (level - ahead - without) is the mean wear at this depth
            expected = level - ahead - mean / slopes[k, i]
            crossed += 1
        else:
            assert slopes[k, i] == part
            expected = level - ahead - mean / slopes[k, i]
        assert without == pytest.approx(expected, abs=1e-9 * SIZE)
    assert crossed > 3
    for k in (2, 5):
        expected = edges.strips.gap[k] + edges.strips.base[edges.bodies[k // TESTS], 2].sum(axis=0)
        np.testing.assert_allclose(gaps[k], expected, rtol=1e-13)
        assert (slopes[k] == 1.0).all()


@pytest.mark.parametrize("part", [1.0, 0.0])
def test_difference_to_the_formula_is_the_greatest_of_all_strips(edges: Edges, part: float) -> None:
    rng = np.random.default_rng(2)
    edges.loads *= part
    gaps, slopes = np.empty(edges.level.shape), np.empty(edges.level.shape)
    linearise_edges(edges.strips, ALL, edges.level, edges.wear, gaps, slopes)
    linear, apart = SIZE * rng.random((2, CONTACTS, STRIPS))
    level, active = edges.level.copy(), np.array([True, False, True])
    arguments = edges.strips, active, gaps, slopes, linear, apart, edges.loads, edges.wear, level
    rest, expected = compare_edges(*arguments), np.zeros((TESTS, STRIPS))
    for k, v, i in edges.each():
        if not active[v]:
            assert level[k, i] == edges.level[k, i]
            continue
        moved = gaps[k, i] + linear[k, i] - apart[k, i] - edges.strips.gap[k, i]
        _, grown, joint = edges.others(k, i)
        mean, expected_level = edges.mean_wear(k, i, moved), moved
        if edges.loads[k, i] > 0.0 and slopes[k, i] == np.inf:
            halfway = edges.strips.first[k, i] + grown  # the edge in the middle of the strip
            assert edges.part_of(k, i, halfway) == pytest.approx(0.5) or edges.part[k, i] == 1.0
            expected_level = max(moved, halfway)
        assert level[k, i] == pytest.approx(expected_level, rel=1e-14)
        own, rise = edges.wear[:, k, i].sum(), edges.strips.rise[k, i]
        if edges.loads[k, i] == 0.0:
            differs = mean - joint
        else:
            entered = max(own, ENTERED * rise)
            differs = entered if slopes[k, i] == np.inf else abs(mean - own - joint)
        expected[v, i] = max(expected[v, i], differs)
    np.testing.assert_allclose(rest, expected.max(axis=1), rtol=1e-8)
    for i in range(STRIPS):  # each strip by itself
        strip = slice(i, i + 1)
        alone = EdgeStrips(*edges.strips[:2], *(one[..., strip] for one in edges.strips[2:]))
        arrays = (one[..., strip].copy() for one in arguments[2:])
        rest = compare_edges(alone, active, *arrays)
        np.testing.assert_allclose(rest, expected[:, i], rtol=1e-8, atol=1e-9 * SIZE)
    assert (level[[2, 5]] == edges.level[[2, 5]]).all()


@pytest.mark.parametrize("counted", [True, False])
def test_depths_grow_by_the_crossed_parts(edges: Edges, counted: bool) -> None:
    worn = edges.sums(edges.wear)
    depths, parts = np.empty(edges.shape), np.empty(edges.shape)
    fields = np.empty((3, CONTACTS, STRIPS))
    arguments = edges.whole_steps, edges.level, edges.loads, edges.wear, worn
    end_edges(edges.strips, counted, *arguments, depths, parts, fields)
    growth, crossed = edges.strips.rows.copy(), np.zeros(edges.shape, bool)
    greatest = np.zeros(edges.shape)
    for k, v, i in edges.each():
        _, grown, joint = edges.others(k, i)
        loaded, own = edges.loads[k, i] > 0.0, edges.wear[:, k, i].sum()
        part = edges.part_of(k, i, edges.level[k, i]) if loaded else 0.0
        added = 0.0
        if loaded and part == 1.0:
            added = edges.level[k, i] - edges.of(edges.strips.rows, k, i) - grown
        elif loaded:
            added = 0.5 * edges.strips.rise[k, i] * (part**2 - edges.part[k, i] ** 2)
        shared, of_one = edges.bodies[k // TESTS]
        crosses = edges.whole_steps[k, i] < SETTLED
        crossed[shared, v, i] |= crosses
        ratio = max(added, 0.0) / (own + joint) if own > 0.0 else 0.0
        of_shared, of_roller = edges.wear[:, k, i]
        formula = edges.strips.base[of_one, v, i] + of_roller - growth[of_one, v, i]
        by_roller = ratio * of_roller if crosses else formula
        growth[of_one, v, i] += by_roller
        growth[shared, v, i] += by_roller * of_shared / of_roller if of_roller > 0.0 else 0.0
        for b in (shared, of_one):
            greatest[b, v, i] = max(greatest[b, v, i], part)
        assert fields[1, k, i] == pytest.approx(part, abs=1e-9)
        steps = min(edges.whole_steps[k, i] + 1.0, SETTLED)
        assert fields[2, k, i] == (steps if part == 1.0 else 0.0)
    crossed[1:] = True  # the wear of a roller is that by its only contact
    expected = np.where(crossed, growth, edges.strips.base + worn)
    np.testing.assert_allclose(depths[:, :2], expected[:, :2], rtol=1e-9)
    for k, _, i in edges.each():
        part = fields[1, k, i]
        apart = max(edges.of(expected, k, i) - edges.level[k, i], 0.0)
        apart = 0.5 * edges.strips.rise[k, i] * (1.0 - part) ** 2 if part > 0.0 else apart
        assert fields[0, k, i] == pytest.approx(apart, abs=1e-9 * SIZE)
    whole = edges.loads[[2, 5]] > 0.0
    assert np.isnan(fields[0, [2, 5]]).all()
    if counted:
        np.testing.assert_array_equal(fields[1, [2, 5]], whole)
        steps = np.minimum(edges.whole_steps[[2, 5]] + 1.0, SETTLED)
        np.testing.assert_array_equal(fields[2, [2, 5]], np.where(whole, steps, 0.0))
        greatest[0, 2], greatest[1:, 2] = whole.any(axis=0), whole
    else:
        assert np.isnan(fields[1:, [2, 5]]).all()
    np.testing.assert_allclose(parts, greatest, atol=1e-9)


@pytest.mark.parametrize("bodies", [ROLLERS_OF_ONE, STATIONS], ids=["cylinder", "cam"])
@pytest.mark.parametrize("wears", [True, False])
def test_strips_are_young_for_steps_of_twice_the_order(bodies: np.ndarray, wears: bool) -> None:
    edges, orders = Edges(bodies), np.array([1, 2, 1])
    shared = 2 if bodies is STATIONS else 0
    wear = np.where(np.arange(STRIPS) % 3 > 0, np.ones(edges.shape), 0.0)
    wear[shared] *= wears
    young, crossed = np.empty(edges.shape, int), np.empty(edges.shape, bool)
    parts = np.empty(edges.shape)
    steps = edges.whole_steps
    arguments = bodies, edges.resolved, edges.part, steps, orders, wear
    mark_strips(*arguments, young, crossed, parts)

    def youngest(contacts: list[int], v: int, i: int) -> int:
        few = [k for k in contacts if steps[k, i] < YOUNG_STEPS * orders[v]]
        partial = any(steps[k, i] < FIRST_STEPS for k in few)
        return (PARTIAL if partial else WHOLE) if few else OLD

    for b in range(3):
        for v in range(2):
            for i in range(STRIPS):
                contacts = [c * TESTS + v for c in range(len(bodies))]
                loaded = [k for k in contacts if edges.part[k, i] > 0.0]
                meets = [k for k in loaded if b in bodies[k // TESTS]]
                together = b == shared or wear[shared, v, i] > 0.0
                expected = youngest(loaded if together else meets, v, i) if meets else PARTIAL
                assert young[b, v, i] == expected
                assert crossed[b, v, i] == any(steps[k, i] < SETTLED for k in meets)
                greatest = max([edges.part[k, i] for k in meets], default=0.0)
                assert parts[b, v, i] == (greatest if wear[b, v, i] > 0.0 else 0.0)
    assert {OLD, WHOLE, PARTIAL} == set(young[:, :2].ravel().tolist())
    assert (young[:, 2] == OLD).all()
    assert not crossed[:, 2].any()
    assert (parts[:, 2] == 1.0).all()


def test_tests_without_parts_do_not_resolve_edges() -> None:
    part, resolved = np.array([[0.5, np.nan], [np.nan, 1.0]]), np.ones(2, bool)
    fill_resolved(part, part, resolved)
    assert resolved.tolist() == [True, False]
    fill_resolved(np.empty((2, 0)), part, resolved)
    assert resolved.tolist() == [False, False]


def test_separations_of_two_bodies_add_up(edges: Edges) -> None:
    share, parts = np.array([0.25, 1.0, 0.5]), np.full(edges.shape, np.nan)
    fill_separations(edges.bodies, edges.resolved, edges.separation, share, parts)
    by_contact = edges.separation.reshape(ROLLERS, TESTS, STRIPS)
    for v in range(2):
        least = by_contact[:, v].min(axis=0)
        np.testing.assert_allclose(parts[0, v], share[v] * least, rtol=1e-14)
        for c in range(ROLLERS):
            np.testing.assert_allclose(parts[1 + c, v] + parts[0, v], by_contact[c, v], rtol=1e-14)
    assert not parts[:, 2].any()
    cam = np.full(edges.shape, np.nan)
    fill_separations(STATIONS, edges.resolved, edges.separation, share, cam)
    np.testing.assert_array_equal(cam[:2, :2], by_contact[:, :2])
    assert not cam[2].any()


@pytest.mark.parametrize("bodies", [ROLLERS_OF_ONE, STATIONS])
@pytest.mark.parametrize("size", [0.01, 0.3, 3.0])
def test_strips_start_with_the_shape_of_their_separation(bodies: np.ndarray, size: float) -> None:
    edges = Edges(bodies)
    strips, part, apart = edges.strips, edges.part, edges.separation
    depth = np.array(
        [[edges.of(strips.rows, k, i) for i in range(STRIPS)] for k in range(CONTACTS)]
    )
    approach = (strips.gap + depth).min(axis=1) + size * SIZE
    start_edges(strips, apart, approach)
    greatest = np.full(edges.shape, float(bodies[-1, 0] > 0))
    for k, v, i in edges.each():
        if 0.0 < part[k, i] < 1.0:
            rise = 2.0 * apart[k, i] / (1.0 - part[k, i]) ** 2
        elif part[k, i] == 0.0:
            # towards the greater neighbour, less where the bodies are far from rigid
            rise = max(apart[k, max(i - 1, 0)], apart[k, min(i + 1, STRIPS - 1)]) - apart[k, i]
            if rise > 0.0:
                kept = (NONE - ELASTIC * size * SIZE / rise) / (NONE - FULL)
                rise *= min(max(kept, LEAST), 1.0)
            rise = min(rise, 2.0 * apart[k, i])
        else:
            rise = 0.0
        rise = max(rise, FLAT)
        assert strips.rise[k, i] == pytest.approx(rise, rel=1e-9)
        known = depth[k, i] - 0.5 * rise * part[k, i] ** 2
        assert strips.first[k, i] == pytest.approx(known, rel=1e-9, abs=1e-18)
        for b in bodies[k // TESTS]:
            greatest[b, v, i] = max(greatest[b, v, i], part[k, i])
    assert strips.greatest[:, edges.resolved] == pytest.approx(greatest[:, edges.resolved])

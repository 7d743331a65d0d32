"""Kernels of an implicit step, interpreted, against plain formulas for each test.

A cylinder and two rollers, or two stations of a cam and a roller, wear in three tests, of which the
last one does not resolve edges; or strips in contact as wholes are counted, or edges are not
followed.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from wearsim.mechanics.numerics.edge_strips import (
    OF_EDGES,
    SETTLED,
    compare_edges,
    edge_strips,
    end_edges,
    fill_resolved,
    fill_separations,
    linearise_edges,
    own_side,
    start_edges,
)
from wearsim.mechanics.numerics.implicit_step import (
    WHOLE_PASSES,
    begin_step,
    compare_step,
    end_step,
    linearise_step,
)
from wearsim.mechanics.numerics.linearised_wear import linearised_wear, wear_of_bodies
from wearsim.mechanics.numerics.multistep import ROWS, formulas, new_differences
from wearsim.mechanics.numerics.young_strips import AT_START, OLD, WHOLE, mark_strips

TESTS, STRIPS, SIZE = 3, 5, 1e-6
ROLLERS, STATIONS = np.array([[0, 1], [0, 2]]), np.array([[0, 2], [1, 2]])
SHAPE, CONTACTS = (3, TESTS, STRIPS), len(ROLLERS) * TESTS
ALL = np.ones(TESTS, np.bool_)


class Step:
    """Random arrays of a step, with edges that are "resolved", of a "cam", "counted" or "none"."""

    def __init__(self, edges: str) -> None:
        rng = np.random.default_rng(6)
        self.edges, contacts = edges, (CONTACTS, STRIPS)
        self.bodies = STATIONS if edges == "cam" else ROLLERS
        self.orders, self.passes = np.array([2, 3, 2]), WHOLE_PASSES * np.array([3.0, 0.4, 1.0])
        self.spans = np.cumsum(WHOLE_PASSES * (2.0 + rng.random((ROWS - 1, TESTS))), axis=0)
        self.exposure, self.mean_exposure = 1.0 + rng.random((2, TESTS))
        self.past_wear = SIZE * rng.standard_normal((ROWS, *SHAPE))
        self.past_wear[0] = np.abs(self.past_wear[0])
        self.past_wear[0, 2, 0] = 0.0  # a roller that does not wear in one test
        self.past_sums = SIZE * rng.standard_normal((ROWS, 4, TESTS, 1))
        self.past_feedback = rng.standard_normal((ROWS, 2, TESTS, 1))
        self.depths, self.gap = SIZE * rng.random(SHAPE), SIZE * rng.random(contacts)
        self.approach, self.share = SIZE * (2.0 + rng.random(CONTACTS)), rng.random(TESTS)
        self.wear = SIZE * rng.random((2, *contacts))
        self.part = np.where(rng.random(contacts) < 0.5, rng.random(contacts), 1.0)
        self.part[:, 0] = 0.0
        self.part[2::TESTS] = np.nan
        self.separation = SIZE * rng.random(contacts) * (self.part < 1.0)
        self.whole_steps = np.floor((SETTLED + 3.0) * rng.random(contacts))
        self.in_groove = np.zeros(TESTS, bool)
        if edges == "counted":  # in one test only
            self.part = np.where(rng.random(contacts) < 0.6, 1.0, 0.0)
            self.in_groove[1] = True
        if edges in {"counted", "none"}:
            self.separation = self.separation[:, :0]
        if edges == "none":
            self.part, self.whole_steps = self.part[:, :0], self.whole_steps[:, :0]
        self.resolved = np.zeros(TESTS, bool)
        self.of_tests, self.of_bodies = np.full((7, TESTS), np.nan), np.full((6, *SHAPE), np.nan)
        self.of_contacts = np.full((3, *contacts), np.nan)
        self.sums, self.feedback = np.full((4, TESTS, 1), np.nan), np.full((2, TESTS, 1), np.nan)
        self.loads = np.where(rng.random(contacts) < 0.8, 1.0 + rng.random(contacts), 0.0)
        self.exponents = 0.4 + rng.random(contacts)
        self.about = np.full((5, *contacts), np.nan)
        self.compliance = np.full((TESTS, len(ROLLERS), 2, STRIPS), np.nan)

    def begin(self) -> None:
        begin_step(
            self.spans, self.orders, self.passes, self.exposure, self.mean_exposure,
            self.past_wear, self.past_sums, self.past_feedback, self.depths, self.bodies, self.gap,
            self.approach, self.wear, self.share, self.separation, self.part, self.whole_steps,
            self.in_groove, self.resolved, self.of_tests, self.sums, self.feedback,
            self.of_bodies, self.of_contacts,
        )  # fmt: skip

    @property
    def strips(self) -> tuple[Any, ...]:
        """Arguments of all later kernels."""
        known = self.gap, self.depths, self.part, self.of_bodies, self.of_contacts
        return self.bodies, self.resolved, *known

    def copied(self) -> Any:
        """Return `EdgeStrips` that share no array."""
        return edge_strips(*(one.copy() for one in self.strips))

    def by_contact(self, values: np.ndarray) -> np.ndarray:
        """Return values of the two bodies of each contact, (2, contacts, strips)."""
        return np.stack(
            [values[self.bodies[:, side]].reshape(CONTACTS, STRIPS) for side in range(2)]
        )

    def of_own(self, values: np.ndarray) -> np.ndarray:
        """Return values of the body that each contact shares with no other one."""
        own = self.bodies[:, own_side(self.bodies)]
        return np.asarray(values[own].reshape(CONTACTS, STRIPS))


@pytest.fixture(params=["resolved", "cam", "counted", "none"])
def step(request: pytest.FixtureRequest) -> Step:
    return Step(request.param)


def test_step_begins_with_its_formula(step: Step) -> None:
    wear = step.wear.copy()
    step.begin()
    lengths = step.mean_exposure * step.passes
    half = np.where(step.passes > WHOLE_PASSES, 0.5, 0.0)
    weights, factor = np.empty((2, ROWS, TESTS)), np.empty(TESTS)
    distances = np.empty((ROWS - 1, TESTS))
    formulas(step.spans, lengths, step.orders, half, weights, factor, distances)
    worn_passes = factor / step.exposure - half
    np.testing.assert_allclose(step.of_tests, [worn_passes, half, *distances], rtol=1e-13)
    resolved = np.ones(TESTS, bool)
    fill_resolved(step.separation, step.part, resolved)
    followed = step.edges in {"resolved", "cam"}
    assert step.resolved.tolist() == resolved.tolist() == [followed, followed, False]
    young, crossed, parts = np.empty(SHAPE, int), np.empty(SHAPE, bool), np.empty(SHAPE)
    state = step.part, step.whole_steps, step.orders, step.past_wear[0]
    mark_strips(step.bodies, resolved | step.in_groove, *state, young, crossed, parts)
    assert (young != OLD).any() == (step.edges != "none")
    length = lengths / step.exposure
    weighted = (young == WHOLE) & resolved[:, None]
    before = np.where(weighted, AT_START * length[:, None], 0.0)
    before = np.maximum(before, half[:, None])
    scale = np.where(young != OLD, (length[:, None] - before) / worn_passes[:, None], 1.0)
    apart = np.empty(SHAPE)
    fill_separations(step.bodies, resolved, step.separation, step.share, apart)
    added, guess = np.einsum("wkv,krvi->wrvi", weights, step.past_wear)
    added = np.where(young != OLD, before * step.past_wear[0], added)
    level = step.depths - apart
    expected = [scale, level, added, level + added, level + guess]
    np.testing.assert_allclose(step.of_bodies[:5], expected, rtol=1e-12, atol=1e-20)
    sums = np.einsum("kv,krvi->rvi", weights[0], step.past_sums)
    np.testing.assert_allclose(step.sums, sums, rtol=1e-12)
    feedback = np.einsum("kv,krvi->rvi", weights[1], step.past_feedback)
    feedback += (1.0 - half)[:, None] * step.past_feedback[0]
    np.testing.assert_allclose(step.feedback, feedback, rtol=1e-12)
    both = step.by_contact(level + guess).sum(axis=0)
    np.testing.assert_allclose(step.of_contacts[2], both, rtol=1e-12)
    passes = step.of_own(scale * worn_passes[:, None])
    np.testing.assert_allclose(step.wear, wear * passes, rtol=1e-12)
    strips = step.copied()
    strips.first[:], strips.rise[:], strips.greatest[:] = np.nan, np.nan, np.nan
    start_edges(strips, step.separation, step.approach)
    np.testing.assert_array_equal(step.of_contacts[:2], [strips.first, strips.rise])
    np.testing.assert_array_equal(step.of_bodies[5], strips.greatest)


def linearised(step: Step) -> None:
    """Begin a step, and linearise its wear."""
    step.begin()
    of_wear = step.loads, step.wear, step.exponents
    linearise_step(*step.strips, *of_wear, ALL, step.about, step.compliance)


def test_wear_is_linearised_about_the_depth_of_each_strip(step: Step) -> None:
    linearised(step)
    gaps, slopes = np.empty((2, CONTACTS, STRIPS))
    linearise_edges(step.copied(), ALL, step.of_contacts[2], step.wear, gaps, slopes)
    np.testing.assert_array_equal(step.about[:2], [gaps, slopes])
    compliance, opened = np.empty_like(step.compliance), np.empty_like(gaps)
    constant, of_wear = np.empty_like(step.wear), (step.loads, step.wear, step.exponents)
    linearised_wear(*of_wear, slopes, step.bodies, gaps, ALL, compliance, opened, constant)
    np.testing.assert_array_equal(step.compliance, compliance)
    np.testing.assert_array_equal(step.about[2:], [opened, *constant])


def test_solution_is_compared_with_the_linearised_wear_and_the_edges(step: Step) -> None:
    linearised(step)
    rng, active = np.random.default_rng(7), np.array([True, False, True])
    loads, apart = step.loads * (0.8 + 0.4 * rng.random((CONTACTS, STRIPS))), SIZE * rng.random()
    wear, worn = SIZE * rng.random(step.wear.shape) * (loads > 0.0), np.full(SHAPE, 7.0)
    apart = np.full((CONTACTS, STRIPS), -200.0 * apart)  # far from the formula
    passes = step.of_own(step.of_bodies[0] * step.of_tests[0][:, None])
    by_formula, exponents, known = wear * passes, step.exponents.copy(), worn.copy()
    linear, strips, level = np.empty_like(loads), step.copied(), step.of_contacts[2].copy()
    of_bodies = wear_of_bodies(
        *(loads, step.loads, by_formula, step.wear, step.compliance, step.about[3:], step.bodies),
        *(step.of_bodies[3], 1.0, step.about[1], active, exponents, known, linear),
    )
    gaps, slopes = step.about[:2]
    of_edges = compare_edges(strips, active, gaps, slopes, linear, apart, loads, by_formula, level)
    found = np.empty((3, TESTS))
    compare_step(
        *(*step.strips, step.loads, step.wear, step.exponents, step.about, step.compliance),
        *(loads, apart, wear, step.of_tests[0], 1.0, active, worn, found),
    )
    np.testing.assert_allclose(wear, by_formula, rtol=1e-13)
    np.testing.assert_allclose(worn, known, rtol=1e-12)
    np.testing.assert_allclose(step.exponents, exponents, rtol=1e-12)
    np.testing.assert_allclose(step.of_contacts[2], level, rtol=1e-12)
    np.testing.assert_allclose(found[1:], of_bodies[1:], rtol=1e-12)
    greatest = np.maximum(of_bodies[0], of_edges / OF_EDGES)
    np.testing.assert_allclose(found[0], greatest, rtol=1e-9)
    if step.resolved.any():
        assert (of_edges[:2] / OF_EDGES > of_bodies[0, :2]).any()


@pytest.mark.parametrize("broken", ["", "depth", "energy"])
def test_step_ends_with_the_sums_of_its_formula(step: Step, broken: str) -> None:
    linearised(step)
    rng, worn = np.random.default_rng(8), np.zeros(SHAPE)
    step.sums[:] = 5.0 * SIZE * (1.0 + rng.random(step.sums.shape))
    step.past_feedback[0] = 1.0
    counted = step.edges == "counted"
    if broken == "depth":
        step.of_bodies[3, 0, :, 1] -= 9.0 * SIZE
        step.of_bodies[2, 0, :, 1] -= 9.0 * SIZE
        step.sums[:3] = 0.0
    for c, pair in enumerate(step.bodies):
        for side, b in enumerate(pair):
            worn[b] += step.wear[side].reshape(-1, TESTS, STRIPS)[c]
    power, weights = SIZE * np.array([1.0, 2.0, 3.0]), np.array([0.4, 0.2])
    if broken == "energy":
        step.sums[3, 1] = -9.0 * SIZE * (1.0 + step.of_tests[0, 1])
    worn_passes, half, *distances = step.of_tests.copy()
    sums, energy = step.sums.copy(), np.empty(TESTS)
    powers = np.array([power, 3.0 * power])  # of two contacts of each test
    per_pass = weights @ powers
    feedback, fields = rng.random((2, TESTS, 1)), np.full((3, CONTACTS, STRIPS), np.nan)
    if step.edges == "none":
        fields = np.empty((0, 0, 0))
    ends, parts = np.empty(SHAPE), np.empty(SHAPE)
    known = step.of_contacts[2], step.loads, step.wear, worn
    end_edges(step.copied(), counted, step.whole_steps, *known, ends, parts, fields.copy())
    found = np.full(SHAPE, np.nan)
    new = [np.empty_like(one) for one in (step.past_wear, step.past_sums, step.past_feedback)]
    decreased = np.zeros(TESTS, bool)
    end_step(
        *(*step.strips, step.separation, step.whole_steps, step.share, step.loads, step.wear),
        *(worn, step.of_tests, step.sums, feedback, powers.ravel(), weights, step.past_wear),
        *(step.past_sums, step.past_feedback, energy, found, fields, *new, decreased),
    )
    rates, by_contact = np.zeros(SHAPE), step.wear / step.of_own(step.of_bodies[0])
    for c, pair in enumerate(step.bodies):
        for side, b in enumerate(pair):
            rates[b] += by_contact[side].reshape(-1, TESTS, STRIPS)[c] / worn_passes[:, None]
    sum_rates = np.concatenate([rates.sum(axis=2), per_pass[None]])[..., None]
    sums += worn_passes[:, None] * sum_rates
    np.testing.assert_allclose(step.sums, sums, rtol=1e-12)
    np.testing.assert_allclose(energy, sums[3, :, 0], rtol=1e-12)
    missing = sums[:3] - (ends - step.depths).sum(axis=2, keepdims=True)
    width = parts.sum(axis=2, keepdims=True)
    spread = np.where(width > 0.0, missing / np.where(width > 0.0, width, 1.0), 0.0) * parts
    follows = (step.resolved | counted)[:, None]
    expected = ends + np.where(follows, spread, 0.0)
    np.testing.assert_allclose(found, expected, rtol=1e-12)
    apart = np.zeros(SHAPE)
    if step.resolved.any():
        fill_separations(step.bodies, step.resolved, fields[0], step.share, apart)
    change = expected - apart - step.of_bodies[1]
    change = np.where(follows, change, step.of_bodies[2] + worn)
    of_steps = np.array(distances)
    for first, moved, part, past, made in (
        (rates, change, half, step.past_wear, new[0]),
        (sum_rates, sums, half, step.past_sums, new[1]),
        (feedback, feedback - 1.0, np.zeros(TESTS), step.past_feedback, new[2]),
    ):
        reference = np.empty_like(made)
        new_differences(first, moved, part, past, of_steps, reference)
        np.testing.assert_allclose(made, reference, rtol=1e-9, atol=1e-12 * SIZE)
    less = (expected < step.depths).any(axis=(0, 2)) | (energy < 0.0)
    assert decreased.tolist() == less.tolist()
    if broken == "energy":
        assert energy[1] < 0.0

"""Damage that a step adds, interpreted, against quadrature of the damage per pass."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad

from wearsim.mechanics.fatigue import damage_of_step, greatest_von_mises

START, LENGTH, CONSTANT, BEFORE = 1000.0, 4000.0, 300.0, 200.0
NONE = np.empty((0, 2))


def step(rate, removed=NONE, slope: float = 2.0, before: float = BEFORE, old=None):
    """Return damage and sums of two strips, of which the second one is never in contact."""
    known = np.zeros((4, 1, 2)) if old is None else old
    known[3, 0, 0] = rate(before) if np.isfinite(before) else 0.0
    rates = np.array([[rate(passes), 0.0] for passes in (START, START + LENGTH)])
    points = np.array([[before], [CONSTANT]])
    times = np.array([START]), np.array([LENGTH])
    return damage_of_step(known, rates[:1], rates[1:], removed, *times, points, slope)


def added(rate) -> float:
    return quad(rate, START, START + LENGTH, epsabs=0.0, epsrel=1e-12)[0]


@pytest.mark.parametrize("power", [-1.0, -0.5, 0.7])
@pytest.mark.parametrize("before", [BEFORE, np.nan])
def test_powers_of_the_passes_are_integrated(power: float, before: float) -> None:
    def rate(passes: float) -> float:
        return float(1e-6 * ((passes + CONSTANT) / 1000.0) ** power)

    damage, sums = step(rate, before=before)
    assert damage[0, 0, 0] == pytest.approx(added(rate), rel=3e-3)
    assert damage[2:, 0, 0].tolist() == [rate(START + LENGTH), rate(START)]
    assert not damage[:, 0, 1].any()
    assert sums[:, 0].tolist() == pytest.approx(
        [0.0, damage[0, 0, 0] ** 2, (damage[0, 0, 0] + damage[1, 0, 0]) ** 2], rel=1e-12
    )
    if np.isfinite(before):  # the parabola agrees with the line
        assert damage[1, 0, 0] < 1e-9 * damage[0, 0, 0]
    else:
        line = 0.5 * LENGTH * (rate(START) + rate(START + LENGTH))
        assert damage[1, 0, 0] == pytest.approx(abs(line - damage[0, 0, 0]), rel=1e-9)


def test_bent_powers_are_integrated_within_their_error() -> None:
    def rate(passes: float) -> float:
        logarithm = np.log((passes + CONSTANT) / 1000.0)
        return float(1e-6 * np.exp(0.5 * logarithm - 0.3 * logarithm**2))

    damage, _ = step(rate)
    assert damage[0, 0, 0] == pytest.approx(added(rate), rel=1e-3)
    span = np.log((START + LENGTH + CONSTANT) / (START + CONSTANT))
    expected = 0.3 * span**2 / 12.0 * damage[0, 0, 0]
    assert damage[1, 0, 0] == pytest.approx(expected, rel=1e-9, abs=0.0)


def plain(old, first, last, removed, start, length, past, constant, slope):
    """Return damage, its error and sums of one body, strip by strip."""

    def place(passes):
        rise = np.log((start + length + constant) / (start + constant))
        return np.log((passes + constant) / (start + constant)) / rise

    nodes, weights = np.polynomial.legendre.leggauss(3)
    at, rows = place(start + 0.5 * length * (1.0 + nodes)), []
    for before, one, other, kept, error, part in zip(
        old[3], first, last, *old[:2], removed, strict=True
    ):
        mean, doubt = 0.5 * (one + other), 0.5 * abs(other - one)
        if one > 0.0 < other:
            bend, curved, ends = 0.0, past < start and before > 0.0, mean
            if curved:
                logarithms = np.log([before, one, other])
                bend = np.clip(np.polyfit([place(past), 0.0, 1.0], logarithms, 2)[0], -2.0, 2.0)
            curve = one * np.exp(at * np.log(other / one) + bend * at * (at - 1.0))
            mean = 0.5 * weights @ curve
            doubt = abs(bend) * mean / 12.0 if curved else abs(mean - ends)
        uneven = abs(other - one) / (other + one) if mean > 0.0 else 0.0
        added = length * mean * (-np.expm1(-part) / part if part else 1.0)
        doubt = length * (doubt + mean * min(part, 1.0) * uneven / 6.0)
        rows.append((kept, kept * np.exp(-part) + added, doubt, error + doubt))
    kept, damage, doubt, error = np.array(rows).T
    total = [np.max, lambda values: (values[values > 0.0] ** slope).sum()][slope > 0.0]
    return damage, error, [total(values) for values in (kept, damage, damage + doubt)]


@pytest.mark.parametrize("slope", [0.0, 0.3, 2.0])
@pytest.mark.parametrize("wears", [False, True])
def test_every_strip_of_every_body_is_integrated_by_plain_formulas(slope, wears) -> None:
    generator = np.random.default_rng(7)
    rates = 1e-6 * generator.uniform(0.5, 2.0, (2, 4, 8))
    old = generator.uniform(0.01, 0.03, (4, 4, 8))
    old[3] = 1e-6 * generator.uniform(0.5, 2.0, (4, 8))
    # contacts that begin, end, are absent or began after the point before; strongly bent ones
    rates[0, :, [0, 2]] = rates[1, :, [1, 2]] = old[3, :, 3] = 0.0
    old[:2, :, 2] = [[0.0] * 4, [0.01] * 4]
    old[3, :, 4:6] = 1e-10, 1e-3
    removed = generator.uniform(0.1, 2.0, (4, 8)) if wears else np.empty((0, 8))
    start, lengths = np.array([1000.0, 300.0]), np.array([4000.0, 0.7])
    points = np.array([[200.0, np.nan], [300.0, 20.0]])
    damage, sums = damage_of_step(old, *rates, removed, start, lengths, points, slope)
    for b in range(4):
        v, none = b % 2, np.zeros(8)
        own = old[:, b], *rates[:, b], removed[b] if wears else none
        known = plain(*own, start[v], lengths[v], *points[:, v], slope)
        assert damage[0, b] == pytest.approx(known[0], rel=1e-10, abs=0.0)
        assert damage[1, b] == pytest.approx(known[1], rel=1e-10, abs=0.0)
        assert damage[2:, b].tolist() == rates[::-1, b].tolist()
        assert sums[:, b] == pytest.approx(known[2], rel=1e-10, abs=0.0)


def test_contact_that_begins_has_the_mean_damage() -> None:
    damage, _ = step(lambda passes: 0.0 if passes < 2000.0 else 3e-7)
    assert damage[0, 0, 0] == pytest.approx(0.5 * 3e-7 * LENGTH, rel=1e-12, abs=0.0)
    assert damage[1, 0, 0] == pytest.approx(0.5 * 3e-7 * LENGTH, rel=1e-12, abs=0.0)


@pytest.mark.parametrize("part", [0.0, 1e-7, 0.4, 3.0])
def test_wear_removes_damage_evenly(part: float) -> None:
    old = np.array([0.3, 0.02, 0.0, 0.0])[:, None, None] * np.array([1.0, 0.0])
    damage, sums = step(lambda _: 2e-5, np.array([[part, part]]), old=old)
    share = quad(lambda time: np.exp(-part * (1.0 - time)), 0.0, 1.0)[0]
    kept = 0.3 * np.exp(-part)
    assert damage[0, 0, 0] == pytest.approx(kept + share * 2e-5 * LENGTH, rel=1e-10)
    assert damage[1, 0, 0] == pytest.approx(0.02, abs=1e-12)
    assert sums[0, 0] == pytest.approx(0.3**2, rel=1e-12)
    uneven = step(lambda passes: passes * 1e-8, np.array([[part, part]]))[0]
    even = step(lambda passes: passes * 1e-8)[0]
    first, last = START * 1e-8, (START + LENGTH) * 1e-8
    more = even[0, 0, 0] * min(part, 1.0) * (last - first) / (last + first) / 6.0
    assert uneven[1, 0, 0] - even[1, 0, 0] == pytest.approx(more, rel=1e-9, abs=1e-15)


def test_greatest_damage_replaces_the_sum() -> None:
    old = np.zeros((4, 1, 2))
    old[0, 0] = 0.1, 0.4
    damage, sums = step(lambda _: 1e-4, slope=0.0, old=old)
    assert damage[0, 0].tolist() == pytest.approx([0.5, 0.4])
    assert sums[:, 0].tolist() == pytest.approx([0.4, 0.5, 0.5 + damage[1, 0, 0]])


def test_step_without_passes_adds_nothing() -> None:
    rates, none = np.full((2, 1), 1e-6), np.zeros(2)
    old, points = np.zeros((4, 2, 1)), np.array([[np.nan, np.nan], [1.0, 1.0]])
    damage, sums = damage_of_step(old, rates, rates, NONE, none, none, points, 1.0)
    assert not damage[:2].any()
    assert not sums.any()


@pytest.mark.parametrize(("ratio", "stress"), [(0.3, 0.557), (0.0, 1.0)])
def test_greatest_stress_of_von_mises_is_that_of_the_textbook(ratio: float, stress: float) -> None:
    found, depth = greatest_von_mises(ratio)
    # Johnson, Contact Mechanics, section 4.2: 0.558 p0 at 0.70 a for a Poisson ratio of 0.3
    assert found == pytest.approx(stress, abs=2e-3)
    z = depth
    root = np.sqrt(1.0 + z * z)
    x, n = -((1.0 + 2.0 * z * z) / root - 2.0 * z), -1.0 / root
    across = ratio * (x + n)
    mises = np.sqrt(x * x + n * n + across * across - x * n - n * across - across * x)
    assert found == pytest.approx(mises, rel=1e-12)
    assert depth == pytest.approx(0.70 if ratio else 0.0, abs=0.01)


def test_row_of_a_realisation_has_its_own_passes() -> None:
    rates, old = np.full((4, 1), 1e-6), np.zeros((4, 4, 1))
    old[0, :, 0] = 0.1, 0.2, 0.3, 0.4
    start, lengths = np.array([0.0, 50.0]), np.array([100.0, 0.0])
    points = np.array([[np.nan, np.nan], [1.0, 1.0]])
    damage, sums = damage_of_step(old, rates, rates, NONE, start, lengths, points, 1.0)
    assert damage[0, :, 0] == pytest.approx([0.1001, 0.2, 0.3001, 0.4])
    assert sums[0] == pytest.approx([0.1, 0.2, 0.3, 0.4])
    assert sums[1] == pytest.approx(damage[0, :, 0])
    assert sums[2] == pytest.approx(damage[:2, :, 0].sum(axis=0))


@pytest.mark.parametrize("passes", [0.4, 1.0, 3.0])
def test_few_passes_add_their_damage(passes: float) -> None:
    old, start, length = np.zeros((4, 1, 1)), np.array([2.0]), np.array([passes])
    first, last = np.full((1, 1), 1e-6), np.full((1, 1), 3e-6)
    damage, _ = damage_of_step(
        old, first, last, np.empty((0, 1)), start, length, np.array([[np.nan], [1.0]]), 1.0
    )

    def rate(done: float) -> float:  # a power of the passes and the constant
        power = np.log(3.0) / np.log((3.0 + passes) / 3.0)
        return float(1e-6 * ((done + 1.0) / 3.0) ** power)

    known = quad(rate, 2.0, 2.0 + passes)[0]
    assert damage[0, 0, 0] == pytest.approx(known, rel=2e-3)

"""Returns from the field: brute force on a grid, remaining lives, goodness of fit, coverage."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.special import ndtr, ndtri

from wearsim.uq.distributions.two_levels import TwoLevels
from wearsim.uq.survival.distributions import FactorMixture
from wearsim.uq.survival.fleet import check_fleet, remaining_lives
from wearsim.uq.survival.returns import FieldPosterior, Fleet, update
from wearsim.uq.survival.scores import score_function
from wearsim.uq.survival.two_levels import UncertainLives

CENTRE, WIDTH, PRIOR = -25.2, 0.15, 0.3  # of m, and of t
T, MEANS = np.linspace(0.03, 1.2, 40), np.linspace(CENTRE - 0.75, CENTRE + 0.75, 41)
M = np.broadcast_to(MEANS, (len(T), len(MEANS)))
LEVELS = TwoLevels.on_grid(
    T, M, np.exp(-0.5 * ((M - CENTRE) / WIDTH) ** 2 - 0.5 * (T[:, None] / PRIOR) ** 2), 8
)
SCALE, INPUTS, SPREAD = -11.0, 0.3, np.log(1.3)
SCORE = score_function(LEVELS)


def design(count: int, seed: int) -> FactorMixture:
    """Return realisations of a design."""
    rng = np.random.default_rng(seed)
    return FactorMixture(np.exp(SCALE + INPUTS * rng.standard_normal(count)), SCORE)


def fleet_of(rng: np.random.Generator, m: float, t: float, factor: float, units: int) -> Fleet:
    """Return units of a design with infinitely many realisations, every fifth with inspections."""
    log = SCALE - m + np.log(factor) + np.hypot(t, INPUTS) * rng.standard_normal(units)
    life, age = np.exp(log), np.exp(SCALE - CENTRE) * rng.uniform(0.2, 1.2, units)
    failed, inspected = life < age, np.arange(units) % 5 == 0
    low = np.where(failed, np.where(inspected, 0.9 * life, life), age)
    high = np.where(failed, np.where(inspected, 1.1 * life, life), np.inf)
    return Fleet(low, high, np.zeros(units, dtype=np.int64))


KAPPA = design(25, 1)
FLEET = fleet_of(np.random.default_rng(5), -25.1, 0.35, 1.2, 40)


@cache
def posterior() -> FieldPosterior:
    return update([replace(KAPPA, exact=True)], LEVELS, FLEET, SPREAD)


def likelihood(m: float, t: float) -> float:
    """Return the logarithm of the product over the units, as written in the text."""
    z, end = (
        (np.log(np.where(np.isfinite(life), life, 1.0))[:, None] + m - np.log(KAPPA.kappa)) / t
        for life in (FLEET.low, FLEET.high)
    )
    density = (np.exp(-0.5 * z * z) / np.sqrt(2.0 * np.pi) / t).mean(axis=1)
    between = (ndtr(end) - ndtr(z)).mean(axis=1)
    known = FLEET.failed & (FLEET.low == FLEET.high)
    each = np.where(known, density, np.where(FLEET.failed, between, ndtr(-z).mean(axis=1)))
    return float(np.log(np.maximum(each, 1e-300)).sum())


@cache
def brute_force() -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return m - ln L, t, ln L given m - ln L, and the posterior on a grid of both."""
    factors = SPREAD * np.linspace(-4.5, 4.5, 91)
    m, t = np.linspace(-26.0, -24.4, 61), np.linspace(0.03, 1.2, 60)
    each = np.exp(
        -0.5 * (factors / SPREAD) ** 2 - 0.5 * ((m[:, None] + factors - CENTRE) / WIDTH) ** 2
    )
    log = np.array([[likelihood(x, y) for x in m] for y in t])
    joint = np.exp(log - log.max() - 0.5 * (t[:, None] / PRIOR) ** 2) * each.sum(axis=1)
    return m, t, each @ factors / each.sum(axis=1), joint / joint.sum()


def test_posterior_is_that_of_brute_force():
    m, t, factor, joint = brute_force()
    after = posterior().after
    for values, exact in ((after.m, joint @ m), (after.t, joint.T @ t)):
        mean, middle = after.weight @ values, exact.sum()
        grid = m if values is after.m else t
        weight = joint.sum(axis=0) if values is after.m else joint.sum(axis=1)
        std = np.sqrt(weight @ (grid - middle) ** 2)
        assert mean == pytest.approx(middle, abs=0.03 * std)
        assert np.sqrt(after.weight @ (values - mean) ** 2) == pytest.approx(std, rel=0.03)
    found = posterior().log_factor @ posterior().factor_weight
    assert found == pytest.approx((joint @ factor).sum(), abs=0.005)


def test_lives_before_and_after_are_those_of_brute_force():
    m, t, _, joint = brute_force()
    after = posterior().lives_after(KAPPA).quantile(0.1)

    def failed(life: float) -> float:
        z = (np.log(life) + m[None, :, None] - np.log(KAPPA.kappa)) / t[:, None, None]
        return float((joint * ndtr(z).mean(axis=2)).sum())

    assert failed(after.predictive) == pytest.approx(0.1, abs=5e-4)
    before = posterior().lives_before(KAPPA).quantile(0.1)
    assert before.low < after.low < after.predictive < after.high < before.high
    # the prior of m - ln L is wider by that of the life factor
    std = np.sqrt(posterior().before.weight @ (posterior().before.m - CENTRE) ** 2)
    assert std == pytest.approx(np.hypot(WIDTH, SPREAD), rel=0.01)


def test_remaining_lives_are_ratios_of_survivals():
    m, t, _, joint = brute_force()
    ages, target = np.array([2e5, 9e5]), 1.2e6
    found = remaining_lives(KAPPA, posterior().after, ages, (0.1, 0.5), target)

    def left(life: float) -> np.ndarray:
        z = (np.log(life) + m[None, :, None] - np.log(KAPPA.kappa)) / t[:, None, None]
        return ndtr(-z).mean(axis=2)

    for age, one in zip(ages, found, strict=True):
        for share, life in zip((0.1, 0.5), one.lives, strict=True):
            ratio = (joint * left(age + life.value) / left(age)).sum()
            assert ratio == pytest.approx(1.0 - share, abs=3e-3)
            assert life.low < life.value < life.high
        assert one.survival is not None
        reached = (joint * left(target) / left(age)).sum()
        assert one.survival.value == pytest.approx(reached, abs=3e-3)


def test_life_factor_of_one_leaves_the_posterior_of_the_tests():
    none = Fleet(np.array([1.0]), np.array([np.inf]), np.zeros(1, dtype=np.int64))
    after = update([replace(KAPPA, exact=True)], LEVELS, none, 0.0).after
    assert after.weight @ after.m == pytest.approx(CENTRE, abs=2e-3)
    assert after.weight @ after.t == pytest.approx(LEVELS.weight @ LEVELS.t, abs=2e-3)


def test_two_designs_share_the_wear_factor():
    longer = FactorMixture(1.5 * KAPPA.kappa, SCORE)
    both = np.array([0, 1] * 20)
    factor = np.where(both == 1, 1.5, 1.0)
    fleet = Fleet(factor * FLEET.low, factor * FLEET.high, both)
    found = update(
        [replace(item, exact=True) for item in (KAPPA, longer)], LEVELS, fleet, SPREAD
    ).after
    one = posterior().after
    assert found.weight @ found.m == pytest.approx(one.weight @ one.m, abs=1e-6)


def test_realisations_may_fail_at_once_or_never():
    mixed = FactorMixture(np.array([0.0, np.inf, *KAPPA.kappa]), SCORE)
    found = update([mixed], LEVELS, FLEET, SPREAD).after
    assert found.weight @ found.m == pytest.approx(CENTRE, abs=0.3)
    assert np.isfinite(check_fleet([mixed], found, found, FLEET).fit)


def test_fit_finds_another_distribution():
    before, after = posterior().before, posterior().after
    good = check_fleet([KAPPA], before, after, FLEET)
    assert good.fit > 0.05
    assert good.surprise > 0.05
    assert good.observed[-1] == FLEET.failed.sum()
    assert good.after.mean[-1] == pytest.approx(good.observed[-1], rel=0.15)
    # half of the units fail at once, the others last
    life = np.where(np.arange(60) % 2 == 0, 2e4, 1.5e6)
    high = np.where(life < 1e5, life, np.inf)
    odd = Fleet(life, high, np.zeros(60, dtype=np.int64))
    spoilt = update([KAPPA], LEVELS, odd, SPREAD)
    assert check_fleet([KAPPA], spoilt.before, spoilt.after, odd).fit < 0.05


@pytest.mark.coverage
def test_intervals_of_fleets_hold_the_truth():
    rng, kept, fleets = np.random.default_rng(46), 0, 100
    for number in range(fleets):
        m, t = rng.normal(CENTRE, WIDTH), abs(rng.normal(0.0, PRIOR))
        factor = np.exp(SPREAD * rng.standard_normal())
        lives = design(40, number)
        found = update([lives], LEVELS, fleet_of(rng, m, t, factor, 40), SPREAD)
        b10 = UncertainLives(replace(lives, exact=True), found.after).quantile(0.1)
        truth = np.exp(SCALE - m + ndtri(0.1) * np.hypot(t, INPUTS)) * factor
        kept += b10.low < truth < b10.high
    assert 0.9 <= kept / fleets <= 0.99

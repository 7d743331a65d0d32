"""Competing risks of wear and pitting against closed forms and draws."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.stats import lognorm, norm

from wearsim.uq.distributions.base import Distribution
from wearsim.uq.survival.competing import CompetingRisks, course_places
from wearsim.uq.survival.scores import score_function

MEDIAN, SIGMA, SLOPE = 1.1e-11, math.log(1.5), 1.5


class WearFactor(Distribution):
    def quantile(self, probability):
        return lognorm.ppf(probability, SIGMA, scale=MEDIAN)


def risks(saturated, end=1.4e6, life=2e6, **changes):
    """Return risks with a damage n/life that levels off at the passes `saturated`."""
    places = end * course_places()
    damage = saturated / life * -np.expm1(-places / saturated)
    values = {
        "damage": damage[None],
        "end": np.array([end]),
        "worn": np.array([True]),
        "rate": np.array([1.0 / life]),
        "slope": SLOPE,
        "probability": 0.1,
        "score": score_function(WearFactor()),
        "reference": MEDIAN,
    }
    return CompetingRisks(**(values | changes))


@pytest.mark.parametrize("saturated", [1e9, 2e5])
def test_probabilities_agree_with_draws(saturated):
    one, rng = risks(saturated), np.random.default_rng(1)
    ratio = np.exp(SIGMA * norm.ppf((np.arange(400_000) + 0.5) / 400_000))
    worn = 1.4e6 / ratio
    chance = rng.random(len(ratio))
    limit = (np.log(chance) / np.log(0.9)) ** (1.0 / SLOPE)  # damage at which a specimen pits

    def damage(passes):  # of specimens with these factors
        return saturated / 2e6 * -np.expm1(-passes * ratio / saturated) / ratio

    for life in (3e5, 1e6, 2e6, math.inf):
        found = one.at(life)
        assert sum(found) == pytest.approx(1.0, abs=1e-14)
        pitted = damage(np.minimum(life, worn)) >= limit
        assert found.pitting == pytest.approx(pitted.mean(), abs=2e-3)
        assert found.wear == pytest.approx((~pitted & (worn <= life)).mean(), abs=2e-3)


def test_quadrature_has_converged():
    one = risks(2e5)
    for life in (1e5, 8e5, 1.5e6, 4e6):
        coarse, fine = one.at(life), one.at(life, nodes=96)
        assert coarse.survival == pytest.approx(fine.survival, abs=1e-6)
        assert coarse.pitting == pytest.approx(fine.pitting, abs=1e-6)


def test_without_damage_only_wear_ends_lives():
    never = risks(1e9, damage=np.zeros((1, len(course_places()))), rate=np.zeros(1))
    life = never.life(0.1, "both").value
    assert life == pytest.approx(1.4e6 * math.exp(SIGMA * norm.ppf(0.1)), rel=1e-6)
    assert math.isinf(never.life(0.1, "pitting").value)


def test_life_without_wear_is_that_of_the_weibull_distribution():
    one = risks(2e5)
    assert one.life(0.1, "without_wear").value == pytest.approx(2e6, rel=1e-8)
    half = 2e6 * (math.log(0.5) / math.log(0.9)) ** (1.0 / SLOPE)
    assert one.life(0.5, "without_wear").value == pytest.approx(half, rel=1e-8)


def test_incidence_of_pitting_levels_off_below_one():
    one = risks(2e5)
    level = one.at(math.inf)
    assert 0.0 < level.pitting < 0.02
    assert level.survival == pytest.approx(0.0, abs=1e-12)
    assert math.isinf(one.life(0.1, "pitting").value)


def test_counted_lives_without_a_factor():
    ends = np.array([1e6, 2e6])
    damage = np.stack([end * course_places() / 2e6 for end in ends])
    one = CompetingRisks(damage, ends, np.array([True, False]), np.full(2, 5e-7), SLOPE, 0.1)
    alive = np.exp(math.log(0.9) * np.array([0.75, 0.5]) ** SLOPE)
    found = one.at(1.5e6)
    assert found.survival == pytest.approx(0.5 * alive[0], rel=1e-9)
    assert found.wear == pytest.approx(0.5 * alive[1], rel=1e-9)


def of_loads(scores, ratio=1.0, **law):
    """Return risks of tests with log-normal loads, on which wear and damage depend."""
    load = np.exp(0.15 * scores)
    end, rate = 1.4e6 / load**1.5 / ratio, 4e-7 * load**3
    level = np.broadcast_to(4e5 / ratio, load.shape)[:, None]
    damage = rate[:, None] * level * -np.expm1(-end[:, None] * course_places() / level)
    return CompetingRisks(damage, end, load > 0.0, rate, SLOPE, 0.1, **law)


LAW = {"score": score_function(WearFactor()), "reference": MEDIAN}


@pytest.mark.parametrize("cause", ["both", "wear", "without_wear", "pitting"])
@pytest.mark.parametrize("integrated", [True, False])
def test_intervals_of_lives_contain_the_truth(integrated, cause):
    share, studies = (0.005 if cause == "pitting" else 0.1), 40
    truth = of_loads(norm.ppf((np.arange(400) + 0.5) / 400), **LAW).life(share, cause).value
    rng = np.random.default_rng(5)
    within = 0
    for scores, factors in rng.standard_normal((studies, 2, 40)):
        tests = (scores, 1.0) if integrated else (scores, np.exp(SIGMA * factors))
        life = of_loads(*tests, **(LAW if integrated else {})).life(share, cause)
        assert life.low > 0.0
        assert life.low <= life.value <= life.high
        within += life.low <= truth <= life.high
    assert within >= 34  # fewer have a probability of 0.003 at 95 %


def test_lives_have_no_interval_where_nothing_else_is_random():
    life = risks(2e5, alone=True).life(0.1, "both")
    assert life.low == life.value == life.high
    one = risks(2e5).life(0.1, "both")
    assert (one.low, one.high) == (0.0, math.inf)


def test_bodies_without_damage_never_pit():
    never = risks(1e9, damage=np.zeros((1, len(course_places()))), rate=np.zeros(1))
    assert math.isinf(never.life(0.1, "without_wear").value)

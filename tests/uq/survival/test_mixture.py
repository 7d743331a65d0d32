"""Lives with the wear factor integrated exactly, and comparisons of designs."""

import math

import numpy as np
import pytest
from scipy.special import ndtr, ndtri
from scipy.stats import uniform

from wearsim.uq.distributions.base import Distribution
from wearsim.uq.survival.comparison import quantile_ratio, same_machine, two_specimens
from wearsim.uq.survival.distributions import CountedLives, FactorMixture
from wearsim.uq.survival.lives import life_quantile
from wearsim.uq.survival.scores import score_function

# full slip, 50 um, 300 N, R_crown 500 mm, mu xi = 1e-4
KAPPA = 4.0 / 3.0 * math.sqrt(2.0 * 0.5) * 50e-6**1.5 / (1e-4 * 300.0)


class LogNormal(Distribution):
    def __init__(self, median, spread):
        self.median, self.spread = median, spread

    def quantile(self, probability):
        return self.median * np.exp(self.spread * ndtri(probability))


class Flat(Distribution):
    def quantile(self, probability):
        return uniform.ppf(probability, 1.0, 2.0)


FACTOR = LogNormal(1.1e-11, math.log(1.5))


def test_closed_form_life_of_a_mean_design():
    mixture = FactorMixture(np.array([KAPPA]), score_function(FACTOR), exact=True)
    lives = [mixture.quantile(p).value for p in (0.5, 0.1, 0.01)]
    assert np.round(lives).tolist() == [1_428_499, 849_591, 556_199]
    assert mixture.probability_before(675_000.0).value == pytest.approx(0.0322357, abs=1e-7)


def test_score_inverts_any_quantile_function():
    score = score_function(Flat())
    values = np.array([0.5, 1.5, 2.0, 2.9, 3.5])
    assert ndtr(score(values)) == pytest.approx([0.0, 0.25, 0.5, 0.95, 1.0], abs=1e-6)


def test_score_of_a_table_of_equal_draws_is_a_step():
    class Table(Distribution):
        def quantile(self, probability):
            return np.where(np.asarray(probability) < 0.3, 1.0, 2.0)

    assert ndtr(score_function(Table())(np.array([0.9, 1.0, 2.0]))) == pytest.approx(
        [0.0, 0.3, 1.0], abs=1e-3
    )


def test_mixture_equals_the_integral_over_all_inputs():
    nodes, weights = np.polynomial.hermite_e.hermegauss(40)
    mixture = FactorMixture(np.exp(0.3 * nodes), score_function(LogNormal(1.0, 0.405)))
    weighted = mixture.failed(np.array([0.5]))[:, 0] @ weights / weights.sum()
    assert weighted == pytest.approx(ndtr(math.log(0.5) / math.hypot(0.3, 0.405)), rel=1e-6)


def test_correlated_factor_is_conditional_on_the_other_draws():
    random, rho = np.random.default_rng(1), 0.6
    other = random.standard_normal(200_000)
    kappa = np.exp(0.3 * other)
    mixture = FactorMixture(
        kappa, score_function(LogNormal(1.0, 0.4)), rho * other, math.sqrt(1.0 - rho**2)
    )
    spread = math.sqrt((0.3 - 0.4 * rho) ** 2 + 0.16 * (1.0 - rho**2))
    assert mixture.probability_before(0.5).value == pytest.approx(
        ndtr(math.log(0.5) / spread), rel=0.02
    )


@pytest.mark.parametrize(("share", "least", "most"), [(1e-2, 14, 78), (1e-3, 50, 450)])
def test_variance_falls_against_counting(share, least, most):
    nodes, weights = np.polynomial.hermite_e.hermegauss(200)
    weights /= weights.sum()
    ratios = []
    for rest in (0.15, 0.30):
        life = math.exp(math.hypot(0.405, rest) * ndtri(share))
        mixture = FactorMixture(np.exp(rest * nodes), score_function(LogNormal(1.0, 0.405)))
        each = mixture.failed(np.array([life]))[:, 0]
        mean = each @ weights
        ratios.append(mean * (1.0 - mean) / (each**2 @ weights - mean**2))
    assert ratios == pytest.approx([most, least], rel=0.2)


def test_life_of_zero_counts_as_failed():
    mixture = FactorMixture(np.array([0.0, 0.0, 1.0, np.inf]), score_function(LogNormal(1.0, 0.1)))
    assert mixture.probability_before(1e-6).value == 0.5
    assert mixture.probability_before(1e6).value == pytest.approx(0.75)


def designs(count, seed=0):
    common, own, factor = np.random.default_rng(seed).standard_normal((3, count))
    first, second = np.exp(0.2 * common), 1.2 * np.exp(0.15 * common + 0.15 * own)
    return first, second, np.exp(0.405 * factor)


def test_comparison_by_mixture_agrees_with_closed_form():
    first, second, factor = designs(2000)
    score = score_function(LogNormal(1.0, 0.405))
    pair = FactorMixture(second, score), FactorMixture(first, score)
    spreads = math.sqrt(0.405**2 + 0.045), math.hypot(0.405, 0.2)
    two, ratio = two_specimens(*pair), quantile_ratio(*pair, 0.1)
    exact = 1.2 * math.exp((spreads[0] - spreads[1]) * ndtri(0.1))
    assert two.low < ndtr(math.log(1.2) / math.hypot(*spreads)) < two.high
    assert ratio.low < exact < ratio.high
    machine = same_machine(second / factor, first / factor)
    assert machine.low < ndtr(math.log(1.2) / math.hypot(0.05, 0.15)) < machine.high


def test_counted_comparison_agrees_with_the_mixture():
    first, second, factor = designs(2000, 1)
    score = score_function(LogNormal(1.0, 0.405))
    mixed = two_specimens(FactorMixture(second, score), FactorMixture(first, score))
    counted = two_specimens(CountedLives(second / factor), CountedLives(first / factor))
    assert counted.value == pytest.approx(mixed.value, abs=0.01)
    assert counted.half_width > mixed.half_width


def test_censored_pairs_widen_the_comparison_to_bounds():
    first, second, factor = designs(2000, 2)
    one, other = second / factor, first / factor
    free, bound = (
        same_machine(one, other),
        same_machine(one.clip(max=1.0), other.clip(max=1.0), 1.0),
    )
    assert bound.low < free.low
    assert bound.high > free.high
    lives = CountedLives(one), CountedLives(other)
    assert two_specimens(*lives, 1.0).half_width > 2.0 * two_specimens(*lives).half_width


def test_bootstrap_of_pairs_uses_their_correlation():
    first, second, factor = designs(200, 3)
    lives = CountedLives(second / factor), CountedLives(first / factor)
    paired = quantile_ratio(*lives, 0.1)
    separate = quantile_ratio(*lives, 0.1, paired=False)
    assert paired.value == separate.value
    assert paired.half_width < 0.8 * separate.half_width


def test_ratio_of_counted_designs_is_that_of_their_quantiles():
    lives = np.random.default_rng(4).random(57)
    ratio = quantile_ratio(CountedLives(lives), CountedLives(np.ones(57)), 0.1)
    assert ratio.value == pytest.approx(life_quantile(lives, lives > 0.0, 0.1).value, rel=1e-12)
    few = quantile_ratio(CountedLives(lives[:6]), CountedLives(np.ones(6)), 0.1)
    assert not math.isfinite(few.value)


def test_designs_agree_with_twenty_thousand_lives_of_each():
    first, second, _ = designs(400, 5)
    score = score_function(LogNormal(1.0, 0.405))
    pair = FactorMixture(second, score), FactorMixture(first, score)
    one, other, factor = designs(20_000, 6)
    many = CountedLives(other / factor), CountedLives(one / factor)
    found = [two_specimens(*pair), quantile_ratio(*pair, 0.1)]
    reference = [two_specimens(*many), quantile_ratio(*many, 0.1, samples=100)]
    for estimate, truth in zip(found, reference, strict=True):
        error = math.hypot(estimate.half_width, truth.half_width) / 1.96
        assert abs(estimate.value - truth.value) < 3.0 * error
    for design, counted in zip(pair, many, strict=True):
        estimate, share = (
            design.quantile(0.1),
            life_quantile(counted.life, counted.life > 0.0, 0.1).value,
        )
        assert abs(estimate.value - share) < 3.0 * estimate.half_width / 1.96 * 1.2

"""Survival, quantiles and causes of censored lives, against published and exact numbers."""

import math

import numpy as np
import pytest
from scipy.stats import binom

from wearsim.uq.survival.fits import fit_lives
from wearsim.uq.survival.lives import (
    cumulative_incidence,
    fewest_lives,
    least_survival,
    life_quantile,
    lower_bound,
    median_positions,
    median_rank,
    probability_before,
    proportion,
    survival_curve,
)

# weeks in remission under 6-MP: Freireich et al., Blood 21 (1963)
WEEKS = np.array(
    [6, 6, 6, 7, 10, 13, 16, 22, 23, 6, 9, 10, 11, 17, 19, 20, 25, 32, 32, 34, 35], float
)
RELAPSED = np.arange(21) < 9


def test_kaplan_meier_reproduces_freireichs_data():
    curve = survival_curve(WEEKS, RELAPSED)
    at = dict(zip(curve.life, zip(curve.survival, curve.low, curve.high, strict=True), strict=True))
    assert at[10.0][0] == pytest.approx(0.752941, abs=5e-7)
    assert at[23.0] == pytest.approx((0.448179, 0.188052, 0.680143), abs=5e-7)


def test_weibull_fit_reproduces_freireichs_data():
    fit = fit_lives("Weibull", WEEKS, RELAPSED)
    b10 = fit.interval(0.1)
    assert (1.0 / fit.sigma, math.exp(fit.mu)) == pytest.approx((1.353735, 33.76515), rel=4e-7)
    assert b10.value == pytest.approx(6.405065, rel=1e-7)
    assert (b10.low, b10.high) == pytest.approx((1.907397, 12.273217), rel=3e-7)


@pytest.mark.parametrize("family", ["log-normal", "Weibull"])
def test_fits_agree_with_lifelines(family):
    lifelines = pytest.importorskip("lifelines")
    fitter = lifelines.LogNormalFitter() if family == "log-normal" else lifelines.WeibullFitter()
    fitter.fit(WEEKS, RELAPSED)
    fit = fit_lives(family, WEEKS, RELAPSED)
    assert fit.quantile(0.1) == pytest.approx(float(fitter.percentile(0.9)), rel=1e-4)
    assert fit.aic == pytest.approx(fitter.AIC_, rel=1e-6)


@pytest.mark.parametrize(("family", "name"), [("log-normal", "LogNormal"), ("Weibull", "Weibull")])
def test_fits_agree_with_surpyval(family, name):
    surpyval = pytest.importorskip("surpyval")
    model = getattr(surpyval, name).fit(x=WEEKS, c=(~RELAPSED).astype(int))
    fit = fit_lives(family, WEEKS, RELAPSED)
    assert fit.quantile(0.1) == pytest.approx(float(model.qf(0.1)), rel=1e-4)


def test_kaplan_meier_agrees_with_lifelines():
    lifelines = pytest.importorskip("lifelines")
    fitter = lifelines.KaplanMeierFitter().fit(WEEKS, RELAPSED)
    curve = survival_curve(WEEKS, RELAPSED)
    both = fitter.confidence_interval_survival_function_.loc[curve.life].to_numpy()
    assert np.allclose(curve.survival, fitter.survival_function_.loc[curve.life].to_numpy()[:, 0])
    assert np.allclose(np.column_stack([curve.low, curve.high]), both)


def test_fit_of_complete_log_normal_lives_is_mean_and_std():
    logs = np.random.default_rng(1).standard_normal(50)
    fit = fit_lives("log-normal", np.exp(logs), logs < np.inf)
    assert fit.mu == pytest.approx(logs.mean(), abs=1e-9)
    assert fit.sigma == pytest.approx(logs.std(), rel=1e-9)
    # deviance n ln(1 + t^2/(n - 1)) of the mean
    reach = math.sqrt(math.expm1(3.841458820694124 / 50)) * logs.std()
    interval = fit.interval(0.5)
    assert math.log(interval.high) == pytest.approx(logs.mean() + reach, abs=1e-7)
    assert math.log(interval.low) == pytest.approx(logs.mean() - reach, abs=1e-7)


def test_weibull_fits_log_normal_lives_with_short_early_lives():
    logs = 0.405 * np.random.default_rng(2).standard_normal(200_000)
    found = [fit_lives(name, np.exp(logs), logs < np.inf) for name in ("log-normal", "Weibull")]
    shorter = [1.0 - found[1].quantile(p) / found[0].quantile(p) for p in (0.1, 0.01)]
    assert shorter == pytest.approx([0.17, 0.51], abs=0.01)
    assert found[0].aic < found[1].aic


def test_no_fit_without_two_different_lives():
    assert fit_lives("Weibull", np.array([3.0, 3.0, 5.0]), np.array([True, True, False])) is None


@pytest.mark.parametrize(("count", "ranks"), [(36, (1, 8)), (100, (5, 17))])
def test_b10_is_bounded_by_exact_ranks(count, ranks):
    lives = np.arange(1.0, count + 1.0)
    found = life_quantile(lives, lives > 0.0, 0.1)
    assert (found.low, found.high) == ranks
    held = binom.cdf(ranks[1] - 1, count, 0.1) - binom.cdf(ranks[0] - 1, count, 0.1)
    assert held >= 0.95


@pytest.mark.parametrize(("count", "share"), [(36, 0.1), (100, 0.01), (20, 0.5)])
def test_counted_quantiles_are_above_the_truth_in_half_of_the_samples(count, share):
    lives = np.random.default_rng(5).random((4000, count))
    found = [life_quantile(one, one > 0.0, share).value for one in lives]
    # the deviation of a share of one half of 4000 samples is 0.8 %
    assert np.mean(np.array(found) > share) == pytest.approx(0.5, abs=0.03)


def test_positions_are_medians_of_the_ordered_lives():
    lives = np.sort(np.random.default_rng(6).random((20_000, 8)), axis=1)
    below = (lives < median_positions(8)).mean(axis=0)
    assert below == pytest.approx(np.full(8, 0.5), abs=0.015)


def test_b1_takes_69_lives_and_b10_takes_7():
    assert [fewest_lives(share) for share in (0.01, 0.1, 0.5, 0.9)] == [69, 7, 1, 7]
    for count, share in ((69, 0.01), (7, 0.1)):
        lives = np.arange(1.0, count + 1.0)
        assert life_quantile(lives, lives > 0.0, share).value == pytest.approx(1.0, abs=0.1)
        assert math.isnan(life_quantile(lives[1:], lives[1:] > 0.0, share).value)
        assert math.isnan(median_rank(count - 1, share))


def test_b10_has_one_bound_only_in_small_samples():
    lives = np.arange(1.0, 36.0)
    assert life_quantile(lives, lives > 0.0, 0.1).low == -math.inf
    assert lower_bound(lives, lives > 0.0, 0.1) == 1.0
    assert lower_bound(lives[:28], lives[:28] > 0.0, 0.1) == -math.inf


def test_quantile_beyond_the_censoring_has_a_lower_bound():
    lives = np.minimum(np.arange(1.0, 101.0), 40.0)
    found = life_quantile(lives, np.arange(100) < 40, 0.5)
    assert math.isnan(found.value)
    assert found.low == 40.0
    assert found.high == math.inf


def test_quantile_with_random_censoring_follows_the_log_log_band():
    found = life_quantile(WEEKS, RELAPSED, 0.5)
    assert (found.value, found.low) == (23.0, 13.0)
    assert found.high == math.inf


def test_probability_before_is_a_count_until_something_is_censored():
    assert probability_before(WEEKS, RELAPSED, 6.0) == proportion(0, 21)
    found = probability_before(WEEKS, RELAPSED, 23.5)
    assert found.value == pytest.approx(1.0 - 0.448179, abs=1e-6)
    assert not math.isfinite(probability_before(WEEKS, RELAPSED, 40.0).value)


def test_survival_without_failures_has_the_exact_bound():
    assert least_survival(29) == pytest.approx(0.05 ** (1 / 29))
    assert least_survival(28) < 0.9 < least_survival(29)


def test_first_failures_have_exact_bounds():
    lives = np.arange(1.0, 31.0)
    curve = survival_curve(lives, lives < 20.0)
    one, two = (proportion(k, 30) for k in (1, 2))
    assert (curve.low[0], curve.high[0]) == (1.0 - one.high, 1.0 - one.low)
    assert (curve.low[1], curve.high[1]) == (1.0 - two.high, 1.0 - two.low)


def test_incidences_of_causes_sum_to_the_failed_share():
    random = np.random.default_rng(3)
    lives, cause = random.random(60), random.integers(-1, 2, 60)
    at, incidence = cumulative_incidence(lives, cause, 2)
    curve = survival_curve(lives, cause >= 0)
    assert np.array_equal(at, curve.life)
    assert np.allclose(incidence.sum(axis=0), 1.0 - curve.survival)
    alone = survival_curve(lives, cause == 0)
    assert incidence[0, -1] < 1.0 - alone.survival[-1]

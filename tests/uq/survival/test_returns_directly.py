"""Returns of one design and one scatter against closed forms, unit by unit."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy import stats
from scipy.special import log_ndtr, ndtr, ndtri

from wearsim.uq.distributions.two_levels import TwoLevels, weighted_quantiles
from wearsim.uq.survival.distributions import FactorMixture
from wearsim.uq.survival.fleet import _draws, check_fleet, remaining_lives
from wearsim.uq.survival.returns import Fleet, LifeFunctions, update
from wearsim.uq.survival.scores import ScoreFunction, score_function
from wearsim.uq.survival.two_levels import UncertainLives

ENDS = np.array([-700.0, 700.0])
SCORE = ScoreFunction(ENDS, ENDS, np.zeros(0))
T, M = 0.4, -10.0


SINGLE = TwoLevels(np.array([M]), np.array([T]), np.ones(1))


def one(kappa: float = 1e-4, **more: object) -> FactorMixture:
    """Return one realisation with log-normal lives."""
    return FactorMixture(np.array([kappa]), SCORE, exact=True, **more)  # type: ignore[arg-type]


def test_functions_of_one_scatter_are_those_of_the_mixture() -> None:
    kappa = np.array([0.2, 1.0, 1.5, 0.0, math.inf])
    shift, spread = np.array([0.5, -0.3, 0.1, 0.0, 0.0]), 0.7
    lives = FactorMixture(kappa, SCORE, shift, spread)
    functions = LifeFunctions(lives, T)
    log = np.linspace(-6.0, 5.0, 57)
    with np.errstate(divide="ignore"):
        z = (log[:, None] + T * shift - np.log(kappa)) / (T * spread)
    density = stats.norm.pdf(z[:, :3]).sum(axis=1) / 5.0 / (T * spread)
    assert functions.failed(log) == pytest.approx(np.log(ndtr(z).mean(axis=1)), abs=1e-5)
    assert functions.survived(log) == pytest.approx(np.log(ndtr(-z).mean(axis=1)), abs=1e-5)
    middle = np.abs(log) < 2.5
    assert functions.density(log[middle]) == pytest.approx(np.log(density[middle]), abs=1e-4)
    assert functions.hazard(log) == pytest.approx(-np.log(ndtr(-z).mean(axis=1)), abs=1e-5)


def test_functions_continue_with_their_slope_beyond_the_table() -> None:
    functions, log = LifeFunctions(one(1.0), T), np.array([-9.0, -3.6, 3.6, 9.0]) * T / 0.4
    ends = np.array([-3.6, 3.6])  # nine scatters
    for name, value, slope in (
        (
            "failed",
            log_ndtr(ends / T),
            np.exp(stats.norm.logpdf(ends / T) - log_ndtr(ends / T)) / T,
        ),
        ("density", stats.norm.logpdf(ends, scale=T), -ends / T**2),
    ):
        found = getattr(functions, name)(log)
        known = [value[0] + slope[0] * (log[0] - ends[0]), *value]
        known.append(value[1] + slope[1] * (log[3] - ends[1]))
        assert found == pytest.approx(known, rel=1e-6)
    assert functions.hazard(np.array([-math.inf]))[0] == pytest.approx(0.0, abs=1e-15)
    assert functions.hazard(np.array([-9.0]))[0] == pytest.approx(0.0, abs=1e-15)


def test_likelihood_is_the_product_over_units() -> None:
    low = np.array([0.8, 0.8, 1.3, 0.5, 0.0, 1.1])
    high = np.array([0.8, 0.8, math.inf, 0.9, 0.7, math.inf])
    fleet = Fleet(low, high, np.zeros(6, dtype=np.int64))
    assert (len(fleet), fleet.failed.tolist()) == (6, [True, True, False, True, True, False])
    m = np.array([-0.2, 0.0, 0.3])
    found = LifeFunctions(one(1.0), T).likelihood(fleet, m)
    with np.errstate(divide="ignore"):
        first, last = ((np.log(x) + m[:, None]) / T for x in (low, high))
    known = 2.0 * stats.norm.logpdf(first[:, 0]) - 2.0 * math.log(T)
    known += np.log(ndtr(-first[:, [2, 5]])).sum(axis=1)
    known += np.log(ndtr(last[:, 3:5]) - ndtr(first[:, 3:5])).sum(axis=1)
    assert found == pytest.approx(known, abs=2e-5)
    late = Fleet(np.array([9.0]), np.array([10.0]), np.zeros(1, dtype=np.int64))
    tail = LifeFunctions(one(1.0), T).likelihood(late, np.zeros(1))[0]
    exact = math.log(ndtr(-math.log(9.0) / T) - ndtr(-math.log(10.0) / T))
    assert tail == pytest.approx(exact, abs=1e-4)


# a normal mean of known scatter: the units that failed at known lives give a conjugate posterior
MEANS = np.linspace(M - 1.2, M + 1.2, 81)
PRIOR = 0.25
LEVELS = TwoLevels(MEANS, np.full(81, T), np.exp(-0.5 * ((MEANS - M) / PRIOR) ** 2), 5, ("load",))
LOGS = math.log(1e-4) - M + np.array([-0.3, 0.1, 0.4, -0.6, 0.2])
FAILED = Fleet(np.exp(LOGS), np.exp(LOGS), np.zeros(5, dtype=np.int64))


@pytest.mark.parametrize("spread", [0.0, 0.2])
def test_posterior_of_known_lives_is_that_of_a_normal_mean(spread: float) -> None:
    found = update([one()], LEVELS, FAILED, spread)
    width = math.hypot(PRIOR, spread)
    precision = 1.0 / width**2 + 5.0 / T**2
    mean = (M / width**2 + (math.log(1e-4) - LOGS).sum() / T**2) / precision
    for levels, centre, std in ((found.before, M, width), (found.after, mean, precision**-0.5)):
        average = levels.weight @ levels.m
        assert average == pytest.approx(centre, abs=2e-3)
        assert math.sqrt(levels.weight @ (levels.m - average) ** 2) == pytest.approx(std, rel=5e-3)
        assert set(levels.t) == {T}
        assert (levels.specimens, levels.contained) == (5, ("load",))
    # of m = (m - ln L) + ln L the factor takes its share of the variance
    average = found.factor_weight @ found.log_factor
    assert average == pytest.approx((spread / width) ** 2 * (M - mean), abs=2e-3)
    square = found.factor_weight @ (found.log_factor - average) ** 2
    share = (spread / width) ** 2
    assert square == pytest.approx(share * PRIOR**2 + share**2 / precision, abs=5e-4)
    assert found.factor_weight.sum() == pytest.approx(1.0)
    after = found.lives_after(one()).quantile(0.3)
    predictive = math.log(1e-4) - mean + ndtri(0.3) * math.hypot(T, precision**-0.5)
    assert math.log(after.predictive) == pytest.approx(predictive, abs=2e-3)
    before = found.lives_before(one()).quantile(0.3)
    assert math.log(before.predictive) == pytest.approx(
        math.log(1e-4) - M + ndtri(0.3) * math.hypot(T, width), abs=2e-3
    )


def test_sampling_error_of_realisations_widens_the_prior_of_the_factor() -> None:
    kappa = 1e-4 * np.exp(0.3 * np.array([-1.0, 1.0] * 8))
    sampled = FactorMixture(kappa, SCORE)
    none = Fleet(np.array([1e-9]), np.array([math.inf]), np.zeros(1, dtype=np.int64))
    for lives, error in ((sampled, 0.3 / 4.0), (FactorMixture(kappa, SCORE, exact=True), 0.0)):
        found = update([lives], LEVELS, none, 0.2)
        std = math.sqrt(found.after.weight @ (found.after.m - M) ** 2)
        assert std == pytest.approx(math.sqrt(PRIOR**2 + 0.2**2 + error**2), rel=3e-3)
        factor = math.sqrt(found.factor_weight @ found.log_factor**2)
        assert factor == pytest.approx(0.04 / math.hypot(0.2, error), rel=5e-3)


def test_known_wear_factor_leaves_the_life_factor_to_the_returns() -> None:
    found = update([one()], SINGLE, FAILED, 0.2)
    precision = 1.0 / 0.2**2 + 5.0 / T**2
    mean = (M / 0.2**2 + (math.log(1e-4) - LOGS).sum() / T**2) / precision
    average = found.after.weight @ found.after.m
    assert average == pytest.approx(mean, abs=2e-3)
    std = math.sqrt(found.after.weight @ (found.after.m - average) ** 2)
    assert std == pytest.approx(precision**-0.5, rel=0.02)
    assert found.factor_weight @ found.log_factor == pytest.approx(M - mean, abs=5e-3)


def test_nearly_equal_scatters_are_one_and_few_are_kept() -> None:
    t = np.repeat([0.3, 0.3015, 0.4, 0.5], 81)
    m = np.tile(MEANS, 4)
    weight = np.exp(-0.5 * ((m - M) / PRIOR) ** 2) * np.repeat([1.0, 3.0, 2.0, 2.0], 81)
    levels = TwoLevels(m, t, weight)
    found = update([one()], levels, FAILED, 0.1).after
    assert np.unique(found.t) == pytest.approx([0.301125, 0.4, 0.5])
    z = math.log(1e-4) - LOGS
    logs = []
    for scatter in np.unique(found.t):
        variance, width = scatter**2 / 5.0, PRIOR**2 + 0.01
        log = stats.norm.logpdf(z.mean(), M, math.sqrt(variance + width)) - 4.0 * math.log(scatter)
        logs.append(log - 2.5 * z.var() / scatter**2)
    weight = np.exp(np.array(logs) - max(logs)) * [4.0, 2.0, 2.0]
    shares = [found.weight[found.t == scatter].sum() for scatter in np.unique(found.t)]
    assert shares == pytest.approx(weight / weight.sum(), abs=2e-3)


def hazard(life: np.ndarray) -> np.ndarray:
    """Return the cumulative hazard of one kappa and one mean."""
    with np.errstate(divide="ignore"):
        return -log_ndtr(-(np.log(life) + M - math.log(1e-4)) / T)


def test_failures_in_bands_are_those_of_the_hazards_passed() -> None:
    ages = math.exp(math.log(1e-4) - M) * np.linspace(0.4, 2.5, 48)
    failed = np.arange(48) % 4 == 0
    fleet = Fleet(ages, np.where(failed, ages, math.inf), np.zeros(48, dtype=np.int64))
    found = check_fleet([one(), one(2e-4)], SINGLE, SINGLE, fleet)
    total = hazard(ages).sum()
    bands = int(min(max(total // 4.0, 1), 6))
    assert len(found.edges) == bands + 1
    assert (found.edges[0], found.edges[-1]) == (0.0, ages.max())
    passed = np.minimum(hazard(found.edges)[:, None], hazard(ages)).sum(axis=1)
    assert np.diff(passed) == pytest.approx(np.full(bands, total / bands), rel=0.01)
    counts = np.histogram(ages[failed], np.append(found.edges[:-1], math.inf))[0]
    assert found.observed == pytest.approx([*counts, 12])
    for predicted in (found.before, found.after):
        assert predicted.mean[:-1] == pytest.approx(np.diff(passed), rel=0.04)
        for place, expected in enumerate([*np.diff(passed), total]):
            ends = np.minimum(stats.poisson.ppf([0.025, 0.975], expected), 48)
            assert predicted.low[place] == pytest.approx(ends[0], abs=1)
            assert predicted.high[place] == pytest.approx(ends[1], abs=2)
    below = 0.5 * (stats.poisson.cdf(12, total) + stats.poisson.cdf(11, total))
    assert found.surprise == pytest.approx(2.0 * min(below, 1.0 - below), abs=1e-3)
    rng, means = np.random.default_rng(1), np.diff(passed)
    distance = ((counts - means) ** 2 / means).sum()
    drawn = ((rng.poisson(means, (20_000, bands)) - means) ** 2 / means).sum(axis=1)
    assert found.fit == pytest.approx((drawn > distance).mean(), abs=0.05)


def test_inspected_failures_are_spread_by_their_probability() -> None:
    middle = math.exp(math.log(1e-4) - M)
    low, high = (
        np.array([0.0, 0.5, 0.9] * 12) * middle,
        np.array([0.8, 1.2, math.inf] * 12) * middle,
    )
    fleet = Fleet(low, high, np.zeros(36, dtype=np.int64))
    found = check_fleet([one()], SINGLE, SINGLE, fleet)
    edges = np.append(found.edges[:-1], math.inf)
    expected = np.zeros(len(edges) - 1)
    survival = np.exp(-hazard(edges))
    for first, last in zip(*(12 * [x[k] for k in (0, 1)] for x in (low, high)), strict=True):
        inside = np.clip(
            survival,
            math.exp(-hazard(np.array([last]))[0]),
            math.exp(-hazard(np.array([first]))[0]),
        )
        expected += -np.diff(inside) / -np.diff(inside).sum()
    assert found.observed == pytest.approx([*expected, 24.0], abs=0.2)
    none = Fleet(np.full(3, middle), np.full(3, math.inf), np.zeros(3, dtype=np.int64))
    found = check_fleet([one()], SINGLE, SINGLE, none)
    assert found.surprise == pytest.approx(math.exp(-3.0 * math.log(2.0)), rel=1e-3)
    assert found.edges.tolist() == [0.0, middle]  # fewer than four failures predicted
    early = np.full(3, 0.8 * middle)
    total = 3.0 * hazard(early[:1])[0]
    many = check_fleet([one()], SINGLE, SINGLE, Fleet(early, early, none.design))
    above = 1.0 - 0.5 * (stats.poisson.cdf(3, total) + stats.poisson.cdf(2, total))
    assert many.surprise == pytest.approx(2.0 * above, rel=1e-3)


def test_remaining_lives_of_a_known_distribution_are_exact() -> None:
    ages = math.exp(math.log(1e-4) - M) * np.array([0.2, 1.0, 2.0])
    target = ages[1] * 1.5
    found = remaining_lives(one(), SINGLE, ages, (0.1, 0.6), target)
    for age, left in zip(ages, found, strict=True):
        survival = ndtr(-(math.log(age) + M - math.log(1e-4)) / T)
        for share, life in zip((0.1, 0.6), left.lives, strict=True):
            log = math.log(1e-4) - M - T * ndtri(survival * (1.0 - share))
            further = math.exp(log) - age
            assert life.value == pytest.approx(further, rel=0.012)
            assert (life.low, life.high) == pytest.approx((life.value, life.value))
        reached = ndtr(-(math.log(target) + M - math.log(1e-4)) / T) / survival
        if age < target:
            assert left.survival is not None
            assert left.survival.value == pytest.approx(reached, rel=1e-3)
        else:
            assert left.survival is None
    assert remaining_lives(one(), SINGLE, ages[:1], (), None)[0].survival is None
    never = remaining_lives(one(), SINGLE, ages[:1], (1.0 - 1e-30,), None)[0].lives[0]
    assert never.value == math.inf


def test_remaining_lives_of_two_means_have_the_interval_of_both() -> None:
    levels = TwoLevels(M + np.array([0.0, 0.5, 3.0]), np.full(3, T), np.array([0.7, 0.3, 1e-6]))
    age = np.array([math.exp(math.log(1e-4) - M)]) * 0.5
    (found,) = remaining_lives(one(), levels, age, (0.2,), 2.0 * age[0])

    def survived(life: float) -> np.ndarray:
        return np.asarray(ndtr(-(math.log(life) + levels.m[:2] - math.log(1e-4)) / T))

    ratio = survived(2.0 * age[0]) / survived(age[0])
    assert found.survival is not None
    assert found.survival.value == pytest.approx([0.7, 0.3] @ ratio, rel=1e-3)
    low, high = weighted_quantiles(ratio, np.array([0.7, 0.3]), np.array([0.025, 0.975]))
    assert (found.survival.low, found.survival.high) == pytest.approx((low, high), rel=1e-3)
    each = np.exp(math.log(1e-4) - levels.m[:2] - T * ndtri(0.8 * survived(age[0]))) - age[0]
    low, high = weighted_quantiles(each, np.array([0.7, 0.3]), np.array([0.025, 0.975]))
    (life,) = found.lives
    assert (life.low, life.high) == pytest.approx((low, high), rel=5e-3)
    reached = [0.7, 0.3] @ (survived(age[0] + life.value) / survived(age[0]))
    assert reached == pytest.approx(0.8, abs=2e-3)


def test_uncertain_lives_of_one_mean_are_those_of_the_mixture() -> None:
    kappa = 1e-4 * np.exp(0.2 * np.array([-1.5, -0.5, 0.0, 0.4, 1.6]))
    two = TwoLevels(np.array([M, M + 0.3]), np.array([T, 0.6]), np.array([1.0, 1.0]))
    mixture = FactorMixture(kappa, score_function(two), np.linspace(-0.2, 0.2, 5), 0.9)
    lives = UncertainLives(mixture, two)
    life = math.exp(math.log(1e-4) - M) * 0.8
    chances = []
    for m, t in zip(two.m, two.t, strict=True):
        z = (math.log(life) + m - np.log(kappa)) / t + mixture.shift
        chances.append(ndtr(z / 0.9).mean())
        given = lives.given(m, t)
        assert given.failed(np.array([life])).mean() == pytest.approx(chances[-1])
        log = math.log(given.quantile_of_mean(0.2))
        assert lives.quantile(0.2).low < math.exp(log) < lives.quantile(0.2).high
    assert lives.probabilities(np.array([life]))[:, 0] == pytest.approx(chances, abs=1e-4)
    assert lives.probabilities(np.zeros(1))[:, 0] == pytest.approx([0.0, 0.0], abs=1e-14)
    assert lives.quantile(0.2) is lives.quantile(0.2)
    found = lives.quantile(0.2)
    interval = found.interval
    assert interval.value == found.predictive
    assert (interval.low, interval.high) == (found.low, found.high)
    # both errors as quantiles of values with a normal part: by realisations within a scatter
    logs, parts = [], []
    for m, t in zip(two.m, two.t, strict=True):
        one_given = lives.given(m, t).quantile(0.2)
        logs.append(math.log(one_given.value))
        parts.append(math.log(one_given.high / one_given.low) / 3.92)
    assert found.by_tests == pytest.approx(np.var(logs), rel=1e-6)
    assert found.by_realisations == pytest.approx(np.mean(np.square(parts)), rel=1e-4)
    z = np.linspace(-2.5, 2.5, 11)
    values = np.concatenate([log + part * z for log, part in zip(logs, parts, strict=True)])
    weight = np.tile(np.exp(-0.5 * z**2), 2)
    ends = weighted_quantiles(values, weight, np.array([0.025, 0.975]))
    assert np.log([found.low, found.high]) == pytest.approx(ends, abs=1e-5)
    probability = lives.probability_before(life)
    inner = mixture.probability_before(life)
    assert probability.value == inner.value
    logits = np.log(np.array(chances) / (1.0 - np.array(chances)))
    part = np.diff(np.log([x / (1.0 - x) for x in (inner.low, inner.high)]))[0] / 3.92
    values = (logits[:, None] + part * z).ravel()
    ends = weighted_quantiles(values, weight, np.array([0.025, 0.975]))
    assert [probability.low, probability.high] == pytest.approx(
        1.0 / (1.0 + np.exp(-ends)), abs=1e-4
    )
    assert lives.probability_before(1e-300) == mixture.probability_before(1e-300)


@pytest.mark.parametrize("exact", [True, False])
def test_life_that_is_never_reached_is_infinite(exact: bool) -> None:
    kappa = np.array([1e-4, 1.2e-4, math.inf, math.inf, math.inf, math.inf])
    two = TwoLevels(np.array([M, M + 0.3]), np.full(2, T), np.ones(2))
    lives = UncertainLives(FactorMixture(kappa, score_function(two), exact=exact), two)
    never, some = lives.quantile(0.5), lives.quantile(0.3)
    assert (never.predictive, never.plug_in, never.high) == (math.inf,) * 3
    assert never.by_tests == math.inf
    assert never.by_realisations == 0.0
    assert 0.0 < some.low < some.predictive < math.inf
    assert some.by_tests == pytest.approx(0.15**2)
    if exact:
        assert (never.low, some.by_realisations) == (math.inf, 0.0)
    else:
        # with an infinite upper end, the lower one gives the error
        given = lives.given(M, T).quantile(0.3)
        assert given.high == math.inf
        error = math.log(given.value / given.low) / 1.96
        assert some.by_realisations == pytest.approx(error**2, rel=1e-4)


def test_draws_of_a_posterior_have_the_shares_of_its_rows() -> None:
    means, scatters = np.array([1.0, 2.0, 3.0, 4.0]), np.array([0.2, 0.2, 0.3, 0.3])
    levels = TwoLevels(means, scatters, np.array([2.0, 3.0, 1.0, 2.0]))
    drawn = list(_draws(levels, 8))
    assert [t for t, _, _ in drawn] == [0.2, 0.3]
    assert np.sort(drawn[0][1]).tolist() == [1.0] * 2 + [2.0] * 3
    assert np.sort(drawn[1][1]).tolist() == [3.0] + [4.0] * 2
    numbers = np.concatenate([number for _, _, number in drawn])
    assert np.sort(numbers).tolist() == list(range(8))

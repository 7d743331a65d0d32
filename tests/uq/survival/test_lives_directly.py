"""Counted lives and distributions of lives against loops and closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy import stats
from scipy.special import ndtr, ndtri

from wearsim.uq.estimation.intervals import UNKNOWN, Interval
from wearsim.uq.survival.distributions import CountedLives, FactorMixture, logit_interval
from wearsim.uq.survival.effective import (
    caution,
    effective_number,
    fits_of,
    predicted_number,
)
from wearsim.uq.survival.lives import (
    cumulative_incidence,
    life_quantile,
    lower_bound,
    median_positions,
    median_rank,
    probability_before,
    proportion,
    survival_curve,
)
from wearsim.uq.survival.scores import ScoreFunction

ENDS = np.array([-700.0, 700.0])
SPREAD, MEDIAN = 0.4, -2.0
SCORE = ScoreFunction(ENDS, (ENDS - MEDIAN) / SPREAD, np.zeros(0))  # log-normal
Z = 1.959963984540054


def parts(found: Interval) -> list[float]:
    """Return value and ends."""
    return [found.value, found.low, found.high]


@pytest.mark.parametrize(("count", "of"), [(0, 10), (3, 10), (9, 10), (10, 10), (1, 2)])
@pytest.mark.parametrize("confidence", [0.95, 0.8])
def test_proportion_has_the_exact_interval(count: int, of: int, confidence: float) -> None:
    known = stats.binomtest(count, of).proportion_ci(confidence, "exact")
    found = proportion(count, of, confidence)
    assert parts(found) == pytest.approx([count / of, known.low, known.high], rel=1e-9)
    assert proportion(0, 0) == UNKNOWN


def curve_by_loop(life: np.ndarray, observed: np.ndarray) -> np.ndarray:
    """Return life, survival and ends of its interval after Kaplan, Meier and Greenwood."""
    rows, survival, variance, high = [], 1.0, 0.0, 1.0
    censored = min(
        (x for x, seen in zip(life, observed, strict=True) if not seen), default=math.inf
    )
    for end in sorted({x for x, seen in zip(life, observed, strict=True) if seen}):
        at_risk, failed = (life >= end).sum(), ((life == end) & observed).sum()
        survival *= 1.0 - failed / at_risk
        low = 0.0
        if survival > 0.0:
            variance += failed / (at_risk * (at_risk - failed))
            reach = Z * math.sqrt(variance) / abs(math.log(survival))
            low, high = survival ** math.exp(reach), min(high, survival ** math.exp(-reach))
        before = ((life <= end) & observed).sum()
        if end < censored and before < 3:
            exact = stats.binomtest(int(before), len(life)).proportion_ci(method="exact")
            low, high = 1.0 - exact.high, 1.0 - exact.low
            rows.append((end, survival, low, high))
            high = min(survival ** math.exp(-reach), 1.0)
            continue
        rows.append((end, survival, low, high))
    return np.array(rows)


@pytest.mark.parametrize(
    ("life", "seen"),
    [
        ([2, 3, 3, 5, 6, 8, 8, 9, 11, 12], "1111011011"),
        ([2, 3, 3, 5, 6, 8, 8, 9, 11, 12], "0111011010"),
        ([1, 2, 3, 4, 5, 6], "110101"),
        ([4, 4, 4, 5, 5], "11101"),
        ([1, 1, 2, 3, 3], "10111"),
        ([1, 2, 3, 4], "1111"),
    ],
)
def test_survival_is_the_product_of_conditional_ones(life: list[int], seen: str) -> None:
    lives, observed = np.array(life, float), np.array([one == "1" for one in seen])
    found = survival_curve(lives, observed)
    known = curve_by_loop(lives, observed)
    assert np.column_stack([found.life, found.survival, found.low, found.high]) == pytest.approx(
        known, abs=1e-7
    )
    assert len(survival_curve(lives, observed & False).life) == 0
    for target in (0.5, 3.0, 3.5, 8.5):
        one = probability_before(lives, observed, target)
        early = ~observed & (lives < target)
        rows = known[known[:, 0] < target]
        if not early.any():
            assert one == proportion(int((lives < target).sum()), len(lives))
        elif target > lives.max():
            assert one == UNKNOWN
        elif not len(rows):
            assert one == proportion(0, int((lives >= target).sum()))
        else:
            _, value, low, high = rows[-1]
            assert parts(one) == pytest.approx([1.0 - value, 1.0 - high, 1.0 - low], abs=1e-7)


def test_nothing_fails_before_a_target_after_a_censored_life() -> None:
    lives = np.array([1.0, 4.0, 5.0, 6.0])
    found = probability_before(lives, np.array([False, True, True, True]), 3.0)
    assert found == proportion(0, 3)
    assert probability_before(
        lives, np.array([False, True, True, True]), 6.0
    ).value == pytest.approx(2.0 / 3.0)


def test_quantiles_with_censored_lives_are_where_the_band_crosses() -> None:
    lives = np.array([2.0, 3.0, 3.0, 5.0, 6.0, 8.0, 8.0, 9.0, 11.0, 12.0])
    observed = np.array([one == "1" for one in "0111011011"])
    known = curve_by_loop(lives, observed)
    for share in (0.2, 0.5, 0.7):
        found = life_quantile(lives, observed, share)
        value, low, high = (
            min((row[0] for row in known if row[k] <= 1.0 - share), default=math.inf)
            for k in (1, 2, 3)
        )
        assert (found.value, found.low, found.high) == (value, min(value, low), high)
    few = life_quantile(np.array([1.0, 2.0, 3.0, 4.0]), np.array([False, True, True, True]), 0.1)
    assert math.isnan(few.value)
    assert life_quantile(lives[:0], observed[:0], 0.5) == UNKNOWN
    # all censored at one age: counted until then
    ended = np.minimum(np.arange(1.0, 41.0), 20.0)
    assert life_quantile(ended, np.arange(40) < 19, 0.3).value == pytest.approx(12.3, abs=0.2)
    late = life_quantile(ended, np.arange(40) < 19, 0.4)
    assert late.value == pytest.approx(16.3, abs=0.2)
    assert late.high == math.inf
    assert lower_bound(ended, np.arange(40) > 0, 0.1) == -math.inf
    assert lower_bound(ended, np.arange(40) < 19, 0.1) == stats.binom.ppf(0.05, 40, 0.1)


def test_incidence_of_causes_adds_up_conditional_shares() -> None:
    life = np.array([1.0, 2.0, 2.0, 2.0, 3.0, 4.0, 5.0])
    cause = np.array([0, 1, 0, -1, 1, -1, 0])
    at, found = cumulative_incidence(life, cause, 3)
    assert at.tolist() == [1.0, 2.0, 3.0, 5.0]
    survival, total, rows = 1.0, np.zeros(3), []
    for end in at:
        share = np.array([((life == end) & (cause == k)).sum() for k in range(3)])
        share = share / (life >= end).sum()
        total = total + survival * share
        survival *= 1.0 - share.sum()
        rows.append(total)
    assert found == pytest.approx(np.array(rows).T)


def logit_ends(value: float, error: float, degrees: float) -> list[float]:
    """Return value and ends by Student's t of the logit."""
    reach = stats.t.ppf(0.975, degrees) * error / (value * (1.0 - value))
    middle = math.log(value / (1.0 - value))
    return [value, *(1.0 / (1.0 + math.exp(-middle - side)) for side in (-reach, reach))]


def test_logit_interval_is_that_of_student() -> None:
    assert parts(logit_interval(0.2, 0.05, 7)) == pytest.approx(logit_ends(0.2, 0.05, 7))
    assert logit_interval(0.2, 0.0, 7) == Interval(0.2, 0.2, 0.2)
    for value in (0.0, 1.0):
        assert logit_interval(value, 0.1, 7) == Interval(value, 0.0, 1.0)
    assert logit_interval(0.2, math.inf, 7) == Interval(0.2, 0.0, 1.0)
    assert parts(logit_interval(0.5, 500.0, 7)) == pytest.approx([0.5, 0.0, 1.0], abs=1e-300)


def test_counted_lives_have_the_logit_interval_of_their_share() -> None:
    lives = CountedLives(np.array([0.0, 2.0, 3.0, 3.0, 5.0, 9.0, 14.0, math.inf]))
    assert (lives.count, lives.middle) == (8, 4.0)
    assert lives.steps.tolist() == [0.0, 2.0, 3.0, 3.0, 5.0, 9.0, 14.0]
    assert CountedLives(np.array([0.0, math.inf])).middle == 1.0
    assert lives.failed(np.array([3.0, 3.1]))[:, 0].tolist() == [1.0, 1.0] + [0.0] * 6
    failed = (lives.life < 5.5).astype(float)
    error = failed.std(ddof=1) / math.sqrt(8)
    found = lives.probability_before(5.5)
    assert parts(found) == pytest.approx(logit_ends(5 / 8, error, 7))
    value = lives.quantile(0.5)
    assert value.value == pytest.approx(3.0, rel=1e-9)
    level = logit_ends(0.5, (lives.life <= 3.0).std(ddof=1) / math.sqrt(8), 7)
    ordered = np.sort(lives.life)
    ends = [ordered[math.ceil(8 * end - 1e-9) - 1] for end in level[1:]]
    assert [value.low, value.high] == pytest.approx(ends, rel=1e-9)
    assert lives.quantile(0.95).value == math.inf
    assert lives.quantile(0.05).value == 0.0
    one = CountedLives(np.array([2.0]))
    assert one.probability_before(3.0) == Interval(1.0, 0.0, 1.0)
    assert parts(one.quantile(0.5)) == pytest.approx([2.0, 0.0, math.inf])


def test_mixture_is_a_mean_of_log_normal_lives() -> None:
    kappa, shift = np.array([0.5, 1.0, 3.0, 0.0, math.inf]), np.array([0.3, -0.2, 0.1, 0.0, 0.4])
    mixture = FactorMixture(kappa, SCORE, shift, 0.8)
    life = np.array([2.0, 9.0])
    with np.errstate(divide="ignore"):
        z = (np.log(life) + MEDIAN - np.log(kappa[:, None])) / SPREAD + shift[:, None]
    assert mixture.failed(life) == pytest.approx(ndtr(z / 0.8), abs=1e-12)
    assert mixture.is_finite.tolist() == [True] * 3 + [False] * 2
    assert mixture.middle == pytest.approx(1.0 / math.exp(MEDIAN))
    assert FactorMixture(kappa[3:], SCORE).middle == 1.0
    log, finite = mixture.log_kappa
    assert log == pytest.approx(np.log(kappa[:3]) - SPREAD * shift[:3])
    assert finite is mixture.is_finite
    needed = mixture.needed_score(np.log([0.5, 2.0]), 4.0)
    assert needed == pytest.approx((np.log([0.125, 0.5]) - MEDIAN) / SPREAD / 0.8)
    steps = FactorMixture(kappa, ScoreFunction(ENDS, ENDS, np.array([0.5, 2.0]))).steps
    assert steps.tolist() == [0.25, 0.5, 1.0, 1.5, 2.0, 6.0]
    single = FactorMixture(kappa[:1], SCORE)
    assert single.probability_before(2.0) == Interval(
        single.failed(np.array([2.0]))[0, 0], 0.0, 1.0
    )
    exact = FactorMixture(kappa[:1], SCORE, exact=True).probability_before(2.0)
    assert (
        exact.low
        == exact.value
        == exact.high
        == pytest.approx(single.failed(np.array([2.0]))[0, 0])
    )


def test_error_of_a_mixture_is_at_least_the_predicted_one() -> None:
    log = np.array([-0.5, -0.2, 0.05, 0.1, 0.3, 0.4, 0.9])
    kappa = np.exp(np.append(log, [-math.inf, math.inf, math.inf]))
    mixture = FactorMixture(kappa, SCORE)
    # seven values have the fit by mean and standard deviation alone
    scores = np.linspace(-9.0, 9.0, 20_001)
    density = stats.norm.pdf(scores) / stats.norm.pdf(scores).sum()
    limit = math.sqrt(6.0 / stats.chi2.ppf(0.1, 6))

    def number(life: float, widened: float) -> float:
        fit = log.mean() + limit**widened * log.std(ddof=1) * scores
        failed = ndtr((math.log(life) + MEDIAN - fit) / SPREAD)
        mean = 0.1 + 0.7 * density @ failed
        square = 0.1 + 0.7 * density @ failed**2
        return 10 * min(mean, 1.0 - mean) ** 2 / (square - mean**2)

    for life in (2.0, 6.0, 40.0):
        each = mixture.failed(np.array([life]))[:, 0]
        mean = each.mean()
        assert mixture.effective_number(life) == pytest.approx(
            min(number(life, 1.0), 10 * min(mean, 1.0 - mean) ** 2 / each.var(ddof=1)), rel=1e-4
        )
        predicted = number(life, caution(mean))
        own = each.std(ddof=1) / math.sqrt(10)
        error = max(own, min(mean, 1.0 - mean) / math.sqrt(predicted))
        found = mixture.error(life, each)
        assert found == pytest.approx((error, min(9.0, max(predicted - 1.0, 1.0))), rel=1e-4)


def test_effective_number_is_that_of_counts_with_the_variation() -> None:
    assert effective_number(50, 0.2, 0.2 * 0.8) == pytest.approx(50 * 0.2 / 0.8)
    assert effective_number(50, 0.8, 0.2 * 0.8) == pytest.approx(50 * 0.2 / 0.8)
    assert effective_number(50, 0.5, 0.0) == math.inf
    mean, square = 0.1 + 0.6 * 0.3, 0.1 + 0.6 * 0.09
    found = predicted_number([np.zeros(721)], lambda log: np.full_like(log, 0.3), (0.1, 0.6), 50)
    assert found == pytest.approx(50 * mean**2 / (square - mean**2))
    both = [np.zeros(721), np.ones(721)]
    least = predicted_number(both, lambda log: np.where(log > 0.5, 0.05, 0.3), (0.1, 0.6), 50)
    other = (0.1 + 0.6 * 0.05, 0.1 + 0.6 * 0.05**2)
    assert least == pytest.approx(50 * other[0] ** 2 / (other[1] - other[0] ** 2))


def test_fits_are_a_line_and_from_eight_values_on_a_parabola() -> None:
    log = np.random.default_rng(1).standard_normal(8) ** 2
    scores = np.linspace(-9.0, 9.0, 721)
    for count in (2, 7, 8):
        fits = fits_of(log[:count])
        assert fits.centre == pytest.approx(log[:count].mean())
        assert fits.shapes[0] == pytest.approx(log[:count].std(ddof=1) * scores)
        limit = math.sqrt((count - 1) / stats.chi2.ppf(0.1, count - 1))
        assert fits.widening == pytest.approx(limit)
        assert len(fits.shapes) == (2 if count == 8 else 1)
        wide = fits.values(0.5)
        assert wide[0] == pytest.approx(fits.centre + math.sqrt(limit) * fits.shapes[0])
    places = ndtri((np.arange(8) + 0.625) / 8.25)
    curve = np.polyval(np.polyfit(places, np.sort(log), 2), scores)
    assert fits.values(0.0)[1] == pytest.approx(curve)
    for few in (log[:0], log[:1]):
        fits = fits_of(few)
        assert (fits.centre, fits.widening) == (few.sum(), 1.0)
        assert not fits.shapes[0].any()


def test_spread_is_widened_from_5_to_1_percent() -> None:
    assert [caution(p) for p in (0.5, 0.05, 0.95, 0.01, 0.99, 1e-9, 0.0)] == pytest.approx(
        [0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0]
    )
    assert caution(math.sqrt(0.05 * 0.01)) == pytest.approx(0.5)


def test_median_ranks_reach_from_the_first_to_the_last_life() -> None:
    positions = median_positions(7)
    assert positions == pytest.approx(stats.beta(np.arange(1, 8), np.arange(7, 0, -1)).median())
    assert median_rank(7, float(positions[0])) == 1.0
    assert median_rank(7, float(positions[-1])) == 7.0
    assert median_rank(7, float(0.5 * (positions[2] + positions[3]))) == pytest.approx(3.5)
    assert math.isnan(median_rank(7, float(positions[-1]) + 1e-9))
    assert math.isnan(median_rank(0, 0.5))


def test_two_realisations_have_an_interval_and_one_has_none() -> None:
    two, one = (FactorMixture(kappa, SCORE) for kappa in (np.array([1.0, 1.3]), np.ones(1)))
    for life in (6.0, 8.0):
        found = two.probability_before(life)
        failed = two.failed(np.array([life]))[:, 0]
        error, degrees = two.error(life, failed)
        assert parts(found) == pytest.approx(parts(logit_interval(failed.mean(), error, degrees)))
        assert 0.0 < found.low < found.value < found.high < 1.0
        assert parts(one.probability_before(life))[1:] == [0.0, 1.0]
    quantile = two.quantile(0.5)
    assert 0.0 < quantile.low < quantile.value < quantile.high < math.inf
    assert parts(one.quantile(0.5))[1:] == [0.0, math.inf]


def test_interval_of_a_quantile_contains_the_step_at_it() -> None:
    lives = np.array([1.0, 2.0, 2.0, 3.0, 5.0, 8.0, 13.0])
    counted = CountedLives(lives)
    for share in (0.4, 0.5, 0.8):
        value = counted.quantile_of_mean(share)
        assert np.abs(lives - value).min() < 1e-9
        failed = (lives <= value * (1.0 + 1e-9)).astype(float)
        error, degrees = counted.error(value * (1.0 + 1e-9), failed)
        ends = logit_interval(share, error, degrees)
        found = counted.quantile(share)
        assert found.low == pytest.approx(counted.quantile_of_mean(ends.low), rel=1e-12)

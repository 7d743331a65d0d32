"""Comparisons of two designs against loops over all pairs and all bootstrap samples."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy import stats
from scipy.optimize import brentq
from scipy.special import ndtr

from wearsim.uq.estimation.intervals import UNKNOWN, Interval
from wearsim.uq.survival.comparison import quantile_ratio, same_machine, two_specimens
from wearsim.uq.survival.distributions import CountedLives, FactorMixture
from wearsim.uq.survival.lives import life_quantile, proportion
from wearsim.uq.survival.scores import ScoreFunction

ENDS = np.array([-700.0, 700.0])
SPREAD = 0.4
SCORE = ScoreFunction(ENDS, ENDS / SPREAD, np.zeros(0))  # log-normal, of median 1
Z = 1.959963984540054


def test_same_machine_counts_equal_and_undecided_pairs_one_half():
    first = np.array([3.0, 1.0, 2.0, 5.0, 6.0, 4.0, 5.0])
    second = np.array([1.0, 3.0, 2.0, 5.0, 5.0, 1.0, 6.0])
    found = same_machine(first, second, 5.0)
    assert found == Interval(4.0 / 7.0, proportion(2, 7).low, proportion(6, 7).high)
    free = same_machine(first, second)
    assert free == Interval(4.0 / 7.0, proportion(3, 7).low, proportion(5, 7).high)
    assert same_machine(first[:0], second[:0]) == UNKNOWN


def logit_ends(value: float, error: float, degrees: int) -> tuple[float, float]:
    """Return the ends of the interval by Student's t of the logit."""
    reach = stats.t.ppf(0.975, degrees) * error / (value * (1.0 - value))
    low, high = (math.log(value / (1.0 - value)) + side * reach for side in (-1.0, 1.0))
    return 1.0 / (1.0 + math.exp(-low)), 1.0 / (1.0 + math.exp(-high))


def by_pairs(chance: np.ndarray, paired: bool, undecided: float = 0.0) -> list[float]:
    """Return value and interval from the chances of all pairs, after DeLong et al. (1988)."""
    n, m = chance.shape
    rows, columns = chance.mean(axis=1), chance.mean(axis=0)
    if paired:
        value = chance[~np.eye(n, dtype=bool)].mean()
        covariance = np.cov(rows, columns)
        error = math.sqrt(covariance.sum() / n)
    else:
        value = chance.mean()
        error = math.sqrt(rows.var(ddof=1) / n + columns.var(ddof=1) / m)
    ends = [logit_ends(value + side * undecided, error, min(n, m) - 1) for side in (-1.0, 1.0)]
    return [value, ends[0][0], ends[1][1]]


def parts(found: Interval) -> list[float]:
    """Return value and ends."""
    return [found.value, found.low, found.high]


@pytest.mark.parametrize("most", [math.inf, 6.0])
def test_counted_lives_of_two_specimens_are_compared_pair_by_pair(most: float):
    rng = np.random.default_rng(1)
    first, second = rng.integers(2, 9, 12).astype(float), rng.integers(1, 8, 9).astype(float)
    for other, paired in ((second, False), (np.append(second, [3.0, 6.0, 7.0]), True)):
        lives = [np.minimum(item, most) for item in (first, other)]
        chance = np.array([[(a > b) + 0.5 * (a == b) for b in lives[1]] for a in lives[0]])
        left = [(item >= most).mean() for item in lives]
        found = two_specimens(CountedLives(first), CountedLives(other), most, paired)
        expected = by_pairs(chance, paired, 0.5 * left[0] * left[1])
        assert parts(found) == pytest.approx(expected, rel=1e-12)
    few = CountedLives(first[:4])
    assert two_specimens(few, few) == UNKNOWN
    assert two_specimens(CountedLives(first[:5]), CountedLives(other), paired=False) != UNKNOWN


def outlives(first: float, second: float, most: float) -> float:
    """Return the probability that a life of one kappa is the longer one."""
    if math.isinf(most):
        return float(ndtr(math.log(first / second) / (SPREAD * math.sqrt(2.0))))
    end = math.log(most)
    x, weights = np.polynomial.legendre.leggauss(60)
    x = -4.0 + 0.5 * (1.0 + x) * (end + 4.0)
    density = stats.norm.pdf(x, math.log(second), SPREAD) * 0.5 * (end + 4.0)
    longer = float(weights @ (ndtr((math.log(first) - x) / SPREAD) * density))
    return longer + 0.5 * math.prod(
        ndtr((math.log(kappa) - end) / SPREAD) for kappa in (first, second)
    )


def never_or(first: float, second: float, most: float) -> float:
    """Return the same where a kappa may be 0, which fails at once, or infinite."""
    if first == 0.0 or second == 0.0:
        return 0.5 * (first == second) + float(first > second)
    if math.isfinite(first) and math.isfinite(second):
        return outlives(first, second, most)
    if math.isinf(first) and math.isinf(second):
        return 0.5
    reached = 0.0  # the other one reaches the censoring too
    if math.isfinite(most):
        reached = float(ndtr((math.log(min(first, second)) - math.log(most)) / SPREAD))
    return 1.0 - 0.5 * reached if math.isinf(first) else 0.5 * reached


@pytest.mark.parametrize("most", [math.inf, 1.1])
def test_mixtures_of_two_specimens_are_compared_pair_by_pair(most: float):
    rng = np.random.default_rng(2)
    first, second = np.exp(0.3 * rng.standard_normal((2, 6)))
    for kappa, paired in ((second, True), (second[:5], False)):
        chance = np.array([[outlives(a, b, most) for b in kappa] for a in 1.3 * first])
        pair = FactorMixture(1.3 * first, SCORE), FactorMixture(kappa, SCORE)
        left = [float(1.0 - item.failed(np.array([most])).mean()) for item in pair]
        found = two_specimens(*pair, most, paired)
        expected = by_pairs(chance, paired, 0.5 * left[0] * left[1])
        assert parts(found) == pytest.approx(expected, abs=1e-4)
    # realisations that never fail outlive all others, and tie with each other
    some, rest = np.append(1.3 * first, math.inf), np.append(second, [math.inf, 0.0])
    chance = np.array([[never_or(a, b, most) for b in rest] for a in some])
    pair = FactorMixture(some, SCORE), FactorMixture(rest, SCORE)
    left = [float(1.0 - item.failed(np.array([min(most, 1e9)])).mean()) for item in pair]
    undecided = 0.5 * left[0] * left[1] if most < math.inf else 0.0
    expected = by_pairs(chance, False, undecided)
    assert parts(two_specimens(*pair, most, False)) == pytest.approx(expected, abs=1e-4)
    one, other = (FactorMixture(np.array([k]), SCORE, exact=True) for k in (1.4, 1.0))
    value = outlives(1.4, 1.0, most)
    half = 0.5 * math.prod(
        float(1.0 - item.failed(np.array([most]))[0, 0]) for item in (one, other)
    )
    found = two_specimens(one, other, most)
    assert parts(found) == pytest.approx([value, value - half, value + half], abs=1e-4)


def bootstrap(quantiles, n: int, m: int, paired: bool, samples: int) -> list[float]:
    """Return the ends of the ratio over bootstrap samples, one after the other."""
    rng = np.random.default_rng(7)
    first = rng.multinomial(n, np.full(n, 1.0 / n), size=samples)
    second = first if paired else rng.multinomial(m, np.full(m, 1.0 / m), size=samples)
    logs = [
        math.log(quantiles[0](one) / quantiles[1](other))
        for one, other in zip(first, second, strict=True)
    ]
    low, middle, high = np.quantile(logs, (0.025, 0.5, 0.975))
    wider = stats.t.ppf(0.975, n - 1) / Z * math.sqrt(n / (n - 1))
    return [math.exp(middle + wider * (end - middle)) for end in (low, high)]


@pytest.mark.parametrize("share", [0.5, 0.3])
def test_ratio_of_counted_quantiles_is_that_of_resampled_lives(share: float):
    rng = np.random.default_rng(3)
    lives = rng.random(12) + 0.5, rng.random(9) + 0.5, rng.random(12) + 0.5

    def quantile(life: np.ndarray):
        return lambda counts: (
            life_quantile(np.repeat(life, counts), np.ones(len(life), dtype=bool), share).value
        )

    for other, paired in ((lives[1], False), (lives[2], True)):
        functions = quantile(lives[0]), quantile(other)
        value = functions[0](np.ones(12, dtype=int)) / functions[1](np.ones(len(other), dtype=int))
        pair = CountedLives(lives[0]), CountedLives(other)
        found = quantile_ratio(*pair, share, paired=paired, samples=60, seed=7)
        expected = [value, *bootstrap(functions, 12, len(other), paired, 60)]
        assert parts(found) == pytest.approx(expected, rel=1e-12)
    few, enough = CountedLives(lives[0][:4]), CountedLives(lives[0][:5])
    assert quantile_ratio(few, enough, share) == UNKNOWN
    assert quantile_ratio(enough, enough, share) != UNKNOWN


@pytest.mark.parametrize("paired", [True, False])
def test_ratio_of_quantiles_of_mixtures_is_that_of_resampled_realisations(paired: bool):
    rng = np.random.default_rng(4)
    kappa = np.exp(0.3 * rng.standard_normal((2, 6)))
    kappa[0] *= 1.2

    def quantile(values: np.ndarray):
        def of(counts: np.ndarray) -> float:
            log = brentq(
                lambda x: counts @ ndtr((x - np.log(values)) / SPREAD) / counts.sum() - 0.1, -9, 9
            )
            return math.exp(log)

        return of

    functions = [quantile(values) for values in kappa]
    pair = [FactorMixture(values, SCORE) for values in kappa]
    found = quantile_ratio(*pair, 0.1, paired=paired, samples=30, seed=7)
    value = functions[0](np.ones(6)) / functions[1](np.ones(6))
    assert parts(found) == pytest.approx([value, *bootstrap(functions, 6, 6, paired, 30)], rel=2e-4)
    exact = [FactorMixture(values[:1], SCORE, exact=True) for values in kappa]
    one = kappa[0, 0] / kappa[1, 0]
    assert parts(quantile_ratio(*exact, 0.1)) == pytest.approx([one] * 3, rel=1e-5)


def test_ratio_with_a_quantile_beyond_the_censoring_is_unbounded():
    kappa = np.exp(np.linspace(-0.5, 0.5, 8))
    short, long = FactorMixture(kappa, SCORE), FactorMixture(40.0 * kappa, SCORE)
    assert quantile_ratio(long, short, 0.5, most=3.0) == UNKNOWN
    never = np.where(np.arange(8) < 4, np.inf, kappa)
    some = FactorMixture(never, SCORE)
    assert two_specimens(some, some).value == pytest.approx(0.5)
    found = quantile_ratio(some, short, 0.4, samples=200)
    assert math.isfinite(found.value)
    assert (found.low, found.high) == (0.0, math.inf)

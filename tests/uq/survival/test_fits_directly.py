"""Fits of lives against their likelihood written out, and specimens of demonstration tests."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from scipy import stats
from scipy.optimize import minimize, minimize_scalar
from scipy.special import ndtr, ndtri

from wearsim.uq.distributions.two_levels import TwoLevels
from wearsim.uq.survival.demonstration import drawn_lives, specimens
from wearsim.uq.survival.distributions import CountedLives, FactorMixture
from wearsim.uq.survival.fits import (
    FAMILIES,
    FittedLives,
    fit_lives,
    fit_mixture,
    standard_score,
)
from wearsim.uq.survival.goodness import anderson_darling
from wearsim.uq.survival.scores import ScoreFunction
from wearsim.uq.survival.two_levels import UncertainLives

LIVES = np.array([0.4, 0.9, 1.1, 1.7, 2.0, 2.4, 2.9, 3.0, 3.0, 3.0])
SEEN = np.arange(10) < 7
ENDS = np.array([-700.0, 700.0])
SCATTER = 0.3
SCORE = ScoreFunction(ENDS, ENDS / SCATTER, np.zeros(0))  # log-normal wear factor, median 1


def law(family: str, mu: float, sigma: float):
    """Return the distribution of lives from scipy."""
    if family == "log-normal":
        return stats.lognorm(sigma, scale=math.exp(mu))
    return stats.weibull_min(1.0 / sigma, scale=math.exp(mu))


def log_likelihood(family: str, mu: float, sigma: float) -> float:
    """Return the log-likelihood of the lives, failed or censored."""
    known = law(family, mu, sigma)
    return float(known.logpdf(LIVES[SEEN]).sum() + known.logsf(LIVES[~SEEN]).sum())


def second_derivatives(function, at: np.ndarray, step: float = 1e-4) -> np.ndarray:
    """Return the second derivatives by central differences."""
    unit = step * np.eye(len(at))
    return np.array(
        [
            [
                sum(
                    one * other * function(at + one * first + other * second)
                    for one in (-1, 1)
                    for other in (-1, 1)
                )
                / (4.0 * step**2)
                for second in unit
            ]
            for first in unit
        ]
    )


@pytest.mark.parametrize("family", FAMILIES)
def test_fit_of_censored_lives_has_the_greatest_likelihood(family: str) -> None:
    fit = fit_lives(family, LIVES, SEEN)
    assert fit is not None

    def value(x: np.ndarray) -> float:
        return log_likelihood(family, x[0], math.exp(x[1]))

    best = minimize(
        lambda x: -value(x),
        [0.5, 0.0],
        method="Nelder-Mead",
        options={"xatol": 1e-9, "fatol": 1e-12},
    ).x
    assert (fit.mu, math.log(fit.sigma)) == pytest.approx(best, abs=1e-5)
    assert fit.log_likelihood == pytest.approx(value(best), abs=1e-9)
    assert fit.aic == pytest.approx(4.0 - 2.0 * value(best))
    covariance = np.linalg.inv(-second_derivatives(value, best))
    assert fit.covariance == pytest.approx(covariance, rel=1e-4)
    known = law(family, fit.mu, fit.sigma)
    assert fit.probability_before(LIVES) == pytest.approx(known.cdf(LIVES))
    assert fit.quantile(0.2) == pytest.approx(known.ppf(0.2))
    score = (np.log(LIVES) - fit.mu) / fit.sigma
    gradient = np.stack([np.full(10, -1.0 / fit.sigma), -score])
    error = np.sqrt(np.einsum("ik,ij,jk->k", gradient, covariance, gradient))
    assert fit.score_error(LIVES) == pytest.approx(error, rel=1e-4)


@pytest.mark.parametrize("family", FAMILIES)
@pytest.mark.parametrize("share", [0.02, 0.5, 0.9])
def test_interval_of_a_fit_ends_where_the_deviance_is_that_of_chi_squared(
    family: str, share: float
) -> None:
    fit = fit_lives(family, LIVES, SEEN)
    assert fit is not None
    found, w = fit.interval(share), standard_score(family, share)
    assert found.value == pytest.approx(fit.quantile(share))
    assert found.low < found.value < found.high
    for end in (found.low, found.high):
        log = math.log(end)
        most = minimize_scalar(
            lambda s: -log_likelihood(family, log - math.exp(s) * w, math.exp(s)),  # noqa: B023
            (math.log(fit.sigma) - 0.1, math.log(fit.sigma) + 0.1),
        )
        assert 2.0 * (fit.log_likelihood + most.fun) == pytest.approx(
            stats.chi2.ppf(0.95, 1), abs=1e-5
        )


def test_fit_needs_two_different_lives_that_ended() -> None:
    assert fit_lives("Weibull", np.array([1.0, 2.0, 3.0]), np.array([True, False, False])) is None
    assert (
        fit_lives("Weibull", np.array([1.0, 2.0, 3.0]), np.array([True, True, False])) is not None
    )
    far = fit_lives("log-normal", np.array([1.0, 1e9]), np.ones(2, dtype=bool))
    assert far is not None
    assert (far.mu, far.sigma) == pytest.approx((0.5 * math.log(1e9),) * 2)


@pytest.mark.parametrize("family", FAMILIES)
def test_integrated_fit_is_that_of_many_wear_factors(family: str) -> None:
    kappa, shift = np.exp(np.array([-0.5, -0.1, 0.0, 0.3, 0.9])), np.linspace(-0.4, 0.4, 5)
    mixture = FactorMixture(kappa, SCORE, shift, 0.8)
    fit = fit_mixture(family, mixture)
    assert fit is not None
    scores = np.linspace(-6.0, 6.0, 241)
    weight = stats.norm.pdf(scores) / stats.norm.pdf(scores).sum()
    logs = np.log(kappa)[:, None] - SCATTER * (shift[:, None] + 0.8 * scores)

    def each(x: np.ndarray) -> np.ndarray:
        known = law(family, x[0], math.exp(x[1]))
        return np.asarray(known.logpdf(np.exp(logs)) @ weight)

    best = np.array([fit.mu, math.log(fit.sigma)])
    value = each(best).mean()
    assert all(each(best + d).mean() < value for d in 1e-3 * np.vstack([np.eye(2), -np.eye(2)]))
    step = 1e-5 * np.eye(2)
    slopes = np.stack([(each(best + d) - each(best - d)) / 2e-5 for d in step])
    assert slopes.sum(axis=1) == pytest.approx([0.0, 0.0], abs=1e-5)
    bread = np.linalg.inv(second_derivatives(lambda x: float(each(x).sum()), best))
    covariance = bread @ (slopes @ slopes.T * 5.0 / 4.0) @ bread
    assert fit.covariance == pytest.approx(covariance, rel=1e-3)
    assert fit.degrees == 4.0
    w = standard_score(family, 0.1)
    gradient = np.array([1.0, fit.sigma * w])
    reach = stats.t.ppf(0.975, 4) * math.sqrt(gradient @ covariance @ gradient)
    found = fit.interval(0.1)
    log = fit.mu + fit.sigma * w
    assert np.log([found.value, found.low, found.high]) == pytest.approx(
        [log, log - reach, log + reach], rel=1e-3
    )
    across = np.exp(np.linspace(logs.min(), logs.max(), 2000))
    difference = np.abs(
        law(family, fit.mu, fit.sigma).cdf(across) - mixture.failed(across).mean(axis=0)
    )
    assert fit.difference == pytest.approx(difference.max(), rel=1e-2)
    exact = fit_mixture(family, FactorMixture(kappa[:1], SCORE, exact=True))
    assert exact is not None
    assert exact.degrees == math.inf
    assert not exact.covariance.any()
    assert fit_mixture(family, FactorMixture(kappa * [1, 1, 0, 1, 1], SCORE)) is None
    # a wear factor that follows from another input, and one realisation: equal lives
    assert fit_mixture(family, FactorMixture(kappa[:1], SCORE, 0.3, 0.0, exact=True)) is None


def statistic(u: np.ndarray, count: int, end: float) -> float:
    """Return the integral of Anderson and Darling of ordered probabilities up to an end."""
    grid = np.concatenate([[0.0], u, [end]])
    total = 0.0
    for k, (low, high) in enumerate(itertools.pairwise(grid)):
        share = k / count  # integral of (share - x)^2/(x (1 - x)), by partial fractions
        total += -(high - low)
        if share > 0.0:
            total += share**2 * math.log(high / low)
        if share < 1.0:
            total -= (1.0 - share) ** 2 * math.log((1.0 - high) / (1.0 - low))
    return count * total


@pytest.mark.parametrize("family", FAMILIES)
def test_statistic_of_lives_censored_at_one_age_is_the_integral_up_to_it(family: str) -> None:
    lives = np.minimum(np.linspace(0.3, 4.0, 14) ** 1.3, 4.2)
    seen = lives < 4.2
    fit = fit_lives(family, lives, seen)
    assert fit is not None
    found = anderson_darling(fit)
    assert found is not None
    u = fit.probability_before(np.append(lives[seen], 4.2))
    assert found.statistic == pytest.approx(statistic(u[:-1], 14, u[-1]), rel=1e-6)
    # every life twice as long is the same test
    twice = fit_lives(family, 2.0 * lives, seen)
    assert twice is not None
    again = anderson_darling(twice)
    assert again is not None
    assert tuple(again) == pytest.approx(tuple(found), abs=0.02)
    ages = np.where(seen, lives, lives + np.arange(14))
    several = fit_lives(family, ages, seen)
    assert several is not None
    assert anderson_darling(several) is None


def test_fewest_specimens_of_several_survivals_have_the_mean_confidence() -> None:
    survival = np.array([0.7, 0.85, 0.95])
    for failures in (0, 2):
        count = specimens(0.9, survival, failures)
        chances = [
            stats.binom.cdf(failures, n, 1.0 - survival).mean() for n in range(failures + 1, 200)
        ]
        assert count == next(n for n, c in enumerate(chances, failures + 1) if c <= 0.1)
    assert specimens(0.5, np.array([0.5])) == 1  # one of two survives, exactly the confidence
    assert [specimens(c, np.array([0.5])) for c in (0.75, 0.875)] == [2, 3]


def test_curve_of_a_known_factor_is_its_distribution() -> None:
    shift = np.array([0.0, 0.4, -0.4])
    kappa = np.exp(np.array([0.0, 0.5, -0.3]))
    mixture = FactorMixture(kappa, SCORE, shift, exact=True)
    drawn = drawn_lives(mixture, None, 3.0)
    assert drawn.shift.tolist() == [0.0]
    for log in (-0.5, 0.3, 1.0):
        known = mixture.failed(np.array([math.exp(log)])).mean()
        assert drawn.failed(np.full(1, log))[0] == pytest.approx(known, abs=1e-4)
        assert drawn.log_quantile(known)[0] == pytest.approx(log, abs=1e-3)
    assert np.isnan(drawn.failed(np.full(1, 1.2))).all()
    assert np.isfinite(drawn.failed(np.log(np.full(1, 3.0)))).all()
    assert np.isnan(drawn.log_quantile(0.999)).all()
    never = drawn_lives(FactorMixture(np.array([math.inf]), SCORE, exact=True), None)
    assert never.failed(np.zeros(1))[0] == pytest.approx(0.0, abs=1e-9)


def test_draws_resample_the_realisations_and_the_wear_factor() -> None:
    lives = CountedLives(np.array([1.0, 2.0, 4.0, 8.0, 16.0]))
    drawn = drawn_lives(lives, None)
    failed = drawn.failed(np.full(200, math.log(3.0)))
    assert failed.mean() == pytest.approx(0.4, abs=0.05)
    assert failed.std() == pytest.approx(math.sqrt(0.24 / 5.0), rel=0.15)
    assert set(np.round(5.0 * failed, 6)) <= set(range(6))
    same = drawn_lives(CountedLives(2.0 * lives.life), None).failed(np.full(200, math.log(6.0)))
    assert failed == pytest.approx(same)
    m, t = np.array([-0.5, 0.2, 0.9]), np.array([0.2, 0.4, 0.3])
    levels = TwoLevels(m, t, np.array([1.0, 2.0, 1.0]))
    mixture = FactorMixture(np.ones(1), SCORE, exact=True)
    both = drawn_lives(mixture, UncertainLives(mixture, levels))
    rows = [int(np.argmin(abs(m - shift))) for shift in both.shift]
    assert np.bincount(rows).tolist() == [50, 100, 50]
    found = both.failed(np.full(200, 0.1))
    assert found == pytest.approx(ndtr((0.1 + m) / t)[rows], abs=2e-3)
    assert both.log_quantile(0.3) == pytest.approx((t * ndtri(0.3) - m)[rows], abs=2e-3)


def test_scores_of_a_life_of_zero_are_minus_infinity() -> None:
    fit = FittedLives("Weibull", 1.0, 0.5, 0.0)
    assert fit.score(np.zeros(1))[0] == -math.inf
    assert fit.probability_before(np.zeros(1))[0] == 0.0
    assert fit.quantile(0.5) == pytest.approx(math.e * math.log(2.0) ** 0.5)

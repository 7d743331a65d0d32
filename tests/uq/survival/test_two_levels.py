"""Lives with a posterior of the wear factor: brute force, closed forms and coverage."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.special import ndtr, ndtri

from wearsim.uq.distributions.two_levels import TwoLevels, weighted_quantiles
from wearsim.uq.hierarchy.kernels import LikelihoodMixture
from wearsim.uq.hierarchy.pooled import Posterior
from wearsim.uq.survival.distributions import FactorMixture
from wearsim.uq.survival.scores import score_function
from wearsim.uq.survival.two_levels import UncertainLives

M, T = np.meshgrid(np.linspace(-25.6, -24.8, 9), np.linspace(0.15, 0.9, 7), indexing="ij")
LEVELS = TwoLevels(M.ravel(), T.ravel(), np.exp(-T.ravel() - (M.ravel() + 25.2) ** 2))
SCORE = score_function(LEVELS)
INPUTS, SCALE = 0.3, -11.0  # standard deviation and mean of ln kappa
CAMPAIGNS, TESTS = 400, 8


def uncertain(kappa: np.ndarray, levels: TwoLevels = LEVELS, exact: bool = False) -> UncertainLives:
    """Return the lives of realisations with a posterior of the wear factor."""
    score = SCORE if levels is LEVELS else score_function(levels)
    return UncertainLives(FactorMixture(kappa, score, exact=exact), levels)


def drawn(count: int, seed: int = 1) -> np.ndarray:
    """Return kappa of realisations."""
    return np.exp(SCALE + INPUTS * np.random.default_rng(seed).standard_normal(count))


def before(log_life: float, kappa: np.ndarray, m: float, t: float) -> float:
    """Return the probability of a shorter life, one realisation after the other."""
    return float(np.mean([ndtr((m + log_life - np.log(one)) / t) for one in kappa]))


def test_predictive_quantiles_are_those_of_the_mixture():
    for probability in (1e-5, 0.01, 0.1, 0.5, 0.9, 1.0 - 1e-5):
        found = float(LEVELS.quantile(np.array([probability]))[0])
        below = LEVELS.weight @ ndtr((np.log(found) - LEVELS.m) / LEVELS.t)
        assert ndtri(below) == pytest.approx(ndtri(probability), abs=2e-4)
    assert LEVELS.quantile(np.array([0.0, 1.0])).tolist() == [0.0, np.inf]


def test_one_mean_and_scatter_is_a_lognormal_distribution():
    one = TwoLevels(np.array([-25.0]), np.array([0.4]), np.ones(1))
    chance = np.array([0.001, 0.3, 0.99])
    assert np.log(one.quantile(chance)) == pytest.approx(-25.0 + 0.4 * ndtri(chance), abs=1e-4)
    assert one.mean == pytest.approx(np.exp(-25.0 + 0.08))


def test_uncertain_lives_are_those_of_brute_force():
    kappa = drawn(30)
    found = uncertain(kappa).quantile(0.1)
    pairs = list(zip(LEVELS.m, LEVELS.t, strict=True))
    each = [brentq(lambda x: before(x, kappa, m, t) - 0.1, 5.0, 20.0) for m, t in pairs]  # noqa: B023
    together = brentq(
        lambda x: LEVELS.weight @ [before(x, kappa, m, t) for m, t in pairs] - 0.1, 5.0, 20.0
    )
    assert np.log(found.predictive) == pytest.approx(together, abs=1e-4)
    middle = LEVELS.weight @ each
    assert found.by_tests == pytest.approx(LEVELS.weight @ (each - middle) ** 2, rel=1e-6)
    plug_in = brentq(lambda x: before(x, kappa, *LEVELS.plug_in) - 0.1, 5.0, 20.0)
    assert np.log(found.plug_in) == pytest.approx(plug_in, abs=1e-8)
    ends = weighted_quantiles(np.array(each), LEVELS.weight, np.array([0.025, 0.975]))
    # the interval also holds the sampling error of 30 realisations
    assert found.low < np.exp(ends[0])
    assert found.high > np.exp(ends[1])
    alone = uncertain(kappa, exact=True).quantile(0.1)
    assert np.log([alone.low, alone.high]) == pytest.approx(ends, abs=1e-8)
    assert alone.by_realisations == 0.0


def test_probability_of_a_life_has_the_interval_of_both_levels():
    kappa, life = drawn(30), np.exp(13.0)
    found = uncertain(kappa, exact=True).probability_before(life)
    each = np.array([before(13.0, kappa, m, t) for m, t in zip(LEVELS.m, LEVELS.t, strict=True)])
    assert found.value == pytest.approx(LEVELS.weight @ each, rel=1e-3)
    logits = np.log(each / (1.0 - each))
    low, high = weighted_quantiles(logits, LEVELS.weight, np.array([0.025, 0.975]))
    assert np.log(found.low / (1.0 - found.low)) == pytest.approx(low, abs=0.02)
    assert np.log(found.high / (1.0 - found.high)) == pytest.approx(high, abs=0.02)


def test_error_by_realisations_is_the_scatter_of_repeated_studies():
    levels = TwoLevels(np.array([-25.0]), np.array([0.4]), np.ones(1))
    studies = [uncertain(drawn(60, seed), levels).quantile(0.1) for seed in range(60)]
    scatter = np.log([one.predictive for one in studies]).std()
    stated = np.sqrt(np.mean([one.by_realisations for one in studies]))
    assert stated == pytest.approx(scatter, rel=0.2)


def life_of(m: float, t: float) -> float:
    """Return the true B10 for any number of realisations."""
    return float(np.exp(SCALE - m + ndtri(0.1) * np.hypot(t, INPUTS)))


def held(rng: np.random.Generator, m: float, t: float, kappa: np.ndarray) -> bool:
    """Return whether the B10 of a campaign of tests holds the truth."""
    inputs = 0.2  # scatter of the other inputs of the wear tests
    apparent = rng.normal(m, np.hypot(t, inputs), TESTS)
    kernels = [
        LikelihoodMixture(np.ones(1), np.array([one]), np.array([inputs])) for one in apparent
    ]
    posterior = Posterior.of(kernels, 40)
    levels = TwoLevels.on_grid(posterior.t, posterior.m, posterior.density(), TESTS)
    found = uncertain(kappa, levels).quantile(0.1)
    return found.low < life_of(m, t) < found.high


@pytest.mark.coverage
def test_intervals_of_campaigns_hold_the_truth():
    rng, kept = np.random.default_rng(43), 0
    for number in range(CAMPAIGNS):
        m, t = rng.normal(-25.0, 0.5), abs(rng.normal(0.0, 0.5))
        kept += held(rng, m, t, drawn(50, number))
    assert 0.93 <= kept / CAMPAIGNS <= 0.97


@pytest.mark.coverage
@pytest.mark.parametrize("t", [0.2, 0.4])
def test_intervals_at_a_fixed_scatter_hold_the_truth(t: float):
    rng, kept = np.random.default_rng(44), 0
    for number in range(CAMPAIGNS // 2):
        kept += held(rng, -25.0, t, drawn(50, number))
    assert kept / (CAMPAIGNS // 2) >= 0.9

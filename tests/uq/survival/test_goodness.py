"""Anderson-Darling tests, bands of fits, and fits to lives with the wear factor integrated."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.special import ndtri

from wearsim.uq.survival.distributions import FactorMixture
from wearsim.uq.survival.fits import FAMILIES, fit_lives, fit_mixture, standard_probability
from wearsim.uq.survival.goodness import _simulated, anderson_darling
from wearsim.uq.survival.scores import ScoreFunction

ENDS = np.array([-700.0, 700.0])
K_MEDIAN, K_SCATTER = -25.2, 0.4


def lognormal_factor(scatter: float = K_SCATTER) -> ScoreFunction:
    """Return the normal score of a log-normal wear factor."""
    return ScoreFunction(ENDS, (ENDS - K_MEDIAN) / scatter, np.zeros(0))


def standard(family: str, shape: tuple[int, int], seed: int = 1) -> np.ndarray:
    """Return standardised logarithms of lives."""
    uniform = np.random.default_rng(seed).random(shape)
    return ndtri(uniform) if family == "log-normal" else np.log(-np.log1p(-uniform))


def test_statistic_of_complete_lives_is_the_integral():
    lives = np.exp(standard("log-normal", (1, 30))[0])
    fit = fit_lives("log-normal", lives, lives > 0)
    assert fit is not None
    test = anderson_darling(fit)
    assert test is not None
    u = np.sort(standard_probability("log-normal", fit.score(lives)))
    grid = np.linspace(0.0, 1.0, 400_001)[1:-1]
    steps = np.searchsorted(u, grid, side="right") / 30.0
    integral = 30.0 * np.mean((steps - grid) ** 2 / (grid * (1.0 - grid)))
    assert test.statistic == pytest.approx(integral, rel=1e-3)


@pytest.mark.parametrize("family", FAMILIES)
@pytest.mark.parametrize("censored", [False, True])
def test_true_distributions_are_rejected_as_often_as_stated(family, censored):
    samples = 60 if censored else 200
    chances = []
    for logs in standard(family, (samples, 40)):
        end = np.quantile(standard(family, (1, 999), 7), 0.8) if censored else np.inf
        fit = fit_lives(family, np.exp(np.minimum(logs, end)), logs <= end)
        assert fit is not None
        test = anderson_darling(fit)
        assert test is not None
        chances.append(test.probability)
    for level in (0.1, 0.5):
        # three binomial errors
        reach = 3.0 * np.sqrt(level * (1.0 - level) / samples)
        assert np.mean(np.array(chances) < level) == pytest.approx(level, abs=reach)


@pytest.mark.parametrize(("family", "critical"), [("log-normal", 0.752), ("Weibull", 0.757)])
def test_critical_values_are_those_of_the_tables(family, critical):
    # D'Agostino and Stephens, Goodness-of-Fit Techniques (1986), tables 4.7 and 4.17, 5 %
    factor = 1.0 + 0.75 / 100 + 2.25 / 100**2 if family == "log-normal" else 1.0 + 0.2 / 10.0
    simulated = factor * _simulated(family, 100, np.inf)
    assert (simulated > critical).mean() == pytest.approx(0.05, abs=0.02)


def test_other_distributions_are_rejected():
    lives = np.exp(standard("log-normal", (1, 400))[0])
    fit = fit_lives("Weibull", lives, lives > 0)
    assert fit is not None
    test = anderson_darling(fit)
    assert test is not None
    assert test.probability < 0.01


def test_too_few_lives_have_no_test():
    lives = np.exp(standard("Weibull", (1, 7))[0])
    fit = fit_lives("Weibull", lives, lives > 0)
    assert fit is not None
    assert anderson_darling(fit) is None


def test_band_of_a_fit_is_that_of_its_quantiles():
    lives = np.exp(standard("log-normal", (1, 200))[0])
    fit = fit_lives("log-normal", lives, lives > 0)
    assert fit is not None
    median = np.exp(np.array([fit.mu]))
    # of n normal values the errors of mean and standard deviation are sigma/sqrt(n), sigma/sqrt(2n)
    assert fit.score_error(median)[0] == pytest.approx(1.0 / np.sqrt(200.0), rel=1e-6)
    far = np.exp(np.array([fit.mu + 2.0 * fit.sigma]))
    assert fit.score_error(far)[0] == pytest.approx(np.sqrt(3.0 / 200.0), rel=1e-6)


def test_integrated_fit_has_the_moments_of_the_mixture():
    kappa = np.exp(-11.0 + 0.3 * standard("log-normal", (1, 50))[0])
    fit = fit_mixture("log-normal", FactorMixture(kappa, lognormal_factor()))
    assert fit is not None
    assert fit.mu == pytest.approx(np.log(kappa).mean() - K_MEDIAN, rel=1e-9)
    assert fit.sigma**2 == pytest.approx(np.log(kappa).var() + K_SCATTER**2, rel=1e-6)
    assert fit.difference < 0.02


def test_fit_with_the_wear_factor_alone_has_no_sampling_error():
    lives = FactorMixture(np.array([1.57e-5]), lognormal_factor(), exact=True)
    fit = fit_mixture("log-normal", lives)
    assert fit is not None
    found = fit.interval(0.1)
    assert found.value == pytest.approx(lives.quantile_of_mean(0.1), rel=1e-6)
    assert found.low == found.high
    assert fit.difference < 1e-6
    assert fit_mixture("Weibull", FactorMixture(np.array([np.inf]), lognormal_factor())) is None


@pytest.mark.parametrize("family", FAMILIES)
def test_interval_of_an_integrated_fit_is_the_scatter_of_studies(family):
    found, errors = [], []
    for logs in standard("log-normal", (60, 30)):
        fit = fit_mixture(family, FactorMixture(np.exp(-11.0 + 0.3 * logs), lognormal_factor()))
        assert fit is not None
        life = fit.interval(0.1)
        found.append(np.log(life.value))
        errors.append(np.log(life.high / life.low) / (2.0 * 2.045))  # Student's t of 29
    assert np.mean(errors) == pytest.approx(np.std(found), rel=0.25)

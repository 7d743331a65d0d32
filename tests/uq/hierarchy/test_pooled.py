"""Hierarchy of wear factors: the paper's three depths, closed forms, rates of the verdicts."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.special import chdtrc, chdtri, ndtri

from tests.uq.hierarchy.likelihoods import normal
from wearsim.uq.hierarchy.kernels import LikelihoodMixture
from wearsim.uq.hierarchy.pooled import Posterior
from wearsim.uq.hierarchy.verdict import ALPHA, Design, Power, word

#: ln of the energy of the paper's tests, which wore 28, 48 and 62 um: depth ~ energy^(2/3)
PAPER = 1.5 * np.log([28.0, 48.0, 62.0])


def normal_power(tests: int, variance: float, t: float) -> float:
    """Return the power of the variance test for normal values of equal variance: closed form."""
    limit = chdtri(tests - 1, ALPHA)
    return float(chdtrc(tests - 1, limit * variance / (variance + t * t)))


def paper() -> list[LikelihoodMixture]:
    """Return the paper's tests with the scatter of normal inputs."""
    return [normal(centre, 0.417) for centre in PAPER]


def test_bayes_factor_of_the_papers_depths():
    posterior = Posterior.of(paper())
    assert posterior.bayes_factor() == pytest.approx(0.82, abs=0.03)
    low, low_90, middle, high_90, high = posterior.scatter((0.025, 0.05, 0.5, 0.95, 0.975))
    assert (low_90, middle, high_90) == pytest.approx((0.04, 0.35, 0.89), abs=0.01)
    assert (low, high) == pytest.approx((0.02, 1.02), abs=0.01)


def test_papers_depths_are_undecided():
    design = Design(paper())
    random = design.ratio(PAPER) > design.quantile
    assert word(random, Posterior.of(paper()).scatter([0.95])[0], 0.2) == "undecided"


def test_flat_prior_of_m_gives_the_closed_form():
    # with m integrated, the likelihood of t follows from the sum of squares alone
    posterior = Posterior.of(paper())
    variance = posterior.t**2 + 0.417**2
    squares = ((PAPER - PAPER.mean()) ** 2).sum()
    expected = np.exp(-0.5 * squares / variance) / variance
    found = posterior.evidence()
    assert found / found[0] == pytest.approx(expected / expected[0], rel=2e-3)


@pytest.mark.parametrize("tests", [3, 8, 20])
def test_verdict_has_its_error_rate_and_the_ideal_power(tests: int):
    middles = (np.arange(256) + 0.5) / 256
    kernel = LikelihoodMixture.of(np.zeros(256), 0.417 * ndtri(middles), np.full(256, 0.01))
    design = Design([kernel], tests, sets=2000)
    assert design.rates(0.0)[0] <= 0.07
    ideal = normal_power(tests, 0.417**2, 0.4)
    assert design.rates(0.4)[0] == pytest.approx(ideal, abs=0.05)


def test_measured_inputs_give_explained_only_where_it_is_true():
    design = Design([normal(0.0, 0.1)], 20, sets=1000)
    assert design.rates(0.0)[1] >= 0.8
    assert design.rates(0.4)[1] <= 0.05


def test_power_of_the_variance_test_as_published():
    powers = [normal_power(n, 0.417**2, 0.4) for n in (3, 10, 40)]
    assert powers == pytest.approx([0.21, 0.46, 0.90], abs=0.01)
    assert normal_power(3, 0.1**2, 0.4) == pytest.approx(0.84, abs=0.005)


def test_needed_tests_are_those_of_the_closed_form_for_normal_values():
    # the closed form has a power of 0.8 from 29 tests on
    assert normal_power(28, 0.417**2, 0.4) < 0.8 < normal_power(29, 0.417**2, 0.4)
    assert Power([normal(0.0, 0.417)], sets=500).needed(0.4) == pytest.approx(29, abs=3)
    assert Power([normal(0.0, 1.0)], sets=200).needed(1e-3) is None


def test_more_tests_repeat_the_given_ones():
    given = [normal(0.0, 0.1), normal(0.0, 0.8)]
    found = Design(given, 4, sets=500).simulated(0.0, "null").std(axis=0)
    assert found == pytest.approx([0.1, 0.8, 0.1, 0.8], rel=0.15)


def test_small_detected_scatter_is_negligible():
    # forty tests with a scatter of 0.05 and precise inputs show it, and that it is negligible
    centres = 0.05 * ndtri((np.arange(40) + 0.5) / 40)
    kernels = [normal(centre, 0.005) for centre in centres]
    design, posterior = Design(kernels, sets=500), Posterior.of(kernels)
    upper = posterior.scatter([0.95])[0]
    assert design.ratio(centres) > design.quantile
    assert word(True, upper, 0.2) == "explained"
    assert word(True, upper, 0.02) == "random"
    decision = design.decide(centres[None])
    assert (bool(decision.random[0]), bool(decision.explained[0])) == (False, True)


def test_smoothing_keeps_mean_and_variance_of_the_draws():
    rng = np.random.default_rng(4)
    centre, std = rng.gamma(2.0, 0.3, 60), np.full(60, 0.02)
    kernel = LikelihoodMixture.of(np.zeros(60), centre, std)
    assert kernel.mean == pytest.approx(centre.mean())
    assert kernel.variance == pytest.approx(centre.var() + 0.02**2)
    assert kernel.effective_size == pytest.approx(60.0)


def test_deviations_follow_the_likelihood():
    rng = np.random.default_rng(5)
    kernel = LikelihoodMixture(np.array([0.7, 0.3]), np.array([0.0, 1.0]), np.array([0.1, 0.2]))
    found = kernel.deviations(rng.random((2, 100_000)))
    assert found.mean() == pytest.approx(0.0, abs=0.01)
    assert found.std() == pytest.approx(kernel.variance**0.5, rel=0.01)
    # the true value lies below the apparent one where the part at 1 is true
    assert np.mean(found < -0.2) == pytest.approx(0.3, abs=0.01)


def test_next_specimen_scatters_more_than_the_mean():
    posterior = Posterior.of([normal(centre, 0.05) for centre in (-0.4, 0.0, 0.4, 0.1, -0.1)])
    mean, following = (np.diff(f((0.025, 0.975)))[0] for f in (posterior.mean, posterior.next))
    assert mean == pytest.approx(0.6, abs=0.25)
    assert following > 1.7 * mean

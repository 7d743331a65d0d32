"""Demonstration tests: numbers of specimens against closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.stats import binom

from wearsim.uq.distributions.base import Distribution
from wearsim.uq.distributions.two_levels import TwoLevels
from wearsim.uq.survival.demonstration import drawn_lives, pass_probability, specimens
from wearsim.uq.survival.distributions import CountedLives, FactorMixture
from wearsim.uq.survival.scores import score_function
from wearsim.uq.survival.two_levels import UncertainLives

R, C, SHAPE = 0.9, 0.95, 2.3


class OfWeibull(Distribution):
    """Wear factor with which lives of kappa = 1 have a Weibull distribution of scale 1."""

    def quantile(self, probability):
        with np.errstate(divide="ignore"):
            return (-np.log(probability)) ** (-1.0 / SHAPE)


def test_29_specimens_without_failure_show_90_percent():
    assert specimens(C, np.array([R])) == 29
    assert [specimens(C, np.array([R]), k) for k in (1, 2, 3)] == [46, 61, 76]


@pytest.mark.parametrize("failures", [0, 1, 4])
def test_fewest_specimens_have_the_confidence(failures):
    for survival in (0.5, 0.93, 0.999):
        count = specimens(C, np.array([survival]), failures)
        assert binom.cdf(failures, count, 1.0 - survival) <= 1.0 - C
        assert binom.cdf(failures, count - 1, 1.0 - survival) > 1.0 - C


@pytest.mark.parametrize("ratio", [0.5, 1.0, 1.5, 3.0])
def test_duration_replaces_specimens_by_the_shape_of_weibull(ratio):
    lives = FactorMixture(np.ones(1), score_function(OfWeibull()), exact=True)
    drawn = drawn_lives(lives, None)
    survived = 1.0 - drawn.failed(drawn.log_quantile(1.0 - R) + math.log(ratio))
    expected = math.log(1.0 - C) / (ratio**SHAPE * math.log(R))
    assert math.log(1.0 - C) / math.log(survived[0]) == pytest.approx(expected, rel=1e-3)
    assert specimens(C, survived) == math.ceil(expected)


def test_unknown_shape_takes_the_mean_of_the_probability():
    survived = np.array([0.6, 0.9])
    count = specimens(C, survived)
    assert np.mean(survived**count) <= 1.0 - C < np.mean(survived ** (count - 1))
    assert specimens(C, np.array([math.nan, 0.9])) is None
    assert specimens(C, np.array([1.0 - 1e-9])) is None


def test_probability_of_passing_is_binomial():
    found = pass_probability(29, 1, np.array([0.02, 0.1]))
    assert found == pytest.approx(binom.cdf(1, 29, [0.02, 0.1]))


def test_posterior_enters_by_its_scatter_alone_in_the_shape():
    m, t = np.array([-25.5, -25.0, -24.5]), np.full(3, 0.4)
    levels = TwoLevels(m, t, np.ones(3))
    mixture = FactorMixture(np.full(2, 1e-5), score_function(levels))
    drawn = drawn_lives(mixture, UncertainLives(mixture, levels))
    scale = drawn.log_quantile(1.0 - R)
    # the life differs by m, and survival of twice that life does not
    assert np.ptp(scale) == pytest.approx(1.0, abs=1e-6)
    assert np.ptp(drawn.failed(scale + math.log(2.0))) < 1e-6


def test_counted_lives_are_known_up_to_their_censoring():
    lives = np.append(np.arange(1.0, 9.0), [np.inf, np.inf])
    drawn = drawn_lives(CountedLives(lives), None, 8.0)
    assert drawn.failed(np.full(200, math.log(4.5))).mean() == pytest.approx(0.4, abs=0.05)
    assert np.isnan(drawn.failed(np.full(200, math.log(9.0)))).all()
    assert np.isnan(drawn.log_quantile(0.95)).any()

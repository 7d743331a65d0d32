"""Weighted distributions and fractional ranks, against numpy, scipy and integer ranks."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import given, strategies as st
from scipy import stats

from wearsim.uq.estimation.estimates import WeightedDistribution
from wearsim.uq.estimation.moments import fractional_ranks, order_ranks


@given(st.integers(1, 100_000), st.floats(0.001, 0.999))
def test_integer_ranks_enclose_fractional_ranks(count, probability):
    low, high = fractional_ranks(count, probability)
    least, greatest = order_ranks(count, probability)
    assert least - 1e-6 <= low <= least + 1.0 + 1e-6
    assert greatest - 1.0 - 1e-6 <= high <= greatest + 1e-6


@pytest.mark.parametrize(("count", "probability"), [(50, 0.5), (12.5, 0.3), (4000.0, 0.975)])
def test_fractional_ranks_miss_equally_often_on_both_sides(count, probability):
    low, high = fractional_ranks(count, probability)
    # the probability below rank r has the beta distribution of r and count - r + 1
    assert stats.beta(low, count - low + 1).sf(probability) == pytest.approx(0.025, rel=1e-6)
    assert stats.beta(high, count - high + 1).cdf(probability) == pytest.approx(0.025, rel=1e-6)


@pytest.mark.parametrize("probability", [0.0, 0.025, 0.3, 0.5, 0.99, 1.0])
@pytest.mark.parametrize("count", [1, 2, 7, 100])
def test_equal_weights_give_numpys_quantiles(count, probability):
    values = np.random.default_rng(count).random(count)
    known = pytest.approx(np.quantile(values, probability), rel=1e-12)
    assert WeightedDistribution(values).quantile(probability) == known
    assert WeightedDistribution(values, np.full(count, 1.0 / count)).quantile(probability) == known


def test_level_is_a_rank_and_infinite_beyond_the_ends():
    distribution = WeightedDistribution(np.array([3.0, 1.0, 2.0, 4.0]))
    assert [distribution.at(rank / 5.0) for rank in (1, 2, 2.5, 4)] == pytest.approx(
        [1.0, 2.0, 2.5, 4.0]
    )
    assert (distribution.at(0.99 / 5.0), distribution.at(4.01 / 5.0)) == (-math.inf, math.inf)


def test_value_of_double_weight_counts_twice():
    weights = np.array([1.0, 2.0, 1.0]) / 4.0
    distribution, plain = (
        WeightedDistribution(np.array([1.0, 2.0, 3.0]), weights),
        np.array([1.0, 2.0, 2.0, 3.0]),
    )
    assert distribution.quantile(0.5) == pytest.approx(np.median(plain))


def test_quantiles_increase_with_negative_weights():
    rng = np.random.default_rng(8)
    weights = rng.normal(0.02, 0.03, 50)
    distribution = WeightedDistribution(rng.random(50), weights / weights.sum())
    assert weights.min() < 0.0
    levels = np.linspace(0.01, 0.99, 99)
    assert (np.diff([distribution.quantile(level) for level in levels]) >= 0.0).all()
    inner = [distribution.at(level) for level in levels]
    assert all(one <= other for one, other in itertools.pairwise(inner))

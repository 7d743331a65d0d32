"""Weighted laws and ranks between ranks, against numpy, scipy and whole ranks."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from wearsim.uq.estimation.moments import order_ranks
from wearsim.uq.estimation.quantiles import WeightedDistribution, fractional_ranks


@given(st.integers(1, 100_000), st.floats(0.001, 0.999))
def test_that_whole_ranks_are_the_next_ones_outside(count, probability):
    low, high = fractional_ranks(count, probability)
    least, greatest = order_ranks(count, probability)
    assert least - 1e-6 <= low <= least + 1.0 + 1e-6
    assert greatest - 1.0 - 1e-6 <= high <= greatest + 1e-6


@pytest.mark.parametrize(("count", "probability"), [(50, 0.5), (12.5, 0.3), (4000.0, 0.975)])
def test_that_each_end_is_missed_by_half_of_what_the_confidence_leaves(count, probability):
    low, high = fractional_ranks(count, probability)
    # the part below the value of rank r follows the beta law of r and count - r + 1
    assert stats.beta(low, count - low + 1).sf(probability) == pytest.approx(0.025, rel=1e-6)
    assert stats.beta(high, count - high + 1).cdf(probability) == pytest.approx(0.025, rel=1e-6)


@pytest.mark.parametrize("probability", [0.0, 0.025, 0.3, 0.5, 0.99, 1.0])
@pytest.mark.parametrize("count", [1, 2, 7, 100])
def test_that_equal_weights_give_numpys_quantiles(count, probability):
    values = np.random.default_rng(count).random(count)
    known = pytest.approx(np.quantile(values, probability), rel=1e-12)
    assert WeightedDistribution(values).quantile(probability) == known
    assert WeightedDistribution(values, np.full(count, 1.0 / count)).quantile(probability) == known


def test_that_a_level_is_a_rank_and_there_is_nothing_beyond_the_ends():
    law = WeightedDistribution(np.array([3.0, 1.0, 2.0, 4.0]))
    assert [law.at(rank / 5.0) for rank in (1, 2, 2.5, 4)] == pytest.approx([1.0, 2.0, 2.5, 4.0])
    assert (law.at(0.99 / 5.0), law.at(4.01 / 5.0)) == (-math.inf, math.inf)


def test_that_a_value_of_twice_the_weight_counts_as_two():
    weights = np.array([1.0, 2.0, 1.0]) / 4.0
    law, plain = (
        WeightedDistribution(np.array([1.0, 2.0, 3.0]), weights),
        np.array([1.0, 2.0, 2.0, 3.0]),
    )
    assert law.quantile(0.5) == pytest.approx(np.median(plain))


def test_that_negative_weights_let_no_quantile_fall():
    rng = np.random.default_rng(8)
    weights = rng.normal(0.02, 0.03, 50)
    law = WeightedDistribution(rng.random(50), weights / weights.sum())
    assert weights.min() < 0.0
    levels = np.linspace(0.01, 0.99, 99)
    assert (np.diff([law.quantile(level) for level in levels]) >= 0.0).all()
    inner = [law.at(level) for level in levels]
    assert all(one <= other for one, other in itertools.pairwise(inner))

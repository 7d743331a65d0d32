"""Moments and their standard errors, against closed forms, scipy and repeated sampling."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, strategies as st
from scipy import stats

from wearsim.uq.estimation.moments import RowMoments, converge, is_constant, order_ranks, summarise


def _coverage(count: int, probability: float, low: int, high: int) -> float:
    """Return the probability that the quantile is between two order statistics."""
    below = stats.binom(count, probability)
    return float(below.cdf(high - 1) - below.cdf(low - 1))


def test_median_of_ten_is_between_second_and_ninth():
    assert order_ranks(10, 0.5) == (2, 9)  # 97.85 %: textbook table
    assert _coverage(10, 0.5, 2, 9) == pytest.approx(1 - 22 / 1024)


@given(st.integers(1, 100_000), st.floats(0.001, 0.999), st.sampled_from([0.8, 0.95, 0.99]))
def test_order_ranks_are_the_narrowest_with_the_confidence(count, probability, confidence):
    low, high = order_ranks(count, probability, confidence)
    assert 0 <= low < high <= count + 1
    below, miss = stats.binom(count, probability), 0.5 * (1 - confidence)
    assert below.cdf(low - 1) <= miss * (1 + 1e-9)
    assert below.sf(high - 1) <= miss * (1 + 1e-9)
    assert below.cdf(low) > miss * (1 - 1e-9)
    if high > 1:
        assert below.sf(high - 2) > miss * (1 - 1e-9)


def test_quantile_intervals_have_the_exact_coverage():
    rng, distribution, held = np.random.default_rng(4), stats.expon(), 0
    for _ in range(1000):
        found = summarise(rng.exponential(size=150), (0.9,)).quantile(0.9)
        held += found.low <= distribution.ppf(0.9) <= found.high
    low, high = order_ranks(150, 0.9)
    expected = _coverage(150, 0.9, low, high)
    assert 0.95 <= expected < 0.98
    assert held / 1000 == pytest.approx(
        expected, abs=4 * math.sqrt(expected * (1 - expected) / 1000)
    )


def test_interval_end_is_infinite_for_too_few_realisations():
    found = summarise(np.arange(20.0), (0.025, 0.5, 0.975))
    assert found.quantile(0.025).low == -math.inf
    assert found.quantile(0.975).high == math.inf
    assert 0.0 <= found.quantile(0.5).low < found.quantile(0.5).high <= 19.0


def test_summary_agrees_with_numpy_and_scipy():
    values = np.random.default_rng(1).gamma(3.0, 0.03, size=777)
    found = summarise(values, (0.25,))
    assert found.count == 777
    assert found.mean == pytest.approx(values.mean(), rel=1e-13)
    assert found.std == pytest.approx(values.std(ddof=1), rel=1e-12)
    assert found.mean_error == pytest.approx(stats.sem(values), rel=1e-12)
    assert found.skewness == pytest.approx(stats.skew(values, bias=False), rel=1e-11)
    assert (found.least, found.greatest) == (values.min(), values.max())
    assert found.quantile(0.25).value == np.quantile(values, 0.25)


@pytest.mark.parametrize(
    ("draw", "kurtosis"), [("standard_normal", 3.0), ("standard_exponential", 9.0)]
)
def test_std_error_follows_the_fourth_moment(draw, kurtosis):
    n = 400_000
    found = summarise(getattr(np.random.default_rng(2), draw)(n))
    assert found.std_error == pytest.approx(math.sqrt((kurtosis - 1) / (4 * n)), rel=0.02)


def test_std_error_agrees_with_repeated_sampling():
    rows = np.random.default_rng(3).gamma(4.0, size=(2000, 200))
    spread = rows.std(axis=1, ddof=1).std()
    typical = np.mean([summarise(row).std_error for row in rows])
    assert typical == pytest.approx(spread, rel=0.06)


def test_one_realisation_has_a_mean_and_no_std():
    found = summarise(np.array([0.07]), (0.5,))
    assert (found.count, found.mean) == (1, 0.07)
    assert np.isnan([found.std, found.mean_error, found.std_error, found.skewness]).all()


def test_equal_realisations_have_zero_std():
    found = summarise(np.full(9, 0.07))
    assert (found.std, found.mean_error, found.std_error) == (0.0, 0.0, 0.0)
    assert math.isnan(found.skewness)


def test_convergence_equals_summaries_of_partial_samples():
    values = 300.0 + np.random.default_rng(5).standard_normal(60)
    found = converge(values, np.arange(1, 61))
    assert math.isnan(found.std[0])
    for n in range(2, 61):
        own = summarise(values[:n])
        seen = [part[n - 1] for part in (found.mean, found.mean_error, found.std, found.std_error)]
        assert seen == pytest.approx([own.mean, own.mean_error, own.std, own.std_error], rel=1e-9)


@pytest.mark.parametrize("batch", [1, 7, 256, 300, 1000])
def test_row_moments_are_independent_of_the_batch_size(batch):
    rows = 1e3 + np.random.default_rng(6).standard_normal((1000, 5))
    found, whole = RowMoments(5), RowMoments(5)
    for first in range(0, 1000, batch):
        found.add(rows[first : first + batch])
    whole.add(rows)
    for one, other in zip(found.mean_and_std(), whole.mean_and_std(), strict=True):
        assert one.tobytes() == other.tobytes()
    mean, std = found.mean_and_std()
    np.testing.assert_allclose(mean, rows.mean(axis=0), rtol=1e-14)
    np.testing.assert_allclose(std, rows.std(axis=0, ddof=1), rtol=1e-12)


def test_reading_row_moments_does_not_change_them():
    rows = np.random.default_rng(7).standard_normal((300, 2))
    found = RowMoments(2)
    found.add(rows[:100])
    assert found.mean_and_std()[0] == pytest.approx(rows[:100].mean(axis=0))
    found.add(rows[100:])
    assert found.mean_and_std()[1] == pytest.approx(rows.std(axis=0, ddof=1))
    one = RowMoments(2)
    one.add(rows[:1])
    assert np.isnan(one.mean_and_std()[1]).all()


def test_values_that_differ_by_rounding_are_constant() -> None:
    rounded = summarise(np.array([0.1, 0.1, np.nextafter(0.1, 1.0)]))
    assert rounded.is_constant
    assert math.isnan(rounded.skewness)
    assert not summarise(np.array([0.1, 0.1 + 1e-8])).is_constant
    assert not summarise(np.array([0.1])).is_constant
    assert not is_constant(0.0, 1e-15)
    assert is_constant(0.0, 1e-15, rounding=1e-14)

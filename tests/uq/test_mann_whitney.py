"""Comparison of ensembles, against scipy's Mann-Whitney statistic and normal distributions."""

import math

import numpy as np
import pytest
from scipy import stats
from scipy.special import ndtr

from wearsim.uq.estimation.intervals import UNKNOWN, Interval
from wearsim.uq.estimation.mann_whitney import paired, superiority


def test_superiority_is_the_mann_whitney_statistic():
    rng = np.random.default_rng(1)
    first, second = rng.integers(0, 9, 40).astype(float), rng.integers(0, 7, 25).astype(float)
    known = stats.mannwhitneyu(first, second).statistic / (40 * 25)
    found = superiority(first, second)
    assert found.value == pytest.approx(known)
    turned = superiority(second, first)
    assert [turned.value, turned.low, turned.high] == pytest.approx(
        [1.0 - found.value, 1.0 - found.high, 1.0 - found.low]
    )


@pytest.mark.parametrize(
    ("shift", "spread", "sizes"),
    [(0.0, 1.0, (50, 50)), (1.0, 1.0, (100, 40)), (0.5, 3.0, (40, 200)), (2.6, 1.0, (60, 60))],
)
def test_superiority_intervals_have_their_coverage(shift, spread, sizes):
    rng, known, held = np.random.default_rng(2), ndtr(shift / math.hypot(1.0, spread)), 0
    for _ in range(500):
        first = shift + spread * rng.standard_normal(sizes[0])
        found = superiority(first, rng.standard_normal(sizes[1]))
        held += found.low <= known <= found.high
    # above 0.9 the interval is too wide
    assert 0.93 <= held / 500 <= (0.975 if known < 0.9 else 1.0)


@pytest.mark.parametrize("count", [5, 20, 500])
def test_separated_ensembles_have_intervals_of_finite_width(count):
    values = np.arange(count, dtype=float)
    found = superiority(values + count, values)
    assert (found.value, found.high) == (1.0, 1.0)
    # the interval excludes values for which some pair of the other order would be expected
    assert 1.0 - 6.0 / count < found.low < 1.0 - 1.0 / count
    below = superiority(values, values + count)
    assert [below.value, below.low, below.high] == pytest.approx([0.0, 0.0, 1.0 - found.low])


def test_equal_constant_ensembles_give_one_half():
    assert superiority(np.full(8, 0.1), np.full(5, 0.1)) == Interval(0.5, 0.5, 0.5)


def test_fewer_than_five_values_are_unknown():
    assert superiority(np.arange(4.0), np.arange(50.0)) == UNKNOWN


def test_paired_difference_has_the_textbook_interval():
    rng = np.random.default_rng(3)
    common = rng.standard_normal(60)
    first, second = common + 0.1 * rng.random(60), common
    found = paired(first, second)
    known = stats.ttest_rel(first, second).confidence_interval()
    assert [found.difference.low, found.difference.high] == pytest.approx([known.low, known.high])
    share = stats.binomtest(60, 60).proportion_ci(method="wilson")
    assert [found.share.low, found.share.high] == pytest.approx([share.low, share.high])
    assert (found.share.value, found.count) == (1.0, 60)


def test_equal_pairs_count_one_half():
    found = paired(np.array([1.0, 2.0, 3.0, 4.0]), np.array([0.0, 2.0, 3.0, 5.0]))
    assert found.share.value == 0.5


def test_paired_sobol_differences_use_the_replicates():
    replicate = np.arange(64) % 8
    means = np.array([1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0])
    found = paired(means[replicate], np.zeros(64), "sobol", replicate)
    low, high = stats.t.interval(0.95, 7, means.mean(), stats.sem(means))
    assert [found.difference.low, found.difference.high] == pytest.approx([low, high])


def test_no_pairs_are_unknown_and_unequal_numbers_refused():
    empty = paired(np.array([]), np.array([]))
    assert math.isnan(empty.difference.value)
    assert (empty.share, empty.count) == (UNKNOWN, 0)
    with pytest.raises(ValueError, match="got 3 and 4"):
        paired(np.zeros(3), np.zeros(4))

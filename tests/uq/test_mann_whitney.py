"""Which ensemble is greater, against scipy's Mann-Whitney statistic and normal laws."""

import math

import numpy as np
import pytest
from scipy import stats
from scipy.special import ndtr

from wearsim.uq.estimation.intervals import UNKNOWN, Interval
from wearsim.uq.estimation.mann_whitney import paired, superiority


def test_that_it_is_the_mann_whitney_statistic_with_ties_by_half():
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
def test_that_intervals_hold_the_chance(shift, spread, sizes):
    rng, known, held = np.random.default_rng(2), ndtr(shift / math.hypot(1.0, spread)), 0
    for _ in range(500):
        first = shift + spread * rng.standard_normal(sizes[0])
        found = superiority(first, rng.standard_normal(sizes[1]))
        held += found.low <= known <= found.high
    # beyond 0.9 the interval errs on the wide side
    assert 0.93 <= held / 500 <= (0.975 if known < 0.9 else 1.0)


@pytest.mark.parametrize("count", [5, 20, 500])
def test_that_ensembles_apart_are_certain_only_as_far_as_there_are_values(count):
    apart = np.arange(count, dtype=float)
    found = superiority(apart + count, apart)
    assert (found.value, found.high) == (1.0, 1.0)
    # even odds of seeing no other order of any pair are far beyond what was seen
    assert 1.0 - 6.0 / count < found.low < 1.0 - 1.0 / count
    below = superiority(apart, apart + count)
    assert [below.value, below.low, below.high] == pytest.approx([0.0, 0.0, 1.0 - found.low])


def test_that_the_same_value_throughout_is_neither_greater():
    assert superiority(np.full(8, 0.1), np.full(5, 0.1)) == Interval(0.5, 0.5, 0.5)


def test_that_a_handful_of_values_tells_nothing():
    assert superiority(np.arange(4.0), np.arange(50.0)) == UNKNOWN


def test_that_pairs_differ_by_the_textbooks_interval():
    rng = np.random.default_rng(3)
    common = rng.standard_normal(60)
    first, second = common + 0.1 * rng.random(60), common
    found = paired(first, second)
    known = stats.ttest_rel(first, second).confidence_interval()
    assert [found.difference.low, found.difference.high] == pytest.approx([known.low, known.high])
    share = stats.binomtest(60, 60).proportion_ci(method="wilson")
    assert [found.share.low, found.share.high] == pytest.approx([share.low, share.high])
    assert (found.share.value, found.count) == (1.0, 60)


def test_that_equal_pairs_count_by_half():
    found = paired(np.array([1.0, 2.0, 3.0, 4.0]), np.array([0.0, 2.0, 3.0, 5.0]))
    assert found.share.value == 0.5


def test_that_pairs_of_a_sobol_plan_differ_by_its_replicates():
    replicate = np.arange(64) % 8
    apart = np.array([1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0])
    found = paired(apart[replicate], np.zeros(64), "sobol", replicate)
    low, high = stats.t.interval(0.95, 7, apart.mean(), stats.sem(apart))
    assert [found.difference.low, found.difference.high] == pytest.approx([low, high])


def test_that_no_pairs_tell_nothing_and_odd_ones_are_refused():
    empty = paired(np.array([]), np.array([]))
    assert math.isnan(empty.difference.value)
    assert empty.share == UNKNOWN
    with pytest.raises(ValueError, match="got 3 and 4"):
        paired(np.zeros(3), np.zeros(4))

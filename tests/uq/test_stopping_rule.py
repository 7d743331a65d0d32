"""Targets: how they are read and when they are reached."""

import math

import numpy as np
import pytest

from wearsim.uq.estimation.estimates import estimate
from wearsim.uq.estimation.stopping_rule import Target


@pytest.mark.parametrize(
    ("text", "target"),
    [
        ("depth.mean 1%", Target("depth", "mean", 0.01)),
        (" worn_volume.std  2.5 % ", Target("worn_volume", "std", 0.025)),
        ("depth.median 5%", Target("depth", 0.5, 0.05)),
        ("width.q97.5 .5%", Target("width", 0.975, 0.005)),
    ],
)
def test_that_a_target_is_read_and_told(text, target):
    assert Target.parse(text) == target
    assert Target.parse(str(target)) == target


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("", "cannot read the target"),
        ("depth 1%", "expected observable.statistic and a half-width"),
        ("depth.mean", "cannot read"),
        ("depth.mean 1", "cannot read"),
        ("depth.mode 1%", "the statistic is mean, std, median"),
        ("depth.mean 0%", "has no width"),
        ("depth.q0 1%", "above q0 and below q100"),
        ("depth.q100 1%", "above q0 and below q100"),
    ],
)
def test_that_what_is_no_target_is_refused(text, told):
    with pytest.raises(ValueError, match=told):
        Target.parse(text)


def test_that_a_target_is_reached_where_its_half_width_is_small_enough():
    values = 1.0 + 0.1 * np.random.default_rng(1).standard_normal(400)
    found = estimate(values, (0.9,))
    for statistic, interval in (
        ("mean", found.mean),
        ("std", found.std),
        (0.9, found.quantile(0.9)),
    ):
        achieved = interval.half_width / interval.value
        target = Target("depth", statistic, achieved * 1.001)
        assert target.achieved(found) == pytest.approx(achieved)
        assert target.reached(found)
        assert not Target("depth", statistic, achieved * 0.999).reached(found)


def test_that_the_quantile_of_a_target_is_the_one_its_estimate_needs():
    assert Target("depth", 0.9, 0.1).probabilities == (0.9,)
    assert Target("depth", "std", 0.1).probabilities == ()


@pytest.mark.parametrize("values", [np.array([]), np.array([1.0]), np.array([-1.0, 1.0])])
def test_that_what_is_unknown_or_about_zero_is_far_off(values):
    assert Target("depth", "mean", 0.5).achieved(estimate(values)) == math.inf


def test_that_values_all_the_same_reach_any_target_though_not_a_few_of_them():
    target = Target("depth", "mean", 1e-9)
    assert target.reached(estimate(np.zeros(32)))
    assert not target.reached(estimate(np.zeros(31)))

"""Targets of the stopping rule: parsing, and when they are reached."""

import math

import numpy as np
import pytest

from wearsim.uq.estimation.estimates import Target, estimate


@pytest.mark.parametrize(
    ("text", "target"),
    [
        ("depth.mean 1%", Target("depth", "mean", 0.01)),
        (" worn_volume.std  2.5 % ", Target("worn_volume", "std", 0.025)),
        ("depth.median 5%", Target("depth", 0.5, 0.05)),
        ("width.q97.5 .5%", Target("width", 0.975, 0.005)),
    ],
)
def test_target_is_parsed_and_written(text, target):
    assert Target.parse(text) == target
    assert Target.parse(str(target)) == target


@pytest.mark.parametrize(
    ("text", "message"),
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
def test_invalid_targets_are_refused(text, message):
    with pytest.raises(ValueError, match=message):
        Target.parse(text)


def test_target_is_reached_at_its_half_width():
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


def test_target_lists_the_quantiles_it_needs():
    assert Target("depth", 0.9, 0.1).probabilities == (0.9,)
    assert Target("depth", "std", 0.1).probabilities == ()


@pytest.mark.parametrize("values", [np.array([]), np.array([1.0]), np.array([-1.0, 1.0])])
def test_unknown_or_zero_estimate_is_infinitely_far(values):
    assert Target("depth", "mean", 0.5).achieved(estimate(values)) == math.inf


def test_constant_values_reach_any_target_from_32_on():
    target = Target("depth", "mean", 1e-9)
    assert target.reached(estimate(np.zeros(32)))
    assert not target.reached(estimate(np.zeros(31)))

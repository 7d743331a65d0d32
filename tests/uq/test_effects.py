"""Effects of inputs on a value: sign, size and coverage of the intervals."""

import numpy as np
import pytest

from wearsim.uq.sensitivity.effects import effects, exact_effect

SCORE = 1.2815515655446004  # of the 90 % quantile


def sample(seed, count=60, noise=1.0):
    """Return ln of a value with two inputs of effect 0.1 and -0.05, and another of effect 0.5."""
    a, b, c, rest = np.random.default_rng(seed).normal(size=(4, count))
    values = 0.1 * a - 0.05 * b + 0.5 * c + 0.02 * noise * rest
    return values, {"a": a[:, None], "b": b[:, None], "c": c[:, None]}


def test_intervals_cover_the_effects_in_19_of_20_samples():
    covered = []
    for seed in range(300):
        found = effects(*sample(seed))
        for name, slope in (("a", 0.1), ("b", -0.05), ("c", 0.5)):
            high = found[name].high
            covered.append(high.low <= slope * SCORE <= high.high)
    assert 0.92 < np.mean(covered) < 0.99


def test_effects_have_a_sign_and_others_add_no_noise():
    found = effects(*sample(1))
    assert {name: found[name].sign for name in "abc"} == {"a": 1, "b": -1, "c": 1}
    # the input of effect 0.5 alone would make it 0.13
    assert found["b"].high.half_width < 0.03
    assert found["b"].high.value == pytest.approx(-0.05 * SCORE, abs=0.03)


def test_input_without_effect_has_no_sign():
    values, groups = sample(2, 200)
    noise = np.random.default_rng(9).normal(size=(200, 1))
    assert effects(values, groups | {"none": noise})["none"].sign == 0


def test_small_samples_are_fitted_by_one_input_at_a_time():
    values, groups = sample(3, 8)
    assert set(effects(values, groups)) == {"a", "b", "c"}
    assert effects(values[:5], {name: numbers[:5] for name, numbers in groups.items()}) == {}


def test_factors_are_those_of_the_value():
    low, high = exact_effect(np.log(2.0), -np.log(2.0)).factors
    assert (low.value, high.value) == pytest.approx((2.0, 0.5), rel=1e-15)
    assert exact_effect(0.5, -0.5).sign == -1

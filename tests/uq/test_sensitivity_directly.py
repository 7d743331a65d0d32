"""Sobol indices and effects against fits that leave out one realisation after the other."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.polynomial import hermite_e, legendre
from scipy import stats
from scipy.special import ndtri

from wearsim.uq.distributions.base import Distribution
from wearsim.uq.estimation.intervals import UNKNOWN, Interval
from wearsim.uq.sensitivity.effects import SignedEffect, effects, exact_effect, normal_scores
from wearsim.uq.sensitivity.sobol_indices import (
    fewest_realisations,
    first_order,
    saltelli_indices,
    without_effect,
)

Z = 1.959963984540054


def parts(found: Interval) -> list[float]:
    """Return value and ends."""
    return [found.value, found.low, found.high]


def left_out(design: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Return the error of each value by a fit to the others."""
    errors = []
    for k in range(len(values)):
        others = np.arange(len(values)) != k
        slopes = np.linalg.lstsq(design[others], values[others], rcond=None)[0]
        errors.append(values[k] - design[k] @ slopes)
    return np.array(errors)


def index_of(values: np.ndarray, numbers: np.ndarray, powers: list, ends: list) -> list[float]:
    """Return the first-order index and its interval, from fits with the first terms of a list."""
    count = len(values)
    ranks = (stats.rankdata(numbers, axis=0) - 0.5) / count
    deviation, found = values - values.mean(), []
    for basis, scores in (
        (hermite_e.hermeval, ndtri(ranks)),
        (legendre.legval, 2.0 * ranks - 1.0),
    ):
        terms = [
            np.prod(
                [basis(column, np.eye(9)[p]) for column, p in zip(scores.T, power, strict=True)],
                axis=0,
            )
            for power in powers
        ]
        for end in ends:
            design = np.column_stack(terms[:end])
            away = left_out(design, deviation)
            fit = design @ np.linalg.lstsq(design, deviation, rcond=None)[0]
            found.append(((away**2).mean(), end, deviation - fit, away))
    _, terms, residual, away = min(found, key=lambda one: one[0])
    variance = values.var(ddof=1)
    left = (deviation @ away) / (count - 1) / variance
    influence = (residual * away - left * deviation**2) / variance
    error = math.sqrt(influence.var() / count + 2.0 * (terms - 1) * (left / count) ** 2)
    ends_of = [1.0 - left, 1.0 - left - Z * error, 1.0 - left + Z * error]
    return [min(max(end, 0.0), 1.0) for end in ends_of]


ONE = [(k,) for k in range(9)]
TWO = [(0, 0), (1, 0), (0, 1), (2, 0), (0, 2), (1, 1)]  # by degree, then by number of factors
TWO += [(3, 0), (0, 3), (2, 1), (1, 2), (4, 0), (0, 4)]
THREE = [
    tuple(row)
    for row in np.vstack([np.zeros(3, int), np.eye(3, dtype=int), 2 * np.eye(3, dtype=int)])
]
THREE += [(1, 1, 0), (1, 0, 1), (0, 1, 1)]


@pytest.mark.parametrize("shape", [np.sin, np.exp, lambda x: x**3, lambda x: 0.02 * x])
def test_index_of_one_number_is_that_of_the_best_polynomial(shape) -> None:
    rng = np.random.default_rng(1)
    x = rng.standard_normal((47, 1))
    values = shape(2.0 * x[:, 0]) + 0.3 * rng.standard_normal(47)
    found = first_order(values, {"x": x})["x"]  # five terms for 47 realisations
    assert parts(found) == pytest.approx(index_of(values, x, ONE, [3, 4, 5]), abs=1e-6)


def test_index_of_several_numbers_has_products_by_their_degree() -> None:
    rng = np.random.default_rng(2)
    x = rng.standard_normal((104, 2))
    for values in (x[:, 0] * x[:, 1], x[:, 0] ** 4 - x[:, 1], x[:, 0] ** 2 * x[:, 1]):
        noisy = values + 0.3 * rng.standard_normal(104)
        found = first_order(noisy, {"x": x})["x"]
        assert parts(found) == pytest.approx(index_of(noisy, x, TWO, [6, 10, 12]), abs=1e-6)
    y = rng.standard_normal((80, 3))
    values = y[:, 0] * y[:, 2] + y[:, 1] + 0.2 * rng.standard_normal(80)
    found = first_order(values, {"y": y})["y"]
    assert parts(found) == pytest.approx(index_of(values, y, THREE, [10]), abs=1e-6)


def test_numbers_of_equal_ranks_add_no_information() -> None:
    rng = np.random.default_rng(8)
    x = rng.standard_normal((200, 1))
    values = np.sin(x[:, 0]) + 0.3 * rng.standard_normal(200)
    alone, both = (first_order(values, {"x": y})["x"] for y in (x, np.hstack([x, x**3])))
    assert both.value == pytest.approx(alone.value, abs=0.02)


def test_number_of_three_values_has_three_terms_and_mean_ranks() -> None:
    rng = np.random.default_rng(3)
    kind = rng.integers(0, 3, (64, 1)).astype(float)
    values = np.array([0.0, 2.0, 1.0])[kind[:, 0].astype(int)] + 0.4 * rng.standard_normal(64)
    found = first_order(values, {"kind": kind})["kind"]
    assert parts(found) == pytest.approx(index_of(values, kind, ONE, [3]), abs=1e-6)


def test_equal_numbers_have_their_mean_rank() -> None:
    rng = np.random.default_rng(9)
    kind = rng.choice(6, (72, 1), p=[0.4, 0.1, 0.2, 0.1, 0.15, 0.05]).astype(float)
    values = np.sin(kind[:, 0]) + 0.4 * rng.standard_normal(72)
    found = first_order(values, {"kind": kind})["kind"]
    assert parts(found) == pytest.approx(index_of(values, kind, ONE, [3, 4, 5, 6]), abs=1e-6)


def test_values_equal_but_for_rounding_have_no_indices() -> None:
    more = np.random.default_rng(10).integers(0, 2, (30, 3))
    blocks = np.where(more, 0.1, np.nextafter(0.1, 1.0))
    none = Interval(0.0, 0.0, 0.0)
    assert saltelli_indices(blocks, ["a"]) == {"a": (none, none)}


def test_fewest_realisations_are_eight_for_each_term() -> None:
    assert [fewest_realisations(k) for k in (1, 2, 6)] == [24, 40, 104]
    x = np.random.default_rng(4).random((40, 2))
    assert first_order(x[:39, 0], {"x": x[:39]})["x"] == UNKNOWN
    assert first_order(x[:, 0] + x[:, 1], {"x": x})["x"].value > 0.9
    assert first_order(x[:1, 0], {"x": x[:1]})["x"] == UNKNOWN
    assert first_order(x[:, 0], {"one": np.ones((40, 1))})["one"] == Interval(0.0, 0.0, 0.0)


def test_effect_counts_as_none_below_one_percent_with_an_interval_that_includes_0() -> None:
    assert without_effect(Interval(0.009, 0.0, 0.02))
    assert not without_effect(Interval(0.01, 0.0, 0.02))
    assert not without_effect(Interval(0.009, 0.001, 0.02))


def ratio(part: np.ndarray, square: np.ndarray) -> list[float]:
    """Return a ratio of means with its interval by the delta method, between 0 and 1."""
    share = part.mean() / square.mean()
    error = stats.sem(part - share * square) / square.mean()
    reach = stats.t.ppf(0.975, len(part) - 1) * error
    return [min(max(end, 0.0), 1.0) for end in (share, share - reach, share + reach)]


def best_weight(first: np.ndarray, second: np.ndarray, square: np.ndarray) -> float:
    """Return the weight of the first numerator of least variance, from the parabola of three."""

    def variance(weight: float) -> float:
        part = weight * first + (1.0 - weight) * second
        return float((part - part.mean() / square.mean() * square).var())

    bend, slope, _ = np.polyfit([0.0, 0.5, 1.0], [variance(w) for w in (0.0, 0.5, 1.0)], 2)
    return min(max(-0.5 * slope / bend, 0.0), 1.0) if bend > 0.0 else 1.0


@pytest.mark.parametrize("bases", [10, 40])
def test_saltelli_indices_are_ratios_of_sums(bases: int) -> None:
    rng = np.random.default_rng(5)
    base, other = 3.0 + rng.standard_normal((2, bases, 3))

    def value(x: np.ndarray) -> np.ndarray:
        return x[:, 0] + 0.5 * x[:, 1] ** 2 * x[:, 2] + 0.01 * x[:, 2]

    blocks = [value(base), value(other)]
    for k in range(3):
        mixed = base.copy()
        mixed[:, k] = other[:, k]
        blocks.append(value(mixed))
    found = saltelli_indices(np.stack(blocks, axis=1), "abc")
    a, b, *ab = np.stack(blocks) - 0.5 * (blocks[0].mean() + blocks[1].mean())
    square = 0.5 * (a**2 + b**2)
    for name, c in zip("abc", ab, strict=True):
        saltelli, jansen = b * (c - a), square - 0.5 * (b - c) ** 2
        weight = best_weight(saltelli, jansen, square)
        first = ratio(weight * saltelli + (1.0 - weight) * jansen, square)
        assert parts(found[name][0]) == pytest.approx(first, abs=1e-9)
        assert parts(found[name][1]) == pytest.approx(ratio(0.5 * (a - c) ** 2, square), abs=1e-9)
    assert saltelli_indices(np.stack(blocks, axis=1)[:9], "abc")["a"] == (UNKNOWN, UNKNOWN)


def test_input_that_causes_all_variance_has_the_index_one() -> None:
    base, other = np.random.default_rng(6).standard_normal((2, 30))
    blocks = np.stack([base, other, other], axis=1)
    one = Interval(1.0, 1.0, 1.0)
    first, total = saltelli_indices(blocks, ["a"])["a"]
    assert parts(first) == pytest.approx(parts(one), abs=1e-12)
    assert total.value == 1.0 or total.low < 1.0 < total.high + 1e-12


def sample(count: int) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Return values with unequal noise of three groups of scores, one with two numbers."""
    rng = np.random.default_rng(7)
    a, b, c = (rng.standard_normal((count, width)) for width in (1, 2, 1))
    values = 0.3 * a[:, 0] - 0.2 * b[:, 0] + 0.4 * b[:, 1] ** 2 + 0.1 * c[:, 0] ** 2
    return values + 0.1 * np.exp(a[:, 0]) * rng.standard_normal(count), {"a": a, "b": b, "c": c}


def hc3(values: np.ndarray, groups: dict[str, np.ndarray]) -> dict[str, list[list[float]]]:
    """Return changes at both quantiles with t intervals, from errors of values left out."""
    columns, places = [np.ones(len(values))], {}
    for name, scores in groups.items():
        places[name] = len(columns), scores.shape[1]
        columns += [*scores.T, *(scores**2).T]
    design = np.column_stack(columns)
    inverse = np.linalg.inv(design.T @ design) @ design.T
    covariance = (inverse * left_out(design, values) ** 2) @ inverse.T
    slopes, found = inverse @ values, {}
    for name, (first, many) in places.items():
        found[name] = []
        for score in (-1.2815515655446004, 1.2815515655446004):
            at = np.zeros(len(slopes))
            at[first : first + many], at[first + many : first + 2 * many] = score, score**2
            reach = stats.t.ppf(0.975, len(values) - len(slopes)) * math.sqrt(at @ covariance @ at)
            change = float(at @ slopes)
            found[name].append([change, change - reach, change + reach])
    return found


def test_effects_have_the_errors_of_values_left_out() -> None:
    values, groups = sample(40)
    found, known = effects(values, groups), hc3(values, groups)
    for name, (low, high) in known.items():
        assert parts(found[name].low) == pytest.approx(low, rel=1e-9)
        assert parts(found[name].high) == pytest.approx(high, rel=1e-9)
        assert found[name].size == pytest.approx(abs(high[0] - low[0]))
    # 9 terms need 18 realisations; with fewer each input is fitted alone, b from 10 on
    values, groups = sample(18)
    assert parts(effects(values, groups)["c"].high) == pytest.approx(hc3(values, groups)["c"][1])
    few = {name: scores[:17] for name, scores in groups.items()}
    alone = hc3(values[:17], {"c": few["c"]})["c"]
    assert parts(effects(values[:17], few)["c"].high) == pytest.approx(alone[1])
    short = {name: scores[:9] for name, scores in groups.items()}
    assert list(effects(values[:9], short)) == ["a", "c"]
    assert list(effects(values[:10], {n: s[:10] for n, s in groups.items()})) == ["a", "b", "c"]


def test_sign_needs_both_changes_beyond_zero_on_different_sides() -> None:
    def sign(low: tuple[float, float], high: tuple[float, float]) -> int:
        return SignedEffect(Interval(sum(low) / 2, *low), Interval(sum(high) / 2, *high)).sign

    assert [sign((-2, -1), (1, 2)), sign((1, 2), (-2, -1))] == [1, -1]
    assert [sign((-2, 0), (1, 2)), sign((-2, -1), (0, 2)), sign((1, 2), (1, 2))] == [0, 0, 0]
    assert [sign((0, 2), (-2, -1)), sign((1, 2), (-2, 0)), sign((-2, 1), (1, 2))] == [0, 0, 0]
    low, high = exact_effect(math.log(2.0), -math.log(4.0)).factors
    assert parts(low) + parts(high) == pytest.approx([2.0] * 3 + [0.25] * 3)
    wide = SignedEffect(Interval(0.0, -1.0, 2.0), Interval(0.5, 0.0, 1.0)).factors
    assert parts(wide[0]) == pytest.approx([1.0, math.exp(-1.0), math.exp(2.0)])


def test_scores_are_those_of_the_distribution_or_of_the_ranks() -> None:
    class LogNormal(Distribution):
        def quantile(self, probability):
            return np.exp(0.5 * ndtri(probability))

    class Coin(Distribution):
        def quantile(self, probability):
            return np.where(probability < 0.5, 1.0, 2.0)

    numbers = np.exp(0.5 * np.array([[-1.3], [0.2], [2.0], [0.2]]))
    assert normal_scores(numbers, LogNormal()) == pytest.approx(2.0 * np.log(numbers), abs=1e-5)
    ranks = ndtri(np.array([[0.5], [2.0], [3.5], [2.0]]) / 4.0)
    assert normal_scores(numbers, None) == pytest.approx(ranks)
    assert normal_scores(numbers, Coin()) == pytest.approx(ranks)

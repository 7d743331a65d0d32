"""Rare events, design points and competing risks against formulas step by step."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy import stats
from scipy.special import ndtr, ndtri

from wearsim.uq.distributions.base import Distribution
from wearsim.uq.survival.competing import CompetingRisks, course_places
from wearsim.uq.survival.design_points import (
    design_points,
    improved_shifts,
    influence,
    mixture_log_weights,
)
from wearsim.uq.survival.rare_events import (
    design_point,
    importance_sampling,
    log_weights,
    next_shift,
    subset_simulation,
    subset_stages,
    weighted_probability,
)
from wearsim.uq.survival.scores import ScoreFunction, score_function

RNG = np.random.default_rng(1)
SCORES = RNG.standard_normal((40, 2))


def test_weighted_probability_is_the_mean_with_a_log_interval() -> None:
    event, log = RNG.random(200), 0.5 * RNG.standard_normal(200)
    found = weighted_probability(event, log, 500)
    weight = event * np.exp(log)
    size = weight.sum() ** 2 / (weight**2).sum()
    variation = stats.sem(weight) / weight.mean()
    reach = math.exp(stats.t.ppf(0.975, size - 1.0) * variation)
    assert found.probability.value == pytest.approx(weight.mean())
    assert found.probability.low == pytest.approx(weight.mean() / reach)
    assert found.probability.high == pytest.approx(min(weight.mean() * reach, 1.0))
    assert (found.tests, found.variation, found.effective_size) == pytest.approx(
        (500, variation, size)
    )
    assert found.is_reliable
    assert found.obstacle == ""
    rare = weighted_probability(np.arange(500) < 1, np.zeros(500), 700)
    assert rare.obstacle == "effective sample size 1 of 700 tests is below 30"
    assert rare.probability.high == 1.0  # one degree of freedom
    assert rare.probability.low == pytest.approx(
        0.002 * math.exp(-stats.t.ppf(0.975, 1) * rare.variation)
    )
    none = weighted_probability(np.zeros(50), np.zeros(50), 60)
    assert none.obstacle == "effective sample size 0 of 60 tests is below 30"
    assert (none.probability.low, none.probability.high, none.variation) == (0.0, 1.0, math.inf)
    assert (none.effective_size, none.tests) == (0.0, 60)


def test_linear_design_point_is_next_to_the_origin() -> None:
    point = design_point(SCORES, 5.0 - 3.0 * SCORES[:, 0] + 4.0 * SCORES[:, 1])
    assert point == pytest.approx([0.6, -0.8])
    assert design_point(SCORES, 50.0 + SCORES[:, 0]) == pytest.approx([-6.5, 0.0])
    for response in (np.full(40, 1.0), SCORES[:, 0] - 1.0):
        assert abs(design_point(SCORES, response)).max() < 1e-12


def test_next_shift_is_the_weighted_mean_of_enough_events() -> None:
    scores, log = RNG.standard_normal((100, 2)), RNG.standard_normal(100)
    for count in (30, 29):
        response = np.where(np.arange(100) < count, np.where(np.arange(100) < 2, 0.0, -1.0), 1.0)
        response = response + np.where(response > 0.0, abs(scores @ [0.3, 0.1]), 0.0)
        found = next_shift(scores, response, log)
        if count == 30:
            weight = np.exp(log[:30])
            assert found == pytest.approx(weight @ scores[:30] / weight.sum())
        else:
            near = np.argsort(response, kind="stable")[:50]
            assert found == pytest.approx(design_point(scores[near], response[near]))
    few = np.arange(1.0, 11.0) + scores[:10, 0] / 10.0
    near = np.argsort(few)[:8]
    assert next_shift(scores[:10], few, log[:10]) == pytest.approx(
        design_point(scores[near], few[near])
    )


def test_importance_sampling_chooses_its_density_by_half_of_the_tests() -> None:
    def response(scores: np.ndarray) -> np.ndarray:
        return np.asarray(3.0 - scores @ [0.8, 0.6])

    rng, shift = np.random.default_rng(5), np.zeros(2)
    for _ in range(4):
        scores = rng.standard_normal((50, 2)) + shift
        log = 0.5 * shift @ shift - scores @ shift
        assert log_weights(scores, shift) == pytest.approx(log)
        shift = next_shift(scores, response(scores), log)
    scores = rng.standard_normal((203, 2)) + shift
    density = stats.norm.logpdf(scores).sum(axis=1) - stats.norm.logpdf(scores - shift).sum(axis=1)
    known = weighted_probability(response(scores) <= 0.0, density, 403)
    found = importance_sampling(response, 2, 403, seed=5)
    assert found.probability.value == pytest.approx(known.probability.value)
    assert found.tests == 403


def subset(response, dimension: int, tests: int, seed: int, drawn: int = 0):
    """Return probability, variation, tests and levels as Au and Beck (2001) derive them."""
    rng = np.random.default_rng(seed)
    count = max(int(tests / (1.0 + 0.9 * 6)), min(drawn, tests // 4))
    scores = rng.standard_normal((count, dimension))
    values, done, square, probability, scale = response(scores), count, 0.0, 1.0, 0.6
    before, planned, chains = (0.0, float(np.median(values))), 6, count
    while True:
        seeds = max(round(0.1 * len(values)), 1)
        last = tests - done < 3 * seeds
        threshold = 0.0 if last else max(np.sort(values)[seeds - 1], 0.0)
        event = values <= threshold
        share = event.mean()
        probability *= share
        steps = event.reshape(-1, chains)
        correlation = sum(
            2.0
            * (1.0 - lag / len(steps))
            * max((steps[lag:] & steps[:-lag]).mean() - share**2, 0.0)
            for lag in range(1, len(steps))
        )
        correlation = correlation / (share * (1.0 - share)) if share < 1.0 else 0.0
        square += (1.0 - share) / (share * len(values)) * (1.0 + correlation)
        if threshold == 0.0:
            return probability, math.sqrt(square), done
        score = ndtri(probability)
        line = (before[1] - threshold) / (before[0] - score)  # fall of the threshold with the score
        chance = max(ndtr(score - threshold / line), 1e-6)
        before, planned = (score, threshold), planned - 1
        left = max(math.ceil(math.log(probability / chance, 10) - 0.2), math.ceil(planned / 3.0), 1)
        places, chains = np.flatnonzero(event)[:seeds], seeds
        state, value, all_states, all_values = scores[places], values[places], [], []
        for _ in range(max((tests - done) // (left * seeds), 2)):
            scale = min(scale, 1.0)
            trial = math.sqrt(1.0 - scale**2) * state + scale * rng.standard_normal(state.shape)
            found = response(trial)
            kept = found <= threshold
            state, value = np.where(kept[:, None], trial, state), np.where(kept, found, value)
            scale *= math.exp(kept.mean() - 0.44)
            done += seeds
            all_states.append(state)
            all_values.append(value)
        scores, values = np.concatenate(all_states), np.concatenate(all_values)


@pytest.mark.parametrize("distance", [1.0, 2.5, 4.0])
@pytest.mark.parametrize("tests", [340, 1000])
def test_subset_simulation_multiplies_the_shares_of_levels(distance: float, tests: int) -> None:
    def response(scores: np.ndarray) -> np.ndarray:
        return np.asarray(distance - scores @ [0.8, 0.6] + 0.1 * scores[:, 0] ** 2)

    found = subset_simulation(response, 2, tests, seed=3)
    probability, variation, done = subset(response, 2, tests, 3)
    assert found.probability.value == pytest.approx(probability, rel=1e-12)
    assert found.variation == pytest.approx(variation, rel=1e-12)
    assert found.tests == done
    reach = math.exp(1.959963984540054 * variation)
    assert found.probability.low == pytest.approx(probability / reach)
    assert found.effective_size is None
    assert found.obstacle == ("" if variation < 1.0 else "its variation is above 100 %")


def test_known_tests_are_the_first_level_up_to_a_quarter() -> None:
    assert [next(subset_stages(640, drawn)).count for drawn in (0, 120, 1000)] == [100, 120, 160]
    stage = next(subset_stages(640))
    assert (stage.parents, stage.scale) == (None, 1.0)


def test_levels_of_equal_responses_have_an_obstacle() -> None:
    stages = subset_stages(640)
    next(stages)
    with pytest.raises(StopIteration) as end:
        stages.send(np.where(np.arange(100) < 50, 9.0, 2.0))
    assert end.value.value.obstacle == (
        "50 % of the tests of a level have the same response, such as a censored life"
    )
    assert (end.value.value.probability.value, end.value.value.tests) == (0.0, 100)
    stages = subset_stages(640)
    next(stages)
    assert stages.send(np.where(np.arange(100) < 51, 9.0, 2.0)).count == 10
    none = subset_simulation(lambda scores: 9.0 + scores[:, 0], 1, 300)
    assert none.obstacle == "no test of the last level has the event"


def test_design_points_are_least_distances_of_the_quadratic_fit() -> None:
    # score needed: 4 + 2 z1 + 0.5 z1^2
    response = SCORES[:, 0] + 0.25 * SCORES[:, 0] ** 2
    found = design_points(SCORES, response, lambda fitted: 4.0 + 2.0 * fitted)
    z = np.linspace(-6.5, 6.5, 130_001)
    cost = z**2 + np.maximum(4.0 + 2.0 * (z + 0.25 * z**2), 0.0) ** 2
    assert len(found) == 1
    assert found[0] == pytest.approx([z[cost.argmin()], 0.0], abs=2e-3)
    # nine realisations of two inputs are too few for the squares
    few = SCORES[:9]
    slopes = np.linalg.lstsq(np.column_stack([np.ones(9), few]), response[:9], rcond=None)[0]
    (point,) = design_points(few, response[:9], lambda fitted: 4.0 + 2.0 * fitted)
    unit = slopes[1:] / np.linalg.norm(slopes[1:])
    steps = np.linspace(-6.5, 0.0, 65_001)
    line = (
        steps**2
        + np.maximum(4.0 + 2.0 * (slopes[0] + steps * np.linalg.norm(slopes[1:])), 0.0) ** 2
    )
    assert point == pytest.approx(steps[line.argmin()] * unit, abs=2e-3)
    ten = design_points(SCORES[:10], response[:10], lambda fitted: 4.0 + 2.0 * fitted)
    assert ten[0] == pytest.approx(found[0], abs=2e-3)


def test_second_design_point_is_left_out_if_it_is_far_less_likely() -> None:
    z = RNG.standard_normal((50, 1))
    for tilt, count in ((0.2, 2), (1.2, 1)):
        points = design_points(z, -(z[:, 0] ** 2) + tilt * z[:, 0], lambda y: 3.0 * (y + 9.0))
        assert len(points) == count
    nothing = design_points(z, np.zeros(50), lambda y: y - 1.0)
    assert abs(nothing[0]).max() < 0.05


def test_weights_of_shifts_are_ratios_of_densities() -> None:
    shifts, shares = [np.zeros(2), np.array([1.0, -0.5]), np.array([-2.0, 0.3])], (0.2, 0.5, 0.3)
    density = sum(
        share * stats.norm.pdf(SCORES - shift).prod(axis=1)
        for share, shift in zip(shares, shifts, strict=True)
    )
    known = np.log(stats.norm.pdf(SCORES).prod(axis=1) / density)
    assert mixture_log_weights(SCORES, shares, shifts) == pytest.approx(known)
    response = SCORES[:, 0] - 0.3 * SCORES[:, 1] ** 2
    deviation = response - response.mean()
    linear, square = deviation @ SCORES, deviation @ (SCORES**2 - 1.0) / math.sqrt(2.0)
    assert influence(SCORES, response) == pytest.approx(np.sqrt(linear**2 + square**2))


def test_improved_shifts_are_means_of_the_nearest_draws() -> None:
    scores = np.array([[1.0], [1.2], [1.4], [1.6], [1.8], [-2.0], [-2.2]])
    weight = np.array([1.0, 1.0, 1.0, 1.0, 1.0, 0.3, 0.3])
    points = [np.array([1.5]), np.array([-2.5])]
    shifts, parts = improved_shifts(scores, weight, points)
    assert [shift[0] for shift in shifts] == pytest.approx([1.4, -2.5])  # five draws, and two
    assert parts == pytest.approx([5.0 / 5.6, 0.6 / 5.6])
    weight[0] = 1.1
    assert improved_shifts(scores, weight, points)[0][0][0] == 1.5  # fewer than five effective ones
    assert improved_shifts(scores, np.append(weight[:5], [0.1, 0.1]), points)[1] == pytest.approx(
        [5.1 / 5.3 / (5.1 / 5.3 + 0.1), 0.1 / (5.1 / 5.3 + 0.1)]
    )
    assert improved_shifts(scores, np.zeros(7), points)[1] == [0.5, 0.5]


ENDS = np.array([-700.0, 700.0])
MEDIAN, SCATTER, SLOPE = 1e-11, 0.3, 1.6
LOG_NORMAL = ScoreFunction(ENDS, (ENDS - math.log(MEDIAN)) / SCATTER, np.zeros(0))


def test_competing_risks_of_realisations_are_integrals_over_the_factor() -> None:
    ends, worn = np.array([1e6, 2e6, 5e5]), np.array([True, True, False])
    level = np.array([3e5, 1e6, 4e5])  # passes at which the damage levels off
    places = ends[:, None] * course_places()
    rate = np.array([1e-6, 5e-7, 2e-6])
    damage = rate[:, None] * level[:, None] * -np.expm1(-places / level[:, None])
    shift, spread = np.array([0.5, 0.0, -0.4]), 0.8
    risks = CompetingRisks(damage, ends, worn, rate, SLOPE, 0.2, LOG_NORMAL, MEDIAN, shift, spread)
    assert risks.constant == pytest.approx(-math.log(0.8))
    score = shift[:, None] + spread * ndtri((np.arange(20_000) + 0.5) / 20_000)
    ratio = np.exp(SCATTER * score)

    def no_pit(passes: np.ndarray) -> np.ndarray:
        """Return the chance of no pit after passes with the factors."""
        course = np.minimum(passes * ratio, ends[:, None])
        done = rate[:, None] * level[:, None] * -np.expm1(-course / level[:, None]) / ratio
        return np.asarray(np.exp(math.log(0.8) * done**SLOPE))

    for life in (2e2, 4e5, 9e5, 3e6, math.inf):
        wears = worn[:, None] & (ends[:, None] / ratio <= life)
        alive = no_pit(np.full_like(ratio, min(life, 1e12)))
        found = risks.at(life)
        assert found.survival == pytest.approx((alive * ~wears).mean(), abs=2e-4)
        assert found.wear == pytest.approx((alive * wears).mean(), abs=2e-4)
        assert found.pitting == pytest.approx(1.0 - alive.mean(), abs=2e-4)
        assert risks.before(life, "both").mean() == pytest.approx(1.0 - found.survival)
    small = risks.at(1.0).pitting
    known = 1.0 - np.exp(math.log(0.8) * rate**SLOPE).mean()
    assert small == pytest.approx(known, rel=0.01)
    assert risks.at(0.0) == pytest.approx((1.0, 0.0, 0.0))
    plain = np.exp(math.log(0.8) * (rate * 7e5) ** SLOPE)
    assert risks.before(7e5, "without_wear").mean() == pytest.approx(1.0 - plain.mean())
    for share in (1e-4, 0.3):
        life = risks.life(share, "both").value
        assert risks.before(life, "both").mean() == pytest.approx(share, rel=1e-6)


def test_counted_risks_end_by_the_earlier_of_both() -> None:
    ends, worn = np.array([1e6, 2e6, 3e6]), np.array([True, True, False])
    damage = 4e-7 * ends[:, None] * course_places()
    risks = CompetingRisks(damage, ends, worn, np.full(3, 4e-7), SLOPE, 0.2)
    for life in (5e5, 1e6, 2.5e6, 9e6):
        passes = np.minimum(life, ends)
        alive = np.exp(math.log(0.8) * (4e-7 * passes) ** SLOPE)
        wears = worn & (ends <= life)
        found = risks.at(life)
        assert found.survival == pytest.approx((alive * ~wears).mean(), rel=1e-9)
        assert found.wear == pytest.approx((alive * wears).mean(), rel=1e-9)
        assert sum(found) == pytest.approx(1.0)


class Steps(Distribution):
    """A value 1 with the probability 0.3, continuous from 2 to 3, and 5 with 0.2."""

    def quantile(self, probability):
        p = np.asarray(probability)
        return np.where(p <= 0.3, 1.0, np.where(p < 0.8, 2.0 + 2.0 * (p - 0.3), 5.0))


def test_scores_of_steps_and_gaps_are_exact() -> None:
    score = score_function(Steps())
    assert score.atoms == pytest.approx([1.0, 5.0])
    values = np.array([0.999, 1.0, 1.5, 1.999, 2.0, 2.5, 3.0, 4.999, 5.0, 6.0])
    chance = [0.0, 0.3, 0.3, 0.3, 0.3, 0.55, 0.8, 0.8, 1.0, 1.0]
    assert ndtr(score(values)) == pytest.approx(chance, abs=1e-8)
    assert score(np.array([0.5, 9.0])).tolist() == [-math.inf, math.inf]
    for p in (0.31, 0.5, 0.79):
        found = math.exp(score.log_quantile(ndtri(p)))
        assert found == pytest.approx(2.0 + 2.0 * (p - 0.3), rel=1e-7)
    assert np.exp(score.log_quantile(np.array([-3.0, ndtri(0.299), 3.0]))) == pytest.approx(
        [1, 1, 5]
    )
    assert (np.diff(score.logs) >= 0.0).all()
    assert (np.diff(score.scores) > 0.0).all()
    # straight in normal scores: only the ends and the first table are kept
    assert (
        score_function(
            type("L", (Steps,), {"quantile": lambda self, p: np.exp(ndtri(p))})()
        ).scores.size
        < 20_000
    )

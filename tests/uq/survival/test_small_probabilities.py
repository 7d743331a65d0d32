"""Small probabilities with the wear factor integrated: interval, refusal and further tests."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tests.uq.survival.small_probabilities import (
    FORMS,
    FRICTION,
    PROBABILITIES,
    SCORE,
    SIZES,
    STUDIES,
    by_further_tests,
    by_realisations,
    importance,
    log_target,
)
from wearsim.uq.survival.design_points import design_points, improved_shifts, mixture_log_weights
from wearsim.uq.survival.distributions import FactorMixture
from wearsim.uq.survival.effective import effective_number

MOST_FALSE = STUDIES - 372  # studies of 400 whose stated interval does not hold the probability


def least_held(stated: int) -> float:
    """Return the least number of stated intervals that hold the truth, for a coverage of 95 %."""
    return 0.95 * stated - 2.0 * math.sqrt(0.95 * 0.05 * stated)


@pytest.mark.coverage
@pytest.mark.parametrize("count", SIZES)
@pytest.mark.parametrize("factor", FRICTION)
@pytest.mark.parametrize("form", FORMS)
def test_stated_probabilities_hold_the_truth(form: str, factor: float, count: int) -> None:
    for probability in PROBABILITIES:
        cell = by_realisations(form, factor, count, probability)
        assert cell.false <= MOST_FALSE, (probability, cell)
        assert cell.stated < 30 or cell.held >= least_held(cell.stated), (probability, cell)


def test_the_few_studies_that_state_a_probability_hold_the_truth() -> None:
    cell = by_realisations("linear", 1.2, 40, 1e-2)
    assert cell.stated > 30
    assert cell.held >= least_held(cell.stated)


@pytest.mark.coverage
@pytest.mark.parametrize("factor", FRICTION)
@pytest.mark.parametrize("form", FORMS)
def test_further_tests_hold_the_truth(form: str, factor: float) -> None:
    # the smallest probability, the hardest; `make bench-ensembles` has the others
    cell = by_further_tests(form, factor, 40, min(PROBABILITIES))
    assert cell.false <= MOST_FALSE, cell
    if form == "linear":
        assert cell.stated == STUDIES
        assert cell.variation < 0.1


def test_wide_friction_is_refused_at_small_probabilities() -> None:
    for probability in (1e-4, 1e-6):
        assert by_realisations("linear", 1.6, 40, probability).stated == 0
    cell = by_realisations("linear", 1.2, 400, 1e-4)
    assert cell.stated > 300
    assert cell.false <= MOST_FALSE


def test_200_tests_give_one_in_a_million_within_10_percent() -> None:
    life = math.exp(log_target("linear", 1.6, 1e-6))
    found = [importance("linear", 1.6, 40, 200, life, (5, seed)) for seed in range(40)]
    values = np.array([item.probability.value for item in found])
    assert values.std() < 0.1e-6
    assert values.mean() == pytest.approx(1e-6, rel=0.03)
    assert all(item.is_reliable for item in found)
    held = [item.probability.low < 1e-6 < item.probability.high for item in found]
    assert sum(held) >= 36


def test_effective_number_is_predicted_where_the_weights_cannot_show_it() -> None:
    random, life = np.random.default_rng(3), math.exp(log_target("linear", 1.6, 1e-4))
    predicted, shown = [], []
    for _ in range(50):
        kappa = np.exp(math.log(1.6) * random.standard_normal(40))
        mixture = FactorMixture(kappa, SCORE)
        each = mixture.failed(np.array([life]))[:, 0]
        shown.append(effective_number(40, each.mean(), each.var(ddof=1)))
        predicted.append(mixture.effective_number(life))
    # 40 (E p)^2/var p = 0.099
    assert np.median(predicted) == pytest.approx(0.099, rel=0.8)
    assert np.median(shown) > 1.0


def test_effective_number_of_a_known_distribution_is_infinite() -> None:
    assert FactorMixture(np.ones(1), SCORE, exact=True).effective_number(0.1) == math.inf
    assert FactorMixture(np.ones(1), SCORE).effective_number(0.1) == 0.0
    assert FactorMixture(np.ones(9), SCORE).effective_number(0.1) == math.inf


def test_design_point_of_a_linear_response_is_that_of_the_closed_form() -> None:
    scores = np.random.default_rng(1).standard_normal((60, 2))
    (point,) = design_points(scores, scores @ [3.0, 4.0], lambda found: found + 10.0)
    # least |z|^2 + (3 z1 + 4 z2 + 10)^2
    assert point == pytest.approx([-30.0 / 26.0, -40.0 / 26.0], abs=1e-3)


def test_response_on_both_sides_has_two_design_points() -> None:
    scores = np.random.default_rng(1).standard_normal((60, 1))
    points = design_points(scores, -(scores[:, 0] ** 2), lambda found: 4.0 * (found + 9.0))
    assert sorted(point[0] for point in points) == pytest.approx([-3.0, 3.0], abs=0.1)


def test_weights_of_a_mixture_are_bounded_and_unbiased() -> None:
    random, shifts = np.random.default_rng(2), [np.zeros(2), np.array([2.0, -1.0])]
    sizes = (2000, 18_000)
    scores = np.concatenate(
        [random.standard_normal((n, 2)) + s for n, s in zip(sizes, shifts, strict=True)]
    )
    weight = np.exp(mixture_log_weights(scores, (0.1, 0.9), shifts))
    assert weight.max() <= 10.0
    assert weight.mean() == pytest.approx(1.0, abs=0.03)
    assert (weight @ scores / len(scores)) == pytest.approx([0.0, 0.0], abs=0.05)


def test_shifts_are_improved_where_enough_draws_have_the_event() -> None:
    scores = np.random.default_rng(4).standard_normal((400, 1)) + 1.0
    event = (scores[:, 0] > 1.5).astype(float)
    weight = np.exp(mixture_log_weights(scores, (1.0,), [np.ones(1)])) * event
    (mean,), parts = improved_shifts(scores, weight, [np.ones(1)])
    # mean of a normal score above 1.5
    assert mean[0] == pytest.approx(1.94, abs=0.1)
    assert parts == [1.0]
    (kept,), _ = improved_shifts(scores, np.zeros(400), [np.array([2.5])])
    assert kept[0] == 2.5

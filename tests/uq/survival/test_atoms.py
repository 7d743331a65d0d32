"""Lives with wear factors that are discrete, mixed or gapped: exact, by enumeration."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.special import ndtr, ndtri

from wearsim.models.random.distributions import TableDistribution
from wearsim.uq.distributions.base import Distribution
from wearsim.uq.distributions.maxent import maximum_entropy
from wearsim.uq.survival.comparison import quantile_ratio, two_specimens
from wearsim.uq.survival.distributions import FactorMixture
from wearsim.uq.survival.scores import score_function

KAPPA = 1.573176e-5  # full slip, 300 N, 50 um


def table(*rows: tuple[float, float]) -> TableDistribution:
    """Return the quantile function through rows of probability and value."""
    return TableDistribution(*np.array(rows).T)


TWO = table((0.0, 1e-11), (0.6, 1e-11), (0.6000001, 3e-11), (1.0, 3e-11))
JUMP = table((0.0, 1e-11), (0.6, 1e-11), (0.6, 3e-11), (1.0, 3e-11))
LAWS: dict[str, Distribution] = {
    "discrete": TWO,
    "discrete with a jump": JUMP,
    "gapped": table((0.0, 1e-11), (0.5, 2e-11), (0.5, 4e-11), (1.0, 5e-11)),
    "mixed": table(
        (0.0, 1e-11), (0.3, 1e-11), (0.5, 2e-11), (0.5, 4e-11), (0.8, 4e-11), (1.0, 5e-11)
    ),
    "bent": table((0.0, 1e-11), (0.3, 2e-11), (0.31, 2.5e-11), (1.0, 3e-11)),
    "continuous": maximum_entropy((0.0, math.inf), 1e-11, 5e-12, None),
}


def test_life_of_two_values_is_that_of_the_greater() -> None:
    mixture = FactorMixture(np.array([KAPPA]), score_function(TWO), exact=True)
    assert mixture.quantile(0.1).value == pytest.approx(KAPPA / 3e-11, rel=1e-9)
    assert round(mixture.quantile(0.1).value) == 524_392
    assert mixture.quantile(0.39).value == pytest.approx(KAPPA / 3e-11, rel=1e-9)
    assert mixture.quantile(0.41).value == pytest.approx(KAPPA / 1e-11, rel=1e-9)
    lives = np.array([524_391.0, 524_393.0, 1e6, 1_573_175.0, 1_573_177.0])
    assert mixture.failed(lives)[0] == pytest.approx([0.0, 0.4, 0.4, 0.4, 1.0], abs=1.1e-7)


@pytest.mark.parametrize("name", LAWS)
def test_score_is_the_distribution_function_by_bisection(name: str) -> None:
    law = LAWS[name]
    inside = law.quantile(np.random.default_rng(1).random(500))
    values = np.concatenate([inside, 0.999 * inside, 1.001 * inside, [0.99e-11, 3.5e-11, 9e-11]])
    low, high = np.zeros(len(values)), np.ones(len(values))
    for _ in range(60):
        middle = 0.5 * (low + high)
        reached = law.quantile(middle) <= values
        low, high = np.where(reached, middle, low), np.where(reached, high, middle)
    assert ndtr(score_function(law)(values)) == pytest.approx(low, abs=1e-8)


def test_atoms_are_the_values_with_a_probability() -> None:
    found = {name: score_function(law).atoms.tolist() for name, law in LAWS.items()}
    assert found["discrete"] == found["discrete with a jump"] == pytest.approx([1e-11, 3e-11])
    assert found["mixed"] == pytest.approx([1e-11, 4e-11])
    assert found["gapped"] == found["bent"] == found["continuous"] == []


def test_mixture_over_realisations_counts_every_value() -> None:
    kappa = np.exp(0.3 * ndtri((np.arange(50) + 0.5) / 50))
    mixture = FactorMixture(1e-11 * kappa, score_function(JUMP))
    life, share = np.sort(np.concatenate([kappa, kappa / 3.0])), np.repeat(1.0, 100)
    share = np.where(np.isin(life, kappa), 0.6, 0.4) / 50.0
    for level in (0.1, 0.35, 0.6):
        expected = life[np.searchsorted(np.cumsum(share), level)]
        assert mixture.quantile(level).value == pytest.approx(expected, rel=1e-9)


def test_designs_with_two_wear_factors_are_compared_exactly() -> None:
    score = score_function(JUMP)
    first, second = (
        FactorMixture(np.array([factor * 1e-11]), score, exact=True) for factor in (1.2, 1.0)
    )
    # lives of the first 1.2 and 0.4, of the second 1 and 1/3, with 0.6 and 0.4
    assert two_specimens(first, second).value == pytest.approx(0.6 + 0.4 * 0.4, abs=1e-9)
    assert quantile_ratio(first, second, 0.1).value == pytest.approx(1.2, rel=1e-9)
    equal = two_specimens(second, second)
    assert equal.value == pytest.approx(0.5, abs=1e-9)


def test_ratio_of_quantiles_is_exact_at_steps() -> None:
    score = score_function(JUMP)
    kappa = 1e-11 * np.exp(0.05 * np.random.default_rng(2).standard_normal(40))
    first, second = FactorMixture(1.3 * kappa, score), FactorMixture(kappa, score)
    found = quantile_ratio(first, second, 0.1)
    assert found.value == pytest.approx(1.3, rel=1e-9)
    assert (found.low, found.high) == pytest.approx((1.3, 1.3), rel=1e-9)


def test_comparison_with_too_many_steps_is_refused() -> None:
    rows = [
        (share, 1e-11 * (1.0 + number)) for number in range(20) for share in (number, number + 1)
    ]
    law = table(*((share / 20.0, value) for share, value in rows))
    kappa = 1e-11 * np.exp(0.3 * np.random.default_rng(3).standard_normal(1100))
    mixture = FactorMixture(kappa, score_function(law))
    assert not math.isfinite(two_specimens(mixture, mixture).value)
    assert not math.isfinite(quantile_ratio(mixture, mixture, 0.1).value)
    fewer = FactorMixture(kappa[:20], score_function(law))
    assert two_specimens(fewer, fewer, paired=False).value == pytest.approx(0.5, abs=1e-9)

"""Rare events of a closed-form life: variation, intervals and refusal."""

import math

import numpy as np
import pytest
from scipy.special import ndtri

from wearsim.uq.survival.rare_events import (
    importance_sampling,
    subset_simulation,
    weighted_probability,
)

SPREADS = np.array([0.405, 0.2, 0.15, 0.1])  # of ln life by its inputs
REPEATS = 200


def excess(probability):
    """Return ln(life/target) as a function of normal scores, 0 or less with the probability."""
    distance = -ndtri(probability) * math.hypot(*SPREADS)
    return lambda scores: distance + scores @ SPREADS


@pytest.mark.parametrize(("probability", "tests"), [(1e-4, 2000), (1e-6, 5000)])
@pytest.mark.parametrize(
    ("method", "variation"), [(importance_sampling, 0.2), (subset_simulation, 0.5)]
)
def test_rare_probability_has_the_stated_variation(method, variation, probability, tests):
    found = [method(excess(probability), len(SPREADS), tests, seed=seed) for seed in range(REPEATS)]
    values = np.array([item.probability.value for item in found])
    held = [item.probability.low <= probability <= item.probability.high for item in found]
    assert values.std() / probability < variation
    assert values.mean() == pytest.approx(probability, rel=0.15)
    assert np.mean(held) >= 0.9
    assert max(item.tests for item in found) <= tests
    assert all(item.is_reliable for item in found)


def test_few_weighted_events_are_refused():
    log_weight = np.zeros(1000)
    assert weighted_probability(np.arange(1000) < 30, log_weight, 1000).is_reliable
    found = weighted_probability(np.arange(1000) < 29, log_weight, 1000)
    assert found.effective_size == pytest.approx(29.0)
    assert not found.is_reliable


def test_event_that_never_occurs_is_refused():
    for found in (
        importance_sampling(lambda scores: np.ones(len(scores)), 2, 400),
        subset_simulation(lambda scores: np.ones(len(scores)), 2, 400),
    ):
        assert found.probability.value == 0.0
        assert not found.is_reliable

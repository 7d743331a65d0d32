"""Mixtures of distributions: the distribution function, lives with K/H integrated, mistakes."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.special import ndtr

import wearsim
from tests.studies.identify.grooves import TEXT
from wearsim.errors import ScenarioError
from wearsim.models.random.distributions import TableDistribution
from wearsim.scenario import parse_scenario
from wearsim.uq.distributions.base import Uniform
from wearsim.uq.distributions.mixture import Mixture
from wearsim.uq.distributions.truncated_normal import TruncatedNormal
from wearsim.uq.survival.distributions import FactorMixture
from wearsim.uq.survival.scores import score_function

KEY = "wear.cylinder.k_over_h"
GOOD = {"distribution": "lognormal", "median": "1.1e-11 1/Pa", "factor": 1.3}
SOFT = {"distribution": "lognormal", "median": "2.2e-11 1/Pa", "factor": 1.2}


def scenario(**options: object) -> wearsim.Scenario:
    """Return a rig whose K/H is a mixture."""
    table = {"distribution": "mixture", **options}
    return parse_scenario(TEXT, "rig.toml", {}.__getitem__, {KEY: table})


def below(value: np.ndarray, shares: tuple[float, float]) -> np.ndarray:
    """Return the distribution function of the two log-normal batches in closed form."""
    first, last = (np.log(value / m) / np.log(f) for m, f in ((1.1e-11, 1.3), (2.2e-11, 1.2)))
    return shares[0] * ndtr(first) + shares[1] * ndtr(last)


def test_wear_factor_of_two_batches_is_integrated_exactly():
    (item,) = scenario(of=[GOOD, SOFT], weights=[7, 3]).random
    kappa, life = np.array([1.5e-5, 2.0e-5]), np.geomspace(2e5, 5e6, 40)
    lives = FactorMixture(kappa, score_function(item.scalar))
    exact = 1.0 - below(kappa[:, None] / life, (0.7, 0.3))
    assert lives.failed(life) == pytest.approx(exact, abs=1e-8)
    found = lives.quantile_of_mean(0.1)
    assert 1.0 - below(kappa / found, (0.7, 0.3)).mean() == pytest.approx(0.1, abs=1e-8)
    assert item.describe().startswith("mixture of 2, mean 1.468")


def test_quantiles_invert_the_sum_of_the_components():
    normal, flat = TruncatedNormal(-np.inf, np.inf, 300.0, 20.0), Uniform(100.0, 200.0)
    mixture, value = Mixture([normal, flat], [0.75, 0.25]), np.linspace(60.0, 400.0, 69)
    exact = 0.75 * ndtr((value - 300.0) / 20.0) + 0.25 * np.clip((value - 100.0) / 100.0, 0, 1)
    assert mixture.cumulative(value) == pytest.approx(exact, abs=1e-8)
    inside = (value > 100.0) & (value < 200.0) | (value > 260.0)
    assert mixture.quantile(exact[inside]) == pytest.approx(value[inside], rel=1e-5)
    assert mixture.mean == pytest.approx(0.75 * 300.0 + 0.25 * 150.0)
    assert mixture.std**2 == pytest.approx(
        0.75 * (400.0 + 37.5**2) + 0.25 * (1e4 / 12.0 + 112.5**2)
    )


def test_components_may_have_steps_and_gaps():
    constants = [TableDistribution(np.array([0.0, 1.0]), np.full(2, k)) for k in (1.0, 3.0)]
    mixture = Mixture(constants, [0.4, 0.6])
    assert mixture.quantile(np.array([0.1, 0.399, 0.401, 0.9])) == pytest.approx([1, 1, 3, 3])
    score = score_function(mixture)
    assert score.atoms == pytest.approx([1.0, 3.0])
    assert ndtr(score(np.array([0.9, 1.0 + 1e-9, 2.0]))) == pytest.approx([0.0, 0.4, 0.4])


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (
            {"of": [GOOD, SOFT | {"medan": 1}], "weights": [1, 1]},
            "of (entry 2)] medan: unknown key (did you mean 'median'?)",
        ),
        (
            {"of": [GOOD, {"distribution": "log-normal"}], "weights": [1, 1]},
            "of (entry 2)] distribution: no random input is named 'log-normal'",
        ),
        (
            {"of": [GOOD, {"median": "1e-11 1/Pa"}], "weights": [1, 1]},
            "of (entry 2)] distribution: is missing",
        ),
        (
            {"of": [GOOD, {"distribution": "disc", "radius": "1 mrad"}], "weights": [1, 1]},
            "is a joint, but a component is the distribution of one number",
        ),
        (
            {"of": [GOOD, SOFT | {"persistence": "per-test"}], "weights": [1, 1]},
            f"of (entry 2)] persistence: belongs in [{KEY}]",
        ),
        ({"of": [GOOD, "SOFT"], "weights": [1, 1]}, "of (entry 2): is not a table"),
        ({"of": [GOOD], "weights": [1]}, "needs two distributions or more"),
        ({"of": [GOOD, SOFT], "weights": [1]}, "needs a weight for each distribution"),
        ({"of": [GOOD, SOFT], "weights": [1, 0]}, "'weights' must be above 0"),
        (
            {"of": [GOOD, {"distribution": "mixture", "of": [GOOD, SOFT | {"factor": 0.5}],
                           "weights": [1, 1]}], "weights": [1, 1]},
            "of (entry 2).of (entry 2)] factor: is out of range, got 0.5",
        ),
    ],
)  # fmt: skip
def test_mistakes_of_components_name_their_place(options: dict[str, object], words: str):
    with pytest.raises(ScenarioError) as caught:
        scenario(**options)
    assert words in str(caught.value)
    assert len(caught.value.mistakes) == 1

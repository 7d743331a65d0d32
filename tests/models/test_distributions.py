"""Built-in distributions: values, refused options and registration."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError
from scipy import stats

from wearsim.errors import ScenarioError
from wearsim.plugins import Distribution, JointDistribution, RandomInputSpec, registry
from wearsim.quantities import Quantity
from wearsim.types import FloatArray
from wearsim.units import FORCE

NAMES = ("maxent", "normal", "lognormal", "uniform", "truncated-normal", "constant", "table")
NEWTON = {"quantity": Quantity(FORCE)}


def build(name: str, context: dict[str, Any] | None = None, /, **options: object) -> Any:
    spec = registry().get(RandomInputSpec, name)
    return spec.factory(spec.options.model_validate(options, context=context))


def reader(text: str) -> Callable[[str], str]:
    return {"data.csv": text}.__getitem__


SAMPLES = "value [kN]\n0.3\n0.1\n0.2\n0.4\n0.8\n"
QUANTILES = "probability; value\n0; 1\n0.5; 2\n1; 5\n"
CASES = {
    "maxent": {"support": [0.0, "inf"], "mean": 307.0, "std": 200.0},
    "maxent, gamma": {"support": [0.0, "inf"], "mean": 307.0, "mean_log": 5.5},
    "maxent, mean": {"support": [0.0, 1.0], "mean": 0.3},
    "maxent, dented": {"support": [0.0, 1.0], "mean": 0.5, "std": 0.4},
    "normal": {"mean": -3.0, "std": 2.0},
    "lognormal": {"mean": 300.0, "std": 90.0},
    "lognormal, factor": {"median": 300.0, "factor": 1.4},
    "uniform": {"low": -1.0, "high": 3.0},
    "truncated-normal": {"parent_mean": 0.0, "parent_std": 2.0, "support": [1.0, 5.0]},
    "truncated-normal, tail": {"parent_mean": 0.0, "parent_std": 1.0, "support": [7.0, "inf"]},
    "constant": {"value": 4.0},
    "table": {"file": "data.csv"},
}


@pytest.fixture(scope="module")
def uniforms() -> FloatArray:
    """Return a random number in each of 100,000 equal intervals, in random order.

    Their mean and std are as accurate as those of many more independent numbers.
    """
    rng, count = np.random.default_rng(11), 100_000
    return rng.permutation((np.arange(count) + rng.random(count)) / count)


@pytest.fixture(params=CASES)
def distribution(request: pytest.FixtureRequest) -> Distribution:
    context = {"read": reader(QUANTILES)}
    made: Distribution = build(request.param.split(",")[0], context, **CASES[request.param])
    return made


def test_distributions_are_registered_with_their_roles() -> None:
    roles = {name: registry().get(RandomInputSpec, name).role for name in (*NAMES, "disc")}
    assert roles == dict.fromkeys(NAMES, "scalar") | {"disc": "joint"}


def test_samples_have_the_mean_and_std(distribution: Distribution, uniforms: FloatArray) -> None:
    draws = distribution.quantile(uniforms)
    centred = draws - distribution.mean
    # each within 4 standard errors of a million independent samples
    assert abs(centred.mean()) <= 4.0 * distribution.std / 1e3
    if distribution.std > 0.0:
        fourth = np.sqrt((centred**4).mean() / distribution.std**4 - 1.0)
        assert abs((centred**2).mean() / distribution.std**2 - 1.0) < 4.0 * fourth / 1e3


def test_quantiles_increase_over_the_support(distribution: Distribution) -> None:
    values = distribution.quantile(np.linspace(0.0, 1.0, 201))
    assert (values[0], values[-1]) == distribution.support
    assert np.all(np.diff(values) >= 0.0)
    assert distribution.quantile(np.full((3, 2), 0.4)).shape == (3, 2)


@pytest.mark.parametrize(
    ("name", "options", "expected"),
    [
        ("normal", {"mean": -3.0, "std": 2.0}, stats.norm(-3.0, 2.0)),
        ("lognormal", {"median": 300.0, "factor": 1.4}, stats.lognorm(math.log(1.4), scale=300.0)),
        ("uniform", {"low": -1.0, "high": 3.0}, stats.uniform(-1.0, 4.0)),
        (
            "truncated-normal",
            {"parent_mean": 0.0, "parent_std": 2.0, "support": [1.0, 5.0]},
            stats.truncnorm(0.5, 2.5, scale=2.0),
        ),
        (
            "truncated-normal",
            {"parent_mean": 0.0, "parent_std": 1.0, "support": [7.0, "inf"]},
            stats.truncnorm(7.0, np.inf),
        ),
    ],
)
def test_quantiles_and_moments_equal_those_of_scipy(
    name: str, options: dict[str, object], expected: Any
) -> None:
    made = build(name, **options)
    probabilities = np.array([1e-6, 0.01, 0.4, 0.9, 0.9999])
    assert made.quantile(probabilities) == pytest.approx(expected.ppf(probabilities), rel=1e-9)
    assert made.mean == pytest.approx(expected.mean(), rel=1e-9)
    assert made.std == pytest.approx(expected.std(), rel=1e-7)


def test_lognormal_mean_and_std_are_those_of_the_value() -> None:
    made = build("lognormal", mean=300.0, std=90.0)
    assert (made.mean, made.std) == (pytest.approx(300.0), pytest.approx(90.0))
    assert build("lognormal", median=2.0, factor=1.5).quantile(np.array(0.5)) == pytest.approx(2.0)


def test_maxent_keeps_the_mean_unlike_truncated_normal() -> None:
    known = build("maxent", support=[0.0, 1.0], mean=1e-3, std=9e-4)
    cut = build("truncated-normal", support=[0.0, 1.0], parent_mean=1e-3, parent_std=9e-4)
    assert known.mean == pytest.approx(1e-3, rel=1e-12)
    assert cut.mean == pytest.approx(1.22e-3, rel=5e-3)


def test_options_have_the_unit_of_the_replaced_value() -> None:
    made = build("maxent", NEWTON, support=["0 N", "inf"], mean="0.307 kN", std="32 N")
    assert made.support == (0.0, math.inf)
    assert (made.mean, made.std) == (pytest.approx(307.0), pytest.approx(32.0))


def test_warnings_of_the_distribution_are_passed_on() -> None:
    (warning,) = build("maxent", support=[0.0, 1.0], mean=1e-3, std=1.1e-3).warnings
    assert "spike" in warning
    assert build("normal", mean=0.0, std=1.0).warnings == ()


def test_table_samples_have_the_unit_of_the_replaced_value() -> None:
    made = build("table", {**NEWTON, "read": reader(SAMPLES)}, file="data.csv")
    assert made.support == (100.0, 800.0)
    assert made.quantile(np.array([0.3, 0.5, 0.8])) == pytest.approx([200.0, 300.0, 600.0])


def test_table_samples_have_equal_weights() -> None:
    samples = [0.05, 0.1, 0.1, 0.1, 0.3]
    text = "value\n" + "\n".join(str(sample) for sample in samples)
    made = build("table", {"read": reader(text)}, file="data.csv")
    assert made.mean == pytest.approx(0.13, rel=1e-14)
    # sample i is at (i - 1/2)/n, and beyond the first and the last the quantiles are constant
    middles = (np.arange(5) + 0.5) / 5.0
    assert made.quantile(middles) == pytest.approx(samples, rel=1e-14)
    assert made.quantile(np.array([0.0, 0.05, 0.95, 1.0])).tolist() == [0.05, 0.05, 0.3, 0.3]
    # linear interpolation reduces the variance by 1/6 of the mean squared difference
    inner = np.square(np.diff(samples)).sum() / 6.0 / 5.0
    assert made.std**2 == pytest.approx(np.var(samples) - inner, rel=1e-13)


def test_table_quantiles_are_interpolated_linearly() -> None:
    made = build("table", {"read": reader(QUANTILES)}, file="data.csv")
    assert made.quantile(np.array([0.25, 0.75])) == pytest.approx([1.5, 3.5])
    # half of the samples are uniform on 1 to 2, half on 2 to 5
    assert made.mean == pytest.approx(0.5 * 1.5 + 0.5 * 3.5)
    assert made.std**2 == pytest.approx(0.5 * (7.0 / 3.0 + 13.0) - 2.5**2)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("probability, value\n0.1, 1\n1, 2\n", "must go from 0 to 1, got 0.1 to 1"),
        ("probability, value\n0, 3\n1, 2\n", "column 'value' must not decrease, got 2 after 3"),
        ("probability, value\n0, 3\n0, 4\n1, 5\n", "column 'probability' must increase"),
        ("value [N]\n1\n2\n", "a plain number has no unit"),
        ("number\n1\n2\n", "column 'value' is missing"),
    ],
)
def test_mistakes_in_a_table_are_reported(text: str, message: str) -> None:
    with pytest.raises(ScenarioError, match=r"data\.csv") as caught:
        build("table", {"read": reader(text)}, file="data.csv")
    assert message in str(caught.value)


@pytest.mark.parametrize(
    ("name", "context", "options", "message"),
    [
        (
            "maxent",
            NEWTON,
            {"support": ["0 N", "inf"], "mean": "0.3 kN", "std": "320 N"},
            "std 320 is more than mean - low = 300",
        ),
        (
            "maxent",
            NEWTON,
            {"support": ["0 N", "inf"], "mean": "0.3 kN", "std": "320 N"},
            "(numbers in N)",
        ),
        ("maxent", None, {"support": [0.0, "inf"]}, "alone determines no distribution"),
        ("maxent", None, {"support": [0.0, 1.0], "mean": 0.5, "std": -1.0}, "must be above zero"),
        ("lognormal", None, {"mean": 1.0, "factor": 2.0}, "got mean and factor"),
        ("lognormal", None, {}, "expected either mean and std, or median and factor"),
        ("lognormal", None, {"median": 1.0, "factor": 1.0}, "greater than 1"),
        ("uniform", None, {"low": 2.0, "high": 2.0}, "must be above the lower one, got 2 to 2"),
        (
            "truncated-normal",
            None,
            {"parent_mean": 0.0, "parent_std": 1.0, "support": ["inf", 0.0]},
            "must be above",
        ),
    ],
)
def test_infeasible_options_are_refused(
    name: str, context: dict[str, Any] | None, options: dict[str, object], message: str
) -> None:
    with pytest.raises(ValidationError) as caught:
        build(name, context, **options)
    assert message in str(caught.value)


def test_disc_is_uniformly_distributed(uniforms: FloatArray) -> None:
    disc: JointDistribution = build("disc", radius=0.002)
    assert disc.components == ("yaw", "tilt")
    points = disc.values(uniforms.reshape(-1, 2)) / 0.002
    square = (points**2).sum(axis=1)
    angle = np.arctan2(points[:, 1], points[:, 0]) / np.pi
    # uniform on the disc: the area within a radius and the angle are uniform and independent
    assert stats.kstest(square, "uniform").pvalue > 1e-3
    assert stats.kstest(angle, stats.uniform(-1.0, 2.0).cdf).pvalue > 1e-3
    assert abs(np.corrcoef(square, angle)[0, 1]) < 4.0 / math.sqrt(len(square))
    assert points.std(axis=0) == pytest.approx([0.5, 0.5], rel=5e-3)  # 1 mrad on 2 mrad
    assert disc.mean == (0.0, 0.0)
    assert np.all(np.abs(points) <= np.array(disc.reach) / 0.002)


def test_disc_is_antisymmetric_in_the_uniform_numbers() -> None:
    disc = build("disc", radius=0.002)
    uniform = np.random.default_rng(2).random((100, 2))
    assert disc.values(1.0 - uniform) == pytest.approx(-disc.values(uniform), abs=1e-17)
    assert disc.values(np.array([[0.5, 0.5], [0.0, 0.5]])) == pytest.approx(
        np.array([[0.0, 0.0], [-0.002, 0.0]])
    )

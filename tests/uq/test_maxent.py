"""Maximum-entropy distributions: multipliers, moments and quantiles."""

from __future__ import annotations

import math
import pickle

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy import stats
from scipy.integrate import quad
from scipy.special import digamma, erfcx

from wearsim.types import FloatArray
from wearsim.uq.distributions.base import MaxentDistribution
from wearsim.uq.distributions.maxent import maximum_entropy
from wearsim.uq.distributions.truncated_normal import QuadraticExponent, TruncatedNormal, cut_normal

INF = math.inf
GAMMA_LOG = (
    float(digamma(0.5)) - math.log(0.5) + math.log(7.0)
)  # of the gamma distribution of shape 1/2
KNOWN = {
    "load": ((0.0, INF), 307.0, 32.0, None),
    "creepage": ((0.0, 1.0), 1e-3, 4e-4, None),
    "hard": ((0.0, 1.0), 1e-3, 9e-4, None),
    "friction": ((0.0, INF), 0.1, 0.02, None),
    "normal": ((-INF, INF), -3.0, 2.0, None),
    "nearly exponential": ((0.0, INF), 5.0, 4.999, None),
    "exponential": ((2.0, INF), 5.0, 3.0, None),
    "exponential by its mean": ((2.0, INF), 5.0, None, None),
    "mirrored exponential": ((-INF, 2.0), 1.5, None, None),
    "truncated exponential": ((0.0, 1.0), 0.2, None, None),
    "increasing exponential": ((0.0, 1.0), 0.9, None, None),
    "uniform": ((-1.0, 3.0), None, None, None),
    "nearly uniform": ((0.0, 1.0), 0.5, 0.28867, None),
    "nearly uniform, with antimode": ((0.0, 1.0), 0.5, 0.28868, None),
    "antimode": ((0.0, 1.0), 0.5, 0.35, None),
    "antimode, asymmetric": ((0.0, 1.0), 0.9, 0.29, None),
    "increasing at one end": ((0.0, 1.0), 0.2, 0.2, None),
    "two ends": ((0.0, 1.0), 0.3, 0.45, None),
    "upper limit": ((-INF, 0.0), -1.0, 0.5, None),
    "both limits close": ((10.0, 11.0), 10.3, 0.2, None),
    "gamma": ((0.0, INF), 7.0, None, GAMMA_LOG),
    "narrow gamma": ((0.0, INF), 7.0, None, math.log(7.0) - 1e-3),
}


@pytest.fixture(params=KNOWN)
def distribution(request: pytest.FixtureRequest) -> MaxentDistribution:
    support, mean, std, mean_log = KNOWN[request.param]
    return maximum_entropy(support, mean, std, mean_log)


@pytest.fixture(scope="module")
def uniforms() -> FloatArray:
    """Return one random number in each of 100,000 equal intervals.

    Their mean and std are as accurate as those of many more independent numbers.
    """
    return (np.arange(100_000) + np.random.default_rng(5).random(100_000)) / 100_000


def integral(distribution: MaxentDistribution, power: float, low: float, high: float) -> float:
    """Integrate the density times a power of the distance from the mean, by adaptive rules."""

    def function(x: float) -> float:
        return (
            float(distribution.density(np.array(x)))
            * ((x - distribution.mean) / distribution.std) ** power
        )

    return float(quad(function, low, high, epsabs=1e-13, epsrel=1e-12, limit=200)[0])


def ends(distribution: MaxentDistribution) -> tuple[float, float]:
    """Return the support, with infinite ends replaced by 60 standard deviations."""
    low, high = distribution.support
    return max(low, distribution.mean - 60 * distribution.std), min(
        high, distribution.mean + 60 * distribution.std
    )


@pytest.mark.parametrize(
    ("name", "multipliers"),
    [
        ("load", (50.4047, -0.2998047, 4.88281e-4)),
        ("creepage", (-3.98140, -5861.46, 2.957525e6)),
        ("hard", (-6.77709, 726.286, 75611.6)),
        ("friction", (9.50682, -249.998, 1249.99)),
    ],
)
def test_multipliers_equal_reference_values_to_5_digits(
    name: str, multipliers: tuple[float, float, float]
) -> None:
    support, mean, std, _ = KNOWN[name]
    assert maximum_entropy(support, mean, std).multipliers == pytest.approx(multipliers, rel=5e-6)


@pytest.mark.parametrize(
    ("name", "parent"),
    [
        ("load", (307.0, 32.0)),
        ("creepage", (9.90940e-4, 4.11169e-4)),
        ("hard", (-4.80274e-3, 2.57152e-3)),
        ("friction", (0.1, 0.02)),
    ],
)
def test_parents_equal_reference_values(name: str, parent: tuple[float, float]) -> None:
    support, mean, std, _ = KNOWN[name]
    assert maximum_entropy(support, mean, std).parent == pytest.approx(parent, rel=5e-6)


def test_parent_moments_differ_from_truncated_moments() -> None:
    naive = cut_normal(0.0, 1.0, 1e-3, 9e-4)
    assert naive.mean / 1e-3 - 1.0 == pytest.approx(0.22, abs=0.005)


def test_no_parent_for_a_density_with_an_antimode() -> None:
    distribution = maximum_entropy((0.0, 1.0), 0.5, 0.35)
    assert distribution.parent is None
    assert distribution.multipliers[2] == pytest.approx(-6.4, abs=0.05)
    assert distribution.multipliers[1] == pytest.approx(
        -distribution.multipliers[2], rel=1e-12
    )  # by symmetry


def test_multipliers_reproduce_the_density(distribution: MaxentDistribution) -> None:
    l0, l1, l2 = distribution.multipliers
    x = distribution.quantile(np.array([0.03, 0.4, 0.98]))
    third = np.log(x) if distribution.third == "log x" else x * x
    assert distribution.density(x) == pytest.approx(np.exp(-l0 - l1 * x - l2 * third), rel=1e-9)


def test_density_has_the_reported_moments(distribution: MaxentDistribution) -> None:
    low, high = ends(distribution)
    middle = float(distribution.quantile(np.array(0.5)))
    for power, expected in ((0, 1.0), (1, 0.0), (2, 1.0)):
        whole = integral(distribution, power, low, middle) + integral(
            distribution, power, middle, high
        )
        assert whole == pytest.approx(expected, abs=1e-9)


def test_prescribed_moments_are_met(
    distribution: MaxentDistribution, request: pytest.FixtureRequest
) -> None:
    _, mean, std, mean_log = next(
        known
        for known in KNOWN.values()
        if maximum_entropy(*known).multipliers == distribution.multipliers
    )
    if mean is not None:
        assert distribution.mean == pytest.approx(mean, abs=1e-12 * distribution.std)
    if std is not None:
        # the std of a nearly uniform distribution is sensitive to rounding of the multipliers
        assert distribution.std == pytest.approx(std, rel=1e-10)
    if mean_log is not None:
        values = distribution.quantile((np.arange(200_000) + 0.5) / 200_000)
        assert np.log(values).mean() == pytest.approx(mean_log, abs=2e-5)


def test_quantiles_invert_the_integral_of_the_density(distribution: MaxentDistribution) -> None:
    probabilities = np.array([1e-4, 0.025, 0.3, 0.6, 0.975, 0.9999])
    values = distribution.quantile(probabilities)
    low, high = ends(distribution)
    for probability, value in zip(probabilities[:3], values[:3], strict=True):
        assert integral(distribution, 0, low, value) == pytest.approx(probability, rel=1e-9)
    for probability, value in zip(probabilities[3:], values[3:], strict=True):
        assert integral(distribution, 0, value, high) == pytest.approx(1.0 - probability, rel=1e-9)


def test_draws_have_the_mean_and_the_std(
    distribution: MaxentDistribution, uniforms: FloatArray
) -> None:
    draws = distribution.quantile(uniforms)
    centred = draws - distribution.mean
    # each within 4 standard errors of a million independent draws; that of the std is estimated
    # from the fourth moment
    assert abs(centred.mean()) < 4.0 * distribution.std / 1e3
    fourth = np.sqrt((centred**4).mean() / distribution.std**4 - 1.0)
    assert abs((centred**2).mean() / distribution.std**2 - 1.0) < 4.0 * fourth / 1e3


def test_quantiles_increase_from_end_to_end(distribution: MaxentDistribution) -> None:
    probabilities = np.concatenate([[0.0], np.logspace(-15, -1, 60), np.linspace(0.1, 1.0, 400)])
    values = distribution.quantile(probabilities)
    assert (values[0], values[-1]) == distribution.support
    assert np.all(np.diff(values) >= 0.0)
    assert distribution.quantile(probabilities.reshape(-1, 1)).shape == (461, 1)


def test_density_is_zero_outside_the_support(distribution: MaxentDistribution) -> None:
    low, high = distribution.support
    outside = np.array([low - 1.0 if low > -INF else 0.0, high + 1.0 if high < INF else 0.0])
    wrong = (outside < low) | (outside > high)
    assert np.all(distribution.density(outside[wrong]) == 0.0)


@pytest.mark.parametrize(
    ("low", "high"), [(-1.0, INF), (0.5, 30.0), (-0.3, 0.4), (3.0, 5.0), (-INF, 1.0)]
)
def test_quantile_table_agrees_with_the_closed_form(low: float, high: float) -> None:
    closed = cut_normal(low, high, 0.0, 1.0)
    if low == -INF:
        turned = QuadraticExponent(-high, INF, 1.0, -high, 0.5)
        table = -turned.quantile(np.linspace(0.999, 0.001, 500))
    else:
        table = QuadraticExponent(low, high, 1.0, low, 0.5).quantile(np.linspace(0.001, 0.999, 500))
    assert table == pytest.approx(closed.quantile(np.linspace(0.001, 0.999, 500)), abs=2e-12)


def test_tail_quantiles_of_the_hard_case_have_10_digits() -> None:
    distribution = maximum_entropy(*KNOWN["hard"])
    mean, std = distribution.parent or (0.0, 1.0)
    for probability in (1e-4, 0.01, 0.5, 0.999, 1.0 - 1e-9):
        value = float(distribution.quantile(np.array(probability)))
        whole = stats.norm.sf(-mean / std)
        above = stats.norm.sf((value - mean) / std) / whole
        assert above == pytest.approx(1.0 - probability, rel=2e-10)
    # the density is constant near the lower end
    first = float(distribution.quantile(np.array(1e-6)))
    assert first * float(distribution.density(np.array(0.0))) == pytest.approx(1e-6, rel=1e-5)


@pytest.mark.parametrize("depth", [6.0, 40.0, 1e3])
def test_support_far_in_the_tail_is_nearly_exponential(depth: float) -> None:
    distribution = cut_normal(depth, INF, 0.0, 1.0)
    # Mills' ratio, first terms of its continued fraction
    assert distribution.mean - depth == pytest.approx(1.0 / depth, rel=2.1 / depth**2)
    assert distribution.std == pytest.approx(1.0 / depth, rel=3.1 / depth**2)
    mirrored = cut_normal(-INF, -depth, 0.0, 1.0)
    ratio = math.sqrt(2.0 / math.pi) / float(erfcx(depth / math.sqrt(2.0)))
    assert [distribution.mean, -mirrored.mean] == pytest.approx([ratio] * 2, rel=1e-12)
    assert mirrored.quantile(np.array(0.2)) == pytest.approx(-distribution.quantile(np.array(0.8)))


def test_gamma_distribution_agrees_with_scipy() -> None:
    for shape in (0.02, 0.5, 1.0, 3.0, 70.0, 2e3):
        log_mean = float(digamma(shape)) - math.log(shape) + math.log(7.0)
        distribution = maximum_entropy((0.0, INF), 7.0, None, log_mean)
        probabilities = np.array([1e-9, 0.01, 0.3, 0.7, 0.99])
        expected = stats.gamma.ppf(probabilities, shape, scale=7.0 / shape)
        assert distribution.quantile(probabilities) == pytest.approx(expected, rel=1e-8, abs=1e-300)
        assert distribution.std == pytest.approx(7.0 / math.sqrt(shape))
        assert distribution.density(np.array([0.3, 7.0])) == pytest.approx(
            stats.gamma.pdf([0.3, 7.0], shape, scale=7.0 / shape), rel=1e-8
        )


@pytest.mark.parametrize("short", [1e-1, 1e-4, 1e-8])
@pytest.mark.parametrize("mean", [0.5, 0.03, 0.999])
def test_stds_just_below_the_limit_of_a_bounded_support_are_met(mean: float, short: float) -> None:
    std = math.sqrt(mean * (1.0 - mean)) * (1.0 - short)
    distribution = maximum_entropy((0.0, 1.0), mean, std)
    assert distribution.mean == pytest.approx(mean, rel=1e-12)
    assert distribution.std == pytest.approx(std, rel=1e-12)


@pytest.mark.parametrize("short", [1e-3, 1e-6, 1e-10])
def test_stds_near_the_exponential_one_converge_to_it(short: float) -> None:
    distribution = maximum_entropy((0.0, INF), 2.0, 2.0 * (1.0 - short))
    assert distribution.std == pytest.approx(2.0 * (1.0 - short), rel=1e-13)
    exponential = maximum_entropy((0.0, INF), 2.0)
    values = np.linspace(0.01, 0.99, 50)
    assert distribution.quantile(values) == pytest.approx(
        exponential.quantile(values), rel=10.0 * short
    )


@pytest.mark.parametrize("short", [1e-15, 1e-12, 1e-8])
def test_nearly_uniform_exponential_quantiles_have_12_digits_at_both_ends(short: float) -> None:
    probabilities = np.array([1e-12, 1e-3, 0.4, 0.6, 0.999])
    change = 6.0 * short * probabilities * (1.0 - probabilities)  # first order in the rate
    rising = maximum_entropy((0.0, 1.0), 0.5 + short).quantile(probabilities)
    assert rising == pytest.approx(probabilities + change, rel=1e-12)
    falling = maximum_entropy((0.0, 1.0), 0.5 - short).quantile(probabilities)
    assert falling == pytest.approx(probabilities - change, rel=1e-12)


def test_spike_at_a_far_limit_gives_a_warning() -> None:
    (message,) = maximum_entropy((0.0, 1.0), 1e-3, 1.1e-3).warnings
    assert "a spike with a probability of 2.1e-07 is at the end 1" in message
    (mirrored,) = maximum_entropy((-1.0, 0.0), -1e-3, 1.1e-3).warnings
    assert "a spike with a probability of 2.1e-07 is at the end -1" in mirrored
    assert maximum_entropy((0.0, 1.0), 1e-3, 9e-4).warnings == ()


def test_spike_has_the_reported_probability() -> None:
    distribution = maximum_entropy((0.0, 1.0), 1e-3, 1.1e-3)
    antimode = distribution.antimode
    assert antimode is not None
    above = integral(distribution, 0, 0.96, 1.0)
    assert above == pytest.approx(antimode[1], rel=1e-6)
    assert integral(distribution, 2, 0.0, 0.04) + integral(
        distribution, 2, 0.96, 1.0
    ) == pytest.approx(1.0, rel=1e-9)


def test_mirrored_moments_give_the_mirrored_distribution() -> None:
    distribution, turned = (
        maximum_entropy((0.0, 1.0), 0.2, 0.1),
        maximum_entropy((-1.0, 0.0), -0.2, 0.1),
    )
    assert isinstance(distribution, TruncatedNormal)
    values = np.linspace(0.0, 1.0, 33)
    assert turned.quantile(values) == pytest.approx(-distribution.quantile(1.0 - values), abs=1e-14)
    assert turned.multipliers == pytest.approx(
        (distribution.multipliers[0], -distribution.multipliers[1], distribution.multipliers[2])
    )


def test_result_is_independent_of_the_unit() -> None:
    si, engineers = maximum_entropy((0.0, INF), 3e-6, 1e-6), maximum_entropy((0.0, INF), 3.0, 1.0)
    assert si.quantile(np.array(0.1)) == pytest.approx(engineers.quantile(np.array(0.1)) * 1e-6)
    assert si.multipliers[2] == pytest.approx(engineers.multipliers[2] * 1e12)


def test_distributions_can_be_pickled(distribution: MaxentDistribution) -> None:
    values = np.linspace(0.01, 0.99, 9)
    assert np.array_equal(
        pickle.loads(pickle.dumps(distribution)).quantile(values),  # trusted data
        distribution.quantile(values),
    )


@settings(max_examples=150, deadline=None)
@given(
    low=st.floats(-1e3, 1e3),
    width=st.floats(1e-3, 1e3),
    place=st.floats(1e-4, 1.0 - 1e-4),
    part=st.floats(1e-4, 0.9999),
)
def test_feasible_moments_on_a_bounded_support_are_met(
    low: float, width: float, place: float, part: float
) -> None:
    high, mean = low + width, low + place * width
    std = part * math.sqrt((mean - low) * (high - mean))
    distribution = maximum_entropy((low, high), mean, std)
    rounding = 1e-15 * max(abs(low), abs(high)) / min(std, mean - low, high - mean)
    assert distribution.mean == pytest.approx(mean, abs=(1e-10 + 10 * rounding) * std)
    assert distribution.std == pytest.approx(std, rel=1e-10 + 100 * rounding / (1.0 - part))
    middle = distribution.quantile((np.arange(2000) + 0.5) / 2000)
    assert middle.mean() == pytest.approx(distribution.mean, abs=0.02 * std + 1e-3 * width)


@settings(max_examples=60, deadline=None)
@given(
    low=st.floats(-10.0, 10.0),
    above=st.floats(1e-3, 1e3),
    part=st.floats(1e-4, 1.0),
    upside_down=st.booleans(),
)
def test_feasible_moments_with_one_limit_are_met(
    low: float, above: float, part: float, upside_down: bool
) -> None:
    mean = low + above
    std = part * (mean - low)
    sign, support = (-1.0, (-INF, -low)) if upside_down else (1.0, (low, INF))
    distribution = maximum_entropy(support, sign * mean, std)
    rounding = 1e-15 * max(abs(low), 1.0) / min(std, above)
    assert distribution.mean == pytest.approx(sign * mean, abs=(1e-10 + 10 * rounding) * std)
    assert distribution.std == pytest.approx(std, rel=1e-10 + 100 * rounding)

"""Laws of maximum entropy: multipliers, moments, quantiles, and what no law can have."""

from __future__ import annotations

import math
import pickle

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats
from scipy.integrate import quad
from scipy.special import digamma

from wearsim.errors import WearsimError
from wearsim.types import FloatArray
from wearsim.uq.distributions.base import MaxentDistribution
from wearsim.uq.distributions.maxent import Infeasible, maximum_entropy
from wearsim.uq.distributions.truncated_normal import QuadraticExponent, TruncatedNormal, cut_normal

INF = math.inf
GAMMA_LOG = float(digamma(0.5)) - math.log(0.5) + math.log(7.0)  # of the gamma law of shape 1/2
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
    "rising exponential": ((0.0, 1.0), 0.9, None, None),
    "uniform": ((-1.0, 3.0), None, None, None),
    "nearly uniform": ((0.0, 1.0), 0.5, 0.28867, None),
    "nearly uniform, dented": ((0.0, 1.0), 0.5, 0.28868, None),
    "dented": ((0.0, 1.0), 0.5, 0.35, None),
    "dented, aslant": ((0.0, 1.0), 0.9, 0.29, None),
    "rising at one end": ((0.0, 1.0), 0.2, 0.2, None),
    "two ends": ((0.0, 1.0), 0.3, 0.45, None),
    "upper limit": ((-INF, 0.0), -1.0, 0.5, None),
    "both limits near": ((10.0, 11.0), 10.3, 0.2, None),
    "gamma": ((0.0, INF), 7.0, None, GAMMA_LOG),
    "narrow gamma": ((0.0, INF), 7.0, None, math.log(7.0) - 1e-3),
}


@pytest.fixture(params=KNOWN)
def law(request: pytest.FixtureRequest) -> MaxentDistribution:
    support, mean, std, mean_log = KNOWN[request.param]
    return maximum_entropy(support, mean, std, mean_log)


@pytest.fixture(scope="module")
def uniforms() -> FloatArray:
    return np.random.default_rng(5).random(1_000_000)


def integral(law: MaxentDistribution, power: float, low: float, high: float) -> float:
    """Integrate the density times a power of the distance from the mean, by adaptive rules."""

    def function(x: float) -> float:
        return float(law.density(np.array(x))) * ((x - law.mean) / law.std) ** power

    return float(quad(function, low, high, epsabs=1e-13, epsrel=1e-12, limit=200)[0])


def ends(law: MaxentDistribution) -> tuple[float, float]:
    """Return the support, or where an infinite one has nothing left."""
    low, high = law.support
    return max(low, law.mean - 60 * law.std), min(high, law.mean + 60 * law.std)


@pytest.mark.parametrize(
    ("name", "multipliers"),
    [
        ("load", (50.4047, -0.2998047, 4.88281e-4)),
        ("creepage", (-3.98140, -5861.46, 2.957525e6)),
        ("hard", (-6.77709, 726.286, 75611.6)),
        ("friction", (9.50682, -249.998, 1249.99)),
    ],
)
def test_that_multipliers_are_the_known_ones_to_5_digits(
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
def test_that_parents_are_the_known_ones(name: str, parent: tuple[float, float]) -> None:
    support, mean, std, _ = KNOWN[name]
    assert maximum_entropy(support, mean, std).parent == pytest.approx(parent, rel=5e-6)


def test_that_the_parent_is_not_what_is_known() -> None:
    naive = cut_normal(0.0, 1.0, 1e-3, 9e-4)
    assert naive.mean / 1e-3 - 1.0 == pytest.approx(0.22, abs=0.005)


def test_that_there_is_no_parent_where_the_density_is_dented() -> None:
    law = maximum_entropy((0.0, 1.0), 0.5, 0.35)
    assert law.parent is None
    assert law.multipliers[2] == pytest.approx(-6.4, abs=0.05)
    assert law.multipliers[1] == pytest.approx(-law.multipliers[2], rel=1e-12)  # by symmetry


def test_that_the_multipliers_give_the_density(law: MaxentDistribution) -> None:
    l0, l1, l2 = law.multipliers
    x = law.quantile(np.array([0.03, 0.4, 0.98]))
    third = np.log(x) if law.third == "log x" else x * x
    assert law.density(x) == pytest.approx(np.exp(-l0 - l1 * x - l2 * third), rel=1e-9)


def test_that_the_density_has_the_moments_that_are_told(law: MaxentDistribution) -> None:
    low, high = ends(law)
    middle = float(law.quantile(np.array(0.5)))
    for power, expected in ((0, 1.0), (1, 0.0), (2, 1.0)):
        whole = integral(law, power, low, middle) + integral(law, power, middle, high)
        assert whole == pytest.approx(expected, abs=1e-9)


def test_that_what_is_known_is_met(law: MaxentDistribution, request: pytest.FixtureRequest) -> None:
    _, mean, std, mean_log = next(
        known for known in KNOWN.values() if maximum_entropy(*known).multipliers == law.multipliers
    )
    if mean is not None:
        assert law.mean == pytest.approx(mean, abs=1e-12 * law.std)
    if std is not None:
        # nearly uniform, a law's width hangs on the last digits of its multipliers
        assert law.std == pytest.approx(std, rel=1e-10)
    if mean_log is not None:
        values = law.quantile((np.arange(200_000) + 0.5) / 200_000)
        assert np.log(values).mean() == pytest.approx(mean_log, abs=2e-5)


def test_that_quantiles_invert_the_integral_of_the_density(law: MaxentDistribution) -> None:
    probabilities = np.array([1e-4, 0.025, 0.3, 0.6, 0.975, 0.9999])
    values = law.quantile(probabilities)
    low, high = ends(law)
    for probability, value in zip(probabilities[:3], values[:3], strict=True):
        assert integral(law, 0, low, value) == pytest.approx(probability, rel=1e-9)
    for probability, value in zip(probabilities[3:], values[3:], strict=True):
        assert integral(law, 0, value, high) == pytest.approx(1.0 - probability, rel=1e-9)


def test_that_a_million_draws_have_the_mean_and_the_std(
    law: MaxentDistribution, uniforms: FloatArray
) -> None:
    draws = law.quantile(uniforms)
    centred = draws - law.mean
    # each within 4 of its own standard errors, the draws' fourth moment telling that of the std
    assert abs(centred.mean()) < 4.0 * law.std / 1e3
    fourth = np.sqrt((centred**4).mean() / law.std**4 - 1.0)
    assert abs((centred**2).mean() / law.std**2 - 1.0) < 4.0 * fourth / 1e3


def test_that_quantiles_rise_from_end_to_end(law: MaxentDistribution) -> None:
    probabilities = np.concatenate([[0.0], np.logspace(-15, -1, 60), np.linspace(0.1, 1.0, 400)])
    values = law.quantile(probabilities)
    assert (values[0], values[-1]) == law.support
    assert np.all(np.diff(values) >= 0.0)
    assert law.quantile(probabilities.reshape(-1, 1)).shape == (461, 1)


def test_that_nothing_lies_outside_the_support(law: MaxentDistribution) -> None:
    low, high = law.support
    outside = np.array([low - 1.0 if low > -INF else 0.0, high + 1.0 if high < INF else 0.0])
    wrong = (outside < low) | (outside > high)
    assert np.all(law.density(outside[wrong]) == 0.0)


@pytest.mark.parametrize(
    ("low", "high"), [(-1.0, INF), (0.5, 30.0), (-0.3, 0.4), (3.0, 5.0), (-INF, 1.0)]
)
def test_that_the_table_agrees_with_the_closed_form(low: float, high: float) -> None:
    closed = cut_normal(low, high, 0.0, 1.0)
    if low == -INF:
        turned = QuadraticExponent(-high, INF, 1.0, -high, 0.5)
        table = -turned.quantile(np.linspace(0.999, 0.001, 500))
    else:
        table = QuadraticExponent(low, high, 1.0, low, 0.5).quantile(np.linspace(0.001, 0.999, 500))
    assert table == pytest.approx(closed.quantile(np.linspace(0.001, 0.999, 500)), abs=2e-12)


def test_that_quantiles_of_the_hard_case_are_right_to_10_digits_far_out_too() -> None:
    law = maximum_entropy(*KNOWN["hard"])
    mean, std = law.parent or (0.0, 1.0)
    for probability in (1e-4, 0.01, 0.5, 0.999, 1.0 - 1e-9):
        value = float(law.quantile(np.array(probability)))
        whole = stats.norm.sf(-mean / std)
        above = stats.norm.sf((value - mean) / std) / whole
        assert above == pytest.approx(1.0 - probability, rel=2e-10)
    # the density is flat where the law begins
    first = float(law.quantile(np.array(1e-6)))
    assert first * float(law.density(np.array(0.0))) == pytest.approx(1e-6, rel=1e-5)


@pytest.mark.parametrize("depth", [6.0, 40.0, 1e3])
def test_that_a_support_far_in_the_parents_tail_is_nearly_exponential(depth: float) -> None:
    law = cut_normal(depth, INF, 0.0, 1.0)
    # Mills' ratio, by its continued fraction's first terms
    assert law.mean - depth == pytest.approx(1.0 / depth, rel=2.1 / depth**2)
    assert law.std == pytest.approx(1.0 / depth, rel=3.1 / depth**2)
    mirrored = cut_normal(-INF, -depth, 0.0, 1.0)
    assert mirrored.quantile(np.array(0.2)) == pytest.approx(-law.quantile(np.array(0.8)))


def test_that_a_gamma_law_is_scipys() -> None:
    for shape in (0.02, 0.5, 1.0, 3.0, 70.0, 2e3):
        log_mean = float(digamma(shape)) - math.log(shape) + math.log(7.0)
        law = maximum_entropy((0.0, INF), 7.0, None, log_mean)
        probabilities = np.array([1e-9, 0.01, 0.3, 0.7, 0.99])
        expected = stats.gamma.ppf(probabilities, shape, scale=7.0 / shape)
        assert law.quantile(probabilities) == pytest.approx(expected, rel=1e-8, abs=1e-300)
        assert law.std == pytest.approx(7.0 / math.sqrt(shape))
        assert law.density(np.array([0.3, 7.0])) == pytest.approx(
            stats.gamma.pdf([0.3, 7.0], shape, scale=7.0 / shape), rel=1e-8
        )


INFEASIBLE = [
    ((0.0, INF), 307.0, 320.0, None, "std 320 is more than mean - low = 307"),
    ((-INF, 0.0), -5.0, 6.0, None, "std 6 is more than high - mean = 5"),
    ((0.0, 1.0), 0.5, 0.5, None, "std 0.5 is not less than sqrt"),
    ((0.0, 1.0), 0.1, 0.4, None, "(high - mean)) = 0.3"),
    ((0.0, 1.0), 0.5, 0.0, None, "std 0 is not above zero"),
    ((0.0, 1.0), 1.0, 0.1, None, "mean 1 is not inside the support [0, 1]"),
    ((0.0, INF), -1.0, None, None, "mean -1 is not inside the support [0, inf)"),
    (
        (0.0, INF),
        None,
        None,
        None,
        "[0, inf) alone determines no distribution, since it is unbounded",
    ),
    ((-INF, INF), 3.0, None, None, "mean 3 alone determines no distribution on (-inf, inf)"),
    ((0.0, 1.0), None, 0.1, None, "a std alone determines no distribution"),
    ((1.0, 1.0), None, None, None, "the support must increase, got 1 to 1"),
    ((math.nan, 1.0), None, None, None, "the support must increase"),
    ((-1.7e308, 1.7e308), None, None, None, "too wide"),
    ((0.0, 1.0), math.nan, 0.1, None, "must be finite"),
    ((0.0, INF), 7.0, None, 2.0, "mean_log 2 is not less than log(mean) = 1.94591"),
    ((0.0, 9.0), 7.0, None, 1.0, "mean_log needs the support [0, inf), got [0, 9]"),
    ((0.0, INF), 7.0, 1.0, 1.0, "replaces the std"),
    ((0.0, INF), None, None, 1.0, "mean_log 1 needs the mean too"),
    ((0.0, INF), -7.0, None, 1.0, "mean -7 is not inside"),
    (
        (0.0, 1e9),
        1.0,
        1.1,
        None,
        "std 1.1 is more than mean - low = 1, which requires a probability",
    ),
    ((-1e9, 0.0), -1.0, 1.1, None, "std 1.1 is more than high - mean = 1, which requires"),
]


@pytest.mark.parametrize(("support", "mean", "std", "mean_log", "told"), INFEASIBLE)
def test_that_what_no_law_can_have_is_refused_by_its_limit(
    support: tuple[float, float],
    mean: float | None,
    std: float | None,
    mean_log: float | None,
    told: str,
) -> None:
    with pytest.raises(Infeasible) as caught:
        maximum_entropy(support, mean, std, mean_log)
    assert told in str(caught.value)
    assert isinstance(caught.value, ValueError)
    assert isinstance(caught.value, WearsimError)
    assert caught.value.exit_code == 2


@pytest.mark.parametrize("short", [1e-1, 1e-4, 1e-8])
@pytest.mark.parametrize("mean", [0.5, 0.03, 0.999])
def test_that_spreads_just_below_the_limit_of_a_bounded_support_are_met(
    mean: float, short: float
) -> None:
    std = math.sqrt(mean * (1.0 - mean)) * (1.0 - short)
    law = maximum_entropy((0.0, 1.0), mean, std)
    assert law.mean == pytest.approx(mean, rel=1e-12)
    assert law.std == pytest.approx(std, rel=1e-12)


@pytest.mark.parametrize("short", [1e-3, 1e-6, 1e-10])
def test_that_spreads_just_below_the_exponential_law_s_go_over_into_it(short: float) -> None:
    law = maximum_entropy((0.0, INF), 2.0, 2.0 * (1.0 - short))
    assert law.std == pytest.approx(2.0 * (1.0 - short), rel=1e-13)
    exponential = maximum_entropy((0.0, INF), 2.0)
    values = np.linspace(0.01, 0.99, 50)
    assert law.quantile(values) == pytest.approx(exponential.quantile(values), rel=10.0 * short)


def test_that_a_spike_at_a_far_limit_is_told() -> None:
    (told,) = maximum_entropy((0.0, 1.0), 1e-3, 1.1e-3).warnings
    assert "a spike with a probability of 2.1e-07 is at the end 1" in told
    (mirrored,) = maximum_entropy((-1.0, 0.0), -1e-3, 1.1e-3).warnings
    assert "a spike with a probability of 2.1e-07 is at the end -1" in mirrored
    assert maximum_entropy((0.0, 1.0), 1e-3, 9e-4).warnings == ()


def test_that_the_spike_makes_up_the_std() -> None:
    law = maximum_entropy((0.0, 1.0), 1e-3, 1.1e-3)
    antimode = law.antimode
    assert antimode is not None
    above = integral(law, 0, 0.96, 1.0)
    assert above == pytest.approx(antimode[1], rel=1e-6)
    assert integral(law, 2, 0.0, 0.04) + integral(law, 2, 0.96, 1.0) == pytest.approx(1.0, rel=1e-9)


def test_that_mirrored_knowledge_gives_the_mirrored_law() -> None:
    law, turned = (
        maximum_entropy((0.0, 1.0), 0.2, 0.1),
        maximum_entropy((-1.0, 0.0), -0.2, 0.1),
    )
    assert isinstance(law, TruncatedNormal)
    values = np.linspace(0.0, 1.0, 33)
    assert turned.quantile(values) == pytest.approx(-law.quantile(1.0 - values), abs=1e-14)
    assert turned.multipliers == pytest.approx(
        (law.multipliers[0], -law.multipliers[1], law.multipliers[2])
    )


def test_that_the_unit_does_not_matter() -> None:
    si, engineers = maximum_entropy((0.0, INF), 3e-6, 1e-6), maximum_entropy((0.0, INF), 3.0, 1.0)
    assert si.quantile(np.array(0.1)) == pytest.approx(engineers.quantile(np.array(0.1)) * 1e-6)
    assert si.multipliers[2] == pytest.approx(engineers.multipliers[2] * 1e12)


def test_that_laws_travel_between_processes(law: MaxentDistribution) -> None:
    values = np.linspace(0.01, 0.99, 9)
    assert np.array_equal(
        pickle.loads(pickle.dumps(law)).quantile(values),  # it was made here
        law.quantile(values),
    )


@settings(max_examples=150, deadline=None)
@given(
    low=st.floats(-1e3, 1e3),
    width=st.floats(1e-3, 1e3),
    place=st.floats(1e-4, 1.0 - 1e-4),
    part=st.floats(1e-4, 0.9999),
)
def test_that_any_feasible_knowledge_on_a_bounded_support_is_met(
    low: float, width: float, place: float, part: float
) -> None:
    high, mean = low + width, low + place * width
    std = part * math.sqrt((mean - low) * (high - mean))
    law = maximum_entropy((low, high), mean, std)
    rounding = 1e-15 * max(abs(low), abs(high)) / min(std, mean - low, high - mean)
    assert law.mean == pytest.approx(mean, abs=(1e-10 + 10 * rounding) * std)
    assert law.std == pytest.approx(std, rel=1e-10 + 100 * rounding / (1.0 - part))
    middle = law.quantile((np.arange(2000) + 0.5) / 2000)
    assert middle.mean() == pytest.approx(law.mean, abs=0.02 * std + 1e-3 * width)


@settings(max_examples=60, deadline=None)
@given(
    low=st.floats(-10.0, 10.0),
    above=st.floats(1e-3, 1e3),
    part=st.floats(1e-4, 1.0),
    upside_down=st.booleans(),
)
def test_that_any_feasible_knowledge_with_one_limit_is_met(
    low: float, above: float, part: float, upside_down: bool
) -> None:
    mean = low + above
    std = part * (mean - low)
    sign, support = (-1.0, (-INF, -low)) if upside_down else (1.0, (low, INF))
    law = maximum_entropy(support, sign * mean, std)
    rounding = 1e-15 * max(abs(low), 1.0) / min(std, above)
    assert law.mean == pytest.approx(sign * mean, abs=(1e-10 + 10 * rounding) * std)
    assert law.std == pytest.approx(std, rel=1e-10 + 100 * rounding)

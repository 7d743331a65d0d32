"""Estimates, moments and noise of few values against formulas written out."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy import stats
from scipy.optimize import brentq

from wearsim.uq.distributions.base import Distribution, Exponential, Uniform
from wearsim.uq.distributions.maxent import Gamma, Infeasible, gamma_shape, maximum_entropy
from wearsim.uq.distributions.mixture import Mixture
from wearsim.uq.distributions.truncated_normal import cut_normal
from wearsim.uq.distributions.two_levels import TwoLevels, weighted_quantiles
from wearsim.uq.estimation.estimates import Target, WeightedDistribution, estimate
from wearsim.uq.estimation.intervals import (
    UNKNOWN,
    Interval,
    arrays_of,
    bisect,
    t_interval,
    t_quantile,
)
from wearsim.uq.estimation.mann_whitney import paired, part_below, superiority
from wearsim.uq.estimation.moments import (
    are_equal,
    converge,
    fractional_ranks,
    order_ranks,
    summarise,
)
from wearsim.uq.estimation.standard_errors import Control, Controlled, Replicated

VALUES = np.array([0.3, 1.2, 0.8, 2.9, 1.1, 0.5, 1.9, 0.7, 1.4, 1.0, 2.2, 0.2])
Z = 1.959963984540054


def parts(found: Interval) -> list[float]:
    """Return value and ends."""
    return [found.value, found.low, found.high]


@pytest.mark.parametrize("count", [2, 3, 5, 12])
def test_moments_of_few_values_are_those_of_their_formulas(count: int) -> None:
    some = VALUES[:count]
    found = summarise(some, (0.5,))
    s, m4 = some.std(ddof=1), ((some - some.mean()) ** 4).mean()
    square = max(m4 - s**4 * (count - 3) / (count - 1), 0.0)
    assert found.std_error == pytest.approx(math.sqrt(square / count) / (2.0 * s))
    assert (found.std, found.mean_error) == pytest.approx((s, s / math.sqrt(count)))
    if count > 2:
        assert found.skewness == pytest.approx(stats.skew(some, bias=False))
    else:
        assert math.isnan(found.skewness)
    path = converge(VALUES, np.array([1, count]))
    assert path.mean == pytest.approx([VALUES[0], some.mean()])
    assert path.std[1] == pytest.approx(s)
    assert path.std_error[1] == pytest.approx(found.std_error)
    assert np.isnan([path.std[0], path.mean_error[0], path.std_error[0]]).all()


def test_interval_of_a_summarised_quantile_is_between_order_statistics() -> None:
    values = np.concatenate([VALUES, VALUES + 3.1])
    low, high = order_ranks(24, 0.4)
    found = summarise(values, (0.4,)).quantile(0.4)
    ordered = np.sort(values)
    assert (found.value, found.low, found.high) == (
        np.quantile(values, 0.4),
        ordered[low - 1],
        ordered[high - 1],
    )


def test_two_values_that_agree_are_equal_and_one_is_not() -> None:
    assert are_equal(np.array([0.3, 0.3]))
    assert not are_equal(np.array([0.3]))
    assert not are_equal(np.array([0.3, 0.3 + 1e-8]))


def test_intervals_are_those_of_student() -> None:
    for degrees in (1, 4.5, 200):
        assert t_quantile(degrees) == pytest.approx(stats.t.ppf(0.975, degrees))
    assert t_quantile(math.inf) == pytest.approx(Z)
    assert parts(t_interval(2.0, 0.5, 3)) == pytest.approx(
        [2.0, *stats.t.interval(0.95, 3, 2.0, 0.5)]
    )
    one = Interval(0.5, -1.0, 3.0)
    assert one.half_width == 2.0
    assert parts(one.within(0.0, 1.0)) == [0.5, 0.0, 1.0]
    assert arrays_of([one, UNKNOWN])[:, 0].tolist() == [0.5, -1.0, 3.0]
    assert arrays_of([]).shape == (3, 0)
    low, high = bisect(lambda x: x < 0.3, 0.0, 1.0, 3)
    assert (low, high) == (0.25, 0.375)


def std_by_leaving_out(values: np.ndarray, error_of, degrees: float) -> list[float]:
    """Return the factors of the interval of a std, from the log variance without each value."""
    count = len(values)
    logs = [math.log(np.delete(values, k).var(ddof=1)) for k in range(count)]
    whole = math.log(values.var(ddof=1))
    pseudo = count * whole - (count - 1) * np.array(logs)
    middle = pseudo.mean() - whole
    reach = stats.t.ppf(0.975, degrees) * error_of(pseudo)
    return [math.exp(0.5 * (middle - reach)), math.exp(0.5 * (middle + reach))]


def test_plain_estimates_of_few_values() -> None:
    found = estimate(VALUES, (0.3, 0.5))
    s = VALUES.std(ddof=1)
    assert parts(found.std) == pytest.approx(
        [s, *(s * x for x in std_by_leaving_out(VALUES, stats.sem, 11))]
    )
    ordered = np.sort(VALUES)
    for p in (0.3, 0.5):
        ranks = fractional_ranks(12.0, p)
        known = [np.interp(rank, np.arange(1, 13), ordered) for rank in ranks]
        known = [
            x if 1 <= rank <= 12 else math.copysign(math.inf, rank - 6)
            for x, rank in zip(known, ranks, strict=True)
        ]
        assert parts(found.quantile(p)) == pytest.approx([np.quantile(VALUES, p), *known])
    with pytest.raises(ValueError, match=r"0\.4"):
        found.quantile(0.4)


GROUPS = np.array([0, 0, 0, 1, 1, 1, 2, 2, 2, 2, 3, 3])


def of_groups(part: np.ndarray, groups: np.ndarray) -> float:
    """Return the error of a ratio of cluster totals, after Cochran (1977)."""
    totals = np.array([(part - part.mean())[groups == g].sum() for g in np.unique(groups)])
    many = len(totals)
    return math.sqrt((totals**2).sum() * many / (many - 1)) / len(part)


@pytest.mark.parametrize(
    "groups", [GROUPS, np.arange(12) % 2, np.arange(12) // 2, np.argsort(np.argsort(VALUES)) % 2]
)
def test_replicated_estimates_have_the_error_of_their_groups(groups: np.ndarray) -> None:
    found, many = estimate(VALUES, (0.5,), "sobol", groups), len(np.unique(groups))
    error = of_groups(VALUES, groups)
    assert Replicated(groups).error(VALUES) == pytest.approx(error)
    reach = stats.t.ppf(0.975, many - 1) * error
    assert parts(found.mean) == pytest.approx(
        [VALUES.mean(), VALUES.mean() - reach, VALUES.mean() + reach]
    )
    # the variance is corrected for the error of the mean, which depends on the groups
    plain = VALUES.var() + error**2
    s = math.sqrt(plain)
    assert found.std.value == pytest.approx(s)
    if many >= 5:
        ends = std_by_leaving_out(VALUES, lambda part: of_groups(part, groups), many - 1)
        assert [found.std.low, found.std.high] == pytest.approx(
            [s * min(ends[0], 1.0), s * ends[1]]
        )
    else:
        assert (found.std.low, found.std.high) == (0.0, math.inf)
    middle = np.median(VALUES)
    error = of_groups((middle >= VALUES).astype(float), groups)
    error = max(error * stats.t.ppf(0.975, many - 1) / Z, 0.5 / 12)
    count = 0.25 / error**2
    distribution = WeightedDistribution(VALUES)
    low, high = (distribution.at(rank / (count + 1.0)) for rank in fractional_ranks(count, 0.5))
    assert parts(found.quantile(0.5)) == pytest.approx([middle, low, high])


def test_control_variate_is_a_regression_with_errors_left_out() -> None:
    control = VALUES**1.5 + np.array(
        [0.1, -0.3, 0.2, 0.4, -0.2, 0.0, 0.3, -0.1, 0.2, -0.4, 0.1, 0.0]
    )
    known = Control(control, 1.5, 0.05)
    errors = Controlled(known)
    design = np.column_stack([np.ones(12), control - 1.5])
    inverse = np.linalg.inv(design.T @ design) @ design.T
    assert errors.weights == pytest.approx(inverse[0])
    slopes = inverse @ VALUES
    away = []
    for k in range(12):
        others = np.arange(12) != k
        own = np.linalg.lstsq(design[others], VALUES[others], rcond=None)[0]
        away.append(VALUES[k] - design[k] @ own)
    error = math.hypot(math.sqrt(((inverse[0] * away) ** 2).sum()), slopes[1] * 0.05)
    assert errors.error(VALUES) == pytest.approx(error)
    assert errors.residuals(VALUES) == pytest.approx(VALUES - design @ slopes)
    saved = 1.0 - (VALUES - design @ slopes).var() / VALUES.var()
    found = estimate(VALUES, (), "control-variate", control=known)
    assert found.variance_saved == pytest.approx(saved)
    reach = stats.t.ppf(0.975, 10) * error
    assert parts(found.mean) == pytest.approx([slopes[0], slopes[0] - reach, slopes[0] + reach])
    deviation = VALUES - VALUES.mean()
    square = (deviation - inverse[0] @ deviation) ** 2
    plain = square.mean() + error**2
    variance = plain * math.exp((inverse[0] @ square - square.mean()) / plain)
    assert found.std.value == pytest.approx(math.sqrt(variance))
    assert not Control(control[:9], 1.0).is_usable
    assert Control(control[:10], 1.0).is_usable


def test_weighted_values_have_ranks_in_the_middle_of_their_weight() -> None:
    values, weights = np.array([3.0, 1.0, 2.0, 5.0]), np.array([0.4, 0.1, 0.3, 0.2])
    middles = np.cumsum([0.1, 0.3, 0.4, 0.2]) - 0.5 * np.array([0.1, 0.3, 0.4, 0.2]) - 0.5
    found = WeightedDistribution(values, weights)
    for p in (0.1, 0.35, 0.6, 0.9):
        known = np.interp(p, 0.5 + middles * 4.0 / 3.0, [1.0, 2.0, 3.0, 5.0])
        assert found.quantile(p) == pytest.approx(known)
    for level in (0.2, 0.5, 0.8):
        known = np.interp(level, 0.5 + middles * 4.0 / 5.0, [1.0, 2.0, 3.0, 5.0])
        assert found.at(level) == pytest.approx(known)


def test_targets_are_read_and_compared_with_the_half_width() -> None:
    for text, observable, statistic, width in (
        ("depth.mean 1%", "depth", "mean", 0.01),
        (" depth.median 2.5 %", "depth", 0.5, 0.025),
        ("width.q97.5 .5%", "width", 0.975, 0.005),
        ("b10 3%", "life", 0.1, 0.03),
        ("B0.5 12.5 %", "life", 0.005, 0.125),
    ):
        target = Target.parse(text)
        assert (target.observable, target.statistic) == (observable, statistic)
        assert target.width == pytest.approx(width)
        assert Target.parse(str(target)) == target
        assert target.probabilities == (() if isinstance(statistic, str) else (statistic,))
    for text in (
        "depth 1%",
        "depth.mean 0%",
        "depth.q0 1%",
        "depth.q100 1%",
        "b100 1%",
        "b0 3%",
        "b10 0%",
    ):
        with pytest.raises(ValueError, match="target"):
            Target.parse(text)
    values = np.tile(VALUES, 3)[:32]
    found = estimate(values, (0.5,))
    ratio = found.mean.half_width / found.mean.value
    for what, interval in (("mean", found.mean), ("std", found.std), (0.5, found.quantile(0.5))):
        target = Target("depth", what, 1.0)
        assert target.interval(found) == interval
        assert target.achieved(found) == pytest.approx(interval.half_width / interval.value)
    assert Target("depth", "mean", 1.0001 * ratio).reached(found)
    assert not Target("depth", "mean", 0.9999 * ratio).reached(found)
    assert not Target("depth", "mean", 10.0).reached(estimate(values[:31]))
    exact = Target("depth", "mean", 1.0).achieved(found)
    assert Target("depth", "mean", exact).reached(found)
    negative = estimate(-values)
    assert Target("depth", "mean", 1.0).achieved(negative) == pytest.approx(ratio)
    around = estimate(np.array([-1.0, 1.0]))
    assert Target("depth", "mean", 1.0).achieved(around) == math.inf
    assert Target("depth", "mean", 1.0).achieved(estimate(np.full(40, 0.0))) == 0.0


@pytest.mark.parametrize("shift", [0.0, 0.5, 1.8])
def test_superiority_has_the_interval_of_its_sources(shift: float) -> None:
    first, second = VALUES + shift, np.array([0.9, 1.0, 0.4, 1.5, 1.1, 0.8, 2.5])
    chance = np.array([[(a > b) + 0.5 * (a == b) for b in second] for a in first])
    assert part_below(first, second) == pytest.approx(chance.mean(axis=1))
    value, rows, columns = chance.mean(), chance.mean(axis=1), chance.mean(axis=0)
    shares = rows.var(ddof=1) / 12, columns.var(ddof=1) / 7
    degrees = sum(shares) ** 2 / (shares[0] ** 2 / 11 + shares[1] ** 2 / 6)
    reach = stats.t.ppf(0.975, degrees) * math.sqrt(sum(shares)) / (value * (1.0 - value))
    logit = math.log(value / (1.0 - value))
    ends = [1.0 / (1.0 + math.exp(-logit - side)) for side in (-reach, reach)]
    if not 0.1 < value < 0.9:

        def excess(true: float) -> float:  # method 5 of Newcombe (2006)
            more = (1.0 - true) / (2.0 - true) + true / (1.0 + true)
            variance = true * (1.0 - true) * (1.0 + 8.5 * more) / (12 * 7)
            return abs(value - true) - Z * math.sqrt(variance)

        ends = [
            min(ends[0], brentq(excess, 1e-9, value)),
            max(ends[1], brentq(excess, value, 1 - 1e-9)),
        ]
    assert parts(superiority(first, second)) == pytest.approx([value, *ends], rel=1e-6)
    assert superiority(first[:5], second) != UNKNOWN
    apart = superiority(VALUES + 9.0, second)
    true = brentq(
        lambda p: (
            1.0
            - p
            - Z
            * math.sqrt(
                p * (1.0 - p) * (1.0 + 8.5 * ((1.0 - p) / (2.0 - p) + p / (1.0 + p))) / (12 * 7)
            )
        ),
        *(0.1, 0.999),
    )
    assert parts(apart) == pytest.approx([1.0, true, 1.0])


def test_pairs_have_wilsons_interval() -> None:
    other = VALUES[::-1].copy()
    other[0], other[5] = VALUES[0], VALUES[5] - 1.0
    found = paired(VALUES, other)
    share = ((other < VALUES) + 0.5 * (other == VALUES)).mean()
    bend = Z**2 / 12
    middle = (share + 0.5 * bend) / (1.0 + bend)
    reach = math.sqrt(bend * share * (1.0 - share) + 0.25 * bend**2) / (1.0 + bend)
    assert parts(found.share) == pytest.approx([share, middle - reach, middle + reach])
    assert parts(found.difference) == pytest.approx(parts(estimate(VALUES - other).mean))


class Plain(Distribution):
    """Log-normal by its quantile function alone."""

    def quantile(self, probability):
        return stats.lognorm.ppf(probability, 0.3, scale=2.0)


def test_moments_of_a_quantile_function_are_integrals() -> None:
    law = stats.lognorm(0.3, scale=2.0)
    found = Plain()
    assert (found.mean, found.std) == pytest.approx((law.mean(), law.std()), rel=1e-9)
    assert found.support == (0.0, math.inf)
    assert found.warnings == ()


def test_uniform_and_exponential_densities_and_quantiles() -> None:
    uniform, p = Uniform(1.0, 4.0), np.array([0.0, 0.2, 0.5, 0.7, 1.0])
    assert uniform.density(np.array([0.9, 1.0, 2.0, 4.0, 4.1])) == pytest.approx(
        [0, *[1 / 3] * 3, 0]
    )
    assert uniform.quantile(p) == pytest.approx(1.0 + 3.0 * p)
    assert uniform.bulk == (1.0, 4.0)
    assert (uniform.mean, uniform.std) == pytest.approx((2.5, math.sqrt(0.75)), rel=1e-14)
    for rate, high in ((0.7, 4.0), (20.0, 4.0), (0.7, math.inf), (1e-9, 4.0)):
        law = (
            stats.truncexpon((high - 1.0) * rate, 1.0, 1.0 / rate)
            if math.isfinite(high)
            else stats.expon(1.0, 1.0 / rate)
        )
        found = Exponential(1.0, high, rate, law.mean(), law.std())
        inner = np.array([1e-9, 0.2, 0.5, 0.6, 0.999])
        fall = rate * (high - 1.0)
        exact = 1.0 - np.log1p(inner * math.expm1(-fall)) / rate
        assert found.quantile(inner) == pytest.approx(exact, rel=1e-7)
        x = np.array([1.0, 1.5, 3.9])
        density = rate * np.exp(-rate * (x - 1.0)) / -math.expm1(-fall)
        assert found.density(x) == pytest.approx(density)
        low, top = (1.0 - math.log1p(q * math.expm1(-fall)) / rate for q in (5e-4, 1.0 - 5e-4))
        near = 0.25 * (top - low)
        assert found.bulk == pytest.approx((1.0, high if high - top < near else top))
    middle = cut_normal(-10.0, 10.0, 0.0, 1.0)
    assert middle.bulk == pytest.approx((-3.2905267, 3.2905267))
    assert cut_normal(-3.5, 9.0, 0.0, 1.0).bulk == pytest.approx((-3.5, 3.29), abs=2e-3)


@pytest.mark.parametrize("shape", [0.02, 0.7, 30.0, 49.0, 51.0, 400.0, 1e5])
def test_gamma_shape_inverts_log_minus_digamma(shape: float) -> None:
    from scipy.special import digamma

    gap = math.log(shape) - float(digamma(shape))
    assert gamma_shape(gap) == pytest.approx(shape, rel=1e-13 + 2e-14 * shape)
    law = Gamma(3.0, math.log(3.0) - gap)
    x = np.array([0.5, 3.0, 4.0])
    l0, l1, l2 = law.multipliers
    assert law.density(x) == pytest.approx(stats.gamma.pdf(x, shape, scale=3.0 / shape), rel=1e-5)
    assert l0 + l1 * x + l2 * np.log(x) == pytest.approx(
        -stats.gamma.logpdf(x, shape, scale=3.0 / shape), rel=1e-5, abs=1e-3
    )


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (((0.0, 1e-151), 5e-152, None, None), "the width of the support 1e-151 is too small"),
        (((-1e-151, 0.0), None, None, None), "the width of the support 1e-151 is too small"),
        (((0.0, 1.0), 0.5, 1e-151, None), "std 1e-151 is too small to be squared"),
        (((0.0, 1.0), 1e-151, None, None), "the distance from the mean to the nearer end 1e-151"),
        (((0.0, 1e151), 1.0, None, None), "high 1e.151 is too large to be squared"),
        (((-1e151, 0.0), -1.0, None, None), "low -1e.151 is too large to be squared"),
        (((0.0, math.inf), 1e151, None, None), "mean 1e.151 is too large"),
        (((0.0, math.inf), 1.0, 1e151, None), "std 1e.151 is too large"),
        (((2.0, 1.0), None, None, None), "the support must increase, got 2 to 1"),
        (((0.0, 1.0), math.inf, None, None), "mean must be finite, got inf"),
        (((0.0, 1.0), 0.0, None, None), r"mean 0 is not inside the support \[0, 1\]"),
        (((0.0, math.inf), 2.0, -1.0, None), "std -1 is not above zero"),
        (((-math.inf, 1.0), 1.0, None, None), r"inside the support \(-inf, 1\]"),
        (
            ((1.0, math.inf), 7.0, None, 1.0),
            r"mean_log needs the support \[0, inf\), got \[1, inf\)",
        ),
        (((0.0, math.inf), 2.0, None, 0.7), "mean_log 0.7 is not less than log.mean. = 0.693147"),
        (((0.0, math.inf), 0.0, None, -1.0), "mean 0 is not inside"),
        (((0.0, math.inf), 1.0, None, 0.0), "mean_log 0 is not less than log.mean. = 0"),
        (((0.0, 1.0), 0.5, 0.6, None), "limit of any distribution"),
    ],
)
def test_impossible_moments_name_their_limit(call: tuple, message: str) -> None:
    with pytest.raises(Infeasible, match=message):
        maximum_entropy(*call)


def test_moments_of_the_uniform_and_exponential_distributions_are_recognised() -> None:
    uniform = maximum_entropy((1.0, 3.0), 2.0)
    assert (uniform.family, uniform.parent) == ("uniform", None)
    assert maximum_entropy((0.0, 1e150)).mean == 5e149
    exponential = maximum_entropy((1.0, math.inf), 3.0, 2.0)
    assert (exponential.family, exponential.parent) == ("exponential", None)
    assert maximum_entropy((1.0, math.inf), 3.0).mean == 3.0
    assert maximum_entropy((1.0, 4.0), 2.0).family == "truncated exponential"
    # the mean of a truncated exponential distribution, by its closed form
    truncated = maximum_entropy((0.0, 2.0), 0.6)
    rate = truncated.multipliers[1]
    assert 1.0 / rate - 2.0 / math.expm1(2.0 * rate) == pytest.approx(0.6, rel=1e-12)
    families = [
        cut_normal(low, high, 0.0, 1.0).family for low, high in ((0.0, math.inf), (-1.0, 2.0))
    ]
    assert families == ["truncated normal"] * 2
    assert cut_normal(-math.inf, math.inf, 0.0, 1.0).family == "normal"
    bent = maximum_entropy((1.0, 3.0), 1.8, 0.75)
    assert bent.family == "exponential of a quadratic"
    assert maximum_entropy((1.0, 3.0), 1.8, 0.2).family == "truncated normal"
    x = np.linspace(1.0, 3.0, 20_001)
    assert bent.antimode is not None
    assert bent.antimode[0] == pytest.approx(x[bent.density(x).argmin()], abs=1e-3)
    # the last quantile, where the end of the support is as far as the probability
    steep = Exponential(0.0, 41.0, 1.0, 1.0, 1.0)
    last = steep.quantile(np.array([1.0 - 2.0**-53]))[0]
    assert last == pytest.approx(-math.log(2.0**-53 + math.exp(-41.0)), rel=1e-12)


def test_posterior_on_a_grid_is_smoothed_and_has_exact_moments() -> None:
    t = np.array([0.0, 0.1, 0.4])
    m = np.stack([np.linspace(-1.0, 1.0, 5)] * 3)
    density = np.array(
        [[1.0, 2.0, 3.0, 2.0, 1.0], [0.0, 1.0, 4.0, 1.0, 0.0], [1.0, 1.0, 1.0, 1.0, 1e-12]]
    )
    found = TwoLevels.on_grid(t, m, density, 4, ["load"])
    weight = density * np.array([0.05, 0.2, 0.15])[:, None]
    kept = weight > 1e-8
    assert found.weight == pytest.approx(weight[kept] / weight[kept].sum(), rel=1e-6)
    # a third of the step of m, 0.5, is the least scatter
    scatter = np.broadcast_to(np.array([0.15, 0.15, 0.4])[:, None], m.shape)[kept]
    assert found.t.tolist() == scatter.tolist()
    assert found.m.tolist() == m[kept].tolist()
    assert (found.specimens, found.contained) == (4, ("load",))
    assert TwoLevels.on_grid(t, m, 1e-9 * density).m.tolist() == found.m.tolist()
    mean = found.weight @ np.exp(found.m + 0.5 * found.t**2)
    square = found.weight @ np.exp(2.0 * found.m + 2.0 * found.t**2)
    assert (found.mean, found.std) == pytest.approx((mean, math.sqrt(square - mean**2)))
    assert found.support == (0.0, math.inf)
    p = np.array([1e-9, 0.01, 0.3, 0.5, 0.97, 1.0 - 1e-9])
    for chance, value in zip(p, found.quantile(p), strict=True):
        z = (math.log(value) - found.m) / found.t
        below, above = found.weight @ stats.norm.cdf(z), found.weight @ stats.norm.sf(z)
        least = min(chance, 1.0 - chance)
        assert min(below, above) == pytest.approx(least, rel=2e-3)
    middle = found.plug_in
    half = np.array([0.5])
    assert middle == (
        weighted_quantiles(found.m, found.weight, half)[0],
        weighted_quantiles(found.t, found.weight, half)[0],
    )
    values, weights = np.array([3.0, 1.0, 2.0]), np.array([1.0, 2.0, 5.0])
    exact = np.interp([0.1, 0.4, 0.9], [0.125, 0.5625, 0.9375], [1.0, 2.0, 3.0])
    assert weighted_quantiles(values, weights, np.array([0.1, 0.4, 0.9])) == pytest.approx(exact)


def test_mixture_of_normal_distributions_is_their_weighted_sum() -> None:
    one, other = (
        cut_normal(-math.inf, math.inf, -1.0, 0.5),
        cut_normal(-math.inf, math.inf, 2.0, 1.5),
    )
    found = Mixture([one, other], [3.0, 1.0])
    assert found.weights == (0.75, 0.25)
    mean = 0.75 * -1.0 + 0.25 * 2.0
    std = math.sqrt(0.75 * (0.25 + (1.0 + mean) ** 2) + 0.25 * (2.25 + (2.0 - mean) ** 2))
    assert (found.mean, found.std) == pytest.approx((mean, std))
    x = np.array([-3.0, -1.0, 0.5, 4.0])
    known = 0.75 * stats.norm.cdf(x, -1.0, 0.5) + 0.25 * stats.norm.cdf(x, 2.0, 1.5)
    assert found.cumulative(x) == pytest.approx(known, abs=1e-7)
    assert found.quantile(known) == pytest.approx(x, abs=1e-5)
    assert found.quantile(np.array([[0.0, 1.0]])).tolist() == [[-math.inf, math.inf]]
    positive = Mixture([Uniform(0.0, 1.0), Uniform(3.0, 5.0)], [1.0, 1.0])
    assert positive.support == (0.0, 5.0)
    p = np.array([0.0, 0.1, 0.49, 0.5, 0.75, 1.0])
    assert positive.quantile(p) == pytest.approx([0.0, 0.2, 0.98, 1.0, 4.0, 5.0], abs=1e-6)
    assert positive.cumulative(np.array([0.5, 2.0, 3.5])) == pytest.approx(
        [0.25, 0.5, 0.625], abs=1e-7
    )

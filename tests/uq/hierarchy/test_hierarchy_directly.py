"""Likelihoods, posterior and verdicts of wear factors against plain formulas for normal values."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy import stats
from scipy.optimize import brentq
from scipy.special import ndtr, ndtri

from tests.uq.hierarchy.likelihoods import normal
from wearsim.uq.hierarchy.kernels import LikelihoodMixture
from wearsim.uq.hierarchy.pooled import (
    Hierarchy,
    Posterior,
    half_normal,
    ratios,
    scatters,
    trapezoid_weights,
    upper_limits,
)
from wearsim.uq.hierarchy.verdict import Design, Power, simulated_centres, word
from wearsim.uq.sampling.sobol import Stream

TWO = LikelihoodMixture(np.array([0.7, 0.3]), np.array([0.0, 1.0]), np.array([0.1, 0.2]))


def test_draws_are_smoothed_by_silvermans_width_and_moved_to_keep_the_variance():
    log = np.array([0.0, -1.0, -2.0, -0.5, -40.0])
    centre, std = np.array([1.0, 2.0, -1.0, 0.5, 9.0]), np.array([0.1, 0.2, 0.3, 0.2, 5.0])
    found = LikelihoodMixture.of(log, centre, std)
    weight = np.exp(log[:4]) / np.exp(log[:4]).sum()  # the last one is negligible
    size = 1.0 / (weight**2).sum()
    mean = weight @ centre[:4]
    spread = math.sqrt(weight @ (centre[:4] - mean) ** 2)
    width = 0.9 / size**0.2
    assert found.weight == pytest.approx(weight)
    assert found.effective_size == pytest.approx(size)
    assert found.variance_of_inputs == pytest.approx(spread**2)
    assert found.std == pytest.approx(np.sqrt(std[:4] ** 2 + (width * spread) ** 2))
    assert found.centre == pytest.approx(mean + math.sqrt(1.0 - width**2) * (centre[:4] - mean))
    assert found.variance == pytest.approx(spread**2 + weight @ std[:4] ** 2)
    single = LikelihoodMixture.of(np.zeros(1), np.ones(1), np.full(1, 0.2))
    assert (single.mean, single.variance, single.effective_size) == pytest.approx((1, 0.04, 1))


def test_quantiles_and_deviations_are_those_of_the_parts():
    for p in (0.01, 0.4, 0.71, 0.99):
        exact = brentq(lambda x: 0.7 * ndtr(x / 0.1) + 0.3 * ndtr((x - 1.0) / 0.2) - p, -5.0, 5.0)  # noqa: B023
        assert TWO.quantile(np.array([p]))[0] == pytest.approx(exact, abs=1e-4)
    uniform = np.array([[0.1, 0.69, 0.71, 1.0], [0.3, 0.5, 0.9, 0.2]])
    expected = (
        0.3 - np.array([0.0, 0.0, 1.0, 1.0]) + np.array([0.1, 0.1, 0.2, 0.2]) * ndtri(uniform[1])
    )
    assert TWO.deviations(uniform) == pytest.approx(expected, abs=1e-12)


def test_table_is_the_density_of_the_apparent_value_with_scatter():
    t = np.array([0.0, 0.5])
    scale, log_density = TWO.table(t)
    variance = 0.7 * (0.09 + 0.01) + 0.3 * (0.49 + 0.04)
    assert scale == pytest.approx(np.sqrt(variance + t**2))
    for row, unit in enumerate(scale):
        u = unit * np.linspace(-9.0, 9.0, log_density.shape[1])
        density = 0.7 * stats.norm.pdf(u, 0.3, math.hypot(0.1, t[row]))
        density += 0.3 * stats.norm.pdf(u, -0.7, math.hypot(0.2, t[row]))
        known = density > 0.0
        assert log_density[row][known] == pytest.approx(np.log(density[known]), abs=1e-9)


def test_neighbours_of_many_parts_are_merged_with_their_moments():
    rng = np.random.default_rng(1)
    weight, centre, std = rng.random(450), rng.standard_normal(450), 0.1 + rng.random(450)
    weight /= weight.sum()
    order = np.argsort(centre)
    merged = []
    for k in range(200):
        some = order[450 * k // 200 : 450 * (k + 1) // 200]
        total, mean = weight[some].sum(), np.average(centre[some], weights=weight[some])
        square = np.average(std[some] ** 2 + (centre[some] - mean) ** 2, weights=weight[some])
        merged.append((total, mean, math.sqrt(square)))
    known = LikelihoodMixture(*np.array(merged).T)
    found = LikelihoodMixture(weight, centre, std)
    for one, other in zip(found.table(np.ones(1)), known.table(np.ones(1)), strict=True):
        assert one == pytest.approx(other, rel=1e-9)
    unmerged = LikelihoodMixture(*np.array(merged).T[:, ::-1])
    assert unmerged.table(np.ones(1))[1] == pytest.approx(known.table(np.ones(1))[1], rel=1e-12)


def test_grid_rule_and_prior_of_the_scatter():
    assert scatters(4) == pytest.approx(6.0 * np.array([0.0, 1.0, 4.0, 9.0]) / 9.0)
    grid = np.array([0.0, 0.2, 0.5, 1.5])
    values = np.array([1.0, 3.0, -2.0, 0.5])
    assert trapezoid_weights(grid) @ values == pytest.approx(np.trapezoid(values, grid))
    for scale in (0.5, 2.0):
        assert half_normal(grid, scale) == pytest.approx(stats.halfnorm.pdf(grid, scale=scale))
    assert half_normal(grid) == pytest.approx(stats.halfnorm.pdf(grid, scale=0.5))


@pytest.mark.parametrize("far", [0.8, 60.0])
def test_likelihood_of_mean_and_scatter_is_the_product_of_normal_densities(far: float):
    t = np.array([0.0, 0.7, 2.0])
    hierarchy = Hierarchy([normal(0.0, 0.3), normal(0.0, 0.5)], t, 3)
    centres = np.array([[0.1, far, -0.4], [0.0, 0.0, 0.3]])
    std = np.hypot(np.array([0.3, 0.5, 0.3]), t[:, None])
    for row in range(3):
        m, log_likelihood = hierarchy.on_grid(centres, row, 21)
        precision = 1.0 / std[row] ** 2
        middle = centres @ precision / precision.sum()
        half = 6.5 / math.sqrt(precision.sum())
        assert m == pytest.approx(np.linspace(middle - half, middle + half, 21, axis=1))
        known = stats.norm.logpdf(centres[:, None, :], m[:, :, None], std[row]).sum(axis=2)
        assert log_likelihood == pytest.approx(known, rel=1e-3, abs=2e-3)
    equal = Hierarchy([normal(0.0, 0.3)], t, 3)
    sets = np.array([[0.1, 0.8, -0.4], [0.0, 0.0, 0.3]])
    squares = ((sets - sets.mean(axis=1, keepdims=True)) ** 2).sum(axis=1)[:, None]
    variance = 0.09 + t**2
    # over m with a flat prior
    known = -np.log(2.0 * np.pi * variance) - 0.5 * np.log(3.0) - 0.5 * squares / variance
    assert equal.integrated(sets) == pytest.approx(known, abs=3e-3)


def test_limits_and_ratios_are_those_of_each_set():
    t = scatters(400)
    upper = upper_limits(np.stack([np.zeros(400), -0.5 * (t / 0.2) ** 2]), t, 0.9)
    both = 1.0 / math.hypot(1.0 / 0.5, 1.0 / 0.2)
    known = [stats.halfnorm.ppf(0.9, scale=scale) for scale in (0.5, both)]
    assert upper == pytest.approx(known, abs=1e-3)
    assert ratios(np.array([[-3.0, -1.0, -2.0], [0.5, 0.2, 0.1]])).tolist() == [4.0, 0.0]


def test_posterior_of_equal_normal_tests_is_that_of_the_integrals():
    centres, std, scale = np.array([-0.4, 0.1, 0.5, 0.6]), 0.2, 0.9
    posterior = Posterior.of([normal(one, std) for one in centres], 80)
    t = np.linspace(0.0, 6.0, 3001)
    variance = std**2 + t**2
    squares = ((centres - centres.mean()) ** 2).sum()
    evidence = np.exp(-0.5 * squares / variance) / variance**1.5
    for given in (None, scale):
        prior = stats.halfnorm.pdf(t, scale=given or 0.5)
        factor = evidence[0] / np.trapezoid(evidence * prior, t)
        assert posterior.bayes_factor(given) == pytest.approx(factor, rel=2e-3)
        below = np.cumsum(evidence * prior)
        known = np.interp((0.1, 0.5, 0.9), below / below[-1], t)
        assert posterior.scatter((0.1, 0.5, 0.9), given) == pytest.approx(known, abs=5e-3)
    weight = evidence * stats.halfnorm.pdf(t, scale=0.5)
    weight /= weight.sum()
    found = posterior.density() * trapezoid_weights(posterior.t)[:, None]
    assert (found.sum(axis=1) * np.diff(posterior.m)[:, 0]).sum() == pytest.approx(1.0)

    def quantile(p: float, square: np.ndarray) -> float:
        return float(
            brentq(lambda x: weight @ ndtr((x - centres.mean()) / np.sqrt(square)) - p, -9.0, 9.0)
        )

    shares = (0.025, 0.3, 0.9)
    of_mean = [quantile(p, variance / 4.0) for p in shares]
    assert posterior.mean(shares) == pytest.approx(of_mean, abs=4e-3)
    following = [quantile(p, variance / 4.0 + t**2) for p in shares]
    assert posterior.next(shares) == pytest.approx(following, abs=5e-3)
    more = [quantile(p, variance / 4.0 + t**2 + 0.49) for p in shares]
    assert posterior.next(shares, 0.7) == pytest.approx(more, abs=5e-3)


def test_simulated_tests_are_normal_scatter_with_deviations_of_their_kernels():
    kernels = [normal(0.2, 0.1), TWO]
    found = simulated_centres(kernels, 3, 5, 0.6, 7, "name")
    numbers = Stream(7, "name", "test").rows(0, 5, 9)
    for test in range(3):
        own = kernels[test % 2].deviations(numbers[:, [3 + test, 6 + test]].T)
        assert found[:, test] == pytest.approx(0.6 * ndtri(numbers[:, test]) + own)


def test_design_decides_by_the_simulated_quantile_and_the_upper_limit():
    design = Design([normal(0.0, 0.1), normal(0.0, 0.3)], 4, negligible=0.15, seed=3, sets=300)
    null = ratios(design.hierarchy.integrated(design.simulated(0.0, "null")))
    assert design.quantile == pytest.approx(np.quantile(null, 0.95))
    assert len(null) == 300
    sets = np.array([[0.0, 0.0, 0.0, 0.0], [0.3, -0.2, -0.3, 0.4], [1.0, -1.0, 1.5, -1.0]])
    both = design.hierarchy.integrated(sets)
    upper = upper_limits(both, design.hierarchy.t, 0.95)
    decision = design.decide(sets)
    for k, centres in enumerate(sets):
        said = word(design.ratio(centres) > design.quantile, upper[k], 0.15)
        assert (bool(decision.random[k]), bool(decision.explained[k])) == (
            said == "random",
            said == "explained",
        )
    assert decision.random[2]
    drawn = design.decide(design.simulated(0.5, "scatter 0.5"))
    assert design.rates(0.5) == (drawn.random.mean(), drawn.explained.mean())
    assert len(Design([normal(0.0, 0.1)] * 2, sets=20).simulated(0.0, "a")[0]) == 2


def test_verdict_is_equivalence_first():
    assert [word(True, 0.1, 0.2), word(False, 0.2, 0.2), word(True, 0.2, 0.2)] == [
        "explained",
        "undecided",
        "random",
    ]


class Known(Power):
    """Power with a normal quantile that is linear in the logarithm of the number of tests."""

    def rates(self, tests: int, t: float) -> tuple[float, float]:
        return float(ndtr(-2.0 + t * math.log(tests))), 0.0


def test_needed_tests_are_interpolated_in_the_logarithm():
    power = Known([normal(0.0, 1.0)])
    for t in (0.7, 1.0, 1.3):
        exact = math.exp((ndtri(0.8) + 2.0) / t)
        assert power.needed(t) == math.ceil(exact)
    assert power.needed(9.0) == 2
    assert power.needed(0.5) is None  # 294 tests
    assert power.needed(0.5, most=300) == 294
    assert power.needed(1.0, power=0.5) == 8

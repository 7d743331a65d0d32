"""Noise of traces: whitening against Cholesky, and the fit on unworn parts."""

from __future__ import annotations

import numpy as np
import pytest

from wearsim.uq.hierarchy.noise import Noise, fit_noise, noise_models

NOISE = Noise(1e-6, 0.2e-3, 0.3e-6)


def covariance(y: np.ndarray, noise: Noise) -> np.ndarray:
    """Return the covariance matrix of the noise at positions."""
    process = noise.sigma**2 * np.exp(-np.abs(y[:, None] - y) / noise.length)
    return process + noise.white**2 * np.eye(len(y))


def test_whitening_equals_cholesky_with_uneven_spacing():
    rng = np.random.default_rng(1)
    y = np.sort(rng.uniform(0.0, 5e-3, 80))
    columns = rng.standard_normal((80, 3))
    expected = np.linalg.solve(np.linalg.cholesky(covariance(y, NOISE)), columns)
    assert NOISE.whitened(y, columns) == pytest.approx(expected, rel=1e-9)


def test_sampled_noise_has_the_covariance():
    rng = np.random.default_rng(2)
    y = np.linspace(0.0, 1e-3, 6)
    found = np.cov(NOISE.sample(y, rng.standard_normal((2, 6, 40_000))))
    assert found == pytest.approx(covariance(y, NOISE), abs=0.03e-12)


def test_fit_finds_length_and_both_parts():
    rng = np.random.default_rng(3)
    y = np.arange(-10e-3, 10e-3, 20e-6)
    unworn = np.abs(y) > 6e-3
    fits = []
    for _ in range(25):
        height = 5e-6 + 1e-3 * y + NOISE.sample(y, rng.standard_normal((2, len(y))))
        fits.append(fit_noise(y[unworn], height[unworn]))
    assert np.median([fit.sigma for fit in fits]) == pytest.approx(1e-6, rel=0.12)
    assert np.median([fit.length for fit in fits]) == pytest.approx(0.2e-3, rel=0.25)
    assert np.median([fit.white for fit in fits]) == pytest.approx(0.3e-6, rel=0.15)


def test_too_few_points_are_refused():
    with pytest.raises(ValueError, match="8 points"):
        fit_noise(np.linspace(0.0, 1.0, 7), np.zeros(7))


def means_and_stds(log: np.ndarray, mean: np.ndarray, std: np.ndarray) -> np.ndarray:
    """Return mean and standard deviation of mixtures over the first axis, shape (2, sets)."""
    weight = np.exp(log - log.max(axis=0))
    weight /= weight.sum(axis=0)
    whole = (weight * mean).sum(axis=0)
    return np.array([whole, np.sqrt((weight * (std**2 + (mean - whole) ** 2)).sum(axis=0))])


@pytest.mark.parametrize("length", [0.3e-3, 1.5e-3])
def test_integral_over_the_noise_equals_that_of_a_fine_grid(length: float):
    rng, noise, sets = np.random.default_rng(4), Noise(1e-6, length, 0.1e-6), 12
    y = np.arange(-12e-3, 12e-3, 0.16e-3)
    count = len(y)
    heights = noise.sample(y, rng.standard_normal((2, count, sets)))
    # the unknown that matters is the height of a step in both edges of a groove
    forms = np.column_stack([np.abs(y) < 7e-3, np.ones(count), y / 12e-3]).astype(float)
    freedom, rows = count - forms.shape[1], []
    for decades in np.linspace(-4.4, np.log10(12e-3), 22):
        for white in np.linspace(0.0, 1.0, 22)[:-1] ** 2:
            unit = Noise(float(np.sqrt(1.0 - white)), 10.0**decades, float(np.sqrt(white)))
            root = np.linalg.cholesky(covariance(y, unit))
            z = np.linalg.solve(root, np.column_stack([heights, forms]))
            inverse = np.linalg.inv(z[:, sets:].T @ z[:, sets:])
            found = inverse @ z[:, sets:].T @ z[:, :sets]
            squares = ((z[:, :sets] - z[:, sets:] @ found) ** 2).sum(axis=0)
            # on a grid of ln length, the density that is proportional to the length is its square
            log = np.log(100.0**decades * np.sqrt(max(white, 1e-4))) - np.log(np.diag(root)).sum()
            log += 0.5 * np.linalg.slogdet(inverse)[1] - 0.5 * freedom * np.log(squares)
            rows.append([log, found[0], np.sqrt(inverse[0, 0] * squares / freedom)])
    mean, std = means_and_stds(*np.array(rows).transpose(1, 0, 2))
    got = []
    for height in heights.T:
        models = noise_models(y, height, forms)
        z = models.whitened(np.column_stack([height, forms])).transpose(1, 0, 2)
        inverse = np.linalg.inv(z[:, :, 1:].transpose(0, 2, 1) @ z[:, :, 1:])
        found = np.einsum("mfg,mjg,mj->mf", inverse, z[:, :, 1:], z[:, :, 0])
        squares = ((z[:, :, 0] - np.einsum("mjf,mf->mj", z[:, :, 1:], found)) ** 2).sum(axis=1)
        log = models.log_weight - models.exponent * np.log(squares)
        deviation = np.sqrt(inverse[:, 0, 0] * squares / freedom)
        got.append(means_and_stds(*(v[:, None] for v in (log, found[:, 0], deviation)))[:, 0])
    means, stds = np.array(got).T
    assert means == pytest.approx(mean, abs=0.1 * std.min())
    assert stds == pytest.approx(std, rel=0.05)


def test_sampled_noise_is_a_chain_and_independent_errors():
    y, normal = (
        np.array([0.0, 1.0, 1.5, 4.0]),
        np.array([[1.0, -0.5, 2.0, 0.3], [0.4, 1.0, -1.0, 0.2]]),
    )
    noise, chain = Noise(2.0, 1.5, 0.5), [1.0]
    for j in range(1, 4):
        decay = np.exp(-(y[j] - y[j - 1]) / 1.5)
        chain.append(decay * chain[-1] + np.sqrt(1.0 - decay**2) * normal[0, j])
    assert noise.sample(y, normal) == pytest.approx(2.0 * np.array(chain) + 0.5 * normal[1])
    assert noise.std == pytest.approx(np.sqrt(4.25))


def test_known_least_noise_widens_the_likelihood_of_each_model():
    rng = np.random.default_rng(6)
    y = np.cumsum(rng.uniform(0.5, 1.5, 40))
    forms = np.column_stack([np.ones(40), y])
    residual = Noise(1.0, 3.0, 0.5).sample(y, rng.standard_normal((2, 40)))
    free, known = noise_models(y, residual, forms), noise_models(y, residual, forms, 1.4)
    z = free.whitened(np.column_stack([residual, forms])).transpose(1, 0, 2)
    squares = []
    for columns, lines in zip(z, free.lines.transpose(2, 1, 0), strict=True):
        away = columns[:, 0] - columns[:, 1:] @ np.linalg.lstsq(columns[:, 1:], columns[:, 0])[0]
        squares.append((away**2).sum())
        assert lines.T @ lines == pytest.approx(np.eye(2), abs=1e-12)
        assert lines.T @ away == pytest.approx([0.0, 0.0], abs=1e-9)
    assert free.exponent == pytest.approx(np.full(len(squares), 19.0))
    # the likelihood with the lines integrated, and priors of the length and of the white share
    volumes = [np.linalg.slogdet(columns[:, 1:].T @ columns[:, 1:])[1] for columns in z]
    prior = np.log(free.length**2 * free.white * (1.0 - free.white))
    log = np.log(free.scale).sum(axis=0) - 0.5 * np.array(volumes) + prior
    assert free.log_weight == pytest.approx(log)
    # a likelihood of a greater variance is flatter by its ratio, and equal at the residuals
    wider = np.maximum(1.0, 1.96 / (np.array(squares) / 38.0))
    assert (wider > 1.0).any()
    assert known.exponent == pytest.approx(19.0 / wider)
    free_log, known_log = (
        models.log_weight - models.exponent * np.log(squares) for models in (free, known)
    )
    assert known_log == pytest.approx(free_log)


def test_line_without_noise_is_refused_and_lines_do_not_change_the_fit():
    y = np.arange(30.0)
    with pytest.raises(ValueError, match="straight line without any noise"):
        fit_noise(y, np.zeros(30))
    rng = np.random.default_rng(7)
    height = Noise(1.0, 3.0, 0.5).sample(y, rng.standard_normal((2, 30)))
    one, other = fit_noise(y, height), fit_noise(y, height + 40.0 - 3.0 * y)
    assert (one.sigma, one.length, one.white) == pytest.approx(
        (other.sigma, other.length, other.white), rel=1e-6
    )
    # in other units
    scaled = fit_noise(1e-3 * y, 2.0 * height)
    assert (scaled.sigma, scaled.length, scaled.white) == pytest.approx(
        (2.0 * one.sigma, 1e-3 * one.length, 2.0 * one.white), rel=1e-6
    )
    fit_noise(y[:8], height[:8])

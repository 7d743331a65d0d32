"""Noise of traces: whitening against Cholesky, and the fit on unworn parts."""

from __future__ import annotations

import numpy as np
import pytest

from wearsim.uq.hierarchy.noise import Noise, fit_noise

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
    for _ in range(40):
        height = 5e-6 + 1e-3 * y + NOISE.sample(y, rng.standard_normal((2, len(y))))
        fits.append(fit_noise(y[unworn], height[unworn]))
    assert np.median([fit.sigma for fit in fits]) == pytest.approx(1e-6, rel=0.12)
    assert np.median([fit.length for fit in fits]) == pytest.approx(0.2e-3, rel=0.25)
    assert np.median([fit.white for fit in fits]) == pytest.approx(0.3e-6, rel=0.15)


def test_too_few_points_are_refused():
    with pytest.raises(ValueError, match="8 points"):
        fit_noise(np.linspace(0.0, 1.0, 7), np.zeros(7))

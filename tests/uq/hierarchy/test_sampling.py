"""Samples of the hierarchical model against its quadrature."""

from __future__ import annotations

import sys

import numpy as np
import pytest

from wearsim.uq.hierarchy import sampling
from wearsim.uq.hierarchy.kernels import LikelihoodMixture
from wearsim.uq.hierarchy.pooled import Posterior
from wearsim.uq.hierarchy.sampling import sample_hierarchy

CENTRES, STD = 1.5 * np.log([28.0, 48.0, 62.0]), 0.417
GRID = np.linspace(2.0, 9.0, 701)
DENSITIES = np.exp(-0.5 * ((GRID - CENTRES[:, None]) / STD) ** 2)


def test_samples_have_the_quantiles_of_the_quadrature():
    kernels = [
        LikelihoodMixture(np.ones(1), np.array([centre]), np.array([STD])) for centre in CENTRES
    ]
    posterior = Posterior.of(kernels)
    m, t, ln_k = sample_hierarchy(GRID, DENSITIES, 250, 1)
    shares = (0.05, 0.5, 0.95)
    assert np.quantile(t, shares) == pytest.approx(posterior.scatter(shares), abs=0.03)
    assert np.quantile(m, shares) == pytest.approx(posterior.mean(shares), abs=0.04)
    # the specimens are drawn towards each other
    assert np.ptp(ln_k.mean(axis=(0, 1))) < np.ptp(CENTRES)
    assert (np.diff(ln_k.mean(axis=(0, 1))) > 0.0).all()


def test_equal_seeds_give_equal_samples(monkeypatch):
    monkeypatch.setattr(sampling, "BURN_IN", 20)
    first, second = (sample_hierarchy(GRID, DENSITIES, 5, 3) for _ in range(2))
    for one, other in zip(first, second, strict=True):
        assert np.array_equal(one, other)


def test_missing_sampler_says_how_to_install_it(monkeypatch):
    monkeypatch.setitem(sys.modules, "emcee", None)
    with pytest.raises(ModuleNotFoundError, match=r"pip install 'wearsim\[sampling\]'"):
        sample_hierarchy(GRID, DENSITIES, 5, 1)

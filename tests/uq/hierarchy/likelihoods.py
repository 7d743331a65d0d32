"""Likelihoods of tests in the tests of hierarchies of wear factors."""

from __future__ import annotations

import numpy as np

from wearsim.uq.hierarchy.kernels import LikelihoodMixture


def normal(centre: float, std: float) -> LikelihoodMixture:
    """Return the likelihood of a test with a normal distribution of its apparent ln K."""
    return LikelihoodMixture(np.ones(1), np.array([centre]), np.array([std]))

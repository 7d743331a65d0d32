"""Recursion of a stationary first-order Gauss-Markov process (discrete Ornstein-Uhlenbeck)."""

from __future__ import annotations

import math

import numpy as np

from wearsim.mechanics.numerics.jit import kernel
from wearsim.types import FloatArray


@kernel
def filter_noise(noise: FloatArray, memory: float) -> FloatArray:
    """Return z_0 = w_0, z_k+1 = r z_k + sqrt(1 - r^2) w_k+1, which has unit variance throughout.

    Parameters
    ----------
    noise : ndarray, shape (points,)
        Independent standard normal values w.
    memory : float
        Correlation r of neighbouring values.

    Returns
    -------
    ndarray, shape (points,)
    """
    path = np.empty(noise.shape[0])
    fresh = math.sqrt((1.0 - memory) * (1.0 + memory))
    value = 0.0
    for k in range(noise.shape[0]):
        value = noise[k] if k == 0 else memory * value + fresh * noise[k]
        path[k] = value
    return path

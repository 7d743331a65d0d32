"""Samples of the hierarchical model: mean, scatter and ln K of every specimen together."""

from __future__ import annotations

import numpy as np

from wearsim.types import FloatArray
from wearsim.uq.hierarchy.pooled import GREATEST, PRIOR_SCALE

LEAST_WALKERS = 32
BURN_IN = 1000  # steps that are left out
THINNING = 10  # steps between the samples that are kept
_LOWEST = 1e-300  # density where none is stored


def sample_hierarchy(
    ln_k: FloatArray, densities: FloatArray, draws: int, seed: int, scale: float = PRIOR_SCALE
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return samples of m, t and ln K_i of the model ln K_i ~ N(m, t^2).

    The affine-invariant ensemble sampler of emcee moves m, t and the standardised deviations
    (ln K_i - m)/t, in which the density is smooth down to t = 0. The prior of m is flat, that of t
    half-normal.

    Parameters
    ----------
    ln_k : ndarray, shape (points,)
        Grid of ln K.
    densities : ndarray, shape (specimens, points)
        Likelihood of the ln K of each specimen, on any scale.
    draws : int
        Samples kept of each walker.
    seed : int
        Seed of the random numbers.
    scale : float
        Scale of the prior of t.

    Returns
    -------
    m, t : ndarray, shape (walkers, draws)
    ln_k : ndarray, shape (walkers, draws, specimens)

    Raises
    ------
    ModuleNotFoundError
        If emcee is not installed, which is part of the extra ``wearsim[sampling]``.

    References
    ----------
    .. [1] D. Foreman-Mackey et al., Publ. Astron. Soc. Pac. 125 (2013), DOI 10.1086/670067.
    """
    try:
        import emcee  # noqa: PLC0415  (optional)
    except ImportError as error:
        raise ModuleNotFoundError(
            "emcee is not installed; install it with: pip install 'wearsim[sampling]'", name="emcee"
        ) from error
    logs = np.log(np.maximum(densities / densities.max(axis=1, keepdims=True), _LOWEST))
    specimens = len(logs)
    means = (densities @ ln_k) / densities.sum(axis=1)

    def log_probability(vectors: FloatArray) -> FloatArray:
        m, t, deviations = vectors[:, 0], vectors[:, 1], vectors[:, 2:]
        values = m[:, None] + t[:, None] * deviations
        log_density = -0.5 * (t / scale) ** 2 - 0.5 * (deviations**2).sum(axis=1)
        for row, log in zip(values.T, logs, strict=True):
            log_density += np.interp(row, ln_k, log)
        return np.where((t >= 0.0) & (t < GREATEST), log_density, -np.inf)

    random = np.random.default_rng(seed)
    walkers = max(LEAST_WALKERS, 2 * (specimens + 2))
    start = np.column_stack(
        [
            means.mean() + 0.1 * random.standard_normal(walkers),
            0.1 + 0.1 * random.random(walkers),
            0.5 * random.standard_normal((walkers, specimens)),
        ]
    )
    sampler = emcee.EnsembleSampler(walkers, specimens + 2, log_probability, vectorize=True)
    sampler.random_state = np.random.RandomState(seed).get_state()
    last = sampler.run_mcmc(start, BURN_IN)
    sampler.reset()
    sampler.run_mcmc(last, draws * THINNING, thin_by=1)
    chain = np.swapaxes(sampler.get_chain(thin=THINNING), 0, 1)
    m, t = chain[..., 0], chain[..., 1]
    return m, t, m[..., None] + t[..., None] * chain[..., 2:]

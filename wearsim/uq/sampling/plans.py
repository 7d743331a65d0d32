"""Sampling designs: the uniform numbers of one input in each realisation of a study.

In each design they depend only on the seed and on the name and dimension of the input, not on other
inputs, the order or the batch size of the realisations.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import Literal, TypeAlias, get_args

import numpy as np

from wearsim.types import FloatArray, IntArray
from wearsim.uq.sampling import sobol
from wearsim.uq.sampling.philox import Stream

PlanName: TypeAlias = Literal["monte-carlo", "latin-hypercube", "sobol"]
PLANS: tuple[PlanName, ...] = get_args(PlanName)

Draw: TypeAlias = Callable[[str, int, int, int], FloatArray]
"""Uniform numbers, shape (count, dimension), by name, dimension, first realisation and count."""

BELOW_ONE = 1.0 - 2.0**-53

REPLICATES = 8
"""Number of independent Sobol sequences for confidence intervals: 7 degrees of freedom."""


def monte_carlo(seed: int, name: str, dimension: int, first: int, count: int) -> FloatArray:
    """Return independent uniform numbers.

    Parameters
    ----------
    seed : int
        Seed of the scenario.
    name : str
        Name of the input.
    dimension : int
        Number of uniform numbers per realisation.
    first, count : int
        First realisation, and number of realisations.

    Returns
    -------
    ndarray, shape (count, dimension)
        Strictly between 0 and 1.
    """
    return Stream(seed, name, "test").rows(first, count, dimension)


def latin_hypercube(
    seed: int, total: int, name: str, dimension: int, first: int, count: int
) -> FloatArray:
    """Return realisations of a Latin hypercube of `total` realisations, one per stratum.

    Parameters
    ----------
    seed, name, dimension, first, count
        As for `monte_carlo`.
    total : int
        Number of realisations of the design, and of strata of each component.

    Returns
    -------
    ndarray, shape (count, dimension)
        Strictly between 0 and 1.

    Raises
    ------
    ValueError
        If a realisation is beyond `total`.

    Notes
    -----
    McKay, Beckman, Conover, Technometrics 21 (1979), DOI 10.1080/00401706.1979.10489755.
    """
    if first + count > total:
        raise ValueError(
            f"realisation {first + count - 1} (counted from 0) is beyond this latin-hypercube plan,"
            f" whose total is {total}; use a greater total, or sobol, which has no total"
        )
    within = monte_carlo(seed, name, dimension, first, count)
    strata = np.stack(
        [_strata(seed, total, name, k)[first : first + count] for k in range(dimension)], axis=1
    )
    # rounding may move the greatest number of a stratum into the next one
    return np.minimum((strata + within) / total, np.nextafter((strata + 1.0) / total, 0.0))


@lru_cache(maxsize=64)
def _strata(seed: int, total: int, name: str, component: int) -> IntArray:
    """Return a random order of the strata; sorting makes it independent of numpy's version."""
    words = Stream(seed, name, "plan").words(0, total, block=component)
    order = np.argsort(words, kind="stable").astype(np.int64)
    order.flags.writeable = False
    return order


def replicated_sobol(
    seed: int, replicates: int, name: str, dimension: int, first: int, count: int
) -> FloatArray:
    """Return points of several independently scrambled Sobol sequences, alternately.

    Realisation k is the point k // replicates of the sequence k % replicates. Each sequence is an
    unbiased sample, and the differences between them give the error of their mean (Owen 1997, DOI
    10.1137/S0036142994277468).

    Parameters
    ----------
    seed, name, dimension, first, count
        As for `monte_carlo`.
    replicates : int
        Number of sequences; 1 gives a single scrambled Sobol sequence.

    Returns
    -------
    ndarray, shape (count, dimension)
        Strictly between 0 and 1.
    """
    points = np.empty((count, dimension))
    for offset in range(min(replicates, count)):
        start, replicate = divmod(first + offset, replicates)
        own = points[offset::replicates]
        own[:] = sobol.scrambled(seed, name, dimension, start, len(own), replicate)
    return points


def drawing(plan: PlanName, seed: int, total: int | None, replicates: int = 1) -> Draw:
    """Return the function that draws one input by a sampling design.

    Parameters
    ----------
    plan : {"monte-carlo", "latin-hypercube", "sobol"}
        Name of the design.
    seed : int
        Seed of the scenario.
    total : int, optional
        Number of realisations of the design; needed by "latin-hypercube".
    replicates : int
        Number of independent, alternating sequences of "sobol".

    Returns
    -------
    callable
        Function of name, dimension, first and count.

    Raises
    ------
    ValueError
        If the design is unknown, or `total` or `replicates` is missing or not positive.
    """
    if plan not in PLANS:
        raise ValueError(f'unknown sampling plan "{plan}", expected one of {", ".join(PLANS)}')
    if total is not None and total < 1:
        raise ValueError(f"total must be 1 or more realisations, got {total}")
    if replicates < 1:
        raise ValueError(f"replicates must be 1 or more sequences, got {replicates}")
    if plan == "monte-carlo":
        return lambda *where: monte_carlo(seed, *where)
    if plan == "sobol":
        return lambda *where: replicated_sobol(seed, replicates, *where)
    if total is None:
        raise ValueError("a latin-hypercube plan needs total, the number of its realisations")
    return lambda *where: latin_hypercube(seed, total, *where)

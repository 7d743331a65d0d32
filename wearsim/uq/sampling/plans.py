"""Sampling plans: the uniform numbers that one input takes in each realisation of a study.

Whatever the plan, they follow from the seed and the input's own name and dimension, so that no
other input, no order and no batch of realisations changes them.
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
"""Independent Sobol sequences of a plan whose estimates need intervals: 7 degrees of freedom."""


def monte_carlo(seed: int, name: str, dimension: int, first: int, count: int) -> FloatArray:
    """Return independent uniform numbers.

    Parameters
    ----------
    seed : int
        Seed of the scenario.
    name : str
        Name of the input.
    dimension : int
        How many uniform numbers it takes.
    first, count : int
        The first realisation, and how many.

    Returns
    -------
    ndarray, shape (count, dimension)
        Strictly between 0 and 1.
    """
    return Stream(seed, name, "test").rows(first, count, dimension)


def latin_hypercube(
    seed: int, total: int, name: str, dimension: int, first: int, count: int
) -> FloatArray:
    """Return a part of a Latin hypercube of `total` realisations: one of them in every stratum.

    Parameters
    ----------
    seed, name, dimension, first, count
        As of `monte_carlo`.
    total : int
        Realisations of the whole plan, and strata of each component.

    Returns
    -------
    ndarray, shape (count, dimension)
        Strictly between 0 and 1.

    Raises
    ------
    ValueError
        If the realisations go beyond `total`.

    Notes
    -----
    McKay, Beckman, Conover, Technometrics 21 (1979), DOI 10.1080/00401706.1979.10489755.
    """
    if first + count > total:
        raise ValueError(
            f"realisation {first + count - 1} is beyond this latin-hypercube plan, whose total is"
            f" {total} (counted from 0); plan with a greater total, or take sobol, which has no end"
        )
    within = monte_carlo(seed, name, dimension, first, count)
    strata = np.stack(
        [_strata(seed, total, name, k)[first : first + count] for k in range(dimension)], axis=1
    )
    # the greatest number of a stratum may be rounded up into the next
    return np.minimum((strata + within) / total, np.nextafter((strata + 1.0) / total, 0.0))


@lru_cache(maxsize=64)
def _strata(seed: int, total: int, name: str, component: int) -> IntArray:
    """Return a random order of the strata, by sorting so that no numpy release changes it."""
    words = Stream(seed, name, "plan").words(0, total, block=component)
    order = np.argsort(words, kind="stable").astype(np.int64)
    order.flags.writeable = False
    return order


def replicated_sobol(
    seed: int, replicates: int, name: str, dimension: int, first: int, count: int
) -> FloatArray:
    """Return points of several independently scrambled Sobol sequences in turn.

    Realisation k has the point k // replicates of the sequence k % replicates: each sequence alone
    is an unbiased sample, and how far they differ tells the error of all of them together
    (Owen 1997, DOI 10.1137/S0036142994277468).

    Parameters
    ----------
    seed, name, dimension, first, count
        As of `monte_carlo`.
    replicates : int
        Number of sequences; of one, it is the plain scrambled Sobol sequence.

    Returns
    -------
    ndarray, shape (count, dimension)
        Strictly between 0 and 1.
    """
    points = np.empty((count, dimension))
    for ahead in range(min(replicates, count)):
        start, replicate = divmod(first + ahead, replicates)
        own = points[ahead::replicates]
        own[:] = sobol.scrambled(seed, name, dimension, start, len(own), replicate)
    return points


def drawing(plan: PlanName, seed: int, total: int | None, replicates: int = 1) -> Draw:
    """Return how a plan draws one input.

    Parameters
    ----------
    plan : {"monte-carlo", "latin-hypercube", "sobol"}
        Name of the plan.
    seed : int
        Seed of the scenario.
    total : int, optional
        Realisations of the whole plan, needed by "latin-hypercube".
    replicates : int
        Independent sequences that "sobol" takes in turn; other plans have none.

    Returns
    -------
    callable
        Of name, dimension, first and count.

    Raises
    ------
    ValueError
        If the plan is unknown, or `total` is missing or not positive, or `replicates` is not.
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
        raise ValueError("a latin-hypercube plan needs total, the realisations of the whole plan")
    return lambda *where: latin_hypercube(seed, total, *where)

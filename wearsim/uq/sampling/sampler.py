"""Sampler of a study: sampling designs, rank correlations, and the numbers of all inputs."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache
from typing import Literal, TypeAlias, get_args

import numpy as np

from wearsim.types import FloatArray, IntArray
from wearsim.uq.sampling import sobol
from wearsim.uq.sampling.sobol import Stream

PlanName: TypeAlias = Literal["monte-carlo", "latin-hypercube", "sobol"]
PLANS: tuple[PlanName, ...] = get_args(PlanName)

#: Uniform numbers, shape (count, dimension), by name, dimension, first realisation and count.
Draw: TypeAlias = Callable[[str, int, int, int], FloatArray]

BELOW_ONE = 1.0 - 2.0**-53

#: Number of independent Sobol sequences for confidence intervals: 7 degrees of freedom.
REPLICATES = 8
#: Two inputs and Spearman's rank correlation between them.
Correlation: TypeAlias = tuple[str, str, float]
_SINGULAR = 1e-9  # eigenvalue below which a correlation matrix is singular to rounding


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
    order = np.argsort(
        Stream(seed, name, "plan").words(0, total, block=component), kind="stable"
    ).astype(np.int64)
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
        sequence = points[offset::replicates]
        sequence[:] = sobol.scrambled(seed, name, dimension, start, len(sequence), replicate)
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


class GaussianCopula:
    """Transformation of independent uniform numbers to given rank correlations.

    Normal scores with the correlation 2 sin(pi rho/6) have the rank correlation rho (Pearson
    1907). Correlated inputs are processed in the order of their names: the first one keeps its
    numbers, and each later one combines its numbers with those before it. Inputs
    without correlation keep their numbers bit for bit.

    Parameters
    ----------
    correlations : sequence of (str, str, float)
        Pairs of inputs and their rank correlation, -1 to 1.
    dimensions : mapping of str to int
        Number of uniform numbers of each input, for all inputs.

    Raises
    ------
    ValueError
        If an input is unknown, takes more than one number or is paired with itself, if a pair is
        given twice or its correlation is out of range, or if the matrix is not positive definite.
    """

    def __init__(self, correlations: Sequence[Correlation], dimensions: Mapping[str, int]) -> None:
        pairs: dict[tuple[str, str], float] = {}
        for first, second, rank in correlations:
            _check(first, second, rank, dimensions)
            pair = (min(first, second), max(first, second))
            if pair in pairs:
                raise ValueError(
                    f"the correlation of {first} with {second} is given twice; keep one"
                )
            pairs[pair] = rank
        self._groups = [(names, _factor(names, pairs)) for names in _groups(pairs)]

    def correlate(self, uniforms: Mapping[str, FloatArray]) -> dict[str, FloatArray]:
        """Return correlated uniform numbers from independent ones.

        Parameters
        ----------
        uniforms : mapping of str to ndarray, shape (count, dimension)
            Strictly between 0 and 1.

        Returns
        -------
        dict of str to ndarray, shapes and order as `uniforms`
        """
        correlated = dict(uniforms)
        if self._groups:
            from scipy.special import ndtr, ndtri  # noqa: PLC0415  (slow to import)

            for names, factor in self._groups:
                scores = [ndtri(uniforms[name]) for name in names]
                for i in range(1, len(names)):
                    # term by term: rounding of a matrix product depends on the batch size
                    mixed = sum(factor[i, j] * scores[j] for j in range(i + 1))
                    correlated[names[i]] = np.clip(ndtr(mixed), 1.0 - BELOW_ONE, BELOW_ONE)
        return correlated


def _check(first: str, second: str, rank: float, dimensions: Mapping[str, int]) -> None:
    """Raise a ValueError for an invalid correlation."""
    for name in (first, second):
        if name not in dimensions:
            raise ValueError(
                f'cannot correlate "{name}": no such input, the inputs are'
                f" {', '.join(dimensions) or 'none'}"
            )
        if dimensions[name] != 1:
            raise ValueError(
                f"cannot correlate {name}: one draw takes {dimensions[name]} numbers, and only"
                " inputs of one number have ranks"
            )
    if first == second:
        raise ValueError(f"cannot correlate {first} with itself; name two inputs")
    if not -1.0 <= rank <= 1.0:
        raise ValueError(
            f"the rank correlation of {first} with {second} must be in -1 to 1, got {rank}"
        )


def _groups(pairs: Mapping[tuple[str, str], float]) -> list[list[str]]:
    """Return the groups of correlated inputs, each in the order of names."""
    groups: list[set[str]] = []
    for pair in pairs:
        joined = [group for group in groups if group & set(pair)]
        groups = [group for group in groups if group not in joined]
        groups.append(set(pair).union(*joined))
    return sorted(sorted(group) for group in groups)


def _factor(names: list[str], pairs: Mapping[tuple[str, str], float]) -> FloatArray:
    """Return the Cholesky factor for the normal scores."""
    ranks = [[pairs.get((min(a, b), max(a, b)), float(a == b)) for b in names] for a in names]
    matrix = 2.0 * np.sin(math.pi / 6.0 * np.array(ranks))
    if np.linalg.eigvalsh(matrix)[0] < _SINGULAR:
        given = ", ".join(f"{a} with {b}: {rank:g}" for (a, b), rank in pairs.items() if a in names)
        raise ValueError(
            "the matrix of these rank correlations is not positive definite"
            f" ({given}); bring them nearer to 0"
        )
    return np.asarray(np.linalg.cholesky(matrix), dtype=np.float64)


class Sampler:
    """Sampler of all inputs of a study by one sampling design.

    The numbers of a realisation do not depend on the order or batch size in which realisations are
    requested, nor on other inputs and the order of the inputs.

    Parameters
    ----------
    seed : int
        Seed of the scenario.
    inputs : sequence of (str, int)
        Name of each input and number of uniform numbers per draw.
    plan : {"monte-carlo", "latin-hypercube", "sobol"}
        Sampling design.
    total : int, optional
        Number of realisations of the design; needed by "latin-hypercube".
    correlations : sequence of (str, str, float)
        Rank correlations between inputs of one number each. They are applied to the numbers of the
        design: a correlated input keeps its distribution, but is less evenly spread.
    replicates : int
        Number of independent, alternating sequences of "sobol": realisation k is the point
        k // replicates of the sequence k % replicates.

    Raises
    ------
    ValueError
        If an input, the design or the correlations are invalid.
    """

    def __init__(
        self,
        seed: int,
        inputs: Sequence[tuple[str, int]],
        plan: PlanName = "monte-carlo",
        total: int | None = None,
        correlations: Sequence[Correlation] = (),
        replicates: int = 1,
    ) -> None:
        self._dimensions: dict[str, int] = {}
        for name, dimension in inputs:
            if name in self._dimensions:
                raise ValueError(f"the input {name} is given twice; use different names")
            if dimension < 1:
                raise ValueError(f"the input {name} must take 1 or more numbers, got {dimension}")
            self._dimensions[name] = dimension
        self._draw = drawing(plan, seed, total, replicates)
        self._copula = GaussianCopula(correlations, self._dimensions)
        owner: dict[int, str] = {}
        for name, dimension in self._dimensions.items() if plan == "sobol" else ():
            for slot in sobol.slots(name, dimension) or ():
                if slot in owner:
                    raise ValueError(
                        f"{owner[slot]} and {name} are one quantity and share a dimension of the"
                        " Sobol sequence; draw only one of them"
                    )
                owner[slot] = name

    def uniforms(self, first: int, count: int) -> dict[str, FloatArray]:
        """Return the uniform numbers of `count` consecutive realisations.

        Parameters
        ----------
        first, count : int
            First realisation, counted from 0, and number of realisations.

        Returns
        -------
        dict of str to ndarray, shape (count, dimension)
            Numbers of each input, strictly between 0 and 1.

        Raises
        ------
        ValueError
            If the design does not have these realisations.
        """
        if first < 0 or count < 0:
            raise ValueError(
                f"realisations are counted from 0, got {count} of them from {first} on"
            )
        return self._copula.correlate(
            {
                name: self._draw(name, dimension, first, count)
                for name, dimension in self._dimensions.items()
            }
        )

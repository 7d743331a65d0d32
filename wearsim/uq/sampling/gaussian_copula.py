"""Rank correlations between inputs by a Gaussian copula."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TypeAlias

import numpy as np

from wearsim.types import FloatArray
from wearsim.uq.sampling.plans import BELOW_ONE

Correlation: TypeAlias = tuple[str, str, float]
"""Two inputs and Spearman's rank correlation between them."""

_SINGULAR = 1e-9  # eigenvalue below which a correlation matrix is singular to rounding


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

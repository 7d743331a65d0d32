"""Rank correlations between inputs, by a Gaussian copula."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TypeAlias

import numpy as np

from wearsim.types import FloatArray
from wearsim.uq.sampling.plans import BELOW_ONE

Correlation: TypeAlias = tuple[str, str, float]
"""Two inputs and Spearman's rank correlation between them."""

_SMALLEST_PIVOT = 1e-9  # of a correlation matrix; below, it is singular but for round-off


class GaussianCopula:
    """Ties uniform numbers to each other so that their ranks have given correlations.

    Normal scores with the correlation 2 sin(pi rho/6) have the rank correlation rho (Pearson
    1907). Inputs are taken in the order of their names: the first of those tied together keeps
    its numbers, each later one is mixed from its own and those before it. Inputs with
    no correlation keep theirs, bit for bit.

    Parameters
    ----------
    correlations : sequence of (str, str, float)
        Two inputs each and their rank correlation, -1 to 1.
    dimensions : mapping of str to int
        All inputs and how many uniform numbers each takes.

    Raises
    ------
    ValueError
        If an input is unknown, takes more than one number or is paired with itself, if a pair
        stands twice or its correlation is out of range, or if no law has all of them together.
    """

    def __init__(self, correlations: Sequence[Correlation], dimensions: Mapping[str, int]) -> None:
        pairs: dict[tuple[str, str], float] = {}
        for first, second, rank in correlations:
            _check(first, second, rank, dimensions)
            pair = (min(first, second), max(first, second))
            if pair in pairs:
                raise ValueError(f"the correlation of {first} with {second} stands twice; keep one")
            pairs[pair] = rank
        self._groups = [(names, _factor(names, pairs)) for names in _groups(pairs)]

    def correlate(self, uniforms: Mapping[str, FloatArray]) -> dict[str, FloatArray]:
        """Return uniform numbers with the correlations, from independent ones.

        Parameters
        ----------
        uniforms : mapping of str to ndarray, shape (count, dimension)
            Strictly between 0 and 1.

        Returns
        -------
        dict of str to ndarray, shapes and order as `uniforms`
        """
        tied = dict(uniforms)
        if self._groups:
            from scipy.special import ndtr, ndtri  # noqa: PLC0415  (slow to import)

            for names, factor in self._groups:
                scores = [ndtri(uniforms[name]) for name in names]
                for i in range(1, len(names)):
                    # term by term: a matrix product's bits depend on the size of the batch
                    mixed = sum(factor[i][j] * scores[j] for j in range(i + 1))
                    tied[names[i]] = np.clip(ndtr(mixed), 1.0 - BELOW_ONE, BELOW_ONE)
        return tied


def _check(first: str, second: str, rank: float, dimensions: Mapping[str, int]) -> None:
    """Refuse a correlation that cannot be meant."""
    for name in (first, second):
        if name not in dimensions:
            known = ", ".join(dimensions) or "none"
            raise ValueError(f'cannot correlate "{name}": no such input, the inputs are {known}')
        if dimensions[name] != 1:
            raise ValueError(
                f"cannot correlate {name}: a draw of it takes {dimensions[name]} numbers, and only"
                " inputs of one number have a rank; correlate those"
            )
    if first == second:
        raise ValueError(f"cannot correlate {first} with itself; name two inputs")
    if not -1.0 <= rank <= 1.0:
        raise ValueError(
            f"the rank correlation of {first} with {second} must lie in -1 to 1, got {rank}"
        )


def _groups(pairs: Mapping[tuple[str, str], float]) -> list[list[str]]:
    """Return the sets of inputs that are tied together, each in the order of names."""
    groups: list[set[str]] = []
    for pair in pairs:
        joined = [group for group in groups if group & set(pair)]
        groups = [group for group in groups if group not in joined]
        groups.append(set(pair).union(*joined))
    return sorted(sorted(group) for group in groups)


def _factor(names: list[str], pairs: Mapping[tuple[str, str], float]) -> list[list[float]]:
    """Return the rows of Cholesky's factor of the normal scores' correlations."""
    factor: list[list[float]] = []
    for i, name in enumerate(names):
        row: list[float] = []
        for j in range(i):
            wanted = 2.0 * math.sin(math.pi / 6.0 * pairs.get((names[j], name), 0.0))
            known = sum(row[k] * factor[j][k] for k in range(j))
            row.append((wanted - known) / factor[j][j])
        pivot = 1.0 - sum(value * value for value in row)
        if pivot < _SMALLEST_PIVOT:
            told = ", ".join(
                f"{a} with {b}: {rank:g}" for (a, b), rank in pairs.items() if a in names
            )
            raise ValueError(
                "no law has these rank correlations together, since their matrix is not positive"
                f" definite ({told}); bring them nearer to 0"
            )
        factor.append([*row, math.sqrt(pivot)])
    return factor

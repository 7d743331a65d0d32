"""Polynomial regression of a value on a few numbers, with leave-one-out errors."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations
from math import comb

import numpy as np

from wearsim.types import FloatArray, IntArray

_DEGREE = 10  # greatest degree of a polynomial
_TERMS = 120  # greatest number of terms, with the constant
_PER_TERM = 8  # least number of realisations per term
_BLOCK = 8192  # rows per block
_RIDGE = 1e-9  # relative regularisation, for terms that are equal in all realisations


@dataclass(frozen=True)
class Fit:
    """A fitted polynomial and its leave-one-out errors.

    Parameters
    ----------
    terms : int
        Number of terms, with the constant.
    error : float
        Mean square of the leave-one-out prediction errors.
    residual, leverage : ndarray, shape (n,)
        Residual and leverage of each realisation.
    """

    terms: int
    error: float
    residual: FloatArray
    leverage: FloatArray


def fewest_realisations(numbers: int) -> int:
    """Return the number of realisations that a fit of so many numbers and their squares needs."""
    return _PER_TERM * (1 + 2 * numbers)


def best_fit(scores: FloatArray, values: FloatArray, family: str) -> Fit:
    """Return the polynomial with the least leave-one-out error.

    Parameters
    ----------
    scores : ndarray, shape (n, m)
        Normal scores ("hermite") or ranks from -1 to 1 ("legendre").
    values : ndarray, shape (n,)
        Values with the mean 0; at least `fewest_realisations` of them.
    family : {"hermite", "legendre"}
        The polynomials whose products the terms are.

    Returns
    -------
    Fit
    """
    count = len(values)
    distinct = [len(np.unique(column)) for column in scores.T]
    powers, ends = _terms(distinct, min(count // _PER_TERM, _TERMS))
    gram, moment = np.zeros((len(powers),) * 2), np.zeros(len(powers))
    for rows, design in _designs(scores, powers, family):
        gram += design.T @ design
        moment += design.T @ values[rows]
    lower = np.linalg.cholesky(gram + _RIDGE * count * np.eye(len(powers)))
    # columns orthonormalised successively: the first k of them span the first k terms
    transform = np.linalg.inv(lower).T
    slopes = transform.T @ moment
    residual, leverage = np.empty((count, len(ends))), np.empty((count, len(ends)))
    for rows, design in _designs(scores, powers, family):
        columns = design @ transform
        for k, end in enumerate(ends):
            residual[rows, k] = values[rows] - columns[:, :end] @ slopes[:end]
            leverage[rows, k] = (columns[:, :end] ** 2).sum(axis=1)
    errors = ((residual / (1.0 - leverage)) ** 2).mean(axis=0)
    best = int(np.argmin(errors))
    return Fit(ends[best], float(errors[best]), residual[:, best], leverage[:, best])


def _terms(distinct: list[int], most: int) -> tuple[IntArray, list[int]]:
    """Return the powers of each term, (terms, m), and the possible numbers of terms.

    Terms are ordered by total degree, then by the number of factors.
    """
    width = len(distinct)
    powers, ends = [(0,) * width], list[int]()
    for degree in range(1, _DEGREE + 1):
        for together in range(1, min(degree, width) + 1):
            if len(powers) + comb(width, together) * comb(degree - 1, together - 1) > most:
                continue
            powers += [
                term
                for term in _of_degree(degree, together, width)
                if all(power < known for power, known in zip(term, distinct, strict=True))
            ]
            if degree > 1:
                ends.append(len(powers))
    return np.array(powers, dtype=np.int64), sorted(set(ends))


def _of_degree(degree: int, together: int, width: int) -> Iterator[tuple[int, ...]]:
    """Yield the powers of all terms of this degree with so many factors."""
    for chosen in combinations(range(width), together):
        # compositions of the degree into parts of 1 or more
        for cuts in combinations(range(1, degree), together - 1):
            powers = [0] * width
            for number, start, stop in zip(chosen, (0, *cuts), (*cuts, degree), strict=True):
                powers[number] = stop - start
            yield tuple(powers)


def _designs(
    scores: FloatArray, powers: IntArray, family: str
) -> Iterator[tuple[slice, FloatArray]]:
    """Yield the terms of successive blocks of rows, (rows, terms)."""
    for first in range(0, len(scores), _BLOCK):
        rows = slice(first, first + _BLOCK)
        degrees = _orthonormal(scores[rows], int(powers.max()), family)
        design = np.ones((degrees.shape[1], len(powers)))
        for number in range(scores.shape[1]):
            design *= degrees[powers[:, number], :, number].T
        yield rows, design


def _orthonormal(x: FloatArray, highest: int, family: str) -> FloatArray:
    """Return orthonormal polynomials of all degrees, (degrees, rows, m), by recurrence."""
    values = np.ones((highest + 1, *x.shape))
    for degree in range(highest):
        before = values[degree - 1] if degree else 0.0
        if family == "hermite":
            upper, lower = (degree + 1.0) ** 0.5, degree**0.5
        else:
            upper = (degree + 1.0) / ((2.0 * degree + 1.0) * (2.0 * degree + 3.0)) ** 0.5
            lower = degree / ((2.0 * degree + 1.0) * abs(2.0 * degree - 1.0)) ** 0.5
        values[degree + 1] = (x * values[degree] - lower * before) / upper
    return values

"""What polynomials of a few numbers explain of a value, with errors of prediction left-one-out."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations
from math import comb

import numpy as np

from wearsim.types import FloatArray, IntArray

_DEGREE = 10  # of a polynomial at most
_TERMS = 120  # at most, the constant among them
_PER_TERM = 8  # realisations to a term
_BLOCK = 8192  # rows at once
_RIDGE = 1e-9  # of the realisations: keeps terms apart that are the same in all of them


@dataclass(frozen=True)
class Fit:
    """A polynomial, and how well it tells the value of each realisation.

    Parameters
    ----------
    terms : int
        Terms, the constant among them.
    error : float
        Mean square of the errors of prediction, each realisation left out in turn.
    residual, leverage : ndarray, shape (n,)
        What the polynomial leaves, and each realisation's weight in its own prediction.
    """

    terms: int
    error: float
    residual: FloatArray
    leverage: FloatArray


def fewest_realisations(numbers: int) -> int:
    """Return how many realisations polynomials of so many numbers and their squares need."""
    return _PER_TERM * (1 + 2 * numbers)


def best_fit(scores: FloatArray, values: FloatArray, family: str) -> Fit:
    """Return the polynomial that predicts best what it has not seen.

    Parameters
    ----------
    scores : ndarray, shape (n, m)
        Normal scores ("hermite") or ranks from -1 to 1 ("legendre").
    values : ndarray, shape (n,)
        With the mean 0; `fewest_realisations` of them or more.
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
    # columns made orthonormal one after the other: the first k of them are those of k terms
    turn = np.linalg.inv(lower).T
    slopes = turn.T @ moment
    left, own = np.empty((count, len(ends))), np.empty((count, len(ends)))
    for rows, design in _designs(scores, powers, family):
        columns = design @ turn
        for k, end in enumerate(ends):
            left[rows, k] = values[rows] - columns[:, :end] @ slopes[:end]
            own[rows, k] = (columns[:, :end] ** 2).sum(axis=1)
    errors = ((left / (1.0 - own)) ** 2).mean(axis=0)
    best = int(np.argmin(errors))
    return Fit(ends[best], float(errors[best]), left[:, best], own[:, best])


def _terms(distinct: list[int], most: int) -> tuple[IntArray, list[int]]:
    """Return the powers of each term, (terms, m), and where a polynomial may end.

    Terms come by total degree, and of one degree those of fewer numbers first.
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
    """Yield the powers, of this sum, of all terms in which so many numbers stand."""
    for chosen in combinations(range(width), together):
        # where the sum is cut into parts of 1 or more
        for cuts in combinations(range(1, degree), together - 1):
            powers = [0] * width
            for number, start, stop in zip(chosen, (0, *cuts), (*cuts, degree), strict=True):
                powers[number] = stop - start
            yield tuple(powers)


def _designs(
    scores: FloatArray, powers: IntArray, family: str
) -> Iterator[tuple[slice, FloatArray]]:
    """Yield the terms of some rows after the other, (rows, terms)."""
    highest = int(powers.max())
    for first in range(0, len(scores), _BLOCK):
        rows = slice(first, first + _BLOCK)
        ladder = _ladder(scores[rows], highest, family)
        design = np.ones((ladder.shape[1], len(powers)))
        for number in range(scores.shape[1]):
            design *= ladder[powers[:, number], :, number].T
        yield rows, design


def _ladder(x: FloatArray, highest: int, family: str) -> FloatArray:
    """Return orthonormal polynomials of all degrees, (degrees, rows, m), by their recurrence."""
    ladder = np.ones((highest + 1, *x.shape))
    for degree in range(highest):
        before = ladder[degree - 1] if degree else 0.0
        if family == "hermite":
            upper, lower = (degree + 1.0) ** 0.5, degree**0.5
        else:
            upper = (degree + 1.0) / ((2.0 * degree + 1.0) * (2.0 * degree + 3.0)) ** 0.5
            lower = degree / ((2.0 * degree + 1.0) * abs(2.0 * degree - 1.0)) ** 0.5
        ladder[degree + 1] = (x * ladder[degree] - lower * before) / upper
    return ladder

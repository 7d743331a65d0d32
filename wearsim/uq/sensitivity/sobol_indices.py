"""Sobol indices with confidence intervals: share of the variance due to each random input."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from itertools import combinations, combinations_with_replacement
from operator import itemgetter

import numpy as np
from numpy.polynomial.hermite_e import hermevander
from numpy.polynomial.legendre import legvander

from wearsim.types import FloatArray, IntArray
from wearsim.uq.estimation.intervals import UNKNOWN, Interval, t_interval
from wearsim.uq.estimation.moments import are_equal, is_constant

#: Index below which an effect whose interval includes 0 counts as none.
SMALL = 0.01

_NONE = Interval(0.0, 0.0, 0.0)
_MOST = 65536  # realisations used by a fit, sufficient for errors of 0.5 %
FEWEST_BASES = 10
_DEGREE = 10  # greatest degree of a polynomial
_TERMS = 120  # greatest number of terms, with the constant
_PER_TERM = 8  # least number of realisations per term
_BLOCK = 8192  # rows per block
_RIDGE = 1e-9  # relative regularisation, for terms that are equal in all realisations


def without_effect(index: Interval) -> bool:
    """Return whether an input has no significant effect."""
    return index.low <= 0.0 and index.value < SMALL


def first_order(values: FloatArray, groups: Mapping[str, FloatArray]) -> dict[str, Interval]:
    """Return the closed first-order Sobol index of each group of numbers, from any sample.

    Parameters
    ----------
    values : ndarray, shape (n,)
        Values of the realisations.
    groups : mapping of str to ndarray, shape (n, m)
        Numbers drawn for each random input, by its name; groups must be independent of each other,
        numbers within a group need not be.

    Returns
    -------
    dict of str to Interval
        Closed first-order Sobol index of each group, 0 to 1: var E[value | group]/var value,
        including interactions within the group. Exactly 0 for constant numbers or values; `UNKNOWN`
        if there are too few realisations for the group.

    Raises
    ------
    ValueError
        If a value or a number is not finite.

    Notes
    -----
    Given-data estimation by regression: E[value | group] is a polynomial in the ranks of the
    group's numbers, Legendre in the ranks or Hermite in their normal scores, of the total degree
    with the least leave-one-out error, at least 2 (Blatman and Sudret, Journal of Computational
    Physics 230 (2011), DOI 10.1016/j.jcp.2010.12.021). The unexplained variance is the mean product
    of the value and its leave-one-out error, which has no bias by overfitting (Kline, Saggio,
    Solvsten, Econometrica 88 (2020), DOI 10.3982/ECTA16410). The interval is the asymptotic one of
    that ratio of variances, plus the noise of the fitted terms, which dominates if there is no
    effect. It assumes independent realisations, and is too wide for evenly spread ones. At most the
    first 65536 realisations are used.

    Coverage: 89 to 100 % for samples of 200 or 1000. An interaction within a group is not detected
    if it has too many terms for the realisations. An index near 1 is underestimated by the loss of
    information in the ranks, by at most 1e-2 for 1000 realisations.
    """
    if not np.isfinite(values).all():
        raise ValueError("sensitivity needs finite values; leave out failed realisations")
    values = values[:_MOST]
    if are_equal(values):
        return dict.fromkeys(groups, _NONE)
    return {name: _share(values, numbers[:_MOST], name) for name, numbers in groups.items()}


def _share(values: FloatArray, numbers: FloatArray, name: str) -> Interval:
    """Return the share of the variance of `values` explained by `numbers`, (n, m)."""
    from scipy.special import ndtri  # noqa: PLC0415  (slow to import)

    if not np.isfinite(numbers).all():
        raise ValueError(f"sensitivity needs finite numbers, and some of {name} are not")
    count = len(values)
    # a column equal to another one adds no information
    varying = np.unique(numbers[:, np.ptp(numbers, axis=0) > 0.0], axis=1) if count else numbers
    if count > 1 and varying.shape[1] == 0:
        return _NONE
    if count < fewest_realisations(varying.shape[1]):
        return UNKNOWN
    ranks = np.stack([_ranks(column) for column in varying.T], axis=1)
    deviation = values - values.mean()
    fits = (
        _best_fit(ndtri(ranks), deviation, "hermite"),
        _best_fit(2.0 * ranks - 1.0, deviation, "legendre"),
    )
    _, terms, residual, left_out = min(fits, key=itemgetter(0))
    variance = float((deviation**2).sum()) / (count - 1)
    left = float((deviation * left_out).sum()) / (count - 1) / variance
    influence = (residual * left_out - left * deviation**2) / variance
    error = math.sqrt(float(influence.var()) / count + 2.0 * (terms - 1) * (left / count) ** 2)
    return t_interval(1.0 - left, error, math.inf).within(0.0, 1.0)


def _ranks(column: FloatArray) -> FloatArray:
    """Return the relative ranks, between 0 and 1; equal numbers have their mean rank."""
    _, place, counts = np.unique(column, return_inverse=True, return_counts=True)
    return np.asarray((np.cumsum(counts) - 0.5 * counts)[place] / len(column))


def saltelli_indices(
    blocks: FloatArray, names: Sequence[str]
) -> dict[str, tuple[Interval, Interval]]:
    """Return first-order and total Sobol indices from a Saltelli design.

    Parameters
    ----------
    blocks : ndarray, shape (bases, 2 + len(names))
        Values of the blocks A, B, and A with one group at a time from B. Rows with a nan, of a
        failed realisation, are left out.
    names : sequence of str
        Names of the groups, in the order of the blocks.

    Returns
    -------
    dict of str to (Interval, Interval)
        First-order and total index of each group, 0 to 1; unknown for fewer than 10 complete rows.
        Exactly 0 for a group that changes no value.

    Notes
    -----
    The total index is Jansen's (Computer Physics Communications 117 (1999), DOI
    10.1016/S0010-4655(98)00154-4). The first-order index is the combination of least estimated
    variance of Jansen's, which is exact for a group that causes all variance, and that of Saltelli
    et al. (Computer Physics Communications 181 (2010), DOI 10.1016/j.cpc.2009.09.018), which is
    exact for a group without effect. The intervals are those of the delta method over the rows, by
    Student's t.

    Coverage of first-order indices: 87 to 94 % for 32 rows, 91 to 95 % for 100 and 93 to 96 % for
    500; of total indices: 85 to 95, 92 to 95 and 93 to 96 %.
    """
    whole = blocks[np.isfinite(blocks).all(axis=1)]
    if len(whole) < FEWEST_BASES:
        return dict.fromkeys(names, (UNKNOWN, UNKNOWN))
    centre = float(whole[:, :2].mean())
    base, other, *mixed = (whole - centre).T
    square = 0.5 * (base**2 + other**2)
    if is_constant(centre, math.sqrt(float(square.mean()))):
        return dict.fromkeys(names, (_NONE, _NONE))
    indices = {}
    for name, values in zip(names, mixed, strict=True):
        saltelli = other * (values - base)
        jansen = square - 0.5 * (other - values) ** 2
        first = _combined(saltelli, jansen, square)
        indices[name] = (_ratio(first, square), _ratio(0.5 * (base - values) ** 2, square))
    return indices


def _combined(saltelli: FloatArray, jansen: FloatArray, square: FloatArray) -> FloatArray:
    """Return the combination of two numerators whose ratio to `square` has the least variance."""
    influences = [part - part.mean() / square.mean() * square for part in (saltelli, jansen)]
    (variance, covariance), (_, variance_of_jansen) = np.cov(influences)
    difference = variance + variance_of_jansen - 2.0 * covariance
    weight = (
        min(max((variance_of_jansen - covariance) / difference, 0.0), 1.0)
        if difference > 0.0
        else 1.0
    )
    return np.asarray(weight * saltelli + (1.0 - weight) * jansen)


def _ratio(part: FloatArray, square: FloatArray) -> Interval:
    """Return the ratio of two means over rows, with its interval."""
    share = float(part.mean() / square.mean())
    influence = (part - share * square) / float(square.mean())
    error = float(influence.std(ddof=1)) / math.sqrt(len(part))
    return t_interval(share, error, len(part) - 1).within(0.0, 1.0)


def fewest_realisations(numbers: int) -> int:
    """Return the number of realisations that a fit of so many numbers and their squares needs."""
    return _PER_TERM * (1 + 2 * numbers)


def _best_fit(
    scores: FloatArray, values: FloatArray, family: str
) -> tuple[float, int, FloatArray, FloatArray]:
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
    error : float
        Mean square of the leave-one-out prediction errors.
    terms : int
        Number of terms, with the constant.
    residual, left_out : ndarray, shape (n,)
        Residual and leave-one-out prediction error of each realisation.
    """
    count = len(values)
    distinct = [len(np.unique(column)) for column in scores.T]
    powers, ends = _terms(distinct, min(count // _PER_TERM, _TERMS))
    gram, moment = np.zeros((len(powers),) * 2), np.zeros(len(powers))
    for rows, design in _designs(scores, powers, family):
        gram += design.T @ design
        moment += design.T @ values[rows]
    # columns orthonormalised successively: the first k of them span the first k terms
    transform = np.linalg.inv(np.linalg.cholesky(gram + _RIDGE * count * np.eye(len(powers)))).T
    slopes = transform.T @ moment
    residual, left_out = np.empty((2, count, len(ends)))
    for rows, design in _designs(scores, powers, family):
        columns = design @ transform
        for k, end in enumerate(ends):
            residual[rows, k] = values[rows] - columns[:, :end] @ slopes[:end]
            left_out[rows, k] = residual[rows, k] / (1.0 - (columns[:, :end] ** 2).sum(axis=1))
    errors = (left_out**2).mean(axis=0)
    best = int(np.argmin(errors))
    return float(errors[best]), ends[best], residual[:, best], left_out[:, best]


def _terms(distinct: list[int], most: int) -> tuple[IntArray, list[int]]:
    """Return the powers of each term, (terms, m), and the possible numbers of terms.

    Terms are ordered by total degree, then by the number of factors.
    """
    width = len(distinct)
    powers, ends = [np.zeros(width, dtype=np.int64)], list[int]()
    for degree in range(1, _DEGREE + 1):
        for factors in range(1, min(degree, width) + 1):
            if len(powers) + math.comb(width, factors) * math.comb(degree - 1, factors - 1) > most:
                continue
            for chosen in combinations(range(width), factors):
                for more in combinations_with_replacement(chosen, degree - factors):
                    term = np.bincount([*chosen, *more], minlength=width)
                    if (term < distinct).all():
                        powers.append(term)
            if degree > 1:
                ends.append(len(powers))
    return np.array(powers), sorted(set(ends))


def _designs(
    scores: FloatArray, powers: IntArray, family: str
) -> Iterator[tuple[slice, FloatArray]]:
    """Yield the terms of successive blocks of rows, (rows, terms)."""
    for first in range(0, len(scores), _BLOCK):
        rows = slice(first, first + _BLOCK)
        degrees = _orthonormal(scores[rows], int(powers.max()), family)
        design = np.ones((degrees.shape[0], len(powers)))
        for number, column in enumerate(powers.T):
            design *= degrees.T[column, number].T
        yield rows, design


def _orthonormal(x: FloatArray, highest: int, family: str) -> FloatArray:
    """Return orthonormal polynomials of all degrees, (rows, m, degrees)."""
    degrees = np.arange(highest + 1)
    if family == "hermite":
        scale = 1.0 / np.sqrt([math.factorial(degree) for degree in degrees])
        return np.asarray(hermevander(x, highest) * scale)
    return np.asarray(legvander(x, highest) * np.sqrt(2.0 * degrees + 1.0))

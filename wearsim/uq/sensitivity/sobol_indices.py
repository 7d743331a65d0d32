"""How much of a value's variance each random input explains: Sobol indices with intervals."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from wearsim.types import FloatArray
from wearsim.uq.estimation.intervals import UNKNOWN, Interval, t_interval
from wearsim.uq.estimation.moments import is_constant
from wearsim.uq.sensitivity.polynomial_chaos import best_fit, fewest_realisations

SMALL = 0.01
"""Part of the variance below which an effect that may be none is called none."""

_NONE = Interval(0.0, 0.0, 0.0)
_MOST = 65536  # realisations a fit looks at: indices are known to 0.5 % by then
FEWEST_BASES = 10


def without_effect(index: Interval) -> bool:
    """Tell whether an input explains nothing, as far as can be seen."""
    return index.low <= 0.0 and index.value < SMALL


def first_order(values: FloatArray, groups: Mapping[str, FloatArray]) -> dict[str, Interval]:
    """Return which part of the variance each group of numbers explains alone, from any sample.

    Parameters
    ----------
    values : ndarray, shape (n,)
        Of the realisations.
    groups : mapping of str to ndarray, shape (n, m)
        The numbers drawn for each random input, by its name; groups must be independent of each
        other, numbers of one group need not be.

    Returns
    -------
    dict of str to Interval
        The closed first-order Sobol index of each group, 0 to 1: var E[value | group]/var value,
        with all that the group's own numbers do together. Exactly 0 for numbers or values that do
        not vary; unknown (`UNKNOWN`) where there are too few realisations for the group.

    Raises
    ------
    ValueError
        If a value or a number is not finite.

    Notes
    -----
    Given-data estimation by regression: E[value | group] is a polynomial in the ranks of the
    group's numbers, Legendre in the ranks or Hermite in their normal scores, of the total degree
    that predicts left-out realisations best, never below the squares (Blatman and Sudret,
    Journal of Computational Physics 230 (2011), DOI 10.1016/j.jcp.2010.12.021). What it leaves
    unexplained is the mean product of the value and its left-one-out error, which overfitting does
    not bias (Kline, Saggio, Solvsten, Econometrica 88 (2020), DOI 10.3982/ECTA16410). The interval
    is the asymptotic one of that ratio of variances, with the noise of fitted terms added, which
    alone is left where there is no effect. It takes realisations as independent, and so is too wide
    for evenly spread ones. Of more than 65536 realisations the first are used.

    Intervals hold the index in 89 to 100 % of samples of 200 or 1000. Where the terms of an
    interaction within a group are too many for the realisations, it is missed; and an index near 1
    comes out low by what the ranks lose of the numbers, 1e-2 of 1000 realisations at most.
    """
    if not np.isfinite(values).all():
        raise ValueError("sensitivity needs finite values; leave out failed realisations")
    values = values[:_MOST]
    if len(values) > 1 and is_constant(float(values.mean()), float(values.std())):
        return dict.fromkeys(groups, _NONE)
    return {name: _share(values, numbers[:_MOST], name) for name, numbers in groups.items()}


def _share(values: FloatArray, numbers: FloatArray, name: str) -> Interval:
    """Return the part of the variance of `values` that `numbers`, (n, m), explain."""
    from scipy.special import ndtri  # noqa: PLC0415  (slow to import)

    if not np.isfinite(numbers).all():
        raise ValueError(f"sensitivity needs finite numbers, and some of {name} are not")
    count = len(values)
    # of two columns that are the same, the second says nothing new
    varying = np.unique(numbers[:, np.ptp(numbers, axis=0) > 0.0], axis=1) if count else numbers
    if count > 1 and varying.shape[1] == 0:
        return _NONE
    if count < fewest_realisations(varying.shape[1]):
        return UNKNOWN
    ranks = np.stack([_ranks(column) for column in varying.T], axis=1)
    apart = values - values.mean()
    fits = (
        best_fit(ndtri(ranks), apart, "hermite"),
        best_fit(2.0 * ranks - 1.0, apart, "legendre"),
    )
    fit = min(fits, key=lambda one: one.error)
    without = fit.residual / (1.0 - fit.leverage)
    variance = float((apart**2).sum()) / (count - 1)
    left = float((apart * without).sum()) / (count - 1) / variance
    influence = (fit.residual * without - left * apart**2) / variance
    noise = 2.0 * (fit.terms - 1) * (left / count) ** 2
    error = math.sqrt(float(influence.var()) / count + noise)
    return t_interval(1.0 - left, error, math.inf).within(0.0, 1.0)


def _ranks(column: FloatArray) -> FloatArray:
    """Return the ranks in parts of all, between 0 and 1; of equal numbers their mean."""
    _, place, many = np.unique(column, return_inverse=True, return_counts=True)
    return np.asarray((np.cumsum(many) - 0.5 * many)[place] / len(column))


def saltelli_indices(
    blocks: FloatArray, names: Sequence[str]
) -> dict[str, tuple[Interval, Interval]]:
    """Return first-order and total Sobol indices from a design made for them.

    Parameters
    ----------
    blocks : ndarray, shape (bases, 2 + len(names))
        Values of the blocks A, B, and A with each group in turn from B. Rows with a value of nan,
        of a realisation that failed, are left out whole.
    names : sequence of str
        Of the groups, in the order of the blocks.

    Returns
    -------
    dict of str to (Interval, Interval)
        First-order and total index of each group, 0 to 1; unknown below 10 whole rows. Exactly 0
        for a group that changes no value.

    Notes
    -----
    The total index is Jansen's (Computer Physics Communications 117 (1999), DOI
    10.1016/S0010-4655(98)00154-4). The first-order index is the combination of the least estimated
    variance of Jansen's, which is exact for a group that does all, and of that of Saltelli et al.
    (Computer Physics Communications 181 (2010), DOI 10.1016/j.cpc.2009.09.018), which is exact for
    one that does nothing. The intervals are the delta method's over the rows, by Student's t.

    They hold first-order indices in 87 to 94 % of designs of 32 rows, 91 to 95 % of 100 and 93 to
    96 % of 500, total ones in 85 to 95, 92 to 95 and 93 to 96 %.
    """
    whole = blocks[np.isfinite(blocks).all(axis=1)]
    if len(whole) < FEWEST_BASES:
        return dict.fromkeys(names, (UNKNOWN, UNKNOWN))
    centre = float(whole[:, :2].mean())
    base, other, *mixed = (whole - centre).T
    square = 0.5 * (base**2 + other**2)
    if is_constant(centre, math.sqrt(float(square.mean()))):
        return dict.fromkeys(names, (_NONE, _NONE))
    found = {}
    for name, values in zip(names, mixed, strict=True):
        saltelli = other * (values - base)
        jansen = square - 0.5 * (other - values) ** 2
        total = 0.5 * (base - values) ** 2
        first = _combined(saltelli, jansen, square)
        found[name] = (_ratio(first, square), _ratio(total, square))
    return found


def _combined(one: FloatArray, other: FloatArray, square: FloatArray) -> FloatArray:
    """Return the mixture of two numerators whose ratio to `square` is known best."""
    influences = [part - part.mean() / square.mean() * square for part in (one, other)]
    (own, both), (_, others) = np.cov(influences)
    apart = own + others - 2.0 * both
    weight = min(max((others - both) / apart, 0.0), 1.0) if apart > 0.0 else 1.0
    return np.asarray(weight * one + (1.0 - weight) * other)


def _ratio(part: FloatArray, square: FloatArray) -> Interval:
    """Return the ratio of two means over rows."""
    share = float(part.mean() / square.mean())
    influence = (part - share * square) / float(square.mean())
    error = float(influence.std(ddof=1)) / math.sqrt(len(part))
    return t_interval(share, error, len(part) - 1).within(0.0, 1.0)

"""Units in service after an update by their returns: goodness of fit and remaining lives."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from wearsim.types import FloatArray, IntArray
from wearsim.uq.distributions.two_levels import TwoLevels, weighted_quantiles
from wearsim.uq.estimation.intervals import ENDS, Interval
from wearsim.uq.survival.distributions import FactorMixture
from wearsim.uq.survival.returns import Fleet, LifeFunctions

_DRAWS = 1000  # of the posterior
_SEED = 1983  # of these draws
_PER_BAND = 4.0  # failures predicted in a band of lives
_MOST_BANDS = 6
_EDGES = 200  # lives among which the edges of bands are chosen
_NODES = 81  # of the functions of a scatter
_LEAST = 1e-4  # weight over the greatest up to which the posterior counts for remaining lives
_FURTHER = np.geomspace(1e-4, 30.0, 73)  # further lives, over the median life


class Predicted(NamedTuple):
    """Predicted numbers of failures in bands of lives, and in all: means and 95 % intervals.

    They are at most the number of units.
    """

    mean: FloatArray
    low: FloatArray
    high: FloatArray


@dataclass(frozen=True)
class FleetCheck:
    """Failures that were predicted and observed.

    Parameters
    ----------
    edges : ndarray, shape (bands + 1,)
        Lives between the bands.
    observed : ndarray, shape (bands + 1,)
        Failures in each band, of an inspection in proportion to their probability, and in all.
    before, after : Predicted
        Failures that the time in service of the units leads to, before and after the update, in
        each band and in all.
    surprise : float
        Probability of a number of failures, before the update, that differs as much to either side.
    fit : float
        Probability of failures in bands that agree less with the prediction after the update.
    """

    edges: FloatArray
    observed: FloatArray
    before: Predicted
    after: Predicted
    surprise: float
    fit: float


def check_fleet(
    designs: Sequence[FactorMixture], before: TwoLevels, after: TwoLevels, fleet: Fleet
) -> FleetCheck:
    """Return predicted and observed failures.

    Parameters
    ----------
    designs : sequence of FactorMixture
    before, after : TwoLevels
        Of m - ln L and t, before and after the update.
    fleet : Fleet

    Notes
    -----
    Given m and t, failures in a band are a Poisson number with the mean of the cumulative hazards
    that the units passed in it, also where units are withdrawn at random (Andersen, Borgan, Gill
    and Keiding, Statistical Models Based on Counting Processes (1993), section III.2). `fit` is the
    posterior predictive probability of a greater sum of (observed - predicted)^2/predicted; it is
    conservative, near 0.5 rather than uniform if the model holds.
    """
    from scipy.special import pdtr  # noqa: PLC0415  (slow to load)

    rng = np.random.default_rng(_SEED)
    uniform = rng.random((_DRAWS, len(fleet)))
    edges = _bands(designs, after, fleet)
    counts, means = _exposed(designs, after, fleet, edges, uniform)
    observed = counts.mean(axis=0)
    replicated = rng.poisson(means)
    distance, replica = (
        ((numbers - means) ** 2 / np.maximum(means, 1e-12)).sum(axis=1)
        for numbers in (counts, replicated)
    )
    fit = float((replica > distance).mean() + 0.5 * (replica == distance).mean())
    _, earlier = _exposed(designs, before, fleet, edges, uniform)
    failures, total = int(fleet.failed.sum()), earlier.sum(axis=1)
    up_to, below = pdtr(failures, total), pdtr(failures - 1, total) if failures else 0.0
    share = float(np.mean(0.5 * (up_to + below)))
    return FleetCheck(
        edges,
        np.append(observed, observed.sum()),
        _predicted(rng.poisson(earlier), len(fleet)),
        _predicted(replicated, len(fleet)),
        2.0 * min(share, 1.0 - share),
        fit,
    )


def _predicted(numbers: IntArray, units: int) -> Predicted:
    """Return the prediction of drawn numbers of failures, shape (draws, bands)."""
    numbers = np.minimum(np.column_stack([numbers, numbers.sum(axis=1)]), units)
    low, high = np.quantile(numbers, ENDS, axis=0, method="inverted_cdf")
    return Predicted(numbers.mean(axis=0), low, high)


def _draws(levels: TwoLevels, count: int) -> Iterator[tuple[float, FloatArray, IntArray]]:
    """Yield each scatter with the means that are drawn with it, and the numbers of the draws."""
    below = np.cumsum(levels.weight)
    rows = np.searchsorted(below, (np.arange(count) + 0.5) / count * below[-1])
    # the draws of a posterior in the order of its rows would go with each other's uniform numbers
    numbers = np.random.default_rng(_SEED).permutation(count)
    for t in np.unique(levels.t[rows]):
        chosen = levels.t[rows] == t
        yield float(t), levels.m[rows[chosen]], numbers[chosen]


def _exposed(
    designs: Sequence[FactorMixture],
    levels: TwoLevels,
    fleet: Fleet,
    edges: FloatArray,
    uniform: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """Return failures and cumulative hazards in bands for draws of m and t, (draws, bands)."""
    shape = len(uniform), len(edges) - 1
    counts, hazards = np.zeros(shape), np.zeros(shape)
    with np.errstate(divide="ignore"):
        first, last, at = np.log(fleet.low), np.log(fleet.high), np.log(edges[1:-1])
    for t, m, numbers in _draws(levels, len(uniform)):
        for design, lives in enumerate(designs):
            units = np.flatnonzero(fleet.design == design)
            if not len(units):
                continue
            functions = LifeFunctions(lives, t, _NODES)
            start = functions.hazard(m[:, None] + first[units])
            failed = fleet.failed[units]
            # a unit found failed at an inspection fails at a random life between both ends
            stop = functions.hazard(m[:, None] + np.where(failed, last[units], first[units]))
            end = start - np.log1p(uniform[numbers][:, units] * np.expm1(start - stop))
            none, all_ = np.zeros((len(m), 1)), np.full((len(m), 1), np.inf)
            limits = np.hstack([none, functions.hazard(m[:, None] + at), all_])
            for band in range(shape[1]):
                low, high = limits[:, band, None], limits[:, band + 1, None]
                hazards[numbers, band] += (np.clip(end, low, high) - low).sum(axis=1)
                counts[numbers, band] += ((end >= low) & (end < high) & failed).sum(axis=1)
    return counts, np.maximum(hazards, 0.0)


def _bands(designs: Sequence[FactorMixture], levels: TwoLevels, fleet: Fleet) -> FloatArray:
    """Return edges of bands of lives in which similar numbers of failures are predicted."""
    ages = np.where(fleet.failed, fleet.high, fleet.low)
    grid = np.linspace(0.0, float(ages.max()), _EDGES + 1)
    m, t = levels.plug_in
    total = np.zeros(len(grid))
    with np.errstate(divide="ignore"):
        for design, lives in enumerate(designs):
            functions = LifeFunctions(lives, t, _NODES)
            passed = functions.hazard(m + np.log(grid))
            total += np.minimum(
                passed[:, None], functions.hazard(m + np.log(ages[fleet.design == design]))
            ).sum(axis=1)
    bands = int(np.clip(total[-1] // _PER_BAND, 1, _MOST_BANDS))
    inner = np.interp(np.arange(1, bands) * total[-1] / bands, total, grid)
    return np.unique(np.concatenate([[0.0], inner, grid[-1:]]))


class RemainingLife(NamedTuple):
    """Remaining life of units of one age and design.

    Parameters
    ----------
    lives : tuple of Interval
        Further lives that shares of such units do not reach: predictive, with the 95 % credible
        interval.
    survival : Interval, optional
        Probability that a unit reaches the target.
    """

    lives: tuple[Interval, ...]
    survival: Interval | None


def remaining_lives(
    lives: FactorMixture,
    levels: TwoLevels,
    ages: FloatArray,
    shares: Sequence[float],
    target: float | None,
) -> list[RemainingLife]:
    """Return the remaining life of running units, S(age + life)/S(age) over the posterior.

    Parameters
    ----------
    lives : FactorMixture
        Realisations of their design.
    levels : TwoLevels
        Of m - ln L and t, after the update, which contains that these units run.
    ages : ndarray, shape (units,)
    shares : sequence of float
        0.1 for the further life that 10 % of such units do not reach.
    target : float, optional
        Life of which the probability is stated, from the beginning.
    """
    kept = levels.weight > _LEAST * levels.weight.max()
    m, t, weight = levels.m[kept], levels.t[kept], levels.weight[kept]
    weight = weight / weight.sum()
    middle = float(np.exp(np.median(np.log(lives.kappa[lives.is_finite])) - weight @ m))
    further = middle * _FURTHER
    ends = np.concatenate([ages[:, None] + further, np.full((len(ages), 1), target or 1.0)], axis=1)
    ratio = np.empty((len(m), *ends.shape))
    for scatter in np.unique(t):
        rows, functions = t == scatter, LifeFunctions(lives, float(scatter), _NODES)
        at = functions.survived(m[rows, None, None] + np.log(ends))
        ratio[rows] = np.exp(at - functions.survived(m[rows, None] + np.log(ages))[:, :, None])
    remaining = []
    for place in range(len(ages)):
        curves, reached = ratio[:, place, :-1], ratio[:, place, -1]
        mean = (weight @ curves)[None, :]
        stated = tuple(
            _about(
                float(_crossings(mean, 1.0 - share, further)[0]),
                _crossings(curves, 1.0 - share, further),
                weight,
            )
            for share in shares
        )
        survives = target is not None and target > ages[place]
        survival = _about(float(weight @ reached), reached, weight) if survives else None
        remaining.append(RemainingLife(stated, survival))
    return remaining


def _about(value: float, values: FloatArray, weight: FloatArray) -> Interval:
    """Return a value with the interval of weighted ones, which includes it."""
    low, high = weighted_quantiles(values, weight, ENDS).tolist()
    return Interval(value, min(low, value), max(high, value))


def _crossings(curves: FloatArray, level: float, life: FloatArray) -> FloatArray:
    """Return the lives at which falling curves, shape (curves, lives), reach a level."""
    place = np.clip((curves > level).sum(axis=1), 1, len(life) - 1)
    row = np.arange(len(curves))
    above, below = curves[row, place - 1], curves[row, place]
    part = np.clip((above - level) / np.maximum(above - below, 1e-300), 0.0, 1.0)
    log = np.log(life)
    reached = np.exp(log[place - 1] + part * (log[place] - log[place - 1]))
    return np.where(curves[:, -1] > level, math.inf, reached)

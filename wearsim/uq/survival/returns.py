r"""Returns from the field: lives of units in service update what is not known of the wear factor.

With ln K ~ N(m, t^2) and a life factor L that all units share, a unit has failed before n with the
probability F(ln n + m - ln L; t), a mean over the realisations. Units that failed contribute its
derivative, units that run contribute 1 - F, and units that were found failed at an inspection the
difference of two values. The likelihood of all units is the product, a function of m - ln L and t.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy

from wearsim.types import BoolArray, FloatArray, IntArray
from wearsim.uq.distributions.two_levels import TwoLevels
from wearsim.uq.survival.distributions import FactorMixture
from wearsim.uq.survival.scores import score_function
from wearsim.uq.survival.two_levels import UncertainLives

_NODES = 241  # of ln life at which the functions of a scatter are tabulated
_FEW_NODES = 81  # the same where the posterior is only sought
_REACH = 9.0  # of these nodes beyond the realisations, in scatters
_COARSE = 241  # means at which the likelihood is computed to find where it is
_MEANS, _SCATTERS = 101, 41  # of the posterior
_PRIOR_MEANS = 61  # of the prior, for each scatter
_LEAST_WEIGHT = 1e-7  # over the greatest, of a mean and scatter of the prior
_SHARE = 1e-6  # of the posterior on each side that is left out
_EQUAL, _EQUAL_PART = 2e-3, 0.01  # differences up to which scatters are taken as equal
_FEW = 6  # scatters up to which they are not interpolated
_FACTORS = np.linspace(-4.0, 4.0, 33)  # of the life factor, in standard deviations
_FACTOR_SHARES = np.exp(-0.5 * _FACTORS**2) / np.exp(-0.5 * _FACTORS**2).sum()


@dataclass(frozen=True)
class Fleet:
    """Units in service, with the lives at which each failed or was last known to run.

    Parameters
    ----------
    low, high : ndarray, shape (units,)
        Life up to which a unit was known to run, and at which it was found failed: equal where the
        life is known, infinite where it runs.
    design : ndarray of int, shape (units,)
        Number of its design.
    """

    low: FloatArray
    high: FloatArray
    design: IntArray

    @property
    def failed(self) -> BoolArray:
        """Whether each unit failed."""
        return np.isfinite(self.high)

    def __len__(self) -> int:
        return len(self.low)


class LifeFunctions:
    """Logarithms of probabilities and of the density of lives for one scatter, with m = 0.

    Parameters
    ----------
    lives : FactorMixture
    t : float
        Scatter of ln K.
    count : int
        Number of lives at which they are tabulated.
    """

    def __init__(self, lives: FactorMixture, t: float, count: int = _NODES) -> None:
        with np.errstate(divide="ignore"):
            log = np.log(lives.kappa)
        finite, reach = log[np.isfinite(log)], _REACH * t
        nodes = np.linspace(finite.min() - reach, finite.max() + reach, count)
        scatter = t * lives.spread
        z = (nodes[:, None] + t * np.asarray(lives.shift) - log) / scatter
        inside = np.where(np.isfinite(z), z, 0.0)
        exponent = np.where(np.isfinite(z), -0.5 * z * z, -np.inf)
        density = _log_mean(exponent)
        part = np.exp(exponent - density[:, None]) / lives.count
        density -= math.log(scatter * math.sqrt(2.0 * math.pi))
        failed, survived = (
            _log_mean(scipy.special.log_ndtr(z)),
            _log_mean(scipy.special.log_ndtr(-z)),
        )
        slopes = [
            np.exp(density - failed),
            -np.exp(density - survived),
            -(part * inside).sum(axis=1) / scatter,
        ]
        values = np.stack([failed, survived, density], axis=1)
        spline = scipy.interpolate.CubicHermiteSpline(nodes, values, np.stack(slopes, axis=1))
        self._ends = nodes[0], nodes[-1]
        self._splines = [
            scipy.interpolate.PPoly.construct_fast(spline.c[..., k], nodes) for k in range(3)
        ]

    def failed(self, log: FloatArray) -> FloatArray:
        """Return ln P(life < n), shape as `log`."""
        return self._value(0, log)

    def survived(self, log: FloatArray) -> FloatArray:
        """Return ln P(life > n), shape as `log`."""
        return self._value(1, log)

    def density(self, log: FloatArray) -> FloatArray:
        """Return the logarithm of the density of ln life, shape as `log`."""
        return self._value(2, log)

    def hazard(self, log: FloatArray) -> FloatArray:
        """Return the cumulative hazard -ln P(life > n), shape as `log`."""
        return np.maximum(-self.survived(np.maximum(log, self._ends[0])), 0.0)

    def _value(self, number: int, log: FloatArray) -> FloatArray:
        low, high = self._ends
        inside, spline = np.clip(log, low, high), self._splines[number]
        value = np.asarray(spline(inside))
        if (inside != log).any():  # beyond the table the logarithm continues with its slope
            value += (log - inside) * spline(inside, 1)
        return value

    def likelihood(self, fleet: Fleet, m: FloatArray) -> FloatArray:
        """Return the logarithm of the likelihood of units for values of m, shape as `m`."""
        total = np.zeros(m.shape)
        known = fleet.failed & (fleet.low == fleet.high)
        inspected = fleet.failed & ~known
        for places, part in ((known, self.density), (~fleet.failed, self.survived)):
            ages, repeats = np.unique(fleet.low[places], return_counts=True)
            total += part(m[:, None] + np.log(ages)) @ repeats
        if inspected.any():
            with np.errstate(divide="ignore"):
                first, last = np.log(fleet.low[inspected]), np.log(fleet.high[inspected])
            total += _log_between(self, m[:, None] + first, m[:, None] + last).sum(axis=1)
        return total


def _log_mean(log: FloatArray) -> FloatArray:
    """Return the logarithm of the mean over the second axis, at least -1e9."""
    top = np.maximum(log.max(axis=1), -1e9)
    return np.asarray(
        np.maximum(top + np.log(np.exp(log - top[:, None]).mean(axis=1) + 1e-300), -1e9)
    )


def _log_between(functions: LifeFunctions, first: FloatArray, last: FloatArray) -> FloatArray:
    """Return the logarithm of the probability of a failure between two lives."""
    start = np.maximum(first, -1e6)  # an inspection that found a unit failed may be the first one
    from_below = functions.failed(last), functions.failed(start)
    from_above = functions.survived(start), functions.survived(last)
    with np.errstate(divide="ignore", invalid="ignore"):
        both = [
            a + np.log(-np.expm1(np.minimum(b - a, -1e-300))) for a, b in (from_below, from_above)
        ]
    return np.where(from_below[0] < from_above[0], *both)


@dataclass(frozen=True)
class FieldPosterior:
    """What is not known of the wear factor and of the life factor, before and after returns.

    The first level of both is m - ln L and t, on which lives depend.

    Parameters
    ----------
    before, after : TwoLevels
    log_factor : ndarray, shape (n,)
        Values of ln L, and
    factor_weight : ndarray, shape (n,)
        their weights after the returns.
    """

    before: TwoLevels
    after: TwoLevels
    log_factor: FloatArray
    factor_weight: FloatArray

    def lives_before(self, mixture: FactorMixture) -> UncertainLives:
        """Return the lives of a design in the field before the returns."""
        return _lives(mixture, self.before)

    def lives_after(self, mixture: FactorMixture) -> UncertainLives:
        """Return the lives of a design in the field after the returns.

        The sampling error of its realisations is part of the posterior.
        """
        return _lives(replace(mixture, exact=True), self.after)


def _lives(mixture: FactorMixture, levels: TwoLevels) -> UncertainLives:
    return UncertainLives(replace(mixture, score=score_function(levels)), levels)


def update(
    designs: Sequence[FactorMixture], levels: TwoLevels, fleet: Fleet, spread: float
) -> FieldPosterior:
    """Return the posterior of the wear factor and of the life factor, given units in service.

    Parameters
    ----------
    designs : sequence of FactorMixture
        Realisations of each design.
    levels : TwoLevels
        Weights over mean m and scatter t of ln K, from wear tests.
    fleet : Fleet
    spread : float
        Standard deviation of the logarithm of the life factor, whose prior median is 1; 0 for a
        life factor of 1.

    Notes
    -----
    Lives of a finite number of realisations are too long or too short by a common factor, whose
    scatter is added to that of the life factor: returns make up for it. The same of the scatter of
    the realisations is neglected.
    """
    scatters, owner = _scatters_of(levels)
    widened = math.hypot(spread, max(_location_error(lives) for lives in designs))
    weight, moved = _with_factor(levels, widened)
    chances = np.empty_like(moved)
    for number, t in enumerate(scatters):
        m = moved[owner == number]
        grid = np.linspace(m.min() - 1e-9, m.max() + 1e-9, _COARSE)
        log_likelihood = _total(designs, float(t), fleet, grid, _FEW_NODES)
        chances[owner == number] = np.interp(m, grid, log_likelihood) + np.log(
            weight[owner == number]
        )
    posterior = np.exp(chances - chances.max())
    m_grid = _covering(moved.ravel(), posterior.ravel(), _MEANS)
    total = np.bincount(owner, posterior.sum(axis=1))
    after, factors = _refined(
        designs, levels, fleet, widened, m_grid, _scatter_grid(scatters, total / total.sum())
    )
    # the part of the life factor itself
    part = (spread / widened) ** 2 if widened else 0.0
    return FieldPosterior(_before(levels, spread), after, part * factors[0], factors[1])


def _location_error(lives: FactorMixture) -> float:
    """Return the standard error of the mean of ln kappa."""
    if lives.exact or lives.count < 2:
        return 0.0
    return float(lives.log_kappa[0].std()) / math.sqrt(lives.count)


def _scatters_of(levels: TwoLevels) -> tuple[FloatArray, IntArray]:
    """Return the scatters of a posterior, nearly equal ones merged, and the scatter of each row."""
    scatters, owner = np.unique(levels.t, return_inverse=True)
    starts = [0]
    for place, t in enumerate(scatters):
        if t - scatters[starts[-1]] > max(_EQUAL, _EQUAL_PART * t):
            starts.append(place)
    group = np.searchsorted(starts, np.arange(len(scatters)), side="right") - 1
    weight = np.bincount(owner, levels.weight)
    return np.bincount(group, weight * scatters) / np.bincount(group, weight), group[owner]


def _total(
    designs: Sequence[FactorMixture], t: float, fleet: Fleet, m: FloatArray, nodes: int = _NODES
) -> FloatArray:
    """Return the logarithm of the likelihood of the units of all designs for one scatter."""
    total = np.zeros(m.shape)
    for number, lives in enumerate(designs):
        chosen = fleet.design == number
        if chosen.any():
            total += LifeFunctions(lives, t, nodes).likelihood(
                Fleet(fleet.low[chosen], fleet.high[chosen], fleet.design[chosen]), m
            )
    return total


def _with_factor(levels: TwoLevels, spread: float) -> tuple[FloatArray, FloatArray]:
    """Return weights and values of m - ln L for each row and life factor, shape (rows, factors)."""
    steps = _FACTORS * spread if spread else np.zeros(1)
    shares = _FACTOR_SHARES if spread else np.ones(1)
    return levels.weight[:, None] * shares, levels.m[:, None] - steps


def _covering(values: FloatArray, weight: FloatArray, count: int) -> FloatArray:
    """Return equally spaced values over the greatest part of a distribution."""
    order = np.argsort(values)
    ordered, below = values[order], np.cumsum(weight[order]) / weight.sum()
    low = ordered[np.searchsorted(below, _SHARE)]
    high = ordered[min(int(np.searchsorted(below, 1.0 - _SHARE)), len(ordered) - 1)]
    margin = 0.05 * (high - low) + 1e-3
    return np.linspace(low - margin, high + margin, count)


def _scatter_grid(scatters: FloatArray, weight: FloatArray) -> FloatArray:
    """Return scatters over the greatest part of the posterior, finer than in the prior."""
    if len(scatters) <= _FEW:
        return scatters
    inside = np.flatnonzero(weight > _SHARE)
    low, high = scatters[max(inside[0] - 1, 0)], scatters[min(inside[-1] + 1, len(scatters) - 1)]
    return np.linspace(low, high, _SCATTERS)


def _refined(
    designs: Sequence[FactorMixture],
    levels: TwoLevels,
    fleet: Fleet,
    spread: float,
    m_grid: FloatArray,
    t_grid: FloatArray,
) -> tuple[TwoLevels, tuple[FloatArray, FloatArray]]:
    """Return the posterior on a grid of m - ln L and t, and values of ln L with their weights."""
    scatters, owner = _scatters_of(levels)
    by_scatter = [(levels.m[owner == k], levels.weight[owner == k]) for k in range(len(scatters))]
    overlap = _overlaps(scatters, t_grid)
    few, step = len(scatters) <= _FEW, m_grid[1] - m_grid[0]
    likelihood, parts = [], []
    for row, t in enumerate(t_grid):
        likelihood.append(_total(designs, float(t), fleet, m_grid))
        shares = (scatters == t).astype(float) if few else overlap[:, row]
        used = np.flatnonzero(shares > 0.0)
        m = np.concatenate([by_scatter[k][0] for k in used])
        weight = np.concatenate([shares[k] * by_scatter[k][1] for k in used])
        gaps = [_gap(by_scatter[k][0], step) for k in used]
        smooth = np.concatenate(
            [np.full(len(by_scatter[k][0]), g) for k, g in zip(used, gaps, strict=True)]
        )
        parts.append((m, weight, np.hypot(spread, smooth)))
    log = np.array(likelihood)
    posterior = np.zeros_like(log)
    bins = np.linspace(-5.0, 5.0, 201) * (spread or 1.0)
    factor = np.zeros(len(bins) - 1)
    top = log.max()
    for row, (m, weight, width) in enumerate(parts):
        z = (m_grid - m[:, None]) / width[:, None]
        joint = (weight / width)[:, None] * np.exp(-0.5 * z * z + log[row] - top)
        posterior[row] = joint.sum(axis=0)
        if spread:
            factor += np.histogram(m[:, None] - m_grid, bins, weights=joint)[0]
    place = posterior > _LEAST_WEIGHT * posterior.max()
    means = np.broadcast_to(m_grid, posterior.shape)[place]
    scatter = np.broadcast_to(t_grid[:, None], posterior.shape)[place]
    after = TwoLevels(means, scatter, posterior[place], levels.specimens, levels.contained)
    middle = 0.5 * (bins[1:] + bins[:-1])
    if not spread:
        middle, factor = np.zeros(1), np.ones(1)
    return after, (middle, factor / factor.sum())


def _before(levels: TwoLevels, spread: float) -> TwoLevels:
    """Return the prior of m - ln L and t, on a grid of means for each scatter."""
    if not spread:
        return levels
    scatters, owner = _scatters_of(levels)
    means, weights = [], []
    for number in range(len(scatters)):
        m, weight = levels.m[owner == number], levels.weight[owner == number]
        moved = m[:, None] - spread * _FACTORS
        grid = np.linspace(moved.min(), moved.max(), _PRIOR_MEANS)
        place = (moved - grid[0]) / (grid[1] - grid[0])
        first = np.clip(place.astype(np.int64), 0, _PRIOR_MEANS - 2)
        # between two values, so that the mean is kept
        part, share = place - first, weight[:, None] * _FACTOR_SHARES
        total = np.bincount(first.ravel(), (share * (1.0 - part)).ravel(), _PRIOR_MEANS)
        total += np.bincount(first.ravel() + 1, (share * part).ravel(), _PRIOR_MEANS)
        means.append(grid)
        weights.append(total)
    m, weight = np.concatenate(means), np.concatenate(weights)
    kept, t = weight > _LEAST_WEIGHT * weight.max(), np.repeat(scatters, _PRIOR_MEANS)
    return TwoLevels(m[kept], t[kept], weight[kept], levels.specimens, levels.contained)


def _overlaps(scatters: FloatArray, grid: FloatArray) -> FloatArray:
    """Return the part of the weight of each scatter that belongs to each of a finer grid.

    The weight of a scatter is spread evenly up to the middles between it and its neighbours.
    """
    edges = np.concatenate([scatters[:1], 0.5 * (scatters[1:] + scatters[:-1]), scatters[-1:]])
    cells = np.concatenate([[-np.inf], 0.5 * (grid[1:] + grid[:-1]), [np.inf]])
    low = np.maximum(edges[:-1, None], cells[:-1])
    high = np.minimum(edges[1:, None], cells[1:])
    return np.asarray(np.maximum(high - low, 0.0) / np.maximum(np.diff(edges), 1e-300)[:, None])


def _gap(m: FloatArray, step: float) -> float:
    """Return the width by which the means of a scatter are smoothed to a density."""
    spacing = float(np.diff(np.unique(m)).min()) if len(m) > 1 else 0.0
    return max(0.6 * spacing, 0.6 * step)

"""Comparison of the lives of two designs that were drawn with common random numbers."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from wearsim.types import FloatArray
from wearsim.uq.estimation.intervals import CONFIDENCE, UNKNOWN, Interval, t_quantile
from wearsim.uq.estimation.mann_whitney import part_below
from wearsim.uq.survival.distributions import CountedLives, LifeDistribution, logit_interval
from wearsim.uq.survival.lives import median_rank, proportion

SAMPLES = 2000  # bootstrap samples
_GRID = 401  # lives at which mixtures are evaluated
_ROUNDING = 1e-12  # relative distance of lives about a step
_FARTHEST = 50.0  # of ln life from the middle, beyond which lives are 0 or infinite
_MOST = 4_000_000  # numbers of a block of samples
_LARGEST = 40_000_000  # probabilities at all lives, beyond which steps are not resolved
FEWEST = 5  # realisations for an interval


def same_machine(first: FloatArray, second: FloatArray, most: float = math.inf) -> Interval:
    """Return the share of machines on which the first design outlives the second.

    Parameters
    ----------
    first, second : ndarray, shape (n,)
        Lives with the same draws, in the same order.
    most : float
        Time at which both are censored. Pairs that both reach it are undecided: the ends count
        them for either side, the value counts one half.

    Returns
    -------
    Interval
        Exact, after Clopper and Pearson.
    """
    count, undecided = len(first), (first >= most) & (second >= most)
    more = int(((first > second) & ~undecided).sum())
    equal = int(((first == second) & ~undecided).sum())
    if not count:
        return UNKNOWN
    value = (more + 0.5 * (equal + int(undecided.sum()))) / count
    low, high = more, more + equal + int(undecided.sum())
    return Interval(value, proportion(low, count).low, proportion(high, count).high)


def two_specimens(
    first: LifeDistribution,
    second: LifeDistribution,
    most: float = math.inf,
    paired: bool = True,
) -> Interval:
    """Return the probability that a specimen of one design outlives another's, drawn separately.

    Parameters
    ----------
    first, second : LifeDistribution
    most : float
        Time at which lives are censored. Where both reach it the pair is undecided: the ends count
        it for either side, the value one half.
    paired : bool
        Whether realisations of equal place have common draws, which are then not compared with each
        other, and whose covariance counts.

    Returns
    -------
    Interval
        Student's t on the logit scale, with the error of DeLong, DeLong and Clarke-Pearson,
        Biometrics 44 (1988), DOI 10.2307/2531595. Unknown for wear factors with so many single
        values that the steps of the probabilities of all realisations are too many.
    """
    both_exact = first.exact and second.exact
    n, m = first.count, second.count
    if min(n, m) < FEWEST and not both_exact:
        return UNKNOWN
    if isinstance(first, CountedLives) and isinstance(second, CountedLives):
        lives = [np.minimum(item.life, most) for item in (first, second)]
        shares = part_below(*lives), 1.0 - part_below(lives[1], lives[0])
        left = [float((item >= most).mean()) for item in lives]
        same_draws = (lives[0] > lives[1]) + 0.5 * (lives[0] == lives[1]) if paired else np.zeros(n)
    else:
        grid = _common_grid((first, second), most)
        if len(grid) * max(n, m) > _LARGEST:
            return UNKNOWN
        # from life 0 on, where nothing has failed
        first_failed, second_failed = (
            np.insert(item.failed(grid), 0, 0.0, axis=1) for item in (first, second)
        )
        alive, fails = (
            1.0 - 0.5 * (first_failed[:, 1:] + first_failed[:, :-1]),
            np.diff(second_failed, axis=1),
        )
        last = 1.0 - first_failed[:, -1], 1.0 - second_failed[:, -1]
        shares = (
            alive @ fails.mean(axis=0) + 0.5 * last[0] * last[1].mean(),
            fails @ alive.mean(axis=0) + 0.5 * last[1] * last[0].mean(),
        )
        left = [float(item.mean()) for item in last] if math.isfinite(most) else [0.0, 0.0]
        same_draws = (
            (alive * fails).sum(axis=1) + 0.5 * last[0] * last[1] if paired else np.zeros(n)
        )
    undecided = 0.5 * left[0] * left[1]
    value = float(shares[0].mean())
    if both_exact:
        return Interval(value, value - undecided, value + undecided)
    if paired:
        value = (n * value - float(same_draws.mean())) / (n - 1)
        error = float((shares[0] + shares[1]).std(ddof=1)) / math.sqrt(n)
    else:
        error = math.sqrt(float(shares[0].var(ddof=1)) / n + float(shares[1].var(ddof=1)) / m)
    low, high = (
        logit_interval(end, error, min(n, m) - 1) for end in (value - undecided, value + undecided)
    )
    return Interval(value, low.low, high.high)


def quantile_ratio(
    first: LifeDistribution,
    second: LifeDistribution,
    probability: float,
    most: float = math.inf,
    paired: bool = True,
    samples: int = SAMPLES,
    seed: int = 0,
) -> Interval:
    """Return the ratio of a quantile of two designs, such as B10, by bootstrap.

    Parameters
    ----------
    first, second : LifeDistribution
        With equally many realisations if they are paired.
    probability : float
        Share that fails before, 0.1 for B10.
    most : float
        Time at which lives are censored; a ratio with a quantile beyond it is unbounded.
    paired : bool
        Whether realisations of equal place have common draws, which are then drawn together.
    samples, seed : int
        Bootstrap samples, and seed of their generator.

    Returns
    -------
    Interval
        Percentiles of the ratio, with the log scale stretched about the median by t over z and
        sqrt(n/(n - 1)) for small samples. Unknown where `two_specimens` is for its steps.

    Notes
    -----
    Efron and Tibshirani, An Introduction to the Bootstrap (1993), chapter 13; the widening is that
    of Hesterberg, The American Statistician 69 (2015), DOI 10.1080/00031305.2015.1089789.
    """
    if min(first.count, second.count) < FEWEST and not (first.exact and second.exact):
        return UNKNOWN
    counted = isinstance(first, CountedLives) and isinstance(second, CountedLives)
    grid = np.zeros(0) if counted else _common_grid((first, second), most)
    if len(grid) * max(first.count, second.count) > _LARGEST:
        return UNKNOWN
    functions = [_weighted_quantile(item, grid, probability) for item in (first, second)]
    whole = [
        function(np.ones((1, item.count)))[0]
        for function, item in zip(functions, (first, second), strict=True)
    ]
    value = _ratio(*whole)
    if first.exact and second.exact:
        return Interval(value, value, value)
    n, random, logs = first.count, np.random.default_rng(seed), np.empty(samples)
    block = max(_MOST // max(n, second.count), 1)
    for start in range(0, samples, block):
        size = min(block, samples - start)
        weights = [random.multinomial(n, np.full(n, 1.0 / n), size=size)]
        m = second.count
        weights.append(
            weights[0] if paired else random.multinomial(m, np.full(m, 1.0 / m), size=size)
        )
        quantiles = [f(w.astype(float)) for f, w in zip(functions, weights, strict=True)]
        with np.errstate(divide="ignore", invalid="ignore"):
            logs[start : start + size] = np.log(quantiles[0]) - np.log(quantiles[1])
    if not np.isfinite(logs).all():
        return Interval(value, 0.0, math.inf) if math.isfinite(value) else UNKNOWN
    tail = 0.5 * (1.0 - CONFIDENCE)
    widening = t_quantile(n - 1) / t_quantile(math.inf) * math.sqrt(n / (n - 1))
    low, middle, high = np.quantile(logs, (tail, 0.5, 1.0 - tail))
    return Interval(value, *(math.exp(middle + widening * (end - middle)) for end in (low, high)))


def _ratio(life: float, other: float) -> float:
    return float(life / other) if math.isfinite(life) and 0.0 < other < math.inf else math.nan


def _common_grid(designs: tuple[LifeDistribution, ...], most: float) -> FloatArray:
    """Return lives that span the distributions of all designs, up to the censoring.

    Each step of a probability is between two lives that are equal but for rounding.
    """
    finite = [end for item in designs for end in _ends(item) if 0.0 < end < math.inf] or [1.0]
    last = min(max(finite), most)
    grid = np.exp(np.linspace(math.log(min(*finite, 0.5 * last)), math.log(last), _GRID))
    steps = np.concatenate([item.steps for item in designs])
    about = (steps[:, None] * (1.0 + _ROUNDING * np.array([-1.0, 1.0]))).ravel()
    return np.append(
        np.unique(np.concatenate([grid[:-1], about[(about > 0.0) & (about < last)]])), last
    )


def _ends(design: LifeDistribution) -> list[float]:
    """Return lives between which nearly all lives are that are neither 0 nor infinite."""
    middle, far = design.middle, math.exp(_FARTHEST)
    at_once, ever = design.failed(np.array([middle / far, middle * far])).mean(axis=0).tolist()
    levels = (at_once + p * (ever - at_once) for p in (1e-7, 1.0 - 1e-7))
    return [design.quantile_of_mean(level) for level in levels]


def _weighted_quantile(
    design: LifeDistribution, grid: FloatArray, probability: float
) -> Callable[[FloatArray], FloatArray]:
    """Return the function from weights, (samples, n), to the quantile of the weighted lives."""
    if isinstance(design, CountedLives):
        order = np.argsort(design.life)
        lives, rank = design.life[order], median_rank(design.count, probability) - 1.0

        def counted(weights: FloatArray) -> FloatArray:
            # the mean of the two order statistics about the level, linear between their ranks
            if math.isnan(rank):
                return np.full(len(weights), math.nan)
            below = np.cumsum(weights[:, order], axis=1)
            low = (below <= math.floor(rank)).sum(axis=1)
            high = (below <= math.floor(rank) + 1.0).sum(axis=1)
            part = rank - math.floor(rank)
            lower, upper = lives[low], lives[np.minimum(high, len(lives) - 1)]
            return np.asarray(lower + part * (upper - lower) if part > 0.0 else lower)

        return counted
    failed, logs = design.failed(grid), np.log(grid)

    def mixed(weights: FloatArray) -> FloatArray:
        mean = weights @ failed / weights.sum(axis=1, keepdims=True)
        after = np.clip((mean < probability).sum(axis=1), 1, len(grid) - 1)
        rows = np.arange(len(mean))
        below, above = mean[rows, after - 1], mean[rows, after]
        # beyond the last life, where it is above 1, the quantile is infinite
        part = np.minimum((probability - below) / np.maximum(above - below, 1e-300), 1.0)
        quantiles = np.exp(logs[after - 1] + part * (logs[after] - logs[after - 1]))
        return np.asarray(np.where(mean[:, -1] < probability, math.inf, quantiles))

    return mixed

"""Probabilities of rare events: importance sampling and subset simulation in normal scores."""

from __future__ import annotations

import math
from collections.abc import Callable, Generator
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from wearsim.types import BoolArray, FloatArray, IntArray
from wearsim.uq.estimation.intervals import Interval, t_quantile

#: Response to normal scores, (m, dimension) to (m,); the event is a response of 0 or less.
Response: TypeAlias = Callable[[FloatArray], FloatArray]

LEAST_SIZE = 30.0  # effective sample size below which an estimate is refused
LEAST = 1e-6  # probability for which the tests of subset simulation are planned
_LEVEL = 0.1  # share of each level of subset simulation
_SHORTEST = 3  # steps of a Markov chain
_AHEAD = 1.0 / 3.0  # part of the levels to `LEAST` for which tests are kept
_TOLERATED = 0.2  # levels that the last one may be longer than the others
_FAR = 6.5  # greatest distance of a shift; P = 4e-11
_NO_SLOPE = 1e-9  # of the constant, below which a slope is rounding
_STAGES = 4  # of the search for the shift, which take half of the tests
_ACCEPTANCE = 0.44  # aim of the Markov chains


@dataclass(frozen=True)
class RareProbability:
    """Estimated probability of a rare event.

    Parameters
    ----------
    probability : Interval
        With a 95 % interval on the log scale.
    tests : int
        Number of evaluated responses.
    variation : float
        Coefficient of variation of the estimate.
    effective_size : float, optional
        Effective number of weighted events, (sum w)^2/sum w^2; None without weights.
    obstacle : str
        Why the estimate permits no statement; empty if it does.
    """

    probability: Interval
    tests: int
    variation: float
    effective_size: float | None = None
    obstacle: str = ""

    @property
    def is_reliable(self) -> bool:
        """Whether the effective sample size, or the variation, permits a statement."""
        return not self.obstacle


@dataclass(frozen=True, eq=False)
class SubsetStage:
    """Tests of subset simulation that can be evaluated at once.

    Parameters
    ----------
    count : int
    parents : ndarray of int, shape (count,), optional
        Number of the earlier test, in the order of evaluation, from which each draw departs; None
        for independent draws.
    scale : float
        Standard deviation of the change: scores are sqrt(1 - scale^2) times those of the parent,
        plus scale times independent ones.
    """

    count: int
    parents: IntArray | None = None
    scale: float = 1.0


def _result(
    value: float, variation: float, tests: int, size: float | None = None, obstacle: str = ""
) -> RareProbability:
    if value <= 0.0:
        return RareProbability(Interval(0.0, 0.0, 1.0), tests, math.inf, size, obstacle)
    degrees = math.inf if size is None else max(size - 1.0, 1.0)
    reach = math.exp(min(t_quantile(degrees) * variation, 700.0))
    return RareProbability(
        Interval(value, value / reach, min(value * reach, 1.0)), tests, variation, size, obstacle
    )


def weighted_probability(
    event: BoolArray | FloatArray, log_weight: FloatArray, tests: int
) -> RareProbability:
    """Return the probability of an event from draws of another density.

    Parameters
    ----------
    event : ndarray of bool or float, shape (n,)
        Whether each draw has the event, or its probability where one input is integrated.
    log_weight : ndarray, shape (n,)
        Logarithm of the ratio of the densities.
    tests : int
        Number of tests to state, with those that chose the density.

    Returns
    -------
    RareProbability
    """
    weight = event * np.exp(log_weight)
    total, square, count = float(weight.sum()), float((weight**2).sum()), len(weight)
    if total == 0.0:
        return _result(0.0, math.inf, tests, 0.0, _few(0.0, tests))
    value = total / count
    variation = float(weight.std(ddof=1)) / math.sqrt(count) / value
    size = total**2 / square
    return _result(value, variation, tests, size, "" if size >= LEAST_SIZE else _few(size, tests))


def _few(size: float, tests: int) -> str:
    return f"effective sample size {size:.0f} of {tests:,} tests is below {LEAST_SIZE:.0f}"


def design_point(scores: FloatArray, response: FloatArray) -> FloatArray:
    """Return the scores of least norm at which a linear fit of the response is 0.

    Parameters
    ----------
    scores : ndarray, shape (n, dimension)
    response : ndarray, shape (n,)
        Finite.

    Returns
    -------
    ndarray, shape (dimension,)
        At most 6.5 from the origin; 0 without an effect.
    """
    constant, *slopes = np.linalg.lstsq(
        np.column_stack([np.ones(len(scores)), scores]), response, rcond=None
    )[0]
    slope = np.array(slopes)
    square = float(slope @ slope)
    if constant <= 0.0 or square <= (_NO_SLOPE * constant) ** 2:
        return np.zeros(scores.shape[1])
    point = -constant / square * slope
    return np.asarray(point * min(1.0, _FAR / float(np.linalg.norm(point))))


def next_shift(scores: FloatArray, response: FloatArray, log_weight: FloatArray) -> FloatArray:
    """Return the mean of the next density: the weighted mean of the events.

    Parameters
    ----------
    scores, response, log_weight : ndarray, shapes (n, dimension), (n,) and (n,)
        Draws so far, and their weights.

    Returns
    -------
    ndarray, shape (dimension,)
        The design point of a linear fit near the event while there are too few events.

    Notes
    -----
    Rubinstein and Kroese, The Cross-Entropy Method (2004), chapter 3.
    """
    event = response <= 0.0
    if event.sum() >= LEAST_SIZE:
        weight = np.exp(log_weight[event] - log_weight[event].max())
        return np.asarray(weight @ scores[event] / weight.sum())
    near = np.argsort(response, kind="stable")[: max(len(response) // 2, 2 * scores.shape[1] + 4)]
    return design_point(scores[near], response[near])


def importance_sampling(
    response: Response, dimension: int, tests: int, seed: int = 0
) -> RareProbability:
    """Return the probability of an event by draws about its most likely point.

    Parameters
    ----------
    response : callable
        See `Response`.
    dimension : int
        Number of independent normal scores.
    tests : int
        Number of evaluations. Half of them choose the density, and are not in the estimate.
    seed : int

    Returns
    -------
    RareProbability

    Notes
    -----
    Melchers, Structural Safety 6 (1989), DOI 10.1016/0167-4730(89)90003-9.

    Examples
    --------
    >>> found = importance_sampling(lambda z: 4.0 - z[:, 0], 2, 1000)
    >>> bool(found.probability.low < 3.167e-5 < found.probability.high)
    True
    """
    random, shift = np.random.default_rng(seed), np.zeros(dimension)
    sizes = [tests // (2 * _STAGES)] * _STAGES
    for size in sizes:
        scores = random.standard_normal((size, dimension)) + shift
        shift = next_shift(scores, response(scores), log_weights(scores, shift))
    scores = random.standard_normal((tests - sum(sizes), dimension)) + shift
    return weighted_probability(response(scores) <= 0.0, log_weights(scores, shift), tests)


def log_weights(scores: FloatArray, shift: FloatArray) -> FloatArray:
    """Return the log ratio of the standard normal density to the shifted one, (n, d) to (n,)."""
    return np.asarray(0.5 * float(shift @ shift) - scores @ shift)


def subset_simulation(
    response: Response, dimension: int, tests: int, seed: int = 0
) -> RareProbability:
    """Return the probability of an event as a product over nested, less rare events.

    Parameters
    ----------
    response, dimension, seed
        As for `importance_sampling`.
    tests : int
        Greatest number of evaluations.

    Returns
    -------
    RareProbability

    Examples
    --------
    >>> found = subset_simulation(lambda z: 4.0 - z[:, 0], 2, 2000)
    >>> bool(found.probability.low < 3.167e-5 < found.probability.high)
    True
    """
    random, stages = np.random.default_rng(seed), subset_stages(tests)
    stage, scores = next(stages), np.empty((0, dimension))
    while True:
        trial = random.standard_normal((stage.count, dimension))
        if stage.parents is not None:
            trial = math.sqrt(1.0 - stage.scale**2) * scores[stage.parents] + stage.scale * trial
        scores = np.concatenate([scores, trial])
        try:
            stage = stages.send(response(trial))
        except StopIteration as end:
            probability: RareProbability = end.value
            return probability


def subset_stages(
    tests: int, drawn: int = 0
) -> Generator[SubsetStage, FloatArray, RareProbability]:
    """Yield the tests of subset simulation stage by stage; return the probability.

    The responses to the tests of each stage are sent to the generator. Every level has a tenth of
    the probability of the one before it. The line through the last two thresholds, against their
    normal scores, gives the number of further levels, among which the remaining tests are divided.

    Parameters
    ----------
    tests : int
        Greatest number of tests.
    drawn : int
        Independent tests that are known already. They are used for the first level, as far as they
        are at most a quarter of the tests.

    Yields
    ------
    SubsetStage

    Returns
    -------
    RareProbability
        With the variation that Au and Beck derive from the correlation along the chains.

    Notes
    -----
    Au and Beck, Probabilistic Engineering Mechanics 16 (2001), DOI 10.1016/S0266-8920(01)00019-4;
    conditional sampling after Papaioannou, Betz, Zwirglmaier and Straub, Probabilistic Engineering
    Mechanics 41 (2015), DOI 10.1016/j.probengmech.2015.06.006.
    """
    from scipy.special import ndtr, ndtri  # noqa: PLC0415  (slow to load)

    levels = math.ceil(math.log(LEAST) / math.log(_LEVEL) - 1e-9)
    done = max(int(tests / (1.0 + (1.0 - _LEVEL) * levels)), min(drawn, tests // 4))
    values = yield SubsetStage(done)
    states, chains, probability, square, scale = np.arange(done), done, 1.0, 0.0, 0.6
    before = 0.0, float(np.median(values))
    while True:
        kept = max(round(_LEVEL * len(values)), 1)
        is_last = tests - done < _SHORTEST * kept
        threshold = 0.0 if is_last else max(float(np.sort(values)[kept - 1]), 0.0)
        event = values <= threshold
        share = float(event.mean())
        probability *= share
        if share == 0.0:
            return _result(0.0, math.inf, done, obstacle="no test of the last level has the event")
        if threshold > 0.0 and share >= 0.5:
            equal = f"{100.0 * share:.0f} % of the tests of a level have the same response"
            return _result(0.0, math.inf, done, obstacle=f"{equal}, such as a censored life")
        correlation = _correlation(event.reshape(-1, chains), share)
        square += (1.0 - share) / (share * len(values)) * (1.0 + correlation)
        if threshold == 0.0:
            variation = math.sqrt(square)
            return _result(
                probability,
                variation,
                done,
                obstacle=("" if variation < 1.0 else "its variation is above 100 %"),
            )
        score = float(ndtri(probability))
        slope = min((threshold - before[1]) / (before[0] - score), -1e-12)
        chance = max(float(ndtr(score + threshold / slope)), LEAST)
        before, levels = (score, threshold), levels - 1
        left = math.ceil(math.log(chance / probability) / math.log(_LEVEL) - _TOLERATED)
        left = max(left, math.ceil(_AHEAD * levels), 1)
        seeds, chains = np.flatnonzero(event)[:kept], kept
        state, value, steps = states[seeds], values[seeds], []
        for _ in range(max((tests - done) // (left * kept), 2)):
            scale = min(scale, 1.0)
            trial = yield SubsetStage(kept, state, scale)
            accepted = trial <= threshold
            state = np.where(accepted, np.arange(done, done + kept), state)
            value = np.where(accepted, trial, value)
            scale *= math.exp(float(accepted.mean()) - _ACCEPTANCE)
            done += kept
            steps.append((state, value))
        states, values = (np.concatenate(items) for items in zip(*steps, strict=True))


def _correlation(event: BoolArray, share: float) -> float:
    """Return the excess variance of a share of events by correlation along chains, (steps, n)."""
    length, variance = len(event), share * (1.0 - share)
    if length < 2 or variance == 0.0:
        return 0.0
    covariance = [
        max(float((event[lag:] & event[:-lag]).mean()) - share**2, 0.0) for lag in range(1, length)
    ]
    return float(2.0 * ((1.0 - np.arange(1, length) / length) * covariance).sum() / variance)

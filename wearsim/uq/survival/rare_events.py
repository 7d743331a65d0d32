"""Probabilities of rare events: importance sampling and subset simulation in normal scores."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from wearsim.types import BoolArray, FloatArray
from wearsim.uq.estimation.intervals import Interval, t_quantile

#: Response to normal scores, (m, dimension) to (m,); the event is a response of 0 or less.
Response: TypeAlias = Callable[[FloatArray], FloatArray]

LEAST_SIZE = 30.0  # effective sample size below which an estimate is refused
_LEVEL = 0.1  # share of each level of subset simulation
_FAR = 6.5  # greatest distance of a shift; P = 4e-11
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
    """

    probability: Interval
    tests: int
    variation: float
    effective_size: float | None = None

    @property
    def is_reliable(self) -> bool:
        """Whether the effective sample size, or the variation, permits a statement."""
        if self.effective_size is None:
            return self.variation < 1.0
        return self.effective_size >= LEAST_SIZE


def _result(
    value: float, variation: float, tests: int, size: float | None = None
) -> RareProbability:
    if value <= 0.0:
        return RareProbability(Interval(0.0, 0.0, 1.0), tests, math.inf, size)
    degrees = math.inf if size is None else max(size - 1.0, 1.0)
    reach = math.exp(min(t_quantile(degrees) * variation, 700.0))
    return RareProbability(
        Interval(value, value / reach, min(value * reach, 1.0)), tests, variation, size
    )


def weighted_probability(event: BoolArray, log_weight: FloatArray, tests: int) -> RareProbability:
    """Return the probability of an event from draws of another density.

    Parameters
    ----------
    event : ndarray of bool, shape (n,)
        Whether each draw has the event.
    log_weight : ndarray, shape (n,)
        Logarithm of the ratio of the densities.
    tests : int
        Number of tests to state, with those that chose the density.

    Returns
    -------
    RareProbability
    """
    weight = np.where(event, np.exp(log_weight), 0.0)
    total, square, count = float(weight.sum()), float((weight**2).sum()), len(weight)
    value = total / count
    if total == 0.0:
        return _result(0.0, math.inf, tests, 0.0)
    variation = float(weight.std(ddof=1)) / math.sqrt(count) / value
    return _result(value, variation, tests, total**2 / square)


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
    design = np.column_stack([np.ones(len(scores)), scores])
    constant, *slopes = np.linalg.lstsq(design, response, rcond=None)[0]
    slope = np.array(slopes)
    square = float(slope @ slope)
    if square == 0.0 or constant <= 0.0:
        return np.zeros(scores.shape[1])
    point = -constant / square * slope
    return np.asarray(point * min(1.0, _FAR / float(np.linalg.norm(point))))


def next_shift(scores: FloatArray, response: FloatArray, log_weight: FloatArray) -> FloatArray:
    """Return the mean of the next density: that of the events, by their weights.

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
    response: Response, dimension: int, tests: int, least: float = 1e-6, seed: int = 0
) -> RareProbability:
    """Return the probability of an event as a product over nested, less rare events.

    Parameters
    ----------
    response, dimension, seed
        As for `importance_sampling`.
    tests : int
        Greatest number of evaluations, spent on levels of equal size.
    least : float
        Least probability for which the tests are planned.

    Returns
    -------
    RareProbability
        With the variation that Au and Beck derive from the correlation along the chains. A
        probability below a tenth of `least` is returned as 0, and is unreliable.

    Notes
    -----
    Au and Beck, Probabilistic Engineering Mechanics 16 (2001), DOI 10.1016/S0266-8920(01)00019-4;
    conditional sampling after Papaioannou, Betz, Zwirglmaier and Straub, Probabilistic Engineering
    Mechanics 41 (2015), DOI 10.1016/j.probengmech.2015.06.006.
    """
    levels = math.ceil(math.log(least) / math.log(_LEVEL) - 1e-9) + 1
    per_level = round(1.0 / _LEVEL)
    kept = int(tests / (1.0 + (1.0 - _LEVEL) * (levels - 1))) // per_level
    size, random = kept * per_level, np.random.default_rng(seed)
    scores = random.standard_normal((size, dimension))
    values, tests, chains = response(scores), size, size
    probability, square, scale = 1.0, 0.0, 0.6
    for _ in range(levels):
        threshold = max(float(np.sort(values)[kept - 1]), 0.0)
        event = values <= threshold
        share = float(event.mean())
        probability *= share
        if share > 0.0:
            correlation = _correlation(event.reshape(-1, chains), share)
            square += (1.0 - share) / (share * size) * (1.0 + correlation)
        if threshold == 0.0:
            return _result(probability, math.sqrt(square), tests)
        seeds, chains = np.flatnonzero(event)[:kept], kept
        scores, values, scale = _chains(
            response, scores[seeds], values[seeds], threshold, size, scale, random
        )
        tests += size - kept
    return _result(0.0, math.inf, tests)


def _chains(
    response: Response,
    scores: FloatArray,
    values: FloatArray,
    threshold: float,
    size: int,
    scale: float,
    random: np.random.Generator,
) -> tuple[FloatArray, FloatArray, float]:
    """Return Markov chains from seeds within an event, step by step, and the adapted scale."""
    found = [(scores, values)]
    for _ in range(size // len(scores) - 1):
        scale = min(scale, 1.0)
        fresh = random.standard_normal(scores.shape)
        trial = math.sqrt(1.0 - scale**2) * scores + scale * fresh
        response_there = response(trial)
        accepted = response_there <= threshold
        scores = np.where(accepted[:, None], trial, scores)
        values = np.where(accepted, response_there, values)
        scale *= math.exp(float(accepted.mean()) - _ACCEPTANCE)
        found.append((scores, values))
    return np.concatenate([one for one, _ in found]), np.concatenate([v for _, v in found]), scale


def _correlation(event: BoolArray, share: float) -> float:
    """Return the excess variance of a share of events by correlation along chains, (steps, n)."""
    length, variance = len(event), share * (1.0 - share)
    if length < 2 or variance == 0.0:
        return 0.0
    covariance = [
        max(float((event[lag:] & event[:-lag]).mean()) - share**2, 0.0) for lag in range(1, length)
    ]
    weights = 1.0 - np.arange(1, length) / length
    return float(2.0 * (weights * covariance).sum() / variance)

"""Importance sampling with one input integrated: where the others are drawn, and their weights.

An event occurs if the normal score of the integrated input exceeds a number that depends on the
scores of the others. Of all scores at which it just occurs, those next to the origin are the most
likely: a design point.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any, TypeAlias

import numpy as np

from wearsim.types import FloatArray

#: Score that the integrated input must exceed, from the fitted response, (m,) to (m,).
Needed: TypeAlias = Callable[[FloatArray], FloatArray]

DEFENSIVE = 0.1  # share of the draws without a shift
_LEAST_SHARE = 0.1  # of a design point
_FAR = 6.5  # greatest distance of a design point; P = 4e-11
_CANDIDATES = 4096  # points among which the search for design points begins
_UNLIKELY = 6.0  # difference of squared distances from which a second design point is left out
_BETTER = 4.0  # most by which the search improves the best candidate
_OPEN = 40.0  # score in place of an infinite one
_FEW = 5.0  # effective draws below which a shift is not improved


def design_points(scores: FloatArray, response: FloatArray, needed: Needed) -> list[FloatArray]:
    """Return the scores at which an event is most likely, by a fit of the response.

    Parameters
    ----------
    scores : ndarray, shape (n, dimension)
        Normal scores of the inputs that are drawn.
    response : ndarray, shape (n,)
        Finite, such as ln kappa. It is fitted by a linear function of the scores, or by one with
        their squares if that has the lesser criterion of Schwarz.
    needed : callable
        See `Needed`.

    Returns
    -------
    list of ndarray, shape (dimension,)
        One point, or two on different sides of the origin that are similarly likely; at most 6.5
        from the origin.

    Notes
    -----
    Hasofer and Lind, Journal of the Engineering Mechanics Division 100 (1974). With the squares,
    the point is that of the quadratic fit.
    """
    from scipy.optimize import minimize  # noqa: PLC0415  (slow to load)

    (fit, slope), dimension = _fit(scores, response), scores.shape[1]

    def distance(points: FloatArray) -> FloatArray:
        fitted = fit(points)
        score = np.clip(needed(fitted), 0.0, _OPEN)
        beyond = np.where(score < _OPEN, 0.0, fitted - response.min())  # leads towards the event
        return np.asarray((points**2).sum(axis=1) + score**2 + _OPEN**2 * np.maximum(beyond, 0.0))

    def improved(point: FloatArray) -> FloatArray:
        def at(z: Any) -> float:
            return float(distance(np.asarray(z)[None])[0])

        nearest = np.asarray(minimize(at, point, method="Nelder-Mead").x)
        return np.asarray(nearest * min(1.0, _FAR / max(float(np.linalg.norm(nearest)), _FAR)))

    random = np.random.default_rng(0)
    directions = random.standard_normal((_CANDIDATES, dimension))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    if (size := float(np.linalg.norm(slope))) > 0.0:
        directions[::2] = -slope / size  # half of the candidates for the linear fit
    candidates = directions * _FAR * random.random((_CANDIDATES, 1))
    values = distance(candidates)
    first = improved(candidates[np.argmin(values)])
    other = candidates @ first < 0.0
    reach = float(distance(first[None])[0]) + _UNLIKELY + _BETTER
    if not other.any() or values[other].min() > reach:
        return [first]
    second = improved(candidates[other][np.argmin(values[other])])
    distance_of_first, distance_of_second = distance(np.stack([first, second]))
    opposite = float(first @ second) < 0.0 and float(np.linalg.norm(second)) > 0.5
    return (
        [first, second]
        if opposite and distance_of_second - distance_of_first < _UNLIKELY
        else [first]
    )


def _fit(
    scores: FloatArray, response: FloatArray
) -> tuple[Callable[[FloatArray], FloatArray], FloatArray]:
    """Return the fitted function, and the slopes of the linear fit."""
    count, dimension = scores.shape
    fits = []
    total = float(((response - response.mean()) ** 2).sum()) + np.finfo(float).tiny
    for powers in ((1,), (1, 2)):
        if powers == (1, 2) and count < 2 * (1 + 2 * dimension):
            continue
        design = _terms(scores, powers)
        terms = np.linalg.lstsq(design, response, rcond=None)[0]
        left = float(((response - design @ terms) ** 2).sum()) / total
        criterion = count * math.log(max(left, 1e-20)) + design.shape[1] * math.log(count)
        fits.append((criterion, powers, terms))
    _, powers, terms = min(fits, key=lambda item: item[0])
    return lambda z: np.asarray(_terms(z, powers) @ terms), np.asarray(fits[0][2][1:])


def _terms(scores: FloatArray, powers: Sequence[int]) -> FloatArray:
    return np.column_stack([np.ones(len(scores)), *(scores**power for power in powers)])


def influence(scores: FloatArray, response: FloatArray) -> FloatArray:
    """Return the effect of each input on a response, linear and by its square, (dimension,)."""
    deviation = response - response.mean()
    curved = deviation @ (scores**2 - 1.0) / math.sqrt(2.0)
    return np.asarray(np.hypot(deviation @ scores, curved))


def mixture_log_weights(
    scores: FloatArray, shares: Sequence[float], shifts: Sequence[FloatArray]
) -> FloatArray:
    """Return the log ratio of the standard normal density to a mixture of shifted ones.

    Parameters
    ----------
    scores : ndarray, shape (n, dimension)
    shares : sequence of float
        Parts of the draws with each shift, with the sum 1.
    shifts : sequence of ndarray, shape (dimension,)

    Notes
    -----
    Owen and Zhou, Journal of the American Statistical Association 95 (2000), DOI
    10.1080/01621459.2000.10473909: with a part without shift, no weight exceeds its reciprocal.
    """
    terms = [
        math.log(share) + scores @ shift - 0.5 * float(shift @ shift)
        for share, shift in zip(shares, shifts, strict=True)
    ]
    return np.asarray(-np.logaddexp.reduce(np.array(terms), axis=0))


def improved_shifts(
    scores: FloatArray, weight: FloatArray, points: Sequence[FloatArray]
) -> tuple[list[FloatArray], list[float]]:
    """Return the mean scores of the event near each design point, and the parts of the event.

    Parameters
    ----------
    scores : ndarray, shape (n, dimension)
        Draws so far.
    weight : ndarray, shape (n,)
        Their weights times the probability of the event.
    points : sequence of ndarray, shape (dimension,)

    Returns
    -------
    shifts : list of ndarray, shape (dimension,)
        A design point where fewer than five effective draws are near it.
    parts : list of float
        With the sum 1, none below 0.1.

    Notes
    -----
    Rubinstein and Kroese, The Cross-Entropy Method (2004), chapter 3.
    """
    distances = np.array([((scores - point) ** 2).sum(axis=1) for point in points])
    nearest, shifts, parts = distances.argmin(axis=0), [], []
    for number, point in enumerate(points):
        near = np.where(nearest == number, weight, 0.0)
        total, square = float(near.sum()), float((near**2).sum())
        enough = square > 0.0 and total**2 >= _FEW * square
        shifts.append(np.asarray(near @ scores / total) if enough else point)
        parts.append(total)
    whole = max(sum(parts), np.finfo(float).tiny)
    parts = [max(part / whole, _LEAST_SHARE) for part in parts]
    return shifts, [part / sum(parts) for part in parts]

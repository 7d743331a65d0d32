"""Multipliers of a law of maximum entropy: the least of a convex function, by Newton's method."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from wearsim.errors import SolverError
from wearsim.types import FloatArray

_GAUSS, _WEIGHTS = np.polynomial.legendre.leggauss(20)
FAR = 60.0  # of a law with one peak and a standard deviation of 1 nothing is left beyond


@dataclass(frozen=True)
class Basis:
    """Two features of which the means are known.

    Parameters
    ----------
    features : ndarray, shape (2, points)
        Each feature at the points of a quadrature.
    means : ndarray, shape (2,)
        What their means must be.
    mixing : ndarray, shape (2, 2)
        Each feature in terms of those of the first basis.
    """

    features: FloatArray
    means: FloatArray
    mixing: FloatArray


def multipliers(
    weights: FloatArray, bases: list[Basis], guesses: list[tuple[float, float]]
) -> tuple[float, float]:
    """Return the multipliers m of the density exp(-m . features) that has the known means.

    They are the least of ``log Z(m) + m . means``, which is convex (Jaynes, Physical Review 106,
    1957). All bases span the same space; steps are taken in that one which knows the smallest
    mean, for the difference of two greater ones would lose its digits.

    Parameters
    ----------
    weights : ndarray, shape (points,)
        Weights of a quadrature over the support.
    bases : list of Basis
        The multipliers belong to the first.
    guesses : list of tuple of float
        Where to begin; the best is taken.

    Returns
    -------
    tuple of float

    Raises
    ------
    SolverError
        If the means are not met to 1e-10.
    """
    found = min(
        (np.array(guess) for guess in guesses),
        key=lambda guess: _objective(guess, weights, bases[0])[0],
    )
    finest = min(bases, key=lambda basis: float(basis.means[0]))
    value, density = _objective(found, weights, bases[0])
    residual, last = np.inf, np.inf
    for _ in range(200):
        residual = _residual(density, finest)
        if residual < 1e-15 or (residual < 1e-11 and residual >= last):
            break
        last = residual
        change, decrement = _newton_step(density, finest)
        # near the end the objective is flat to rounding, and full steps converge
        flat = decrement < 1e-9 and np.abs(change @ bases[0].features).max() < 0.5
        length, tried = 1.0, _objective(found + change, weights, bases[0])
        while not flat and length > 1e-30:
            if tried[0] <= value - 0.2 * length * decrement + 1e-15 * abs(value):
                break
            length *= 0.5
            tried = _objective(found + length * change, weights, bases[0])
        found, (value, density) = found + length * change, tried
    if not residual < 1e-10:
        raise SolverError(f"no law of maximum entropy was found: its means are {residual:.1e} off")
    return float(found[0]), float(found[1])


def _objective(tried: FloatArray, weights: FloatArray, basis: Basis) -> tuple[float, FloatArray]:
    """Return the convex function, and each point's probability."""
    exponent = -(tried @ basis.features)
    top = float(exponent.max())
    mass = weights * np.exp(exponent - top)
    total = float(mass.sum())
    return top + float(np.log(total)) + float(tried @ basis.means), mass / total


def _residual(density: FloatArray, basis: Basis) -> float:
    """Return how far off the means are, in terms of what they should be (of 1 where that is 0)."""
    size = np.where(basis.means == 0.0, 1.0, np.abs(basis.means))
    return float(np.max(np.abs(basis.features @ density - basis.means) / size))


def _newton_step(density: FloatArray, basis: Basis) -> tuple[FloatArray, float]:
    """Return Newton's step, and twice the fall of the convex function that it foretells."""
    means = basis.features @ density
    centred = basis.features - means[:, None]
    covariance = (centred * density) @ centred.T
    scale = np.maximum(np.sqrt(np.diag(covariance)), 1e-150)
    together = float(covariance[0, 1] / (scale[0] * scale[1]))
    excess = (means - basis.means) / scale
    step = (excess - together * excess[::-1]) / max(1.0 - together**2, 1e-15)
    return basis.mixing.T @ (step / scale), float(step @ excess)


def even_quadrature(low: float, high: float) -> tuple[FloatArray, FloatArray]:
    """Return points and weights over [low, high], in panels about 1 wide."""
    panels = int(np.ceil(high - low))
    edges = np.linspace(low, high, panels + 1)
    half = 0.5 * np.diff(edges)[:, None]
    return (edges[:-1, None] + half * (1.0 + _GAUSS)).ravel(), (half * _WEIGHTS).ravel()


def graded_quadrature(finest: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return points over [0, 1] as their distances from both ends, and weights.

    Panels halve towards both ends, down to well below `finest`.
    """
    octaves = int(np.ceil(-np.log2(finest))) + 12
    edges = np.concatenate([[0.0], 0.5 ** np.arange(octaves, 0, -1)])
    half = 0.5 * np.diff(edges)[:, None]
    near, weights = (edges[:-1, None] + half * (1.0 + _GAUSS)).ravel(), (half * _WEIGHTS).ravel()
    return (
        np.concatenate([near, 1.0 - near[::-1]]),
        np.concatenate([1.0 - near, near[::-1]]),
        np.concatenate([weights, weights[::-1]]),
    )

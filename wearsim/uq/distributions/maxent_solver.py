"""Lagrange multipliers of maximum-entropy distributions, by Newton's method."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from wearsim.errors import SolverError
from wearsim.types import FloatArray

_GAUSS, _WEIGHTS = np.polynomial.legendre.leggauss(20)
FAR = 60.0  # standard deviations beyond which a density with one peak is below rounding


@dataclass(frozen=True)
class Basis:
    """Two functions whose means are prescribed.

    Parameters
    ----------
    features : ndarray, shape (2, points)
        Values of the two functions at the quadrature points.
    means : ndarray, shape (2,)
        Prescribed means.
    mixing : ndarray, shape (2, 2)
        The functions as combinations of those of the first basis.
    """

    features: FloatArray
    means: FloatArray
    mixing: FloatArray


def multipliers(
    weights: FloatArray, bases: list[Basis], guesses: list[tuple[float, float]]
) -> tuple[float, float]:
    """Return the multipliers m for which the density exp(-m . features) has the prescribed means.

    They minimise ``log Z(m) + m . means``, which is convex (Jaynes, Physical Review 106, 1957).
    All bases span the same space; Newton's steps use the one with the smallest mean, where there
    is no cancellation between two larger means.

    Parameters
    ----------
    weights : ndarray, shape (points,)
        Weights of a quadrature rule over the support.
    bases : list of Basis
        The multipliers are those of the first basis.
    guesses : list of tuple of float
        Starting points; the best one is used.

    Returns
    -------
    tuple of float

    Raises
    ------
    SolverError
        If the relative error of the means is above 1e-10.
    """
    result = min(
        (np.array(guess) for guess in guesses),
        key=lambda guess: _objective(guess, weights, bases[0])[0],
    )
    finest = min(bases, key=lambda basis: float(basis.means[0]))
    value, density = _objective(result, weights, bases[0])
    residual, last = np.inf, np.inf
    size = np.where(finest.means == 0.0, 1.0, np.abs(finest.means))
    for _ in range(200):
        residual = float(np.max(np.abs(finest.features @ density - finest.means) / size))
        if residual < 1e-15 or (residual < 1e-11 and residual >= last):
            break
        last = residual
        change, decrement = _newton_step(density, finest)
        # near the minimum the objective is constant to rounding, and full steps converge
        flat = decrement < 1e-9 and np.abs(change @ bases[0].features).max() < 0.5
        length, tried = 1.0, _objective(result + change, weights, bases[0])
        while not (
            flat
            or length <= 1e-30
            or tried[0] <= value - 0.2 * length * decrement + 1e-15 * abs(value)
        ):
            length *= 0.5
            tried = _objective(result + length * change, weights, bases[0])
        result, (value, density) = result + length * change, tried
    if not residual < 1e-10:
        raise SolverError(
            "the maximum-entropy iteration did not converge: the relative error of the means is"
            f" {residual:.1e}"
        )
    return float(result[0]), float(result[1])


def _objective(tried: FloatArray, weights: FloatArray, basis: Basis) -> tuple[float, FloatArray]:
    """Return the convex function, and the probability of each point."""
    exponent = -(tried @ basis.features)
    top = float(exponent.max())
    mass = weights * np.exp(exponent - top)
    total = float(mass.sum())
    return top + float(np.log(total)) + float(tried @ basis.means), mass / total


def _newton_step(density: FloatArray, basis: Basis) -> tuple[FloatArray, float]:
    """Return Newton's step, and twice the predicted decrease of the convex function."""
    means = basis.features @ density
    centred = basis.features - means[:, None]
    covariance = (centred * density) @ centred.T
    scale = np.maximum(np.sqrt(np.diag(covariance)), 1e-150)
    correlation = float(covariance[0, 1] / (scale[0] * scale[1]))
    excess = (means - basis.means) / scale
    step = (excess - correlation * excess[::-1]) / max(1.0 - correlation**2, 1e-15)
    return basis.mixing.T @ (step / scale), float(step @ excess)


def even_quadrature(low: float, high: float) -> tuple[FloatArray, FloatArray]:
    """Return quadrature points and weights over [low, high], in panels of width 1 or less."""
    edges = np.linspace(low, high, int(np.ceil(high - low)) + 1)
    half = 0.5 * np.diff(edges)[:, None]
    return (edges[:-1, None] + half * (1.0 + _GAUSS)).ravel(), (half * _WEIGHTS).ravel()


def graded_quadrature(finest: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the distances of quadrature points on [0, 1] from both ends, and their weights.

    The panels are halved towards both ends, down to far below `finest`.
    """
    edges = np.append(0.0, 0.5 ** np.arange(int(np.ceil(-np.log2(finest))) + 12, 0, -1))
    half = 0.5 * np.diff(edges)[:, None]
    near, weights = (edges[:-1, None] + half * (1.0 + _GAUSS)).ravel(), (half * _WEIGHTS).ravel()
    return (
        np.concatenate([near, 1.0 - near[::-1]]),
        np.concatenate([1.0 - near, near[::-1]]),
        np.concatenate([weights, weights[::-1]]),
    )

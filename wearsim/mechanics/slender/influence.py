"""Influence functions of strips with semi-elliptic pressure: displacement and curvature.

A strip of width dy and half-length a with the line load q displaces the surface by
``F_k(a / dy) q / (pi E*)`` at the centre of the strip k places away (Kalker, On elastic line
contact, J. Appl. Mech. 39 (1972), DOI 10.1115/1.3422842), with

    F_k = f((k + 1/2) dy/a) - f((k - 1/2) dy/a),
    f(t) = mean of asinh(t/|s|) over s in (-1, 1), weighted by (2/pi) sqrt(1 - s^2).

At the same point the strip curves the surface along rolling by ``C_k q / (pi E* a^2)``, with

    C_k = h((k + 1/2) dy/a) - h((k - 1/2) dy/a),   h(t) = (4/pi) k' K,   k' = t / sqrt(1 + t^2),

where K is the complete elliptic integral of complementary modulus k'. C_k is the second derivative
of f with respect to the position along rolling, and C_0 = 4 for an infinitely wide strip. F_k and
C_k are smooth functions of ln(a/dy) only; they are tabulated once and interpolated by cubics.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from math import comb

import numpy as np

from wearsim.mechanics.hertz.ellipse import elliptic_integrals_of
from wearsim.mechanics.numerics.jit import subroutine
from wearsim.types import FloatArray

LOWEST = -10.0  # ln(a/dy) below which F_k does not depend on a, to 1e-9
HIGHEST = 4.75  # greatest ln(a/dy) of the table: strips of width dy = a/115
STEP = 1.0 / 16.0

_FAR = 3.0  # t above which the series has converged to 1e-13
_TERMS = 10


def _series_coefficient(m: int) -> float:
    """Return c_m of f(t) = ln(4t) + 1/2 + sum c_m t^(-2m)."""
    catalan = comb(2 * m, m) // (m + 1)
    asinh = (-1) ** (m + 1) * comb(2 * m, m) / 4.0**m / (2 * m)
    return float(asinh * catalan / 4.0**m)


_gauss_points = cache(lambda: np.polynomial.legendre.leggauss(24))


def _near(t: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return f(t) and t f'(t) by Gauss quadrature; s = t sinh v makes the integrands smooth."""
    nodes, weights = _gauss_points()
    angle = 0.25 * np.pi * (nodes + 1.0)
    reach = np.arcsinh(1.0 / t)[:, None]
    v = reach * np.sin(angle)
    weight = 0.25 * np.pi * weights * np.cos(angle) * reach * (4.0 / np.pi)
    t = t[:, None]
    root = np.sqrt(np.maximum(0.0, 1.0 - (t * np.sinh(v)) ** 2)) * weight
    cosh = np.cosh(v)
    value = np.log(2.0) + 0.5 + (root * t * cosh * np.log(t * (1.0 + cosh))).sum(axis=1)
    return value, t[:, 0] * root.sum(axis=1)


def mean_asinh(t: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return f(t) and its logarithmic derivative t f'(t).

    Parameters
    ----------
    t : ndarray, shape (points,)
        Positive distances in half-lengths.

    Returns
    -------
    value, slope : ndarray, shape (points,)
        f(t) and t f'(t), to 1e-12.
    """
    value, slope = np.empty_like(t), np.empty_like(t)
    near = t < _FAR
    value[near], slope[near] = _near(t[near])
    inverse = t[~near] ** -2.0
    far_value, far_slope = np.zeros_like(inverse), np.zeros_like(inverse)
    for m in range(_TERMS, 0, -1):
        coefficient = _series_coefficient(m)
        far_value = (far_value + coefficient) * inverse
        far_slope = (far_slope - 2.0 * m * coefficient) * inverse
    value[~near] = np.log(4.0 * t[~near]) + 0.5 + far_value
    slope[~near] = 1.0 + far_slope
    return value, slope


def middle_curvature(t: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return h(t) and its logarithmic derivative t h'(t).

    Parameters
    ----------
    t : ndarray, shape (points,)
        Positive distances in half-lengths.

    Returns
    -------
    value, slope : ndarray, shape (points,)
        h(t) and t h'(t), to 1e-15.
    """
    square = 1.0 + t * t
    complement = t / np.sqrt(square)
    first, d_integral = elliptic_integrals_of(complement)
    factor = 4.0 / np.pi * complement
    return factor * first, factor * d_integral / square


@cache
def influence_table(strips: int) -> FloatArray:
    """Tabulate F_k and its derivative by ln(a/dy).

    Parameters
    ----------
    strips : int
        Number of strips; k runs from 1 - strips to strips - 1.

    Returns
    -------
    ndarray, shape (nodes, 2, 2 * strips - 1)
        F_k and STEP * dF_k/dln(a/dy) at ln(a/dy) = LOWEST, LOWEST + STEP, ..., HIGHEST.
    """
    return _tabulated(mean_asinh, strips)


@cache
def curvature_table(strips: int) -> FloatArray:
    """Tabulate C_k and its derivative by ln(a/dy).

    Parameters and returned values are those of `influence_table`, with C_k instead of F_k.
    """
    return _tabulated(middle_curvature, strips)


@cache
def no_table(strips: int) -> FloatArray:
    """Return a table without nodes, for half-lengths without interaction of the strips."""
    table = np.empty((0, 2, 2 * strips - 1))
    table.setflags(write=False)
    return table


def _tabulated(
    function: Callable[[FloatArray], tuple[FloatArray, FloatArray]], strips: int
) -> FloatArray:
    """Return a table of the differences of an odd function over the strips k places away.

    Both signs of k are stored, so that the influence on neighbouring strips is read in one loop.
    """
    tau = LOWEST + STEP * np.arange(round((HIGHEST - LOWEST) / STEP) + 1)
    t = (np.arange(strips) + 0.5) * np.exp(-tau)[:, None]
    value, slope = (part.reshape(t.shape) for part in function(t.ravel()))
    table = np.empty((len(tau), 2, 2 * strips - 1))
    right = table[..., strips - 1 :]
    right[:, 0, 0], right[:, 1, 0] = 2.0 * value[:, 0], -2.0 * STEP * slope[:, 0]
    right[:, 0, 1:] = np.diff(value, axis=1)
    right[:, 1, 1:] = -STEP * np.diff(slope, axis=1)
    table[..., : strips - 1] = right[..., :0:-1]
    table.setflags(write=False)
    return table


@subroutine
def interpolation(
    nodes: int, tau: float
) -> tuple[int, tuple[float, float, float, float], tuple[float, float, float, float]]:
    """Return the node below `tau` and the weights of the cubic, for F_k (or C_k) and its tangent.

    The weights are those of value and slope at the node, then at the next one. The tangent is
    d(q F_k)/dq = F_k + (dF_k/dtau)/2, as a is proportional to the square root of q.

    Parameters
    ----------
    nodes : int
        Number of nodes of the table; numba would count the references to the table itself.
    tau : float
        ln(a/dy) of the loaded strip, up to HIGHEST; values below LOWEST are replaced by LOWEST.
    """
    position = max((tau - LOWEST) / STEP, 0.0)
    node = min(int(position), nodes - 2)
    s = position - node
    square = (1.0 - s) * (1.0 - s)
    low, low_slope = (1.0 + 2.0 * s) * square, s * square
    high, high_slope = s * s * (3.0 - 2.0 * s), s * s * (s - 1.0)
    half = 0.5 / STEP if tau > LOWEST else 0.0
    tangent = (
        low + half * 6.0 * s * (s - 1.0),
        low_slope + half * (3.0 * s - 1.0) * (s - 1.0),
        high - half * 6.0 * s * (s - 1.0),
        high_slope + half * s * (3.0 * s - 2.0),
    )
    return node, (low, low_slope, high, high_slope), tangent


@subroutine
def read_value(table: FloatArray, tau: float, distance: int) -> float:
    """Interpolate F_k or C_k of one strip at one distance k; arguments as in `read_influence`."""
    node, (v0, v1, w0, w1), _ = interpolation(table.shape[0], tau)
    place = table.shape[2] // 2 + distance
    low = v0 * table[node, 0, place] + v1 * table[node, 1, place]
    high = w0 * table[node + 1, 0, place] + w1 * table[node + 1, 1, place]
    return float(low + high)


@subroutine
def read_influence(
    table: FloatArray, tau: float, count: int, value: FloatArray, tangent: FloatArray
) -> None:
    """Interpolate F_k or C_k of one strip, and its derivative for Newton's method.

    Parameters
    ----------
    table : ndarray, shape (nodes, 2, 2 * strips - 1)
        From `influence_table` or `curvature_table`.
    tau : float
        As in `interpolation`.
    count : int
        Number of distances k to fill.
    value, tangent : ndarray, shape (>= count,)
        Filled: F_k (or C_k) and its tangent.
    """
    node, (v0, v1, w0, w1), (d0, d1, e0, e1) = interpolation(table.shape[0], tau)
    middle = np.uint64(table.shape[2] // 2)
    for k in range(np.uint64(0), np.uint64(count)):
        # indices instead of rows: numba counts the references to every row
        a, b = table[node, 0, middle + k], table[node, 1, middle + k]
        c, d = table[node + 1, 0, middle + k], table[node + 1, 1, middle + k]
        value[k] = v0 * a + v1 * b + w0 * c + w1 * d
        tangent[k] = d0 * a + d1 * b + e0 * c + e1 * d

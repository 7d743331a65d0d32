"""Roots of several monotonic functions at once; each is independent of the others."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from wearsim.types import BoolArray, FloatArray

_MOST = 80
_MOST_SECANTS = 8
_FIRST_STEP = 1e-3  # of the scale


def bracketed_roots(
    function: Callable[[FloatArray], FloatArray],
    low: FloatArray,
    high: FloatArray,
    first: FloatArray,
    tolerance: float = 1e-13,
) -> FloatArray:
    """Return a root of each of several functions within its bracket.

    Parameters
    ----------
    function : callable
        Values at one point of each function, shape (functions,), of opposite sign at both ends.
    low, high : ndarray, shape (functions,)
        Ends of the brackets.
    first : ndarray, shape (functions,)
        First guesses; the middle is taken where a guess is outside of its bracket.
    tolerance : float
        Width of the last bracket relative to its greatest end.

    Notes
    -----
    Chandrupatla, Advances in Engineering Software 28 (1997), DOI 10.1016/S0965-9978(96)00051-8,
    with the first guess instead of the first bisection.
    """
    x0, x1 = np.array(low), np.array(high)
    f0, f1 = function(x0), function(x1)
    done = np.zeros(len(x0), dtype=bool)
    root, third, f_third = np.empty_like(x0), x0, f0
    point = np.where((first > x0) & (first < x1), first, 0.5 * (x0 + x1))
    scale = np.maximum(np.abs(x0), np.abs(x1))
    for _ in range(_MOST):
        value = function(point)
        same = np.sign(value) == np.sign(f0)
        third, f_third = np.where(same, x0, x1), np.where(same, f0, f1)
        x1, f1 = np.where(same, x1, x0), np.where(same, f1, f0)
        x0, f0 = point, value
        best = np.where(np.abs(f0) < np.abs(f1), x0, x1)
        limit = 2.0 * tolerance * np.abs(best) + tolerance**1.25 * scale
        width = np.abs(x1 - x0)
        # a root must not depend on the number of iterations of the others
        new = ~done & ((width <= limit) | (f0 == 0.0) | (f1 == 0.0))
        root[new], done = best[new], done | new
        if done.all():
            break
        with np.errstate(divide="ignore", invalid="ignore"):
            xi, phi = (x0 - x1) / (third - x1), (f0 - f1) / (f_third - f1)
            quadratic = (phi**2 < xi) & ((1.0 - phi) ** 2 < 1.0 - xi)
            part = f0 / (f1 - f0) * f_third / (f1 - f_third)
            part = part + (third - x0) / (x1 - x0) * f0 / (f_third - f0) * f1 / (f_third - f1)
            edge = np.where(width > 0.0, 0.5 * limit / np.where(width > 0.0, width, 1.0), 0.5)
        edge = np.minimum(edge, 0.5)
        part = np.clip(np.where(quadratic & np.isfinite(part), part, 0.5), edge, 1.0 - edge)
        point = x0 + part * (x1 - x0)
    return np.where(done, root, np.where(np.abs(f0) < np.abs(f1), x0, x1))


def secant_roots(
    function: Callable[[FloatArray], FloatArray],
    first: FloatArray,
    scale: FloatArray,
    tolerance: float = 1e-9,
) -> tuple[FloatArray, BoolArray]:
    """Return a root of each of several functions near a guess, by the secant method.

    Parameters
    ----------
    function : callable
        Values at one point of each increasing function, shape (functions,).
    first, scale : ndarray, shape (functions,)
        Guesses, and a size of the arguments within which the functions vary.
    tolerance : float
        Last step relative to the scale; the error is far smaller, as convergence is superlinear.

    Returns
    -------
    roots : ndarray, shape (functions,)
    converged : ndarray of bool, shape (functions,)
    """
    x0, f0 = np.array(first), function(first)
    x1 = x0 - _FIRST_STEP * np.copysign(scale, f0)
    done, failed = f0 == 0.0, np.zeros(len(x0), dtype=bool)
    x1[done] = x0[done]
    for _ in range(_MOST_SECANTS):
        if done.all():
            break
        f1 = function(x1)
        with np.errstate(divide="ignore", invalid="ignore"):
            step = np.where(f1 == 0.0, 0.0, -f1 * (x1 - x0) / (f1 - f0))
        # a long step leads to where a function is flat
        failed |= ~done & ~(np.abs(step) < 10.0 * scale)
        done |= failed
        x0, f0 = np.where(done, x0, x1), f1
        x1[~done] += step[~done]
        done |= np.abs(step) <= tolerance * scale
    return x1, done & ~failed

"""Normal contact of half-spaces: bound-constrained conjugate gradients."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from wearsim.plugins import ContactError
from wearsim.types import FloatArray
from wearsim_halfspace.influence import Elements

MAX_ITERATIONS = 400


class NormalSolution(NamedTuple):
    """Pressure on the elements [Pa], approach [m] and number of iterations."""

    pressure: FloatArray
    approach: float
    iterations: int


def solve_normal(
    elements: Elements,
    gap: FloatArray,
    force: float,
    start: FloatArray,
    tolerance: float,
    wear_compliance: FloatArray | None = None,
) -> NormalSolution:
    """Return the pressure that presses two half-spaces together by a force.

    Conjugate gradients on the elements in contact, with an approximate inverse of the convolution
    as preconditioner. Directions carry no force, so that the force is kept. Elements leave
    the contact where the pressure falls to zero, and enter it where the surfaces overlap.

    Parameters
    ----------
    elements : Elements
    gap : ndarray, shape (rows, columns)
        Gap before deformation [m].
    force : float
        Normal force [N].
    start : ndarray, shape (rows, columns)
        Initial guess, positive on some elements [Pa].
    tolerance : float
        Change of the pressure in an iteration, relative to the greatest one.
    wear_compliance : ndarray, shape (rows,), optional
        Gap opened by wear per line load of a row [m/(N/m)].

    Raises
    ------
    ContactError
        If the iteration does not converge.

    References
    ----------
    .. [1] I.A. Polonsky, L.M. Keer, Wear 231 (1999), DOI 10.1016/S0043-1648(99)00113-1.
    .. [2] E.A.H. Vollebregt, J. Comput. Phys. 257 (2014), DOI 10.1016/j.jcp.2013.10.005.
    """
    convolve, area = elements.normal, elements.dx * elements.dy
    # of the periodic convolution; its smallest eigenvalues are those of the shortest waves
    spectrum = np.maximum(np.abs(convolve.transforms[0]), 1e-3 * np.abs(convolve.middle[0]).max())

    def opened(pressure: FloatArray) -> FloatArray:
        found = convolve(pressure)
        if wear_compliance is not None:
            found = found + (wear_compliance * pressure.sum(axis=1) * elements.dx)[:, None]
        return found

    def smoothed(field: FloatArray) -> FloatArray:
        return convolve.divided(field, spectrum)

    pressure = start * (force / (start.sum() * area))
    inside, direction, last, product = pressure > 0.0, np.zeros_like(pressure), None, 0.0
    for iteration in range(1, MAX_ITERATIONS + 1):
        excess = -(opened(pressure) + gap)
        residual = np.where(inside, excess, 0.0)
        each, unit = smoothed(residual) * inside, smoothed(inside * 1.0) * inside
        approach = -float(each.sum()) / float(unit.sum())
        overlap = ~inside & (excess + approach > 0.0)
        if overlap.any():
            inside |= overlap
            residual = np.where(inside, excess, 0.0)
            each, unit = smoothed(residual) * inside, smoothed(inside * 1.0) * inside
            approach, last = -float(each.sum()) / float(unit.sum()), None
        each += approach * unit
        residual = np.where(inside, residual + approach, 0.0)
        new = float((each * residual).sum())
        factor = 0.0
        if last is not None:
            factor = max(float((each * (residual - last)).sum()) / product, 0.0)
        direction = np.where(inside, each + factor * direction, 0.0)
        along = opened(direction)
        step = float((residual * direction).sum()) / float((direction * along).sum())
        moved = pressure + step * direction
        inside &= moved > 0.0
        moved = np.where(inside, moved, 0.0)
        moved *= force / (moved.sum() * area)
        last, product = residual, new
        change = float(np.abs(moved - pressure).max())
        pressure = moved
        if change <= tolerance * float(pressure.max()) and not overlap.any():
            return NormalSolution(pressure, approach, iteration)
    raise ContactError(
        f"the normal contact of half-spaces has not converged in {MAX_ITERATIONS} iterations"
        f" (last relative change {change / float(pressure.max()):.1e})"
    )

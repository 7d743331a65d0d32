"""Normal contact of half-spaces: bound-constrained conjugate gradients."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from wearsim.plugins import ContactError
from wearsim.types import FloatArray
from wearsim_halfspace.influence import Convolution, Elements, inner

MAX_ITERATIONS = 5000  # many are needed only where wear is far more compliant than the bodies
LEAST = 1e-3  # least eigenvalue, relative to the influence of an element on itself


class NormalSolution(NamedTuple):
    """Pressure on the elements [Pa], approach [m], separation [m] and number of iterations."""

    pressure: FloatArray
    approach: float
    separation: FloatArray
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
    smoothed = _ApproximateInverse(convolve)

    def opened(pressure: FloatArray) -> FloatArray:
        opening = convolve(pressure)
        if wear_compliance is not None:
            opening += (wear_compliance * pressure.sum(axis=1) * elements.dx)[:, None]
        return opening

    pressure = start * (force / (start.sum() * area))
    inside = pressure > 0.0
    # overlap at an approach of zero, and the preconditioned unit pressure of the contact
    closed, unit = -gap - opened(pressure), None
    direction, last, product = pressure, None, 1.0
    for iteration in range(1, MAX_ITERATIONS + 1):
        if unit is None:  # after a change of the contact
            unit = smoothed(inside) * inside
            total = float(unit.sum())
        preconditioned = smoothed(closed * inside) * inside
        approach = -float(preconditioned.sum()) / total
        residual = closed + approach
        overlap = (residual > 0.0) & ~inside
        if overlap.any():
            inside |= overlap
            unit = smoothed(inside) * inside
            total = float(unit.sum())
            preconditioned = smoothed(closed * inside) * inside
            approach, last = -float(preconditioned.sum()) / total, None
            residual = closed + approach
        residual *= inside
        preconditioned += approach * unit
        new = inner(preconditioned, residual)
        if last is None:
            direction = preconditioned
        else:
            factor = max((new - inner(preconditioned, last)) / product, 0.0)
            direction *= inside
            # directions carry no force
            direction = preconditioned + factor * (
                direction - (float(direction.sum()) / total) * unit
            )
        along = opened(direction)
        curvature = inner(direction, along)
        # no direction is left if a single element is in contact
        step = inner(residual, direction) / curvature if curvature > 0.0 else 0.0
        last, product = residual, new
        moved = pressure + step * direction
        leaves = moved < 0.0
        if leaves.any():
            moved[leaves] = 0.0
            moved *= force / (moved.sum() * area)
            inside, unit = moved > 0.0, None
            closed = -gap - opened(moved)
        else:
            closed -= step * along
        change = float(np.abs(moved - pressure).max())
        pressure = moved
        if change <= tolerance * float(pressure.max()) and not overlap.any():
            separation = float(closed[inside].mean()) - closed
            return NormalSolution(pressure, approach, separation, iteration)
    raise ContactError(
        f"the normal contact of half-spaces has not converged in {MAX_ITERATIONS} iterations"
        f" (last relative change {change / float(pressure.max()):.1e})"
    )


class _ApproximateInverse:
    """Inverse of the convolution on a grid without padding, as if the grid were periodic."""

    def __init__(self, convolve: Convolution) -> None:
        from scipy import fft  # noqa: PLC0415  (slow to load)

        self._fft = fft
        high = fft.next_fast_len(convolve.rows)
        wide = fft.next_fast_len(convolve.columns, real=True)
        rows, columns = (np.minimum(np.arange(n), n - np.arange(n)) for n in (high, wide))
        kernel = convolve.quarter[rows[:, None], columns]
        spectrum = fft.rfft2(kernel).real
        # the smallest eigenvalues are those of the shortest waves
        self._inverse = 1.0 / np.maximum(spectrum, LEAST * kernel[0, 0])
        self._shape = high, wide

    def __call__(self, field: FloatArray) -> FloatArray:
        transform = self._inverse * self._fft.rfft2(field, s=self._shape)
        preconditioned = self._fft.irfft2(transform, s=self._shape)
        return np.asarray(preconditioned[: field.shape[0], : field.shape[1]])

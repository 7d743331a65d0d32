"""Traction fields of FASTSIM inside a contact, and the dissipation as a sum over elements."""

from __future__ import annotations

import numpy as np

from wearsim.mechanics.numerics.jit import kernel
from wearsim.mechanics.tangential.fastsim import bound_shape, limit_traction, place_of
from wearsim.types import FloatArray


@kernel
def march_fields(
    half_length: FloatArray,
    bound_peak: FloatArray,
    elliptic: bool,
    gradient_x: FloatArray,
    gradient_y: float,
    gradient_spin: float,
    points: int,
) -> FloatArray:
    """Return the traction fields of `march`.

    Parameters
    ----------
    half_length, bound_peak, elliptic, gradient_x, gradient_y, gradient_spin, points
        As in `march`.

    Returns
    -------
    ndarray, shape (4, points + 1, strips)
        As of `march_local_fields`.
    """
    friction = np.ones((points, len(half_length)))
    return march_local_fields(
        half_length, bound_peak, friction, elliptic, gradient_x, gradient_y, gradient_spin
    )


@kernel
def march_local_fields(
    half_length: FloatArray,
    bound_peak: FloatArray,
    friction: FloatArray,
    elliptic: bool,
    gradient_x: FloatArray,
    gradient_y: float,
    gradient_spin: float,
) -> FloatArray:
    """Return the traction fields of `march_local`.

    Parameters
    ----------
    half_length, bound_peak, friction, elliptic, gradient_x, gradient_y, gradient_spin
        As in `march_local`.

    Returns
    -------
    ndarray, shape (4, points + 1, strips)
        Longitudinal and lateral traction, and the excess of each trial traction over the traction
        bound [Pa]; from the leading edge x = a to the trailing edge x = -a. Slip over the rolling
        velocity is ``-excess * L / dx`` in each direction, with its flexibility L.
    """
    points, strips = friction.shape
    out = np.zeros((4, points + 1, strips))
    cell = 2.0 / points
    for k in range(1, points + 1):
        place = place_of(k, points)
        middle = place + 0.5 * cell
        shape = bound_shape(place, elliptic)
        for j in range(strips):
            a = half_length[j]
            dx = cell * a
            tx = out[0, k - 1, j] - gradient_x[j] * dx
            ty = out[1, k - 1, j] - (gradient_y + gradient_spin * middle * a) * dx
            _, scale = limit_traction(tx, ty, shape * (friction[k - 1, j] * bound_peak[j]))
            out[0, k, j] = scale * tx
            out[1, k, j] = scale * ty
            out[2, k, j] = (1.0 - scale) * tx
            out[3, k, j] = (1.0 - scale) * ty
    return out


def element_sum(
    fields: FloatArray, longitudinal: float, lateral: float, rolling_speed: float
) -> FloatArray:
    """Return the dissipation as a sum over elements of their new traction times their slip.

    The error is of first order in dx and negative; used for comparison with the work of the rigid
    slip.

    Parameters
    ----------
    fields : ndarray, shape (4, points + 1, strips)
        From `march_fields`.
    longitudinal, lateral : float
        Flexibilities L1 and L2 [m/Pa].
    rolling_speed : float
        V [m/s].

    Returns
    -------
    ndarray, shape (strips,)
        P_l [W/m].
    """
    traction_x, traction_y, excess_x, excess_y = fields
    work = longitudinal * traction_x * excess_x + lateral * traction_y * excess_y
    return np.asarray(rolling_speed * work.sum(axis=0))

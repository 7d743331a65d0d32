"""The inside of a contact as FaStrip sees it."""

from __future__ import annotations

import math

import numpy as np

from wearsim.mechanics.fastrip import turned
from wearsim.mechanics.jit import kernel
from wearsim.mechanics.strip_with_spin import (
    Moduli,
    Motion,
    Strip,
    beyond_strip_theory,
    slip_at,
    strip_of,
)
from wearsim.types import FloatArray


@kernel
def fastrip_fields(
    half_length: FloatArray,
    bound_peak: FloatArray,
    motion: Motion,
    moduli: Moduli,
    points: int,
) -> FloatArray:
    """Return the inside of every strip that strip theory holds for; zeros in others.

    Parameters
    ----------
    half_length, bound_peak, motion, moduli
        As in `fastrip`.
    points : int
        Points along a strip, evenly spaced from x = a to x = -a; the march steps over them.

    Returns
    -------
    ndarray, shape (4, points, strips)
        Longitudinal and lateral traction [Pa] and slip over the rolling velocity, which opposes the
        traction and is zero where the strip adheres; from the leading edge on.
    """
    out = np.zeros((4, points, len(half_length)))
    for j in range(len(half_length)):
        if not (half_length[j] > 0.0 and bound_peak[j] > 0.0):
            continue
        if beyond_strip_theory(j, half_length, bound_peak, motion, moduli):
            continue
        strip = strip_of(j, half_length, bound_peak, motion, moduli)
        _put_fields(j, strip, out)
    return out


@kernel
def _put_fields(j: int, strip: Strip, out: FloatArray) -> None:
    """Put traction and slip of strip `j`, point by point from the leading edge."""
    a, d, rise = strip.half_length, strip.shift, strip.rise
    points = out.shape[1]
    before = math.acos((2.0 * d - a) / a)
    e_x, e_y = strip.direction_x, strip.direction_y
    for k in range(points):
        cosine = 1.0 - 2.0 * k / (points - 1)
        sine = math.sqrt((1.0 - cosine) * (1.0 + cosine))
        x, bound = a * cosine, rise * a * sine
        if d < a and x >= 2.0 * d - a:
            back = rise * math.sqrt(max((a - x) * (x - 2.0 * d + a), 0.0))
            out[0, k, j] = e_x * (bound - back)
            out[1, k, j] = e_y * bound - (e_y + strip.twist) * back
            continue
        arc = math.acos(cosine)
        middle = 0.5 * (before + arc)
        if arc > before:
            slip_x, slip_y = slip_at(strip, a * math.cos(middle), e_x, e_y)
            way = (arc - before) / math.sin(middle)
            e_x, e_y = turned(strip, slip_x, slip_y, way, e_x, e_y)
        before = arc
        slip_x, slip_y = slip_at(strip, x, e_x, e_y)
        against = max(-(slip_x * e_x + slip_y * e_y), 0.0)
        out[0, k, j], out[1, k, j] = e_x * bound, e_y * bound
        out[2, k, j], out[3, k, j] = -against * e_x, -against * e_y

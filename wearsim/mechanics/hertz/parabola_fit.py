"""Least-squares parabola of a measured gap, and the Hertz contact on it."""

from __future__ import annotations

import math
from typing import TypeAlias

from wearsim.mechanics.hertz.ellipse import hertz_ellipse
from wearsim.mechanics.numerics.jit import kernel, subroutine
from wearsim.types import FloatArray

Moments: TypeAlias = tuple[float, float, float, float, float, float, float, float]

CONVERGED, NOT_CONVERGED, NO_CURVATURE, TOO_FEW_STRIPS, LEAVES_STRIPS = range(5)

ROUND_OFF = 4e-15  # of the greatest height of the gap: tolerance of `is_parabola`

HOLLOW = 1.0  # upper bound of ln(b'/b), and its value in the concave part of a groove


NO_MOMENTS = (0.0,) * 8


@subroutine
def add_moments(moments: Moments, weight: float, t: float, height: float) -> Moments:
    """Add a weighted point to the moments of a least-squares parabola.

    Parameters
    ----------
    moments : tuple of float
        Sums of the weight times 1, t, ..., t^4, and of weight and height times 1, t, t^2.
    weight, t, height : float
        Weight, position and height of the point.
    """
    m0, m1, m2, m3, m4, s0, s1, s2 = moments
    first, second = weight * t, weight * t * t
    return (
        m0 + weight,
        m1 + first,
        m2 + second,
        m3 + second * t,
        m4 + second * t * t,
        s0 + weight * height,
        s1 + first * height,
        s2 + second * height,
    )


@subroutine
def fit_parabola(
    y: FloatArray, gap: FloatArray, centre: float, half_width: float
) -> tuple[float, float, float, int]:
    """Fit ``gap = w0 + B (y - yc)^2`` by least squares weighted with ``1 - ((y - centre)/b)^2``.

    Parameters
    ----------
    y, gap : ndarray, shape (strips,)
        Position and gap [m].
    centre, half_width : float
        Centre and half-width b [m] of the fitted section.

    Returns
    -------
    curvature, vertex, height : float
        B [1/m], yc [m] and w0 [m]; the last two are nan where B is not positive.
    used : int
        Number of strips with positive weight; a parabola requires at least three.
    """
    moments, used, nearest = NO_MOMENTS, 0, 0
    for i in range(1, len(y)):
        if abs(y[i] - centre) < abs(y[nearest] - centre):
            nearest = i
    shift = gap[nearest]  # heights relative to it are more accurate
    for i in range(len(y)):
        t = (y[i] - centre) / half_width
        weight = 1.0 - t * t
        if weight <= 1e-12:
            continue
        used += 1
        moments = add_moments(moments, weight, t, gap[i] - shift)
    if used < 3:
        return math.nan, math.nan, math.nan, used
    m0, m1, m2, m3, m4, s0, s1, s2 = moments
    det = m0 * (m2 * m4 - m3 * m3) - m1 * (m1 * m4 - m2 * m3) + m2 * (m1 * m3 - m2 * m2)
    constant = s0 * (m2 * m4 - m3 * m3) - m1 * (s1 * m4 - s2 * m3) + m2 * (s1 * m3 - s2 * m2)
    slope = m0 * (s1 * m4 - s2 * m3) - s0 * (m1 * m4 - m2 * m3) + m2 * (m1 * s2 - m2 * s1)
    square = m0 * (m2 * s2 - m3 * s1) - m1 * (m1 * s2 - m2 * s1) + s0 * (m1 * m3 - m2 * m2)
    constant, slope, square = constant / det, slope / det, square / det
    if not square > 0.0:
        return square / half_width**2, math.nan, math.nan, used
    vertex = -0.5 * slope / square
    height = shift + constant + 0.5 * slope * vertex
    return square / half_width**2, centre + vertex * half_width, height, used


@subroutine
def fit_centred(
    y: FloatArray, gap: FloatArray, centre: float, half_width: float, tolerance: float
) -> tuple[float, float, float, int]:
    """Fit a parabola over a section that is centred on the vertex of the fit.

    Parameters and returned values are those of `fit_parabola`, with a status instead of the count.
    """
    last, last_shift = centre, 0.0
    for _ in range(100):
        curvature, vertex, height, used = fit_parabola(y, gap, centre, half_width)
        if used < 3:
            return curvature, centre, height, TOO_FEW_STRIPS
        if not curvature > 0.0:
            return curvature, centre, height, NO_CURVATURE
        shift = (vertex - centre) / half_width
        if abs(shift) <= tolerance:
            return curvature, vertex, height, CONVERGED
        # secant method: in a concave groove the vertex moves faster than the section, so that a
        # fixed-point iteration diverges
        moved = (centre - last) / half_width
        step = shift if moved == 0.0 else -shift * moved / (shift - last_shift)
        last, last_shift = centre, shift
        centre += min(max(step, -0.5), 0.5) * half_width
    return curvature, centre, height, NOT_CONVERGED


@subroutine
def is_parabola(
    y: FloatArray, gap: FloatArray, curvature: float, centre: float, height: float
) -> bool:
    """Return whether the gap is ``height + curvature (y - centre)^2`` to round-off.

    In that case the fit over any section is the same parabola, and one fit serves every patch.

    Parameters
    ----------
    y, gap : ndarray, shape (strips,)
        Position and gap [m].
    curvature, centre, height : float
        B [1/m], yc [m] and w0 [m].
    """
    worst, most = 0.0, 0.0
    for i in range(len(y)):
        rise = curvature * (y[i] - centre) ** 2
        worst = max(worst, abs(gap[i] - height - rise))
        most = max(most, rise)
    return worst <= ROUND_OFF * most


@subroutine
def strips_within(y: FloatArray, centre: float, half_width: float) -> int:
    """Return the number of strips within `half_width` of `centre`.

    Parameters
    ----------
    y : ndarray, shape (strips,)
        Position [m].
    centre, half_width : float
        Centre and half-width of the section [m].
    """
    count = 0
    for i in range(len(y)):
        count += 1 if abs(y[i] - centre) < half_width else 0
    return count


@kernel
def hertz_on_profile(
    y: FloatArray,
    gap: FloatArray,
    curvature_x: float,
    normal_force: float,
    contact_modulus: float,
    tolerance: float,
    limit: int,
) -> tuple[float, float, float, float, int, int]:
    """Find the Hertz patch that is consistent with the parabola fitted over it.

    The parabola fitted over a patch of half-width b, centred on its own vertex, has a Hertz patch
    of half-width b'. b = b' is solved by reducing b from the widest patch inside the strips, to no
    less than 0.6 b at a time, and then by the regula falsi (Illinois rule) on ln(b'/b). A gap that
    is a parabola needs one fit only.

    Parameters
    ----------
    y, gap : ndarray, shape (strips,)
        Position and gap [m].
    curvature_x : float
        A [1/m].
    normal_force, contact_modulus : float
        N [N] and E* [Pa].
    tolerance : float
        Greatest ln(b'/b), and a tenth of the greatest shift of the centre over b, at which the
        patch is consistent; the effect of a shift is of second order.
    limit : int
        Greatest number of iterations.

    Returns
    -------
    curvature, half_width, centre, height : float
        B [1/m], b [m], yc [m] and the fitted gap at yc [m].
    iterations, status : int
        The status is one of `CONVERGED`, `NOT_CONVERGED`, `NO_CURVATURE`, `TOO_FEW_STRIPS` and
        `LEAVES_STRIPS`.

    Notes
    -----
    Dowell and Jarratt (1971), DOI 10.1007/BF01934364, for the Illinois rule.
    """
    centre = 0.5 * (y[0] + y[-1])
    width = 0.5 * (y[-1] - y[0]) * len(y) / max(len(y) - 1, 1)
    # ln b and ln(b'/b) at both ends of the bracket; the value is 0 while an end is unknown
    low = low_value = high = high_value = 0.0
    side, curvature, height = 0, math.nan, math.nan  # the end that moved last, B and w0
    for iteration in range(1, limit + 1):
        curvature, vertex, height, status = fit_centred(y, gap, centre, width, 10.0 * tolerance)
        here = math.log(width)
        if status == CONVERGED:
            centre = vertex
            half_width = hertz_ellipse(curvature_x, curvature, normal_force, contact_modulus)[1]
            sufficient = half_width <= width and strips_within(y, centre, half_width) >= 3
            if iteration == 1 and sufficient and is_parabola(y, gap, curvature, centre, height):
                return curvature, half_width, centre, height, iteration, CONVERGED
            value = min(math.log(half_width / width), HOLLOW)
        elif status != TOO_FEW_STRIPS and high_value != 0.0:
            # the section lies in the concave part of a groove, where no patch ends: too narrow
            half_width, value = math.inf, HOLLOW
        else:
            return curvature, width, vertex, height, iteration, status
        if abs(value) <= tolerance:
            return curvature, half_width, centre, height, iteration, CONVERGED
        if value > 0.0:
            if high_value == 0.0:
                return curvature, half_width, centre, height, iteration, LEAVES_STRIPS
            high_value *= 0.5 if side > 0 else 1.0
            low, low_value, side = here, value, 1
        else:
            low_value *= 0.5 if side < 0 else 1.0
            high, high_value, side = here, value, -1
        if low_value != 0.0 and high - low <= tolerance:
            # b' is either a steep function of b here, or it jumps and no patch is consistent
            agrees = status == CONVERGED and abs(value) < 1e4 * tolerance
            status = CONVERGED if agrees else NO_CURVATURE
            return curvature, half_width, centre, height, iteration, status
        if low_value == 0.0:
            width = max(half_width, 0.6 * width)
        else:
            width = math.exp(high - high_value * (high - low) / (high_value - low_value))
    return curvature, width, centre, height, limit, NOT_CONVERGED

"""FaStrip: strip theory in the adhesion zone, integration of the traction's direction in slip.

Sichani, Enblom and Berg (2016), DOI 10.1080/00423114.2016.1156135, take the direction from FASTSIM;
here it is integrated with the elasticity of the strip. In the slip zone the traction is equal to
the bound, and only its direction e may change. With x = a cos(q), a change of traction strains the
surface of a plane by (2a sin(q)/G) d/dx. This strain cancels the component of strip theory's slip S
in the direction n normal to the traction:

    n . de/dq = -(n . S) / (2 B a sin(q) (nx^2/Gx + ny^2/Gy)).

Strips without an adhesion zone because of spin are solved by FASTSIM with one flexibility.
"""

from __future__ import annotations

import math

import numpy as np

from wearsim.mechanics.numerics.jit import kernel, subroutine
from wearsim.mechanics.tangential.fastsim import (
    ADHESION,
    FORCE_X,
    FORCE_Y,
    MOMENT,
    ROWS,
    WORK,
    march_into,
)
from wearsim.mechanics.tangential.strip_with_spin import (
    Moduli,
    Strip,
    StripMotion,
    beyond_strip_theory,
    slip_at,
    strip_of,
)
from wearsim.types import FloatArray

_STEP_RATIO = 5  # steps of FASTSIM per step here, as the direction is a smoother function


@kernel
def fastrip(
    half_length: FloatArray,
    bound_peak: FloatArray,
    motion: StripMotion,
    moduli: Moduli,
    flexibility: float,
    points: int,
) -> FloatArray:
    """Return the forces of every strip.

    Parameters
    ----------
    half_length : ndarray, shape (strips,)
        a(y) [m]; strips with a = 0 get zeros.
    bound_peak : ndarray, shape (strips,)
        Friction times the greatest pressure of the strip [Pa].
    motion : StripMotion
        The rigid slip.
    moduli : Moduli
        The amended moduli.
    flexibility : float
        L [m/Pa] of FASTSIM, for strips without an adhesion zone because of spin.
    points : int
        Steps along a strip that is solved by FASTSIM; a fifth of them along a slip zone.

    Returns
    -------
    ndarray, shape (4, strips)
        As of `fastsim.march`; the adhesion length is exact except in strips solved by FASTSIM.
    """
    sums, marched = np.zeros((ROWS, len(half_length))), np.empty((ROWS, 1))
    gradient = np.empty(len(half_length))
    elliptic = points > 0  # always true; a literal would be compiled as another signature
    for j in range(len(half_length)):
        gradient[j] = motion.longitudinal[j] / flexibility
        if not (half_length[j] > 0.0 and bound_peak[j] > 0.0):
            continue
        if beyond_strip_theory(j, half_length, bound_peak, motion, moduli):
            march_into(
                1,
                half_length[j : j + 1],
                bound_peak[j : j + 1],
                None,
                0,
                elliptic,
                gradient[j : j + 1],
                motion.lateral / flexibility,
                motion.spin / flexibility,
                0.0,
                0.0,
                points,
                marched,
                None,
            )
            sums[:, j] = marched[:, 0]
        else:
            strip = strip_of(j, half_length, bound_peak, motion, moduli)
            one_way = motion.lateral == 0.0 or motion.longitudinal[j] == 0.0
            # a slip of constant direction does not turn, so that one step is exact
            steps = 1 if motion.spin == 0.0 and one_way else 1 + points // _STEP_RATIO
            _integrate_adhesion(j, strip, sums)
            _march_slip(j, strip, steps, sums)
    return sums[:WORK].copy()


@subroutine
def _integrate_adhesion(j: int, strip: Strip, sums: FloatArray) -> None:
    """Integrate the traction over the adhesion zone of strip `j`."""
    a, radius = strip.half_length, strip.half_length - strip.shift
    if not radius > 0.0:
        return
    d = strip.shift
    cosine = (2.0 * d - a) / a  # x/a where slip begins
    sine = 2.0 * math.sqrt(d * radius) / a
    slides = 2.0 * math.asin(math.sqrt(d / a))
    # bound minus its reduction in adhesion, in terms that are small for a short slip zone
    area = 0.5 * math.pi * d * (2.0 * a - d) - 0.5 * a * a * (slides + sine * cosine)
    lever = (a * sine) ** 3 / 3.0
    back = 0.5 * math.pi * radius * radius
    across, rest = strip.direction_y, strip.direction_y + strip.twist
    sums[FORCE_X, j] += strip.rise * strip.direction_x * area
    sums[FORCE_Y, j] += strip.rise * (across * area - strip.twist * back)
    sums[MOMENT, j] += strip.rise * (across * lever - rest * back * d)
    sums[ADHESION, j] += 2.0 * radius


@subroutine
def _march_slip(j: int, strip: Strip, steps: int, sums: FloatArray) -> None:
    """Integrate the traction's direction through the slip zone of strip `j`."""
    if not strip.shift > 0.0:
        return
    a = strip.half_length
    arc = 2.0 * math.asin(math.sqrt(min(strip.shift / a, 1.0))) / steps
    step_cos, step_sin = math.cos(arc), math.sin(arc)
    half_cos, half_sin = math.cos(0.5 * arc), math.sin(0.5 * arc)
    cosine = (2.0 * strip.shift - a) / a
    sine = 2.0 * math.sqrt(strip.shift * (a - strip.shift)) / a
    e_x, e_y = strip.direction_x, strip.direction_y
    for k in range(steps):
        x = a * (cosine * half_cos - sine * half_sin)
        way = arc / (sine * half_cos + cosine * half_sin)
        next_cos = cosine * step_cos - sine * step_sin
        next_sin = sine * step_cos + cosine * step_sin if k < steps - 1 else 0.0
        slip_x, slip_y = slip_at(strip, x, e_x, e_y)
        n_x, n_y = turn_direction(strip, slip_x, slip_y, way, e_x, e_y)
        bound = 0.5 * a * a * (arc - next_sin * next_cos + sine * cosine)
        lever = a**3 * (next_sin**3 - sine**3) / 3.0
        along, across = 0.5 * strip.rise * (e_x + n_x), 0.5 * strip.rise * (e_y + n_y)
        sums[FORCE_X, j] += along * bound
        sums[FORCE_Y, j] += across * bound
        sums[MOMENT, j] += across * lever
        cosine, sine, e_x, e_y = next_cos, next_sin, n_x, n_y


@subroutine
def turn_direction(
    strip: Strip, slip_x: float, slip_y: float, way: float, e_x: float, e_y: float
) -> tuple[float, float]:
    """Return the traction's direction e after a step.

    With a constant slip, the tangent of half the angle between the two decays exponentially.

    Parameters
    ----------
    strip : Strip
        The strip.
    slip_x, slip_y : float
        Strip theory's slip over the step.
    way : float
        Step of q over sin(q) in its middle.
    e_x, e_y : float
        The direction before the step.
    """
    size = math.sqrt(slip_x * slip_x + slip_y * slip_y)
    if not size > 0.0:
        return e_x, e_y
    u_x, u_y = -slip_x / size, -slip_y / size
    give = e_y * e_y / strip.modulus_x + e_x * e_x / strip.modulus_y
    rate = size / (2.0 * strip.rise * strip.half_length * give)
    tangent = (u_x * e_y - u_y * e_x) / max(1.0 + u_x * e_x + u_y * e_y, 1e-12)
    tangent *= math.exp(-rate * way)
    square = tangent * tangent
    cosine, sine = (1.0 - square) / (1.0 + square), 2.0 * tangent / (1.0 + square)
    return u_x * cosine - u_y * sine, u_x * sine + u_y * cosine


@kernel
def fastrip_fields(
    half_length: FloatArray,
    bound_peak: FloatArray,
    motion: StripMotion,
    moduli: Moduli,
    points: int,
) -> FloatArray:
    """Return traction and slip fields of the strips that strip theory applies to; zeros in others.

    Parameters
    ----------
    half_length, bound_peak, motion, moduli
        As in `fastrip`.
    points : int
        Points along a strip, evenly spaced from x = a to x = -a, also the steps of the integration.

    Returns
    -------
    ndarray, shape (4, points, strips)
        Longitudinal and lateral traction [Pa] and slip over the rolling velocity, which opposes the
        traction and is zero in adhesion; from the leading edge on.
    """
    out = np.zeros((4, points, len(half_length)))
    for j in range(len(half_length)):
        beyond = beyond_strip_theory(j, half_length, bound_peak, motion, moduli)
        if half_length[j] > 0.0 and not beyond:
            _fill_fields(j, strip_of(j, half_length, bound_peak, motion, moduli), out)
    return out


@subroutine
def _fill_fields(j: int, strip: Strip, out: FloatArray) -> None:
    """Fill traction and slip of strip `j`, point by point from the leading edge."""
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
            e_x, e_y = turn_direction(strip, slip_x, slip_y, way, e_x, e_y)
        before = arc
        slip_x, slip_y = slip_at(strip, x, e_x, e_y)
        against = max(-(slip_x * e_x + slip_y * e_y), 0.0)
        out[0, k, j], out[1, k, j] = e_x * bound, e_y * bound
        out[2, k, j], out[3, k, j] = -against * e_x, -against * e_y

"""Strip theory with spin: adhesion zone of a strip, and slip behind it.

Haines and Ollerton, Proc. Inst. Mech. Eng. 177 (1963), and Kalker, Proc. Kon. Ned. Akad. Wet. B 70
(1967), solve rolling in every strip as in a plane. The moduli are amended here so that the linear
limits are those of the ellipse, following Sichani, Enblom and Berg (2016),
DOI 10.1080/00423114.2016.1156135. With the traction bound B sqrt(a^2 - x^2) and

    X = (xi Gx + s Gk) / 2B,  Y = eta Gy / 2B,  psi = phi Gs / 2B,

where s is the longitudinal slip caused by spin, the strip adheres at x > 2d - a, and its traction
there is

    -B [e sqrt(a^2 - x^2) - (e - psi j) sqrt((a - d)^2 - (x - d)^2)],
    e = (X/d, Y/d + psi),  |e| = 1:  d = (X^2 + Y^2) / (sqrt(Y^2 + (1 - psi^2) X^2) - Y psi).

The published amendment scales s and phi x by the same factor, the ratio of C23 to its plane limit.
In a plane the modulus of s is E* and that of phi x is G, so that s is too stiff by Gs/G, about 1.5
for the test rig. Here s has a separate modulus, which is determined from C33.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from wearsim.mechanics.numerics.jit import kernel, subroutine
from wearsim.mechanics.tangential.kalker_coefficients import CreepageCoefficients
from wearsim.types import FloatArray

_LIMIT = 50  # steps of Newton's method, which converges monotonically in about five


class Moduli(NamedTuple):
    """Moduli for which strip theory has the linear limit of the ellipse [Pa].

    Gx for longitudinal and Gy for lateral creepage; Gk and Gs for the slip caused by spin along
    rolling, -phi y, and across it, phi x.
    """

    longitudinal: float
    lateral: float
    spin_along: float
    spin_across: float


class StripMotion(NamedTuple):
    """Rigid slip per unit of rolling velocity, and its product with the moduli.

    Longitudinal slip (strips,), and xi Gx + s Gk (strips,) [Pa]; eta and phi [1/m].
    """

    longitudinal: FloatArray
    drive: FloatArray
    lateral: float
    spin: float


class Strip(NamedTuple):
    """One strip: half-length a [m], B [Pa/m] and shift d [m]; d = a in full sliding.

    Direction of the traction at the onset of slip, psi, the rigid slip without phi x, Gx and Gy
    [Pa].
    """

    half_length: float
    rise: float
    shift: float
    direction_x: float
    direction_y: float
    twist: float
    slip_x: float
    slip_y: float
    modulus_x: float
    modulus_y: float


def amended_moduli(
    coefficients: CreepageCoefficients,
    semi_axis_x: float,
    semi_axis_y: float,
    shear_modulus: float,
) -> Moduli:
    """Return the moduli for which strip theory has Kalker's coefficients in the linear limit.

    Parameters
    ----------
    coefficients : CreepageCoefficients
        Kalker's coefficients.
    semi_axis_x, semi_axis_y : float
        Half-lengths a along rolling and b across it [m].
    shear_modulus : float
        Combined shear modulus G [Pa].

    Returns
    -------
    Moduli
        For a contact that is long across rolling: E*, G, E* and, to first order, G.
    """
    ratio = semi_axis_x / semi_axis_y
    plane = 4.0 * shear_modulus / math.pi**2
    return Moduli(
        longitudinal=plane * coefficients.c11,
        lateral=plane * coefficients.c22,
        spin_along=4.0 * plane * coefficients.c33 * ratio,
        spin_across=3.0 * shear_modulus / (math.pi * math.sqrt(ratio)) * coefficients.c23,
    )


@kernel
def beyond_strip_theory(
    j: int, half_length: FloatArray, bound_peak: FloatArray, motion: StripMotion, moduli: Moduli
) -> bool:
    """Return whether strip `j` has no adhesion zone in strip theory because of spin.

    Parameters
    ----------
    j : int
        Number of the strip.
    half_length, bound_peak, motion, moduli
        As in `strip_of`.

    Returns
    -------
    bool
        Whether the magnitude of psi is at least 1.
    """
    return bool(abs(motion.spin) * moduli.spin_across * half_length[j] >= 2.0 * bound_peak[j])


@subroutine
def strip_of(
    j: int, half_length: FloatArray, bound_peak: FloatArray, motion: StripMotion, moduli: Moduli
) -> Strip:
    """Return strip `j` with its shift and the traction's direction at the onset of slip.

    Parameters
    ----------
    j : int
        Number of the strip.
    half_length, bound_peak : ndarray, shape (strips,)
        a(y) [m] and friction times the greatest pressure of the strip [Pa], both positive.
    motion : StripMotion
        The rigid slip.
    moduli : Moduli
        The amended moduli.
    """
    a = half_length[j]
    rise = bound_peak[j] / a
    slip_x, slip_y = motion.longitudinal[j], motion.lateral
    x, y = 0.5 * motion.drive[j] / rise, 0.5 * slip_y * moduli.lateral / rise
    twist = 0.5 * motion.spin * moduli.spin_across / rise
    square = x * x + y * y
    part = math.sqrt(y * y + (1.0 - twist * twist) * x * x) - y * twist
    shift = square / part if part > 0.0 else 0.0
    if shift < a:
        along, across = (-x / shift, -(y / shift + twist)) if shift > 0.0 else (0.0, 0.0)
    else:
        shift = a
        # the longitudinal slip that the shift is computed from
        driven = motion.drive[j] / moduli.longitudinal
        along, across = _direction_at_edge(driven, slip_y, twist, 2.0 * rise * a, moduli)
    return Strip(
        a,
        rise,
        shift,
        along,
        across,
        twist,
        slip_x,
        slip_y,
        moduli.longitudinal,
        moduli.lateral,
    )


@subroutine
def _direction_at_edge(
    slip_x: float, slip_y: float, twist: float, strain: float, moduli: Moduli
) -> tuple[float, float]:
    """Return the traction's direction at the leading edge of a strip in full sliding.

    The traction opposes the slip of strip theory there: slip = -lambda e, where lambda >= 0 is
    determined by |e| = 1.
    """
    k_x, k_y = strain / moduli.longitudinal, strain / moduli.lateral
    w_x, w_y = slip_x, slip_y + k_y * twist
    size, factor = 0.0, 0.0
    for _ in range(_LIMIT):
        e_x, e_y = w_x / (factor + k_x), w_y / (factor + k_y)
        size = math.sqrt(e_x * e_x + e_y * e_y)
        slope = e_x * e_x / (factor + k_x) + e_y * e_y / (factor + k_y)
        change = (size - 1.0) * size * size / slope
        factor += change
        if not abs(change) > 1e-14 * (factor + k_x):
            break
    return -e_x / size, -e_y / size


@subroutine
def slip_at(strip: Strip, x: float, e_x: float, e_y: float) -> tuple[float, float]:
    """Return the slip of strip theory in the slip zone, over the rolling velocity.

    Parameters
    ----------
    strip : Strip
        The strip.
    x : float
        Position [m].
    e_x, e_y : float
        The traction's direction there, used only in full sliding.
    """
    a, d = strip.half_length, strip.shift
    if d < a:
        grown = math.sqrt(max((2.0 * d - a - x) * (a - x), 0.0)) / d
        return strip.slip_x * grown, strip.slip_y * grown
    strain = 2.0 * strip.rise * x
    return (
        strip.slip_x + strain * e_x / strip.modulus_x,
        strip.slip_y + strain * (e_y + strip.twist) / strip.modulus_y,
    )

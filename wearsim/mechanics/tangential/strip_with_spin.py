"""Strip theory with spin: how far a strip slides, and what slips behind the part that adheres.

Haines and Ollerton, Proc. Inst. Mech. Eng. 177 (1963), and Kalker, Proc. Kon. Ned. Akad. Wet. B 70
(1967), solve rolling in every strip as in a plane. It is amended here so that its linear limits are
those of the whole ellipse, as Sichani, Enblom and Berg do (2016),
DOI 10.1080/00423114.2016.1156135. With the traction bound B sqrt(a^2 - x^2) and

    X = (xi Gx + s Gk) / 2B,  Y = eta Gy / 2B,  psi = phi Gs / 2B,

s being the part of the longitudinal slip that comes from spin, the strip adheres at x > 2d - a,
where its traction is

    -B [e sqrt(a^2 - x^2) - (e - psi j) sqrt((a - d)^2 - (x - d)^2)],
    e = (X/d, Y/d + psi),  |e| = 1:  d = (X^2 + Y^2) / (sqrt(Y^2 + (1 - psi^2) X^2) - Y psi).

The published amendment scales s and phi x alike, by what C23 has beyond its plane limit. In a plane
s meets E* and phi x meets G, so that s comes out Gs/G too stiff, half as stiff again on the rig;
here s has a modulus of its own, by which C33 is met.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from wearsim.mechanics.numerics.jit import kernel
from wearsim.mechanics.tangential.kalker_coefficients import CreepageCoefficients
from wearsim.types import FloatArray

_LIMIT = 50  # steps of Newton's method, which comes from one side and needs a handful


class Moduli(NamedTuple):
    """Moduli with which strips have the linear limit of a whole ellipse [Pa].

    Gx for longitudinal and Gy for lateral creepage; Gk and Gs for the parts of spin that act along
    rolling, -phi y, and across it, phi x.
    """

    longitudinal: float
    lateral: float
    spin_along: float
    spin_across: float


class Motion(NamedTuple):
    """Rigid slip per unit of rolling velocity, and its product with the moduli.

    Longitudinal slip (strips,), and xi Gx + s Gk (strips,) [Pa]; eta and phi [1/m].
    """

    longitudinal: FloatArray
    drive: FloatArray
    lateral: float
    spin: float


class Strip(NamedTuple):
    """One strip: half-length a [m], B [Pa/m] and shift d [m]; d = a where it slides throughout.

    Direction of the traction where slip begins, psi, the part of the rigid slip without phi x, Gx
    and Gy [Pa].
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
    """Return the moduli with which strip theory meets Kalker's coefficients in the linear limit.

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
        For a contact long across rolling these are E*, G, E* and, to first order, G.
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
    j: int, half_length: FloatArray, bound_peak: FloatArray, motion: Motion, moduli: Moduli
) -> bool:
    """Tell whether spin leaves nothing of strip `j` adhering in strip theory.

    Parameters
    ----------
    j : int
        Number of the strip.
    half_length, bound_peak, motion, moduli
        As in `strip_of`.

    Returns
    -------
    bool
        Whether psi is 1 or more, to either side.
    """
    return bool(abs(motion.spin) * moduli.spin_across * half_length[j] >= 2.0 * bound_peak[j])


@kernel
def strip_of(
    j: int, half_length: FloatArray, bound_peak: FloatArray, motion: Motion, moduli: Moduli
) -> Strip:
    """Return how far strip `j` slides, and the traction's direction where it begins to.

    Parameters
    ----------
    j : int
        Number of the strip.
    half_length, bound_peak : ndarray, shape (strips,)
        a(y) [m] and friction times the greatest pressure of the strip [Pa], both positive.
    motion : Motion
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
        along, across = 0.0, 0.0  # nothing slides, or
        if shift > 0.0:
            along, across = -x / shift, -(y / shift + twist)
    else:
        shift = a
        # the slip that the shift follows from, with which the strip slides throughout by itself
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


@kernel
def _direction_at_edge(
    slip_x: float, slip_y: float, twist: float, strain: float, moduli: Moduli
) -> tuple[float, float]:
    """Return the traction's direction at the leading edge of a strip that slides throughout.

    There it turns at once until the slip that strip theory leaves opposes it: slip = -lambda e,
    where lambda, from 0 up, makes e a unit vector.
    """
    k_x, k_y = strain / moduli.longitudinal, strain / moduli.lateral
    w_x, w_y = slip_x, slip_y + k_y * twist
    size, factor = 0.0, 0.0
    for _ in range(_LIMIT):
        e_x, e_y = w_x / (factor + k_x), w_y / (factor + k_y)
        size = math.sqrt(e_x * e_x + e_y * e_y)
        bend = e_x * e_x / (factor + k_x) + e_y * e_y / (factor + k_y)
        change = (size - 1.0) * size * size / bend
        factor += change
        if not abs(change) > 1e-14 * (factor + k_x):
            break
    return -e_x / size, -e_y / size


@kernel
def slip_at(strip: Strip, x: float, e_x: float, e_y: float) -> tuple[float, float]:
    """Return strip theory's slip where it slides, over the rolling velocity.

    Parameters
    ----------
    strip : Strip
        The strip.
    x : float
        Where [m].
    e_x, e_y : float
        The traction's direction there, which counts where the strip slides throughout.
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

"""Interaction of the strips of a finite contact: effective moduli and induced slip.

Strip theory treats a strip as one of infinitely many identical strips. It lacks two effects, of
order (a/b)^2 ln(b/a) and (a/b) ln(b/a).

**Moduli.** A patch of finite width is slightly stiffer. E* and G are multiplied by the ratio of
Kalker's C11 and C22 for equivalent ellipses to their limits for a long contact, so that the linear
theory is recovered for small creepage.

**Induced slip.** Traction in y that varies along y strains the surface along x, and vice versa:
with the forces T of the strips and the displacement nu x y / (pi G R^3) of the half-space,

    d u_x / d x = -(nu / (pi G)) d/dy int T_y(y') W(y - y') dy',    W -> 1/|y - y'|,

and likewise d u_y / d x from T_x. Near a strip W is regularised over a length that is obtained by
averaging ln|x - x'| over the tractions: 0.5 e^(3/4) a where strips slide (elliptic traction), 0.5
e^(3/2) a where they adhere (traction of the linear theory, and weight of the slip in the force).
W is approximated by a geometric series of exponentials,

    1 / |y| = int e^(-k |y|) dk,  k = k_0, k_0/4, k_0/16, ...,

so that the sum over all pairs of strips requires one forward and one backward sweep. The operator
is antisymmetric: it transfers power between strips and conserves the total.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from wearsim.mechanics.numerics.jit import subroutine
from wearsim.mechanics.tangential.kalker_coefficients import coefficient, short_limit, spline
from wearsim.types import FloatArray

_STEP = 0.05  # of ln(a/b) in the table; the error of linear interpolation is below 3e-4
_LOWEST = math.log(2e-3)  # ln(a/b) below which a contact is treated as infinitely wide
_HIGHEST = math.log(20.0)

_LADDER = math.log(4.0)  # step of ln k: the sum deviates from its integral by 4 %
_GROUPS = 2  # of four exponentials: sufficient for b/a up to 8000
_FLAT = 0.1  # k times the contact's width below which exponentials are negligible: (k width)^2/4
# k_0 = _HEAD / (regularisation length of W), so that sum and integral have the same logarithm
_HEAD = 2.0 * math.exp(-float(np.euler_gamma) - 0.5 * _LADDER)


class StripElasticity(NamedTuple):
    """E* and G [Pa], and their factors in a contact of finite width, one row per ln(a/b)."""

    contact_modulus: float
    shear_modulus: float
    widening: FloatArray


@lru_cache(maxsize=16)
def strip_elasticity(contact_modulus: float, shear_modulus: float) -> StripElasticity:
    """Return the `StripElasticity` of two bodies.

    Parameters
    ----------
    contact_modulus, shear_modulus : float
        E* and G [Pa].
    """
    nu = min(max(1.0 - shear_modulus / contact_modulus, 0.0), 0.5)
    ratios = np.exp(np.arange(_LOWEST, _HIGHEST + _STEP, _STEP))
    limits = short_limit(float(ratios[0]), nu)  # of C11, C22 and the others
    widening = [
        [coefficient(which, ratio, nu, spline(which)) / limits[which] for which in range(2)]
        for ratio in ratios.tolist()
    ]
    return StripElasticity(float(contact_modulus), float(shear_modulus), np.array(widening))


@subroutine
def equivalent_ratio(half_length: FloatArray, line_load: FloatArray, spacing: float) -> float:
    """Return a/b of the ellipses equivalent to a contact.

    They have the greatest half-length of the contact and in total its area. Their number is the sum
    of all increases of a(y) over that half-length: it is the number of separate patches, and varies
    continuously as patches merge.

    Parameters
    ----------
    half_length, line_load : ndarray, shape (strips,)
        a [m] and q [N/m].
    spacing : float
        Width of a strip [m].
    """
    widest, length, rises, before = 0.0, 0.0, 0.0, 0.0
    for i in range(line_load.shape[0]):
        here = half_length[i] if line_load[i] > 0.0 else 0.0
        widest = max(widest, here)
        length += here
        rises += max(0.0, here - before)
        before = here
    return 0.5 * math.pi * widest * rises / (length * spacing) if length > 0.0 else 1.0


@subroutine
def effective_moduli(ratio: float, elasticity: StripElasticity) -> tuple[float, float]:
    """Return E_x and G_y [Pa] of the strips of a contact.

    Parameters
    ----------
    ratio : float
        a/b of the equivalent ellipse.
    elasticity : StripElasticity
    """
    factors = elasticity.widening
    place = max(0.0, (math.log(ratio) - _LOWEST) / _STEP)
    k = min(int(place), factors.shape[0] - 2)
    part = min(place - k, 1.0)
    factor_x = factors[k, 0] + part * (factors[k + 1, 0] - factors[k, 0])
    factor_y = factors[k, 1] + part * (factors[k + 1, 1] - factors[k, 1])
    return elasticity.contact_modulus * factor_x, elasticity.shear_modulus * factor_y


@subroutine
def coupling_length(half_length: float, adhering: float) -> float:
    """Return the regularisation length of W [m].

    Parameters
    ----------
    half_length : float
        Mean half-length of the strips [m].
    adhering : float
        Adhering fraction of the contact, 0 to 1.
    """
    return 0.5 * half_length * math.exp(0.75 * (1.0 + adhering))


@subroutine
def induced_slip(
    force_x: FloatArray,
    force_y: FloatArray,
    first: int,
    last: int,
    spacing: float,
    length: float,
    elasticity: StripElasticity,
    induced_x: FloatArray,
    induced_y: FloatArray,
) -> None:
    """Fill the slip that the strips induce in each other, to be added to the rigid slip.

    Parameters
    ----------
    force_x, force_y : ndarray, shape (strips,)
        Forces of the strips [N/m], zero where unloaded.
    first, last : int
        The first and the last loaded strip.
    spacing, length : float
        Width of a strip, and `coupling_length` [m].
    elasticity : StripElasticity
    induced_x, induced_y : ndarray, shape (strips,)
        Filled from `first` to `last`: slip per unit of rolling velocity.
    """
    for i in range(first, last + 1):
        induced_x[i], induced_y[i] = 0.0, 0.0
    shear = elasticity.shear_modulus
    poisson = 1.0 - shear / elasticity.contact_modulus
    rate, width = _HEAD / length, spacing * (last - first + 1)
    decay = math.exp(-rate * spacing)
    weight = _LADDER * rate * rate * spacing * poisson / (math.pi * shear)
    for group in range(_GROUPS):
        if group > 0 and rate * width < _FLAT:
            break
        _add_group(force_x, force_y, first, last, decay, weight, induced_x, induced_y)
        rate, weight = rate / 256.0, weight / 65536.0
        decay = math.exp(-rate * spacing)


@subroutine
def _add_group(
    force_x: FloatArray,
    force_y: FloatArray,
    first: int,
    last: int,
    decay: float,
    weight: float,
    induced_x: FloatArray,
    induced_y: FloatArray,
) -> None:
    """Add the slip of four exponentials in one forward and one backward sweep.

    Parameters
    ----------
    force_x, force_y, first, last, induced_x, induced_y
        As in `induced_slip`.
    decay, weight : float
        exp(-k spacing) of the greatest k, and the weight of its sums.
    """
    two = math.sqrt(math.sqrt(decay))
    three = math.sqrt(math.sqrt(two))
    four = math.sqrt(math.sqrt(three))
    second, third, fourth = weight / 16.0, weight / 256.0, weight / 4096.0
    for sign in (-1.0, 1.0):
        x1, x2, x3, x4, y1, y2, y3, y4 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for k in range(last - first + 1):
            i = first + k if sign < 0.0 else last - k
            induced_x[i] += sign * ((weight * y1 + second * y2) + (third * y3 + fourth * y4))
            induced_y[i] += sign * ((weight * x1 + second * x2) + (third * x3 + fourth * x4))
            x, y = force_x[i], force_y[i]
            x1, x2, x3, x4 = decay * (x1 + x), two * (x2 + x), three * (x3 + x), four * (x4 + x)
            y1, y2, y3, y4 = decay * (y1 + y), two * (y2 + y), three * (y3 + y), four * (y4 + y)

"""FASTSIM's march integrated in closed form, where each traction keeps one direction."""

from __future__ import annotations

import math

import numpy as np

from wearsim.mechanics.numerics.jit import kernel
from wearsim.mechanics.tangential.fastsim import Sums, clear, new_sums, stack_sums
from wearsim.types import FloatArray


@kernel
def closed_form(
    half_length: FloatArray,
    bound_peak: FloatArray,
    elliptic: bool,
    gradient_x: FloatArray,
    gradient_y: float,
) -> FloatArray:
    """Return what `march` tends to without spin, where each traction keeps one direction.

    With G = |gradient| the traction climbs as G s behind the leading edge until it meets the bound,
    where it stays: at s = 2a - kappa, kappa = G a^2/bound_peak, for the parabolic bound, and at
    s = 2a/(1 + k^2), k = G a/bound_peak, for the elliptic one.

    Parameters
    ----------
    half_length, bound_peak, elliptic, gradient_x, gradient_y
        As in `march`.

    Returns
    -------
    ndarray, shape (4, strips)
        As `march` returns, the moment being that of the same tractions.

    Notes
    -----
    Integrated here from the march of Kalker (1982), DOI 10.1080/00423118208968684.
    """
    sums = new_sums(len(half_length))
    closed_form_into(
        len(half_length), half_length, bound_peak, elliptic, gradient_x, gradient_y, sums
    )
    return stack_sums(sums)


@kernel
def closed_form_into(
    strips: int,
    half_length: FloatArray,
    bound_peak: FloatArray,
    elliptic: bool,
    gradient_x: FloatArray,
    gradient_y: float,
    sums: Sums,
) -> None:
    """Integrate as `closed_form` does, into room that is there already.

    Parameters
    ----------
    strips : int
        How many of the strips to integrate, the first ones.
    half_length, bound_peak, elliptic, gradient_x, gradient_y
        As in `march`.
    sums : Sums
        Overwritten.
    """
    clear(strips, sums)
    for j in range(strips):
        a, peak = half_length[j], bound_peak[j]
        size = math.sqrt(gradient_x[j] * gradient_x[j] + gradient_y * gradient_y)
        if a > 0.0 and size > 0.0 and peak > 0.0:
            if elliptic:
                stick, force, moment = _elliptic(a, size, peak)
            else:
                stick, force, moment = _parabolic(a, size, peak)
            sums.force_x[j] = -force * (gradient_x[j] / size)
            sums.force_y[j] = -force * (gradient_y / size)
            sums.moment[j] = -moment * (gradient_y / size)
            sums.adhesion[j] = stick
        elif size == 0.0:
            sums.adhesion[j] = 2.0 * a


@kernel
def _parabolic(a: float, steep: float, peak: float) -> tuple[float, float, float]:
    """Return adhesion length, force and moment (x times traction) for the parabolic bound."""
    kappa = min(steep * a**2 / peak, 2.0 * a)
    stick = 2.0 * a - kappa
    # x = a - s; in adhesion the traction is G s, in slip peak s(2a - s)/a^2
    slip_force = peak * kappa**2 * (3.0 * a - kappa) / (3.0 * a**2)
    edge = kappa - a  # x where slip starts
    slip_moment = -0.25 * peak * (a**2 - edge**2) ** 2 / a**2
    force = 0.5 * steep * stick**2 + slip_force
    moment = steep * stick**2 * (0.5 * a - stick / 3.0) + slip_moment
    return stick, force, moment


@kernel
def _elliptic(a: float, steep: float, peak: float) -> tuple[float, float, float]:
    """Return adhesion length, force and moment (x times traction) for the elliptic bound."""
    k = steep * a / peak
    stick = 2.0 * a / (1.0 + k**2)
    cosine = (k**2 - 1.0) / (k**2 + 1.0)  # x/a where slip starts
    sine = 2.0 * k / (1.0 + k**2)
    slip_force = 0.5 * peak * a * (cosine * sine + math.atan2(cosine, sine) + 0.5 * math.pi)
    slip_moment = -peak * a**2 * sine**3 / 3.0
    force = 0.5 * steep * stick**2 + slip_force
    moment = steep * stick**2 * (0.5 * a - stick / 3.0) + slip_moment
    return stick, force, moment


def closed_form_parabolic(
    semi_axis_x: float,
    semi_axis_y: float,
    normal_force: float,
    friction: float,
    creepage: float,
    flexibility: float,
    half_length: FloatArray,
) -> FloatArray:
    """Return the force per strip of Kalker's ellipse under one creepage, in closed form.

    With kappa = v a^2/(L mu pp), pp = 2N/(pi a b), the same for every strip of half-length A:
    F = (v/L)(2 A^2 - A kappa + kappa^2/6) where kappa < 2A, else (4/3) mu pp A^3/a^2. The
    dissipation is V v F.

    Parameters
    ----------
    semi_axis_x, semi_axis_y : float
        a and b [m].
    normal_force : float
        N [N].
    friction : float
        mu.
    creepage : float
        Magnitude v of the creepage.
    flexibility : float
        L of its direction [m/Pa].
    half_length : ndarray, shape (strips,)
        A = a(y) [m].

    Returns
    -------
    ndarray, shape (strips,)
        Magnitude of the force per unit of axial length [N/m].
    """
    peak = friction * 2.0 * normal_force / (math.pi * semi_axis_x * semi_axis_y)
    bound_peak = peak * (half_length / semi_axis_x) ** 2
    gradient = np.full_like(half_length, creepage / flexibility)
    force_x: FloatArray = closed_form(half_length, bound_peak, False, gradient, 0.0)[0]
    return -force_x

"""Closed form of FASTSIM without spin, where the direction of each traction is constant."""

from __future__ import annotations

import math

from wearsim.mechanics.numerics.jit import kernel, subroutine
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
    """Return the limit of `march` for small steps without spin.

    With G = |gradient| the traction increases as G s behind the leading edge until it reaches the
    bound, and is then equal to it: from s = 2a - kappa, kappa = G a^2/bound_peak, for the parabolic
    bound, and from s = 2a/(1 + k^2), k = G a/bound_peak, for the elliptic one.

    Parameters
    ----------
    half_length, bound_peak, elliptic, gradient_x, gradient_y
        As in `march`.

    Returns
    -------
    ndarray, shape (4, strips)
        As of `march`; the moment is that of the same tractions.

    Notes
    -----
    Derived from Kalker (1982), DOI 10.1080/00423118208968684.
    """
    sums = new_sums(len(half_length))
    closed_form_into(
        len(half_length), half_length, bound_peak, elliptic, gradient_x, gradient_y, sums
    )
    return stack_sums(sums)


@subroutine
def closed_form_into(
    strips: int,
    half_length: FloatArray,
    bound_peak: FloatArray,
    elliptic: bool,
    gradient_x: FloatArray,
    gradient_y: float,
    sums: Sums,
) -> None:
    """Integrate as `closed_form` does, into an existing `Sums`.

    Parameters
    ----------
    strips : int
        Number of strips to integrate, the first ones.
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
            slip = _elliptic(a, size, peak) if elliptic else _parabolic(a, size, peak)
            stick = slip[0]
            force = 0.5 * size * stick**2 + slip[1]
            moment = size * stick**2 * (0.5 * a - stick / 3.0) + slip[2]
            sums.force_x[j] = -force * (gradient_x[j] / size)
            sums.force_y[j] = -force * (gradient_y / size)
            sums.moment[j] = -moment * (gradient_y / size)
            sums.adhesion[j] = stick
        elif size == 0.0:
            sums.adhesion[j] = 2.0 * a


@subroutine
def _parabolic(a: float, steep: float, peak: float) -> tuple[float, float, float]:
    """Return adhesion length, force and moment of the slip zone for the parabolic bound."""
    kappa = min(steep * a**2 / peak, 2.0 * a)
    # x = a - s; the traction is G s in adhesion and peak s(2a - s)/a^2 in slip
    slip_force = peak * kappa**2 * (3.0 * a - kappa) / (3.0 * a**2)
    edge = kappa - a  # x at the onset of slip
    return 2.0 * a - kappa, slip_force, -0.25 * peak * (a**2 - edge**2) ** 2 / a**2


@subroutine
def _elliptic(a: float, steep: float, peak: float) -> tuple[float, float, float]:
    """Return adhesion length, force and moment of the slip zone for the elliptic bound."""
    k = steep * a / peak
    cosine = (k**2 - 1.0) / (k**2 + 1.0)  # x/a at the onset of slip
    sine = 2.0 * k / (1.0 + k**2)
    slip_force = 0.5 * peak * a * (cosine * sine + math.atan2(cosine, sine) + 0.5 * math.pi)
    return 2.0 * a / (1.0 + k**2), slip_force, -peak * a**2 * sine**3 / 3.0

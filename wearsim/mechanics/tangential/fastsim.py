"""FASTSIM, Kalker's simplified theory of rolling contact, on strips of any shape."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from wearsim.mechanics.numerics.jit import kernel, subroutine
from wearsim.types import FloatArray

_ROOT_CORNER = 0.2078862249773546  # -zeta(-1/2)


# rows of the integrals over every strip, and of the traction at the current point, (7, strips):
# integrals of the longitudinal and the lateral traction [N/m] and of x times the latter [N],
# adhesion length [m], the element sum over V [N/m] and the tractions [Pa]
ROWS = 7
FORCE_X, FORCE_Y, MOMENT, ADHESION, WORK, TRACTION_X, TRACTION_Y = range(ROWS)


@kernel
def march(
    half_length: FloatArray,
    bound_peak: FloatArray,
    elliptic: bool,
    gradient_x: FloatArray,
    gradient_y: float,
    gradient_spin: float,
    points: int,
) -> FloatArray:
    """Integrate the traction from the leading to the trailing edge of all strips together.

    A step of dx adds -gradient dx to the traction; if the result exceeds the bound at the new
    point, the traction is scaled back to the bound. The integrals use the trapezoidal rule with
    corrections at both edges, where the traction vanishes (`end_weights`). The work of the rigid
    slip is exact for these integrals. Its error is of second order in dx; the remaining error is
    caused by the onset of slip, has either sign, and averages out over the strips.

    Parameters
    ----------
    half_length : ndarray, shape (strips,)
        a(y) [m]; strips with a = 0 get zeros.
    bound_peak : ndarray, shape (strips,)
        Traction bound at x = 0 [Pa].
    elliptic : bool
        Whether the bound along the strip is sqrt(1 - x^2/a^2) rather than 1 - x^2/a^2.
    gradient_x : ndarray, shape (strips,)
        Gradient of the longitudinal traction in adhesion: xi/L1 plus the spin part over L3 [Pa/m].
    gradient_y, gradient_spin : float
        The same for the lateral traction, eta/L2 [Pa/m], and phi/L3 [Pa/m^2], which multiplies x.
    points : int
        Number of steps mx along each strip.

    Returns
    -------
    ndarray, shape (4, strips)
        Integral of the longitudinal and of the lateral traction [N/m], integral of x times the
        lateral traction [N], and adhesion length [m].

    Notes
    -----
    Kalker (1982), DOI 10.1080/00423118208968684.
    """
    sums = np.empty((ROWS, len(half_length)))
    march_into(
        len(half_length),
        half_length,
        bound_peak,
        None,
        0,
        elliptic,
        gradient_x,
        gradient_y,
        gradient_spin,
        0.0,
        0.0,
        points,
        sums,
        None,
    )
    return sums[:WORK].copy()


@subroutine
def march_into(
    strips: int,
    half_length: FloatArray,
    bound_peak: FloatArray,
    friction: Any,
    first: int,
    elliptic: bool,
    gradient_x: FloatArray,
    gradient_y: float,
    gradient_spin: float,
    longitudinal: float,
    lateral: float,
    points: int,
    sums: FloatArray,
    fields: Any,
) -> None:
    """Integrate as `march` does, into existing rows.

    Compiled separately for a bound without a friction field (`friction` None), without the element
    sum, and without fields (`fields` None).

    Parameters
    ----------
    strips : int
        Number of strips to integrate, the first ones; a multiple of four is fastest.
    half_length, elliptic, gradient_x, gradient_y, gradient_spin
        As in `march`.
    bound_peak : ndarray, shape (strips,)
        As in `march`; with a friction field its pressure [Pa], without friction.
    friction : ndarray, shape (points, all strips), or None
        Friction coefficient at the end of each step, from the leading edge on.
    first : int
        Column of `friction` of the first strip.
    longitudinal, lateral : float
        Flexibilities L1 and L2 [m/Pa], used for the element sum only.
    points : int
        As in `march`.
    sums : ndarray, shape (7, >= strips)
        Overwritten, for the first strips; row `WORK` is the element sum over the rolling velocity.
    fields : ndarray, shape (4, points + 1, strips), or None
        Filled behind the leading edge, as by `march_fields`.
    """
    sums[:, :strips] = 0.0
    cell = 2.0 / points
    for k in range(1, points + 1):
        place = place_of(k, points)
        shape = bound_shape(place, elliptic)
        sticking, sliding = end_weights(k, points, elliptic)
        for j in range(strips):
            a, bound = half_length[j], shape * bound_peak[j]
            if friction is not None:
                bound = shape * (friction[k - 1, first + j] * bound_peak[j])
            across = gradient_y + gradient_spin * (place + 0.5 * cell) * a
            tx = sums[TRACTION_X, j] - gradient_x[j] * (cell * a)
            ty = sums[TRACTION_Y, j] - across * (cell * a)
            square = tx * tx + ty * ty
            sticks = square <= bound * bound
            scale = 1.0 if sticks else bound / math.sqrt(square)
            sums[TRACTION_X, j] = scale * tx
            sums[TRACTION_Y, j] = scale * ty
            weighed = scale * (sticking if sticks else sliding)
            sums[FORCE_X, j] += weighed * tx
            sums[FORCE_Y, j] += weighed * ty
            sums[MOMENT, j] += place * (weighed * ty)
            sums[ADHESION, j] += 1.0 if sticks else 0.0
            if friction is not None:
                cut = scale * (1.0 - scale)
                sums[WORK, j] += cut * (longitudinal * tx * tx + lateral * ty * ty)
            if fields is not None:
                fields[0, k, j], fields[1, k, j] = scale * tx, scale * ty
                fields[2, k, j], fields[3, k, j] = (1.0 - scale) * tx, (1.0 - scale) * ty
    for j in range(strips):
        dx = cell * half_length[j]
        sums[FORCE_X, j] *= dx
        sums[FORCE_Y, j] *= dx
        sums[MOMENT, j] *= dx * half_length[j]
        sums[ADHESION, j] *= dx


@subroutine
def place_of(step: int, points: int) -> float:
    """Return x/a at the end of a step, from just behind the leading edge to -1.

    Parameters
    ----------
    step, points : int
        Number of the step, from 1, and number of steps mx along the strip.
    """
    return 1.0 - 2.0 / points * step if step < points else -1.0


@subroutine
def end_weights(step: int, points: int, elliptic: bool) -> tuple[float, float]:
    """Return the weights of the traction at the end of a step in the sums, in adhesion and slip.

    They are 1 except next to the edges, where the error of the trapezoidal rule is corrected by the
    Euler-Maclaurin formula: h/12 times the first value of a traction that increases linearly or as
    the parabola, and -zeta(-1/2) h times that of one that increases as a square root.

    Parameters
    ----------
    step, points : int
        Number of the step, from 1, and number of steps mx along the strip.
    elliptic : bool
        As in `march`.
    """
    sticking = sliding = 1.0
    inner = points / max(points - 1.0, 1.0)  # slope of the bound at the edge over that of its chord
    corner = _ROOT_CORNER * math.sqrt(inner) if elliptic else inner / 12.0
    if step == 1:
        sticking += 1.0 / 12.0
        sliding += corner
    if step == points - 1:
        sticking += corner
        sliding += corner
    return sticking, sliding


@subroutine
def bound_shape(place: float, elliptic: bool) -> float:
    """Return the traction bound at x/a = `place` over that at x = 0.

    Parameters
    ----------
    place : float
        x/a, from -1 to 1.
    elliptic : bool
        As in `march`.
    """
    shape = (1.0 - place) * (1.0 + place)
    return math.sqrt(shape) if elliptic else shape


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
    sums = np.empty((ROWS, len(half_length)))
    closed_form_into(
        len(half_length), half_length, bound_peak, elliptic, gradient_x, gradient_y, sums
    )
    return sums[:WORK].copy()


@subroutine
def closed_form_into(
    strips: int,
    half_length: FloatArray,
    bound_peak: FloatArray,
    elliptic: bool,
    gradient_x: FloatArray,
    gradient_y: float,
    sums: FloatArray,
) -> None:
    """Integrate as `closed_form` does, into existing rows.

    Parameters
    ----------
    strips : int
        Number of strips to integrate, the first ones.
    half_length, bound_peak, elliptic, gradient_x, gradient_y
        As in `march`.
    sums : ndarray, shape (7, >= strips)
        Overwritten, for the first strips.
    """
    sums[:, :strips] = 0.0
    for j in range(strips):
        a, peak = half_length[j], bound_peak[j]
        size = math.sqrt(gradient_x[j] * gradient_x[j] + gradient_y * gradient_y)
        if a > 0.0 and size > 0.0 and peak > 0.0:
            slip = _elliptic(a, size, peak) if elliptic else _parabolic(a, size, peak)
            stick = slip[0]
            force = 0.5 * size * stick**2 + slip[1]
            moment = size * stick**2 * (0.5 * a - stick / 3.0) + slip[2]
            sums[FORCE_X, j] = -force * (gradient_x[j] / size)
            sums[FORCE_Y, j] = -force * (gradient_y / size)
            sums[MOMENT, j] = -moment * (gradient_y / size)
            sums[ADHESION, j] = stick
        elif size == 0.0:
            sums[ADHESION, j] = 2.0 * a


@subroutine
def _parabolic(a: float, steep: float, peak: float) -> tuple[float, float, float]:
    """Return adhesion length, force and moment of the slip zone for the parabolic bound."""
    kappa = min(steep * a**2 / peak, 2.0 * a)
    # x = a - s; the traction is G s in adhesion and peak s(2a - s)/a^2 in slip
    slip_force = peak * kappa**2 * (3.0 * a - kappa) / (3.0 * a**2)
    # slip begins at x = kappa - a
    return 2.0 * a - kappa, slip_force, -0.25 * peak * (a**2 - (kappa - a) ** 2) ** 2 / a**2


@subroutine
def _elliptic(a: float, steep: float, peak: float) -> tuple[float, float, float]:
    """Return adhesion length, force and moment of the slip zone for the elliptic bound."""
    k = steep * a / peak
    cosine = (k**2 - 1.0) / (k**2 + 1.0)  # x/a at the onset of slip
    sine = 2.0 * k / (1.0 + k**2)
    slip_force = 0.5 * peak * a * (cosine * sine + math.atan2(cosine, sine) + 0.5 * math.pi)
    return 2.0 * a / (1.0 + k**2), slip_force, -peak * a**2 * sine**3 / 3.0


@kernel
def march_fields(
    half_length: FloatArray,
    bound_peak: FloatArray,
    elliptic: bool,
    gradient_x: FloatArray,
    gradient_y: float,
    gradient_spin: float,
    friction: FloatArray,
) -> FloatArray:
    """Return the traction fields of `march_into`.

    Parameters
    ----------
    half_length, bound_peak, elliptic, gradient_x, gradient_y, gradient_spin
        As in `march`.
    friction : ndarray, shape (points, strips)
        Friction coefficient at the end of each step that `bound_peak` is multiplied by.

    Returns
    -------
    ndarray, shape (4, points + 1, strips)
        Longitudinal and lateral traction, and the excess of each trial traction over the traction
        bound [Pa]; from the leading edge x = a to the trailing edge x = -a. Slip over the rolling
        velocity is ``-excess * L / dx`` in each direction, with its flexibility L.
    """
    points, strips = friction.shape
    out = np.zeros((4, points + 1, strips))
    march_into(
        strips,
        half_length,
        bound_peak,
        friction,
        0,
        elliptic,
        gradient_x,
        gradient_y,
        gradient_spin,
        0.0,
        0.0,
        points,
        np.empty((ROWS, strips)),
        out,
    )
    return out

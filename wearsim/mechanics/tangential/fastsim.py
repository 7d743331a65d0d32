"""FASTSIM, Kalker's simplified theory of rolling contact, on strips of any shape."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from wearsim.mechanics.numerics.jit import inlined_subroutine, kernel, subroutine
from wearsim.types import FloatArray

_ROOT_CORNER = 0.2078862249773546  # -zeta(-1/2)


class Sums(NamedTuple):
    """Integrals over every strip and the traction at the current point, all (strips,).

    Integrals of the longitudinal and the lateral traction [N/m] and of x times the latter [N],
    adhesion length [m], the element sum over V [N/m] and the tractions [Pa].
    """

    force_x: FloatArray
    force_y: FloatArray
    moment: FloatArray
    adhesion: FloatArray
    work: FloatArray
    traction_x: FloatArray
    traction_y: FloatArray


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
    sums = new_sums(len(half_length))
    march_into(
        len(half_length),
        half_length,
        bound_peak,
        elliptic,
        gradient_x,
        gradient_y,
        gradient_spin,
        points,
        sums,
    )
    return stack_sums(sums)


@subroutine
def new_sums(strips: int) -> Sums:
    """Return `Sums` of zeros for a number of strips.

    Parameters
    ----------
    strips : int
        Number of strips.
    """
    rows = np.zeros((7, strips))
    return Sums(rows[0], rows[1], rows[2], rows[3], rows[4], rows[5], rows[6])


@subroutine
def slice_sums(sums: Sums, first: int, stop: int) -> Sums:
    """Return a view of the sums of the strips from `first` to before `stop`.

    Parameters
    ----------
    sums : Sums
        Sums of all strips.
    first, stop : int
        Number of the first strip, and of the one after the last.
    """
    return Sums(
        sums.force_x[first:stop],
        sums.force_y[first:stop],
        sums.moment[first:stop],
        sums.adhesion[first:stop],
        sums.work[first:stop],
        sums.traction_x[first:stop],
        sums.traction_y[first:stop],
    )


@subroutine
def stack_sums(sums: Sums) -> FloatArray:
    """Return forces, moment and adhesion length as one array, shape (4, strips)."""
    out = np.empty((4, len(sums.force_x)))
    out[0], out[1], out[2], out[3] = sums.force_x, sums.force_y, sums.moment, sums.adhesion
    return out


@subroutine
def clear(strips: int, sums: Sums) -> None:
    """Set the sums and tractions of the first strips to zero, as at the leading edge.

    Parameters
    ----------
    strips : int
        Number of strips.
    sums : Sums
        Overwritten.
    """
    for j in range(strips):
        sums.force_x[j] = sums.force_y[j] = sums.moment[j] = 0.0
        sums.adhesion[j] = sums.work[j] = 0.0
        sums.traction_x[j] = sums.traction_y[j] = 0.0


@subroutine
def _times_step(strips: int, sums: Sums, half_length: FloatArray, cell: float) -> None:
    """Multiply the sums over points of the first strips by the step, to obtain integrals."""
    for j in range(strips):
        dx = cell * half_length[j]
        sums.force_x[j] *= dx
        sums.force_y[j] *= dx
        sums.moment[j] *= dx * half_length[j]
        sums.adhesion[j] *= dx


@subroutine
def march_into(
    strips: int,
    half_length: FloatArray,
    bound_peak: FloatArray,
    elliptic: bool,
    gradient_x: FloatArray,
    gradient_y: float,
    gradient_spin: float,
    points: int,
    sums: Sums,
) -> None:
    """Integrate as `march` does, into an existing `Sums`.

    Parameters
    ----------
    strips : int
        Number of strips to integrate, the first ones; a multiple of four is fastest.
    half_length, bound_peak, elliptic, gradient_x, gradient_y, gradient_spin, points
        As in `march`.
    sums : Sums
        Overwritten.
    """
    clear(strips, sums)
    cell = 2.0 / points
    for k in range(1, points + 1):
        place = place_of(k, points)
        shape = bound_shape(place, elliptic)
        sticking, sliding = end_weights(k, points, elliptic)
        for j in range(strips):
            a, bound = half_length[j], shape * bound_peak[j]
            across = gradient_y + gradient_spin * (place + 0.5 * cell) * a
            _step(j, place, cell * a, gradient_x[j], across, bound, sticking, sliding, sums)
    _times_step(strips, sums, half_length, cell)


@inlined_subroutine
def _step(
    j: int,
    place: float,
    dx: float,
    along: float,
    across: float,
    bound: float,
    sticking: float,
    sliding: float,
    sums: Sums,
) -> tuple[float, float, float]:
    """Advance strip `j` by one step; return the trial tractions and their scale factor.

    Parameters
    ----------
    j : int
        Number of the strip.
    place, dx : float
        x/a at the end of the step, and its length [m].
    along, across : float
        Gradients of the tractions over the step [Pa/m].
    bound : float
        Traction bound at the end of the step [Pa].
    sticking, sliding : float
        Weight of the point in the sums in adhesion and in slip.
    sums : Sums
        Updated, except for the work.
    """
    tx = sums.traction_x[j] - along * dx
    ty = sums.traction_y[j] - across * dx
    sticks, scale = limit_traction(tx, ty, bound)
    sums.traction_x[j] = scale * tx
    sums.traction_y[j] = scale * ty
    weighed = scale * (sticking if sticks else sliding)
    sums.force_x[j] += weighed * tx
    sums.force_y[j] += weighed * ty
    sums.moment[j] += place * (weighed * ty)
    sums.adhesion[j] += 1.0 if sticks else 0.0
    return tx, ty, scale


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


@inlined_subroutine
def limit_traction(traction_x: float, traction_y: float, bound: float) -> tuple[bool, float]:
    """Return whether the traction is within the bound, and the factor that scales it to the bound.

    Parameters
    ----------
    traction_x, traction_y, bound : float
        Trial traction and its bound [Pa].
    """
    square = traction_x * traction_x + traction_y * traction_y
    sticks = square <= bound * bound
    return sticks, 1.0 if sticks else bound / math.sqrt(square)


@subroutine
def march_local(
    strips: int,
    half_length: FloatArray,
    bound_peak: FloatArray,
    friction: FloatArray,
    first: int,
    elliptic: bool,
    gradient_x: FloatArray,
    gradient_y: float,
    gradient_spin: float,
    longitudinal: float,
    lateral: float,
    sums: Sums,
) -> None:
    """Integrate as `march` does with a friction coefficient that varies from point to point.

    Parameters
    ----------
    strips : int
        As in `march_into`.
    half_length, elliptic, gradient_x, gradient_y, gradient_spin
        As in `march`.
    bound_peak : ndarray, shape (strips,)
        Pressure of the traction bound at x = 0 [Pa], without friction.
    friction : ndarray, shape (points, all strips)
        Friction coefficient at the end of each step, from the leading edge on.
    first : int
        Column of `friction` of the first strip.
    longitudinal, lateral : float
        Flexibilities L1 and L2 [m/Pa], used for the element sum only.
    sums : Sums
        Overwritten; `work` is the element sum over the rolling velocity.
    """
    clear(strips, sums)
    points = len(friction)
    cell = 2.0 / points
    for k in range(1, points + 1):
        place = place_of(k, points)
        shape = bound_shape(place, elliptic)
        sticking, sliding = end_weights(k, points, elliptic)
        for j in range(strips):
            a, bound = half_length[j], shape * (friction[k - 1, first + j] * bound_peak[j])
            across = gradient_y + gradient_spin * (place + 0.5 * cell) * a
            tx, ty, scale = _step(
                j, place, cell * a, gradient_x[j], across, bound, sticking, sliding, sums
            )
            cut = scale * (1.0 - scale)
            sums.work[j] += cut * (longitudinal * tx * tx + lateral * ty * ty)
    _times_step(strips, sums, half_length, cell)

"""FASTSIM, Kalker's simplified theory of rolling contact, on strips of any shape."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from wearsim.mechanics.numerics.jit import inlined_kernel, kernel
from wearsim.types import FloatArray

_ROOT_CORNER = 0.2078862249773546  # -zeta(-1/2)


class Sums(NamedTuple):
    """What a march sums up in every strip, and the traction where it stands; all (strips,).

    Integrals of the longitudinal and the lateral traction [N/m] and of x times the latter [N],
    length in adhesion [m], the element sum over V [N/m] and the tractions [Pa].
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
    """March the traction from the leading to the trailing edge of every strip at once.

    A step of dx adds -gradient dx to the traction; where that exceeds the bound at the new point
    the traction is scaled back to it. Sums over the points are trapezoidal, corrected at both
    edges, where the traction vanishes (`end_weights`); the work of the rigid slip follows from
    them without an error of its own. It is second order in dx: what is left comes from where a
    strip begins to slide, with either sign, and averages out over strips.

    Parameters
    ----------
    half_length : ndarray, shape (strips,)
        a(y) [m]; strips with a = 0 get zeros.
    bound_peak : ndarray, shape (strips,)
        Friction times the traction bound's pressure at x = 0 [Pa].
    elliptic : bool
        Whether the bound along the strip is sqrt(1 - x^2/a^2) rather than 1 - x^2/a^2.
    gradient_x : ndarray, shape (strips,)
        Rise of the longitudinal traction in adhesion, xi/L1 and spin's part over L3 [Pa/m].
    gradient_y, gradient_spin : float
        The same for the lateral traction, eta/L2 [Pa/m], and phi/L3 [Pa/m^2], which multiplies x.
    points : int
        Steps mx along each strip.

    Returns
    -------
    ndarray, shape (4, strips)
        Integral of the longitudinal and of the lateral traction [N/m], integral of x times the
        lateral traction [N], and length in adhesion [m].

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


@kernel
def new_sums(strips: int) -> Sums:
    """Return room for what the march of so many strips sums up.

    Parameters
    ----------
    strips : int
        Number of strips.
    """
    rows = np.zeros((7, strips))
    return Sums(rows[0], rows[1], rows[2], rows[3], rows[4], rows[5], rows[6])


@kernel
def slice_sums(sums: Sums, first: int, stop: int) -> Sums:
    """Return the room of the strips from `first` to before `stop`.

    Parameters
    ----------
    sums : Sums
        The room of all strips.
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


@kernel
def stack_sums(sums: Sums) -> FloatArray:
    """Return the first four of the sums as one array, shape (4, strips)."""
    out = np.empty((4, len(sums.force_x)))
    out[0], out[1], out[2], out[3] = sums.force_x, sums.force_y, sums.moment, sums.adhesion
    return out


@kernel
def clear(strips: int, sums: Sums) -> None:
    """Set the sums of the first strips to zero, as at the leading edge.

    Parameters
    ----------
    strips : int
        How many.
    sums : Sums
        Overwritten.
    """
    for j in range(strips):
        sums.force_x[j] = sums.force_y[j] = sums.moment[j] = 0.0
        sums.adhesion[j] = sums.work[j] = 0.0
        sums.traction_x[j] = sums.traction_y[j] = 0.0


@kernel
def _times_step(strips: int, sums: Sums, half_length: FloatArray, cell: float) -> None:
    """Turn sums over the points into integrals along the first strips."""
    for j in range(strips):
        dx = cell * half_length[j]
        sums.force_x[j] *= dx
        sums.force_y[j] *= dx
        sums.moment[j] *= dx * half_length[j]
        sums.adhesion[j] *= dx


@kernel
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
    """March as `march` does, into room that is there already.

    Parameters
    ----------
    strips : int
        How many of the strips to march through, the first ones; four at a time go fastest.
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
            a = half_length[j]
            across = gradient_y + gradient_spin * (place + 0.5 * cell) * a
            bound = shape * bound_peak[j]
            _step(j, place, cell * a, gradient_x[j], across, bound, sticking, sliding, sums)
    _times_step(strips, sums, half_length, cell)


@inlined_kernel
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
    """Take strip `j` a step on; return the trial tractions and the factor that held them.

    Parameters
    ----------
    j : int
        Number of the strip.
    place, dx : float
        x/a where the step ends, and its length [m].
    along, across : float
        Rise of the tractions over the step [Pa/m].
    bound : float
        Traction bound where the step ends [Pa].
    sticking, sliding : float
        What the point weighs in the sums, as it adheres or slides.
    sums : Sums
        Brought up to date, but for the work.
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


@kernel
def place_of(step: int, points: int) -> float:
    """Return x/a where a step ends, from just behind the leading edge to -1.

    Parameters
    ----------
    step, points : int
        Number of the step, from 1 on, and steps mx along the strip.
    """
    return 1.0 - 2.0 / points * step if step < points else -1.0


@kernel
def end_weights(step: int, points: int, elliptic: bool) -> tuple[float, float]:
    """Return what the traction where a step ends weighs in the sums, as it adheres or slides.

    One everywhere but next to the edges. There the trapezoidal rule cuts a corner, which Euler and
    Maclaurin give back: h/12 of the first value of a traction that rises evenly, or along the
    parabola, and -zeta(-1/2) h of one that rises as a root.

    Parameters
    ----------
    step, points : int
        Number of the step, from 1 on, and steps mx along the strip.
    elliptic : bool
        As in `march`.
    """
    sticking = sliding = 1.0
    inner = points / max(points - 1.0, 1.0)  # the bound's rise at the edge, over that of its chord
    corner = _ROOT_CORNER * math.sqrt(inner) if elliptic else inner / 12.0
    if step == 1:
        sticking += 1.0 / 12.0
        sliding += corner
    if step == points - 1:
        sticking += corner
        sliding += corner
    return sticking, sliding


@kernel
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


@inlined_kernel
def limit_traction(traction_x: float, traction_y: float, bound: float) -> tuple[bool, float]:
    """Return whether the traction keeps to the bound, and the factor that holds it there.

    Parameters
    ----------
    traction_x, traction_y, bound : float
        Trial traction and its bound [Pa].
    """
    square = traction_x * traction_x + traction_y * traction_y
    sticks = square <= bound * bound
    return sticks, 1.0 if sticks else bound / math.sqrt(square)


@kernel
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
    """March as `march` does under friction that differs from point to point.

    Parameters
    ----------
    strips : int
        As in `march_into`.
    half_length, elliptic, gradient_x, gradient_y, gradient_spin
        As in `march`.
    bound_peak : ndarray, shape (strips,)
        The traction bound's pressure at x = 0 [Pa], without friction.
    friction : ndarray, shape (points, all strips)
        Friction coefficient where each step ends, from the leading edge on.
    first : int
        Where in `friction` the strips begin.
    longitudinal, lateral : float
        Flexibilities L1 and L2 [m/Pa], for the element sum alone.
    sums : Sums
        Overwritten; `work` is the textbook's element sum over the rolling velocity.
    """
    clear(strips, sums)
    points = len(friction)
    cell = 2.0 / points
    for k in range(1, points + 1):
        place = place_of(k, points)
        shape = bound_shape(place, elliptic)
        sticking, sliding = end_weights(k, points, elliptic)
        for j in range(strips):
            a = half_length[j]
            across = gradient_y + gradient_spin * (place + 0.5 * cell) * a
            bound = shape * (friction[k - 1, first + j] * bound_peak[j])
            tx, ty, scale = _step(
                j, place, cell * a, gradient_x[j], across, bound, sticking, sliding, sums
            )
            cut = scale * (1.0 - scale)
            sums.work[j] += cut * (longitudinal * tx * tx + lateral * ty * ty)
    _times_step(strips, sums, half_length, cell)

"""Hertz patches of a batch of gaps, and the strips that each patch covers."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from wearsim.mechanics.hertz.ellipse import ellipse_shape, ellipse_under, prescribed_ellipse
from wearsim.mechanics.hertz.parabola_fit import (
    CONVERGED,
    LEAVES_STRIPS,
    NO_CURVATURE,
    TOO_FEW_STRIPS,
    fit_centred,
    fit_parabola,
    hertz_on_profile,
    is_parabola,
    strips_within,
)
from wearsim.mechanics.numerics.jit import kernel, subroutine
from wearsim.types import FloatArray, IntArray

NO_GAP, NO_LOAD = 20, 21  # statuses in addition to those of `parabola_fit`

_INSIDE = 1.0 - 1e-9  # of the half-width: the patch may end exactly at the edge of the grid


class Bodies(NamedTuple):
    """Constants of a batch of contacts.

    Positions of the strips (strips,) and their width [m], A (contacts,) [1/m], E* [Pa], semi-axes
    of a prescribed patch [m], 0 for the Hertz ellipse, tolerance and iteration limit of the fit.
    """

    y: FloatArray
    spacing: float
    curvature_x: FloatArray
    contact_modulus: float
    given_a: float
    given_b: float
    tolerance: float
    limit: int


class Patches(NamedTuple):
    """Patches of a batch of contacts, all (contacts,): lengths [m], p0 [Pa] and a/b.

    Patches of the same shape have bitwise equal a/b, independent of their size.
    """

    a: FloatArray
    b: FloatArray
    ratio: FloatArray
    peak_pressure: FloatArray
    approach: FloatArray
    centre: FloatArray
    iterations: IntArray
    status: IntArray


@kernel
def fit_within(
    y: FloatArray, gap: FloatArray, spacing: float, tolerance: float
) -> tuple[float, float, float, float, int]:
    """Fit a parabola over the widest section that is symmetric about its vertex.

    Parameters
    ----------
    y, gap : ndarray, shape (strips,)
        Position and gap [m].
    spacing, tolerance : float
        Width of a strip [m]; greatest shift of the centre over the half-width.

    Returns
    -------
    curvature, centre, height, half_width : float
        B [1/m], yc [m], the fitted gap there and the half-width of the section [m].
    status : int
        As of `hertz_on_profile`.
    """
    middle, span = 0.5 * (y[0] + y[-1]), 0.5 * spacing * len(y)
    _, vertex, _, used = fit_parabola(y, gap, middle, span)
    if not abs(vertex - middle) < span:  # nan where there is no vertex
        return math.nan, middle, math.nan, span, TOO_FEW_STRIPS if used < 3 else NO_CURVATURE
    span -= abs(vertex - middle)
    curvature, centre, height, status = fit_centred(y, gap, vertex, span, tolerance)
    return curvature, centre, height, span, status


@kernel
def find_patches(
    bodies: Bodies, gaps: FloatArray, row: IntArray, normal_force: FloatArray, patches: Patches
) -> None:
    """Find the patch of every contact as `hertz_on_profile` and `hertz` do.

    Successive contacts with the same gap share its fit if the gap is a parabola, and those with the
    same curvatures share the shape of their ellipse and differ in its size only.

    Parameters
    ----------
    bodies : Bodies
        Constants of the contacts.
    gaps : ndarray, shape (rows, strips)
        Gaps [m].
    row : ndarray of int, shape (contacts,)
        The row of each contact's gap.
    normal_force : ndarray, shape (contacts,)
        N [N].
    patches : Patches
        Overwritten.
    """
    y, modulus = bodies.y, bodies.contact_modulus
    middle = 0.5 * (y[0] + y[-1])
    width = 0.5 * (y[-1] - y[0]) * len(y) / max(len(y) - 1, 1)
    given = bodies.given_a > 0.0
    first_edge, last_edge = y[0] - 0.5 * bodies.spacing, y[-1] + 0.5 * bodies.spacing
    fitted, exact, fit_status = -1, False, CONVERGED
    fit_curvature, vertex, bottom = math.nan, math.nan, math.nan
    shaped, shaped_x, shape = math.nan, math.nan, (math.nan, math.nan, math.nan)
    for k in range(len(row)):
        gap, force, curvature_x = gaps[row[k]], normal_force[k], bodies.curvature_x[k]
        if row[k] != fitted:
            fitted = row[k]
            if not np.isfinite(gap).all():
                exact, fit_status = False, NO_GAP
            elif given:
                fit_curvature, vertex, bottom, _, fit_status = fit_within(
                    y, gap, bodies.spacing, bodies.tolerance
                )
            else:
                fit = fit_centred(y, gap, middle, width, 10.0 * bodies.tolerance)
                fit_curvature, vertex, bottom = fit[0], fit[1], fit[2]
                exact = fit[3] == CONVERGED and is_parabola(y, gap, fit_curvature, vertex, bottom)
                fit_status = CONVERGED
        status = fit_status if 0.0 < force < math.inf else NO_LOAD
        patches.status[k], patches.iterations[k] = status, 0
        if status != CONVERGED:
            continue
        centre, height = vertex, bottom
        if given:
            a, b = bodies.given_a, bodies.given_b
            peak, approach = prescribed_ellipse(a, b, force, modulus)
            ratio = a / b
        else:
            solved, curvature, iterations = False, fit_curvature, 1
            a = b = peak = approach = math.nan
            if exact:
                if curvature != shaped or curvature_x != shaped_x:
                    shape = ellipse_shape(curvature_x, curvature)
                    shaped, shaped_x = curvature, curvature_x
                a, b, peak, approach = ellipse_under(curvature_x, curvature, shape, force, modulus)
                solved = b <= width and strips_within(y, centre, b) >= 3
            if not solved:
                curvature, b, centre, height, iterations, status = hertz_on_profile(
                    y, gap, curvature_x, force, modulus, bodies.tolerance, bodies.limit
                )
                if status == CONVERGED:
                    if curvature != shaped or curvature_x != shaped_x:
                        shape = ellipse_shape(curvature_x, curvature)
                        shaped, shaped_x = curvature, curvature_x
                    a, b, peak, approach = ellipse_under(
                        curvature_x, curvature, shape, force, modulus
                    )
            patches.iterations[k] = iterations
            ratio = 1.0 / shape[0] if curvature_x <= curvature else shape[0]
        reach = _INSIDE * b
        if status == CONVERGED and (centre - reach < first_edge or centre + reach > last_edge):
            status = LEAVES_STRIPS
        patches.status[k] = status
        patches.a[k], patches.b[k], patches.ratio[k] = a, b, ratio
        patches.peak_pressure[k], patches.approach[k] = peak, approach + height
        patches.centre[k] = centre


@subroutine
def cut_into_strips(
    bodies: Bodies,
    a: float,
    b: float,
    centre: float,
    normal_force: float,
    half_length: FloatArray,
    line_load: FloatArray,
    middle: FloatArray,
    coverage: FloatArray,
) -> tuple[int, int]:
    """Fill half-length, line load and coverage of the strips of one patch.

    Parameters
    ----------
    bodies : Bodies
        The strips.
    a, b, centre, normal_force : float
        Semi-axes and centre of the patch [m], and its load [N].
    half_length, line_load, middle, coverage : ndarray, shape (strips,)
        Overwritten: a(y) at the middle of the covered part [m], mean of q(y) over the strip [N/m],
        distance of that middle from the centre [m] and the covered fraction of the strip.

    Returns
    -------
    first, stop : int
        The first strip in contact, and the one after the last.
    """
    y, spacing, strips = bodies.y, bodies.spacing, len(bodies.y)
    first, stop = strips, 0
    lower = y[0] - 0.5 * spacing - centre
    for j in range(strips):
        upper = (y[j + 1] - 0.5 * spacing if j + 1 < strips else y[j] + 0.5 * spacing) - centre
        inner_low, inner_high = min(max(lower, -b), b), min(max(upper, -b), b)
        middle[j] = 0.5 * (inner_high + inner_low)
        coverage[j] = min((inner_high - inner_low) / spacing, 1.0)
        t = middle[j] / b
        section = max((1.0 - t) * (1.0 + t), 0.0)
        half_length[j] = a * math.sqrt(section) if coverage[j] > 0.0 else 0.0
        low, high = min(max(lower / b, -1.0), 1.0), min(max(upper / b, -1.0), 1.0)
        below = 0.25 * normal_force * (1.0 + low) ** 2 * (2.0 - low)
        above = 0.25 * normal_force * (1.0 + high) ** 2 * (2.0 - high)
        line_load[j] = (above - below) / spacing
        lower = upper
        if half_length[j] > 0.0:
            first, stop = min(first, j), j + 1
    return first, stop


@kernel
def half_lengths(bodies: Bodies, patches: Patches, normal_force: FloatArray) -> FloatArray:
    """Return the half-lengths of every contact's strips.

    Parameters
    ----------
    bodies, patches : Bodies, Patches
        As for `find_patches`, which fills the patches.
    normal_force : ndarray, shape (contacts,)
        N [N].

    Returns
    -------
    ndarray, shape (contacts, strips)
        a(y) [m]; 0 outside the contact.
    """
    strips = len(bodies.y)
    out = np.zeros((len(normal_force), strips))
    line_load, middle, coverage = np.empty(strips), np.empty(strips), np.empty(strips)
    for k in range(len(normal_force)):
        if patches.status[k] == CONVERGED:
            cut_into_strips(
                bodies,
                patches.a[k],
                patches.b[k],
                patches.centre[k],
                normal_force[k],
                out[k],
                line_load,
                middle,
                coverage,
            )
    return out

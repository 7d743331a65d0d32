"""Semi-Hertzian contact of strips: Kik-Piotrowski, Ayasse-Chollet (STRIPES) and ANALYN.

Each method is a foundation of springs. Strip i has the line load ``q_i = k_i (H_i - z_i)``, where z
is the gap and H_i the level below which the strip is in contact (`contact_levels`), and the
half-length ``a_i = sqrt(l_i (H_i - z_i))``. The methods differ in the stiffness k, in l, and in the
fraction of the bodies' overlap that remains after deformation:

=============== ======================== ====== =======================
                k                        l      fraction of the overlap
=============== ======================== ====== =======================
Kik-Piotrowski  equal for all strips     2/kx   0.55
Ayasse-Chollet  Hertz, local curvature   Hertz  Hertz, first contact
ANALYN          Hertz, local curvature   Hertz  Hertz, strip by strip
=============== ======================== ====== =======================

For the Hertz ellipse of the curvatures A and B, with semi-axes a and b, approach d and pressure p0,
these are ``k = pi p0 a/(2 B b^2)``, ``l = a^2/(B b^2)`` and ``B b^2/d``: functions of B/A, scaled
by E* and 1/A.
"""

from __future__ import annotations

from functools import cache
from math import pi

import numpy as np

from wearsim.mechanics.hertz.ellipse import hertz
from wearsim.mechanics.hertz.parabola_fit import NO_MOMENTS, add_moments
from wearsim.mechanics.numerics.jit import kernel, subroutine
from wearsim.mechanics.semi_hertzian.penetration import (
    CONVERGED,
    NO_CONVERGENCE,
    NOT_FINITE,
    first_contacts,
    solve_foundation,
    solve_virtual_penetration,
)
from wearsim.types import FloatArray

KIK_PIOTROWSKI, AYASSE_CHOLLET, ANALYN = range(3)

FLATTEST, SHARPEST = -20.0, 10.0  # range of ln(B/A) of the table

STEP = 1.0 / 32.0

LIMIT, UNDAMPED = 200, 12  # iterations, and those without damping

TOLERANCE = 1e-11  # of the approach: change of the gap in an iteration


@cache
def local_hertz_table() -> FloatArray:
    """Tabulate the foundation of Hertz at ln(B/A) = FLATTEST, FLATTEST + STEP, ..., SHARPEST.

    Returns
    -------
    ndarray, shape (nodes, 3)
        ln of k/E*, ln of l A, and the fraction of the overlap B b^2/d.
    """
    rows = []
    for ratio in np.exp(np.arange(FLATTEST, SHARPEST + 0.5 * STEP, STEP)):
        patch = hertz(1.0, float(ratio), 1.0, 1.0)
        rise = ratio * patch.b**2
        log_stiffness = np.log(0.5 * pi * patch.peak_pressure * patch.a / rise)
        rows.append((log_stiffness, np.log(patch.a**2 / rise), rise / patch.approach))
    table = np.array(rows)
    table.setflags(write=False)
    return table


@subroutine
def read_local_hertz(table: FloatArray, ratio: float) -> tuple[float, float, float]:
    """Return k/E*, l A and the fraction of the overlap for B/A = `ratio`, by cubic interpolation.

    Parameters
    ----------
    table : ndarray, shape (nodes, 3)
        From `local_hertz_table`.
    ratio : float
        B/A; values beyond the table are replaced by its end.
    """
    position = min(max((np.log(ratio) - FLATTEST) / STEP, 0.0), table.shape[0] - 1.0)
    node = min(max(int(position), 1), table.shape[0] - 3)
    s = position - node
    before = -s * (s - 1.0) * (s - 2.0) / 6.0
    here = (s + 1.0) * (s - 1.0) * (s - 2.0) / 2.0
    after = -(s + 1.0) * s * (s - 2.0) / 2.0
    beyond = (s + 1.0) * s * (s - 1.0) / 6.0
    first, second, third, fourth = table[node - 1], table[node], table[node + 1], table[node + 2]
    stiffness = before * first[0] + here * second[0] + after * third[0] + beyond * fourth[0]
    length = before * first[1] + here * second[1] + after * third[1] + beyond * fourth[1]
    part = before * first[2] + here * second[2] + after * third[2] + beyond * fourth[2]
    return np.exp(stiffness), np.exp(length), part


@kernel
def solve_semi_hertzian(
    variant: int,
    gap: FloatArray,
    compliance: FloatArray,
    normal_force: float,
    spacing: float,
    contact_modulus: float,
    longitudinal_curvature: float,
    influence: FloatArray,
    local_hertz: FloatArray,
    line_load: FloatArray,
    half_length: FloatArray,
) -> tuple[int, int, float]:
    """Solve a normal contact with wear compliance.

    Curvatures and first contact points are those of the gap including wear,
    `gap + compliance line_load`, which is found by fixed-point iteration; every iterate carries the
    load. After `UNDAMPED` iterations the change of the gap is halved.

    Parameters
    ----------
    variant : int
        `KIK_PIOTROWSKI`, `AYASSE_CHOLLET` or `ANALYN`.
    gap, compliance : ndarray, shape (strips,)
        Gap [m], and wear compliance [m/(N/m)].
    normal_force, spacing, contact_modulus, longitudinal_curvature : float
        N [N], strip width [m], E* [Pa], relative curvature along rolling [1/m].
    influence : ndarray, shape (nodes, 2, strips)
        From `influence_table`.
    local_hertz : ndarray, shape (nodes, 3)
        From `local_hertz_table`.
    line_load, half_length : ndarray, shape (strips,)
        Filled: q [N/m], a [m].

    Returns
    -------
    status, iterations : int
        `CONVERGED`, `TOO_FINE`, `NO_CONVERGENCE` or `NOT_FINITE`; iterations.
    approach : float
        Approach from gap zero [m].

    Notes
    -----
    Piotrowski and Kik (2008), DOI 10.1080/00423110701586444; Ayasse and Chollet (2005),
    DOI 10.1080/00423110412331327193; Sichani, Enblom and Berg (2014),
    DOI 10.1080/00423114.2014.961932.
    """
    n = len(gap)
    places = np.empty((n, 2), dtype=np.int64)
    opened, depth, curvature = gap.copy(), np.empty(n), np.empty(n)
    stiffness, length, reach = np.empty(n), np.empty(n), np.empty(n)
    level, slope = np.empty(n), np.empty(n)
    load, wears, total = normal_force / spacing, False, 0.0
    for i in range(n):
        wears = wears or compliance[i] != 0.0
        total += abs(gap[i]) + abs(compliance[i])
    if not (total < np.inf and 0.0 < load < np.inf):
        return NOT_FINITE, 0, np.nan
    approach, rigid = 0.0, np.nan
    for iteration in range(1, LIMIT + 1):
        count = first_contacts(opened, places)
        status, approach, scale = solve_virtual_penetration(
            opened,
            places,
            count,
            load,
            approach,
            spacing,
            contact_modulus,
            longitudinal_curvature,
            influence,
            reach,
            level,
            slope,
            depth,
        )
        if status != CONVERGED:
            return status, iteration, rigid
        if variant == KIK_PIOTROWSKI:
            stiffness[:] = scale
            length[:] = 2.0 / longitudinal_curvature
        else:
            smoothed_curvature(opened, depth, approach, spacing, curvature)
            for i in range(n):
                ratio = 2.0 * curvature[i] / longitudinal_curvature
                spring, square, reach[i] = read_local_hertz(local_hertz, ratio)
                stiffness[i] = contact_modulus * spring
                length[i] = 2.0 * square / longitudinal_curvature
        if not rigid > opened.min():
            rigid = opened.min() + approach
        rigid = solve_foundation(
            gap,
            opened,
            compliance,
            stiffness,
            reach,
            variant == ANALYN,
            places,
            count,
            load,
            rigid,
            level,
            slope,
            line_load,
        )
        change = 0.0
        for i in range(n):
            worn = gap[i] + compliance[i] * line_load[i]
            change = max(change, abs(worn - opened[i]))
            opened[i] += (1.0 if iteration <= UNDAMPED else 0.5) * (worn - opened[i])
        if not change < np.inf or not rigid < np.inf:
            return NOT_FINITE, iteration, rigid
        if not wears or change <= TOLERANCE * approach:
            for i in range(n):
                half_length[i] = np.sqrt(length[i] * line_load[i] / stiffness[i])
            return CONVERGED, iteration, rigid
    return NO_CONVERGENCE, LIMIT, rigid


DEPTH = 1.5  # approaches: height above the lowest gap up to which the parabola is fitted

LEAST, GREATEST = 0.125, 100.0  # bounds of the curvature, over that of `patch_curvature`

SINGULAR = 1e-9  # of the first term of the determinant: too few strips for a parabola


@subroutine
def patch_curvature(depth: FloatArray, spacing: float) -> tuple[float, float]:
    """Return half-width and curvature of the parabola equivalent to the depth of a contact.

    A parabolic depth of half-width b has the same ratio of squared sum to sum of squares:
    b = 0.6 (sum of depth)^2/(sum of depth^2) in strips. b does not depend on the edges of the
    contact, is a smooth function of the gap, and is twice as large for two equal patches.

    Parameters
    ----------
    depth : ndarray, shape (strips,)
        Depth of penetration [m].
    spacing : float
        Width of a strip [m].

    Returns
    -------
    half_width, curvature : float
        b [m] and (greatest depth)/b^2 [1/m].
    """
    total, square, deepest = 0.0, 0.0, 0.0
    for i in range(len(depth)):
        total += depth[i]
        square += depth[i] * depth[i]
        deepest = max(deepest, depth[i])
    half_width = 0.6 * spacing * total * total / square
    return half_width, deepest / half_width**2


@subroutine
def curvature_at(
    gap: FloatArray, i: int, bottom: float, limit: float, window: float, spacing: float
) -> float:
    """Return B at strip i by least squares; nan if there are too few strips for a parabola.

    Each strip of the window has the weight 1 - (distance/window)^2 times the depth of the highest
    gap between it and strip i below `bottom + limit`.

    Parameters
    ----------
    gap : ndarray, shape (strips,)
        Gap [m].
    i : int
        Number of the strip.
    bottom, limit : float
        Lowest gap, and height above it up to which the gap is fitted [m].
    window, spacing : float
        Half-width of the window, and width of a strip [m].
    """
    n = len(gap)
    moments, share = NO_MOMENTS, spacing / window
    for side in range(2):
        step = 2 * side - 1
        ridge, t, j = gap[i] - bottom, 0.0, i
        while 0 <= j < n and ridge < limit and t * t < 1.0:
            height = gap[j] - bottom
            ridge = max(ridge, height)
            weight = (1.0 - t * t) * max(limit - ridge, 0.0)
            if j == i:
                weight *= 0.5  # visited from both sides
            moments = add_moments(moments, weight, t, height)
            t += step * share
            j += step
    m0, m1, m2, m3, m4, s0, s1, s2 = moments
    det = m0 * (m2 * m4 - m3 * m3) - m1 * (m1 * m4 - m2 * m3) + m2 * (m1 * m3 - m2 * m2)
    if not det > SINGULAR * (m0 * m2 * m4):
        return np.nan
    square = m0 * (m2 * s2 - m3 * s1) - m1 * (m1 * s2 - m2 * s1) + s0 * (m1 * m3 - m2 * m2)
    return square / det / window**2


@subroutine
def smoothed_curvature(
    gap: FloatArray, depth: FloatArray, approach: float, spacing: float, curvature: FloatArray
) -> None:
    """Fill the lateral curvature B [1/m] of a gap, smoothed over the size of the contact.

    At every strip a parabola is fitted to the gap over the half-width of the contact on either side
    (`patch_curvature`), up to the height of 1.5 approaches and not beyond ridges. B is limited to
    the range from B_p/8 to 100 B_p, with the curvature B_p of the equivalent parabola: below the
    lower bound a section is effectively flat over the patch.

    Parameters
    ----------
    gap, depth : ndarray, shape (strips,)
        Gap, and depth of a virtual penetration [m].
    approach, spacing : float
        Its approach, and width of a strip [m].
    curvature : ndarray, shape (strips,)
        Filled: B [1/m].
    """
    window, typical = patch_curvature(depth, spacing)
    bottom, limit = gap.min(), DEPTH * approach
    for i in range(len(gap)):
        fitted = np.nan
        if gap[i] - bottom < limit:
            fitted = curvature_at(gap, i, bottom, limit, window, spacing)
        if np.isnan(fitted):
            fitted = typical
        curvature[i] = min(max(fitted, LEAST * typical), GREATEST * typical)

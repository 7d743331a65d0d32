"""The one rule that smooths the lateral curvature of a gap, worn or measured."""

from __future__ import annotations

import numpy as np

from wearsim.mechanics.jit import kernel
from wearsim.types import FloatArray

SEEN = 1.5  # approaches: how deep into the gap the curvature is taken from
LEAST, GREATEST = 0.125, 100.0  # of the curvature that is as deep at the patch's half-width as it
SINGULAR = 1e-9  # of the determinant's first term: too few strips to tell a parabola


@kernel
def patch_curvature(depth: FloatArray, spacing: float) -> tuple[float, float]:
    """Return half-width and curvature of the parabola that is as deep and wide as a contact.

    The half-width b is that of the parabolic depth whose mean square, weighted by depth, is the
    contact's: 0.6 (sum of depth)^2/(sum of depth^2) in strips. It knows no edges and changes
    smoothly, and two patches alike have the half-width of one of them, twice.

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


@kernel
def curvature_at(
    gap: FloatArray, i: int, bottom: float, seen: float, window: float, spacing: float
) -> float:
    """Return B at strip i by least squares; nan where there are too few strips for a parabola.

    Each strip of the window counts by 1 - (distance/window)^2, and by how far the highest gap on
    the way to it lies below `bottom + seen`.

    Parameters
    ----------
    gap : ndarray, shape (strips,)
        Gap [m].
    i : int
        The strip.
    bottom, seen : float
        Lowest gap, and how far above it the gap counts [m].
    window, spacing : float
        Half-width of the window, and width of a strip [m].
    """
    n = len(gap)
    m0 = m1 = m2 = m3 = m4 = 0.0
    s0 = s1 = s2 = 0.0
    share = spacing / window
    for side in range(2):
        step = 2 * side - 1
        ridge, t, j = gap[i] - bottom, 0.0, i
        while 0 <= j < n and ridge < seen and t * t < 1.0:
            height = gap[j] - bottom
            ridge = max(ridge, height)
            weight = (1.0 - t * t) * max(seen - ridge, 0.0)
            if j == i:
                weight *= 0.5  # comes from either side
            first, second = weight * t, weight * t * t
            m0 += weight
            m1 += first
            m2 += second
            m3 += second * t
            m4 += second * t * t
            s0 += weight * height
            s1 += first * height
            s2 += second * height
            t += step * share
            j += step
    whole = m0 * m2 * m4
    det = m0 * (m2 * m4 - m3 * m3) - m1 * (m1 * m4 - m2 * m3) + m2 * (m1 * m3 - m2 * m2)
    if not det > SINGULAR * whole:
        return np.nan
    square = m0 * (m2 * s2 - m3 * s1) - m1 * (m1 * s2 - m2 * s1) + s0 * (m1 * m3 - m2 * m2)
    return square / det / window**2


@kernel
def smoothed_curvature(
    gap: FloatArray, depth: FloatArray, approach: float, spacing: float, curvature: FloatArray
) -> None:
    """Fill the lateral curvature B [1/m] that a gap has, as contact feels it.

    At every strip a parabola is fitted to the gap over the half-width of the contact to either
    side (`patch_curvature`), as deep as 1.5 approaches and no further than ridges let one see.
    With B_p the curvature of a parabola as deep at its edge as the contact, B is held between
    B_p/8, below which a stretch is as flat as the patch can tell, and 100 B_p.

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
    bottom, seen = gap.min(), SEEN * approach
    for i in range(len(gap)):
        found = typical
        if gap[i] - bottom < seen:
            found = curvature_at(gap, i, bottom, seen, window, spacing)
            if np.isnan(found):
                found = typical
        curvature[i] = min(max(found, LEAST * typical), GREATEST * typical)

"""How high contact reaches in a gap with one or several first contact points."""

from __future__ import annotations

import numpy as np

from wearsim.mechanics.numerics.jit import kernel
from wearsim.types import FloatArray, IntArray

ROUNDS = 200  # of Newton and bisection together
TOLERANCE = 1e-14  # of the load


@kernel
def first_contacts(gap: FloatArray, places: IntArray) -> int:
    """Find the minima of a gap: where the bodies would touch first if they were brought together.

    Parameters
    ----------
    gap : ndarray, shape (strips,)
        Gap [m].
    places : ndarray of int, shape (strips, 2)
        Filled: the strips on both sides of the middle of each minimum, the same strip twice where
        the minimum is an odd number of strips wide.

    Returns
    -------
    int
        Number of minima.
    """
    n, count, start, falling = len(gap), 0, 0, True
    for i in range(n):
        if i > 0 and gap[i] != gap[i - 1]:
            start, falling = i, gap[i] < gap[i - 1]
        if falling and (i == n - 1 or gap[i + 1] > gap[i]):
            places[count, 0], places[count, 1] = (start + i) // 2, (start + i + 1) // 2
            count += 1
    return count


@kernel
def contact_levels(
    gap: FloatArray,
    places: IntArray,
    count: int,
    reach: FloatArray,
    own: bool,
    rigid: float,
    level: FloatArray,
    slope: FloatArray,
) -> None:
    """Fill the level of every strip: it is in contact if its gap lies below.

    Undeformed bodies brought together by a rigid motion overlap wherever the gap lies below
    `rigid`. Deformation leaves, about a first contact point of gap g, the part of that which lies
    below g + reach (rigid - g). Where there are several first contact points, the lowest such level
    holds; but one that comes from beyond a ridge is not lower than the ridge, so that contacts
    that are far apart do not know of each other, and those that grow together become one without
    a jump.

    Parameters
    ----------
    gap : ndarray, shape (strips,)
        Gap [m].
    places, count
        As `first_contacts` fills them.
    reach : ndarray, shape (strips,)
        Part of the overlap that deformation leaves.
    own : bool
        Whether a strip takes its own `reach`, or that of the first contact point.
    rigid : float
        Gap below which the undeformed bodies overlap [m].
    level, slope : ndarray, shape (strips,)
        Filled: level [m], and its rise with `rigid`.
    """
    n = len(gap)
    for i in range(n):
        level[i], slope[i] = rigid, 1.0
    for m in range(count):
        bottom = gap[places[m, 0]]
        part = 0.5 * (reach[places[m, 0]] + reach[places[m, 1]])
        if bottom >= rigid:
            continue
        for side in range(2):
            step = 2 * side - 1
            i, ridge = places[m, side], bottom
            while 0 <= i < n and ridge < rigid:
                here = reach[i] if own else part
                low = bottom + here * (rigid - bottom)
                if max(low, ridge) < level[i]:
                    level[i], slope[i] = max(low, ridge), here if low >= ridge else 0.0
                ridge = max(ridge, gap[i])
                i += step


@kernel
def solve_foundation(
    gap: FloatArray,
    opened: FloatArray,
    compliance: FloatArray,
    stiffness: FloatArray,
    reach: FloatArray,
    own: bool,
    places: IntArray,
    count: int,
    load: float,
    start: float,
    level: FloatArray,
    slope: FloatArray,
    line_load: FloatArray,
) -> float:
    """Press strips that are springs into contact, until they carry a load.

    Parameters
    ----------
    gap, opened : ndarray, shape (strips,)
        Gap without wear, and the gap with it in which contact reaches as high as `contact_levels`
        says [m].
    compliance, stiffness : ndarray, shape (strips,)
        Wear compliance [m/(N/m)], and line load per depth below the level [N/m^2].
    reach, own, places, count
        As for `contact_levels`.
    load : float
        Sum of the line loads [N/m].
    start : float
        A first guess of the answer [m].
    level, slope : ndarray, shape (strips,)
        Workspace.
    line_load : ndarray, shape (strips,)
        Filled: q [N/m].

    Returns
    -------
    float
        Gap below which the undeformed bodies overlap [m]; nan if there is none.
    """
    low, high, rigid = gap.min(), np.inf, start
    bottom = low
    for _ in range(ROUNDS):
        contact_levels(opened, places, count, reach, own, rigid, level, slope)
        total, rise = 0.0, 0.0
        for i in range(len(gap)):
            depth = level[i] - gap[i]
            line_load[i] = 0.0
            if depth > 0.0:
                spring = stiffness[i] / (1.0 + stiffness[i] * compliance[i])
                line_load[i] = spring * depth
                total += spring * depth
                rise += spring * slope[i]
        excess = total - load
        if abs(excess) <= TOLERANCE * load:
            return rigid
        if excess > 0.0:
            high = rigid
        else:
            low = rigid
        moved = rigid - excess / rise if rise > 0.0 else np.inf
        if not low < moved < high:
            moved = 0.5 * (low + high) if high < np.inf else low + 2.0 * (rigid - bottom)
        if moved == rigid:
            return rigid
        rigid = moved
    return np.nan

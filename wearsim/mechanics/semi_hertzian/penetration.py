"""Penetration of strips: contact levels, spring foundation and the method of Kik and Piotrowski."""

from __future__ import annotations

import numpy as np

from wearsim.mechanics.numerics.jit import subroutine
from wearsim.mechanics.slender.influence import HIGHEST, read_value
from wearsim.types import FloatArray, IntArray

OVERLAP = 0.55  # virtual penetration over the approach
MEAN_STIFFNESS = 0.5  # line load over depth and E*: typical value, except for short patches
TOUCHING = 0.05  # depth of a first contact point, over the mean depth of the contact
FOUNDATION_LIMIT = 200  # iterations of Newton's method and bisection together
APPROACH_LIMIT = 100
TOLERANCE = 1e-14  # of the load
CONVERGED, TOO_FINE, NO_CONVERGENCE, NOT_FINITE = range(4)


@subroutine
def first_contacts(gap: FloatArray, places: IntArray) -> int:
    """Find the minima of a gap, which are the possible first contact points of the bodies.

    Parameters
    ----------
    gap : ndarray, shape (strips,)
        Gap [m].
    places : ndarray of int, shape (strips, 2)
        Filled: the strips on both sides of the middle of each minimum, the same strip twice if the
        minimum is an odd number of strips wide.

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


@subroutine
def contact_levels(
    gap: FloatArray,
    places: IntArray,
    count: int,
    reach: FloatArray,
    local_reach: bool,
    rigid: float,
    level: FloatArray,
    slope: FloatArray,
) -> None:
    """Fill the level of every strip; a strip is in contact if its gap is below its level.

    Undeformed bodies brought together by a rigid motion overlap wherever the gap is below `rigid`.
    Deformation reduces the overlap around a first contact point of gap g to the part below
    g + reach (rigid - g). With several first contact points, the lowest of these levels applies. A
    level that originates beyond a ridge is at least the height of the ridge. Distant contacts are
    therefore independent, and contacts that grow together merge continuously.

    Parameters
    ----------
    gap : ndarray, shape (strips,)
        Gap [m].
    places, count
        As `first_contacts` fills them.
    reach : ndarray, shape (strips,)
        Fraction of the overlap that remains after deformation.
    local_reach : bool
        Whether a strip has its own `reach`, instead of that of the first contact point.
    rigid : float
        Gap below which the undeformed bodies overlap [m].
    level, slope : ndarray, shape (strips,)
        Filled: level [m], and its derivative by `rigid`.
    """
    n = len(gap)
    level[:], slope[:] = rigid, 1.0
    for m in range(count):
        bottom = gap[places[m, 0]]
        part = 0.5 * (reach[places[m, 0]] + reach[places[m, 1]])
        if bottom >= rigid:
            continue
        for side in range(2):
            step = 2 * side - 1
            i, ridge = places[m, side], bottom
            while 0 <= i < n and ridge < rigid:
                here = reach[i] if local_reach else part
                low = bottom + here * (rigid - bottom)
                if max(low, ridge) < level[i]:
                    level[i], slope[i] = max(low, ridge), here if low >= ridge else 0.0
                ridge = max(ridge, gap[i])
                i += step


@subroutine
def solve_foundation(
    gap: FloatArray,
    opened: FloatArray,
    compliance: FloatArray,
    stiffness: FloatArray,
    reach: FloatArray,
    local_reach: bool,
    places: IntArray,
    count: int,
    load: float,
    start: float,
    level: FloatArray,
    slope: FloatArray,
    line_load: FloatArray,
) -> float:
    """Solve the contact of a foundation of springs under a load.

    Parameters
    ----------
    gap, opened : ndarray, shape (strips,)
        Gap without wear, and the gap with wear for `contact_levels` [m].
    compliance, stiffness : ndarray, shape (strips,)
        Wear compliance [m/(N/m)], and line load per depth below the level [N/m^2].
    reach, local_reach, places, count
        As for `contact_levels`.
    load : float
        Sum of the line loads [N/m].
    start : float
        Initial value of the result [m].
    level, slope : ndarray, shape (strips,)
        Workspace.
    line_load : ndarray, shape (strips,)
        Filled: q [N/m].

    Returns
    -------
    float
        Gap below which the undeformed bodies overlap [m]; nan without convergence.
    """
    low, high, rigid = gap.min(), np.inf, start
    bottom = low
    for _ in range(FOUNDATION_LIMIT):
        contact_levels(opened, places, count, reach, local_reach, rigid, level, slope)
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
        low, high = (low, rigid) if excess > 0.0 else (rigid, high)
        moved = rigid - excess / rise if rise > 0.0 else np.inf
        if not low < moved < high:
            moved = 0.5 * (low + high) if high < np.inf else low + 2.0 * (rigid - bottom)
        if moved == rigid:
            return rigid
        rigid = moved
    return np.nan


@subroutine
def even_depth(gap: FloatArray, amount: float) -> float:
    """Return the height above the lowest gap [m] of the level with a given sum of depths.

    Parameters
    ----------
    gap : ndarray, shape (strips,)
        Gap [m].
    amount : float
        Sum over the strips of their depth below the level [m].
    """
    bottom, depth = gap.min(), amount / len(gap)
    for _ in range(len(gap) + 2):  # Newton's method is exact once the set of strips is correct
        total, below = 0.0, 0
        for i in range(len(gap)):
            if gap[i] - bottom < depth:
                total += depth - (gap[i] - bottom)
                below += 1
        if abs(total - amount) <= TOLERANCE * amount:
            break
        depth += (amount - total) / below
    return depth


@subroutine
def contact_places(
    gap: FloatArray, places: IntArray, count: int, depth: float, points: FloatArray
) -> int:
    """Find the first contact points, in strip widths from the first strip's centre.

    A first contact point is the mean position of the strips connected to a lowest strip by gaps
    below a level: the lowest point of a symmetric profile, the middle of a flat one. Strips are
    weighted by their depth below the level, so that the point is a smooth function of the gap.

    Parameters
    ----------
    gap : ndarray, shape (strips,)
        Gap [m].
    places, count
        From `first_contacts`.
    depth : float
        Height of the level above the lowest gap [m].
    points : ndarray, shape (strips,)
        Filled: the first contact points.

    Returns
    -------
    int
        Their number; several strips may be equally low.
    """
    bottom, number = gap.min(), 0
    for m in range(count):
        first, last = places[m, 0], places[m, 1]
        if gap[first] > bottom:
            continue
        total, moment = 0.0, 0.0
        for side in range(2):
            i = last if side else first
            ridge = bottom
            while 0 <= i < len(gap):
                ridge = max(ridge, gap[i])
                share = 1.0 - (ridge - bottom) / depth
                if not share > 0.0:
                    break
                weight = share * (0.5 if first == i == last else 1.0)  # visited from both sides
                total += weight
                moment += weight * (i - first)
                i += 2 * side - 1
        points[number] = first + moment / total
        number += 1
    return number


@subroutine
def displacement_at(
    place: float,
    depth: FloatArray,
    spacing: float,
    curvature: float,
    table: FloatArray,
) -> float:
    """Return the displacement at a point by the loaded strips, per stiffness over pi E* [m].

    Parameters
    ----------
    place : float
        Position in strip widths from the first strip's centre; linear between the strips.
    depth : ndarray, shape (strips,)
        Depth of the strips below their level [m].
    spacing, curvature : float
        Strip width [m], relative curvature along rolling [1/m].
    table : ndarray, shape (nodes, 2, strips)
        From `influence_table`.
    """
    here = min(int(place), len(depth) - 1)
    part, pressed = place - here, 0.0
    for i in range(len(depth)):
        if depth[i] > 0.0:
            tau = min(np.log(np.sqrt(2.0 * depth[i] / curvature) / spacing), HIGHEST)
            near = read_value(table, tau, abs(i - here))
            if part > 0.0:
                near += part * (read_value(table, tau, abs(i - here - 1)) - near)
            pressed += depth[i] * near
    return pressed


@subroutine
def solve_virtual_penetration(
    gap: FloatArray,
    places: IntArray,
    count: int,
    load: float,
    start: float,
    spacing: float,
    contact_modulus: float,
    curvature: float,
    table: FloatArray,
    reach: FloatArray,
    level: FloatArray,
    slope: FloatArray,
    depth: FloatArray,
) -> tuple[int, float, float]:
    """Find the approach at which the strips carry a load, by virtual penetration.

    The bodies overlap by 0.55 of the approach. The pressure is semi-elliptic along rolling and
    proportional to the half-length sqrt(2 depth/curvature). It is scaled so that the displacement
    of the half-spaces at the first contact point is equal to the approach.

    Parameters
    ----------
    gap : ndarray, shape (strips,)
        Gap [m].
    places, count
        From `first_contacts`.
    load : float
        Sum of the line loads [N/m].
    start : float
        Initial value of the approach [m], or 0.
    spacing, contact_modulus, curvature : float
        Strip width [m], E* [Pa], relative curvature along rolling [1/m].
    table : ndarray, shape (nodes, 2, strips)
        From `influence_table`.
    reach, level, slope : ndarray, shape (strips,)
        Workspace.
    depth : ndarray, shape (strips,)
        Filled: depth below the level [m].

    Returns
    -------
    status : int
        `CONVERGED`, `TOO_FINE` or `NO_CONVERGENCE`.
    approach, stiffness : float
        Approach from first contact [m], and line load per depth [N/m^2].

    Notes
    -----
    Kik and Piotrowski (1996); Piotrowski and Kik (2008), DOI 10.1080/00423110701586444.
    """
    n, longest = len(gap), spacing * np.exp(HIGHEST)
    bottom, points = gap.min(), np.empty(count)
    mean_depth = even_depth(gap, load / (MEAN_STIFFNESS * contact_modulus))
    contacts = contact_places(gap, places, count, TOUCHING * mean_depth, points)
    reach[:] = OVERLAP
    # with a smaller approach the first contact points would lie outside the contact
    low, high = TOUCHING * mean_depth / OVERLAP, np.inf
    approach = start if start > low else mean_depth / OVERLAP
    old, old_error = 0.0, 0.0
    local_reach = count < 0  # always false; a literal would be compiled as another signature
    for _ in range(APPROACH_LIMIT):
        contact_levels(gap, places, count, reach, local_reach, bottom + approach, level, slope)
        total, deepest = 0.0, 0.0
        for i in range(n):
            depth[i] = max(level[i] - gap[i], 0.0)
            total += depth[i]
            deepest = max(deepest, depth[i])
        pressed = 0.0
        for m in range(contacts):
            pressed += displacement_at(points[m], depth, spacing, curvature, table) / contacts
        stiffness = approach * np.pi * contact_modulus / pressed
        error = np.log(stiffness * total / load)
        if abs(error) <= TOLERANCE or high - low <= TOLERANCE * approach:
            if 2.0 * deepest > curvature * longest**2:
                return TOO_FINE, approach, 0.0
            return CONVERGED, approach, stiffness
        low, high = (low, approach) if error > 0.0 else (approach, high)
        # the load is nearly a power of the approach
        known = old > 0.0 and error != old_error
        power = (error - old_error) / np.log(approach / old) if known else 1.5
        power = min(max(power, 0.5), 4.0)
        old, old_error = approach, error
        approach *= np.exp(-error / power)
        if not low < approach < high:
            approach = 0.5 * (low + high) if high < np.inf else 2.0 * old
    return NO_CONVERGENCE, approach, 0.0

"""Virtual penetration: the contact of Kik and Piotrowski on strips."""

from __future__ import annotations

import numpy as np

from wearsim.mechanics.numerics.jit import kernel
from wearsim.mechanics.semi_hertzian.contact_level import contact_levels
from wearsim.mechanics.slender.influence import HIGHEST, read_value
from wearsim.types import FloatArray, IntArray

REACH = 0.55  # of the approach: the virtual penetration of the method
EVEN = 0.5  # line load over depth and E*: the size of it in patches that are not too short
TOUCHING = 0.05  # of the depth that goes with it: what of a gap counts as its lowest point
ROUNDS = 100
TOLERANCE = 1e-14  # of the load
CONVERGED, TOO_FINE, NO_CONVERGENCE, NOT_FINITE = range(4)


@kernel
def even_depth(gap: FloatArray, amount: float) -> float:
    """Return how far a level lies above the lowest gap [m] if so much of the gap lies below it.

    Parameters
    ----------
    gap : ndarray, shape (strips,)
        Gap [m].
    amount : float
        Sum over the strips of their depth below the level [m].
    """
    bottom = gap.min()
    depth = amount / len(gap)
    for _ in range(len(gap) + 2):  # Newton: exact once the right strips lie below
        total, below = 0.0, 0
        for i in range(len(gap)):
            if gap[i] - bottom < depth:
                total += depth - (gap[i] - bottom)
                below += 1
        if abs(total - amount) <= TOLERANCE * amount:
            break
        depth += (amount - total) / below
    return depth


@kernel
def contact_places(
    gap: FloatArray, places: IntArray, count: int, depth: float, points: FloatArray
) -> int:
    """Find where the bodies touch first, in strips counted from the first strip's centre.

    A first contact point is the mean place of the strips about a lowest one whose gap, and that of
    all strips on the way, is lower than a level: on a symmetric profile the point itself, on a
    flat one its middle. Strips count by how far they lie below the level, so that the point moves
    on smoothly while the gap changes.

    Parameters
    ----------
    gap : ndarray, shape (strips,)
        Gap [m].
    places, count
        As `first_contacts` fills them.
    depth : float
        How far the level lies above the lowest gap [m].
    points : ndarray, shape (strips,)
        Filled: the place of every strip that is lowest.

    Returns
    -------
    int
        How many there are: one, unless several touch at once.
    """
    bottom, found = gap.min(), 0
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
                weight = share * (0.5 if first == i == last else 1.0)  # comes from both sides
                total += weight
                moment += weight * (i - first)
                i += 2 * side - 1
        points[found] = first + moment / total
        found += 1
    return found


@kernel
def displacement_at(
    place: float,
    depth: FloatArray,
    spacing: float,
    curvature: float,
    table: FloatArray,
) -> float:
    """Return how far pressed strips displace a place, per stiffness over pi E* [m].

    Parameters
    ----------
    place : float
        In strips counted from the first strip's centre; linear between the strips.
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
            half_length = np.sqrt(2.0 * depth[i] / curvature)
            tau = min(np.log(half_length / spacing), HIGHEST)
            near = read_value(table, tau, abs(i - here))
            if part > 0.0:
                following = read_value(table, tau, abs(i - here - 1))
                near += part * (following - near)
            pressed += depth[i] * near
    return pressed


@kernel
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
    """Find the approach at which the pressed strips carry a load.

    The bodies overlap down to 0.55 of the approach; pressure is semi-elliptic along rolling and
    goes as the half-length sqrt(2 depth/curvature); its scale is the one with which it presses
    the half-spaces apart by just the approach at the first contact point.

    Parameters
    ----------
    gap : ndarray, shape (strips,)
        Gap [m].
    places, count
        As `first_contacts` fills them.
    load : float
        Sum of the line loads [N/m].
    start : float
        A guess of the approach [m], or 0.
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
    bottom = gap.min()
    points = np.empty(count)
    usual = even_depth(gap, load / (EVEN * contact_modulus))
    found = contact_places(gap, places, count, TOUCHING * usual, points)
    reach[:] = REACH
    # below this the first contact points would lie beside the contact
    low, high = TOUCHING * usual / REACH, np.inf
    approach = start if start > low else usual / REACH
    old, old_error = 0.0, 0.0
    own = count < 0  # never, but a literal would be compiled for by itself
    for _ in range(ROUNDS):
        contact_levels(gap, places, count, reach, own, bottom + approach, level, slope)
        total, deepest = 0.0, 0.0
        for i in range(n):
            depth[i] = max(level[i] - gap[i], 0.0)
            total += depth[i]
            deepest = max(deepest, depth[i])
        pressed = 0.0
        for m in range(found):
            pressed += displacement_at(points[m], depth, spacing, curvature, table) / found
        stiffness = approach * np.pi * contact_modulus / pressed
        error = np.log(stiffness * total / load)
        settled = abs(error) <= TOLERANCE or high - low <= TOLERANCE * approach
        if settled and 2.0 * deepest > curvature * longest**2:
            return TOO_FINE, approach, 0.0
        if settled:
            return CONVERGED, approach, stiffness
        if error > 0.0:
            high = approach
        else:
            low = approach
        # the load goes nearly as a power of the approach
        power = 1.5
        if old > 0.0 and error != old_error:
            power = min(max((error - old_error) / np.log(approach / old), 0.5), 4.0)
        old, old_error = approach, error
        approach *= np.exp(-error / power)
        if not low < approach < high:
            approach = 0.5 * (low + high) if high < np.inf else 2.0 * old
    return NO_CONVERGENCE, approach, 0.0

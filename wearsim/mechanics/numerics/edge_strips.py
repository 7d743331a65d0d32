"""Strips that the edge of a contact crosses in a step; see `evolution.steppers.edges`.

The letters of these kernels are those of that module: depth l in contact, mean depth u, depth u_0
when the edge reached the strip, rise r of the gap across it, part f in contact. Contact number k is
c * realisations + v, as in `linearised_wear`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from wearsim.mechanics.numerics.jit import subroutine
from wearsim.mechanics.numerics.multistep import ROWS
from wearsim.types import BoolArray, FloatArray, IntArray

SETTLED = float(ROWS)  # steps after which all points of a formula lie in contact
ELASTIC = 0.5
LEAST, FULL, NONE = 0.1, 0.5, 1.0
OF_EDGES = 10.0  # change by which strips partly in contact have converged, over that of the others
# difference counted for a strip that is loaded ahead of the predicted edge, over the rise: its mean
# depth is uncertain by an eighth, and held to the tolerance of strips in contact as wholes
ENTERED = OF_EDGES / 8.0
FLAT = 1e-15  # least rise of a gap across a strip [m]


class EdgeStrips(NamedTuple):
    """All strips at the start of a step.

    Parameters
    ----------
    bodies : ndarray of int, shape (contacts each, 2)
        Rows of the two bodies of each contact.
    resolved : ndarray of bool, shape (realisations,)
        Tests that resolve edges; strips of the others have no u_0 and r.
    gap : ndarray, shape (contacts, strips)
        Gap before wear [m].
    rows : ndarray, shape (bodies, realisations, strips)
        Mean depths of the bodies [m].
    added : ndarray, shape (bodies, realisations, strips)
        Increase of the depths in the step without the wear at its end [m].
    base : ndarray, shape (bodies, realisations, strips)
        Depths l_0 of the formula, of the bodies [m].
    part : ndarray, shape (contacts, strips)
        As in `WearState`.
    first, rise : ndarray, shape (contacts, strips)
        u_0 and r [m], from `start_edges`.
    greatest : ndarray, shape (bodies, realisations, strips)
        Greatest f of the contacts of each body, from `start_edges`.
    """

    bodies: IntArray
    resolved: BoolArray
    gap: FloatArray
    rows: FloatArray
    added: FloatArray
    base: FloatArray
    part: FloatArray
    first: FloatArray
    rise: FloatArray
    greatest: FloatArray


@subroutine
def edge_strips(
    bodies: IntArray,
    resolved: BoolArray,
    gap: FloatArray,
    depths: FloatArray,
    part: FloatArray,
    of_bodies: FloatArray,
    of_contacts: FloatArray,
) -> EdgeStrips:
    """Return `EdgeStrips` from the arrays of `implicit_step.begin_step`."""
    added, base, greatest = of_bodies[2], of_bodies[3], of_bodies[5]
    first, rise = of_contacts[0], of_contacts[1]
    return EdgeStrips(bodies, resolved, gap, depths, added, base, part, first, rise, greatest)


@subroutine
def start_edges(strips: EdgeStrips, separation: FloatArray, approach: FloatArray) -> None:
    """Fill u_0, r and greatest f of all strips.

    Ahead of an edge, the deformed surfaces of a strip touch at its inner end or not yet.

    Parameters
    ----------
    strips : EdgeStrips
    separation : ndarray, shape (contacts, strips)
        As in `WearState`.
    approach : ndarray, shape (contacts,)
        Approach of each contact [m].
    """
    contacts, n = strips.gap.shape
    realisations = strips.rows.shape[1]
    # the contacts of a roller along a cam meet it one after another
    strips.greatest[:] = 1.0 if strips.bodies[len(strips.bodies) - 1, 0] > 0 else 0.0
    for k in range(contacts):
        one, other = strips.bodies[k // realisations, 0], strips.bodies[k // realisations, 1]
        v, least = k % realisations, np.inf
        if not strips.resolved[v]:
            continue
        for i in range(n):
            depth = strips.rows[one, v, i] + strips.rows[other, v, i]
            least = min(least, strips.gap[k, i] + depth)
        elastic = ELASTIC * (approach[k] - least)
        for i in range(n):
            part, apart = strips.part[k, i], separation[k, i]
            rise = 0.0
            if 0.0 < part < 1.0:
                rise = 2.0 * apart / ((1.0 - part) * (1.0 - part))
            elif part <= 0.0:
                ahead = max(separation[k, min(i + 1, n - 1)], separation[k, max(i - 1, 0)])
                rise = ahead - apart
                if rise > 0.0:
                    kept = (NONE - elastic / rise) / (NONE - FULL)
                    rise *= min(max(kept, LEAST), 1.0)
                rise = min(rise, 2.0 * apart)
            rise = max(rise, FLAT)
            depth = strips.rows[one, v, i] + strips.rows[other, v, i]
            strips.rise[k, i] = rise
            for b in (one, other):
                strips.greatest[b, v, i] = max(strips.greatest[b, v, i], part)
            strips.first[k, i] = depth - 0.5 * rise * part * part


@subroutine
def part_at(strips: EdgeStrips, k: int, i: int, level: float, grown: float) -> float:
    """Return f of a strip at a depth l, where other contacts have increased the depth."""
    if strips.part[k, i] >= 1.0:
        return 1.0
    part = 0.5 + (level - strips.first[k, i] - grown) / strips.rise[k, i]
    return float(min(max(part, 0.0), 1.0))


@subroutine
def sum_of_wear(strips: EdgeStrips, active: BoolArray, wear: FloatArray, sums: FloatArray) -> None:
    """Fill the wear of each body by all contacts, in active tests that resolve edges."""
    rows, realisations, n = sums.shape
    for v in range(realisations):
        for b in range(rows if active[v] and strips.resolved[v] else 0):
            sums[b, v, :] = 0.0
    for k in range(wear.shape[1]):
        v = k % realisations
        for side in range(2 if active[v] and strips.resolved[v] else 0):
            b = strips.bodies[k // realisations, side]
            for i in range(n):
                sums[b, v, i] += wear[side, k, i]


@subroutine
def share_ahead(strips: EdgeStrips, part: float, b: int, v: int, i: int) -> float:
    """Return the share of the wear by others that lowers the part ahead of an edge too."""
    return max(strips.greatest[b, v, i] - part, 0.0) / (1.0 - part) if part < 1.0 else 1.0


@subroutine
def own_side(bodies: IntArray) -> int:
    """Return the side of the body that a contact shares with no other one: the roller's or a cam's.

    Parameters
    ----------
    bodies : ndarray of int, shape (contacts each, 2)
        As in `EdgeStrips`, of rollers that pass one station, or of one that passes several.
    """
    return 1 if bodies[len(bodies) - 1, 0] == 0 else 0


@subroutine
def by_others(
    strips: EdgeStrips, wear: FloatArray, sums: FloatArray, k: int, i: int
) -> tuple[float, float, float]:
    """Return the wear of a strip by the other contacts of its bodies.

    Where another contact reaches further across the strip, its wear lowers the part ahead of the
    edge too; the other wear is joint, on the part that this contact has crossed. What others have
    added to a body is all that is added to it, less what this contact adds to both of its bodies in
    the ratio of their wear.

    Returns
    -------
    ahead, grown, joint : float
        Wear at the end of the step that lowers the whole strip, the same in the whole step, and
        joint wear [m].
    """
    c, realisations = k // strips.resolved.size, strips.resolved.size
    side, v = own_side(strips.bodies), k % realisations
    own, b = strips.bodies[c, side], strips.bodies[c, 1 - side]
    of_this, of_own = wear[1 - side, k, i], wear[side, k, i]
    of_others = sums[b, v, i] - of_this
    if not of_others > 0.0:
        return 0.0, 0.0, 0.0
    share = share_ahead(strips, strips.part[k, i], b, v, i)
    if of_own > 0.0:
        added = max(strips.added[b, v, i] - of_this / of_own * strips.added[own, v, i], 0.0)
    else:
        added = of_others / sums[b, v, i] * strips.added[b, v, i]
    return share * of_others, share * (of_others + added), (1.0 - share) * of_others


@subroutine
def linearise_edges(
    strips: EdgeStrips,
    active: BoolArray,
    level: FloatArray,
    wear: FloatArray,
    gaps: FloatArray,
    slopes: FloatArray,
) -> None:
    """Fill gaps without wear at the end of the step, and slopes of the mean wear, about a depth l.

    Parameters
    ----------
    strips : EdgeStrips
    active : ndarray of bool, shape (realisations,)
        Realisations whose results are computed.
    level : ndarray, shape (contacts, strips)
        Depth l [m].
    wear : ndarray, shape (2, contacts, strips)
        Wear of both bodies by each contact [m].
    gaps, slopes : ndarray, shape (contacts, strips)
        Result. The slope is infinite where a strip is not in contact.
    """
    contacts, n = level.shape
    realisations = strips.rows.shape[1]
    sums, scaled = np.empty(strips.rows.shape), np.empty(wear.shape)
    sum_of_wear(strips, active, wear, sums)
    for k in range(contacts):
        one, other = strips.bodies[k // realisations, 0], strips.bodies[k // realisations, 1]
        v = k % realisations
        for i in range(0 if strips.resolved[v] or not active[v] else n):
            gaps[k, i] = strips.gap[k, i] + strips.base[one, v, i] + strips.base[other, v, i]
            slopes[k, i] = 1.0
        for i in range(n if strips.resolved[v] and active[v] else 0):
            ahead, grown, _ = by_others(strips, wear, sums, k, i)
            part = part_at(strips, k, i, level[k, i], grown)
            base = strips.base[one, v, i] + strips.base[other, v, i]
            worn = level[k, i] - base - ahead
            slope, without = part, base
            if part <= 0.0:
                depth = strips.rows[one, v, i] + strips.rows[other, v, i]
                slope, without = np.inf, max(level[k, i], depth)
            elif part < 1.0:
                slope += max(worn, 0.0) / strips.rise[k, i]
                without = level[k, i] - part * worn / slope - ahead
            gaps[k, i], slopes[k, i] = strips.gap[k, i] + without, slope
            # what the scaled wear of a strip opens beyond its mean wear
            beyond = 1.0 / slope - 1.0 if slope < np.inf else 0.0
            for side in range(2):
                scaled[side, k, i] = beyond * wear[side, k, i]
    if contacts == realisations:
        return
    sum_of_wear(strips, active, scaled, sums)
    for k in range(contacts):
        v = k % realisations
        for i in range(n if strips.resolved[v] and active[v] else 0):
            for side in range(2):
                b = strips.bodies[k // realisations, side]
                share = share_ahead(strips, strips.part[k, i], b, v, i)
                gaps[k, i] -= share * (sums[b, v, i] - scaled[side, k, i])


@subroutine
def compare_edges(
    strips: EdgeStrips,
    active: BoolArray,
    gaps: FloatArray,
    slopes: FloatArray,
    linear: FloatArray,
    apart: FloatArray,
    loads: FloatArray,
    wear: FloatArray,
    level: FloatArray,
) -> FloatArray:
    """Update the depth l by a solution, and return how much its wear differs from the formula.

    Parameters
    ----------
    strips : EdgeStrips
    active : ndarray of bool, shape (realisations,)
        Realisations whose depth and result are computed; the results of others are 0.
    gaps, slopes : ndarray, shape (contacts, strips)
        From `linearise_edges`.
    linear, apart, loads : ndarray, shape (contacts, strips)
        Opening of the gaps by the linearised wear [m], separation [m] and line load of the
        solution [N/m].
    wear : ndarray, shape (2, contacts, strips)
        Its wear [m].
    level : ndarray, shape (contacts, strips)
        Depth l, overwritten [m].

    Returns
    -------
    ndarray, shape (realisations,)
        Greatest difference of the mean wear [m].
    """
    contacts, n = level.shape
    realisations = len(active)
    sums, rest = np.empty(strips.rows.shape), np.zeros(realisations)
    sum_of_wear(strips, active, wear, sums)
    for k in range(contacts):
        one, other = strips.bodies[k // realisations, 0], strips.bodies[k // realisations, 1]
        v = k % realisations
        for i in range(n if strips.resolved[v] and active[v] else 0):
            level[k, i] = gaps[k, i] + linear[k, i] - apart[k, i] - strips.gap[k, i]
            ahead, grown, joint = by_others(strips, wear, sums, k, i)
            part = part_at(strips, k, i, level[k, i], grown)
            base = strips.base[one, v, i] + strips.base[other, v, i]
            mean = part * (level[k, i] - base - ahead)
            own = wear[0, k, i] + wear[1, k, i]
            if not loads[k, i] > 0.0:
                rest[v] = max(rest[v], mean - joint)
            elif slopes[k, i] == np.inf:
                rest[v] = max(rest[v], own, ENTERED * strips.rise[k, i])
                # loaded ahead of the predicted edge, which is now in its middle
                level[k, i] = max(level[k, i], strips.first[k, i] + grown)
            else:
                rest[v] = max(rest[v], abs(mean - own - joint))
    return rest


@subroutine
def end_edges(
    strips: EdgeStrips,
    counted: bool,
    whole_steps: FloatArray,
    level: FloatArray,
    loads: FloatArray,
    wear: FloatArray,
    worn: FloatArray,
    depths: FloatArray,
    parts: FloatArray,
    fields: FloatArray,
) -> None:
    """Fill depths, parts of the bodies in contact, and fields of the state at the end of a step.

    Parameters
    ----------
    strips : EdgeStrips
    counted : bool
        Whether strips in contact as wholes are counted, where no test resolves edges.
    whole_steps : ndarray, shape (contacts, strips)
        As in `WearState`, at the start of the step.
    level, loads : ndarray, shape (contacts, strips)
        Depth l [m] and line load [N/m] at the end of the step.
    wear : ndarray, shape (2, contacts, strips)
        Wear of both bodies by each contact [m].
    worn, depths, parts : ndarray, shape (bodies, realisations, strips)
        Wear of the bodies by the formula [m]; results: mean depths [m], greatest f.
    fields : ndarray, shape (3, contacts, strips), or (0, 0, 0)
        Result: `separation`, `part` and `whole_steps` as in `WearState`, not a number in tests
        that do not resolve edges; none where no test does.
    """
    contacts, n = level.shape
    rows, realisations, _ = worn.shape
    sums, crossed = np.empty(worn.shape), np.empty(worn.shape, np.bool_)
    side = own_side(strips.bodies)
    sum_of_wear(strips, strips.resolved, wear, sums)
    for b in range(rows):
        for v in range(realisations):
            for i in range(n):
                depths[b, v, i], parts[b, v, i] = strips.rows[b, v, i], 0.0
                crossed[b, v, i] = False
    for k in range(contacts):
        c, v = k // realisations, k % realisations
        own, shared = strips.bodies[c, side], strips.bodies[c, 1 - side]
        for i in range(n):
            if not strips.resolved[v]:
                for field in range(len(fields)):
                    fields[field, k, i] = np.nan
                if counted:
                    fields[1, k, i] = 1.0 if loads[k, i] > 0.0 else 0.0
                    fields[2, k, i] = fields[1, k, i] * min(whole_steps[k, i] + 1.0, SETTLED)
                    for b in (own, shared):
                        parts[b, v, i] = max(parts[b, v, i], fields[1, k, i])
                continue
            _, grown, joint = by_others(strips, wear, sums, k, i)
            before, part, growth = strips.part[k, i], 0.0, 0.0
            if loads[k, i] > 0.0:
                part = part_at(strips, k, i, level[k, i], grown)
                depth = strips.rows[own, v, i] + strips.rows[shared, v, i]
                growth = level[k, i] - depth - grown
                if part < 1.0:
                    growth = 0.5 * strips.rise[k, i] * (part * part - before * before)
            of_both = wear[0, k, i] + wear[1, k, i]
            ratio = max(growth, 0.0) / (of_both + joint) if of_both > 0.0 else 0.0
            of_own, of_shared = wear[side, k, i], wear[1 - side, k, i]
            steps = min(whole_steps[k, i] + 1.0, SETTLED)
            if whole_steps[k, i] >= SETTLED:
                depths[own, v, i] = strips.base[own, v, i] + of_own
            else:
                depths[own, v, i] += ratio * of_own
                crossed[own, v, i], crossed[shared, v, i] = True, True
            if of_own > 0.0:  # each contact wears both of its bodies in one ratio
                ratio = (depths[own, v, i] - strips.rows[own, v, i]) / of_own
            depths[shared, v, i] += ratio * of_shared
            for b in (own, shared):
                parts[b, v, i] = max(parts[b, v, i], part)
            fields[1, k, i], fields[2, k, i] = part, steps if part >= 1.0 else 0.0
    for b in range(rows):
        for v in range(realisations):
            for i in range(n):
                if not crossed[b, v, i]:
                    depths[b, v, i] = strips.base[b, v, i] + worn[b, v, i]
    for k in range(contacts):
        one, other = strips.bodies[k // realisations, 0], strips.bodies[k // realisations, 1]
        v = k % realisations
        for i in range(n if strips.resolved[v] and len(fields) else 0):
            part = fields[1, k, i]
            apart = max(depths[one, v, i] + depths[other, v, i] - level[k, i], 0.0)
            if part > 0.0:
                apart = 0.5 * strips.rise[k, i] * ((1.0 - part) * (1.0 - part))
            fields[0, k, i] = apart


@subroutine
def fill_resolved(separation: FloatArray, part: FloatArray, resolved: BoolArray) -> None:
    """Fill which tests resolve edges: the parts of the others are not numbers, or all whole."""
    for v in range(len(resolved)):
        resolved[v] = separation.shape[1] > 0 and not np.isnan(part[v, 0])


@subroutine
def fill_separations(
    bodies: IntArray,
    resolved: BoolArray,
    separation: FloatArray,
    share: FloatArray,
    parts: FloatArray,
) -> None:
    """Fill the separation of the contacts as parts of the bodies, 0 without resolved edges [m].

    The sum of the two bodies of a contact is its separation, which their wear closes together.

    Parameters
    ----------
    bodies, resolved
        As in `EdgeStrips`.
    separation : ndarray, shape (contacts, strips)
        As in `WearState` [m].
    share : ndarray, shape (realisations,)
        Part of the wear of a contact that is the cylinder's.
    parts : ndarray, shape (bodies, realisations, strips)
        Result [m].
    """
    _, realisations, n = parts.shape
    one_station = bodies[len(bodies) - 1, 0] == 0
    parts[:] = 0.0
    for v in range(realisations):
        for c in range(len(bodies) if resolved[v] else 0):
            b, k = bodies[c, 0], c * realisations + v
            for i in range(n):
                first = c == 0 or bodies[c - 1, 0] != b
                parts[b, v, i] = (
                    separation[k, i] if first else min(parts[b, v, i], separation[k, i])
                )
        for i in range(n if resolved[v] and one_station else 0):
            parts[0, v, i] *= share[v]
            for c in range(len(bodies)):
                parts[bodies[c, 1], v, i] = separation[c * realisations + v, i] - parts[0, v, i]

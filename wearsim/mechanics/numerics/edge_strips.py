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
YOUNG_STEPS = 2.0  # steps for which a strip is young, over the order
ELASTIC = 0.5
LEAST, FULL, NONE = 0.1, 0.5, 1.0
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
def by_others(
    strips: EdgeStrips, wear: FloatArray, sums: FloatArray, k: int, i: int
) -> tuple[float, float, float]:
    """Return the wear of a strip by the other contacts of its bodies.

    Where another contact reaches further across the strip, its wear lowers the part ahead of the
    edge too; the other wear is joint, on the part that this contact has crossed.

    Returns
    -------
    ahead, grown, joint : float
        Wear at the end of the step that lowers the whole strip, the same in the whole step, and
        joint wear [m].
    """
    ahead, grown, joint, realisations = 0.0, 0.0, 0.0, sums.shape[1]
    part = strips.part[k, i]
    for side in range(2):
        b, v = strips.bodies[k // realisations, side], k % realisations
        of_others = sums[b, v, i] - wear[side, k, i]
        if of_others > 0.0:
            share = share_ahead(strips, part, b, v, i)
            ahead += share * of_others
            joint += (1.0 - share) * of_others
            grown += share * of_others / sums[b, v, i] * (strips.added[b, v, i] + sums[b, v, i])
    return ahead, grown, joint


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
                rest[v] = max(rest[v], own)
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
    sum_of_wear(strips, strips.resolved, wear, sums)
    for b in range(rows):
        for v in range(realisations):
            for i in range(n):
                depths[b, v, i], parts[b, v, i] = strips.rows[b, v, i], 0.0
                crossed[b, v, i] = False
    for k in range(contacts):
        one, other = strips.bodies[k // realisations, 0], strips.bodies[k // realisations, 1]
        v = k % realisations
        for i in range(n):
            if not strips.resolved[v]:
                for field in range(len(fields)):
                    fields[field, k, i] = np.nan
                if counted:
                    fields[1, k, i] = 1.0 if loads[k, i] > 0.0 else 0.0
                    fields[2, k, i] = fields[1, k, i] * min(whole_steps[k, i] + 1.0, SETTLED)
                    for b in (one, other):
                        parts[b, v, i] = max(parts[b, v, i], fields[1, k, i])
                continue
            _, grown, joint = by_others(strips, wear, sums, k, i)
            before, part, growth = strips.part[k, i], 0.0, 0.0
            if loads[k, i] > 0.0:
                part = part_at(strips, k, i, level[k, i], grown)
                depth = strips.rows[one, v, i] + strips.rows[other, v, i]
                growth = level[k, i] - depth - grown
                if part < 1.0:
                    growth = 0.5 * strips.rise[k, i] * (part * part - before * before)
            own = wear[0, k, i] + wear[1, k, i]
            ratio = max(growth, 0.0) / (own + joint) if own > 0.0 else 0.0
            for side in range(2):
                b = strips.bodies[k // realisations, side]
                # a strip of a body follows the formula where all of its contacts do
                crossed[b, v, i] |= whole_steps[k, i] < SETTLED
                depths[b, v, i] += ratio * wear[side, k, i]
                parts[b, v, i] = max(parts[b, v, i], part)
            steps = min(whole_steps[k, i] + 1.0, SETTLED)
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
def mark_strips(
    bodies: IntArray,
    resolved: BoolArray,
    part: FloatArray,
    whole_steps: FloatArray,
    orders: IntArray,
    wear: FloatArray,
    young: BoolArray,
    crossed: BoolArray,
    parts: FloatArray,
) -> None:
    """Fill which strips of the bodies are young, which an edge has crossed, and their parts.

    Young strips take steps of first order. Points of formulas of the state's order would lie ahead
    of the edge or close to it, until as many steps again have been taken. There the surfaces close
    as the power 3/2 of the distance from it, and higher orders would overshoot. A worn roller of a
    cam meets the edges at all stations at different times. Its wear by one of them has no past
    points, and both bodies of a contact must wear by the same formula: no strip is young then.

    Parameters
    ----------
    bodies, resolved
        As in `EdgeStrips`.
    part, whole_steps : ndarray, shape (contacts, strips)
        As in `WearState`.
    orders : ndarray of int, shape (realisations,)
        Orders of the steps.
    wear : ndarray, shape (bodies, realisations, strips)
        Wear per roller pass [m].
    young, crossed : ndarray of bool, shape as `wear`
        Results: strips that are young, and that an edge is crossing or has crossed lately.
    parts : ndarray, shape as `wear`
        Result: greatest part in contact, 0 without wear; 1 in tests that do not resolve edges.
    """
    rows, realisations, n = wear.shape
    stations = bodies[len(bodies) - 1, 0] + 1
    for v in range(realisations):
        takes_part, young_steps = resolved[v], YOUNG_STEPS * orders[v]
        for b in range(rows):
            for i in range(n):
                if stations > 1 and b >= stations and wear[b, v, i] > 0.0:
                    takes_part = False
                young[b, v, i], crossed[b, v, i] = False, False
                parts[b, v, i] = 0.0 if resolved[v] else 1.0
        for c in range(len(bodies) if resolved[v] else 0):
            k = c * realisations + v
            for side in range(2):
                b = bodies[c, side]
                for i in range(n):
                    if part[k, i] > 0.0:
                        parts[b, v, i] = max(parts[b, v, i], part[k, i])
                        young[b, v, i] = young[b, v, i] or whole_steps[k, i] < young_steps
                        crossed[b, v, i] = crossed[b, v, i] or whole_steps[k, i] < SETTLED
        for b in range(rows if resolved[v] else 0):
            for i in range(n):
                young[b, v, i] = takes_part and (young[b, v, i] or not parts[b, v, i] > 0.0)
                parts[b, v, i] = parts[b, v, i] if wear[b, v, i] > 0.0 else 0.0


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

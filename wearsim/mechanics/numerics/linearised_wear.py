"""Wear of a step, linearised in the line load of every strip."""

from __future__ import annotations

import math

import numpy as np

from wearsim.mechanics.numerics.jit import kernel, subroutine
from wearsim.types import BoolArray, FloatArray, IntArray

LEAST_EXPONENT = 0.4  # wear is proportional to q^(1/2) in adhesion and at a steady wear rate
DEEP = 0.5  # depths are compared where a groove is deeper than this part of its greatest depth
FOUNDATION = 0.5  # elastic compliance of a strip, over approach per greatest line load
# least relative change of a line load for the estimate of an exponent; over a much smaller one the
# estimate would be round-off, which later steps amplify
MIN_LOG_CHANGE = 1e-3
LEAST = 0.15  # error of the greatest depth, relative to that of the profile, as it crosses zero


@subroutine
def linearised_wear(
    line_load: FloatArray,
    wear: FloatArray,
    exponents: FloatArray,
    slopes: FloatArray,
    bodies: IntArray,
    gap: FloatArray,
    active: BoolArray,
    compliance: FloatArray,
    opened: FloatArray,
    constant: FloatArray,
) -> None:
    """Linearise the wear u of each strip about its line load q_0.

    u = (1 - e) u_0 + e (u_0/q_0) q, with the exponent e of u ~ q^e. In a strip partly in contact
    the gap there opens by u over the slope s of the mean wear, see `steppers.edges`.

    Parameters
    ----------
    line_load : ndarray, shape (contacts, strips)
        Line load q_0 [N/m]; contact number c * realisations + v.
    wear : ndarray, shape (2, contacts, strips)
        Depth u_0 that each contact wears off its two bodies [m].
    exponents : ndarray, shape (contacts, strips)
        Exponent e.
    slopes : ndarray, shape (contacts, strips)
        Slope s, infinite in strips that do not wear.
    bodies : ndarray of int, shape (contacts each, 2)
        Numbers of the two bodies of each contact, less than twice the number of contacts.
    gap : ndarray, shape (contacts, strips)
        Gap without this wear [m].
    active : ndarray of bool, shape (realisations,)
        Realisations whose results are computed.
    compliance : ndarray, shape (realisations, contacts each, 2, strips)
        Result: e u_0/(s q_0) [m/(N/m)]; u_0/q_0 is interpolated to strips without load.
    opened : ndarray, shape (contacts, strips)
        Result: gap opened by the constant part of the wear of all contacts [m].
    constant : ndarray, shape (2, contacts, strips)
        Result: the constant part (1 - e) u_0/s [m].
    """
    contacts, n = line_load.shape
    realisations = len(compliance)
    worn = np.empty((2 * len(bodies), realisations, n))  # np.zeros takes longer to compile
    worn[:] = 0.0
    for k in range(contacts):
        c, v = k // realisations, k % realisations
        for side in range(2 if active[v] else 0):
            b = bodies[c, side]
            for i in range(n):
                constant[side, k, i] = (1.0 - exponents[k, i]) * wear[side, k, i] / slopes[k, i]
                worn[b, v, i] += constant[side, k, i]
                loaded = line_load[k, i] > 0.0
                compliance[v, c, side, i] = wear[side, k, i] / line_load[k, i] if loaded else 0.0
            fill_unloaded(line_load[k], compliance[v, c, side])
            for i in range(n):
                compliance[v, c, side, i] *= exponents[k, i] / slopes[k, i]
    for k in range(contacts):
        c, v = k // realisations, k % realisations
        one, other = bodies[c, 0], bodies[c, 1]
        for i in range(n if active[v] else 0):
            opened[k, i] = gap[k, i] + (worn[one, v, i] + worn[other, v, i])


@subroutine
def fill_unloaded(line_load: FloatArray, values: FloatArray) -> None:
    """Interpolate values to the strips without load; beyond the loaded ones they are constant.

    Parameters
    ----------
    line_load, values : ndarray, shape (strips,)
        Values of strips without load are overwritten; 0 if no strip is loaded.
    """
    last, n = -1, len(values)
    for i in range(n):
        if not line_load[i] > 0.0:
            continue
        if last < i - 1:
            start = values[last] if last >= 0 else values[i]
            for j in range(last + 1, i):
                part = (j - last) / (i - last) if last >= 0 else 1.0
                values[j] = start + (values[i] - start) * part
        last = i
    for j in range(last + 1, n):
        values[j] = values[last] if last >= 0 else 0.0


@subroutine
def wear_of_bodies(
    loads: FloatArray,
    old_loads: FloatArray,
    wear: FloatArray,
    old_wear: FloatArray,
    compliance: FloatArray,
    constant: FloatArray,
    bodies: IntArray,
    base: FloatArray,
    greatest: float,
    slopes: FloatArray,
    active: BoolArray,
    exponents: FloatArray,
    worn: FloatArray,
    linear: FloatArray,
) -> FloatArray:
    """Add the wear of all contacts, and compare it with that linearised about another solution.

    Parameters
    ----------
    loads, old_loads : ndarray, shape (contacts, strips)
        Line loads of the solution, and of the other one [N/m].
    wear, old_wear : ndarray, shape (2, contacts, strips)
        Their wear [m].
    compliance, constant : ndarray
        As in `linearised_wear`.
    bodies : ndarray of int, shape (contacts each, 2)
        Rows in `worn` of the two bodies of each contact.
    base : ndarray, shape (bodies, realisations, strips)
        Depths without this wear [m].
    greatest : float
        Upper bound of the exponents.
    slopes : ndarray, shape (contacts, strips)
        As in `linearised_wear`.
    active : ndarray of bool, shape (realisations,)
        Realisations whose exponents and results are computed; the wear of others remains.
    exponents : ndarray, shape (contacts, strips)
        Updated by the two solutions in strips whose load has changed.
    worn : ndarray, shape (bodies, realisations, strips)
        Result: wear of the bodies [m].
    linear : ndarray, shape (contacts, strips)
        Result: opening of the gaps by the linearised wear [m].

    Returns
    -------
    ndarray, shape (3, realisations)
        Greatest opening less the linearised one, greatest opening, and greatest depth of both
        bodies of a contact, infinite without any [m]. Those of others are 0, 0 and infinite.
    """
    contacts, n = loads.shape
    rows, realisations = worn.shape[0], worn.shape[1]
    part, scaled = np.empty((rows, realisations, n)), np.empty((rows, realisations, n))
    for v in range(realisations):
        for b in range(rows if active[v] else 0):
            worn[b, v, :], part[b, v, :], scaled[b, v, :] = 0.0, 0.0, 0.0
    for k in range(contacts):
        c, v = k // realisations, k % realisations
        for side in range(2 if active[v] else 0):
            body = bodies[c, side]
            for i in range(n):
                worn[body, v, i] += wear[side, k, i]
                scaled[body, v, i] += wear[side, k, i] / slopes[k, i]
                part[body, v, i] += constant[side, k, i] + compliance[v, c, side, i] * loads[k, i]
        for i in range(n if active[v] else 0):
            new, old = wear[0, k, i] + wear[1, k, i], old_wear[0, k, i] + old_wear[1, k, i]
            if not (new > 0.0 and old > 0.0):
                continue
            rise = math.log(loads[k, i] / old_loads[k, i])
            if abs(rise) > MIN_LOG_CHANGE:
                exponents[k, i] = min(max(math.log(new / old) / rise, LEAST_EXPONENT), greatest)
    sizes = np.empty((3, realisations))
    for v in range(realisations):
        difference, greatest_opening, deepest = 0.0, 0.0, 0.0
        for c in range(len(bodies) if active[v] else 0):
            one, other, k = bodies[c, 0], bodies[c, 1], c * realisations + v
            for i in range(n):
                opening = worn[one, v, i] + worn[other, v, i]
                linear[k, i] = part[one, v, i] + part[other, v, i]
                rest = scaled[one, v, i] + scaled[other, v, i] - linear[k, i]
                difference = max(difference, abs(rest) * min(slopes[k, i], 1.0))
                greatest_opening = max(greatest_opening, opening)
                deepest = max(deepest, base[one, v, i] + base[other, v, i] + opening)
        sizes[0, v], sizes[1, v] = difference, greatest_opening
        sizes[2, v] = deepest if deepest > 0.0 else np.inf
    return sizes


@kernel
def difference_sizes(
    depths: FloatArray, differences: FloatArray, weights: FloatArray
) -> FloatArray:
    """Return the sizes of differences in the depths of all bodies.

    Parameters
    ----------
    depths, differences : ndarray, shape (bodies, realisations, strips)
        Depths and differences of depths [m].
    weights : ndarray, shape (2, bodies)
        One for a body of the first kind and zero for others; volume per sum of depths [m^2].

    Returns
    -------
    ndarray, shape (4, realisations)
        Greatest absolute difference where the bodies of a kind are worn deeper than half their
        greatest depth [m]; volume of the differences [m^3]; Euclidean norms of differences and
        depths [m].
    """
    return _sizes(depths, differences, weights)


@subroutine
def _sizes(depths: FloatArray, differences: FloatArray, weights: FloatArray) -> FloatArray:
    bodies, realisations, n = depths.shape
    sizes = np.empty((4, realisations))
    for v in range(realisations):
        of_first, of_others = 0.0, 0.0  # greatest depths of both kinds
        for b in range(bodies):
            for i in range(n):
                if weights[0, b] > 0.0:
                    of_first = max(of_first, depths[b, v, i])
                else:
                    of_others = max(of_others, depths[b, v, i])
        greatest, volume, square, square_of_depth = 0.0, 0.0, 0.0, 0.0
        for b in range(bodies):
            deepest = of_first if weights[0, b] > 0.0 else of_others
            total = 0.0
            for i in range(n):
                difference = differences[b, v, i]
                total += difference
                square += difference * difference
                square_of_depth += depths[b, v, i] * depths[b, v, i]
                if depths[b, v, i] >= DEEP * deepest:
                    greatest = max(greatest, abs(difference))
            volume += weights[1, b] * total
        sizes[0, v], sizes[1, v] = greatest, volume
        sizes[2, v], sizes[3, v] = np.sqrt(square), np.sqrt(square_of_depth)
    return sizes


@subroutine
def carried_errors(
    errors: FloatArray,
    added: FloatArray,
    loads: FloatArray,
    wear: FloatArray,
    exponents: FloatArray,
    approaches: FloatArray,
    gap: FloatArray,
    depths: FloatArray,
    bodies: IntArray,
    stiffness: FloatArray,
    spacing: float,
    weights: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """Return errors of the depths after a step, and their sizes.

    Where a groove is too deep the line load is smaller, and wear fills the error. The strips are
    taken as an elastic foundation, and all contacts of a body as wearing it by the same amount.

    Parameters
    ----------
    errors, added : ndarray, shape (bodies, realisations, strips)
        Errors of the depths before the step, and those that it adds [m].
    loads : ndarray, shape (contacts, strips)
        Line loads [N/m].
    wear, exponents : ndarray
        Wear of the step and its exponents, as in `linearised_wear`.
    approaches : ndarray, shape (contacts,)
        Approach of each contact [m].
    gap : ndarray, shape (contacts, strips)
        Gap before wear [m].
    depths : ndarray, shape (bodies, realisations, strips)
        Depths at the end of the step [m].
    bodies : ndarray of int, shape (contacts each, 2)
        Rows in `errors` of the two bodies of each contact.
    stiffness : ndarray, shape (contacts,)
        Loss of load per descent of each contact's roller [N/m].
    spacing : float
        Width of a strip [m].
    weights : ndarray, shape (2, bodies)
        As in `difference_sizes`.

    Returns
    -------
    errors : ndarray, shape (bodies, realisations, strips)
    sizes : ndarray, shape (3, realisations)
        Error of the greatest depth [m]; volume by which the errors have changed, without its sign
        [m^3]; Euclidean norm of the errors over that of the depths.
    """
    rows, realisations, n = errors.shape
    whole, carried = np.empty((rows, realisations, n)), np.empty((rows, realisations, n))
    soft, weight, own = np.empty((rows, n)), np.empty(n), np.empty((len(bodies), 2, n))
    for v in range(realisations):
        for b in range(rows):
            for i in range(n):
                soft[b, i] = 0.0
                whole[b, v, i] = carried[b, v, i] = errors[b, v, i] + added[b, v, i]
        for c in range(len(bodies)):
            k = c * realisations + v
            for side in range(2):
                for i in range(n):
                    own[c, side, i] = 0.0
                    if loads[k, i] > 0.0:
                        own[c, side, i] = exponents[k, i] * wear[side, k, i] / loads[k, i]
                        soft[bodies[c, side], i] += own[c, side, i]
        for c in range(len(bodies)):
            k, one, other = c * realisations + v, bodies[c, 0], bodies[c, 1]
            least, greatest = np.inf, 0.0
            for i in range(n):
                least = min(least, gap[k, i] + depths[one, v, i] + depths[other, v, i])
                greatest = max(greatest, loads[k, i])
            elastic = FOUNDATION * (approaches[k] - least) / greatest
            opened, held = 0.0, stiffness[k] / spacing
            for i in range(n):
                stiff = 1.0 / (elastic + soft[one, i] + soft[other, i])
                weight[i] = stiff if loads[k, i] > 0.0 else 0.0
                opened += weight[i] * (whole[one, v, i] + whole[other, v, i])
                held += weight[i]
            for i in range(n):
                change = weight[i] * (whole[one, v, i] + whole[other, v, i] - opened / held)
                carried[one, v, i] -= own[c, 0, i] * change
                carried[other, v, i] -= own[c, 1, i] * change
    sizes, found = _sizes(depths, carried, weights), np.empty((3, realisations))
    for v in range(realisations):
        deepest, volume = 0.0, 0.0
        for b in range(rows):
            change = 0.0
            for i in range(n):
                deepest = max(deepest, depths[b, v, i])
                change += carried[b, v, i] - errors[b, v, i]
            volume += weights[1, b] * change
        profile = sizes[2, v] / sizes[3, v] if sizes[3, v] > 0.0 else 0.0
        # the error of the greatest depth may cross zero
        found[0, v] = max(sizes[0, v], LEAST * profile * deepest)
        found[1, v], found[2, v] = abs(volume), profile
    return carried, found

"""Error of an implicit step, of the test so far, and the choice of the next step.

Arrays are those of `implicit_step`.
"""

from __future__ import annotations

import math

import numpy as np

from wearsim.mechanics.numerics.edge_strips import fill_resolved
from wearsim.mechanics.numerics.implicit_step import WHOLE_PASSES, compile_implicit_step
from wearsim.mechanics.numerics.jit import compile_alongside, kernel, subroutine
from wearsim.mechanics.numerics.linearised_wear import carried_errors
from wearsim.mechanics.numerics.multistep import MAX_ORDER, ROWS, next_steps
from wearsim.mechanics.numerics.young_strips import AT_START, OLD, WHOLE, mark_strips
from wearsim.types import BoolArray, FloatArray, IntArray

SHARE = 0.28  # part of the tolerance that a step may add to the profiles
# early errors decay: they may be greater, by this power of the passes done, and by the other one
# where edges are resolved
PART_EXPONENT, EDGES_EXPONENT = 0.25, 0.75
COVER = (4.0, 2.0, 6.0)  # safety factors on the errors of depth, volume, profile
# least errors of depth and profile, over that of the volume, all relative and with their factors: a
# groove of wrong volume has the wrong depth and width, which further wear does not correct
OF_VOLUME = (0.33, 0.5)
# of a step at a lower order, compared with other orders: the differences that a step leaves are
# less smooth after a change of order; where inputs vary they are not smooth at any order
KEEP = 0.9
# safety factor on local errors of strips that the edge crosses
EDGES = 6.0
# greatest order where edges are resolved within a strip: beyond the first derivative the wear of
# strips that the edge has just crossed is not smooth, and pressures would overshoot
EDGE_ORDER = 3
# part of the difference in young strips that counts as error of a step: they are not smooth enough
# for an estimate, which is too great; safety factor on errors of depth and volume then, and part of
# the usual error that a step aims at, as the pressure at the edges follows from these strips
YOUNG, OF_YOUNG, BESIDE_YOUNG = 0.2, 9.0, 0.36
# lower bounds: the depth grows with a power of 2/3 to 1 of the passes, the volume with about 1
DEPTH_EXPONENT, VOLUME_EXPONENT = 0.5, 0.75
# the error that a step aims at falls where the errors so far, over the tolerance, exceed the first
# number, to a least part of itself at the second one
ADDED_UP, LEAST_AIM = (0.75, 1.5), 0.1
# least relative error of the energy that a step aims at: no step is short enough for a smaller one,
# as iterations are not more accurate
LEAST_OF_ENERGY = 1e-5
LEAST_ENERGY = 0.1  # part of the mean energy that an error of the energy is compared with, at least


@subroutine
def with_sum(
    errors: FloatArray,
    parts: FloatArray,
    crossed: BoolArray,
    resolved: BoolArray,
    past_sums: FloatArray,
    spans: FloatArray,
    orders: IntArray,
) -> FloatArray:
    """Return errors of the depths that agree with those of their sums, which a step keeps.

    Parameters
    ----------
    errors, parts : ndarray, shape (bodies, realisations, strips)
        Errors of the depths that a step adds [m], and the part of each that counts.
    crossed, resolved
        From `mark_strips` and `fill_resolved`.
    past_sums, spans, orders
        At the end of the step.
    """
    rows, realisations, n = errors.shape
    summed = np.empty(errors.shape)
    for b in range(rows):
        for v in range(realisations):
            total, width, product, inverse, of_sum = 0.0, 0.0, 1.0, 0.0, 0.0
            for k in range(orders[v] if resolved[v] else 0):
                product, inverse = product * spans[k, v], inverse + 1.0 / spans[k, v]
                if np.isfinite(spans[k + 1, v]):
                    of_sum = product / (inverse + 1.0 / spans[k + 1, v]) * past_sums[k + 2, b, v, 0]
            for i in range(n):
                summed[b, v, i] = errors[b, v, i]
                if resolved[v]:
                    summed[b, v, i] = 0.0 if crossed[b, v, i] else errors[b, v, i]
                    total += summed[b, v, i]
                    width += 0.0 if crossed[b, v, i] else parts[b, v, i]
            if width > 0.0:
                shift = (of_sum - total) / width
                for i in range(n):
                    summed[b, v, i] += 0.0 if crossed[b, v, i] else parts[b, v, i] * shift
    return summed


@kernel
def energy_steps(
    past_sums: FloatArray,
    spans: FloatArray,
    passes_before: FloatArray,
    passes_after: FloatArray,
    energy_before: FloatArray,
    energy_after: FloatArray,
    orders: IntArray,
    tolerance: float,
    keep: float,
    most: IntArray,
    next_orders: IntArray,
) -> FloatArray:
    """Choose the next step by the error of the energy; others as of `next_steps`.

    Parameters
    ----------
    past_sums : ndarray, shape (6, sums, realisations, 1)
        After the step, that of the energy last.
    passes_before, passes_after, energy_before, energy_after : ndarray, shape (realisations,)
        Passes done and energy dissipated [J].
    """
    realisations, last = len(orders), past_sums.shape[1] - 1
    differences = np.empty((ROWS, 1, realisations, 1))
    worn, errors = np.empty((1, realisations, 1)), np.empty((1, realisations, 1))
    for v in range(realisations):
        least = LEAST_ENERGY * energy_after[v] * (1.0 - passes_before[v] / passes_after[v])
        worn[0, v, 0] = max(energy_after[v] - energy_before[v], least)
        for r in range(ROWS):
            differences[r, 0, v, 0] = past_sums[r, last, v, 0]
    return next_steps(
        differences,
        spans,
        worn,
        orders,
        np.ones(realisations),
        tolerance,
        keep,
        most,
        np.ones((1, realisations, 1)),
        errors,
        next_orders,
    )


@kernel
def assess_step(
    tolerance: float,
    left: FloatArray,
    done: FloatArray,
    passes: FloatArray,
    passes_before: FloatArray,
    passes_after: FloatArray,
    energy_before: FloatArray,
    energy_after: FloatArray,
    displaced: FloatArray,
    volume_error: FloatArray,
    irreducible: FloatArray,
    stepping_error: FloatArray,
    depths: FloatArray,
    orders: IntArray,
    spans: FloatArray,
    past_wear: FloatArray,
    past_sums: FloatArray,
    part: FloatArray,
    whole_steps: FloatArray,
    bodies: IntArray,
    gap: FloatArray,
    approach: FloatArray,
    loads: FloatArray,
    wear: FloatArray,
    exponents: FloatArray,
    stiffness: FloatArray,
    spacing: float,
    volume_weights: FloatArray,
    of_next: FloatArray,
    next_orders: IntArray,
    estimates: FloatArray,
) -> FloatArray:
    """Choose length and order of the next step, and return the errors of the test.

    Parameters
    ----------
    tolerance : float
    left : ndarray, shape (realisations,)
        From `parts_of_aim`, for the errors before the step.
    done : ndarray, shape (realisations,)
        Passes done after the step over those of the test.
    passes : ndarray, shape (realisations,)
        Length of the step.
    passes_before, passes_after, energy_before, energy_after
        As of `energy_steps`.
    displaced : ndarray, shape (realisations,)
        Displacement of a roller that the error of its load corresponds to [m]: a stiff spring holds
        the depth, and errors of its load remain.
    volume_error : ndarray, shape (realisations,)
        By steps alone, before the step [m^3].
    irreducible : ndarray, shape (3, realisations)
        Errors of depth, volume and profile after the step that no step reduces.
    stepping_error : ndarray, shape (bodies, realisations, strips)
        Errors of the depths before the step [m].
    depths : ndarray, shape (bodies, realisations, strips)
        After the step [m].
    orders, spans, past_wear, past_sums, part, whole_steps, bodies, gap
        After the step, as of `begin_step`.
    approach, loads, exponents
        Of the contacts after the step, as of `carried_errors`.
    wear : ndarray, shape (2, contacts, strips)
        Their wear per pass; overwritten with that of the step [m].
    stiffness, spacing, volume_weights
        As of `carried_errors`.
    of_next : ndarray, shape (2, realisations)
        Filled: excess of error and ratio of the next step, as of `next_steps`.
    next_orders : ndarray of int, shape (realisations,)
        Filled.
    estimates : ndarray, shape (3, realisations)
        Filled: errors of depth, volume and profile after the step.

    Returns
    -------
    ndarray, shape (bodies, realisations, strips)
        Errors of the depths after the step [m].
    """
    rows, realisations, n = depths.shape
    most, orders_by_energy = np.empty(realisations, np.int64), np.empty(realisations, np.int64)
    resolved = np.empty(realisations, np.bool_)
    fill_resolved(part, part, resolved)
    young, crossed = np.empty(depths.shape, np.int64), np.empty(depths.shape, np.bool_)
    parts, own = np.empty(depths.shape), np.empty(depths.shape)
    mark_strips(bodies, resolved, part, whole_steps, orders, past_wear[0], young, crossed, parts)
    scale, discounted = np.empty(realisations), np.empty(realisations, np.bool_)
    for v in range(realisations):
        discounted[v] = False
        for b in range(rows):
            for i in range(n):
                if young[b, v, i] != OLD:
                    parts[b, v, i] *= YOUNG
                    discounted[v] = True
        most[v] = EDGE_ORDER if resolved[v] else MAX_ORDER
        aim = left[v] * (BESIDE_YOUNG if discounted[v] else 1.0)
        scale[v] = done[v] ** (EDGES_EXPONENT if resolved[v] else PART_EXPONENT) / aim
    by_depths = next_steps(
        past_wear,
        spans,
        depths,
        orders,
        scale,
        SHARE * tolerance,
        KEEP,
        most,
        parts,
        own,
        next_orders,
    )
    by_energy = energy_steps(
        past_sums,
        spans,
        passes_before,
        passes_after,
        energy_before,
        energy_after,
        orders,
        max(tolerance, LEAST_OF_ENERGY),
        KEEP,
        most,
        orders_by_energy,
    )
    for v in range(realisations):
        if by_energy[1, v] < by_depths[1, v]:
            next_orders[v] = orders_by_energy[v]
        # the error so far shortens the next step
        of_next[0, v] = max(by_depths[0, v] * left[v], by_energy[0, v])
        of_next[1, v] = min(by_depths[1, v], by_energy[1, v])
    # without half a pass, the wear of a pass is that after it instead of before it
    for b in range(rows):
        for v in range(realisations):
            for i in range(n if passes[v] <= WHOLE_PASSES else 0):
                own[b, v, i] *= 2.0
    added = with_sum(own, parts, crossed, resolved, past_sums, spans, orders)
    for k in range(len(gap)):
        for side in range(2):
            for i in range(n):
                wear[side, k, i] *= passes[k % realisations]
    errors, sizes = carried_errors(
        stepping_error,
        added,
        loads,
        wear,
        exponents,
        approach,
        gap,
        depths,
        bodies,
        stiffness,
        spacing,
        volume_weights,
    )
    for v in range(realisations):
        deepest, volume, of_edges, square = 0.0, 0.0, 0.0, 0.0
        # error of steps of first order
        factor = spans[0, v] / (1.0 / spans[0, v] + 1.0 / spans[1, v])
        factor = factor if np.isfinite(spans[1, v]) else 0.0
        for b in range(rows):
            total = 0.0
            for i in range(n):
                depth, at_edge = depths[b, v, i], 0.0
                deepest, total = max(deepest, depth), total + depth
                square += depth * depth
                if resolved[v]:
                    at_edge = own[b, v, i] if crossed[b, v, i] else 0.0
                    if young[b, v, i] != OLD and past_wear[0, b, v, i] > 0.0:
                        weight = 1.0 - 2.0 * AT_START if young[b, v, i] == WHOLE else 1.0
                        at_edge += weight * factor * past_wear[2, b, v, i]
                of_edges += (EDGES * at_edge) * (EDGES * at_edge)
            volume += volume_weights[1, b] * total
        sizes[0, v] += displaced[v]
        if displaced[v] > 0.0:
            sizes[2, v] += displaced[v] / deepest
        if resolved[v]:
            relative = of_edges / square if square > 0.0 else 0.0
            sizes[2, v] = math.sqrt(sizes[2, v] * sizes[2, v] + relative)
        if discounted[v]:
            sizes[0, v], sizes[1, v] = OF_YOUNG * sizes[0, v], OF_YOUNG * sizes[1, v]
        # the error of the volume may cross zero
        of_test = COVER[1] * sizes[1, v] + volume_error[v]
        relative_size = of_test / volume if volume > 0.0 else 0.0
        depth = max(COVER[0] * sizes[0, v], OF_VOLUME[0] * relative_size * deepest)
        profile = max(COVER[2] * sizes[2, v], OF_VOLUME[1] * relative_size)
        estimates[0, v] = depth + irreducible[0, v]
        estimates[1, v] = of_test + irreducible[1, v]
        estimates[2, v] = profile + irreducible[2, v]
    return errors


@kernel
def parts_of_aim(
    tolerance: float,
    done: FloatArray,
    of_volume: float,
    of_profile: float,
    volume_error: FloatArray,
    profile_error: FloatArray,
    irreducible: FloatArray,
    depths: FloatArray,
    separation: FloatArray,
    part: FloatArray,
    volume_weights: FloatArray,
    parts: FloatArray,
) -> None:
    """Find the part of its usual error that a step aims at, by the errors before it.

    Errors of the volume add up during a test if they have the same sign. Where edges are resolved,
    the error of the profile is that of the strips that an edge has just crossed. It decays as these
    are worn further, and depends on where within a strip the edge is at the end of a step: step
    lengths that followed it would alternate between long and short.

    Parameters
    ----------
    tolerance : float
    done : ndarray, shape (realisations,)
        Passes done over those of the test.
    of_volume, of_profile : float
        Safety factors that the errors contain.
    volume_error, profile_error : ndarray, shape (realisations,)
        Before the step [m^3], and relative.
    irreducible, depths, separation, part, volume_weights
        As of `assess_step` and `begin_step`, before the step.
    parts : ndarray, shape (realisations,)
        Result.
    """
    bodies, realisations, n = depths.shape
    low, high = ADDED_UP
    resolved = np.empty(realisations, np.bool_)
    fill_resolved(separation, part, resolved)
    parts[:] = 1.0
    for v in range(realisations):
        # `assess_step` makes the error of the profile at least this part of that of the volume
        if profile_error[v] < OF_VOLUME[1] * low * tolerance:
            continue
        volume = 0.0
        for b in range(bodies):
            total = 0.0
            for i in range(n):
                total += depths[b, v, i]
            volume += volume_weights[1, b] * total
        if volume > 0.0:
            relative_size = (volume_error[v] - irreducible[1, v]) / of_volume / volume
            profile = (profile_error[v] - irreducible[2, v]) / of_profile
            profile = 0.0 if resolved[v] else profile
            relative_size *= done[v] ** VOLUME_EXPONENT
            worst = max(relative_size, profile * done[v] ** DEPTH_EXPONENT) / tolerance
            parts[v] = min(max((high - worst) / (high - low), LEAST_AIM), 1.0)


def compile_step_errors() -> None:
    """Compile the kernels of a step's error, and then those of the step, for one strip."""
    one, order, errors = np.ones(1), np.ones(1, np.int64), np.ones((3, 1))
    strip, wear, rows = np.ones((1, 1)), np.ones((2, 1, 1)), np.ones((2, 1, 1))
    past, sums, spans = np.ones((ROWS, 2, 1, 1)), np.ones((ROWS, 3, 1, 1)), np.ones((ROWS - 1, 1))
    assess_step(
        *(1e-3, one, one, one, one, one, one, one, one, one, errors, rows, rows, order),
        *(spans, past, sums, strip, strip, np.array([[0, 1]]), strip, one, strip, wear, strip),
        *(one, 1.0, np.ones((2, 2)), rows[:, 0], order, errors),
    )
    parts_of_aim(
        1e-3, one, 1.0, 1.0, one, one, errors, rows, strip, strip, np.ones((2, 2)), one.copy()
    )
    compile_implicit_step()


compile_alongside(
    *("solve_slender", compile_step_errors, "assess_step", "next_steps", "energy_steps"),
    *("parts_of_aim", "begin_step", "linearise_step", "compare_step", "end_step"),
)

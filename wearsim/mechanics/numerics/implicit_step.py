"""Kernels of an implicit step: its formula, the wear about a solution, its end and its error.

Arrays over bodies have the shape (bodies, realisations, strips), the stations of the cylinder
first, as `WearState.stacked`; arrays over contacts have the shape (contacts, strips), contact
number c * realisations + v. Arrays of the edges of contacts have no strips where no test of a batch
resolves edges, see `evolution.steppers.edges`.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from wearsim.mechanics.numerics.edge_strips import (
    EdgeStrips,
    compare_edges,
    end_edges,
    fill_separations,
    linearise_edges,
    mark_strips,
    resolved_tests,
    start_edges,
)
from wearsim.mechanics.numerics.jit import borrowed, compile_alongside, kept, kernel
from wearsim.mechanics.numerics.linearised_wear import linearised_wear, wear_of_bodies
from wearsim.mechanics.numerics.multistep import ROWS, extrapolated, formulas, new_differences
from wearsim.types import BoolArray, FloatArray, IntArray

WHOLE_PASSES = 2.0  # steps above which passes are counted one by one
OF_EDGES = 10.0  # change by which strips partly in contact have converged, over that of the others


@kernel
def begin_step(
    spans: FloatArray,
    orders: IntArray,
    passes: FloatArray,
    exposure: FloatArray,
    mean_exposure: FloatArray,
    past_wear: FloatArray,
    past_sums: FloatArray,
    past_feedback: FloatArray,
    depths: FloatArray,
    bodies: IntArray,
    gap: FloatArray,
    approach: FloatArray,
    wear: FloatArray,
    share: FloatArray,
    separation: FloatArray,
    part: FloatArray,
    whole_steps: FloatArray,
    in_groove: BoolArray,
) -> tuple[Any, ...]:
    """Return the formula of a step for all bodies and contacts.

    Parameters
    ----------
    spans : ndarray, shape (5, realisations)
        As in `formulas`, as exposure.
    orders : ndarray of int, shape (realisations,)
    passes, exposure, mean_exposure : ndarray, shape (realisations,)
        Length of the step, exposure per pass at its end, and its mean.
    past_wear : ndarray, shape (6, bodies, realisations, strips)
    past_sums, past_feedback : ndarray, shape (6, rows, realisations, 1)
        Rates and differences, as in `WearState`.
    depths : ndarray, shape (bodies, realisations, strips)
        Depths at the start [m].
    bodies, gap, share
        As in `EdgeStrips` and `fill_separations`.
    approach : ndarray, shape (contacts,)
        Approach of each contact [m].
    wear : ndarray, shape (2, contacts, strips)
        Wear of both bodies per pass at the start; overwritten with that by the formula [m].
    separation, part, whole_steps : ndarray, shape (contacts, strips or 0)
        As in `WearState`.
    in_groove : ndarray of bool, shape (realisations,)
        Tests in a groove, where strips in contact as wholes are counted: there is no separation.

    Returns
    -------
    worn_passes, half_pass : ndarray, shape (realisations,)
        Passes of the wear at the end, and half a pass in long steps.
    distances : ndarray, shape (5, realisations)
        `spans` of the end.
    scale : ndarray, shape (bodies, realisations, strips)
        What `worn_passes` are multiplied by in strips that follow the formula of first order.
    level, added, base, guess : ndarray, shape (bodies, realisations, strips)
        Depths less separations at the start, their increase without the wear at the end, the sum of
        both, and predicted depths [m].
    sums, feedback : ndarray, shape (rows, realisations, 1)
        Increase of the sums without the wear at the end, and predicted feedback [N].
    resolved : ndarray of bool, shape (realisations,)
        Tests that resolve edges.
    first, rise : ndarray, shape (contacts, strips)
    greatest : ndarray, shape (bodies, realisations, strips)
        As in `EdgeStrips`.
    contact_depth : ndarray, shape (contacts, strips)
        Predicted depth of both bodies of each contact [m].
    """
    rows, realisations, n = depths.shape
    lengths, half_pass = np.empty(realisations), np.empty(realisations)
    factor, worn_passes = np.empty(realisations), np.empty(realisations)
    weights, distances = np.empty((2, ROWS, realisations)), np.empty((ROWS - 1, realisations))
    for v in range(realisations):
        lengths[v] = mean_exposure[v] * passes[v]
        half_pass[v] = 0.5 if passes[v] > WHOLE_PASSES else 0.0
    formulas(spans, lengths, orders, half_pass, weights, factor, distances)
    for v in range(realisations):
        worn_passes[v] = factor[v] / exposure[v] - half_pass[v]
    resolved = resolved_tests(separation, part, realisations)
    marked = np.empty(realisations, np.bool_)
    for v in range(realisations):
        marked[v] = resolved[v] or in_groove[v]
    shape = depths.shape
    young, crossed = np.empty(shape, np.bool_), np.empty(shape, np.bool_)
    scale, level, base = np.empty(shape), np.empty(shape), np.empty(shape)
    greatest = np.empty(shape)
    mark_strips(bodies, marked, part, whole_steps, orders, past_wear[0], young, crossed, scale)
    fill_separations(bodies, resolved, separation, share, level)
    added, guess = extrapolated(weights, past_wear)
    for b in range(rows):
        for v in range(realisations):
            first_order = (lengths[v] / exposure[v] - half_pass[v]) / worn_passes[v]
            for i in range(n):
                scale[b, v, i] = 1.0
                if young[b, v, i]:
                    scale[b, v, i] = first_order
                    added[b, v, i] = half_pass[v] * past_wear[0, b, v, i]
                level[b, v, i] = depths[b, v, i] - level[b, v, i]
                base[b, v, i] = level[b, v, i] + added[b, v, i]
                guess[b, v, i] += level[b, v, i]
    sums, feedback = extrapolated(weights, past_sums)[0], extrapolated(weights, past_feedback)[1]
    for f in range(feedback.shape[0]):
        for v in range(realisations):
            feedback[f, v, 0] += (1.0 - half_pass[v]) * past_feedback[0, f, v, 0]
    first, rise, contact_depth = np.empty(gap.shape), np.empty(gap.shape), np.empty(gap.shape)
    strips = borrowed(
        EdgeStrips(bodies, resolved, gap, depths, added, base, part, first, rise, greatest)
    )
    start_edges(strips, separation, approach)
    for k in range(len(gap)):
        v = k % realisations
        one, other = bodies[k // realisations, 0], bodies[k // realisations, 1]
        for i in range(n):
            contact_depth[k, i] = guess[one, v, i] + guess[other, v, i]
            wear[0, k, i] *= worn_passes[v] * scale[one, v, i]
            wear[1, k, i] *= worn_passes[v] * scale[other, v, i]
    kept((resolved, added, base, first, rise, greatest))
    return (
        worn_passes,
        half_pass,
        distances,
        scale,
        level,
        added,
        base,
        guess,
        sums,
        feedback,
        resolved,
        first,
        rise,
        greatest,
        contact_depth,
    )


@kernel
def linearise_step(
    bodies: IntArray,
    resolved: BoolArray,
    gap: FloatArray,
    depths: FloatArray,
    added: FloatArray,
    base: FloatArray,
    part: FloatArray,
    first: FloatArray,
    rise: FloatArray,
    greatest: FloatArray,
    contact_depth: FloatArray,
    line_load: FloatArray,
    wear: FloatArray,
    exponents: FloatArray,
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray]:
    """Linearise the wear of a step about a solution of the contacts.

    Parameters
    ----------
    bodies, resolved, gap, depths, added, base, part, first, rise, greatest, contact_depth
        As in `begin_step`.
    line_load, exponents : ndarray, shape (contacts, strips)
    wear : ndarray, shape (2, contacts, strips)
        As in `linearised_wear`.

    Returns
    -------
    gaps, slopes : ndarray, shape (contacts, strips)
        From `linearise_edges`.
    compliance : ndarray, shape (realisations, contacts each, 2, strips)
    opened : ndarray, shape (contacts, strips)
    constant : ndarray, shape (2, contacts, strips)
        From `linearised_wear`.
    """
    gaps, slopes, opened = np.empty(gap.shape), np.empty(gap.shape), np.empty(gap.shape)
    strips = borrowed(
        EdgeStrips(bodies, resolved, gap, depths, added, base, part, first, rise, greatest)
    )
    linearise_edges(strips, contact_depth, wear, gaps, slopes)
    compliance = np.empty((len(resolved), len(bodies), 2, gap.shape[1]))
    constant = linearised_wear(line_load, wear, exponents, slopes, bodies, gaps, compliance, opened)
    return gaps, slopes, compliance, opened, constant


@kernel
def compare_step(
    bodies: IntArray,
    resolved: BoolArray,
    gap: FloatArray,
    depths: FloatArray,
    added: FloatArray,
    base: FloatArray,
    part: FloatArray,
    first: FloatArray,
    rise: FloatArray,
    greatest: FloatArray,
    contact_depth: FloatArray,
    line_load: FloatArray,
    wear: FloatArray,
    exponents: FloatArray,
    gaps: FloatArray,
    slopes: FloatArray,
    compliance: FloatArray,
    constant: FloatArray,
    loads: FloatArray,
    apart: FloatArray,
    new_wear: FloatArray,
    worn_passes: FloatArray,
    scale: FloatArray,
    greatest_exponent: float,
    active: BoolArray,
) -> tuple[FloatArray, FloatArray]:
    """Compare the wear of a new solution of the contacts with that linearised about another one.

    Parameters
    ----------
    bodies, ..., greatest
        As in `begin_step`.
    contact_depth, exponents : ndarray, shape (contacts, strips)
        Updated by the solution.
    line_load, wear, gaps, slopes, compliance, constant
        Arguments and results of `linearise_step`.
    loads, apart : ndarray, shape (contacts, strips)
        Line loads [N/m] and separations of the solution [m].
    new_wear : ndarray, shape (2, contacts, strips)
        Its wear per pass; overwritten with that by the formula [m].
    worn_passes, scale
        From `begin_step`.
    greatest_exponent : float
        Upper bound of the exponents.
    active : ndarray of bool, shape (realisations,)
        Realisations that have not converged yet.

    Returns
    -------
    worn : ndarray, shape (bodies, realisations, strips)
        Wear of the bodies by the formula [m].
    sizes : ndarray, shape (3, realisations)
        As of `wear_of_bodies`.
    """
    realisations, n = len(active), gap.shape[1]
    for k in range(len(gap)):
        v = k % realisations
        for side in range(2):
            b = bodies[k // realisations, side]
            for i in range(n):
                new_wear[side, k, i] *= worn_passes[v] * scale[b, v, i]
    worn, linear = np.empty(depths.shape), np.empty(gap.shape)
    sizes = wear_of_bodies(
        loads,
        line_load,
        new_wear,
        wear,
        compliance,
        constant,
        bodies,
        base,
        greatest_exponent,
        slopes,
        active,
        exponents,
        worn,
        linear,
    )
    strips = borrowed(
        EdgeStrips(bodies, resolved, gap, depths, added, base, part, first, rise, greatest)
    )
    of_edges = compare_edges(
        strips, active, gaps, slopes, linear, apart, loads, new_wear, contact_depth
    )
    for v in range(realisations):
        sizes[0, v] = max(sizes[0, v], of_edges[v] / OF_EDGES)
    return worn, sizes


@kernel
def end_step(
    bodies: IntArray,
    resolved: BoolArray,
    gap: FloatArray,
    depths: FloatArray,
    added: FloatArray,
    base: FloatArray,
    part: FloatArray,
    first: FloatArray,
    rise: FloatArray,
    greatest: FloatArray,
    contact_depth: FloatArray,
    separation: FloatArray,
    whole_steps: FloatArray,
    share: FloatArray,
    loads: FloatArray,
    wear: FloatArray,
    worn: FloatArray,
    worn_passes: FloatArray,
    half_pass: FloatArray,
    distances: FloatArray,
    scale: FloatArray,
    level: FloatArray,
    sums: FloatArray,
    feedback: FloatArray,
    energy: FloatArray,
    past_wear: FloatArray,
    past_sums: FloatArray,
    past_feedback: FloatArray,
) -> tuple[Any, ...]:
    """Return depths, fields about the edges, and differences at the end of a step.

    The depths of strips partly in contact follow from their shape, which keeps no volume. What is
    missing to the volume by the formula is added evenly where the bodies are in contact, which
    changes no pressure.

    Parameters
    ----------
    bodies, ..., greatest
        As in `begin_step`.
    contact_depth, loads, wear, worn
        Of the solution, from `compare_step`.
    separation, whole_steps, share, past_wear, past_sums, past_feedback
        As in `begin_step`.
    worn_passes, half_pass, distances, scale, level, sums
        From `begin_step`.
    feedback : ndarray, shape (rows, realisations, 1)
        At the end [N].
    energy : ndarray, shape (realisations,)
        Dissipated energy per pass at the end [J].

    Returns
    -------
    ends : ndarray, shape (bodies, realisations, strips)
        Depths at the end [m].
    fields : ndarray, shape (3, contacts, strips)
        As of `end_edges`.
    new_wear, new_sums, new_feedback : ndarray
        Rates and differences at the end.
    dissipated : ndarray, shape (realisations,)
        Energy of the step [J].
    decreased : ndarray of bool, shape (realisations,)
        Whether a depth or the energy has decreased.
    """
    rows, realisations, n = depths.shape
    strips = borrowed(
        EdgeStrips(bodies, resolved, gap, depths, added, base, part, first, rise, greatest)
    )
    shape = depths.shape
    ends, parts, rates, change = np.empty(shape), np.empty(shape), np.empty(shape), np.empty(shape)
    fields = np.empty((3 if part.shape[1] > 0 else 0, part.shape[0], part.shape[1]))
    counted = part.shape[1] > separation.shape[1]
    end_edges(strips, counted, whole_steps, contact_depth, loads, wear, worn, ends, parts, fields)
    sum_rates = np.empty(sums.shape)
    for b in range(rows):
        for v in range(realisations):
            total, grown, width = 0.0, 0.0, 0.0
            for i in range(n):
                rates[b, v, i] = worn[b, v, i] / worn_passes[v] / scale[b, v, i]
                total += rates[b, v, i]
                grown += ends[b, v, i] - depths[b, v, i]
                width += parts[b, v, i]
            if b < len(sums) - 1:
                sum_rates[b, v, 0] = total
                sums[b, v, 0] += worn_passes[v] * total
                if (resolved[v] or counted) and width > 0.0:
                    missing = (sums[b, v, 0] - grown) / width
                    for i in range(n):
                        ends[b, v, i] += missing * parts[b, v, i]
    last, dissipated = len(sums) - 1, np.empty(realisations)
    decreased = np.empty(realisations, np.bool_)
    for v in range(realisations):
        sum_rates[last, v, 0] = energy[v]
        sums[last, v, 0] += worn_passes[v] * energy[v]
        dissipated[v] = sums[last, v, 0]
        decreased[v] = dissipated[v] < 0.0
    for b in range(rows):
        for v in range(realisations):
            for i in range(n):
                change[b, v, i] = 0.0
    if separation.shape[1] > 0:
        fill_separations(bodies, resolved, fields[0], share, change)
    for b in range(rows):
        for v in range(realisations):
            for i in range(n):
                decreased[v] = decreased[v] or ends[b, v, i] < depths[b, v, i]
                if resolved[v] or counted:
                    change[b, v, i] = ends[b, v, i] - change[b, v, i] - level[b, v, i]
                else:
                    change[b, v, i] = added[b, v, i] + worn[b, v, i]
    new_wear = new_differences(rates, change, half_pass, past_wear, distances)
    new_sums = new_differences(sum_rates, sums, half_pass, past_sums, distances)
    moved, whole = np.empty(feedback.shape), np.zeros(realisations)
    for f in range(feedback.shape[0]):
        for v in range(realisations):
            moved[f, v, 0] = feedback[f, v, 0] - past_feedback[0, f, v, 0]
    new_feedback = new_differences(feedback, moved, whole, past_feedback, distances)
    return ends, fields, new_wear, new_sums, new_feedback, dissipated, decreased


def compile_implicit_step() -> None:
    """Compile the kernels of a step by calls for one contact of one strip."""
    one, order, bodies = np.ones(1), np.ones(1, np.int64), np.array([[0, 1]])
    strip, wear, rows = np.ones((1, 1)), np.ones((2, 1, 1)), np.ones((2, 1, 1))
    past, sums, spans = np.ones((ROWS, 2, 1, 1)), np.ones((ROWS, 1, 1, 1)), np.ones((ROWS - 1, 1))
    start = begin_step(
        *(spans, order, one, one, one, past, sums, sums, rows, bodies, strip, one, wear, one),
        *(strip, strip, strip, np.ones(1, np.bool_)),
    )
    worn_passes, half_pass, distances, scale, level, added, base, _, totals, feedback = start[:10]
    resolved, first, rise, greatest, depth = start[10:]
    strips = bodies, resolved, strip, rows, added, base, strip, first, rise, greatest, depth
    about = strip, wear, strip.copy()
    gaps, slopes, compliance, _, constant = linearise_step(*strips, *about)
    worn, _ = compare_step(
        *(*strips, *about, gaps, slopes, compliance, constant, strip, strip, wear.copy()),
        *(worn_passes, scale, 1.0, resolved),
    )
    end_step(
        *(*strips, strip, strip, one, strip, wear, worn, worn_passes, half_pass, distances, scale),
        *(level, totals, feedback, one, past, sums, sums),
    )


compile_alongside("solve_slender", compile_implicit_step)

"""Kernels of an implicit step: its formula, the wear about a solution, its end and its error.

Arrays over bodies have the shape (bodies, realisations, strips), the stations of the cylinder
first, as `WearState.stacked`; arrays over contacts have the shape (contacts, strips), contact
number c * realisations + v. Arrays of the edges of contacts have no strips where no test of a batch
resolves edges, see `evolution.steppers.edges`.
"""

from __future__ import annotations

import numpy as np

from wearsim.mechanics.numerics.edge_strips import (
    OF_EDGES,
    compare_edges,
    edge_strips,
    end_edges,
    fill_resolved,
    fill_separations,
    linearise_edges,
    own_side,
    start_edges,
)
from wearsim.mechanics.numerics.jit import borrowed, kernel
from wearsim.mechanics.numerics.linearised_wear import linearised_wear, wear_of_bodies
from wearsim.mechanics.numerics.multistep import ROWS, extrapolated, formulas, new_differences
from wearsim.mechanics.numerics.young_strips import AT_START, OLD, WHOLE, mark_strips
from wearsim.types import BoolArray, FloatArray, IntArray

WHOLE_PASSES = 2.0  # steps above which passes are counted one by one


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
    resolved: BoolArray,
    of_tests: FloatArray,
    sums: FloatArray,
    feedback: FloatArray,
    of_bodies: FloatArray,
    of_contacts: FloatArray,
) -> None:
    """Compute the formula of a step for all bodies and contacts.

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
    resolved : ndarray of bool, shape (realisations,)
        Result: tests that resolve edges.
    of_tests : ndarray, shape (7, realisations)
        Results: passes of the wear at the end, half a pass in long steps, and `spans` of the end.
    sums, feedback : ndarray, shape (rows, realisations, 1)
        Results: increase of the sums without the wear at the end, and predicted feedback [N].
    of_bodies : ndarray, shape (6, bodies, realisations, strips)
        Results: what the passes of the wear are multiplied by in young strips, which both bodies of
        a contact take from the one that is its own; depths less separations at the start, their
        increase without the wear at the end, the sum of both, and predicted depths [m]; `greatest`
        of `EdgeStrips`.
    of_contacts : ndarray, shape (3, contacts, strips)
        Results: `first` and `rise` of `EdgeStrips`, and the predicted depth of both bodies [m].
    """
    rows, realisations, n = depths.shape
    lengths, factor = np.empty(realisations), np.empty(realisations)
    worn_passes, half_pass, distances = of_tests[0], of_tests[1], of_tests[2:]
    scale, level, added = of_bodies[0], of_bodies[1], of_bodies[2]
    base, guess, contact_depth = of_bodies[3], of_bodies[4], of_contacts[2]
    weights = np.empty((2, ROWS, realisations))
    for v in range(realisations):
        lengths[v] = mean_exposure[v] * passes[v]
        half_pass[v] = 0.5 if passes[v] > WHOLE_PASSES else 0.0
    formulas(spans, lengths, orders, half_pass, weights, factor, distances)
    for v in range(realisations):
        worn_passes[v] = factor[v] / exposure[v] - half_pass[v]
    fill_resolved(separation, part, resolved)
    marked = np.empty(realisations, np.bool_)
    for v in range(realisations):
        marked[v] = resolved[v] or in_groove[v]
    shape = depths.shape
    young, crossed = np.empty(shape, np.int64), np.empty(shape, np.bool_)
    mark_strips(bodies, marked, part, whole_steps, orders, past_wear[0], young, crossed, scale)
    fill_separations(bodies, resolved, separation, share, level)
    extrapolated(weights[0], past_wear, added)
    extrapolated(weights[1], past_wear, guess)
    for b in range(rows):
        for v in range(realisations):
            length = lengths[v] / exposure[v]
            for i in range(n):
                scale[b, v, i] = 1.0
                if young[b, v, i] != OLD:
                    weighted = resolved[v] and young[b, v, i] == WHOLE
                    before = max(AT_START * length if weighted else 0.0, half_pass[v])
                    scale[b, v, i] = (length - before) / worn_passes[v]
                    added[b, v, i] = before * past_wear[0, b, v, i]
                level[b, v, i] = depths[b, v, i] - level[b, v, i]
                base[b, v, i] = level[b, v, i] + added[b, v, i]
                guess[b, v, i] += level[b, v, i]
    extrapolated(weights[0], past_sums, sums)
    extrapolated(weights[1], past_feedback, feedback)
    for f in range(feedback.shape[0]):
        for v in range(realisations):
            feedback[f, v, 0] += (1.0 - half_pass[v]) * past_feedback[0, f, v, 0]
    strips = borrowed(edge_strips(bodies, resolved, gap, depths, part, of_bodies, of_contacts))
    start_edges(strips, separation, approach)
    for k in range(len(gap)):
        c, v = k // realisations, k % realisations
        own = bodies[c, own_side(bodies)]
        for i in range(n):
            contact_depth[k, i] = guess[bodies[c, 0], v, i] + guess[bodies[c, 1], v, i]
            wear[0, k, i] *= worn_passes[v] * scale[own, v, i]
            wear[1, k, i] *= worn_passes[v] * scale[own, v, i]


@kernel
def linearise_step(
    bodies: IntArray,
    resolved: BoolArray,
    gap: FloatArray,
    depths: FloatArray,
    part: FloatArray,
    of_bodies: FloatArray,
    of_contacts: FloatArray,
    line_load: FloatArray,
    wear: FloatArray,
    exponents: FloatArray,
    active: BoolArray,
    about: FloatArray,
    compliance: FloatArray,
) -> None:
    """Linearise the wear of a step about a solution of the contacts.

    Parameters
    ----------
    bodies, resolved, gap, depths, part, of_bodies, of_contacts
        As in `begin_step`.
    line_load, exponents : ndarray, shape (contacts, strips)
    wear : ndarray, shape (2, contacts, strips)
        As in `linearised_wear`.
    active : ndarray of bool, shape (realisations,)
        Realisations that have not converged yet; the results of others remain.
    about : ndarray, shape (5, contacts, strips)
        Results: `gaps` and `slopes` of `linearise_edges`; `opened` and both rows of `constant` of
        `linearised_wear`.
    compliance : ndarray, shape (realisations, contacts each, 2, strips)
        Result of `linearised_wear`.
    """
    gaps, slopes = about[0], about[1]
    strips = borrowed(edge_strips(bodies, resolved, gap, depths, part, of_bodies, of_contacts))
    linearise_edges(strips, active, of_contacts[2], wear, gaps, slopes)
    linearised_wear(
        line_load, wear, exponents, slopes, bodies, gaps, active, compliance, about[2], about[3:]
    )


@kernel
def compare_step(
    bodies: IntArray,
    resolved: BoolArray,
    gap: FloatArray,
    depths: FloatArray,
    part: FloatArray,
    of_bodies: FloatArray,
    of_contacts: FloatArray,
    line_load: FloatArray,
    wear: FloatArray,
    exponents: FloatArray,
    about: FloatArray,
    compliance: FloatArray,
    loads: FloatArray,
    apart: FloatArray,
    new_wear: FloatArray,
    worn_passes: FloatArray,
    greatest_exponent: float,
    active: BoolArray,
    worn: FloatArray,
    sizes: FloatArray,
) -> None:
    """Compare the wear of a new solution of the contacts with that linearised about another one.

    Parameters
    ----------
    bodies, resolved, gap, depths, part, of_bodies, of_contacts
        As in `begin_step`.
    exponents : ndarray, shape (contacts, strips)
        Updated by the solution, as is the depth of both bodies in `of_contacts`.
    line_load, wear, about, compliance
        Arguments and results of `linearise_step`.
    loads, apart : ndarray, shape (contacts, strips)
        Line loads [N/m] and separations of the solution [m].
    new_wear : ndarray, shape (2, contacts, strips)
        Its wear per pass; overwritten with that by the formula [m].
    worn_passes : ndarray, shape (realisations,)
        From `begin_step`.
    greatest_exponent : float
        Upper bound of the exponents.
    active : ndarray of bool, shape (realisations,)
        Realisations that have not converged yet; the results of others remain.
    worn : ndarray, shape (bodies, realisations, strips)
        Result: wear of the bodies by the formula [m].
    sizes : ndarray, shape (3, realisations)
        Result: as of `wear_of_bodies`.
    """
    realisations, n, scale = len(active), gap.shape[1], of_bodies[0]
    slopes, linear = about[1], np.empty(gap.shape)
    for k in range(len(gap)):
        v = k % realisations
        own = bodies[k // realisations, own_side(bodies)]
        for side in range(2):
            for i in range(n):
                new_wear[side, k, i] *= worn_passes[v] * scale[own, v, i]
    sizes[:] = wear_of_bodies(
        loads,
        line_load,
        new_wear,
        wear,
        compliance,
        about[3:],
        bodies,
        of_bodies[3],
        greatest_exponent,
        slopes,
        active,
        exponents,
        worn,
        linear,
    )
    strips = borrowed(edge_strips(bodies, resolved, gap, depths, part, of_bodies, of_contacts))
    of_edges = compare_edges(
        strips, active, about[0], slopes, linear, apart, loads, new_wear, of_contacts[2]
    )
    for v in range(realisations):
        sizes[0, v] = max(sizes[0, v], of_edges[v] / OF_EDGES)


@kernel
def end_step(
    bodies: IntArray,
    resolved: BoolArray,
    gap: FloatArray,
    depths: FloatArray,
    part: FloatArray,
    of_bodies: FloatArray,
    of_contacts: FloatArray,
    separation: FloatArray,
    whole_steps: FloatArray,
    share: FloatArray,
    loads: FloatArray,
    wear: FloatArray,
    worn: FloatArray,
    of_tests: FloatArray,
    sums: FloatArray,
    feedback: FloatArray,
    power: FloatArray,
    energy_weights: FloatArray,
    past_wear: FloatArray,
    past_sums: FloatArray,
    past_feedback: FloatArray,
    energy: FloatArray,
    ends: FloatArray,
    fields: FloatArray,
    new_wear: FloatArray,
    new_sums: FloatArray,
    new_feedback: FloatArray,
    decreased: BoolArray,
) -> None:
    """Compute depths, fields about the edges, and differences at the end of a step.

    The depths of strips partly in contact follow from their shape, which keeps no volume. What is
    missing to the volume by the formula is added evenly where the bodies are in contact, which
    changes no pressure.

    Parameters
    ----------
    bodies, resolved, gap, depths, part, of_bodies, of_contacts
        As in `begin_step`.
    loads, wear, worn
        Of the solution, from `compare_step`.
    separation, whole_steps, share, past_wear, past_sums, past_feedback
        As in `begin_step`.
    of_tests, sums
        From `begin_step`.
    feedback : ndarray, shape (rows, realisations, 1)
        At the end [N].
    power : ndarray, shape (contacts,)
        Dissipated power of each contact at the end [W].
    energy_weights : ndarray, shape (contacts each,)
        Energy per pass of one test for a power of 1 W of each of its contacts [J].
    energy : ndarray, shape (realisations,)
        Result: dissipated energy of the step [J].
    ends : ndarray, shape (bodies, realisations, strips)
        Result: depths at the end [m].
    fields : ndarray, shape (3, contacts, strips), or (0, 0, 0)
        Result, as of `end_edges`.
    new_wear, new_sums, new_feedback : ndarray
        Results: rates and differences at the end.
    decreased : ndarray of bool, shape (realisations,)
        Result: whether a depth or the energy has decreased.
    """
    rows, realisations, n = depths.shape
    strips = borrowed(edge_strips(bodies, resolved, gap, depths, part, of_bodies, of_contacts))
    shape = depths.shape
    parts, rates, change = np.empty(shape), np.empty(shape), np.empty(shape)
    worn_passes, half_pass, distances = of_tests[0], of_tests[1], of_tests[2:]
    scale, level, added = of_bodies[0], of_bodies[1], of_bodies[2]
    counted = part.shape[1] > separation.shape[1]
    end_edges(strips, counted, whole_steps, of_contacts[2], loads, wear, worn, ends, parts, fields)
    sum_rates, rates[:] = np.empty(sums.shape), 0.0
    for k in range(len(gap)):
        c, v = k // realisations, k % realisations
        own = bodies[c, own_side(bodies)]
        for side in range(2):
            for i in range(n):
                of_contact = wear[side, k, i] / worn_passes[v] / scale[own, v, i]
                rates[bodies[c, side], v, i] += of_contact
    for b in range(rows):
        for v in range(realisations):
            total, grown, width = 0.0, 0.0, 0.0
            for i in range(n):
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
    last = len(sums) - 1
    for v in range(realisations):
        sum_rates[last, v, 0] = 0.0
        for c in range(len(energy_weights)):
            sum_rates[last, v, 0] += energy_weights[c] * power[c * realisations + v]
        sums[last, v, 0] += worn_passes[v] * sum_rates[last, v, 0]
        energy[v] = sums[last, v, 0]
        decreased[v] = energy[v] < 0.0
    change[:] = 0.0
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
    new_differences(rates, change, half_pass, past_wear, distances, new_wear)
    new_differences(sum_rates, sums, half_pass, past_sums, distances, new_sums)
    moved, whole = np.empty(feedback.shape), np.zeros(realisations)
    for f in range(feedback.shape[0]):
        for v in range(realisations):
            moved[f, v, 0] = feedback[f, v, 0] - past_feedback[0, f, v, 0]
    new_differences(feedback, moved, whole, past_feedback, distances, new_feedback)


def compile_implicit_step() -> None:
    """Compile the kernels of a step by calls for one contact of one strip.

    The last one comes first: a process that solves the first contacts meanwhile then compiles the
    first ones itself.
    """
    one, order, bodies = np.ones(1), np.ones(1, np.int64), np.array([[0, 1]])
    strip, wear, rows = np.ones((1, 1)), np.ones((2, 1, 1)), np.ones((2, 1, 1))
    past, sums, spans = np.ones((ROWS, 2, 1, 1)), np.ones((ROWS, 1, 1, 1)), np.ones((ROWS - 1, 1))
    resolved, of_tests, total = np.ones(1, np.bool_), np.ones((7, 1)), np.ones((1, 1, 1))
    of_bodies, of_contacts = np.ones((6, 2, 1, 1)), np.ones((3, 1, 1))
    strips = bodies, resolved, strip, rows, strip, of_bodies, of_contacts
    about, compliance, apart = np.ones((5, 1, 1)), np.ones((1, 1, 2, 1)), strip.copy()
    end_step(
        *(*strips, strip, strip, one, strip, wear, rows, of_tests, total, total, one, one),
        *(past, sums, sums, one.copy(), rows.copy(), np.ones((3, 1, 1)), past.copy()),
        *(sums.copy(), sums.copy(), resolved),
    )
    compare_step(
        *(*strips, strip, wear, apart, about, compliance, strip, strip, wear.copy(), one, 1.0),
        *(resolved, rows.copy(), of_tests[:3]),
    )
    linearise_step(*strips, strip, wear, apart, resolved, about, compliance)
    begin_step(
        *(spans, order, one, one, one, past, sums, sums, rows, bodies, strip, one, wear, one),
        *(strip, strip, strip, resolved, resolved, of_tests, total, total),
        *(of_bodies, of_contacts),
    )

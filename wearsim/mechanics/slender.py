"""Normal contact of slender patches: unknown line loads on strips.

Strip i of contact k meets the gap z_i and is pressed down by every strip j (see `influence`):

    sum_j W_ij(a_j) q_j + c_i q_i + z_i = delta_k   where q_i > 0,
    a_j = sqrt(4 s_j q_j / (pi E* kappa)),   sum_i q_i dy = N_k,

kappa being the relative curvature along rolling, s what strips make of each other's half-lengths
(see `half_length`) and c the contact's own wear compliance; contacts that wear bodies they share
are in `slender_coupled`. Newton's method with an active set of strips in contact, and delta as one
more unknown. The derivative of W is exact but for that of s, which knows only strips
nearby: the last steps shrink fifty times or so, where with s = 1 they are squared.
"""

from __future__ import annotations

import numpy as np

from wearsim.mechanics.half_length import (
    Lengths,
    add_lengthening,
    fill_half_lengths,
    find_factors,
    lengthen,
    log_length,
    new_lengths,
)
from wearsim.mechanics.influence import HIGHEST, read_influence
from wearsim.mechanics.jit import kernel
from wearsim.mechanics.linear import solve_in_place
from wearsim.types import FloatArray, IntArray

CONVERGED = 0
SINGULAR = 1
TOO_FINE = 2
NO_CONVERGENCE = 3
NOT_FINITE = 4
GOING_ON = -1

STEP_TOLERANCE = 1e-7  # of the greatest line load; the error left is a small part of it
GAP_TOLERANCE = 1e-8  # of the approach
MAX_ITERATIONS = 100


@kernel
def foundation_guess(
    contact: int,
    gap: FloatArray,
    compliance: FloatArray,
    contact_modulus: float,
    load: float,
    spacing: float,
    line_load: FloatArray,
) -> float:
    """Fill a contact's line load with an elastic foundation's answer: a start from nothing.

    Parameters
    ----------
    contact : int
        Which contact.
    gap, line_load : ndarray, shape (contacts, strips)
        Gap [m]; line load, whose row is filled [N/m].
    compliance : ndarray, shape (contacts, strips)
        Wear compliance of each contact by itself [m/(N/m)].
    contact_modulus, load, spacing : float
        E* [Pa], N [N] and the strips' width [m].

    Returns
    -------
    float
        The approach of the guess [m].
    """
    n, k = gap.shape[1], contact
    soft = 8.0 / (np.pi * contact_modulus)
    lowest, highest, softest = gap[k, 0], gap[k, 0], 0.0
    for i in range(n):
        lowest = min(lowest, gap[k, i])
        highest = max(highest, gap[k, i])
        softest = max(softest, compliance[k, i])
    low, high = 0.0, load / spacing * (soft + softest) + highest - lowest
    for _ in range(60):
        depth = 0.5 * (low + high)
        total = 0.0
        for i in range(n):
            total += max(0.0, depth + lowest - gap[k, i]) / (soft + compliance[k, i])
        if total * spacing > load:
            high = depth
        else:
            low = depth
    for i in range(n):
        line_load[k, i] = max(0.0, high + lowest - gap[k, i]) / (soft + compliance[k, i])
    approach: float = high + lowest
    return approach


@kernel
def _number_strips(k: int, line_load: FloatArray, index: IntArray) -> int:
    """Give the strips of contact `k` that carry load their rows, the others -1; return how many."""
    count = 0
    for i in range(line_load.shape[1]):
        if line_load[k, i] > 0.0:
            index[k, i] = count
            count += 1
        else:
            index[k, i] = -1
    return count


@kernel
def _press(
    k: int,
    line_load: FloatArray,
    index: IntArray,
    table: FloatArray,
    unit: float,
    lengths: Lengths,
    work: FloatArray,
    surface: FloatArray,
    matrix: FloatArray,
) -> float:
    """Add contact `k`'s elastic displacement to `surface` and its derivative to `matrix`.

    Returns the greatest ln(a/dy) met; past HIGHEST nothing more is added.
    """
    n = line_load.shape[1]
    value, tangent = work[0], work[1]
    widest: float = -np.inf
    for j in range(n):
        column = index[k, j]
        if column < 0:
            continue
        q = line_load[k, j]
        tau = log_length(k, j, line_load, lengths)
        widest = max(widest, tau)
        if widest > HIGHEST:
            return widest
        read_influence(table, tau, max(j + 1, n - j), value, tangent)
        for i in range(n):
            surface[k, i] += unit * q * value[abs(i - j)]
        for i in range(n):
            row = index[k, i]
            if row >= 0:
                matrix[row, column] += unit * tangent[abs(i - j)]
        if lengths.table.shape[0] > 0:
            lengthen(k, j, unit * q, value, tangent, lengths)
    if lengths.table.shape[0] > 0:
        add_lengthening(k, line_load, index, lengths, matrix)
    return widest


@kernel
def newton_system(
    k: int,
    own: FloatArray,
    table: FloatArray,
    unit: float,
    lengths: Lengths,
    line_load: FloatArray,
    index: IntArray,
    work: FloatArray,
    surface: FloatArray,
    matrix: FloatArray,
) -> tuple[int, float]:
    """Fill `matrix` with contact `k`'s Newton system; return its size and the greatest ln(a/dy).

    `surface` holds the gap and receives displacement and own wear; it equals delta in contact.
    Two columns after those of the strips hold the residual and a unit approach. Past HIGHEST the
    system is not complete.
    """
    n, size = line_load.shape[1], _number_strips(k, line_load, index)
    for row in range(size):
        for column in range(size):
            matrix[row, column] = 0.0
    for i in range(n):
        surface[k, i] += own[k, i] * line_load[k, i]
        row = index[k, i]
        if row >= 0:
            matrix[row, row] = own[k, i]
    widest = find_factors(k, line_load, lengths)
    if widest > HIGHEST:
        return size, widest
    widest = _press(k, line_load, index, table, unit, lengths, work, surface, matrix)
    for i in range(n):
        row = index[k, i]
        if row >= 0:
            matrix[row, size] = -surface[k, i]
            matrix[row, size + 1] = 1.0
    return size, widest


@kernel
def take_step(
    k: int,
    size: int,
    load: float,
    line_load: FloatArray,
    matrix: FloatArray,
    step: FloatArray,
    approach: FloatArray,
) -> float:
    """Take contact `k`'s step and approach from its solved system; return the rise per approach.

    The approach is chosen so that the strips carry `load` in all [N/m]. Where the rise is zero
    there is none, and nothing is taken.
    """
    missing, risen = load, 0.0
    for i in range(line_load.shape[1]):
        missing -= line_load[k, i]
    for row in range(size):
        missing -= matrix[row, size]
        risen += matrix[row, size + 1]
    if abs(risen) > 0.0:
        approach[k] = missing / risen
        for row in range(size):
            step[k, row] = matrix[row, size] + matrix[row, size + 1] * approach[k]
        return risen
    return 0.0


@kernel
def _update(
    line_load: FloatArray, index: IntArray, step: FloatArray, cautious: bool
) -> tuple[float, bool]:
    """Take the Newton step; strips that would pull leave the contact.

    Returns the greatest change relative to the greatest line load, and whether strips left.
    """
    contacts, n = line_load.shape
    change, left = 0.0, False
    for k in range(contacts):
        peak, greatest = 0.0, 0.0
        for i in range(n):
            peak = max(peak, line_load[k, i])
        for i in range(n):
            row = index[k, i]
            if row < 0:
                continue
            old = line_load[k, i]
            new = old + step[k, row]
            if not new > 0.0:
                if np.isnan(new):
                    return np.inf, left
                # a strip that Newton empties is dropped; while cautious it shrinks first
                new = 0.1 * old if cautious and old > 1e-6 * peak else 0.0
                left = True
            greatest = max(greatest, abs(new - old))
            line_load[k, i] = new
        change = max(change, greatest / peak)
    return change, left


@kernel
def _admit(
    surface: FloatArray,
    line_load: FloatArray,
    index: IntArray,
    approach: FloatArray,
    unit: float,
    tolerance: float,
    cautious: bool,
) -> bool:
    """Let strips that the other body has penetrated into the contact.

    A strip enters with about the load that its penetration asks for; much more would throw it out
    again at the next step.
    """
    contacts, n = line_load.shape
    entered = False
    for k in range(contacts):
        lowest, deepest = surface[k, 0], 0.0
        for i in range(n):
            lowest = min(lowest, surface[k, i])
            if index[k, i] < 0:
                deepest = max(deepest, approach[k] - surface[k, i])
        scale = tolerance * max(abs(approach[k]), approach[k] - lowest)
        if deepest <= scale:
            continue
        limit = max(scale, 0.999 * deepest) if cautious else scale
        for i in range(n):
            inside = approach[k] - surface[k, i]
            if index[k, i] < 0 and inside > limit:
                line_load[k, i] = 0.1 * inside / unit
                entered = True
    return entered


@kernel
def start_contact(
    k: int,
    gap: FloatArray,
    compliance: FloatArray,
    contact_modulus: float,
    load: float,
    spacing: float,
    line_load: FloatArray,
    approach: FloatArray,
) -> None:
    """Give contact `k` a start if it has none; parameters as of `foundation_guess`."""
    for i in range(gap.shape[1]):
        if line_load[k, i] > 0.0:
            return
    approach[k] = foundation_guess(k, gap, compliance, contact_modulus, load, spacing, line_load)


@kernel
def settle(
    iteration: int,
    unit: float,
    surface: FloatArray,
    index: IntArray,
    step: FloatArray,
    approach: FloatArray,
    line_load: FloatArray,
) -> int:
    """Take Newton's step, let strips leave and enter, and return CONVERGED, GOING_ON or NOT_FINITE.

    After some iterations it goes cautiously; a strip that comes and goes at the edge is let be
    where it hardly matters.
    """
    cautious = iteration > 12
    change, left = _update(line_load, index, step, cautious)
    if not change < np.inf:
        return NOT_FINITE
    ready = not cautious or (change < 1e-3 and not left)
    tolerance = GAP_TOLERANCE * 10.0 ** max(0, iteration // 20 - 1)
    entered = ready and _admit(surface, line_load, index, approach, unit, tolerance, cautious)
    if change < STEP_TOLERANCE and not left and not entered:
        return CONVERGED
    return GOING_ON


@kernel
def log_scale_of(contact_modulus: float, longitudinal_curvature: float, spacing: float) -> float:
    """Return ln(a/dy) of a strip by itself under 1 N/m."""
    scale = 4.0 / (np.pi * contact_modulus * longitudinal_curvature)
    value: float = 0.5 * np.log(scale) - np.log(spacing)
    return value


@kernel
def solve_slender(
    gap: FloatArray,
    own: FloatArray,
    loads: FloatArray,
    spacing: float,
    contact_modulus: float,
    longitudinal_curvature: float,
    table: FloatArray,
    bend: FloatArray,
    line_load: FloatArray,
    approach: FloatArray,
    half_length: FloatArray,
) -> tuple[int, int]:
    """Solve one or several slender contacts that share nothing, from the line loads given.

    Parameters
    ----------
    gap : ndarray, shape (contacts, strips)
        Gap [m].
    own : ndarray, shape (contacts, strips)
        Gap that a contact opens for itself per unit of line load [m/(N/m)].
    loads : ndarray, shape (contacts,)
        Loads N [N].
    spacing, contact_modulus, longitudinal_curvature : float
        Strip width [m], E* [Pa], kappa [1/m].
    table, bend : ndarray
        From `influence_table`, and from `curvature_table` or, for half-lengths that follow from a
        strip's own line load alone, `no_table`.
    line_load : ndarray, shape (contacts, strips)
        Starting line loads, all zero in a contact for a start from nothing; holds q [N/m] after.
    approach : ndarray, shape (contacts,)
        Starting approaches; holds delta [m] after.
    half_length : ndarray, shape (contacts, strips)
        Holds a [m] after.

    Returns
    -------
    status, iterations : int
        CONVERGED, or what went wrong.
    """
    contacts, n = gap.shape
    unit = 1.0 / (np.pi * contact_modulus)
    index = np.empty((contacts, n), np.int64)
    surface, step = np.empty((contacts, n)), np.empty((contacts, n))
    work, matrix = np.empty((2, n)), np.empty((n, n + 2))
    log_scale = log_scale_of(contact_modulus, longitudinal_curvature, spacing)
    lengths = new_lengths(contacts, bend, log_scale)
    for k in range(contacts):
        start_contact(k, gap, own, contact_modulus, loads[k], spacing, line_load, approach)
    for iteration in range(1, MAX_ITERATIONS + 1):
        for k in range(contacts):
            for i in range(n):  # an assignment of arrays takes seconds to compile
                surface[k, i] = gap[k, i]
            size, widest = newton_system(
                k, own, table, unit, lengths, line_load, index, work, surface, matrix
            )
            if widest > HIGHEST:
                return TOO_FINE, iteration
            if not solve_in_place(matrix, size, size + 2):
                return SINGULAR, iteration
            if take_step(k, size, loads[k] / spacing, line_load, matrix, step, approach) == 0.0:
                return SINGULAR, iteration
        status = settle(iteration, unit, surface, index, step, approach, line_load)
        if status == CONVERGED:
            fill_half_lengths(spacing, line_load, lengths, half_length)
        if status != GOING_ON:
            return status, iteration
    return NO_CONVERGENCE, MAX_ITERATIONS

"""Normal contact of slender patches: unknown line loads on strips, one or several coupled contacts.

Strip i of contact k meets the gap z_i and is pressed down by every strip j (see `influence`):

    sum_j W_ij(a_j) q_j + c_i q_i + D_i + z_i = delta_k   where q_i > 0,
    a_j = sqrt(4 q_j / (pi E* kappa)),   sum_i q_i dy = N_k,

kappa being the relative curvature along rolling, c the contact's own wear compliance and D what all
contacts wear off the bodies that they share (see `shared_bodies`). Newton's method with the exact
derivative of W, an active set of strips in contact, and delta as one more unknown.
"""

from __future__ import annotations

import numpy as np

from wearsim.mechanics.influence import HIGHEST, read_influence
from wearsim.mechanics.jit import kernel
from wearsim.mechanics.linear import solve_in_place
from wearsim.mechanics.shared_bodies import add_depths, count_bodies, solve_depths
from wearsim.types import FloatArray, IntArray

CONVERGED = 0
SINGULAR = 1
TOO_FINE = 2
NO_CONVERGENCE = 3
NOT_FINITE = 4

STEP_TOLERANCE = 1e-7  # of the greatest line load; Newton squares it before it is felt
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
    log_scale: float,
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
        tau = log_scale + 0.5 * np.log(q)
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
    return widest


@kernel
def _assemble(
    k: int,
    own: FloatArray,
    table: FloatArray,
    unit: float,
    log_scale: float,
    line_load: FloatArray,
    index: IntArray,
    size: int,
    coupled: bool,
    work: FloatArray,
    surface: FloatArray,
    matrix: FloatArray,
) -> float:
    """Add contact `k`'s Newton system to `matrix`; return the greatest ln(a/dy).

    `surface` holds gap and shared wear, and receives displacement and own wear; it equals delta in
    contact. Columns after those of the strips hold the residual, a unit approach and, where
    contacts share a body, a unit rise of every strip's gap.
    """
    n = line_load.shape[1]
    for i in range(n):
        surface[k, i] += own[k, i] * line_load[k, i]
        row = index[k, i]
        if row >= 0:
            matrix[row, row] = own[k, i]
            if coupled:
                matrix[row, size + 2 + row] = 1.0
    widest = _press(k, line_load, index, table, unit, log_scale, work, surface, matrix)
    for i in range(n):
        row = index[k, i]
        if row >= 0:
            matrix[row, size] = -surface[k, i]
            matrix[row, size + 1] = 1.0
    return widest


@kernel
def _answer(
    k: int,
    size: int,
    coupled: bool,
    missing: float,
    matrix: FloatArray,
    step: FloatArray,
    approach: FloatArray,
    response: FloatArray,
    lift: FloatArray,
) -> bool:
    """Take contact `k`'s step and approach, and how both follow its gap, from its solved system.

    The approach is chosen so that the loads of the strips grow by `missing` in all [N/m].
    """
    risen = 0.0
    for row in range(size):
        missing -= matrix[row, size]
        risen += matrix[row, size + 1]
    if not abs(risen) > 0.0:
        return False
    approach[k] = missing / risen
    for row in range(size):
        step[k, row] = matrix[row, size] + matrix[row, size + 1] * approach[k]
    if coupled:
        for column in range(size):
            total = 0.0
            for row in range(size):
                total += matrix[row, size + 2 + column]
            lift[k, column] = total / risen
            for row in range(size):
                fall = matrix[row, size + 2 + column] - matrix[row, size + 1] * lift[k, column]
                response[k, column, row] = fall
    return True


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
def solve_slender(
    gap: FloatArray,
    own: FloatArray,
    members: IntArray,
    shared: FloatArray,
    loads: FloatArray,
    spacing: float,
    contact_modulus: float,
    longitudinal_curvature: float,
    table: FloatArray,
    line_load: FloatArray,
    approach: FloatArray,
) -> tuple[int, int]:
    """Solve one or several coupled slender contacts, starting from the line loads given.

    Parameters
    ----------
    gap : ndarray, shape (contacts, strips)
        Gap [m].
    own : ndarray, shape (contacts, strips)
        Gap that a contact opens for itself alone per unit of line load [m/(N/m)].
    members : ndarray of int, shape (contacts, 2)
        Bodies that each contact shares with others, numbered from 0; -1 for none.
    shared : ndarray, shape (contacts, 2, strips)
        Depth that a contact wears off those bodies per unit of line load [m/(N/m)].
    loads : ndarray, shape (contacts,)
        Loads N [N].
    spacing, contact_modulus, longitudinal_curvature : float
        Strip width [m], E* [Pa], kappa [1/m].
    table : ndarray
        From `influence_table`.
    line_load : ndarray, shape (contacts, strips)
        Starting line loads, all zero in a contact for a start from nothing; holds q [N/m] after.
    approach : ndarray, shape (contacts,)
        Starting approaches; holds delta [m] after.

    Returns
    -------
    status, iterations : int
        CONVERGED, or what went wrong.
    """
    contacts, n = gap.shape
    unit = 1.0 / (np.pi * contact_modulus)
    log_scale = 0.5 * np.log(4.0 / (np.pi * contact_modulus * longitudinal_curvature))
    log_scale -= np.log(spacing)
    coupled = count_bodies(members) > 0
    per_strip = 2 if coupled else 1
    kept = contacts if coupled else 0
    index = np.empty((contacts, n), np.int64)
    surface, step = np.empty((contacts, n)), np.empty((contacts, n))
    response, lift = np.empty((kept, n, n)), np.empty((kept, n))
    work, matrix = np.empty((2, n)), np.empty((n, 2 + per_strip * n))
    for k in range(contacts):
        if not line_load[k].max() > 0.0:
            for i in range(n):
                surface[k, i] = own[k, i] + shared[k, 0, i] + shared[k, 1, i]
            approach[k] = foundation_guess(
                k, gap, surface, contact_modulus, loads[k], spacing, line_load
            )
    for iteration in range(1, MAX_ITERATIONS + 1):
        cautious = iteration > 12
        for k in range(contacts):
            for i in range(n):  # an assignment of arrays takes seconds to compile
                surface[k, i] = gap[k, i]
        if coupled:
            add_depths(members, shared, line_load, surface)
        for k in range(contacts):
            size = _number_strips(k, line_load, index)
            width = 2 + per_strip * size
            matrix[:size, :width] = 0.0
            widest = _assemble(
                k,
                own,
                table,
                unit,
                log_scale,
                line_load,
                index,
                size,
                coupled,
                work,
                surface,
                matrix,
            )
            if widest > HIGHEST:
                return TOO_FINE, iteration
            if not solve_in_place(matrix, size, width):
                return SINGULAR, iteration
            missing = loads[k] / spacing
            for i in range(n):
                missing -= line_load[k, i]
            if not _answer(k, size, coupled, missing, matrix, step, approach, response, lift):
                return SINGULAR, iteration
        if coupled and not solve_depths(members, shared, index, response, step, lift, approach):
            return SINGULAR, iteration
        change, left = _update(line_load, index, step, cautious)
        if not change < np.inf:
            return NOT_FINITE, iteration
        settled = not cautious or (change < 1e-3 and not left)
        # a strip that comes and goes at the edge is let be where it hardly matters
        tolerance = GAP_TOLERANCE * 10.0 ** max(0, iteration // 20 - 1)
        entered = settled and _admit(surface, line_load, index, approach, unit, tolerance, cautious)
        if change < STEP_TOLERANCE and not left and not entered:
            return CONVERGED, iteration
    return NO_CONVERGENCE, MAX_ITERATIONS

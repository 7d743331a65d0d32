"""Normal contact of slender patches: unknown line loads on strips, one or several coupled contacts.

Strip i of contact k meets the gap z_i and is pressed down by every strip j (see `influence`):

    sum_j W_ij(a_j) q_j + sum_l c_kli q_li + z_i = delta_k   where q_i > 0,
    a_j = sqrt(4 q_j / (pi E* kappa)),   sum_i q_i dy = N_k,

kappa being the relative curvature along rolling and c_kl the gap that contact l's wear opens at
contact k. Newton's method with the exact derivative of W, an active set of strips in contact, and
delta as one more unknown.
"""

from __future__ import annotations

import numpy as np

from wearsim.mechanics.influence import HIGHEST, read_influence
from wearsim.mechanics.jit import kernel
from wearsim.mechanics.linear import solve_in_place
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
    compliance : ndarray, shape (contacts, contacts, strips)
        Wear compliance [m/(N/m)].
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
        softest = max(softest, compliance[k, k, i])
    low, high = 0.0, load / spacing * (soft + softest) + highest - lowest
    for _ in range(60):
        depth = 0.5 * (low + high)
        total = 0.0
        for i in range(n):
            total += max(0.0, depth + lowest - gap[k, i]) / (soft + compliance[k, k, i])
        if total * spacing > load:
            high = depth
        else:
            low = depth
    for i in range(n):
        line_load[k, i] = max(0.0, high + lowest - gap[k, i]) / (soft + compliance[k, k, i])
    approach: float = high + lowest
    return approach


@kernel
def _number_contacts(line_load: FloatArray, index: IntArray) -> int:
    """Give the strips that carry load their rows, the others -1; return the number of rows."""
    contacts, n = line_load.shape
    count = 0
    for k in range(contacts):
        for i in range(n):
            if line_load[k, i] > 0.0:
                index[k, i] = count
                count += 1
            else:
                index[k, i] = -1
    return count


@kernel
def _press(
    line_load: FloatArray,
    index: IntArray,
    table: FloatArray,
    unit: float,
    log_scale: float,
    work: FloatArray,
    surface: FloatArray,
    matrix: FloatArray,
) -> float:
    """Add the elastic displacement to `surface` and its derivative to `matrix`.

    Returns the greatest ln(a/dy) met; past HIGHEST nothing more is added.
    """
    contacts, n = line_load.shape
    value, tangent = work[0], work[1]
    widest: float = -np.inf
    for k in range(contacts):
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
    gap: FloatArray,
    compliance: FloatArray,
    table: FloatArray,
    unit: float,
    log_scale: float,
    line_load: FloatArray,
    index: IntArray,
    size: int,
    work: FloatArray,
    surface: FloatArray,
    matrix: FloatArray,
) -> float:
    """Fill the bordered Newton system; return the greatest ln(a/dy).

    `surface` receives gap, wear and displacement together; it equals delta in contact. Columns
    after the first `size` hold the residual and one unit load per contact.
    """
    contacts, n = gap.shape
    matrix[:size, : size + contacts + 1] = 0.0
    for k in range(contacts):
        for i in range(n):
            surface[k, i] = gap[k, i]
        for other in range(contacts):
            for i in range(n):
                wear = compliance[k, other, i]
                surface[k, i] += wear * line_load[other, i]
                row, column = index[k, i], index[other, i]
                if row >= 0 and column >= 0:
                    matrix[row, column] += wear
    widest = _press(line_load, index, table, unit, log_scale, work, surface, matrix)
    for k in range(contacts):
        for i in range(n):
            row = index[k, i]
            if row >= 0:
                matrix[row, size] = -surface[k, i]
                matrix[row, size + 1 + k] = 1.0
    return widest


@kernel
def _approaches(
    matrix: FloatArray,
    size: int,
    line_load: FloatArray,
    index: IntArray,
    loads: FloatArray,
    spacing: float,
    small: FloatArray,
    approach: FloatArray,
) -> bool:
    """Choose every approach so that each contact carries its load exactly after the step."""
    contacts, n = line_load.shape
    small[:] = 0.0
    for k in range(contacts):
        missing = loads[k] / spacing
        for i in range(n):
            row = index[k, i]
            if row >= 0:
                missing -= line_load[k, i] + matrix[row, size]
                for other in range(contacts):
                    small[k, other] += matrix[row, size + 1 + other]
        small[k, contacts] = missing
    if not solve_in_place(small, contacts, contacts + 1):
        return False
    for k in range(contacts):
        approach[k] = small[k, contacts]
    return True


@kernel
def _update(
    matrix: FloatArray,
    size: int,
    line_load: FloatArray,
    index: IntArray,
    approach: FloatArray,
    cautious: bool,
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
            new = old + matrix[row, size]
            for other in range(contacts):
                new += matrix[row, size + 1 + other] * approach[other]
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
    compliance: FloatArray,
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
    compliance : ndarray, shape (contacts, contacts, strips)
        Gap that opens at the first contact per unit of line load of the second [m/(N/m)].
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
    index = np.empty((contacts, n), np.int64)
    surface = np.empty((contacts, n))
    work = np.empty((2, n))
    small = np.empty((contacts, contacts + 1))
    for k in range(contacts):
        if not line_load[k].max() > 0.0:
            approach[k] = foundation_guess(
                k, gap, compliance, contact_modulus, loads[k], spacing, line_load
            )
    matrix = np.empty((contacts * n, contacts * n + contacts + 1))
    for iteration in range(1, MAX_ITERATIONS + 1):
        cautious = iteration > 12
        size = _number_contacts(line_load, index)
        widest = _assemble(
            gap, compliance, table, unit, log_scale, line_load, index, size, work, surface, matrix
        )
        if widest > HIGHEST:
            return TOO_FINE, iteration
        if not solve_in_place(matrix, size, size + contacts + 1):
            return SINGULAR, iteration
        if not _approaches(matrix, size, line_load, index, loads, spacing, small, approach):
            return SINGULAR, iteration
        change, left = _update(matrix, size, line_load, index, approach, cautious)
        if not change < np.inf:
            return NOT_FINITE, iteration
        settled = not cautious or (change < 1e-3 and not left)
        # a strip that comes and goes at the edge is let be where it hardly matters
        tolerance = GAP_TOLERANCE * 10.0 ** max(0, iteration // 20 - 1)
        entered = settled and _admit(surface, line_load, index, approach, unit, tolerance, cautious)
        if change < STEP_TOLERANCE and not left and not entered:
            return CONVERGED, iteration
    return NO_CONVERGENCE, MAX_ITERATIONS

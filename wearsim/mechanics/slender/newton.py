"""Normal contact of slender patches: unknown line loads on strips.

Strip i of contact k meets the gap z_i and is pressed down by every strip j (see `influence`):

    sum_j W_ij(a_j) q_j + c_i q_i + z_i = delta_k   where q_i > 0,
    a_j = sqrt(4 s_j q_j / (pi E* kappa)),   sum_i q_i dy = N_k,

kappa being the relative curvature along rolling, s what strips make of each other's half-lengths
(see `half_length`) and c the contact's own wear compliance; contacts that wear bodies they share
are in `slender_coupled`. Newton's method with an active set of strips in contact, and delta as one
more unknown, takes the steps of `slender_step`.
"""

from __future__ import annotations

import numpy as np

from wearsim.mechanics.numerics.jit import kernel
from wearsim.mechanics.slender.half_length import NEWTON_REACH, fill_half_lengths, new_lengths
from wearsim.mechanics.slender.influence import HIGHEST
from wearsim.mechanics.slender.newton_step import (
    Steps,
    add_beyond,
    displace,
    factor_jacobian,
    foresee,
    new_steps,
    take_step,
)
from wearsim.types import FloatArray

CONVERGED = 0
SINGULAR = 1
TOO_FINE = 2
NO_CONVERGENCE = 3
NOT_FINITE = 4
GOING_ON = -1

TOLERANCE = 1e-8  # of the greatest line load: what the next step would change
REUSED = 0.05  # change of that up to which the Jacobian may serve again
SHRINKING = 0.2  # least shrinkage of the steps with which it may
FIRST = 0.1  # shrinkage that the step after the first is trusted to bring
AT_BEST = 0.01  # shrinkage that no step is trusted to exceed, for what the Jacobian lacks
MANIFOLD = 3.0  # change of a strip's load, as a ratio, up to which the Jacobian may serve again
GAP_TOLERANCE = 1e-8  # of the approach
MAX_ITERATIONS = 100
CAUTIOUS = 12  # iterations after which strips leave and enter with care


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
    approach: float = load / spacing * (soft + softest) + highest
    for _ in range(60):  # from above Newton's method never passes the root of a convex function
        total, stiffness = -load / spacing, 0.0
        for i in range(n):
            if approach > gap[k, i]:
                total += (approach - gap[k, i]) / (soft + compliance[k, i])
                stiffness += 1.0 / (soft + compliance[k, i])
        approach -= total / stiffness
        if not total > 1e-9 * load / spacing:
            break
    for i in range(n):
        line_load[k, i] = max(0.0, approach - gap[k, i]) / (soft + compliance[k, i])
    return approach


@kernel
def update_loads(line_load: FloatArray, steps: Steps, cautious: bool) -> tuple[float, bool]:
    """Take the step; strips that would pull leave the contact.

    Where strips leave or change much, the contact needs a new Jacobian. Returns the greatest change
    relative to the greatest line load, and whether strips left.
    """
    contacts, n = line_load.shape
    change, left = 0.0, False
    for k in range(contacts):
        peak, greatest = 0.0, 0.0
        for i in range(n):
            steps.change[k, i] = 0.0
            peak = max(peak, line_load[k, i])
        for row in range(steps.size[k]):
            i = steps.place[k, row]
            old = line_load[k, i]
            new = old + steps.step[k, row]
            if not new > 0.0:
                if np.isnan(new):
                    return np.inf, left
                # a strip that Newton empties is dropped; while cautious it shrinks first
                new = 0.1 * old if cautious and old > 1e-6 * peak else 0.0
                left = True
            if new * MANIFOLD < old or new > MANIFOLD * old:
                steps.fresh[k] = True
            greatest = max(greatest, abs(new - old))
            line_load[k, i], steps.change[k, i] = new, new - old
        change = max(change, greatest / peak)
    return change, left


@kernel
def _admit(
    surface: FloatArray,
    line_load: FloatArray,
    steps: Steps,
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
            if steps.rows[k, i] < 0:
                deepest = max(deepest, approach[k] - surface[k, i])
        scale = tolerance * max(abs(approach[k]), approach[k] - lowest)
        if deepest <= scale:
            continue
        limit = max(scale, 0.999 * deepest) if cautious else scale
        for i in range(n):
            inside = approach[k] - surface[k, i]
            if steps.rows[k, i] < 0 and inside > limit:
                line_load[k, i] = 0.1 * inside / unit
                entered = True
                steps.fresh[k] = True
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
    before: float,
    change: float,
    left: bool,
    surface: FloatArray,
    steps: Steps,
    approach: FloatArray,
    line_load: FloatArray,
) -> tuple[int, float]:
    """Let strips enter, say which contacts need a new Jacobian, and whether all is done.

    After some iterations it goes cautiously; a strip that comes and goes at the edge is let be
    where it hardly matters.

    Parameters
    ----------
    before : float
        Change of the step before, 0 if there was none on these strips.
    change, left
        From `update_loads`.
    surface : ndarray, shape (contacts, strips)
        Gap and displacement, after the step [m].

    Returns
    -------
    status : int
        CONVERGED, GOING_ON or NOT_FINITE.
    change : float
        Greatest change relative to the greatest line load, 0 if strips left or entered.
    """
    cautious = iteration > CAUTIOUS
    if not change < np.inf:
        return NOT_FINITE, change
    ready = not cautious or (change < 1e-3 and not left)
    tolerance = GAP_TOLERANCE * 10.0 ** max(0, iteration // 20 - 1)
    entered = ready and _admit(surface, line_load, steps, approach, unit, tolerance, cautious)
    shrinking = FIRST
    if before > 0.0:
        shrinking = min(max(change / before, AT_BEST), 1.0)
    if not (change < REUSED and shrinking < SHRINKING):
        for k in range(line_load.shape[0]):
            steps.fresh[k] = True
    if left or entered:
        return GOING_ON, 0.0
    return CONVERGED if change * shrinking < TOLERANCE else GOING_ON, change


@kernel
def least_gap(k: int, gap: FloatArray) -> float:
    """Return the least gap of contact `k`.

    Displacements are counted from there: under a vanishing load they would be lost in the rounding
    of a deep groove.
    """
    least: float = gap[k, 0]
    for i in range(gap.shape[1]):
        least = min(least, gap[k, i])
    return least


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
    unit, before = 1.0 / (np.pi * contact_modulus), 0.0
    surface, work = np.empty((contacts, n)), np.empty((2, n))
    steps = new_steps(contacts, n)
    log_scale = log_scale_of(contact_modulus, longitudinal_curvature, spacing)
    lengths, lowest = new_lengths(contacts, bend, log_scale, NEWTON_REACH), np.empty(contacts)
    for k in range(contacts):
        start_contact(k, gap, own, contact_modulus, loads[k], spacing, line_load, approach)
        lowest[k] = least_gap(k, gap)
        approach[k] -= lowest[k]
    for iteration in range(1, MAX_ITERATIONS + 1):
        for k in range(contacts):
            for i in range(n):  # an assignment of arrays takes seconds to compile
                surface[k, i] = gap[k, i] - lowest[k]
            widest = displace(k, own, table, unit, lengths, line_load, work, surface, steps)
            if widest > HIGHEST:
                return TOO_FINE, iteration
            if steps.fresh[k] and not factor_jacobian(k, steps):
                return SINGULAR, iteration
            take_step(k, loads[k] / spacing, line_load, steps, approach)
            add_beyond(k, table, unit, line_load, lengths, steps)
            take_step(k, loads[k] / spacing, line_load, steps, approach)
        change, left = update_loads(line_load, steps, iteration > CAUTIOUS)
        for k in range(contacts):
            foresee(k, surface, steps)
        status, before = settle(
            iteration, unit, before, change, left, surface, steps, approach, line_load
        )
        if status == CONVERGED:
            fill_half_lengths(spacing, line_load, lengths, half_length)
            for k in range(contacts):
                approach[k] += lowest[k]
        if status != GOING_ON:
            return status, iteration
    return NO_CONVERGENCE, MAX_ITERATIONS

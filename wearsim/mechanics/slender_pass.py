"""The per-pass loop of slender contacts with strip theory: every roller pass solved by itself.

Between full solves a contact is followed by a chord method from an anchor, where it was solved and
its Jacobian inverted. A strip's displacement depends on its own line load alone,

    u_i = sum_j phi_ij(q_j),   phi = q F / (pi E*),

so that with q = q_A + x the equations read J x = delta - z + ... - N(x), in which N holds what is
left of phi beyond its tangent. N is short-ranged (F_k depends on q as k^-3), so that a pass costs
one product with the inverse and a band. The anchor is moved before any strip's load has changed by
`STRAY`, when strips join or leave, and when the residual of the gap exceeds `RESIDUAL`.
"""

from __future__ import annotations

import numpy as np

from wearsim.mechanics.influence import read_influence
from wearsim.mechanics.jit import kernel
from wearsim.mechanics.linear import solve_in_place
from wearsim.mechanics.slender import CONVERGED, GAP_TOLERANCE, solve_slender
from wearsim.mechanics.strip import strip_force
from wearsim.types import FloatArray, IntArray

RESIDUAL = 1e-8  # of the elastic approach
STRAY = 0.01  # change of a strip's load, of the peak load, that moves the anchor
DOUBLED = 0.8  # change of a strip's load, of that load itself, that moves the anchor
TAYLOR = 0.005  # relative change up to which the quadratic term stands for phi
BAND = 12  # strips on either side where N is kept
MAX_CHORD = 4
LOST = 10  # status: the load is not positive


@kernel
def set_anchor(
    g: int,
    line_load: FloatArray,
    spacing: float,
    unit: float,
    log_scale: float,
    table: FloatArray,
    active: IntArray,
    count: IntArray,
    inverse: FloatArray,
    unit_load: FloatArray,
    near: FloatArray,
    guard: IntArray,
    guard_row: FloatArray,
    work: FloatArray,
    matrix: FloatArray,
) -> bool:
    """Invert the Jacobian of contact `g` at its line load and keep what the chord method needs.

    Parameters
    ----------
    g : int
        Which contact; arrays below have one entry per contact first.
    line_load : ndarray, shape (contacts, strips)
        Line load at the anchor [N/m].
    spacing, unit, log_scale, table
        As in `slender.solve_slender`.
    active, count : ndarray of int, shape (contacts, strips) and (contacts,)
        Receive the loaded strips and their number.
    inverse : ndarray, shape (contacts, strips, strips)
        Receives the inverse, transposed, in its leading block.
    unit_load : ndarray, shape (contacts, strips)
        Receives the loads that a unit approach adds.
    near : ndarray, shape (contacts, strips, 3, BAND)
        Receives phi, its tangent and half its second derivative near each loaded strip.
    guard, guard_row : ndarray, shape (contacts, strips) and (contacts, strips, strips)
        Receive the unloaded strips beside loaded ones, -1 after the last, and their rows of J.
    work, matrix : ndarray
        Work space, (6, strips) and (strips, 2 strips).

    Returns
    -------
    bool
        False if the Jacobian is singular.
    """
    n = line_load.shape[1]
    reach = min(BAND, n)
    count[g] = 0
    for i in range(n):
        if line_load[g, i] > 0.0:
            active[g, count[g]] = i
            count[g] += 1
    m = count[g]
    guards = 0
    for i in range(n):
        beside = (i > 0 and line_load[g, i - 1] > 0.0) or (i < n - 1 and line_load[g, i + 1] > 0.0)
        if beside and not line_load[g, i] > 0.0:
            guard[g, guards] = i
            guards += 1
    if guards < n:
        guard[g, guards] = -1
    matrix[:m, : 2 * m] = 0.0
    small = 1e-3
    for c in range(m):
        j = active[g, c]
        q = line_load[g, j]
        tau = log_scale + 0.5 * np.log(q)
        read_influence(table, tau, n, work[0], work[1])
        read_influence(table, tau + small, reach, work[2], work[3])
        read_influence(table, tau - small, reach, work[4], work[5])
        for r in range(m):
            matrix[r, c] = unit * work[1, abs(active[g, r] - j)]
        matrix[c, m + c] = 1.0
        for k in range(reach):
            near[g, c, 0, k] = unit * q * work[0, k]
            near[g, c, 1, k] = unit * work[1, k]
            near[g, c, 2, k] = 0.125 * unit * (work[3, k] - work[5, k]) / (small * q)
        for r in range(guards):
            guard_row[g, r, c] = unit * work[1, abs(guard[g, r] - j)]
    if not solve_in_place(matrix, m, 2 * m):
        return False
    for r in range(m):
        total = 0.0
        for c in range(m):
            inverse[g, c, r] = matrix[r, m + c]
            total += matrix[r, m + c]
        unit_load[g, r] = total
    return True


@kernel
def _beyond_tangent(
    g: int,
    line_load: FloatArray,
    anchor: FloatArray,
    unit: float,
    log_scale: float,
    table: FloatArray,
    active: IntArray,
    count: int,
    near: FloatArray,
    work: FloatArray,
    beyond: FloatArray,
) -> None:
    """Fill `beyond` with N: displacement [m] on every strip beyond the anchor's tangent."""
    n = line_load.shape[1]
    reach = min(BAND, n)
    for i in range(n):
        beyond[i] = 0.0
    for c in range(count):
        j = active[g, c]
        q, q0 = line_load[g, j], anchor[g, j]
        x = q - q0
        if abs(x) <= TAYLOR * q0:
            for k in range(reach):
                work[0, k] = near[g, c, 2, k] * x * x
        else:
            read_influence(table, log_scale + 0.5 * np.log(q), reach, work[2], work[3])
            for k in range(reach):
                work[0, k] = unit * q * work[2, k] - near[g, c, 0, k] - near[g, c, 1, k] * x
        beyond[j] += work[0, 0]
        for k in range(1, min(reach, n - j)):
            beyond[j + k] += work[0, k]
        for k in range(1, min(reach, j + 1)):
            beyond[j - k] += work[0, k]


@kernel
def _chord(
    g: int,
    load: float,
    spacing: float,
    gap: FloatArray,
    anchor: FloatArray,
    anchor_gap: FloatArray,
    active: IntArray,
    count: int,
    inverse: FloatArray,
    unit_load: FloatArray,
    beyond: FloatArray,
    line_load: FloatArray,
    change: FloatArray,
) -> tuple[float, bool]:
    """Solve the chord equations; return the change of approach since the anchor, and success.

    It fails where a strip would pull or has strayed too far from the anchor.
    """
    for r in range(count):
        change[r] = 0.0
    c = 0
    while c + 3 < count:
        i0, i1, i2, i3 = active[g, c], active[g, c + 1], active[g, c + 2], active[g, c + 3]
        f0 = anchor_gap[g, i0] - gap[i0] - beyond[i0]
        f1 = anchor_gap[g, i1] - gap[i1] - beyond[i1]
        f2 = anchor_gap[g, i2] - gap[i2] - beyond[i2]
        f3 = anchor_gap[g, i3] - gap[i3] - beyond[i3]
        for r in range(count):
            change[r] += (inverse[g, c, r] * f0 + inverse[g, c + 1, r] * f1) + (
                inverse[g, c + 2, r] * f2 + inverse[g, c + 3, r] * f3
            )
        c += 4
    while c < count:
        i0 = active[g, c]
        f0 = anchor_gap[g, i0] - gap[i0] - beyond[i0]
        for r in range(count):
            change[r] += inverse[g, c, r] * f0
        c += 1
    missing, stiffness, peak = load / spacing, 0.0, 0.0
    for r in range(count):
        q0 = anchor[g, active[g, r]]
        missing -= q0 + change[r]
        stiffness += unit_load[g, r]
        peak = max(peak, q0)
    rise = missing / stiffness
    for r in range(count):
        change[r] += unit_load[g, r] * rise
        q0 = anchor[g, active[g, r]]
        q = q0 + change[r]
        if not q > 0.0 or abs(change[r]) > min(STRAY * peak, DOUBLED * q0):
            return rise, False
        line_load[g, active[g, r]] = q
    return rise, True


@kernel
def _penetrates(
    g: int,
    gap: FloatArray,
    anchor_surface: FloatArray,
    approach: float,
    guard: IntArray,
    guard_row: FloatArray,
    count: int,
    change: FloatArray,
    tolerance: float,
) -> bool:
    """Tell whether a strip beside the contact has closed its gap."""
    for r in range(guard.shape[1]):
        i = guard[g, r]
        if i < 0:
            break
        surface = gap[i] + anchor_surface[g, i]
        for c in range(count):
            surface += guard_row[g, r, c] * change[c]
        if approach - surface > tolerance:
            return True
    return False


@kernel
def _displacement(
    g: int,
    line_load: FloatArray,
    unit: float,
    log_scale: float,
    table: FloatArray,
    work: FloatArray,
    surface: FloatArray,
) -> None:
    """Fill `surface` of contact `g` with the displacement under its line load [m]."""
    n = line_load.shape[1]
    for i in range(n):
        surface[g, i] = 0.0
    for j in range(n):
        q = line_load[g, j]
        if q > 0.0:
            read_influence(table, log_scale + 0.5 * np.log(q), n, work[0], work[1])
            for i in range(n):
                surface[g, i] += unit * q * work[0, abs(i - j)]


@kernel
def _wear_strips(
    g: int,
    active: IntArray,
    count: int,
    line_load: FloatArray,
    half_length_scale: float,
    creepage: FloatArray,
    slip_base: FloatArray,
    slip_rates: FloatArray,
    friction: FloatArray,
    moduli: FloatArray,
    wear: FloatArray,
    cylinder_depth: FloatArray,
    roller_depth: FloatArray,
) -> float:
    """Wear both bodies by one pass of contact `g`; return the sum of dissipation over V [N/m]."""
    mean, total = 0.0, 0.0
    for r in range(count):
        i = active[g, r]
        q = line_load[g, i]
        mean += q * (
            slip_base[g, i] + slip_rates[0] * roller_depth[g, i] - slip_rates[1] * cylinder_depth[i]
        )
        total += q
    mean /= total
    dissipated = 0.0
    for r in range(count):
        i = active[g, r]
        q = line_load[g, i]
        slip = creepage[g, 0] - mean + slip_base[g, i]
        slip += slip_rates[0] * roller_depth[g, i] - slip_rates[1] * cylinder_depth[i]
        force_x, force_y, _ = strip_force(
            np.sqrt(half_length_scale * q), q, friction[i], slip, creepage[g, 1], moduli[0],
            moduli[1],
        )  # fmt: skip
        work = -(force_x * slip + force_y * creepage[g, 1])
        cylinder_depth[i] += wear[0] * work
        roller_depth[g, i] += wear[1 + g] * work
        dissipated += work
    return dissipated


@kernel
def run_passes(
    order: IntArray,
    first: int,
    base_load: FloatArray,
    feedback: FloatArray,
    terms: FloatArray,
    term_rates: FloatArray,
    nominal_gap: FloatArray,
    fresh_gap: FloatArray,
    spacing: float,
    rolling_speed: float,
    longitudinal_curvature: float,
    moduli: FloatArray,
    table: FloatArray,
    creepage: FloatArray,
    slip_base: FloatArray,
    slip_rates: FloatArray,
    friction: FloatArray,
    wear: FloatArray,
    cylinder_depth: FloatArray,
    roller_depth: FloatArray,
    line_load: FloatArray,
    approach: FloatArray,
    anchor: FloatArray,
    anchor_gap: FloatArray,
    anchor_approach: FloatArray,
    energy: FloatArray,
) -> tuple[int, int, int]:
    """Run roller passes one by one; everything that evolves is changed in place.

    Parameters
    ----------
    order : ndarray of int, shape (physical rollers,)
        Which contact each physical roller is, in the order of their passes.
    first : int
        Number of the first pass, counted from the start of the test.
    base_load : ndarray, shape (passes,)
        Load before feedback at each pass [N].
    feedback : ndarray, shape (1,)
        Load lost per descent of a roller [N/m].
    terms : ndarray, shape (terms, contacts)
        State of linear load terms [N].
    term_rates : ndarray, shape (terms, 1 + contacts)
        Gain [N/W], and per contact the part of the way that a pass goes to rest.
    nominal_gap : ndarray, shape (contacts, strips)
        Gap before wear [m].
    fresh_gap : ndarray, shape (contacts,)
        Its least value [m].
    spacing, rolling_speed, longitudinal_curvature : float
        Strip width [m], V [m/s], relative curvature [1/m].
    moduli : ndarray, shape (2,)
        E* and G [Pa].
    table : ndarray
        From `influence_table`.
    creepage : ndarray, shape (contacts, 2)
        Mean longitudinal and lateral creepage.
    slip_base : ndarray, shape (contacts, strips)
        Variation of the longitudinal creepage on unworn bodies.
    slip_rates : ndarray, shape (2,)
        What worn depth of roller and cylinder adds to it [1/m].
    friction : ndarray, shape (strips,)
        Friction coefficient.
    wear : ndarray, shape (1 + contacts,)
        Depth per dissipation over V: the cylinder's, then each roller's [m/(N/m)].
    cylinder_depth, roller_depth, line_load, approach
        State: (strips,), (contacts, strips) twice, (contacts,).
    anchor, anchor_gap, anchor_approach
        Line load, gap and approach where the factorisation in use was made; an anchor of zero
        load asks for a full solve.
    energy : ndarray, shape (contacts,)
        Added to: sum over passes of the dissipated power [W].

    Returns
    -------
    status, done, full_solves : int
        CONVERGED or what went wrong, the passes done, and those solved in full.
    """
    contacts, n = nominal_gap.shape
    unit = 1.0 / (np.pi * moduli[0])
    half_length_scale = 4.0 * unit / longitudinal_curvature
    log_scale = 0.5 * np.log(half_length_scale) - np.log(spacing)
    active, guard = np.zeros((contacts, n), np.int64), np.zeros((contacts, n), np.int64)
    count = np.zeros(contacts, np.int64)
    inverse, guard_row = np.empty((contacts, n, n)), np.empty((contacts, n, n))
    unit_load, surface = np.empty((contacts, n)), np.empty((contacts, n))
    near = np.empty((contacts, n, 3, BAND))
    work, matrix = np.empty((6, max(n, BAND))), np.empty((n, 2 * n))
    beyond, gap, change = np.empty((contacts, n)), np.empty(n), np.empty(n)
    loads, one_gap, one_load = np.empty(1), np.empty((1, n)), np.empty((1, n))
    one_approach, no_wear = np.empty(1), np.zeros((1, 1, n))
    full_solves = 0
    for g in range(contacts):
        if anchor[g].max() > 0.0:
            if not set_anchor(
                g, anchor, spacing, unit, log_scale, table, active, count, inverse, unit_load,
                near, guard, guard_row, work, matrix,
            ):  # fmt: skip
                return 1, 0, full_solves
            _displacement(g, anchor, unit, log_scale, table, work, surface)
            _beyond_tangent(
                g, line_load, anchor, unit, log_scale, table, active, count[g], near, work,
                beyond[g],
            )  # fmt: skip
    for p in range(base_load.shape[0]):
        g = order[(first + p) % order.shape[0]]
        lowest = 1e300
        for i in range(n):
            gap[i] = nominal_gap[g, i] + cylinder_depth[i] + roller_depth[g, i]
            lowest = min(lowest, gap[i])
        load = base_load[p] - feedback[0] * (lowest - fresh_gap[g])
        for t in range(terms.shape[0]):
            load += terms[t, g]
        if not load > 0.0:
            return LOST, p, full_solves
        followed = anchor[g].max() > 0.0
        if followed:
            followed = False
            for _ in range(MAX_CHORD):
                rise, fits = _chord(
                    g, load, spacing, gap, anchor, anchor_gap, active, count[g], inverse,
                    unit_load, beyond[g], line_load, change,
                )  # fmt: skip
                if not fits:
                    break
                approach[g] = anchor_approach[g] + rise
                for i in range(n):
                    work[4, i] = beyond[g, i]
                _beyond_tangent(
                    g, line_load, anchor, unit, log_scale, table, active, count[g], near, work,
                    beyond[g],
                )  # fmt: skip
                residual = 0.0
                for r in range(count[g]):
                    i = active[g, r]
                    residual = max(residual, abs(beyond[g, i] - work[4, i]))
                if residual <= RESIDUAL * (approach[g] - lowest):
                    followed = True
                    break
            followed = followed and not _penetrates(
                g, gap, surface, approach[g], guard, guard_row, count[g], change,
                GAP_TOLERANCE * (approach[g] - lowest),
            )  # fmt: skip
        if not followed:
            loads[0] = load
            one_approach[0] = approach[g]
            for i in range(n):
                one_gap[0, i], one_load[0, i] = gap[i], line_load[g, i]
            status, _ = solve_slender(
                one_gap, no_wear, loads, spacing, moduli[0], longitudinal_curvature, table,
                one_load, one_approach,
            )  # fmt: skip
            if status != CONVERGED:
                return status, p, full_solves
            full_solves += 1
            for i in range(n):
                line_load[g, i], anchor[g, i] = one_load[0, i], one_load[0, i]
                anchor_gap[g, i], beyond[g, i] = gap[i], 0.0
            approach[g] = anchor_approach[g] = one_approach[0]
            if not set_anchor(
                g, anchor, spacing, unit, log_scale, table, active, count, inverse, unit_load,
                near, guard, guard_row, work, matrix,
            ):  # fmt: skip
                return 1, p, full_solves
            _displacement(g, anchor, unit, log_scale, table, work, surface)
        dissipated = _wear_strips(
            g, active, count[g], line_load, half_length_scale, creepage, slip_base, slip_rates,
            friction, moduli, wear, cylinder_depth, roller_depth,
        )  # fmt: skip
        power = rolling_speed * dissipated * spacing
        energy[g] += power
        for t in range(terms.shape[0]):
            terms[t, g] += term_rates[t, 1 + g] * (term_rates[t, 0] * power - terms[t, g])
    return CONVERGED, base_load.shape[0], full_solves

"""Follow slender contacts from pass to pass by a chord method, instead of solving each in full.

Between full solves a contact is followed by a chord method from an anchor, where it was solved and
its Jacobian inverted. A strip's displacement depends on its own line load alone,

    u_i = sum_j phi_ij(q_j),   phi = q F / (pi E*),

so that with q = q_A + x the equations read J x = delta - z + ... - N(x), in which N holds what is
left of phi beyond its tangent. N is short-ranged (F_k depends on q as k^-3), so that a pass costs
one product with the inverse and a band. The anchor is moved before any strip's load has changed by
`STRAY`, when strips join or leave, and when the residual of the gap exceeds `RESIDUAL`.

What strips make of each other's half-lengths (see `half_length`) is that of the anchor, and J holds
its slope: the loads stray so little from the anchor that a pass is off by 1e-5 of the greatest
load.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from wearsim.mechanics.numerics.jit import kernel
from wearsim.mechanics.numerics.lu import factor_in_place, invert_factored
from wearsim.mechanics.slender.half_length import (
    REACH,
    Lengths,
    add_lengthening,
    find_factors,
    lengthen,
    log_length,
    new_lengths,
)
from wearsim.mechanics.slender.influence import read_influence
from wearsim.mechanics.slender.newton import (
    CONVERGED,
    GAP_TOLERANCE,
    SINGULAR,
    log_scale_of,
    solve_slender,
)
from wearsim.mechanics.tangential.strip_interaction import StripElasticity, strip_elasticity
from wearsim.mechanics.tangential.strip_theory import StripTractions, new_tractions
from wearsim.types import FloatArray, IntArray

RESIDUAL = 1e-8  # of the elastic approach
STRAY = 0.01  # change of a strip's load, of the peak load, that moves the anchor
DOUBLED = 0.8  # change of a strip's load, of that load itself, that moves the anchor
TAYLOR = 0.005  # relative change up to which the quadratic term stands for phi
BAND = 12  # strips on either side where N is kept
MAX_CHORD = 4


class Medium(NamedTuple):
    """What the strips have in common: width [m], 1/(pi E*) [1/Pa], E* [Pa] and the rest.

    `log_scale` is ln(a/dy) at 1 N/m of a strip by itself.
    """

    spacing: float
    unit: float
    contact_modulus: float
    longitudinal_curvature: float
    log_scale: float
    table: FloatArray
    bend: FloatArray
    elasticity: StripElasticity


class Loads(NamedTuple):
    """What evolves in the contacts: (contacts, strips) arrays, and approaches (contacts,)."""

    line_load: FloatArray
    anchor: FloatArray
    anchor_gap: FloatArray
    approach: FloatArray
    anchor_approach: FloatArray


class Follower(NamedTuple):
    """What the chord method keeps of each contact, one entry per contact first; and work space.

    Loaded strips and their number; the inverse of the Jacobian, transposed; the loads that a unit
    approach adds; phi, its tangent and half its second derivative near each loaded strip; the
    unloaded strips beside loaded ones, -1 after the last, and their rows of J; the displacement at
    the anchor; N; what half-lengths follow from, s at the anchor; and of the contact in hand its
    gap, the change of its loads, its half-lengths, friction and longitudinal slip (3, strips), and
    its tractions.
    """

    active: IntArray
    loaded: IntArray
    inverse: FloatArray
    unit_load: FloatArray
    near: FloatArray
    guard: IntArray
    guard_row: FloatArray
    surface: FloatArray
    beyond: FloatArray
    lengths: Lengths
    gap: FloatArray
    change: FloatArray
    work: FloatArray
    matrix: FloatArray
    order: IntArray
    seen: FloatArray
    tractions: StripTractions


def medium(
    spacing: float,
    contact_modulus: float,
    shear_modulus: float,
    longitudinal_curvature: float,
    table: FloatArray,
    bend: FloatArray,
) -> Medium:
    """Return the `Medium` of strips of width `spacing`, with tables as in `solve_slender`."""
    return Medium(
        spacing,
        1.0 / (np.pi * contact_modulus),
        contact_modulus,
        longitudinal_curvature,
        float(log_scale_of(contact_modulus, longitudinal_curvature, spacing)),
        table,
        bend,
        strip_elasticity(contact_modulus, shear_modulus),
    )


def empty_follower(m: Medium, contacts: int, n: int) -> Follower:
    """Return a `Follower` for contacts that have no anchor yet."""
    return Follower(
        np.zeros((contacts, n), np.int64),
        np.zeros(contacts, np.int64),
        np.empty((contacts, n, n)),
        np.empty((contacts, n)),
        np.empty((contacts, n, 3, BAND)),
        np.zeros((contacts, n), np.int64),
        np.empty((contacts, n, n)),
        np.empty((contacts, n)),
        np.zeros((contacts, n)),
        new_lengths(contacts, m.bend, m.log_scale, REACH),
        np.empty(n),
        np.empty(n),
        np.empty((6, max(n, BAND))),
        np.empty((n, n)),
        np.empty(n, np.int64),
        np.zeros((3, n)),
        new_tractions(n),
    )


@kernel
def _number_strips(g: int, line_load: FloatArray, f: Follower) -> int:
    """List the loaded strips of contact `g` and the unloaded ones beside; return how many those."""
    n = line_load.shape[1]
    f.loaded[g] = 0
    guards = 0
    for i in range(n):
        if line_load[g, i] > 0.0:
            f.active[g, f.loaded[g]] = i
            f.loaded[g] += 1
            continue
        before, after = i > 0 and line_load[g, i - 1] > 0.0, i < n - 1 and line_load[g, i + 1] > 0.0
        if before or after:
            f.guard[g, guards] = i
            guards += 1
    if guards < n:
        f.guard[g, guards] = -1
    return guards


@kernel
def _add_lengthening(g: int, line_load: FloatArray, f: Follower) -> None:
    """Add to the Jacobian of contact `g` how s follows the loads."""
    row = np.full(line_load.shape, -1)
    for r in range(f.loaded[g]):
        row[g, f.active[g, r]] = r
    add_lengthening(g, line_load, row, f.lengths, f.matrix)


@kernel
def set_anchor(g: int, line_load: FloatArray, m: Medium, f: Follower) -> bool:
    """Invert the Jacobian of contact `g` at a line load and keep what the chord method needs.

    Parameters
    ----------
    g : int
        Which contact.
    line_load : ndarray, shape (contacts, strips)
        Line load at the anchor [N/m].
    m : Medium
    f : Follower
        Filled for contact `g`.

    Returns
    -------
    bool
        False if the Jacobian is singular.
    """
    find_factors(g, line_load, True, f.lengths)
    n = line_load.shape[1]
    reach, small = min(BAND, n), 1e-3
    guards, count = _number_strips(g, line_load, f), f.loaded[g]
    matrix, work = f.matrix, f.work
    f.surface[g] = 0.0
    for c in range(count):
        j = f.active[g, c]
        q = line_load[g, j]
        tau = log_length(g, j, line_load, f.lengths)
        read_influence(m.table, tau, n, work[0], work[1])
        read_influence(m.table, tau + small, reach, work[2], work[3])
        read_influence(m.table, tau - small, reach, work[4], work[5])
        for r in range(count):
            matrix[c, r] = m.unit * work[1, abs(f.active[g, r] - j)]
        for k in range(reach):
            f.near[g, c, 0, k] = m.unit * q * work[0, k]
            f.near[g, c, 1, k] = m.unit * work[1, k]
            f.near[g, c, 2, k] = 0.125 * m.unit * (work[3, k] - work[5, k]) / (small * q)
        for r in range(guards):
            f.guard_row[g, r, c] = m.unit * work[1, abs(f.guard[g, r] - j)]
        for i in range(n):
            k = abs(i - j)
            f.surface[g, i] += m.unit * q * work[0, k]
        if m.bend.shape[0] > 0:
            lengthen(g, j, m.unit * q, work[0], work[1], f.lengths)
    if m.bend.shape[0] > 0:
        _add_lengthening(g, line_load, f)
    if not factor_in_place(matrix, count, f.order):
        return False
    invert_factored(matrix, count, f.order, f.inverse[g])
    for r in range(count):
        f.unit_load[g, r] = 0.0
        for c in range(count):
            f.unit_load[g, r] += f.inverse[g, c, r]
    return True


@kernel
def beyond_tangent(g: int, loads: Loads, m: Medium, f: Follower) -> None:
    """Fill N of contact `g`: displacement [m] on every strip beyond the anchor's tangent."""
    n = loads.line_load.shape[1]
    reach, beyond, work = min(BAND, n), f.beyond[g], f.work
    for i in range(n):
        beyond[i] = 0.0
    for c in range(f.loaded[g]):
        j = f.active[g, c]
        q, q0 = loads.line_load[g, j], loads.anchor[g, j]
        x = q - q0
        if abs(x) <= TAYLOR * q0:
            for k in range(reach):
                work[0, k] = f.near[g, c, 2, k] * x * x
        else:
            tau = log_length(g, j, loads.line_load, f.lengths)
            read_influence(m.table, tau, reach, work[2], work[3])
            for k in range(reach):
                phi = m.unit * q * work[2, k]
                work[0, k] = phi - f.near[g, c, 0, k] - f.near[g, c, 1, k] * x
        beyond[j] += work[0, 0]
        for k in range(1, min(reach, n - j)):
            beyond[j + k] += work[0, k]
        for k in range(1, min(reach, j + 1)):
            beyond[j - k] += work[0, k]


@kernel
def _forced_change(g: int, anchor_gap: FloatArray, f: Follower) -> None:
    """Fill the change of the loads at a fixed approach; four columns at once save half the time."""
    count, change, inverse = f.loaded[g], f.change, f.inverse[g]
    for r in range(count):
        change[r] = 0.0
    for c in range(0, count - 3, 4):
        i0, i1, i2, i3 = f.active[g, c], f.active[g, c + 1], f.active[g, c + 2], f.active[g, c + 3]
        f0 = anchor_gap[g, i0] - f.gap[i0] - f.beyond[g, i0]
        f1 = anchor_gap[g, i1] - f.gap[i1] - f.beyond[g, i1]
        f2 = anchor_gap[g, i2] - f.gap[i2] - f.beyond[g, i2]
        f3 = anchor_gap[g, i3] - f.gap[i3] - f.beyond[g, i3]
        for r in range(count):
            change[r] += (inverse[c, r] * f0 + inverse[c + 1, r] * f1) + (
                inverse[c + 2, r] * f2 + inverse[c + 3, r] * f3
            )
    for c in range(count - count % 4, count):
        i0 = f.active[g, c]
        f0 = anchor_gap[g, i0] - f.gap[i0] - f.beyond[g, i0]
        for r in range(count):
            change[r] += inverse[c, r] * f0


@kernel
def _chord(g: int, load: float, loads: Loads, m: Medium, f: Follower) -> bool:
    """Solve the chord equations; False where a strip would pull or strays from the anchor."""
    _forced_change(g, loads.anchor_gap, f)
    missing, stiffness, peak = load / m.spacing, 0.0, 0.0
    for r in range(f.loaded[g]):
        q0 = loads.anchor[g, f.active[g, r]]
        missing -= q0 + f.change[r]
        stiffness += f.unit_load[g, r]
        peak = max(peak, q0)
    rise = missing / stiffness
    for r in range(f.loaded[g]):
        f.change[r] += f.unit_load[g, r] * rise
        q0 = loads.anchor[g, f.active[g, r]]
        q = q0 + f.change[r]
        if not q > 0.0 or abs(f.change[r]) > min(STRAY * peak, DOUBLED * q0):
            return False
        loads.line_load[g, f.active[g, r]] = q
    loads.approach[g] = loads.anchor_approach[g] + rise
    return True


@kernel
def _penetrates(g: int, approach: float, tolerance: float, f: Follower) -> bool:
    """Tell whether a strip beside the contact has closed its gap."""
    for r in range(f.guard.shape[1]):
        i = f.guard[g, r]
        if i < 0:
            break
        surface = f.gap[i] + f.surface[g, i]
        for c in range(f.loaded[g]):
            surface += f.guard_row[g, r, c] * f.change[c]
        if approach - surface > tolerance:
            return True
    return False


@kernel
def follow(g: int, load: float, lowest: float, loads: Loads, m: Medium, f: Follower) -> bool:
    """Solve contact `g` from its anchor; False if it asks for a full solve.

    `lowest` is the least gap [m].
    """
    if not loads.anchor[g].max() > 0.0:
        return False
    before = f.work[4]
    for _ in range(MAX_CHORD):
        if not _chord(g, load, loads, m, f):
            return False
        for i in range(f.gap.shape[0]):
            before[i] = f.beyond[g, i]
        beyond_tangent(g, loads, m, f)
        residual = 0.0
        for r in range(f.loaded[g]):
            i = f.active[g, r]
            residual = max(residual, abs(f.beyond[g, i] - before[i]))
        elastic = loads.approach[g] - lowest
        if residual <= RESIDUAL * elastic:
            return not _penetrates(g, loads.approach[g], GAP_TOLERANCE * elastic, f)
    return False


@kernel
def solve_fully(g: int, load: float, anchored: bool, loads: Loads, m: Medium, f: Follower) -> int:
    """Solve contact `g` by Newton's method, and set its anchor there; return the status."""
    n = f.gap.shape[0]
    gap, line_load, no_wear = np.empty((1, n)), np.empty((1, n)), np.zeros((1, n))
    half_length = np.empty((1, n))
    approach, force = np.empty(1), np.empty(1)
    approach[0], force[0] = loads.approach[g], load
    for i in range(n):
        gap[0, i], line_load[0, i] = f.gap[i], loads.line_load[g, i]
    status, _ = solve_slender(
        gap,
        no_wear,
        force,
        m.spacing,
        m.contact_modulus,
        m.longitudinal_curvature,
        m.table,
        m.bend,
        line_load,
        approach,
        half_length,
    )
    if status != CONVERGED:
        return status
    loads.approach[g] = approach[0]
    for i in range(n):
        loads.line_load[g, i] = line_load[0, i]
    if not anchored:
        _number_strips(g, loads.line_load, f)
        find_factors(g, loads.line_load, True, f.lengths)
        return CONVERGED
    for i in range(n):
        loads.anchor[g, i], loads.anchor_gap[g, i] = line_load[0, i], f.gap[i]
        f.beyond[g, i] = 0.0
    loads.anchor_approach[g] = approach[0]
    return CONVERGED if set_anchor(g, loads.anchor, m, f) else SINGULAR

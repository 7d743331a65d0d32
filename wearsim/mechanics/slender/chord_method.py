"""Chord method for slender contacts that change little from pass to pass.

Between full solves a contact is solved by a chord method from an anchor: a state that was solved by
Newton's method and whose Jacobian was inverted. The displacement caused by a strip depends on its
own line load only,

    u_i = sum_j phi_ij(q_j),   phi = q F / (pi E*),

so that with q = q_A + x the equations are J x = delta - z + ... - N(x), where N is the remainder of
phi beyond its tangent. N is short-ranged (F_k depends on q as k^-3), so that a pass costs one
product with the inverse and a band. The anchor is moved before the load of any strip has changed by
`STRAY`, when strips enter or leave, and when the residual of the gap exceeds `RESIDUAL`.

The interaction factors of the half-lengths (see `half_length`) are those of the anchor, and J
contains their derivatives. The loads stay so close to the anchor that the error of a pass is 1e-5
of the greatest load.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from wearsim.mechanics.numerics.jit import subroutine
from wearsim.mechanics.numerics.lu import invert_in_place, whole_panels
from wearsim.mechanics.slender.half_length import (
    REACH,
    SWEEPS,
    HalfLengths,
    add_around,
    add_length_slopes,
    fill_log_scales,
    find_factors,
    log_half_length,
    new_half_lengths,
)
from wearsim.mechanics.slender.influence import read_influence
from wearsim.mechanics.slender.newton import (
    CONVERGED,
    GAP_TOLERANCE,
    SINGULAR,
    TOLERANCE,
    solve_slender,
)
from wearsim.mechanics.tangential.strip_interaction import StripElasticity
from wearsim.mechanics.tangential.strip_theory import StripTractions, new_tractions
from wearsim.types import FloatArray, IntArray

RESIDUAL = 1e-8  # of the elastic approach
STRAY = 0.01  # change of a strip's load, of the peak load, that moves the anchor
DOUBLED = 0.8  # change of a strip's load, of that load, that moves the anchor
TAYLOR = 0.015  # relative change up to which N is approximated by two terms of its series
BAND = 12  # strips on either side within which N is evaluated
MAX_CHORD = 4


class ContactConstants(NamedTuple):
    """Strip width [m], 1/(pi E*) [1/Pa], E* [Pa], kappa (contacts,) [1/m], tables, elasticity."""

    spacing: float
    unit: float
    contact_modulus: float
    longitudinal_curvature: FloatArray
    table: FloatArray
    curvature_influence: FloatArray
    elasticity: StripElasticity


class Loads(NamedTuple):
    """Loads, gaps (contacts, strips) and approaches (contacts,), current and at the anchor."""

    line_load: FloatArray
    anchor: FloatArray
    anchor_gap: FloatArray
    approach: FloatArray
    anchor_approach: FloatArray


class ChordState(NamedTuple):
    """Anchor of each contact, with the contact as the first axis, and work space.

    `active` are the loaded strips and `loaded` is their number. `inverse` is the transposed inverse
    of the Jacobian, `unit_load` the loads per unit of approach, `near` the first four coefficients
    of the Taylor series of phi, (contacts, 4, distances, strips). `guard` are the unloaded strips
    next to loaded ones, -1 after the last, and `guard_row` their rows of J. `surface` is the
    displacement at the anchor, `remainder` is N, and `lengths` contains s at the anchor. `gap`,
    `change` of the loads, `strip_inputs` (half-lengths, friction and longitudinal slip,
    (3, strips)) and `tractions` belong to the current contact.
    """

    active: IntArray
    loaded: IntArray
    inverse: FloatArray
    unit_load: FloatArray
    near: FloatArray
    guard: IntArray
    guard_row: FloatArray
    surface: FloatArray
    remainder: FloatArray
    lengths: HalfLengths
    gap: FloatArray
    change: FloatArray
    work: FloatArray
    strip_inputs: FloatArray
    tractions: StripTractions


def new_chord_state(constants: ContactConstants, contacts: int, n: int) -> ChordState:
    """Return the `ChordState` of contacts without an anchor."""
    modulus, curvature = constants.contact_modulus, constants.longitudinal_curvature
    lengths = new_half_lengths(constants.curvature_influence, contacts)
    fill_log_scales(modulus, curvature, constants.spacing, lengths.log_scale)
    return ChordState(
        np.zeros((contacts, n), np.int64),
        np.zeros(contacts, np.int64),
        np.empty((contacts, whole_panels(n), whole_panels(n))),
        np.empty((contacts, n)),
        np.zeros((contacts, 4, BAND, n)),
        np.zeros((contacts, n), np.int64),
        np.empty((contacts, n, n)),
        np.empty((contacts, n)),
        np.zeros((contacts, n)),
        lengths,
        np.empty(n),
        np.empty(n),
        np.empty((6, max(n, BAND) + 4 * REACH)),
        np.zeros((3, n)),
        new_tractions(n),
    )


@subroutine
def _number_strips(g: int, line_load: FloatArray, state: ChordState) -> int:
    """List the loaded strips of contact `g` and their unloaded neighbours; count the latter."""
    n = line_load.shape[1]
    state.loaded[g] = 0
    guards = 0
    for i in range(n):
        if line_load[g, i] > 0.0:
            state.active[g, state.loaded[g]] = i
            state.loaded[g] += 1
        elif (i > 0 and line_load[g, i - 1] > 0.0) or (i < n - 1 and line_load[g, i + 1] > 0.0):
            state.guard[g, guards] = i
            guards += 1
    if guards < n:
        state.guard[g, guards] = -1
    return guards


@subroutine
def set_anchor(
    g: int, line_load: FloatArray, constants: ContactConstants, state: ChordState
) -> bool:
    """Set the anchor of contact `g` at a line load and invert its Jacobian there.

    Parameters
    ----------
    g : int
        Number of the contact.
    line_load : ndarray, shape (contacts, strips)
        Line load at the anchor [N/m].
    constants : ContactConstants
    state : ChordState
        Filled for contact `g`.

    Returns
    -------
    bool
        False if the Jacobian is singular.
    """
    find_factors(g, line_load, True, SWEEPS, state.lengths)
    n = line_load.shape[1]
    reach, small, unit = min(BAND, n), 1e-3, constants.unit
    guards, count = _number_strips(g, line_load, state), state.loaded[g]
    matrix, work, near = state.inverse[g], state.work, state.lengths.near
    state.surface[g] = 0.0
    for c in range(count):
        j = state.active[g, c]
        q = line_load[g, j]
        tau = log_half_length(g, j, line_load, state.lengths)
        read_influence(constants.table, tau, n, work[0], work[1])
        read_influence(constants.table, tau + small, reach, work[2], work[3])
        read_influence(constants.table, tau - small, reach, work[4], work[5])
        for r in range(count):
            matrix[c, r] = constants.unit * work[1, abs(state.active[g, r] - j)]
        for k in range(reach):
            # derivatives of the tangent by ln(a/dy), which is half of ln q and a constant
            first = 0.5 * (work[3, k] - work[5, k]) / small
            second = (work[3, k] - 2.0 * work[1, k] + work[5, k]) / (small * small)
            state.near[g, 0, k, j] = unit * q * work[0, k]
            state.near[g, 1, k, j] = unit * work[1, k]
            state.near[g, 2, k, j] = 0.25 * unit * first / q
            state.near[g, 3, k, j] = unit * (second - 2.0 * first) / (24.0 * q * q)
        for r in range(guards):
            state.guard_row[g, r, c] = constants.unit * work[1, abs(state.guard[g, r] - j)]
        add_around(j, 0, n - 1, constants.unit * q, work[0], state.surface[g])
        for d in range(min(n, REACH + 1)):
            near[d, j + 2 * REACH] = constants.unit * q * (work[1, d] - work[0, d])
    if constants.curvature_influence.shape[0] > 0:
        row = np.full(line_load.shape, -1)
        for r in range(count):
            row[g, state.active[g, r]] = r
        add_length_slopes(g, line_load, row, state.lengths, matrix)
    if not invert_in_place(matrix, count):
        return False
    for r in range(count):
        state.unit_load[g, r] = 0.0
        for c in range(count):
            state.unit_load[g, r] += state.inverse[g, c, r]
    return True


@subroutine
def fill_remainder(g: int, loads: Loads, constants: ContactConstants, state: ChordState) -> None:
    """Fill N of contact `g`: displacement of every strip beyond the anchor's tangent [m]."""
    n = loads.line_load.shape[1]
    reach, remainder, near = min(BAND, n), state.remainder, state.near
    square, cube, value, tangent = state.work[0], state.work[1], state.work[2], state.work[3]
    first, last = state.active[g, 0], state.active[g, state.loaded[g] - 1]
    far = 0  # counted, as a maximum is not vectorised
    remainder[g] = 0.0
    for i in range(first, last + 1):
        q0 = loads.anchor[g, i]
        x = loads.line_load[g, i] - q0
        excess = abs(x) - TAYLOR * q0
        x = x if excess <= 0.0 else 0.0
        far += int(excess > 0.0)
        square[i], cube[i] = x * x, x * x * x
    for k in range(reach):
        shift = np.uint64(k)
        for i in range(np.uint64(first), np.uint64(min(last + 1, n - k))):
            remainder[g, i + shift] += near[g, 2, k, i] * square[i] + near[g, 3, k, i] * cube[i]
        for i in range(np.uint64(max(first, k)), np.uint64(last + 1 if k > 0 else 0)):
            remainder[g, i - shift] += near[g, 2, k, i] * square[i] + near[g, 3, k, i] * cube[i]
    for j in range(first, last + 1 if far > 0 else first):
        q, q0 = loads.line_load[g, j], loads.anchor[g, j]
        x = q - q0
        if abs(x) > TAYLOR * q0:
            tau = log_half_length(g, j, loads.line_load, state.lengths)
            read_influence(constants.table, tau, reach, value, tangent)
            for k in range(reach):
                phi = constants.unit * q * value[k]
                value[k] = phi - near[g, 0, k, j] - near[g, 1, k, j] * x
            add_around(j, max(0, j - reach + 1), min(n, j + reach) - 1, 1.0, value, remainder[g])


@subroutine
def _fill_load_change(g: int, anchor_gap: FloatArray, state: ChordState) -> None:
    """Fill the change of the loads at a fixed approach; four columns at once halve the time."""
    count, change, inverse = state.loaded[g], state.change, state.inverse[g]
    change[:count] = 0.0
    for c in range(0, count - 3, 4):
        i0, i1, i2, i3 = (
            state.active[g, c],
            state.active[g, c + 1],
            state.active[g, c + 2],
            state.active[g, c + 3],
        )
        f0 = anchor_gap[g, i0] - state.gap[i0] - state.remainder[g, i0]
        f1 = anchor_gap[g, i1] - state.gap[i1] - state.remainder[g, i1]
        f2 = anchor_gap[g, i2] - state.gap[i2] - state.remainder[g, i2]
        f3 = anchor_gap[g, i3] - state.gap[i3] - state.remainder[g, i3]
        for r in range(count):
            change[r] += (inverse[c, r] * f0 + inverse[c + 1, r] * f1) + (
                inverse[c + 2, r] * f2 + inverse[c + 3, r] * f3
            )
    for c in range(count - count % 4, count):
        i0 = state.active[g, c]
        f0 = anchor_gap[g, i0] - state.gap[i0] - state.remainder[g, i0]
        for r in range(count):
            change[r] += inverse[c, r] * f0


@subroutine
def _solve_chord(
    g: int, load: float, loads: Loads, constants: ContactConstants, state: ChordState
) -> bool:
    """Solve the chord equations; False if a strip is in tension or too far from the anchor."""
    _fill_load_change(g, loads.anchor_gap, state)
    missing, stiffness, peak = load / constants.spacing, 0.0, 0.0
    for r in range(state.loaded[g]):
        q0 = loads.anchor[g, state.active[g, r]]
        missing -= q0 + state.change[r]
        stiffness += state.unit_load[g, r]
        peak = max(peak, q0)
    rise = missing / stiffness
    for r in range(state.loaded[g]):
        state.change[r] += state.unit_load[g, r] * rise
        q0 = loads.anchor[g, state.active[g, r]]
        q = q0 + state.change[r]
        if not q > 0.0 or abs(state.change[r]) > min(STRAY * peak, DOUBLED * q0):
            return False
        loads.line_load[g, state.active[g, r]] = q
    loads.approach[g] = loads.anchor_approach[g] + rise
    return True


@subroutine
def _has_penetrated_strip(g: int, approach: float, tolerance: float, state: ChordState) -> bool:
    """Return whether an unloaded strip next to the contact has closed its gap."""
    for r in range(state.guard.shape[1]):
        i = state.guard[g, r]
        if i < 0:
            break
        surface, count = state.gap[i] + state.surface[g, i], state.loaded[g]
        s0 = s1 = s2 = s3 = 0.0  # one sum alone would wait for every addition
        for c in range(0, count - 3, 4):
            s0 += state.guard_row[g, r, c] * state.change[c]
            s1 += state.guard_row[g, r, c + 1] * state.change[c + 1]
            s2 += state.guard_row[g, r, c + 2] * state.change[c + 2]
            s3 += state.guard_row[g, r, c + 3] * state.change[c + 3]
        for c in range(count - count % 4, count):
            s0 += state.guard_row[g, r, c] * state.change[c]
        if approach - (surface + ((s0 + s1) + (s2 + s3))) > tolerance:
            return True
    return False


@subroutine
def solve_from_anchor(
    g: int, load: float, lowest: float, loads: Loads, constants: ContactConstants, state: ChordState
) -> bool:
    """Solve contact `g` from its anchor; False if it needs a full solve.

    `lowest` is the least gap [m].
    """
    if not loads.anchor[g].max() > 0.0:
        return False
    before = state.work[4]
    for _ in range(MAX_CHORD):
        if not _solve_chord(g, load, loads, constants, state):
            return False
        before[: state.gap.shape[0]] = state.remainder[g]
        fill_remainder(g, loads, constants, state)
        residual = 0.0
        for r in range(state.loaded[g]):
            i = state.active[g, r]
            residual = max(residual, abs(state.remainder[g, i] - before[i]))
        elastic = loads.approach[g] - lowest
        if residual <= RESIDUAL * elastic:
            return not _has_penetrated_strip(g, loads.approach[g], GAP_TOLERANCE * elastic, state)
    return False


@subroutine
def solve_fully(
    g: int,
    load: float,
    anchored: bool,
    loads: Loads,
    constants: ContactConstants,
    state: ChordState,
) -> int:
    """Solve contact `g` by Newton's method and set its anchor if `anchored`; return the status."""
    n = state.gap.shape[0]
    line_load = loads.line_load[g].copy().reshape((1, 1, n))
    approach, status = np.full((1, 1), loads.approach[g]), np.zeros((2, 1), np.int64)
    solve_slender(
        state.gap.reshape((1, 1, n)),
        np.zeros((1, 1, n)),
        None,
        None,
        np.full((1, 1), load),
        np.full((1, 1), constants.longitudinal_curvature[g]),
        constants.spacing,
        constants.contact_modulus,
        constants.table,
        constants.curvature_influence,
        TOLERANCE,
        line_load,
        approach,
        np.empty((1, 1, n)),
        np.empty((1, 1, n)),
        status[0],
        status[1],
    )
    if status[0, 0] != CONVERGED:
        return int(status[0, 0])
    loads.approach[g] = approach[0, 0]
    for i in range(n):
        loads.line_load[g, i] = line_load[0, 0, i]
    if not anchored:
        _number_strips(g, loads.line_load, state)
        find_factors(g, loads.line_load, False, SWEEPS, state.lengths)
        return CONVERGED
    for i in range(n):
        loads.anchor[g, i], loads.anchor_gap[g, i] = line_load[0, 0, i], state.gap[i]
        state.remainder[g, i] = 0.0
    loads.anchor_approach[g] = approach[0, 0]
    return CONVERGED if set_anchor(g, loads.anchor, constants, state) else SINGULAR

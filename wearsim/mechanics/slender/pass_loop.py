"""Per-pass loop of slender contacts with strip theory: every roller pass is solved separately.

Between full solves a contact is solved by the chord method of `chord_method`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from wearsim.mechanics.numerics.jit import borrowed, kernel, subroutine
from wearsim.mechanics.slender.chord_method import (
    ChordState,
    ContactConstants,
    Loads,
    fill_remainder,
    set_anchor,
    solve_from_anchor,
    solve_fully,
)
from wearsim.mechanics.slender.half_length import REACH, fill_factor_growth
from wearsim.mechanics.slender.newton import CONVERGED, NO_CONVERGENCE, SINGULAR
from wearsim.mechanics.tangential.strip_theory import solve_strips
from wearsim.types import FloatArray, IntArray

UNLOADED = 10  # status: the load is not positive
LOAD_TOLERANCE = 1e-6  # relative change of the load of a spring by the approach it causes
MAX_LOAD_ITERATIONS = 40
SMALL = 0.02  # up to which logarithms and exponential functions are five terms of their series
APPROACH_EXPONENT = 0.75  # approach as a power of the load: 2/3 in a Hertzian contact, 1 in a flat


class Passes(NamedTuple):
    """Inputs of every pass, in order; shapes as in `run_passes`."""

    base_load: FloatArray
    creepage: FloatArray
    friction: FloatArray
    tilt: FloatArray
    spin: FloatArray


class Wear(NamedTuple):
    """Local creepage and worn depths; shapes as in `run_passes`."""

    slip_base: FloatArray
    spin_arm: FloatArray
    slip_rates: FloatArray
    depth_per_work: FloatArray
    cylinder_depth: FloatArray
    roller_depth: FloatArray


@subroutine
def _fill_growth(
    g: int, first: int, last: int, loads: Loads, growth: FloatArray, size: int
) -> None:
    """Fill the growth of ln q beyond the anchor; parameters as of `fill_factor_growth`."""
    line_load, anchor, great = loads.line_load, loads.anchor, 0
    growth[:size] = 0.0
    for i in range(first, last + 1):
        x = (line_load[g, i] - anchor[g, i]) / max(anchor[g, i], 1e-300)
        great += int(abs(x) > SMALL)
        growth[i + 2 * REACH] = x * (
            1.0 - x * (1 / 2 - x * (1 / 3 - x * (1 / 4 - x * (1 / 5 - x / 6))))
        )
    for i in range(first, last + 1 if great > 0 else first):
        if abs(line_load[g, i] - anchor[g, i]) > SMALL * anchor[g, i]:
            growth[i + 2 * REACH] = np.log(line_load[g, i] / anchor[g, i])


@subroutine
def _wear_strips(
    g: int,
    p: int,
    loads: Loads,
    anchored: bool,
    passes: Passes,
    constants: ContactConstants,
    state: ChordState,
    wear: Wear,
) -> float:
    """Wear both bodies by pass `p` of contact `g`; return the sum of dissipation over V [N/m].

    Half-lengths of an anchored contact follow the loads to first order: in partial slip, those with
    the interaction factors of the anchor would change the worn profile by 1e-4.
    """
    mean, total, dissipated, spin = 0.0, 0.0, 0.0, passes.spin[p]
    line_load, work, factor = loads.line_load, state.tractions.work, state.lengths.factor
    half_length, friction, slip_x = (
        state.strip_inputs[0],
        state.strip_inputs[1],
        state.strip_inputs[2],
    )
    # loops over the unloaded strips between loaded ones too are vectorised
    first, last = state.active[g, 0], state.active[g, state.loaded[g] - 1]
    for i in range(first, last + 1):
        slip_x[i] = (
            wear.slip_base[g, i]
            - spin * wear.spin_arm[g, i]
            + (
                wear.slip_rates[0] * wear.roller_depth[g, i]
                - wear.slip_rates[1] * wear.cylinder_depth[i]
            )
        )
    for i in range(first, last + 1):
        mean += line_load[g, i] * slip_x[i]
        total += line_load[g, i]
    mean = passes.creepage[p, 0] - mean / total
    scale, change, great = constants.spacing * np.exp(state.lengths.log_scale[g]), work, 0
    change[:] = 0.0
    if anchored:
        growth = state.work[0]
        _fill_growth(g, first, last, loads, growth, line_load.shape[1] + 4 * REACH)
        fill_factor_growth(g, first, last, growth, state.lengths, change)
    for i in range(first, last + 1):
        x = change[i]
        great += int(abs(x) > SMALL)
        grown = 1.0 + x * (1.0 + x * (1 / 2 + x * (1 / 6 + x * (1 / 24 + x / 120))))
        half_length[i] = scale * np.sqrt(line_load[g, i] * factor[g, i] * grown)
        friction[i] = passes.friction[p]
        slip_x[i] += mean
    for i in range(first, last + 1 if great > 0 else first):
        if abs(change[i]) > SMALL:
            half_length[i] = scale * np.sqrt(line_load[g, i] * factor[g, i] * np.exp(change[i]))
    solve_strips(
        half_length,
        line_load[g],
        friction,
        slip_x,
        passes.creepage[p, 1],
        spin,
        constants.spacing,
        constants.elasticity,
        state.tractions,
    )
    for i in range(first, last + 1):
        wear.cylinder_depth[i] += wear.depth_per_work[0] * work[i]
        wear.roller_depth[g, i] += wear.depth_per_work[1 + g] * work[i]
    for i in range(first, last + 1):
        dissipated += work[i]
    return dissipated


@kernel
def run_passes(
    order: IntArray,
    first: int,
    passes: Passes,
    stiffness: float,
    fresh_approach: FloatArray,
    rests: bool,
    terms: FloatArray,
    term_rates: FloatArray,
    nominal_gap: FloatArray,
    from_apex: FloatArray,
    rolling_speed: FloatArray,
    similar: bool,
    constants: ContactConstants,
    wear: Wear,
    loads: Loads,
    state: ChordState,
    energy: FloatArray,
) -> tuple[int, int, int]:
    """Run roller passes one by one; the state is updated in place.

    Parameters
    ----------
    order : ndarray of int, shape (physical rollers,)
        Contact of each physical roller, in the order of their passes.
    first : int
        Number of the first pass, counted from the start of the test.
    passes : Passes
        Load before feedback [N], friction, tilt [rad] and spin [1/m] of every pass, (passes,), and
        its mean longitudinal and lateral creepage (passes, 2).
    stiffness : float
        Decrease of the load per displacement of a roller [N/m].
    fresh_approach : ndarray, shape (passes,)
        Elastic approach of unworn bodies in each pass, which does not displace the roller [m].
    rests : bool
        Whether a pass without load wears nothing, instead of being an error.
    terms : ndarray, shape (terms, contacts)
        State of linear load terms [N].
    term_rates : ndarray, shape (terms, 1 + contacts)
        Gain [N/W], and per contact the fraction of the distance to equilibrium in one pass.
    nominal_gap, from_apex : ndarray, shape (contacts, strips)
        Gap before wear without tilt, and its increase per unit of tilt [m].
    rolling_speed : ndarray, shape (contacts,)
        V [m/s].
    similar : bool
        Use the chord method where possible, instead of a full solve of every pass.
    constants : ContactConstants
    wear : Wear
        Variation of the creepage on unworn bodies, and its decrease per spin [m] (contacts,
        strips); its rates by the worn depth of roller and cylinder (2,) [1/m]; depth per work of
        the cylinder, then of each roller (1 + contacts,) [m/(N/m)]; worn depths (strips,) and
        (contacts, strips) [m].
    loads : Loads
        An anchor of zero load requires a full solve.
    state : ChordState
        Work space, from `new_chord_state`.
    energy : ndarray, shape (contacts,)
        Increased by the sum over passes of the dissipated power [W].

    Returns
    -------
    status, done, full_solves : int
        CONVERGED or the cause of failure; number of passes done, and of those solved in full.
    """
    passes, constants, wear = borrowed(passes), borrowed(constants), borrowed(wear)
    loads, state = borrowed(loads), borrowed(state)
    full_solves, count = 0, passes.base_load.shape[0]
    for g in range(nominal_gap.shape[0]):
        if loads.anchor[g].max() > 0.0:
            if not set_anchor(g, loads.anchor, constants, state):
                return SINGULAR, 0, full_solves
            fill_remainder(g, loads, constants, state)
    for p in range(count):
        g = order[(first + p) % order.shape[0]]
        lowest, lowest_unworn = np.inf, np.inf
        for i in range(nominal_gap.shape[1]):
            unworn = nominal_gap[g, i] + passes.tilt[p] * from_apex[g, i]
            state.gap[i] = unworn + wear.cylinder_depth[i] + wear.roller_depth[g, i]
            lowest, lowest_unworn = min(lowest, state.gap[i]), min(lowest_unworn, unworn)
        free, zero, fully = passes.base_load[p], lowest_unworn + fresh_approach[p], False
        for t in range(terms.shape[0]):
            free += terms[t, g]
        most = free - stiffness * (lowest - zero)  # without elastic approach
        if not most > 0.0 or (rests and passes.base_load[p] <= 0.0):
            if not rests:
                return UNLOADED, p, full_solves
            for t in range(terms.shape[0]):
                terms[t, g] -= term_rates[t, 1 + g] * terms[t, g]
            continue
        # a spring extends by the approach that the load causes, at first that of the last pass
        load = free - stiffness * (loads.approach[g] - zero)
        if not load > 0.0:
            load = 0.1 * most
        for iteration in range(MAX_LOAD_ITERATIONS):
            if not (similar and solve_from_anchor(g, load, lowest, loads, constants, state)):
                fully = True
                status = solve_fully(g, load, similar, loads, constants, state)
                if status != CONVERGED:
                    return status, p, full_solves
            change = free - stiffness * (loads.approach[g] - zero) - load
            if stiffness == 0.0 or abs(change) <= LOAD_TOLERANCE * load:
                break
            if iteration == MAX_LOAD_ITERATIONS - 1:
                return NO_CONVERGENCE, p, full_solves
            slope = APPROACH_EXPONENT * (loads.approach[g] - lowest) / load
            load = max(load + change / (1.0 + stiffness * slope), 0.1 * load)
        full_solves += int(fully)
        power = (rolling_speed[g] * constants.spacing) * _wear_strips(
            g, p, loads, similar, passes, constants, state, wear
        )
        energy[g] += power
        for t in range(terms.shape[0]):
            terms[t, g] += term_rates[t, 1 + g] * (term_rates[t, 0] * power - terms[t, g])
    return CONVERGED, count, full_solves

"""The per-pass loop of slender contacts with strip theory: every roller pass solved by itself.

Between full solves a contact is followed by the chord method of `slender_follower`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from wearsim.mechanics.numerics.jit import kernel
from wearsim.mechanics.slender.chord_method import (
    Follower,
    Loads,
    Medium,
    beyond_tangent,
    follow,
    set_anchor,
    solve_fully,
)
from wearsim.mechanics.slender.half_length import log_length
from wearsim.mechanics.slender.newton import CONVERGED, SINGULAR
from wearsim.mechanics.tangential.strip_theory import solve_strips
from wearsim.types import FloatArray, IntArray

LOST = 10  # status: the load is not positive


class Passes(NamedTuple):
    """The inputs of every pass, in turn; shapes as in `run_passes`."""

    base_load: FloatArray
    creepage: FloatArray
    friction: FloatArray
    tilt: FloatArray
    spin: FloatArray


class Wear(NamedTuple):
    """How strips slip and wear; shapes as in `run_passes`."""

    slip_base: FloatArray
    spin_arm: FloatArray
    slip_rates: FloatArray
    depth_per_work: FloatArray
    cylinder_depth: FloatArray
    roller_depth: FloatArray


@kernel
def _local_slip(g: int, i: int, spin: float, w: Wear) -> float:
    """Return the variation of the longitudinal creepage at strip `i`, worn depth included."""
    worn = w.slip_rates[0] * w.roller_depth[g, i] - w.slip_rates[1] * w.cylinder_depth[i]
    variation: float = w.slip_base[g, i] - spin * w.spin_arm[g, i] + worn
    return variation


@kernel
def _wear_strips(
    g: int, p: int, line_load: FloatArray, passes: Passes, m: Medium, f: Follower, w: Wear
) -> float:
    """Wear both bodies by pass `p` of contact `g`; return the sum of dissipation over V [N/m]."""
    mean, total, spin = 0.0, 0.0, passes.spin[p]
    dissipated: float = 0.0
    for r in range(f.loaded[g]):
        i = f.active[g, r]
        mean += line_load[g, i] * _local_slip(g, i, spin, w)
        total += line_load[g, i]
    mean /= total
    half_length, friction, slip_x = f.seen[0], f.seen[1], f.seen[2]
    for r in range(f.loaded[g]):
        i = f.active[g, r]
        half_length[i] = m.spacing * np.exp(log_length(g, i, line_load, f.lengths))
        friction[i] = passes.friction[p]
        slip_x[i] = passes.creepage[p, 0] - mean + _local_slip(g, i, spin, w)
    solve_strips(
        half_length,
        line_load[g],
        friction,
        slip_x,
        passes.creepage[p, 1],
        spin,
        m.spacing,
        m.elasticity,
        f.tractions,
    )
    for r in range(f.loaded[g]):
        i = f.active[g, r]
        work = f.tractions.work[i]
        w.cylinder_depth[i] += w.depth_per_work[0] * work
        w.roller_depth[g, i] += w.depth_per_work[1 + g] * work
        dissipated += work
    return dissipated


@kernel
def _meet(
    g: int, tilt: float, nominal_gap: FloatArray, from_apex: FloatArray, f: Follower, w: Wear
) -> tuple[float, float]:
    """Fill the gap of contact `g`; return its least value, worn and unworn [m]."""
    lowest, fresh = np.inf, np.inf
    for i in range(nominal_gap.shape[1]):
        unworn = nominal_gap[g, i] + tilt * from_apex[g, i]
        f.gap[i] = unworn + w.cylinder_depth[i] + w.roller_depth[g, i]
        lowest, fresh = min(lowest, f.gap[i]), min(fresh, unworn)
    return lowest, fresh


@kernel
def run_passes(
    order: IntArray,
    first: int,
    passes: Passes,
    stiffness: float,
    terms: FloatArray,
    term_rates: FloatArray,
    nominal_gap: FloatArray,
    from_apex: FloatArray,
    rolling_speed: float,
    similar: bool,
    m: Medium,
    w: Wear,
    loads: Loads,
    f: Follower,
    energy: FloatArray,
) -> tuple[int, int, int]:
    """Run roller passes one by one; everything that evolves is changed in place.

    Parameters
    ----------
    order : ndarray of int, shape (physical rollers,)
        Which contact each physical roller is, in the order of their passes.
    first : int
        Number of the first pass, counted from the start of the test.
    passes : Passes
        Load before feedback [N], friction, tilt [rad] and spin [1/m] of every pass, (passes,), and
        its mean longitudinal and lateral creepage (passes, 2).
    stiffness : float
        Load lost per descent of a roller [N/m].
    terms : ndarray, shape (terms, contacts)
        State of linear load terms [N].
    term_rates : ndarray, shape (terms, 1 + contacts)
        Gain [N/W], and per contact the part of the way that a pass goes to rest.
    nominal_gap, from_apex : ndarray, shape (contacts, strips)
        Gap before wear without tilt, and what a unit of tilt adds to it [m].
    rolling_speed : float
        V [m/s].
    similar : bool
        Follow a contact from pass to pass, rather than solve every pass in full.
    m : Medium
    w : Wear
        Variation of the creepage on unworn bodies, and what it falls by per spin [m] (contacts,
        strips); what worn depth of roller and cylinder adds to it (2,) [1/m]; depth per work of
        the cylinder, then of each roller (1 + contacts,) [m/(N/m)]; worn depths (strips,) and
        (contacts, strips) [m].
    loads : Loads
        An anchor of zero load asks for a full solve.
    f : Follower
        Work space, from `empty_follower`.
    energy : ndarray, shape (contacts,)
        Added to: sum over passes of the dissipated power [W].

    Returns
    -------
    status, done, full_solves : int
        CONVERGED or what went wrong, the passes done, and those solved in full.
    """
    full_solves, count = 0, passes.base_load.shape[0]
    for g in range(nominal_gap.shape[0]):
        if loads.anchor[g].max() > 0.0:
            if not set_anchor(g, loads.anchor, m, f):
                return SINGULAR, 0, full_solves
            beyond_tangent(g, loads, m, f)
    for p in range(count):
        g = order[(first + p) % order.shape[0]]
        lowest, fresh = _meet(g, passes.tilt[p], nominal_gap, from_apex, f, w)
        load = passes.base_load[p] - stiffness * (lowest - fresh)
        for t in range(terms.shape[0]):
            load += terms[t, g]
        if not load > 0.0:
            return LOST, p, full_solves
        if not (similar and follow(g, load, lowest, loads, m, f)):
            full_solves += 1
            status = solve_fully(g, load, similar, loads, m, f)
            if status != CONVERGED:
                return status, p, full_solves
        power = _wear_strips(g, p, loads.line_load, passes, m, f, w)
        power *= rolling_speed * m.spacing
        energy[g] += power
        for t in range(terms.shape[0]):
            terms[t, g] += term_rates[t, 1 + g] * (term_rates[t, 0] * power - terms[t, g])
    return CONVERGED, count, full_solves

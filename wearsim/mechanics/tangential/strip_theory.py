"""Strip theory: rolling contact of every strip under its effective slip.

The forces of a strip are those of `carter.strip_force`, with moduli for the finite width of the
contact and with the slip induced by the tractions of the other strips (`strip_interaction`). Two
sweeps are made: forces from the rigid slip, the slip they induce, and forces from both. With
longitudinal creepage only, the induced slip is lateral, changes the power by less than 0.05 % on a
Hertzian patch, and is neglected.

The steepness of the traction bound along rolling, 2 p0/a, is replaced by its load-weighted mean
over the strips: it represents the curvature along rolling, which is the same for all strips. On
profiles whose strips interact, 2 p0/a varies, but the relation between traction and slip does not.

The dissipation of a strip is the work of its traction on the effective slip. The dissipation of all
strips is then scaled by a common factor, less than half a per cent from 1, so that the total is the
work of the rigid slip, P = -V (xi F_x + eta F_y + phi M_z), to round-off.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from wearsim.mechanics.numerics.jit import compile_alongside, kernel, subroutine
from wearsim.mechanics.tangential.carter import spin_turns, straight_force, strip_force
from wearsim.mechanics.tangential.strip_interaction import (
    StripElasticity,
    coupling_length,
    effective_moduli,
    equivalent_ratio,
    induced_slip,
)
from wearsim.types import FloatArray

SUMS = ("force_x", "force_y", "spin_moment", "power", "peak_pressure", "adhesion_fraction")

_LEAST = 1e-30  # Pa/m, added to the steepness of the bound to avoid a division by zero


class StripTractions(NamedTuple):
    """Tractions of the strips of a contact, all (strips,), zero in unloaded strips.

    Forces on body 1 [N/m], moment of the lateral force [N], work per rolled distance [N/m],
    adhesion length [m], and slip induced by the other strips.
    """

    force_x: FloatArray
    force_y: FloatArray
    moment: FloatArray
    work: FloatArray
    adhesion_length: FloatArray
    induced_x: FloatArray
    induced_y: FloatArray


@subroutine
def new_tractions(strips: int) -> StripTractions:
    """Return `StripTractions` of zeros."""
    rows = np.zeros((7, strips))
    return StripTractions(rows[0], rows[1], rows[2], rows[3], rows[4], rows[5], rows[6])


@subroutine
def bound_steepness(half_length: FloatArray, line_load: FloatArray) -> float:
    """Return the steepness of the pressure bound along rolling, 2 p0/a [Pa/m].

    Parameters
    ----------
    half_length, line_load : ndarray, shape (strips,)
        a [m] and q [N/m].

    Returns
    -------
    float
        Load-weighted mean over the strips; zero without load.
    """
    load, moment = 0.0, 0.0
    for i in range(line_load.shape[0]):
        if line_load[i] > 0.0:
            load += line_load[i]
            stress = line_load[i] / half_length[i]
            moment += 4.0 / np.pi * (stress * stress)
    return moment / load if load > 0.0 else 0.0


@subroutine
def _fill_work(slip_x: FloatArray, slip_y: float, spin: float, out: StripTractions) -> None:
    """Fill the work on the effective slip, scaled so that the total is that of the rigid slip."""
    seen, rigid = 0.0, 0.0
    for i in range(slip_x.shape[0]):
        force_x, force_y = out.force_x[i], out.force_y[i]
        work = -(force_x * slip_x[i] + force_y * slip_y + spin * out.moment[i])
        out.work[i] = work - (force_x * out.induced_x[i] + force_y * out.induced_y[i])
        seen += out.work[i]
        rigid += work
    scale = rigid / seen if seen > 0.0 else 1.0
    for i in range(slip_x.shape[0]):
        out.work[i] *= scale


@subroutine
def solve_strips(
    half_length: FloatArray,
    line_load: FloatArray,
    friction: FloatArray,
    slip_x: FloatArray,
    slip_y: float,
    spin: float,
    spacing: float,
    elasticity: StripElasticity,
    out: StripTractions,
) -> None:
    """Fill the tractions of the strips of one contact.

    All strips are computed without branches: those without load or friction have placeholder inputs
    and a traction bound of zero. Strips that require the full formula for spin are then repeated.

    Parameters
    ----------
    half_length, line_load, friction, slip_x : ndarray, shape (strips,)
        a [m], q [N/m], mu, and the rigid longitudinal slip per unit of rolling velocity, including
        the part of spin.
    slip_y, spin : float
        Lateral creepage, and spin phi [1/m]; the local lateral slip is slip_y + phi x.
    spacing : float
        Width of a strip [m].
    elasticity : StripElasticity
    out : StripTractions
        Filled.
    """
    n = line_load.shape[0]
    first, last = n, -n  # a literal would be compiled as another signature of induced_slip
    load, mean = 0.0, 0.0
    for i in range(n):
        out.induced_x[i], out.induced_y[i] = 0.0, 0.0
        if line_load[i] > 0.0:
            first, last = min(first, i), i
            load += line_load[i]
            mean += line_load[i] * half_length[i]
    ratio = equivalent_ratio(half_length, line_load, spacing)
    modulus_x, modulus_y = effective_moduli(ratio, elasticity)
    steepness = bound_steepness(half_length, line_load)
    coupled = last >= 0 and (slip_y != 0.0 or spin != 0.0)
    for sweep in range(2 if coupled else 1):
        if sweep > 0:
            sticking = 0.0
            for i in range(first, last + 1):
                sticking += line_load[i] * out.adhesion_length[i]
            induced_slip(
                out.force_x,
                out.force_y,
                first,
                last,
                spacing,
                coupling_length(mean / load, 0.5 * sticking / mean),
                elasticity,
                out.induced_x,
                out.induced_y,
            )
        turned = 0
        for i in range(n if spin != 0.0 else 0):
            x, y = slip_x[i] + out.induced_x[i], slip_y + out.induced_y[i]
            if spin_turns(half_length[i], friction[i] * steepness, x, y, spin, modulus_y):
                turned += 1
        for i in range(n):
            loaded = 1.0 if line_load[i] > 0.0 else 0.0
            force_x, force_y, moment, adhering = straight_force(
                loaded * half_length[i] + (1.0 - loaded),
                max(friction[i] * (loaded * line_load[i]), 0.0),
                friction[i] * steepness + _LEAST,
                slip_x[i] + out.induced_x[i],
                slip_y + out.induced_y[i],
                spin,
                modulus_x,
                modulus_y,
            )
            out.force_x[i], out.force_y[i], out.moment[i] = force_x, force_y, moment
            out.adhesion_length[i] = loaded * adhering
        for i in range(n if turned > 0 else 0):
            if line_load[i] > 0.0:
                x, y = slip_x[i] + out.induced_x[i], slip_y + out.induced_y[i]
                a, q, mu = half_length[i], line_load[i], friction[i]
                out.force_x[i], out.force_y[i], out.moment[i], out.adhesion_length[i] = strip_force(
                    a, q, mu, steepness, x, y, spin, modulus_x, modulus_y
                )
    _fill_work(slip_x, slip_y, spin, out)


strips_of_contact = kernel(solve_strips)  # for calls from Python


@kernel
def strip_contacts(
    line_load: FloatArray,
    half_length: FloatArray,
    y: FloatArray,
    spacing: float,
    elasticity: StripElasticity,
    rolling_speed: FloatArray,
    longitudinal: FloatArray,
    lateral: FloatArray,
    spin: FloatArray,
    variation: FloatArray,
    friction: FloatArray,
    rolling_radius: FloatArray,
    dissipation: FloatArray,
    sums: FloatArray,
    torque: FloatArray,
) -> None:
    """Compute the tractions of several contacts of slender strips, and their sums.

    Parameters
    ----------
    line_load, half_length : ndarray, shape (contacts, strips)
        q [N/m] and a [m].
    y : ndarray, shape (strips,)
        Axial position [m].
    spacing : float
        Strip width [m].
    elasticity : StripElasticity
    rolling_speed, longitudinal, lateral, spin : ndarray, shape (contacts,)
        V [m/s], mean longitudinal creepage, lateral creepage, and spin phi [1/m].
    variation : ndarray, shape (contacts, strips), or (contacts, 0) for that by the spin
        Variation of the longitudinal creepage, whose load-weighted mean is subtracted here.
    friction : ndarray, shape (contacts, strips or 1)
        Friction coefficient.
    rolling_radius : ndarray, shape (contacts, strips), or (contacts, 0) where it is not needed
        Lever arm of the longitudinal traction [m].
    dissipation : ndarray, shape (contacts, strips)
        Filled: P_l [W/m].
    sums : ndarray, shape (6, contacts)
        Filled, in the order of `SUMS`: forces on body 1 [N], their moment about the centre of the
        load [N m], power [W], greatest pressure [Pa], and adhering fraction of the area.
    torque : ndarray, shape (contacts,)
        Filled: torque of the longitudinal traction on the roller [N m], zero without the lever arm.
    """
    contacts, n = line_load.shape
    slip_x, local_friction, tractions = np.empty(n), np.empty(n), new_tractions(n)
    for k in range(contacts):
        first, last = 0, n - 1  # of the loaded strips, to which all sums are restricted
        while last > 0 and not line_load[k, last] > 0.0:
            last -= 1
        while first < last and not line_load[k, first] > 0.0:
            first += 1
        total, centre, mean = 0.0, 0.0, 0.0
        for i in range(first, last + 1):
            q, here = line_load[k, i], i - first
            slip_x[here] = variation[k, i] if variation.shape[1] > 0 else -spin[k] * y[i]
            local_friction[here] = friction[k, i if friction.shape[1] > 1 else 0]
            total += q
            centre += q * y[i]
            mean += q * slip_x[here]
        centre /= total
        mean = longitudinal[k] - mean / total
        for here in range(last + 1 - first):
            slip_x[here] += mean
        solve_strips(
            half_length[k, first : last + 1],
            line_load[k, first : last + 1],
            local_friction,
            slip_x[: last + 1 - first],
            lateral[k],
            spin[k],
            spacing,
            elasticity,
            tractions,
        )
        peak = length = adhering = sum_x = sum_y = moment = power = torque[k] = 0.0
        dissipation[k] = 0.0
        for i in range(first, last + 1):
            here = i - first
            dissipation[k, i] = rolling_speed[k] * tractions.work[here]
            if line_load[k, i] > 0.0:
                peak = max(peak, 2.0 * line_load[k, i] / (np.pi * half_length[k, i]))
            length += half_length[k, i]
            adhering += tractions.adhesion_length[here]
            sum_x += tractions.force_x[here]
            sum_y += tractions.force_y[here]
            moment += tractions.moment[here] - (y[i] - centre) * tractions.force_x[here]
            power += dissipation[k, i]
            if rolling_radius.shape[1] > 0:
                torque[k] -= tractions.force_x[here] * rolling_radius[k, i] * spacing
        sums[0, k], sums[1, k] = sum_x * spacing, sum_y * spacing
        sums[2, k], sums[3, k] = moment * spacing, power * spacing
        sums[4, k], sums[5, k] = peak, 0.5 * adhering / length


def compile_strip_contacts() -> None:
    """Compile `strip_contacts` by a call for one contact of one strip."""
    strip, contact = np.ones((1, 1)), np.ones(1)
    elasticity = StripElasticity(1e11, 4e10, np.ones((2, 2)))
    slips = (contact, contact, contact, contact)  # rolling speed, both creepages, and spin
    filled = np.empty((1, 1)), np.empty((len(SUMS), 1)), np.empty(1)
    strip_contacts(strip, strip, contact, 1.0, elasticity, *slips, strip, strip, strip, *filled)


compile_alongside("solve_slender", compile_strip_contacts, "strip_contacts", "solve_strips")

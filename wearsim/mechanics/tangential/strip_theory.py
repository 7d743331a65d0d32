"""Strip theory: rolling contact in every strip, with the slip that strip sees.

Each strip is `carter.strip_force`, with moduli for the finite width of the contact and with the
slip that its neighbours' tractions induce (`strip_coupling`). That takes two rounds: forces from
the rigid slip, the slip they induce, forces from both. Where there is longitudinal creepage only,
the slip induced is lateral, changes the power by less than 0.05 % on a Hertzian patch, and is left
out.

What a strip's traction bound falls by along rolling, 2 p0/a, is taken alike for all strips, as the
mean over the load: it stands for the curvature along rolling, which is. On profiles whose strips
bear on one another it differs from strip to strip, but not what tractions make of the slip.

A strip dissipates the work of its traction on the slip it sees, induced slip included; all are then
scaled alike, by less than half a per cent, so that they add up to the work of the rigid slip,
P = -V (xi F_x + eta F_y + phi M_z), to round-off.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from wearsim.mechanics.numerics.jit import kernel
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

_LEAST = 1e-30  # Pa/m, added to the steepness of a bound: less than a rounding, but where it is 0


class StripTractions(NamedTuple):
    """What the strips of a contact carry, all (strips,): zero where they are not loaded.

    Forces on body 1 [N/m], the moment of the lateral one [N], work per rolled distance [N/m],
    length that adheres [m], and slip induced by the other strips.
    """

    force_x: FloatArray
    force_y: FloatArray
    moment: FloatArray
    work: FloatArray
    adhesion_length: FloatArray
    induced_x: FloatArray
    induced_y: FloatArray


@kernel
def new_tractions(strips: int) -> StripTractions:
    """Return tractions to be filled."""
    room = np.zeros((7, strips))
    return StripTractions(room[0], room[1], room[2], room[3], room[4], room[5], room[6])


@kernel
def bound_steepness(half_length: FloatArray, line_load: FloatArray) -> float:
    """Return what the pressure bound of all strips falls by along rolling, 2 p0/a [Pa/m].

    Parameters
    ----------
    half_length, line_load : ndarray, shape (strips,)
        a [m] and q [N/m].

    Returns
    -------
    float
        The mean over the load; zero where there is none.
    """
    load, moment = 0.0, 0.0
    for i in range(line_load.shape[0]):
        if line_load[i] > 0.0:
            load += line_load[i]
            moment += 4.0 / np.pi * (line_load[i] / half_length[i]) ** 2
    return moment / load if load > 0.0 else 0.0


@kernel
def _fill_forces(
    half_length: FloatArray,
    line_load: FloatArray,
    friction: FloatArray,
    slip_x: FloatArray,
    slip_y: float,
    spin: float,
    steepness: float,
    modulus_x: float,
    modulus_y: float,
    out: StripTractions,
) -> None:
    """Fill the forces for the slip that strips see; that induced is read from `out`.

    All strips are done alike, without branches: those without load or friction get harmless
    numbers in, and a traction bound of zero. Those that spin asks more of are then done again.
    """
    turned = 0
    if spin != 0.0:
        for i in range(line_load.shape[0]):
            x, y = slip_x[i] + out.induced_x[i], slip_y + out.induced_y[i]
            steep = friction[i] * steepness
            turned += 1 if spin_turns(half_length[i], steep, x, y, spin, modulus_y) else 0
    for i in range(line_load.shape[0]):
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
    for i in range(line_load.shape[0] if turned > 0 else 0):
        if line_load[i] > 0.0:
            x, y = slip_x[i] + out.induced_x[i], slip_y + out.induced_y[i]
            a, q, mu = half_length[i], line_load[i], friction[i]
            found = strip_force(a, q, mu, steepness, x, y, spin, modulus_x, modulus_y)
            out.force_x[i], out.force_y[i], out.moment[i], out.adhesion_length[i] = found


@kernel
def _fill_work(slip_x: FloatArray, slip_y: float, spin: float, out: StripTractions) -> None:
    """Fill the work on the slip that strips see, scaled to add up to that on the rigid slip."""
    seen, rigid = 0.0, 0.0
    for i in range(slip_x.shape[0]):
        force_x, force_y = out.force_x[i], out.force_y[i]
        own = -(force_x * slip_x[i] + force_y * slip_y + spin * out.moment[i])
        out.work[i] = own - (force_x * out.induced_x[i] + force_y * out.induced_y[i])
        seen += out.work[i]
        rigid += own
    scale = rigid / seen if seen > 0.0 else 1.0
    for i in range(slip_x.shape[0]):
        out.work[i] *= scale


@kernel
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

    Parameters
    ----------
    half_length, line_load, friction, slip_x : ndarray, shape (strips,)
        a [m], q [N/m], mu, and the rigid longitudinal slip per unit of rolling velocity, spin's
        part included.
    slip_y, spin : float
        Lateral creepage, and spin [1/m] whose phi x adds to it.
    spacing : float
        Width of a strip [m].
    elasticity : StripElasticity
    out : StripTractions
        Filled.
    """
    n = line_load.shape[0]
    first, last = n, -n  # no literal, which induced_slip would be compiled for by itself
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
            adhering = 0.0
            for i in range(first, last + 1):
                adhering += line_load[i] * out.adhesion_length[i]
            induced_slip(
                out.force_x,
                out.force_y,
                first,
                last,
                spacing,
                coupling_length(mean / load, 0.5 * adhering / mean),
                elasticity,
                out.induced_x,
                out.induced_y,
            )
        _fill_forces(
            half_length,
            line_load,
            friction,
            slip_x,
            slip_y,
            spin,
            steepness,
            modulus_x,
            modulus_y,
            out,
        )
    _fill_work(slip_x, slip_y, spin, out)


@kernel
def strip_contacts(
    line_load: FloatArray,
    half_length: FloatArray,
    y: FloatArray,
    spacing: float,
    elasticity: StripElasticity,
    rolling_speed: float,
    longitudinal: FloatArray,
    lateral: FloatArray,
    spin: FloatArray,
    variation: FloatArray,
    friction: FloatArray,
    dissipation: FloatArray,
    sums: FloatArray,
) -> None:
    """Complete several contacts of slender strips: tractions and their sums.

    Parameters
    ----------
    line_load, half_length : ndarray, shape (contacts, strips)
        q [N/m] and a [m].
    y : ndarray, shape (strips,)
        Axial position [m].
    spacing : float
        Strip width [m].
    elasticity : StripElasticity
    rolling_speed : float
        V [m/s].
    longitudinal, lateral, spin : ndarray, shape (contacts,)
        Mean longitudinal, and lateral creepage, and spin [1/m] for its phi x.
    variation, friction : ndarray, shape (contacts, strips)
        How the longitudinal creepage varies, its mean weighted by the line load being taken off
        here; friction coefficient.
    dissipation : ndarray, shape (contacts, strips)
        Filled: P_l [W/m].
    sums : ndarray, shape (6, contacts)
        Filled, in the order of `SUMS`: forces on body 1 [N], their moment about the load's centre
        [N m], power [W], greatest pressure [Pa], and part of the area that adheres.
    """
    contacts, n = line_load.shape
    slip_x, found = np.empty(n), new_tractions(n)
    for k in range(contacts):
        total, centre, mean = 0.0, 0.0, 0.0
        for i in range(n):
            q = line_load[k, i]
            total += q
            centre += q * y[i]
            mean += q * variation[k, i]
        centre /= total
        mean = longitudinal[k] - mean / total
        for i in range(n):
            slip_x[i] = mean + variation[k, i]
        solve_strips(
            half_length[k],
            line_load[k],
            friction[k],
            slip_x,
            lateral[k],
            spin[k],
            spacing,
            elasticity,
            found,
        )
        peak, length, adhering = 0.0, 0.0, 0.0
        sum_x, sum_y, moment, power = 0.0, 0.0, 0.0, 0.0
        for i in range(n):
            dissipation[k, i] = rolling_speed * found.work[i]
            if line_load[k, i] > 0.0:
                peak = max(peak, 2.0 * line_load[k, i] / (np.pi * half_length[k, i]))
            length += half_length[k, i]
            adhering += found.adhesion_length[i]
            sum_x += found.force_x[i]
            sum_y += found.force_y[i]
            moment += found.moment[i] - (y[i] - centre) * found.force_x[i]
            power += dissipation[k, i]
        sums[0, k], sums[1, k] = sum_x * spacing, sum_y * spacing
        sums[2, k], sums[3, k] = moment * spacing, power * spacing
        sums[4, k] = peak
        sums[5, k] = 0.5 * adhering / length

"""Strip theory: Carter's rolling contact in every strip, with the creepage that strip sees.

Carter, Proc. R. Soc. A 112 (1926), DOI 10.1098/rspa.1926.0100; spin enters as a longitudinal
creepage that varies across the track. In a strip of half-length a and greatest pressure p0

    d_x = X E* a / (2 mu p0),  d_y = Y G a / (2 mu p0),  d = hypot(d_x, d_y),
    F = mu q t (2 a - t) / a^2,  t = min(d, a),

(X, Y) being the rigid slip per unit of rolling velocity. The traction opposes (d_x, d_y) in a strip
that adheres and (X, Y) in one that slides; in between, a mean of the two weighted with 1 - (t/a)^4
keeps the force continuous and comes nearest to the exact theory. The dissipation is the work of the
rigid slip, P_l = V F . (X, Y).
"""

from __future__ import annotations

import numpy as np

from wearsim.mechanics.jit import kernel
from wearsim.types import FloatArray


@kernel
def strip_force(
    half_length: float,
    line_load: float,
    friction: float,
    slip_x: float,
    slip_y: float,
    contact_modulus: float,
    shear_modulus: float,
) -> tuple[float, float, float]:
    """Return the force of one strip along x and y [N/m], and the length that adheres.

    Parameters
    ----------
    half_length, line_load, friction : float
        a [m], q [N/m] and mu; a and q positive.
    slip_x, slip_y : float
        Rigid slip per unit of rolling velocity.
    contact_modulus, shear_modulus : float
        E* and G [Pa].

    Returns
    -------
    force_x, force_y, adhesion_length : float
        Forces on body 1 [N/m], length that adheres [m].
    """
    rigid = np.hypot(slip_x, slip_y)
    if rigid == 0.0:
        return 0.0, 0.0, 2.0 * half_length
    bound = 4.0 * friction * line_load / (np.pi * half_length * half_length)
    d_x = slip_x * contact_modulus / bound
    d_y = slip_y * shear_modulus / bound
    d = np.hypot(d_x, d_y)
    t = min(d, half_length)
    force = friction * line_load * t * (2.0 * half_length - t) / half_length**2
    adhering = 1.0 - (t / half_length) ** 4
    e_x = adhering * d_x / d + (1.0 - adhering) * slip_x / rigid
    e_y = adhering * d_y / d + (1.0 - adhering) * slip_y / rigid
    force /= np.hypot(e_x, e_y)
    return -force * e_x, -force * e_y, 2.0 * (half_length - t)


@kernel
def strip_tractions(
    half_length: FloatArray,
    line_load: FloatArray,
    friction: FloatArray,
    slip_x: FloatArray,
    slip_y: float,
    contact_modulus: float,
    shear_modulus: float,
    rolling_speed: float,
    force_x: FloatArray,
    force_y: FloatArray,
    dissipation: FloatArray,
    adhesion_length: FloatArray,
) -> None:
    """Fill the tractions [N/m], dissipation [W/m] and adhesion length [m] of every strip.

    Parameters are those of `strip_force`, per strip where they are arrays of shape (strips,);
    strips without load get zeros.
    """
    for i in range(half_length.shape[0]):
        if line_load[i] > 0.0:
            force_x[i], force_y[i], adhesion_length[i] = strip_force(
                half_length[i],
                line_load[i],
                friction[i],
                slip_x[i],
                slip_y,
                contact_modulus,
                shear_modulus,
            )
            work = force_x[i] * slip_x[i] + force_y[i] * slip_y
            dissipation[i] = -rolling_speed * work
        else:
            force_x[i], force_y[i], adhesion_length[i], dissipation[i] = 0.0, 0.0, 0.0, 0.0


SUMS = ("force_x", "force_y", "spin_moment", "power", "peak_pressure", "adhesion_fraction")


@kernel
def strip_contacts(
    line_load: FloatArray,
    y: FloatArray,
    spacing: float,
    longitudinal_curvature: float,
    contact_modulus: float,
    shear_modulus: float,
    rolling_speed: float,
    longitudinal: FloatArray,
    lateral: FloatArray,
    variation: FloatArray,
    friction: FloatArray,
    half_length: FloatArray,
    dissipation: FloatArray,
    sums: FloatArray,
) -> None:
    """Complete several contacts of slender strips: half-lengths, tractions and their sums.

    Parameters
    ----------
    line_load : ndarray, shape (contacts, strips)
        q [N/m].
    y : ndarray, shape (strips,)
        Axial position [m].
    spacing, longitudinal_curvature : float
        Strip width [m], relative curvature along rolling [1/m].
    contact_modulus, shear_modulus, rolling_speed : float
        E* and G [Pa], V [m/s].
    longitudinal, lateral : ndarray, shape (contacts,)
        Mean longitudinal, and lateral creepage.
    variation, friction : ndarray, shape (contacts, strips)
        How the longitudinal creepage varies, its mean weighted by the line load being taken off
        here; friction coefficient.
    half_length, dissipation : ndarray, shape (contacts, strips)
        Filled: a [m], P_l [W/m].
    sums : ndarray, shape (6, contacts)
        Filled, in the order of `SUMS`: forces on body 1 [N], their moment about the load's centre
        [N m], power [W], greatest pressure [Pa], and part of the area that adheres.
    """
    contacts, n = line_load.shape
    scale = 4.0 / (np.pi * contact_modulus * longitudinal_curvature)
    for k in range(contacts):
        total, centre, mean = 0.0, 0.0, 0.0
        for i in range(n):
            q = line_load[k, i]
            total += q
            centre += q * y[i]
            mean += q * variation[k, i]
        centre /= total
        mean = longitudinal[k] - mean / total
        slip_y, widest, length, adhering = lateral[k], 0.0, 0.0, 0.0
        sum_x, sum_y, moment, power = 0.0, 0.0, 0.0, 0.0
        for i in range(n):
            q = line_load[k, i]
            if not q > 0.0:
                half_length[k, i], dissipation[k, i] = 0.0, 0.0
                continue
            a, slip_x = np.sqrt(scale * q), mean + variation[k, i]
            force_x, force_y, stick = strip_force(
                a, q, friction[k, i], slip_x, slip_y, contact_modulus, shear_modulus
            )
            half_length[k, i] = a
            dissipation[k, i] = -rolling_speed * (force_x * slip_x + force_y * slip_y)
            widest = max(widest, a)
            length += a
            adhering += stick
            sum_x += force_x
            sum_y += force_y
            moment -= (y[i] - centre) * force_x
            power += dissipation[k, i]
        sums[0, k], sums[1, k] = sum_x * spacing, sum_y * spacing
        sums[2, k], sums[3, k] = moment * spacing, power * spacing
        sums[4, k] = 0.5 * contact_modulus * longitudinal_curvature * widest
        sums[5, k] = 0.5 * adhering / length

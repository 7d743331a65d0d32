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

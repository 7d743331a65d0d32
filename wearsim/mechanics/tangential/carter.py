"""Rolling contact of one strip: Carter's closed form with longitudinal and lateral creepage, spin.

Symbols: half-length a, greatest traction bound mu p0, local rigid slip (X, Y + phi x). The ratio
2 p0 / a is replaced by its mean over all strips of the contact, as it represents the curvature
along rolling, which is the same for all strips. With

    d_x = X E_x a / (2 mu p0),  d_y = Y G_y a / (2 mu p0),  psi = phi G_y a / (2 mu p0),

consider the traction (over -mu) in a direction e of unit length, reduced where the strip adheres,
over the length 2 (a - t) from the leading edge,

    e p - (e - psi y^) (p0 / a) sqrt((a - t)^2 - (x - t)^2).

The slip vanishes there if e = (d_x / t, d_y / t + psi). This is Carter's solution (Proc. R. Soc. A
112 (1926), DOI 10.1098/rspa.1926.0100) extended to lateral creepage and spin; it is exact where e
is also the direction u of the slip behind the adhesion zone. The slip has the direction of (X, Y),
which differs from e because E_x differs from G_y, and by spin. To first order in u - e, the
equations of the strip are satisfied by the additional traction

    (u - e) [(3/2 - (a + x)/t) p + ((a + x)/t - 1/2) (p0/a) sqrt(...)],  t < a,
    (u - e) [1 - a^2/(2 t^2) - x/t] p,                                t >= a.

Compared with a numerical solution of the strip's equations, the error of the power is 0.1 % without
spin and with psi below 0.1, and 1.5 % with psi = 0.2 (nu = 0.3). Where a greater spin turns the
slip along a sliding strip, the mean direction over the strip is computed by quadrature. There are
no fitted constants; `SPIN_LIMIT` and `TURNED` are the limits between the two forms.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from wearsim.mechanics.numerics.jit import subroutine

SPIN_LIMIT = 0.9  # psi above which full sliding in both directions is blended in
TURNED = 0.2  # phi a over the slip above which the rotation of the slip along the strip is included

# Gauss quadrature for the weight sqrt(1 - s^2) with mean 1: nodes cos(k pi/8), weights sin^2/4
_RULE = tuple(
    (math.cos(k * math.pi / 8.0), 0.25 * math.sin(k * math.pi / 8.0) ** 2) for k in range(1, 8)
)


class StripState(NamedTuple):
    """Sliding state of a strip: t/a, directions of adhesion e and of slip u, psi, and two weights.

    `turned` is the weight of the rotation of the slip along a sliding strip, and `scrubbed` the
    fraction by which psi exceeds its limit.
    """

    t: float
    e_x: float
    e_y: float
    u_x: float
    u_y: float
    psi: float
    turned: float
    scrubbed: float


@subroutine
def strip_state(
    half_length: float,
    steepness: float,
    slip_x: float,
    slip_y: float,
    spin: float,
    modulus_x: float,
    modulus_y: float,
) -> StripState:
    """Return the sliding state of a strip; parameters as in `strip_force`.

    Here `steepness` includes the friction coefficient and is positive.
    """
    per = 1.0 / (steepness * half_length)
    d_x, d_y = slip_x * modulus_x * per, slip_y * modulus_y * per
    squared = d_x * d_x + d_y * d_y
    psi, turned, scrubbed = 0.0, 0.0, 0.0
    t = math.sqrt(squared)
    if spin != 0.0:
        whole = spin * half_length * modulus_y * per
        psi = min(max(whole, -SPIN_LIMIT), SPIN_LIMIT)
        scrubbed = max(0.0, 1.0 - SPIN_LIMIT / abs(whole))
        rest = 1.0 - psi * psi
        t = (d_y * psi + math.sqrt(d_y * d_y * psi * psi + rest * squared)) / rest
    slip = math.sqrt(slip_x * slip_x + slip_y * slip_y)
    if not t > 0.0 or slip == 0.0:
        return StripState(t, 0.0, psi, 0.0, psi, psi, 0.0, scrubbed)
    if spin != 0.0 and t > 1.0:
        straight = TURNED * slip / (spin * half_length)
        turned = max(0.0, 1.0 - 1.0 / (t * t) - straight * straight)
    return StripState(
        t, d_x / t, d_y / t + psi, slip_x / slip, slip_y / slip, psi, turned, scrubbed
    )


@subroutine
def mean_direction(slip_x: float, slip_y: float, turn: float) -> tuple[float, float, float]:
    """Return the pressure-weighted mean of the direction of (X, Y + phi x), and its moment.

    Parameters
    ----------
    slip_x, slip_y : float
        X and Y.
    turn : float
        phi a.

    Returns
    -------
    mean_x, mean_y, moment : float
        The moment is that of x/a times the y-component.
    """
    mean_x, mean_y, moment = 0.0, 0.0, 0.0
    for node, weight in _RULE:
        local = slip_y + turn * node
        slip = math.sqrt(slip_x * slip_x + local * local)
        share = weight / slip if slip > 0.0 else 0.0
        mean_x += share * slip_x
        mean_y += share * local
        moment += share * local * node
    return mean_x, mean_y, moment


@subroutine
def strip_force(
    half_length: float,
    line_load: float,
    friction: float,
    steepness: float,
    slip_x: float,
    slip_y: float,
    spin: float,
    modulus_x: float,
    modulus_y: float,
) -> tuple[float, float, float, float]:
    """Return the forces of one strip, their moment, and the adhesion length.

    Parameters
    ----------
    half_length, line_load, friction : float
        a [m], q [N/m] and mu; a and q positive.
    steepness : float
        2 p0/a, of this strip 4 q/(pi a^2), of a contact their mean [Pa/m].
    slip_x, slip_y : float
        X and Y, rigid slip per unit of rolling velocity in the middle of the strip.
    spin : float
        phi [1/m]; the local lateral slip is Y + phi x.
    modulus_x, modulus_y : float
        E_x and G_y [Pa]: E* and G in a long contact.

    Returns
    -------
    force_x, force_y : float
        Forces on body 1 [N/m]; their resultant is at most mu q.
    moment : float
        Integral of x times the lateral traction [N]; -(F_x X + F_y Y + phi moment) >= 0.
    adhesion_length : float
        Length of the adhesion zone [m].
    """
    bound = friction * line_load
    if bound <= 0.0:
        return 0.0, 0.0, 0.0, 0.0
    steep = friction * steepness
    force_x, force_y, moment, adhering = straight_force(
        half_length, bound, steep, slip_x, slip_y, spin, modulus_x, modulus_y
    )
    state = strip_state(half_length, steep, slip_x, slip_y, spin, modulus_x, modulus_y)
    if state.turned > 0.0 or state.scrubbed > 0.0:
        mean_x, mean_y, turning = mean_direction(slip_x, slip_y, spin * half_length)
        turned, scrubbed, lever = state.turned, state.scrubbed, bound * half_length
        force_x += turned * bound * (state.u_x - mean_x)
        force_y += turned * bound * (state.u_y - mean_y)
        moment += turned * (-lever * turning - moment)
        force_x += scrubbed * (-bound * mean_x - force_x)
        force_y += scrubbed * (-bound * mean_y - force_y)
        moment += scrubbed * (-lever * turning - moment)
        adhering *= 1.0 - scrubbed
    return force_x, force_y, moment, adhering


@subroutine
def spin_turns(
    half_length: float,
    steepness: float,
    slip_x: float,
    slip_y: float,
    spin: float,
    modulus_y: float,
) -> bool:
    """Return whether spin may require the full `strip_force`; inexpensive, without square root.

    Parameters
    ----------
    half_length, steepness, slip_x, slip_y, spin, modulus_y
        As in `strip_state`.
    """
    turn = spin * half_length
    straight = TURNED * TURNED * (slip_x * slip_x + slip_y * slip_y)
    # `or` would branch
    return (straight < turn * turn) | (abs(spin) * modulus_y > SPIN_LIMIT * steepness)


@subroutine
def straight_force(
    half_length: float,
    bound: float,
    steepness: float,
    slip_x: float,
    slip_y: float,
    spin: float,
    modulus_x: float,
    modulus_y: float,
) -> tuple[float, float, float, float]:
    """Return the result of `strip_force` if spin neither turns the slip nor exceeds its limit.

    One formula without branches covers partial and full sliding, so that the loop over strips is
    vectorised: with s = min(t, 1) and r = min(1/t, 1) the weight of u is w = (1 + s^2 - r^2)/2, and

        F = -mu q [(2 - 3s/2) r^3 d + (1 - w) psi y^ + w u].

    Parameters
    ----------
    half_length, bound, steepness : float
        a [m], mu q [N/m] and mu 2 p0/a [Pa/m]; a and the last positive.
    slip_x, slip_y, spin, modulus_x, modulus_y
        As in `strip_force`.

    Returns
    -------
    force_x, force_y, moment, adhesion_length
        As of `strip_force`.
    """
    per = 1.0 / (steepness * half_length)
    d_x, d_y = slip_x * modulus_x * per, slip_y * modulus_y * per
    psi = min(max(spin * half_length * modulus_y * per, -SPIN_LIMIT), SPIN_LIMIT)
    rest, part = 1.0 - psi * psi, d_y * psi
    shift = part + math.sqrt(part * part + rest * (d_x * d_x + d_y * d_y))  # t times rest
    greater = max(shift, rest)
    once = 1.0 / (rest * greater)
    s, r = min(shift, rest) * greater * once, rest * rest * once
    slip = math.sqrt(slip_x * slip_x + slip_y * slip_y)
    per_slip = 1.0 / slip if slip > 0.0 else 0.0
    u_x, u_y = slip_x * per_slip, slip_y * per_slip
    weight = 0.5 * (1.0 + s * s - r * r)
    kept = (2.0 - 1.5 * s) * (r * r * r)
    force_x = kept * d_x + weight * u_x
    force_y = kept * d_y + (1.0 - weight) * psi + weight * u_y
    moment = s * r * (0.75 * s - 1.0) * (s * (u_y - psi) - r * d_y) - (1.0 - s) * (1.0 - s) * d_y
    adhering = 2.0 * (1.0 - s) * half_length
    return -bound * force_x, -bound * force_y, -bound * half_length * moment, adhering

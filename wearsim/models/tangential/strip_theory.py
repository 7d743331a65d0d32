"""Traction and slip along the strips of strip theory, point by point."""

from __future__ import annotations

import numpy as np

from wearsim.mechanics.hertz.elasticity import ElasticPair
from wearsim.mechanics.tangential.carter import mean_direction, strip_state
from wearsim.mechanics.tangential.strip_interaction import (
    effective_moduli,
    equivalent_ratio,
    strip_elasticity,
)
from wearsim.mechanics.tangential.strip_theory import (
    StripTractions,
    bound_steepness,
    new_tractions,
    solve_strips,
)
from wearsim.models.tangential.base import LocalSlip, Strips, TangentialTheory, Tractions
from wearsim.types import BoolArray, ContactFields, FloatArray


def strip_fields(
    strips: Strips,
    pair: ElasticPair,
    slip: LocalSlip,
    friction: FloatArray,
    rolling_speed: float,
    points_along: int,
    found: StripTractions,
) -> ContactFields:
    """Return the fields inside the strips, (points_along, strips).

    Parameters
    ----------
    strips, pair, slip, friction, rolling_speed
        What `StripTheory.tractions` was given.
    points_along : int
        Points along each strip.
    found : StripTractions
        What it found.

    Returns
    -------
    ContactFields
        The traction's integrals are `found`'s, but where first-order terms exceed the traction
        bound, to which they are cut: less than 1 % of the forces.
    """
    s = np.linspace(-1.0, 1.0, points_along)
    x = s[:, None] * strips.half_length
    shape = (points_along, len(strips.y))
    traction_x, traction_y, slip_x, slip_y = (np.zeros(shape) for _ in range(4))
    adhesion = np.zeros(shape, dtype=bool)
    pressure = np.zeros(shape)
    elasticity = strip_elasticity(pair.contact_modulus, pair.shear_modulus)
    ratio = equivalent_ratio(strips.half_length, strips.line_load, strips.spacing)
    moduli = effective_moduli(ratio, elasticity)
    loaded = np.flatnonzero(strips.line_load > 0.0)
    steepness = bound_steepness(strips.half_length, strips.line_load)
    for i in loaded:
        a, q = float(strips.half_length[i]), float(strips.line_load[i])
        peak = 2.0 * q / (np.pi * a)
        pressure[:, i] = peak * np.sqrt(np.maximum(0.0, (1.0 - s) * (1.0 + s)))
        rigid_x = float(slip.longitudinal[i] + found.induced_x[i])
        rigid_y = float(slip.lateral + found.induced_y[i])
        mu = float(friction[i])
        (traction_x[:, i], traction_y[:, i], slip_x[:, i], slip_y[:, i], adhesion[:, i]) = _along(
            s, a, mu * peak, mu * steepness, rigid_x, rigid_y, float(slip.spin), moduli
        )
    return ContactFields(
        x=x,
        y=strips.y,
        pressure=pressure,
        traction_x=traction_x,
        traction_y=traction_y,
        slip_x=slip_x,
        slip_y=slip_y,
        adhesion=adhesion,
        power_density=-rolling_speed * (traction_x * slip_x + traction_y * slip_y),
    )


def _along(
    s: FloatArray,
    a: float,
    bound: float,
    steepness: float,
    rigid_x: float,
    rigid_y: float,
    spin: float,
    moduli: tuple[float, float],
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray, BoolArray]:
    """Return tractions, slip and adhesion at x = s a in a strip whose traction bound is `bound`.

    `steepness` includes the friction coefficient.
    """
    nothing = np.zeros_like(s)
    local_y = rigid_y + spin * a * s
    still = (nothing + rigid_x == 0.0) & (local_y == 0.0)
    if bound <= 0.0 or still.all():
        return nothing, nothing, nothing + rigid_x, local_y, still
    state = strip_state(a, steepness, rigid_x, rigid_y, spin, *moduli)
    mean_x, mean_y, _ = mean_direction(rigid_x, rigid_y, spin * a)
    local = np.where(still, 1.0, np.hypot(rigid_x, local_y))
    shape = np.sqrt(np.maximum(0.0, (1.0 - s) * (1.0 + s)))
    tractions, slips = [], []
    for e, u, psi, mean, rigid, modulus in (
        (state.e_x, state.u_x, 0.0, mean_x, nothing + rigid_x, moduli[0]),
        (state.e_y, state.u_y, state.psi, mean_y, local_y, moduli[1]),
    ):
        rate = steepness * a / modulus
        turning = rigid / local
        if state.t < 1.0:
            traction, moving = _partly_adhering(s, shape, state.t, e, u, psi)
        else:
            kept, elastic = (1.0 - state.turned) / state.t, 0.5 / state.t**2
            traction = shape * (u + state.turned * (turning - u) + (e - u) * (elastic + kept * s))
            strain = u * s + (e - u) * (elastic * s + kept * (s * s - 0.5))
            moving = rigid / rate - strain - state.turned * (mean - u) * s
        traction += state.scrubbed * (turning * shape - traction)
        moving += state.scrubbed * (rigid / rate - mean * s - moving)
        tractions.append(-bound * traction)
        slips.append(rate * moving)
    excess = np.maximum(1.0, np.hypot(*tractions) / np.where(shape > 0.0, bound * shape, 1.0))
    adhesion = (np.abs(s - state.t) <= 1.0 - state.t) & (state.scrubbed == 0.0)
    return tractions[0] / excess, tractions[1] / excess, slips[0], slips[1], adhesion


def _partly_adhering(
    s: FloatArray, shape: FloatArray, t: float, e: float, u: float, psi: float
) -> tuple[FloatArray, FloatArray]:
    """Return traction over -mu p0, and slip over its scale, along one axis.

    The strip adheres from s = 1 back to 2 t - 1.
    """
    beyond = (s - t) ** 2 - (1.0 - t) ** 2
    taken_back = np.sqrt(np.maximum(0.0, -beyond))
    opening = np.where(s < t, np.sqrt(np.maximum(0.0, beyond)), 0.0)
    place = (1.0 + s) / max(t, 1e-300)
    turned = (1.5 - place) * shape + (place - 0.5) * taken_back
    if u == e:
        turned = np.zeros_like(s)
    traction = e * shape - (e - psi) * taken_back + (u - e) * turned
    return traction, ((e - psi) - (u - e) * np.where(opening > 0.0, place - 0.5, 0.0)) * opening


class StripTheory(TangentialTheory):
    """Carter's closed form in every strip, with its local slip."""

    def tractions(
        self,
        strips: Strips,
        pair: ElasticPair,
        slip: LocalSlip,
        friction: FloatArray,
        rolling_speed: float,
    ) -> Tractions:
        """Return the tractions for a local slip; `friction` has shape (strips,)."""
        found = self._solve(strips, pair, slip, friction)
        return Tractions(
            found.force_x,
            found.force_y,
            found.moment,
            rolling_speed * found.work,
            found.adhesion_length,
        )

    def fields(
        self,
        strips: Strips,
        pair: ElasticPair,
        slip: LocalSlip,
        friction: FloatArray,
        rolling_speed: float,
        points_along: int,
    ) -> ContactFields:
        """Return the tractions whose integrals are the forces, and the slip that goes with them."""
        found = self._solve(strips, pair, slip, friction)
        return strip_fields(strips, pair, slip, friction, rolling_speed, points_along, found)

    @staticmethod
    def _solve(
        strips: Strips, pair: ElasticPair, slip: LocalSlip, friction: FloatArray
    ) -> StripTractions:
        found = new_tractions(len(strips.y))
        solve_strips(
            np.ascontiguousarray(strips.half_length),
            np.ascontiguousarray(strips.line_load),
            np.ascontiguousarray(friction),
            np.ascontiguousarray(slip.longitudinal),
            float(slip.lateral),
            float(slip.spin),
            float(strips.spacing),
            strip_elasticity(pair.contact_modulus, pair.shear_modulus),
            found,
        )
        return found

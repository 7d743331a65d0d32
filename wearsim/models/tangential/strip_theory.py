"""Strip theory."""

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
    strips_of_contact,
)
from wearsim.models.tangential.base import LocalSlip, Strips, TangentialTheory, Tractions
from wearsim.types import BoolArray, ContactFields, FloatArray


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
    """Return tractions, slip and adhesion at x = s a in a strip with the traction bound `bound`.

    `steepness` includes the friction coefficient.
    """
    zero = np.zeros_like(s)
    local_y = rigid_y + spin * a * s
    still = (zero + rigid_x == 0.0) & (local_y == 0.0)
    if bound <= 0.0 or still.all():
        return zero, zero, zero + rigid_x, local_y, still
    state = strip_state(a, steepness, rigid_x, rigid_y, spin, *moduli)
    mean_x, mean_y, _ = mean_direction(rigid_x, rigid_y, spin * a)
    local = np.where(still, 1.0, np.hypot(rigid_x, local_y))
    shape = np.sqrt(np.maximum(0.0, (1.0 - s) * (1.0 + s)))
    tractions, slips = [], []
    for e, u, psi, mean, rigid, modulus in (
        (state.e_x, state.u_x, 0.0, mean_x, zero + rigid_x, moduli[0]),
        (state.e_y, state.u_y, state.psi, mean_y, local_y, moduli[1]),
    ):
        rate, turning = steepness * a / modulus, rigid / local
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

    The adhesion zone of the strip extends from s = 2 t - 1 to 1.
    """
    beyond = (s - t) ** 2 - (1.0 - t) ** 2
    taken_back = np.sqrt(np.maximum(0.0, -beyond))
    opening = np.where(s < t, np.sqrt(np.maximum(0.0, beyond)), 0.0)
    place = (1.0 + s) / max(t, 1e-300)
    turned = (1.5 - place) * shape + (place - 0.5) * taken_back if u != e else np.zeros_like(s)
    traction = e * shape - (e - psi) * taken_back + (u - e) * turned
    return traction, ((e - psi) - (u - e) * np.where(opening > 0.0, place - 0.5, 0.0)) * opening


class StripTheory(TangentialTheory):
    """Carter's closed form in each strip with its local slip."""

    def tractions(
        self,
        strips: Strips,
        pair: ElasticPair,
        slip: LocalSlip,
        friction: FloatArray,
        rolling_speed: float,
    ) -> Tractions:
        """Return the tractions for a local slip and `friction`, shape (strips,)."""
        solved = self._solve(strips, pair, slip, friction)
        return Tractions(
            solved.force_x,
            solved.force_y,
            solved.moment,
            rolling_speed * solved.work,
            solved.adhesion_length,
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
        """Return pressure, traction and slip in the contact, (points_along, strips).

        The integrals of the traction are the forces of `tractions`, except where first-order terms
        exceed the traction bound, at which they are cut off: less than 1 % of the forces.
        """
        solved = self._solve(strips, pair, slip, friction)
        s = np.linspace(-1.0, 1.0, points_along)
        shape = (points_along, len(strips.y))
        pressure, traction_x, traction_y, slip_x, slip_y = np.zeros((5, *shape))
        adhesion = np.zeros(shape, dtype=bool)
        elasticity = strip_elasticity(pair.contact_modulus, pair.shear_modulus)
        ratio = equivalent_ratio(strips.half_length, strips.line_load, strips.spacing)
        moduli = effective_moduli(ratio, elasticity)
        steepness = bound_steepness(strips.half_length, strips.line_load)
        for i in np.flatnonzero(strips.line_load > 0.0):
            a, mu = float(strips.half_length[i]), float(friction[i])
            peak = 2.0 * float(strips.line_load[i]) / (np.pi * a)
            pressure[:, i] = peak * np.sqrt(np.maximum(0.0, (1.0 - s) * (1.0 + s)))
            rigid_x = float(slip.longitudinal[i] + solved.induced_x[i])
            rigid_y = float(slip.lateral + solved.induced_y[i])
            traction_x[:, i], traction_y[:, i], slip_x[:, i], slip_y[:, i], adhesion[:, i] = _along(
                s, a, mu * peak, mu * steepness, rigid_x, rigid_y, float(slip.spin), moduli
            )
        return ContactFields(
            x=s[:, None] * strips.half_length,
            y=strips.y,
            pressure=pressure,
            traction_x=traction_x,
            traction_y=traction_y,
            slip_x=slip_x,
            slip_y=slip_y,
            adhesion=adhesion,
            power_density=-rolling_speed * (traction_x * slip_x + traction_y * slip_y),
        )

    @staticmethod
    def _solve(
        strips: Strips, pair: ElasticPair, slip: LocalSlip, friction: FloatArray
    ) -> StripTractions:
        solved = new_tractions(len(strips.y))
        strips_of_contact(
            np.ascontiguousarray(strips.half_length),
            np.ascontiguousarray(strips.line_load),
            np.ascontiguousarray(friction),
            np.ascontiguousarray(slip.longitudinal),
            float(slip.lateral),
            float(slip.spin),
            float(strips.spacing),
            strip_elasticity(pair.contact_modulus, pair.shear_modulus),
            solved,
        )
        return solved

"""Strip theory as a tangential theory: the closed form of `mechanics.strip` and its fields."""

from __future__ import annotations

import numpy as np

from wearsim.mechanics.elasticity import ElasticPair
from wearsim.mechanics.strip import strip_tractions
from wearsim.models.tangential import LocalSlip, Strips, TangentialTheory, Tractions
from wearsim.types import ContactFields, FloatArray


class StripTheory(TangentialTheory):
    """Carter's closed form in every strip, with its local creepage."""

    def tractions(
        self,
        strips: Strips,
        pair: ElasticPair,
        slip: LocalSlip,
        friction: FloatArray,
        rolling_speed: float,
    ) -> Tractions:
        """Return the tractions; the part of the moment from phi x is not in this theory."""
        force_x, force_y, dissipation, adhesion = np.empty((4, len(strips.y)))
        strip_tractions(
            strips.half_length,
            strips.line_load,
            friction,
            slip.longitudinal,
            slip.lateral,
            pair.contact_modulus,
            pair.shear_modulus,
            rolling_speed,
            force_x,
            force_y,
            dissipation,
            adhesion,
        )
        return Tractions(force_x, force_y, np.zeros_like(force_x), dissipation, adhesion)

    def fields(
        self,
        strips: Strips,
        pair: ElasticPair,
        slip: LocalSlip,
        friction: FloatArray,
        rolling_speed: float,
        points_along: int,
    ) -> ContactFields:
        """Return Carter's fields: full sliding less the tractions that adhesion takes back.

        With s = (x - d)/A' measured in the adhering part of half-length A' = a - d at the leading
        edge, traction is mu p less mu p0 (A'/a) sqrt(1 - s^2) there, and the slip behind it grows
        as sqrt(s^2 - 1).
        """
        found = self.tractions(strips, pair, slip, friction, rolling_speed)
        a, q = strips.half_length, strips.line_load
        inside = q > 0.0
        safe_a = np.where(inside, a, 1.0)
        s = np.linspace(-1.0, 1.0, points_along)[:, None]
        x = s * a
        peak = np.where(inside, 2.0 * q / (np.pi * safe_a), 0.0)
        pressure = peak * np.sqrt(np.maximum(0.0, 1.0 - s * s))
        total = np.hypot(found.force_x, found.force_y)
        direction_x = np.divide(found.force_x, total, out=np.zeros_like(a), where=total > 0.0)
        direction_y = np.divide(found.force_y, total, out=np.zeros_like(a), where=total > 0.0)
        stick = 0.5 * found.adhesion_length
        shift = x - (a - stick)
        taken_back = np.where(
            stick > 0.0, np.sqrt(np.maximum(0.0, stick**2 - shift**2)) / safe_a, 0.0
        )
        traction = friction * (pressure - peak * taken_back)
        slip_x, slip_y = self._slip(a, peak, friction, pair, slip, found, x, stick, shift)
        adhesion = inside & (np.abs(shift) <= stick) & (stick > 0.0)
        density = -rolling_speed * traction * (direction_x * slip_x + direction_y * slip_y)
        return ContactFields(
            x=x,
            y=strips.y,
            pressure=pressure,
            traction_x=traction * direction_x,
            traction_y=traction * direction_y,
            slip_x=slip_x,
            slip_y=slip_y,
            adhesion=adhesion,
            power_density=density,
        )

    @staticmethod
    def _slip(
        a: FloatArray,
        peak: FloatArray,
        friction: FloatArray,
        pair: ElasticPair,
        slip: LocalSlip,
        found: Tractions,
        x: FloatArray,
        stick: FloatArray,
        shift: FloatArray,
    ) -> tuple[FloatArray, FloatArray]:
        """Return the slip where the strip slides.

        It is the rigid slip less the strain of an elliptic traction in full sliding, and the
        square root behind the part that adheres otherwise.
        """
        safe_a = np.where(a > 0.0, a, 1.0)
        total = np.hypot(found.force_x, found.force_y)
        share_x = np.divide(-found.force_x, total, out=np.zeros_like(a), where=total > 0.0)
        share_y = np.divide(-found.force_y, total, out=np.zeros_like(a), where=total > 0.0)
        rate_x = 2.0 * friction * peak * share_x / (pair.contact_modulus * safe_a)
        rate_y = 2.0 * friction * peak * share_y / (pair.shear_modulus * safe_a)
        behind = np.where(shift < -stick, np.sqrt(np.maximum(0.0, shift**2 - stick**2)), 0.0)
        partial = stick > 0.0
        slip_x = np.where(partial, rate_x * behind, slip.longitudinal - rate_x * x)
        slip_y = np.where(partial, rate_y * behind, slip.lateral - rate_y * x)
        inside = a > 0.0
        return np.where(inside, slip_x, 0.0), np.where(inside, slip_y, 0.0)

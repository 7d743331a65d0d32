"""Strip theory as a tangential theory: the closed form of `mechanics.strip` and its fields."""

from __future__ import annotations

import numpy as np

from wearsim.mechanics.elasticity import ElasticPair
from wearsim.mechanics.strip import StripTractions, new_tractions, solve_strips
from wearsim.mechanics.strip_coupling import strip_elasticity
from wearsim.models.strip_fields import strip_fields
from wearsim.models.tangential import LocalSlip, Strips, TangentialTheory, Tractions
from wearsim.types import ContactFields, FloatArray


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

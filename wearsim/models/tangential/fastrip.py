"""FaStrip as a tangential theory on the strips of any normal contact."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from wearsim.mechanics.hertz.elasticity import ElasticPair
from wearsim.mechanics.tangential.fastrip import fastrip, fastrip_fields
from wearsim.mechanics.tangential.kalker_coefficients import creepage_coefficients, flexibilities
from wearsim.mechanics.tangential.strip_with_spin import (
    Moduli,
    Motion,
    amended_moduli,
    beyond_strip_theory,
)
from wearsim.models.contact.equivalent_ellipse import (
    covered_share,
    equivalent_ellipse,
    peak_pressure,
    single_flexibility,
    touching,
)
from wearsim.models.tangential.base import (
    LocalSlip,
    Strips,
    TangentialTheory,
    Tractions,
    spread_work,
)
from wearsim.models.tangential.fastsim import FastsimTheory
from wearsim.types import ContactFields, FloatArray


class FastripTheory(TangentialTheory):
    """Strip theory with spin in the adhesion zone, and a march along the slip zone.

    Kalker's coefficients are those of the equivalent ellipse of the strips, and the traction bound
    is elliptic along rolling. Strips with too much spin for strip theory are solved by FASTSIM
    with one flexibility.

    Parameters
    ----------
    mx : int
        Steps of the march along the slip zone of a strip.

    Notes
    -----
    Sichani, Enblom and Berg (2016), DOI 10.1080/00423114.2016.1156135; the differences are listed
    in `mechanics.tangential.fastrip`.

    The moduli of spin and of creepage are not those of one surface, so that the work of a strip
    with little slip may be negative, down to -5 % of the maximum where spin dominates creepage.
    The dissipation of such strips is set to zero, and that of the others scaled (`spread_work`):
    the power remains the work of the rigid slip.
    """

    knows_ellipses: ClassVar[bool] = True

    def __init__(self, mx: int = 50) -> None:
        self.mx = mx

    def tractions(
        self,
        strips: Strips,
        pair: ElasticPair,
        slip: LocalSlip,
        friction: FloatArray,
        rolling_speed: float,
    ) -> Tractions:
        """Return the tractions for a local slip; strips outside the contact are skipped."""
        part = touching(strips)
        problem = self._problem(strips, pair, slip, friction, part)
        out = np.zeros((4, len(strips.y)))
        out[:, part] = fastrip(*problem, self._beyond(strips, pair, slip), self.mx)
        out[:3] *= covered_share(strips)
        force_x, force_y, moment, adhesion = out
        work = slip.longitudinal * force_x + slip.lateral * force_y + slip.spin * moment
        return Tractions(force_x, force_y, moment, spread_work(-rolling_speed * work), adhesion)

    def fields(
        self,
        strips: Strips,
        pair: ElasticPair,
        slip: LocalSlip,
        friction: FloatArray,
        rolling_speed: float,
        points_along: int,
    ) -> ContactFields:
        """Return pressure, traction and slip inside the contact.

        The slip is that of strip theory, opposite to the traction. Strips for which strip theory is
        not valid have the fields of FASTSIM.
        """
        march = FastsimTheory("elliptic", self.mx, flexibility="one")
        marched = march.fields(strips, pair, slip, friction, rolling_speed, points_along)
        problem = self._problem(strips, pair, slip, friction, slice(0, len(strips.y)))
        valid = [not beyond_strip_theory(j, *problem) for j in range(len(strips.y))]
        traction_x, traction_y, slip_x, slip_y = (
            np.where(valid, by_strips, by_march)
            for by_strips, by_march in zip(
                fastrip_fields(*problem, points_along)[:, ::-1],
                (marched.traction_x, marched.traction_y, marched.slip_x, marched.slip_y),
                strict=True,
            )
        )
        return ContactFields(
            x=marched.x,
            y=strips.y,
            pressure=marched.pressure,
            traction_x=traction_x,
            traction_y=traction_y,
            slip_x=slip_x,
            slip_y=slip_y,
            adhesion=(slip_x == 0.0) & (slip_y == 0.0) & (strips.half_length > 0.0),
            power_density=-rolling_speed * (traction_x * slip_x + traction_y * slip_y),
        )

    @staticmethod
    def _beyond(strips: Strips, pair: ElasticPair, slip: LocalSlip) -> float:
        """Return the flexibility of the strips that are solved by FASTSIM."""
        a, b = equivalent_ellipse(strips)
        coefficients = creepage_coefficients(a / b, pair.poisson_ratio)
        three = flexibilities(coefficients, a, b, pair.shear_modulus)
        return single_flexibility(strips, three, slip)

    @staticmethod
    def _problem(
        strips: Strips, pair: ElasticPair, slip: LocalSlip, friction: FloatArray, part: slice
    ) -> tuple[FloatArray, FloatArray, Motion, Moduli]:
        """Return the arguments of the kernels for the strips of `part`."""
        a, b = equivalent_ellipse(strips)
        coefficients = creepage_coefficients(a / b, pair.poisson_ratio)
        moduli = amended_moduli(coefficients, a, b, pair.shear_modulus)
        mean = slip.longitudinal - slip.spin_part
        drive = mean * moduli.longitudinal + slip.spin_part * moduli.spin_along
        return (
            np.ascontiguousarray(strips.half_length[part]),
            np.ascontiguousarray((friction * peak_pressure(strips, elliptic=True))[part]),
            Motion(
                np.ascontiguousarray(slip.longitudinal[part]),
                np.ascontiguousarray(drive[part]),
                float(slip.lateral),
                float(slip.spin),
            ),
            moduli,
        )

"""FaStrip as a tangential theory, on the strips of any normal contact."""

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
    """Strip theory with spin where a strip adheres, and a march where it slides.

    Kalker's coefficients are those of the strips' equivalent ellipse, and the traction bound is
    elliptic along rolling. A strip whose spin is too strong for strip theory is left to FASTSIM
    with one flexibility.

    Parameters
    ----------
    mx : int
        Steps of the march along the part of a strip that slides.

    Notes
    -----
    Sichani, Enblom and Berg (2016), DOI 10.1080/00423114.2016.1156135; `mechanics.fastrip` says in
    what this differs.

    The moduli of spin and of creepage are not those of one surface, so that the work of a strip
    that hardly slips may come out negative, down to -5 % of the greatest where spin outweighs
    creepage. Such strips dissipate nothing, and the others give it alike (`spread_work`): power
    stays the work of the rigid slip.
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
        """Return the tractions for a local slip; strips outside the contact cost nothing."""
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

        Slip is strip theory's, along the direction that opposes the traction. Strips that strip
        theory does not hold for have the fields of FASTSIM.
        """
        march = FastsimTheory("elliptic", self.mx, flexibility="one")
        other = march.fields(strips, pair, slip, friction, rolling_speed, points_along)
        everywhere = slice(0, len(strips.y))
        problem = self._problem(strips, pair, slip, friction, everywhere)
        found = fastrip_fields(*problem, points_along)[:, ::-1]
        own = [not beyond_strip_theory(j, *problem) for j in range(len(strips.y))]
        traction_x, traction_y, slip_x, slip_y = (
            np.where(own, mine, theirs)
            for mine, theirs in zip(
                found, (other.traction_x, other.traction_y, other.slip_x, other.slip_y), strict=True
            )
        )
        resting = (slip_x == 0.0) & (slip_y == 0.0) & (strips.half_length > 0.0)
        return ContactFields(
            x=other.x,
            y=strips.y,
            pressure=other.pressure,
            traction_x=traction_x,
            traction_y=traction_y,
            slip_x=slip_x,
            slip_y=slip_y,
            adhesion=resting,
            power_density=-rolling_speed * (traction_x * slip_x + traction_y * slip_y),
        )

    @staticmethod
    def _beyond(strips: Strips, pair: ElasticPair, slip: LocalSlip) -> float:
        """Return the flexibility of strips that are left to FASTSIM."""
        a, b = equivalent_ellipse(strips)
        coefficients = creepage_coefficients(a / b, pair.poisson_ratio)
        three = flexibilities(coefficients, a, b, pair.shear_modulus)
        return single_flexibility(strips, three, slip)

    @staticmethod
    def _problem(
        strips: Strips, pair: ElasticPair, slip: LocalSlip, friction: FloatArray, part: slice
    ) -> tuple[FloatArray, FloatArray, Motion, Moduli]:
        """Return what the kernels take, for the strips of `part`."""
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

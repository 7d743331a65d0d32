"""FASTSIM as a tangential theory, on the strips of any normal contact."""

from __future__ import annotations

from typing import ClassVar, Literal, TypeAlias

import numpy as np

from wearsim.errors import ContactError
from wearsim.mechanics.hertz.elasticity import ElasticPair
from wearsim.mechanics.tangential import hertz_fastsim_batch as batches
from wearsim.mechanics.tangential.fastsim import march
from wearsim.mechanics.tangential.fastsim_closed_form import closed_form
from wearsim.mechanics.tangential.fastsim_fields import (
    element_sum,
    march_fields,
    march_local_fields,
)
from wearsim.mechanics.tangential.kalker_coefficients import (
    CreepageCoefficients,
    Flexibilities,
    creepage_coefficients,
    flexibilities,
    line_limit_coefficients,
    spline,
)
from wearsim.models.contact.equivalent_ellipse import (
    covered_share,
    equivalent_ellipse,
    peak_pressure,
    single_flexibility,
    touching,
)
from wearsim.models.tangential.base import LocalSlip, Strips, TangentialTheory, Tractions
from wearsim.types import ContactFields, FloatArray

Bound: TypeAlias = Literal["parabolic", "elliptic"]
Dissipation: TypeAlias = Literal["rigid-slip", "element-sum"]
Kalker: TypeAlias = Literal["table", "line-limit"]
ClosedForm: TypeAlias = Literal["exact", "always", "never"]
Flexibility: TypeAlias = Literal["three", "one"]

_CLOSED_FORM = {"never": batches.NEVER, "exact": batches.EXACT, "always": batches.ALWAYS}


class FastsimTheory(TangentialTheory):
    """Kalker's simplified theory with its three flexibilities, or with one.

    Parameters
    ----------
    bound : {"parabolic", "elliptic"}
        Traction bound along rolling. On an ellipse the parabolic one is Kalker's
        ``2N/(pi a b) (1 - x^2/a^2 - y^2/b^2)`` and the elliptic one Hertz's; on other strips each
        carries the strip's own line load.
    mx : int
        Points along each strip.
    dissipation : {"rigid-slip", "element-sum"}
        Work of the rigid slip, second order in 1/mx, or the textbook's sum over elements, first
        order and low.
    kalker : {"table", "line-limit"}
        Kalker's table, or its limits for a contact that is long across rolling.
    coefficients : CreepageCoefficients, optional
        Coefficients to use in place of either.
    closed_form : {"exact", "always", "never"}
        Where the integral of the march replaces it, if the dissipation is the work of the rigid
        slip: where there is no spin and it is exact; with spin too, whose phi x along the strip is
        then left out of the slip; or nowhere. Over the paper's inputs leaving it out moves the mean
        and the standard deviation of the power by less than 1e-4 of them, and one power by 0.2 %
        rms, 2.5 % at most.
    flexibility : {"three", "one"}
        Kalker's three flexibilities, or their mean weighted with the magnitudes of the creepages,
        ``L = (|xi| L1 + |eta| L2 + |phi| c L3)/sqrt(xi^2 + eta^2 + phi^2 c^2)``, c = sqrt(ab). One
        leaves the direction of slip to the creepage where a contact slides throughout.

    Notes
    -----
    Kalker (1982), DOI 10.1080/00423118208968684.

    Three flexibilities are not those of one surface: where spin acts against the longitudinal
    creepage, the work of a strip that hardly slips may be negative. With creepages of 1e-3 and spin
    of 0.8/m (standard deviations of 4000 draws) some strip's is in one contact of ten on the rig's
    ellipse, a/b = 0.09, down to -8 % of the greatest P_l, and on a circle in one of 200, to -1 %.
    Drawn evenly in their logarithms, creepages to 3e-3 and spin to 10/m, it is in up to one contact
    of six, to -20 % where a/b = 5; with one flexibility in up to one of 50, to -0.7 %. That of a
    whole contact never was.
    """

    knows_ellipses: ClassVar[bool] = True

    def __init__(
        self,
        bound: Bound = "parabolic",
        mx: int = 50,
        dissipation: Dissipation = "rigid-slip",
        kalker: Kalker = "table",
        coefficients: CreepageCoefficients | None = None,
        closed_form: ClosedForm = "exact",
        flexibility: Flexibility = "three",
    ) -> None:
        self.elliptic = bound == "elliptic"
        self.mx = mx
        self.element_sum = dissipation == "element-sum"
        self.kalker = kalker
        self.coefficients = coefficients
        self.closed_form = closed_form
        self.single = flexibility == "one"

    def flexibilities(self, strips: Strips, pair: ElasticPair) -> Flexibilities:
        """Return L1, L2 and L3 of the strips' equivalent ellipse.

        Raises
        ------
        ContactError
            If the limit of a long contact is asked for where it means nothing.
        """
        a, b = equivalent_ellipse(strips)
        found = self.coefficients
        if found is None and self.kalker == "table":
            found = creepage_coefficients(a / b, pair.poisson_ratio)
        elif found is None:
            try:
                found = line_limit_coefficients(a / b, pair.poisson_ratio)
            except ValueError as error:
                raise ContactError(
                    f"{error}; use kalker = 'table'", {"half_length": strips.half_length}
                ) from error
        return flexibilities(found, a, b, pair.shear_modulus)

    def _flexibilities_under(
        self, strips: Strips, pair: ElasticPair, slip: LocalSlip
    ) -> Flexibilities:
        """Return the flexibilities that the march takes under a creepage."""
        three = self.flexibilities(strips, pair)
        if not self.single:
            return three
        one = single_flexibility(strips, three, slip)
        return Flexibilities(one, one, one)

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
        flexibility = self._flexibilities_under(strips, pair, slip)
        problem = self._problem(strips, flexibility, slip, friction, part)
        out = np.zeros((5, len(strips.y)))
        always = self.closed_form == "always"
        exact = self.closed_form == "exact" and slip.spin == 0.0
        if (always or exact) and not self.element_sum:
            out[:4, part] = closed_form(*problem[:5])
            if slip.spin != 0.0:
                out[2] = 0.0  # phi x is left out, of the work as of the traction
        else:
            out[:4, part] = march(*problem, self.mx)
        force_x, force_y, moment, adhesion, dissipation = out
        if self.element_sum:
            fields = march_fields(*problem, self.mx)
            dissipation[part] = element_sum(
                fields, flexibility.longitudinal, flexibility.lateral, rolling_speed
            )
        else:
            work = slip.longitudinal * force_x + slip.lateral * force_y + slip.spin * moment
            dissipation[:] = -rolling_speed * work
        out[[0, 1, 2, 4]] *= covered_share(strips)
        return Tractions(force_x, force_y, moment, dissipation, adhesion)

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

        The pressure is elliptic along rolling whatever the bound, which may exceed it. Slip at a
        point is that of the step which ends there, and its elastic part takes L1 along rolling and
        L2 across it, so that it is zero where the surfaces adhere. Where `friction` has the shape
        (points, strips) its points are those of the march, and `points_along` counts for nothing.
        """
        flexibility = self._flexibilities_under(strips, pair, slip)
        everywhere = slice(0, len(strips.y))
        problem = self._problem(strips, flexibility, slip, friction, everywhere)
        half_length, _, elliptic, gradient_x, gradient_y, gradient_spin = problem
        steps = len(friction) if friction.ndim == 2 else points_along - 1
        local = np.require(
            np.broadcast_to(friction, (steps, len(strips.y))), np.float64, ["C", "W"]
        )
        peak = peak_pressure(strips, elliptic=self.elliptic)
        marched = march_local_fields(
            half_length, peak, local, elliptic, gradient_x, gradient_y, gradient_spin
        )[:, ::-1]
        traction_x, traction_y, cut_x, cut_y = marched
        a = strips.half_length
        inside = a > 0.0
        place = np.linspace(-1.0, 1.0, steps + 1)[:, None]
        shape = np.maximum((1.0 - place) * (1.0 + place), 0.0)
        step = np.where(inside, 2.0 * a / steps, 1.0)
        slip_x = -cut_x * flexibility.longitudinal / step
        slip_y = -cut_y * flexibility.lateral / step
        # the march starts at the leading edge with nothing cut off: what the first step finds
        # holds there too
        slip_x[-1], slip_y[-1] = slip_x[-2], slip_y[-2]
        return ContactFields(
            x=place * a,
            y=strips.y,
            pressure=peak_pressure(strips, elliptic=True) * np.sqrt(shape),
            traction_x=traction_x,
            traction_y=traction_y,
            slip_x=slip_x,
            slip_y=slip_y,
            adhesion=inside & (slip_x == 0.0) & (slip_y == 0.0),
            power_density=-rolling_speed * (traction_x * slip_x + traction_y * slip_y),
        )

    def compiled(self, pair: ElasticPair) -> batches.Theory:
        """Return the theory as the kernels for many contacts take it."""
        given = self.coefficients
        chosen = batches.TABLE if self.kalker == "table" else batches.LINE_LIMIT
        return batches.Theory(
            shear_modulus=pair.shear_modulus,
            poisson_ratio=pair.poisson_ratio,
            elliptic=self.elliptic,
            closed_form=_CLOSED_FORM[self.closed_form],
            element_sum=self.element_sum,
            points=self.mx,
            single=self.single,
            kalker=chosen if given is None else batches.GIVEN,
            given=np.zeros(3) if given is None else np.array([given.c11, given.c22, given.c23]),
            tables=(spline(0), spline(1), spline(2)),
        )

    def _problem(
        self,
        strips: Strips,
        flexibility: Flexibilities,
        slip: LocalSlip,
        friction: FloatArray,
        part: slice,
    ) -> tuple[FloatArray, FloatArray, bool, FloatArray, float, float]:
        """Return what the kernels take, for the strips of `part`."""
        mean = slip.longitudinal - slip.spin_part
        gradient_x = mean / flexibility.longitudinal + slip.spin_part / flexibility.spin
        bound = friction * peak_pressure(strips, elliptic=self.elliptic)
        return (
            np.ascontiguousarray(strips.half_length[part]),
            np.ascontiguousarray(bound[..., part]),
            self.elliptic,
            np.ascontiguousarray(gradient_x[part]),
            float(slip.lateral / flexibility.lateral),
            float(slip.spin / flexibility.spin),
        )

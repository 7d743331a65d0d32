"""FASTSIM and FaStrip as tangential theories on the strips of any normal contact."""

from __future__ import annotations

import math
from typing import ClassVar, Literal, TypeAlias

import numpy as np

from wearsim.errors import ContactError
from wearsim.mechanics.hertz.elasticity import ElasticPair
from wearsim.mechanics.tangential import hertz_fastsim_batch as batches
from wearsim.mechanics.tangential.fastrip import fastrip, fastrip_fields
from wearsim.mechanics.tangential.fastsim import closed_form, march, march_fields
from wearsim.mechanics.tangential.kalker_coefficients import (
    CreepageCoefficients,
    Flexibilities,
    creepage_coefficients,
    flexibilities,
    line_limit_coefficients,
    one_flexibility,
    spline,
)
from wearsim.mechanics.tangential.strip_with_spin import (
    Moduli,
    StripMotion,
    amended_moduli,
    beyond_strip_theory,
)
from wearsim.models.tangential.base import (
    LocalSlip,
    Strips,
    TangentialTheory,
    Tractions,
    covered_tractions,
    equivalent_ellipse,
    load_weighted_mean,
    peak_pressure,
    touching,
)
from wearsim.types import ContactFields, FloatArray

Bound: TypeAlias = Literal["parabolic", "elliptic"]
Dissipation: TypeAlias = Literal["rigid-slip", "element-sum"]
Kalker: TypeAlias = Literal["table", "line-limit"]
ClosedForm: TypeAlias = Literal["exact", "always", "never"]
Flexibility: TypeAlias = Literal["three", "one"]

_CLOSED_FORM = {"never": batches.NEVER, "exact": batches.EXACT, "always": batches.ALWAYS}


class FastsimTheory(TangentialTheory):
    """Kalker's simplified theory with three flexibilities, or with one.

    Parameters
    ----------
    bound : {"parabolic", "elliptic"}
        Traction bound along rolling. On an ellipse the parabolic bound is Kalker's
        ``2N/(pi a b) (1 - x^2/a^2 - y^2/b^2)`` and the elliptic bound Hertz's; on other strips the
        integral of either is the line load of the strip.
    mx : int
        Points along each strip.
    kalker : {"table", "line-limit"}
        Kalker's table, or its limits for a contact that is long across rolling.
    coefficients : CreepageCoefficients, optional
        Coefficients that replace either.
    flexibility : {"three", "one"}
        Kalker's three flexibilities, or their mean weighted with the magnitudes of the creepages,
        ``L = (|xi| L1 + |eta| L2 + |phi| c L3)/sqrt(xi^2 + eta^2 + phi^2 c^2)``, c = sqrt(ab). With
        one, the direction of slip in gross sliding is that of the creepage.

    Notes
    -----
    Kalker (1982), DOI 10.1080/00423118208968684.

    Three flexibilities are not those of one surface: where spin is opposed to the longitudinal
    creepage, the work of a strip with little slip may be negative. For creepages of 1e-3 and a spin
    of 0.8/m (standard deviations, 4000 samples) one contact in ten has such a strip on the ellipse
    of the rig, a/b = 0.09, with down to -8 % of the maximum P_l; one in 200 on a circle, to -1 %.
    For log-uniform creepages up to 3e-3 and a spin up to 10/m it is up to one contact in six, with
    down to -20 % for a/b = 5; with one flexibility up to one in 50, to -0.7 %. The power of a whole
    contact was never negative. The dissipation of such strips is set to zero, and that of the
    others scaled (`spread_work`): the power remains the work of the rigid slip.
    """

    knows_ellipses: ClassVar[bool] = True

    def __init__(
        self,
        bound: Bound = "parabolic",
        mx: int = 50,
        kalker: Kalker = "table",
        coefficients: CreepageCoefficients | None = None,
        flexibility: Flexibility = "three",
    ) -> None:
        self.elliptic, self.single = bound == "elliptic", flexibility == "one"
        self.mx, self.kalker, self.coefficients = mx, kalker, coefficients

    def flexibilities(self, strips: Strips, pair: ElasticPair) -> Flexibilities:
        """Return L1, L2 and L3 of the equivalent ellipse of the strips.

        Raises
        ------
        ContactError
            If the limit of a long contact is not valid for the ellipse.
        """
        a, b = equivalent_ellipse(strips)
        coefficients = self.coefficients
        if coefficients is None and self.kalker == "table":
            coefficients = creepage_coefficients(a / b, pair.poisson_ratio)
        elif coefficients is None:
            try:
                coefficients = line_limit_coefficients(a / b, pair.poisson_ratio)
            except ValueError as error:
                raise ContactError(
                    f"{error}; use kalker = 'table'", {"half_length": strips.half_length}
                ) from error
        return flexibilities(coefficients, a, b, pair.shear_modulus)

    def flexibilities_under(
        self, strips: Strips, pair: ElasticPair, slip: LocalSlip
    ) -> Flexibilities:
        """Return the flexibilities of the march for a creepage.

        The weights of a single one are the mean magnitude of the longitudinal creepage, the lateral
        creepage and the spin times sqrt(ab) of the equivalent ellipse.
        """
        three, (a, b) = self.flexibilities(strips, pair), equivalent_ellipse(strips)
        one = one_flexibility(
            *three,
            load_weighted_mean(strips, np.abs(slip.longitudinal - slip.spin_part)),
            float(slip.lateral),
            float(slip.spin) * math.sqrt(a * b),
        )
        return Flexibilities(one, one, one) if self.single else three

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
        flexibility = self.flexibilities_under(strips, pair, slip)
        problem = self._problem(strips, flexibility, slip, friction, part)
        out = np.zeros((4, len(strips.y)))
        # without spin the closed form is exact
        out[:, part] = march(*problem, self.mx) if slip.spin else closed_form(*problem[:5])
        return covered_tractions(strips, slip, rolling_speed, out)

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

        The pressure is elliptic along rolling for both bounds, and may be less than a parabolic
        bound. The slip at a point is that of the step that ends there, and its elastic part has the
        flexibilities L1 along rolling and L2 across it, so that it is zero in the adhesion zone. If
        `friction` has the shape (points, strips), its points are those of the march, and
        `points_along` is not used.
        """
        flexibility = self.flexibilities_under(strips, pair, slip)
        problem = self._problem(strips, flexibility, slip, friction, slice(0, len(strips.y)))
        half_length, _, elliptic, gradient_x, gradient_y, gradient_spin = problem
        steps = len(friction) if friction.ndim == 2 else points_along - 1
        local = np.require(
            np.broadcast_to(friction, (steps, len(strips.y))), np.float64, ["C", "W"]
        )
        peak = peak_pressure(strips, elliptic=self.elliptic)
        traction_x, traction_y, cut_x, cut_y = march_fields(
            half_length, peak, elliptic, gradient_x, gradient_y, gradient_spin, local
        )[:, ::-1]
        a, inside = strips.half_length, strips.half_length > 0.0
        place = np.linspace(-1.0, 1.0, steps + 1)[:, None]
        shape = np.maximum((1.0 - place) * (1.0 + place), 0.0)
        step = np.where(inside, 2.0 * a / steps, 1.0)
        slip_x = -cut_x * flexibility.longitudinal / step
        slip_y = -cut_y * flexibility.lateral / step
        # at the leading edge, where the march starts, the slip is that of the first step
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

    def compiled(
        self, pair: ElasticPair, dissipation: Dissipation, closed_form: ClosedForm
    ) -> batches.Theory:
        """Return the theory as an argument of the kernels for many contacts.

        Parameters
        ----------
        pair : ElasticPair
        dissipation : {"rigid-slip", "element-sum"}
            Work of the rigid slip, second order in 1/mx, or the textbook's sum over elements, first
            order and too low.
        closed_form : {"exact", "always", "never"}
            Use of the closed-form integral instead of the march, if the dissipation is the work of
            the rigid slip: without spin, where it is exact; also with spin, whose lateral slip
            phi x is then neglected; or never. Over the inputs of the paper the neglect changes the
            mean and the standard deviation of the power by less than 1e-4 of them, and a single
            power by 0.2 % rms, at most 2.5 %.
        """
        coefficients = self.coefficients
        chosen = batches.TABLE if self.kalker == "table" else batches.LINE_LIMIT
        return batches.Theory(
            shear_modulus=pair.shear_modulus,
            poisson_ratio=pair.poisson_ratio,
            elliptic=self.elliptic,
            closed_form=_CLOSED_FORM[closed_form],
            element_sum=dissipation == "element-sum",
            points=self.mx,
            single=self.single,
            kalker=chosen if coefficients is None else batches.GIVEN,
            given=np.zeros(3)
            if coefficients is None
            else np.array([coefficients.c11, coefficients.c22, coefficients.c23]),
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
        """Return the arguments of the kernels for the strips of `part`."""
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
        # for strips with too much spin for strip theory
        self._march = FastsimTheory("elliptic", mx, flexibility="one")

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
        beyond = self._march.flexibilities_under(strips, pair, slip).longitudinal
        out[:, part] = fastrip(*problem, beyond, self.mx)
        return covered_tractions(strips, slip, rolling_speed, out)

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
        marched = self._march.fields(strips, pair, slip, friction, rolling_speed, points_along)
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
    def _problem(
        strips: Strips, pair: ElasticPair, slip: LocalSlip, friction: FloatArray, part: slice
    ) -> tuple[FloatArray, FloatArray, StripMotion, Moduli]:
        """Return the arguments of the kernels for the strips of `part`."""
        a, b = equivalent_ellipse(strips)
        coefficients = creepage_coefficients(a / b, pair.poisson_ratio)
        moduli = amended_moduli(coefficients, a, b, pair.shear_modulus)
        mean = slip.longitudinal - slip.spin_part
        drive = mean * moduli.longitudinal + slip.spin_part * moduli.spin_along
        return (
            np.ascontiguousarray(strips.half_length[part]),
            np.ascontiguousarray((friction * peak_pressure(strips, elliptic=True))[part]),
            StripMotion(
                np.ascontiguousarray(slip.longitudinal[part]),
                np.ascontiguousarray(drive[part]),
                float(slip.lateral),
                float(slip.spin),
            ),
            moduli,
        )

"""The contact model `slender`: line-contact strips on any gap profile, any tangential theory."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Literal

import numpy as np
from pydantic import Field

from wearsim.contact_batch import BatchSolution, OperatingPoints
from wearsim.errors import ContactError
from wearsim.mechanics.slender import newton as kernels
from wearsim.mechanics.slender.influence import HIGHEST, curvature_table, no_table
from wearsim.mechanics.tangential.strip_theory import SUMS
from wearsim.models.contact.slender_problems import (
    Constants,
    NormalContacts,
    TangentialInputs,
    first_not_finite,
    start_of,
    strip_tractions,
)
from wearsim.models.contact.strip_model import StripModel, check_edges
from wearsim.models.tangential.base import TangentialTheory, power_not_finite
from wearsim.models.tangential.options import TangentialOptions, tangential_theory
from wearsim.models.tangential.strip_theory import StripTheory
from wearsim.plugins import Capabilities, ContactModelSpec, PassLoop, SharedWear
from wearsim.plugins.contact_model import naming_contact
from wearsim.types import ContactSolution, FloatArray, Grid, Material, Number, OperatingPoint

_REMEDY = {
    kernels.SINGULAR: "its equations are singular: check the gap, the load and the materials",
    kernels.TOO_FINE: (
        f"a half-length exceeds {np.exp(HIGHEST):.0f} strip widths: lower contact.strips"
    ),
    kernels.NO_CONVERGENCE: "Newton's method did not converge on the strips in contact",
    kernels.NOT_FINITE: "a value is not finite",
}
_SINGLE = (1, 1, 1)  # leading axes of a single contact


class SlenderOptions(TangentialOptions):
    """Options of the contact model `slender`."""

    half_length: Literal["coupled", "local"] = Field(
        "coupled",
        description="half-length from the line loads of all strips, or local from that of the same"
        " strip: a quarter cheaper, with an error in p0 of 0.5 % where the patch is ten times as"
        " wide as long and 3 % where it is three times",
    )


class Slender(StripModel):
    """Line-contact strips (Kalker 1972) on any profile, with wear compliance.

    Parameters
    ----------
    theory : TangentialTheory
        Theory of the tangential contact.
    coupled_lengths : bool
        Whether half-lengths depend on the line loads of all strips.
    """

    capabilities = Capabilities(
        wear_compliance=True,
        coupled=True,
        creepage_variation=True,
        bearing_torque=True,
        local_friction=True,
        pass_loop=True,
        fields=True,
    )

    def __init__(self, theory: TangentialTheory, coupled_lengths: bool = True) -> None:
        super().__init__(theory)
        self._coupled_lengths = coupled_lengths
        if not isinstance(theory, StripTheory):
            self.capabilities = replace(self.capabilities, pass_loop=False)

    def prepare(self, grid: Grid, materials: tuple[Material, Material]) -> None:
        """Set strips and materials, and tabulate the influence of one strip on another."""
        super().prepare(grid, materials)
        self._bend = (curvature_table if self._coupled_lengths else no_table)(grid.strips)

    def solve(
        self,
        gap: FloatArray,
        longitudinal_curvature: float,
        point: OperatingPoint,
        wear_compliance: FloatArray | None = None,
        warm: ContactSolution | None = None,
    ) -> ContactSolution:
        """Solve one contact."""
        shape = (1, 1, len(gap))
        own = np.zeros(shape) if wear_compliance is None else wear_compliance.reshape(shape)
        start = None if warm is None else (warm.line_load, warm.approach)
        normal = self._solve_normal(
            gap.reshape(shape), longitudinal_curvature, point.normal_force, own, start, _SINGLE
        )
        if not self._has_closed_form(point):
            return self._completed(normal, (0, 0), longitudinal_curvature, point)
        inputs = TangentialInputs.of_one(point, self._grid)
        dissipation, sums = strip_tractions(normal, inputs, self._grid, self._pair)
        if first_not_finite(sums) is not None:
            raise power_not_finite(point, line_load=normal.line_load[0, 0])
        return ContactSolution(
            y=self._grid.y,
            half_length=normal.half_length[0, 0],
            line_load=normal.line_load[0, 0],
            dissipation=dissipation[0],
            approach=normal.approach.item(),
            longitudinal_creepage=point.creepage.longitudinal,
            iterations=normal.iterations.item(),
            **dict(zip(SUMS, sums[:, 0].tolist(), strict=True)),
        )

    def solve_coupled(
        self,
        gap: FloatArray,
        longitudinal_curvature: float,
        points: Sequence[OperatingPoint],
        wear: SharedWear,
        warm: Sequence[ContactSolution] | None = None,
    ) -> Sequence[ContactSolution]:
        """Solve several contacts that wear common bodies, in one system of equations."""
        return self.solve_coupled_batch(
            gap[None],
            longitudinal_curvature,
            points,
            SharedWear(wear.bodies, wear.compliance[None]),
            warm,
        )

    def solve_coupled_batch(
        self,
        gap: FloatArray,
        longitudinal_curvature: float,
        points: Sequence[OperatingPoint],
        wear: SharedWear,
        warm: Sequence[ContactSolution] | None = None,
    ) -> Sequence[ContactSolution]:
        """Solve many sets of contacts that wear common bodies, in one call."""
        leading, columns = (*gap.shape[:2], 1), self._columns(points)
        if columns is not None:
            return self._solve_columns(gap, longitudinal_curvature, columns, wear, warm, leading)
        loads = np.array([point.normal_force for point in points])
        start = start_of(warm)
        normal = self._solve_normal(gap, longitudinal_curvature, loads, wear, start, leading)
        return [
            self._completed(normal, place, longitudinal_curvature, point)
            for place, point in zip(np.ndindex(gap.shape[:2]), points, strict=True)
        ]

    def _completed(
        self,
        normal: NormalContacts,
        place: tuple[int, ...],
        longitudinal_curvature: float,
        point: OperatingPoint,
    ) -> ContactSolution:
        """Return the solution at `place`, set and contact, by any tangential theory."""
        return self._complete(
            normal.line_load[place],
            normal.half_length[place],
            longitudinal_curvature,
            float(normal.approach[place]),
            int(normal.iterations[place[0]]),
            point,
        )

    def solve_batch(
        self,
        gap: FloatArray,
        longitudinal_curvature: float,
        points: Sequence[OperatingPoint],
        wear_compliance: FloatArray | None = None,
        warm: Sequence[ContactSolution] | None = None,
    ) -> BatchSolution:
        """Solve many independent contacts, in one call if strip theory supports the points."""
        columns = self._columns(points)
        if columns is None:
            return super().solve_batch(gap, longitudinal_curvature, points, wear_compliance, warm)
        single = gap.reshape(-1, 1, gap.shape[-1])
        shape = single.shape
        own = np.zeros(shape) if wear_compliance is None else wear_compliance.reshape(shape)
        leading = gap.shape[:-1]
        return self._solve_columns(single, longitudinal_curvature, columns, own, warm, leading)

    def _solve_columns(
        self,
        gap: FloatArray,
        longitudinal_curvature: float,
        points: OperatingPoints,
        wear: SharedWear | FloatArray,
        warm: Sequence[ContactSolution] | None,
        leading: tuple[int, ...],
    ) -> BatchSolution:
        """Solve sets of contacts, (sets, contacts, strips), by strip theory.

        `wear` is shared, or the wear compliance of each contact. `leading` is the shape of the
        result.
        """
        loads, start = points.normal_force, start_of(warm)
        normal = self._solve_normal(gap, longitudinal_curvature, loads, wear, start, leading)
        inputs = TangentialInputs.of(points, self._grid)
        dissipation, sums = strip_tractions(normal, inputs, self._grid, self._pair)
        number = first_not_finite(sums)
        if number is not None:
            line_load = normal.line_load.reshape(dissipation.shape)
            error = power_not_finite(points[number], line_load=line_load[number])
            raise naming_contact(error, number, leading)
        strips = (*leading, self._grid.strips)
        columns = {
            "half_length": normal.half_length.reshape(strips),
            "line_load": normal.line_load.reshape(strips),
            "dissipation": dissipation.reshape(strips),
            "approach": normal.approach.reshape(leading),
            "longitudinal_creepage": points.longitudinal.reshape(leading),
            "iterations": normal.iterations.repeat(normal.gap.shape[1]).reshape(leading),
            **dict(zip(SUMS, sums.reshape(-1, *leading), strict=True)),
        }
        return BatchSolution(leading, self._grid.y, columns)

    def _solve_normal(
        self,
        gap: FloatArray,
        longitudinal_curvature: float,
        loads: Number,
        wear: SharedWear | FloatArray,
        start: tuple[FloatArray, Number] | None,
        leading: tuple[int, ...],
    ) -> NormalContacts:
        """Solve the normal problem of sets of contacts.

        `start` is the initial guess of line loads and approaches.
        """
        constants = Constants(
            self._grid.spacing,
            self._pair.contact_modulus,
            longitudinal_curvature,
            self._table,
            self._bend,
        )
        normal = NormalContacts.starting(gap, loads, start)
        if isinstance(wear, SharedWear):
            normal.solve(wear, constants)
        else:
            normal.solve_independent(wear, constants)
        for number in normal.failed.tolist():
            try:
                self._check(
                    int(normal.status[number]),
                    normal.gap[number],
                    normal.loads[number],
                    normal.line_load[number],
                    normal.approach[number],
                )
            except ContactError as error:
                if gap.shape[1] > 1:
                    raise
                raise naming_contact(error, number, leading) from error
        return normal

    def _has_closed_form(self, point: OperatingPoint) -> bool:
        """Return whether strip theory solves an operating point in closed form."""
        return (
            isinstance(self.theory, StripTheory)
            and (isinstance(point.friction, float) or np.ndim(point.friction) < 2)
            and point.bearing_torque is None
            and not point.friction_carried
        )

    def _columns(self, points: Sequence[OperatingPoint]) -> OperatingPoints | None:
        """Return the points as columns if strip theory solves them in closed form, or None."""
        if not isinstance(self.theory, StripTheory):
            return None
        columns = OperatingPoints.of(points)
        if columns is None or columns.friction.ndim > 2 or columns.friction_carried:
            return None
        return columns

    def _check(
        self,
        status: int,
        gap: FloatArray,
        loads: FloatArray,
        line_load: FloatArray,
        approach: FloatArray,
    ) -> None:
        state = {"gap": gap, "line_load": line_load, "approach": approach, "normal_force": loads}
        if status != kernels.CONVERGED:
            raise ContactError(f"the slender contact failed: {_REMEDY[status]}", state)
        check_edges(self._grid, line_load, state)

    def pass_loop(self, loop: PassLoop) -> int:
        """Run roller passes in compiled code; strip theory only."""
        if not self.capabilities.pass_loop:
            return super().pass_loop(loop)
        from wearsim.mechanics.slender import chord_method, pass_loop  # noqa: PLC0415  (slow to load, rarely needed)

        constants = chord_method.contact_constants(
            self._grid.spacing,
            self._pair.contact_modulus,
            self._pair.shear_modulus,
            loop.longitudinal_curvature,
            self._table,
            self._bend,
        )
        status, done, full_solves = pass_loop.run_passes(
            loop.order,
            loop.first_pass,
            pass_loop.Passes(loop.base_load, loop.creepage, loop.friction, loop.tilt, loop.spin),
            float(loop.stiffness),
            loop.terms,
            loop.term_rates,
            loop.nominal_gap,
            loop.from_apex,
            loop.rolling_speed,
            loop.similar,
            constants,
            pass_loop.Wear(
                loop.slip_base,
                loop.spin_arm,
                loop.slip_rates,
                loop.wear,
                loop.cylinder_depth,
                loop.roller_depth,
            ),
            chord_method.Loads(
                loop.line_load, loop.anchor, loop.anchor_gap, loop.approach, loop.anchor_approach
            ),
            chord_method.new_chord_state(constants, *loop.nominal_gap.shape),
            loop.energy,
        )
        gap = loop.nominal_gap + loop.cylinder_depth + loop.roller_depth
        if status == pass_loop.UNLOADED:
            raise ContactError(
                f"contact is lost at pass {loop.first_pass + done}: the load is not positive",
                {"line_load": loop.line_load, "gap": gap},
            )
        loads = loop.line_load.sum(axis=1) * self._grid.spacing
        self._check(status, gap, loads, loop.line_load, loop.approach)
        return int(full_solves)


SPEC = ContactModelSpec(
    name="slender",
    factory=lambda options: Slender(tangential_theory(options), options.half_length == "coupled"),
    options=SlenderOptions,
    capabilities=Slender.capabilities,
    summary="line-contact strips on any profile; the default",
    references=(
        "Kalker, On elastic line contact, J. Appl. Mech. 39 (1972), DOI 10.1115/1.3422842",
        "Carter, Proc. R. Soc. A 112 (1926), DOI 10.1098/rspa.1926.0100",
    ),
)

"""The contact model `slender`."""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

import numpy as np
from pydantic import Field

from wearsim.contact_batch import ContactBatch, ContactBatchSolution
from wearsim.errors import ContactError
from wearsim.mechanics.slender import newton as kernels
from wearsim.mechanics.slender.influence import HIGHEST, curvature_table, no_table
from wearsim.mechanics.tangential.strip_interaction import strip_elasticity
from wearsim.mechanics.tangential.strip_theory import SUMS
from wearsim.models.contact.normal_contacts import NormalContacts
from wearsim.models.contact.strip_model import (
    StripModel,
    check_edges,
    grid_about_hertz,
    normal_failure,
)
from wearsim.models.contact.strip_tractions import strip_tractions
from wearsim.models.tangential.base import TangentialTheory, power_not_finite
from wearsim.models.tangential.strip_theory import StripTheory, TangentialOptions, tangential_theory
from wearsim.models.tangential.torque_balance import with_balanced_creepage
from wearsim.plugins import (
    Capabilities,
    ContactModelSpec,
    PassLoop,
    SharedWear,
    refuse_unclaimed,
)
from wearsim.plugins.contact_model import naming_contact, solved_one_by_one
from wearsim.types import FloatArray, Grid, Material

_FAILURE = {
    kernels.SINGULAR: "its equations are singular: check the gap, the load and the materials",
    kernels.TOO_FINE: f"a half-length exceeds {np.exp(HIGHEST):.0f} strip widths",
    kernels.NO_CONVERGENCE: "Newton's method did not converge on the strips in contact",
    kernels.NOT_FINITE: "a value is not finite",
}


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
    theory, grid, materials
        As in `StripModel`.
    coupled_lengths : bool
        Whether half-lengths depend on the line loads of all strips.
    """

    capabilities = Capabilities(
        wear_compliance=True,
        coupled=True,
        creepage_variation=True,
        bearing_torque=True,
        local_friction=True,
        creep_factor=True,
        pass_loop=True,
        fields=True,
    )

    def __init__(
        self,
        theory: TangentialTheory,
        grid: Grid,
        materials: tuple[Material, Material],
        coupled_lengths: bool = True,
    ) -> None:
        super().__init__(theory, grid, materials)
        self._bend = (curvature_table if coupled_lengths else no_table)(grid.strips)
        if not isinstance(theory, StripTheory):
            self.capabilities = replace(self.capabilities, pass_loop=False)

    def solve(
        self,
        batch: ContactBatch,
        wear_compliance: FloatArray | None = None,
        coupling: SharedWear | None = None,
        warm: ContactBatchSolution | None = None,
    ) -> ContactBatchSolution:
        """Solve the contacts in one call if strip theory supports them.

        Contacts with another theory have their normal problems solved in one call and their
        tangential problems one after another.
        """
        refuse_unclaimed(self, batch, wear_compliance, coupling)
        normal = self._solve_normal(batch, wear_compliance, coupling, warm)
        shape = batch.gap.shape
        line_load, half_length = normal.line_load.reshape(shape), normal.half_length.reshape(shape)
        separation, approach = normal.separation.reshape(shape), normal.approach.reshape(shape[0])
        iterations = normal.iterations.ravel()
        if not isinstance(self.theory, StripTheory):
            one_by_one = solved_one_by_one(
                batch,
                lambda k: self._complete(
                    line_load[k],
                    half_length[k],
                    float(batch.longitudinal_curvature[k]),
                    float(approach[k]),
                    int(iterations[k]),
                    batch.point(k),
                ),
            )
            return replace(one_by_one, separation=separation)
        solved, tangential = (line_load, half_length), (self._grid, self._tangential)
        if batch.bearing_torque is not None:
            batch = with_balanced_creepage(
                batch,
                line_load,
                half_length,
                self._grid,
                self._tangential,
                warm,
                lambda trial: strip_tractions(*solved, trial, *tangential)[2],
            )
        dissipation, sums, _ = strip_tractions(*solved, batch, *tangential)
        if not np.isfinite(np.add.reduce(sums, axis=None)):
            number = int((~np.isfinite(sums)).nonzero()[1].min())
            raise naming_contact(
                power_not_finite(batch.point(number), line_load=line_load[number]), number, batch
            )
        return ContactBatchSolution.of_columns(
            {
                "y": self._grid.y,
                "half_length": half_length,
                "line_load": line_load,
                "dissipation": dissipation,
                "approach": approach,
                "longitudinal_creepage": batch.longitudinal,
                "iterations": iterations,
                "separation": separation,
                **dict(zip(SUMS, sums, strict=True)),
            }
        )

    def _solve_normal(
        self,
        batch: ContactBatch,
        wear_compliance: FloatArray | None,
        coupling: SharedWear | None,
        warm: ContactBatchSolution | None,
    ) -> NormalContacts:
        """Solve the normal problems; arguments as in `solve`."""
        constants = self._grid.spacing, self._pair.contact_modulus, self._table, self._bend
        size = 1 if coupling is None else len(coupling.bodies)
        normal = NormalContacts.starting(batch, size, warm)
        if not normal.solve(wear_compliance if coupling is None else coupling, constants):
            return normal
        for number in normal.failed.tolist():
            try:
                self._check(
                    int(normal.status[number].max()),
                    normal.gap[number],
                    normal.loads[number],
                    normal.line_load[number],
                    normal.approach[number],
                )
            except ContactError as error:
                if size > 1:
                    raise
                raise naming_contact(error, number, batch) from error
        return normal

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
            raise normal_failure("slender", _FAILURE[status], status == kernels.TOO_FINE, state)
        check_edges(self._grid, line_load, state)

    def pass_loop(self, loop: PassLoop) -> int:
        """Run roller passes in compiled code; strip theory only."""
        if not self.capabilities.pass_loop:
            return super().pass_loop(loop)
        from wearsim.mechanics.slender import chord_method, pass_loop  # noqa: PLC0415  (slow to load, rarely needed)

        modulus = self._pair.contact_modulus
        constants = chord_method.ContactConstants(
            self._grid.spacing,
            1.0 / (np.pi * modulus),
            modulus,
            loop.longitudinal_curvature,
            self._table,
            self._bend,
            strip_elasticity(self._tangential.contact_modulus, self._tangential.shear_modulus),
        )
        status, done, full_solves = pass_loop.run_passes(
            loop.order,
            loop.first_pass,
            pass_loop.Passes(loop.base_load, loop.creepage, loop.friction, loop.tilt, loop.spin),
            float(loop.stiffness),
            loop.fresh_approach,
            loop.rests,
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
                cause="lost",
            )
        loads = loop.line_load.sum(axis=1) * self._grid.spacing
        self._check(status, gap, loads, loop.line_load, loop.approach)
        return int(full_solves)


SPEC = ContactModelSpec(
    name="slender",
    factory=lambda options, grid, materials: Slender(
        tangential_theory(options), grid, materials, options.half_length == "coupled"
    ),
    suggest_grid=grid_about_hertz,
    protocol=2,
    options=SlenderOptions,
    capabilities=Slender.capabilities,
    summary="line-contact strips on any profile; the default",
    references=(
        "Kalker, On elastic line contact, J. Appl. Mech. 39 (1972), DOI 10.1115/1.3422842",
        "Carter, Proc. R. Soc. A 112 (1926), DOI 10.1098/rspa.1926.0100",
    ),
)

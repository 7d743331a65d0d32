"""The contact model `semi-hertzian`: Kik-Piotrowski, STRIPES and ANALYN on any gap profile."""

from __future__ import annotations

from typing import Literal

import numpy as np
from pydantic import Field

from wearsim.errors import ContactError
from wearsim.mechanics.numerics.jit import own_array
from wearsim.mechanics.semi_hertzian import solver as kernels
from wearsim.mechanics.semi_hertzian.penetration import (
    CONVERGED,
    NO_CONVERGENCE,
    NOT_FINITE,
    TOO_FINE,
)
from wearsim.mechanics.slender.influence import HIGHEST
from wearsim.models.contact.strip_model import StripModel, check_edges, grid_about_hertz
from wearsim.models.tangential.base import TangentialTheory
from wearsim.models.tangential.strip_theory import TangentialOptions, tangential_theory
from wearsim.plugins import Capabilities, ContactModelSpec, SingleContactModel
from wearsim.types import ContactSolution, FloatArray, Grid, Material, OperatingPoint

Variant = Literal["kik-piotrowski", "ayasse-chollet", "analyn"]

_VARIANTS: dict[Variant, int] = {
    "kik-piotrowski": kernels.KIK_PIOTROWSKI,
    "ayasse-chollet": kernels.AYASSE_CHOLLET,
    "analyn": kernels.ANALYN,
}

_REMEDY = {
    TOO_FINE: f"a half-length exceeds {np.exp(HIGHEST):.0f} strip widths: lower contact.strips",
    NO_CONVERGENCE: "the contact and the gap that its wear opens did not converge",
    NOT_FINITE: "a value is not finite, or the load is not positive",
}


class SemiHertzianOptions(TangentialOptions):
    """Options of the contact model `semi-hertzian`."""

    variant: Variant = Field(
        "analyn",
        description="kik-piotrowski: virtual penetration, no curvature needed, 17 % off on long"
        " ellipses; ayasse-chollet (STRIPES) and analyn: Hertz strip by strip, exact on ellipses",
    )


class SemiHertzian(StripModel, SingleContactModel):
    """Strips as springs with Hertzian stiffness, or that of a virtual penetration.

    The variants depend on the lateral curvature of the profile, which is that of a least-squares
    parabola over the half-width of the contact to either side (`mechanics.semi_hertzian.solver`).
    Several patches are solved for one approach; the penetration of each is measured from its
    point of first contact, until the patches merge (`mechanics.semi_hertzian.penetration`). With a
    wear compliance, the gap after wear is used throughout.

    Parameters
    ----------
    variant : {"kik-piotrowski", "ayasse-chollet", "analyn"}
        Variant of the method.
    theory, grid, materials
        As in `StripModel`.
    """

    capabilities = Capabilities(
        wear_compliance=True,
        creepage_variation=True,
        bearing_torque=True,
        local_friction=True,
        fields=True,
    )

    def __init__(
        self,
        variant: Variant,
        theory: TangentialTheory,
        grid: Grid,
        materials: tuple[Material, Material],
    ) -> None:
        super().__init__(theory, grid, materials)
        self._variant = _VARIANTS[variant]
        self._local_hertz = kernels.local_hertz_table()

    def solve_contact(
        self,
        gap: FloatArray,
        longitudinal_curvature: float,
        point: OperatingPoint,
        wear_compliance: FloatArray | None = None,
        warm: ContactSolution | None = None,
    ) -> ContactSolution:
        """Solve one contact; `warm` is not used."""
        line_load, half_length = np.zeros(len(gap)), np.zeros(len(gap))
        compliance = np.zeros(len(gap)) if wear_compliance is None else own_array(wear_compliance)
        status, iterations, approach = kernels.solve_semi_hertzian(
            self._variant,
            own_array(gap),
            compliance,
            float(point.normal_force),
            self._grid.spacing,
            self._pair.contact_modulus,
            float(longitudinal_curvature),
            self._table,
            self._local_hertz,
            line_load,
            half_length,
        )
        state = {
            "gap": gap,
            "line_load": line_load,
            "approach": approach,
            "normal_force": point.normal_force,
        }
        if status != CONVERGED:
            raise ContactError(f"the semi-Hertzian contact failed: {_REMEDY[status]}", state)
        check_edges(self._grid, line_load, state)
        return self._complete(
            line_load, half_length, longitudinal_curvature, approach, iterations, point
        )


SPEC = ContactModelSpec(
    name="semi-hertzian",
    factory=lambda options, grid, materials: SemiHertzian(
        options.variant, tangential_theory(options), grid, materials
    ),
    suggest_grid=grid_about_hertz,
    protocol=2,
    options=SemiHertzianOptions,
    capabilities=SemiHertzian.capabilities,
    summary="strips as springs: Kik-Piotrowski, STRIPES or ANALYN, chosen by the option variant",
    references=(
        "Piotrowski and Kik, Veh. Syst. Dyn. 46 (2008), DOI 10.1080/00423110701586444",
        "Ayasse and Chollet, Veh. Syst. Dyn. 43 (2005), DOI 10.1080/00423110412331327193",
        "Sichani, Enblom and Berg, Veh. Syst. Dyn. 52 (2014), DOI 10.1080/00423114.2014.961932",
    ),
)

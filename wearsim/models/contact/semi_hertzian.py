"""The contact model `semi-hertzian`: Kik-Piotrowski, STRIPES and ANALYN on any gap profile."""

from __future__ import annotations

from typing import Literal

import numpy as np
from pydantic import Field

from wearsim.errors import ContactError
from wearsim.mechanics.hertz.elasticity import ElasticPair, combine
from wearsim.mechanics.numerics.jit import own_array
from wearsim.mechanics.semi_hertzian import solver as kernels
from wearsim.mechanics.semi_hertzian.penetration import (
    CONVERGED,
    NO_CONVERGENCE,
    NOT_FINITE,
    TOO_FINE,
)
from wearsim.mechanics.slender.influence import HIGHEST, influence_table
from wearsim.models.contact.default_grid import check_edges, grid_about_hertz
from wearsim.models.tangential.base import TangentialTheory, complete, inside, semi_elliptic_strips
from wearsim.models.tangential.options import TangentialOptions, tangential_theory
from wearsim.plugins import Capabilities, ContactModel, ContactModelSpec
from wearsim.types import (
    ContactFields,
    ContactSolution,
    FloatArray,
    Grid,
    Material,
    OperatingPoint,
)

Variant = Literal["kik-piotrowski", "ayasse-chollet", "analyn"]

_VARIANTS: dict[Variant, int] = {
    "kik-piotrowski": kernels.KIK_PIOTROWSKI,
    "ayasse-chollet": kernels.AYASSE_CHOLLET,
    "analyn": kernels.ANALYN,
}

_REMEDY = {
    TOO_FINE: f"a half-length exceeds {np.exp(HIGHEST):.0f} strip widths: lower contact.strips",
    NO_CONVERGENCE: "contact and the gap that its wear opens did not agree",
    NOT_FINITE: "a value is not finite, or the load is not positive",
}


class SemiHertzianOptions(TangentialOptions):
    """Options of the contact model `semi-hertzian`."""

    variant: Variant = Field(
        "analyn",
        description="kik-piotrowski: virtual penetration, no curvature needed, 17 % off on long"
        " ellipses; ayasse-chollet (STRIPES) and analyn: Hertz strip by strip, exact on ellipses",
    )


class SemiHertzian(ContactModel):
    """Strips as springs whose stiffness is Hertz's, or that of a virtual penetration.

    What the variants need of the profile's shape, its lateral curvature, is smoothed by one rule:
    a least-squares parabola over the half-width of the contact to either side
    (`mechanics.semi_hertzian.solver`). Several patches are solved together for one approach;
    each penetrates from its own first contact point, until they grow together
    (`mechanics.semi_hertzian.penetration`). With a wear compliance all this is taken from the gap that
    wear leaves, not from the one before.

    Parameters
    ----------
    variant : {"kik-piotrowski", "ayasse-chollet", "analyn"}
        Which of the methods.
    theory : TangentialTheory
        How tractions are found.
    """

    capabilities = Capabilities(
        wear_compliance=True,
        creepage_variation=True,
        bearing_torque=True,
        local_friction=True,
        fields=True,
    )

    def __init__(self, variant: Variant, theory: TangentialTheory) -> None:
        self.theory = theory
        self._variant = _VARIANTS[variant]

    def prepare(self, grid: Grid, materials: tuple[Material, Material]) -> None:
        """Tabulate the influence of one strip on another, and Hertz's ellipses."""
        self._grid = grid
        self._pair: ElasticPair = combine(*materials)
        self._influence = influence_table(grid.strips)
        self._local_hertz = kernels.local_hertz_table()

    def suggest_grid(
        self,
        gap_curvature: float,
        longitudinal_curvature: float,
        normal_force: float,
        materials: tuple[Material, Material],
    ) -> Grid | None:
        """Return 121 strips over 1.2 times the width of the Hertzian patch."""
        return grid_about_hertz(gap_curvature, longitudinal_curvature, normal_force, materials)

    def solve(
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
            self._influence,
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
        strips = semi_elliptic_strips(
            self._grid, line_load, half_length, longitudinal_curvature, approach, iterations
        )
        return complete(self.theory, strips, self._pair, point)

    def fields(
        self,
        solution: ContactSolution,
        gap: FloatArray,
        longitudinal_curvature: float,
        point: OperatingPoint,
        points_along: int = 101,
    ) -> ContactFields:
        """Return tractions and slip inside a solved contact."""
        strips = semi_elliptic_strips(
            self._grid,
            solution.line_load,
            solution.half_length,
            longitudinal_curvature,
            solution.approach,
            solution.iterations,
        )
        creepage = solution.longitudinal_creepage
        return inside(self.theory, strips, self._pair, point, creepage, points_along)


def _build(options: SemiHertzianOptions) -> SemiHertzian:
    return SemiHertzian(options.variant, tangential_theory(options))


SPEC = ContactModelSpec(
    name="semi-hertzian",
    factory=_build,
    options=SemiHertzianOptions,
    capabilities=SemiHertzian.capabilities,
    summary="strips as springs: Kik-Piotrowski, STRIPES or ANALYN, chosen by the option variant",
    references=(
        "Piotrowski and Kik, Veh. Syst. Dyn. 46 (2008), DOI 10.1080/00423110701586444",
        "Ayasse and Chollet, Veh. Syst. Dyn. 43 (2005), DOI 10.1080/00423110412331327193",
        "Sichani, Enblom and Berg, Veh. Syst. Dyn. 52 (2014), DOI 10.1080/00423114.2014.961932",
    ),
)

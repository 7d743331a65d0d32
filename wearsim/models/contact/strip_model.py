"""Contact models that solve loaded strips: their options, their base, and semi-hertzian."""

from __future__ import annotations

from collections.abc import Mapping
from copy import copy
from typing import Any, Literal, Self

import numpy as np
from pydantic import Field, ValidationInfo, field_validator

from wearsim.errors import ContactError
from wearsim.mechanics.hertz.elasticity import ElasticPair, combine
from wearsim.mechanics.hertz.ellipse import hertz
from wearsim.mechanics.numerics.jit import own_array
from wearsim.mechanics.semi_hertzian import solver as kernels
from wearsim.mechanics.semi_hertzian.penetration import (
    CONVERGED,
    NO_CONVERGENCE,
    NOT_FINITE,
    TOO_FINE,
)
from wearsim.mechanics.slender.influence import HIGHEST, influence_table
from wearsim.models.tangential.base import (
    Strips,
    TangentialTheory,
    complete,
    friction_per_strip,
    local_slip,
)
from wearsim.models.tangential.fastsim import FastripTheory, FastsimTheory
from wearsim.models.tangential.strip_theory import StripTheory
from wearsim.plugins import (
    Capabilities,
    ContactModel,
    ContactModelSpec,
    Options,
    SingleContactModel,
)
from wearsim.types import (
    ContactFields,
    ContactSolution,
    FloatArray,
    Grid,
    Material,
    OperatingPoint,
)
from wearsim.units import QuantityError, as_written

_WIDTH = 1.2  # width of the grid over that of the Hertzian patch
_STRIPS = 121
Variant = Literal["kik-piotrowski", "ayasse-chollet", "analyn"]
_VARIANTS: dict[Variant, int] = {
    "kik-piotrowski": kernels.KIK_PIOTROWSKI,
    "ayasse-chollet": kernels.AYASSE_CHOLLET,
    "analyn": kernels.ANALYN,
}
# the theories that use each of the other options
_USED_BY = {"mx": ("fastrip", "fastsim"), "bound": ("fastsim",), "flexibility": ("fastsim",)}
_FAILURE = {
    TOO_FINE: f"a half-length exceeds {np.exp(HIGHEST):.0f} strip widths",
    NO_CONVERGENCE: "the contact and the gap that its wear opens did not converge",
    NOT_FINITE: "a value is not finite, or the load is not positive",
}


class TangentialOptions(Options):
    """Options of contact models of strips that select the tangential theory."""

    tangential: Literal["strip", "fastrip", "fastsim"] = Field(
        "strip",
        description="tangential theory: closed-form strips, a FaStrip march or a FASTSIM march",
    )
    mx: int = Field(50, ge=2, description="points along rolling of a FaStrip or FASTSIM march")
    bound: Literal["parabolic", "elliptic"] = Field(
        "elliptic", description="traction bound of a FASTSIM march"
    )
    flexibility: Literal["three", "one"] = Field(
        "three",
        description="flexibilities of a FASTSIM march: Kalker's three, or one weighted by creepage",
    )

    @field_validator(*_USED_BY)
    @classmethod
    def _is_used(cls, value: object, info: ValidationInfo) -> object:
        """Refuse an option that the theory does not use; defaults are not validated."""
        theory, users = info.data.get("tangential"), _USED_BY[str(info.field_name)]
        if theory is not None and theory not in users:
            raise QuantityError(
                f'is not used with tangential = "{theory}"',
                as_written(value),
                "none of it, or " + " or ".join(f'tangential = "{user}"' for user in users),
            )
        return value


def tangential_theory(options: TangentialOptions) -> TangentialTheory:
    """Return the tangential theory that the options select."""
    if options.tangential == "strip":
        return StripTheory()
    if options.tangential == "fastrip":
        return FastripTheory(options.mx)
    return FastsimTheory(options.bound, options.mx, flexibility=options.flexibility)


class StripModel(ContactModel):
    """Contact model with semi-elliptic pressure along rolling in each strip.

    Parameters
    ----------
    theory : TangentialTheory
        Theory of the tangential contact.
    grid : Grid
        The strips.
    materials : tuple of Material
        Materials of cylinder and roller.
    """

    def __init__(
        self, theory: TangentialTheory, grid: Grid, materials: tuple[Material, Material]
    ) -> None:
        self.theory, self._grid = theory, grid
        self._pair: ElasticPair = combine(*materials)
        self._tangential, self._table = self._pair, influence_table(grid.strips)

    def with_creep_factor(self, factor: float) -> Self:
        """Return the model with its tangential compliance divided by a factor."""
        model = copy(self)
        model._tangential = self._pair.reduced(factor)
        return model

    def fields(
        self,
        solution: ContactSolution,
        gap: FloatArray,
        longitudinal_curvature: float,
        point: OperatingPoint,
        points_along: int = 101,
    ) -> ContactFields:
        """Return pressure, traction and slip in a solved contact."""
        strips = self._strips(
            solution.line_load,
            solution.half_length,
            longitudinal_curvature,
            solution.approach,
            solution.iterations,
        )
        return self.theory.fields(
            strips,
            self._tangential,
            local_slip(strips, point, solution.longitudinal_creepage),
            friction_per_strip(strips, point),
            point.rolling_speed,
            points_along,
        )

    def _complete(
        self,
        line_load: FloatArray,
        half_length: FloatArray,
        longitudinal_curvature: float,
        approach: float,
        iterations: int,
        point: OperatingPoint,
    ) -> ContactSolution:
        """Solve the tangential problem of a solved normal contact."""
        strips = self._strips(line_load, half_length, longitudinal_curvature, approach, iterations)
        return complete(self.theory, strips, self._tangential, point)

    def _strips(
        self,
        line_load: FloatArray,
        half_length: FloatArray,
        longitudinal_curvature: float,
        approach: float,
        iterations: int,
    ) -> Strips:
        loaded = line_load > 0.0
        return Strips(
            y=self._grid.y,
            half_length=half_length,
            line_load=line_load,
            spacing=self._grid.spacing,
            longitudinal_curvature=longitudinal_curvature,
            approach=float(approach),
            peak_pressure=float(2.0 * (line_load[loaded] / (np.pi * half_length[loaded])).max()),
            iterations=iterations,
        )


def grid_about_hertz(
    options: object,
    gap_curvature: float,
    longitudinal_curvature: float,
    normal_force: float,
    materials: tuple[Material, Material],
) -> Grid:
    """Return 121 strips over 1.2 times the width of the Hertzian patch.

    Parameters
    ----------
    options : Options
        Not used.
    gap_curvature, longitudinal_curvature : float
        Relative curvatures across and along rolling [1/m].
    normal_force : float
        Load [N].
    materials : tuple of Material
        Materials of the two bodies.
    """
    modulus = combine(*materials).contact_modulus
    patch = hertz(0.5 * longitudinal_curvature, 0.5 * gap_curvature, normal_force, modulus)
    return Grid.spanning(-_WIDTH * patch.b, _WIDTH * patch.b, _STRIPS)


def check_edges(grid: Grid, line_load: FloatArray, state: Mapping[str, Any]) -> None:
    """Raise an error if a contact reaches its first or last strip.

    Parameters
    ----------
    grid : Grid
        The strips; not checked if there are only one or two.
    line_load : ndarray, shape (strips,) or (contacts, strips)
        q [N/m].
    state : mapping
        State of the error.

    Raises
    ------
    ContactError
        If the line load of an edge strip is positive.
    """
    at_edge = (line_load[..., 0] > 0.0) | (line_load[..., -1] > 0.0)
    if grid.strips > 2 and at_edge.any():
        y = grid.y
        raise ContactError(
            f"the contact reaches the edge of its strips, which span {y[0] * 1e3:.4g} to"
            f" {y[-1] * 1e3:.4g} mm",
            dict(state),
            remedy="raise contact.width or move contact.centre",
            cause="edge",
        )


def normal_failure(kind: str, what: str, too_fine: bool, state: Mapping[str, Any]) -> ContactError:
    """Return the error of a normal problem without solution.

    Parameters
    ----------
    kind : str
        Name of the contact in the message.
    what : str
        What failed.
    too_fine : bool
        Whether a half-length exceeds the greatest number of strip widths.
    state : mapping
        State of the error.
    """
    message = f"the {kind} contact failed: {what}"
    remedy, cause = ("lower contact.strips", "too fine") if too_fine else ("", "")
    return ContactError(message, dict(state), remedy=remedy, cause=cause)


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
        creep_factor=True,
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
        # the depths under a vanishing load would be lost in the rounding of a deep groove
        lowest = float(gap.min()) if np.isfinite(gap).all() else 0.0
        status, iterations, approach = kernels.solve_semi_hertzian(
            self._variant,
            own_array(gap - lowest),
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
        approach += lowest
        state = {
            "gap": gap,
            "line_load": line_load,
            "approach": approach,
            "normal_force": point.normal_force,
        }
        if status != CONVERGED:
            raise normal_failure("semi-Hertzian", _FAILURE[status], status == TOO_FINE, state)
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

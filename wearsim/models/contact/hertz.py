"""The contact model `hertz`, and the normal contact of `hertz-fastsim`."""

from __future__ import annotations

import math
from collections.abc import Mapping
from copy import copy
from typing import Any, Self

import numpy as np
from pydantic import Field

from wearsim.errors import ContactError
from wearsim.mechanics.hertz import parabola_fit
from wearsim.mechanics.hertz.elasticity import ElasticPair, combine
from wearsim.mechanics.hertz.ellipse import HertzContact, given_ellipse, hertz
from wearsim.mechanics.hertz.patches import fit_within
from wearsim.models.contact.strip_model import TangentialOptions, tangential_theory
from wearsim.models.tangential.base import (
    EllipseStrips,
    Strips,
    TangentialTheory,
    complete,
    friction_per_strip,
    local_slip,
    power_not_finite,
)
from wearsim.plugins import Capabilities, ContactModelSpec, Options, SingleContactModel
from wearsim.quantities import PositiveLength
from wearsim.types import (
    ContactFields,
    ContactSolution,
    FloatArray,
    Grid,
    Material,
    OperatingPoint,
)

TOLERANCE = 1e-10
LIMIT = 200


class Patch(Options):
    """Prescribed contact ellipse."""

    a: PositiveLength = Field(description="half-length along rolling")
    b: PositiveLength = Field(description="half-length across rolling")


class HertzOptions(TangentialOptions):
    """Options of the contact model `hertz`."""

    my: int = Field(50, ge=3, description="strips across the patch of a single contact")


class HertzModel(SingleContactModel):
    """Exact Hertzian contact on the strips of a grid, with any tangential theory.

    On a worn profile the lateral curvature and the centre are those of a parabola fitted to the
    gap over the patch by least squares with the weights ``1 - ((y - yc)/b)^2``; patch and fit are
    iterated to a relative change of 1e-10. A prescribed patch is centred on the vertex of the
    parabola fitted with these weights to the largest interval symmetric about the vertex.

    Parameters
    ----------
    theory : TangentialTheory
        Theory of the tangential contact.
    grid : Grid
        The strips.
    materials : tuple of Material
        Materials of cylinder and roller.
    patch : Patch, optional
        Contact ellipse that replaces the Hertzian one.
    """

    capabilities = Capabilities(
        creepage_variation=True,
        bearing_torque=True,
        local_friction=True,
        creep_factor=True,
        fields=True,
    )

    def __init__(
        self,
        theory: TangentialTheory,
        grid: Grid,
        materials: tuple[Material, Material],
        patch: Patch | None = None,
    ) -> None:
        self.theory, self._grid, self.patch = theory, grid, patch
        self._pair: ElasticPair = combine(*materials)
        self._tangential = self._pair

    def with_creep_factor(self, factor: float) -> Self:
        """Return the model with its tangential compliance divided by a factor."""
        model = copy(self)
        model._tangential = self._pair.reduced(factor)
        return model

    def solve_contact(
        self,
        gap: FloatArray,
        longitudinal_curvature: float,
        point: OperatingPoint,
        wear_compliance: FloatArray | None = None,
        warm: ContactSolution | None = None,
    ) -> ContactSolution:
        """Solve one contact; `warm` is not used.

        Raises
        ------
        ContactError
            If the curvature of the gap over the patch is not positive, the patch extends beyond
            the strips or covers too few of them, the fit does not converge, or a value is not
            finite.
        """
        if not np.isfinite(point.friction).all():  # a closed form would return zero traction
            raise power_not_finite(point, gap=gap)
        strips = self._theory_strips(gap, longitudinal_curvature, point)
        return complete(self.theory, strips, self._tangential, point)

    def fields(
        self,
        solution: ContactSolution,
        gap: FloatArray,
        longitudinal_curvature: float,
        point: OperatingPoint,
        points_along: int = 101,
    ) -> ContactFields:
        """Return pressure, traction and slip in a solved contact."""
        strips = self._theory_strips(gap, longitudinal_curvature, point)
        return self.theory.fields(
            strips,
            self._tangential,
            local_slip(strips, point, solution.longitudinal_creepage),
            self._friction(strips, point),
            point.rolling_speed,
            points_along,
        )

    def _friction(self, strips: Strips, point: OperatingPoint) -> FloatArray:
        """Return the friction coefficients of the fields."""
        return friction_per_strip(strips, point)

    def _theory_strips(
        self, gap: FloatArray, longitudinal_curvature: float, point: OperatingPoint
    ) -> Strips:
        """Return the strips of the patch in the form that the tangential theory supports."""
        strips = self._strips(gap, longitudinal_curvature, point)
        return strips if self.theory.knows_ellipses else strips.whole()

    def _strips(
        self, gap: FloatArray, longitudinal_curvature: float, point: OperatingPoint
    ) -> EllipseStrips:
        """Solve the normal problem and divide its patch into the strips of the grid."""
        gap = np.require(gap, np.float64, ["C", "W"])
        _check(gap, longitudinal_curvature, point.normal_force)
        if self.patch is None:
            patch, centre, height, iterations = self._fitted(
                gap, longitudinal_curvature, point.normal_force
            )
        else:
            patch, centre, height = self._prescribed(self.patch, gap, point.normal_force)
            iterations = 0
        y, spacing = self._grid.y, self._grid.spacing
        reach = (1.0 - 1e-9) * patch.b  # a grid of the width of the patch contains it
        first, last = float(y[0]) - 0.5 * spacing, float(y[-1]) + 0.5 * spacing
        if centre - reach < first or centre + reach > last:
            raise self._too_wide(centre, patch.b, {"gap": gap, "normal_force": point.normal_force})
        edges = np.append(y - 0.5 * spacing, last) - centre
        inner = np.clip(edges, -patch.b, patch.b)
        middle = 0.5 * (inner[1:] + inner[:-1])
        coverage = np.minimum(np.diff(inner) / spacing, 1.0)
        return EllipseStrips(
            y=y,
            half_length=np.where(coverage > 0.0, patch.half_length(middle), 0.0),
            line_load=np.diff(patch.load_below(edges)) / spacing,
            spacing=spacing,
            longitudinal_curvature=longitudinal_curvature,
            approach=patch.approach + height,
            peak_pressure=patch.peak_pressure,
            iterations=iterations,
            ellipse=patch,
            from_centre=middle,
            coverage=coverage,
        )

    def _fitted(
        self, gap: FloatArray, longitudinal_curvature: float, normal_force: float
    ) -> tuple[HertzContact, float, float, int]:
        """Return the converged patch, its centre, the fitted gap there and the iterations."""
        curvature, b, centre, height, iterations, status = parabola_fit.hertz_on_profile(
            self._grid.y,
            gap,
            0.5 * longitudinal_curvature,
            float(normal_force),
            self._pair.contact_modulus,
            TOLERANCE,
            LIMIT,
        )
        state = {
            "gap": gap,
            "normal_force": normal_force,
            "curvature": curvature,
            "half_width": b,
            "centre": centre,
            "iterations": iterations,
        }
        if status == parabola_fit.LEAVES_STRIPS:
            raise self._too_wide(centre, b, state)
        if status != parabola_fit.CONVERGED:
            raise _failure(status, state, self._grid.spacing)
        patch = hertz(
            0.5 * longitudinal_curvature, curvature, normal_force, self._pair.contact_modulus
        )
        return patch, centre, height, iterations

    def _prescribed(
        self, patch: Patch, gap: FloatArray, normal_force: float
    ) -> tuple[HertzContact, float, float]:
        """Return the prescribed patch, its centre and the fitted gap there."""
        curvature, centre, height, span, status = fit_within(
            self._grid.y, gap, self._grid.spacing, TOLERANCE
        )
        if status != parabola_fit.CONVERGED:
            state = {"gap": gap, "normal_force": normal_force, "half_width": span}
            raise _failure(status, state | {"curvature": curvature}, self._grid.spacing)
        ellipse = given_ellipse(patch.a, patch.b, normal_force, self._pair.contact_modulus)
        return ellipse, centre, height

    def _too_wide(self, centre: float, b: float, state: Mapping[str, Any]) -> ContactError:
        y, half = self._grid.y, 0.5 * self._grid.spacing
        return ContactError(
            f"the Hertz patch, {(centre - b) * 1e3:.4g} to {(centre + b) * 1e3:.4g} mm, extends"
            f" beyond its strips, which span {(y[0] - half) * 1e3:.4g} to"
            f" {(y[-1] + half) * 1e3:.4g} mm",
            dict(state),
            remedy="raise contact.width or move contact.centre",
            cause="edge",
        )


def _check(gap: FloatArray, longitudinal_curvature: float, normal_force: float) -> None:
    """Raise a ContactError unless gap, curvature along rolling and load can have a contact."""
    curvature = f"the relative curvature along rolling is {longitudinal_curvature:.4g} 1/m"
    for possible, text in (
        (np.isfinite(gap).all(), "the gap has a value that is not finite"),
        (
            0.0 < normal_force < math.inf,
            f"the contact is lost: its load is {normal_force:.4g} N; raise the load",
        ),
        (
            0.0 < longitudinal_curvature < math.inf,
            f"{curvature}, expected a positive value; check the radii",
        ),
    ):
        if not possible:
            raise ContactError(text, {"gap": gap, "normal_force": normal_force})


def _failure(status: int, state: Mapping[str, Any], spacing: float) -> ContactError:
    """Return the error of a patch that was not found."""
    width = 2e3 * state["half_width"]
    texts = {
        parabola_fit.NO_CURVATURE: f"the gap's fitted curvature over {width:.4g} mm is"
        f" {state['curvature']:.4g} 1/m, and Hertz needs it positive: no parabola approximates the"
        " worn profile; use contact.model = 'slender'",
        parabola_fit.TOO_FEW_STRIPS: f"the patch, {width:.4g} mm wide, covers fewer than three"
        f" strips of {spacing * 1e3:.4g} mm, too few to fit a parabola; raise contact.strips",
        parabola_fit.NOT_CONVERGED: "the patch and the parabola fitted over it did not converge in"
        f" {LIMIT} iterations; use contact.model = 'slender'",
    }
    return ContactError(texts[status], dict(state))


def strips_over_patch(
    options: Any,
    gap_curvature: float,
    longitudinal_curvature: float,
    normal_force: float,
    materials: tuple[Material, Material],
) -> Grid:
    """Return `options.my` strips over the width of the patch.

    Parameters
    ----------
    options : HertzOptions or HertzFastsimOptions
    gap_curvature, longitudinal_curvature : float
        Relative curvatures across and along rolling [1/m].
    normal_force : float
        Load [N].
    materials : tuple of Material
        Materials of the two bodies.
    """
    patch: Patch | HertzContact | None = getattr(options, "patch", None)
    if patch is None:
        modulus = combine(*materials).contact_modulus
        patch = hertz(0.5 * longitudinal_curvature, 0.5 * gap_curvature, normal_force, modulus)
    return Grid.spanning(-patch.b, patch.b, options.my)


SPEC = ContactModelSpec(
    name="hertz",
    factory=lambda options, grid, materials: HertzModel(
        tangential_theory(options), grid, materials
    ),
    suggest_grid=strips_over_patch,
    protocol=2,
    options=HertzOptions,
    capabilities=HertzModel.capabilities,
    summary="exact Hertz, fitted to the worn profile, with any tangential theory",
    references=("Johnson (1985), Contact Mechanics, DOI 10.1017/CBO9781139171731",),
)

"""The contact model `hertz-fastsim`: exact Hertz and Kalker's FASTSIM, as the paper has it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from pydantic import Field

from wearsim.errors import CapabilityError, ContactError
from wearsim.mechanics import hertz as kernels
from wearsim.mechanics.elasticity import ElasticPair, combine
from wearsim.mechanics.hertz import HertzContact, given_ellipse, hertz
from wearsim.mechanics.hertz_patches import fit_within
from wearsim.mechanics.kalker import CreepageCoefficients
from wearsim.models.fastsim_theory import (
    Bound,
    ClosedForm,
    Dissipation,
    EllipseStrips,
    FastsimTheory,
    Kalker,
)
from wearsim.models.hertz_fastsim_batch import HertzFastsimBatch
from wearsim.models.tangential import complete, friction_per_strip, local_slip
from wearsim.plugins import Capabilities, ContactModel, ContactModelSpec, Options
from wearsim.plugins.protocols import naming_contact
from wearsim.quantities import PositiveLength
from wearsim.types import (
    BatchSolution,
    ContactFields,
    ContactSolution,
    FloatArray,
    Grid,
    Material,
    OperatingPoint,
    OperatingPoints,
)

TOLERANCE = 1e-10
LIMIT = 200


class Patch(Options):
    """A prescribed contact ellipse."""

    a: PositiveLength = Field(description="half-length along rolling")
    b: PositiveLength = Field(description="half-length across rolling")


class KalkerCoefficients(Options):
    """Prescribed creepage coefficients."""

    c11: float = Field(gt=0.0, allow_inf_nan=False, description="longitudinal coefficient")
    c22: float = Field(gt=0.0, allow_inf_nan=False, description="lateral coefficient")
    c23: float = Field(gt=0.0, allow_inf_nan=False, description="coefficient of lateral and spin")


class HertzFastsimOptions(Options):
    """Options of the contact model `hertz-fastsim`."""

    mx: int = Field(50, ge=2, description="points along rolling in each strip")
    my: int = Field(50, ge=3, description="strips across the patch of a single contact")
    bound: Bound = Field(
        "parabolic", description="traction bound: parabolic (Kalker's) or elliptic (Hertz's)"
    )
    dissipation: Dissipation = Field(
        "rigid-slip",
        description="work of the rigid slip, or the textbook's element-sum (first order, low)",
    )
    closed_form: ClosedForm = Field(
        "exact",
        description="integrate instead of marching: exact (where there is no spin), always (with"
        " spin, its part along rolling left out: fast, 0.2 % rms in power) or never",
    )
    kalker: Kalker = Field(
        "table",
        description="creepage coefficients: Kalker's table, or line-limit (long contacts)",
    )
    kalker_coefficients: KalkerCoefficients | None = Field(
        None, description="creepage coefficients to use instead: c11, c22, c23"
    )
    patch: Patch | None = Field(
        None, description="contact ellipse to use instead of Hertz's: a, b; the load sets p0"
    )


class HertzFastsim(ContactModel):
    """Exact Hertz on the grid's strips, with FASTSIM for the tractions.

    On a worn profile the lateral curvature and the centre are those of the parabola fitted to the
    gap over the patch by least squares, weighted with ``1 - ((y - yc)/b)^2``; patch and fit are
    repeated until they agree to 1e-10. A prescribed patch is centred on the vertex of the parabola
    fitted in the same way to as much of the gap as lies evenly about that vertex.

    Parameters
    ----------
    options : HertzFastsimOptions, optional
        The options; their defaults where left out.
    """

    capabilities = Capabilities(
        creepage_variation=True,
        bearing_torque=True,
        local_friction=True,
        friction_field=True,
        fields=True,
    )

    def __init__(self, options: HertzFastsimOptions | None = None) -> None:
        self.options = options if options is not None else HertzFastsimOptions()
        given = self.options.kalker_coefficients
        self.theory = FastsimTheory(
            bound=self.options.bound,
            mx=self.options.mx,
            dissipation=self.options.dissipation,
            kalker=self.options.kalker,
            coefficients=None
            if given is None
            else CreepageCoefficients(given.c11, given.c22, given.c23, math.nan),
            closed_form=self.options.closed_form,
        )

    def prepare(self, grid: Grid, materials: tuple[Material, Material]) -> None:
        """Take the strips and the two bodies' materials."""
        self._grid = grid
        self._pair: ElasticPair = combine(*materials)
        patch = self.options.patch
        given = (0.0, 0.0) if patch is None else (patch.a, patch.b)
        self._batch = HertzFastsimBatch(grid, self._pair, self.theory, given, TOLERANCE, LIMIT)

    def suggest_grid(
        self,
        gap_curvature: float,
        longitudinal_curvature: float,
        normal_force: float,
        materials: tuple[Material, Material],
    ) -> Grid | None:
        """Return `my` strips that span the patch exactly."""
        if self.options.patch is not None:
            b = self.options.patch.b
        else:
            modulus = combine(*materials).contact_modulus
            b = hertz(0.5 * longitudinal_curvature, 0.5 * gap_curvature, normal_force, modulus).b
        return Grid.spanning(-b, b, self.options.my)

    def solve(
        self,
        gap: FloatArray,
        longitudinal_curvature: float,
        point: OperatingPoint,
        wear_compliance: FloatArray | None = None,
        warm: ContactSolution | None = None,
    ) -> ContactSolution:
        """Solve one contact; `warm` is of no use to it, so that a solution has one value only.

        Raises
        ------
        ContactError
            If the gap's curvature over the patch is not positive, the patch leaves the strips or
            holds too few of them, the fit does not settle, or a value is not finite.
        CapabilityError
            If a wear compliance is given, or a bearing torque where friction differs from point to
            point.
        """
        _refuse(wear_compliance)
        if np.ndim(point.friction) > 1 and point.bearing_torque is None:
            return self.solve_batch(gap[None, :], longitudinal_curvature, [point]).solutions[0]
        strips = self._strips(gap, longitudinal_curvature, point)
        solution = complete(self.theory, strips, self._pair, point)
        if not math.isfinite(solution.power):
            raise _not_finite(gap, point)
        return solution

    def solve_batch(
        self,
        gap: FloatArray,
        longitudinal_curvature: float,
        points: Sequence[OperatingPoint],
        wear_compliance: FloatArray | None = None,
        warm: Sequence[ContactSolution] | None = None,
    ) -> BatchSolution:
        """Solve many contacts in one call of compiled code, as `solve` does to round-off.

        Points under a bearing torque, or of several kinds, are solved one after another.

        Raises
        ------
        ContactError, CapabilityError
            As `solve`, naming the first contact that fails.
        """
        _refuse(wear_compliance)
        columns = OperatingPoints.of(points)
        if columns is None:
            return super().solve_batch(gap, longitudinal_curvature, points)
        batch, failed = self._batch.solve(gap, longitudinal_curvature, columns)
        if failed is not None:
            raise self._failure_of(failed, gap, longitudinal_curvature, points)
        return batch

    def friction_points(
        self, gap: FloatArray, longitudinal_curvature: float, point: OperatingPoint
    ) -> tuple[FloatArray, FloatArray]:
        """Return where friction is asked for: where each of the `mx` steps of the march ends."""
        x, y = self.friction_points_batch(gap[None, :], longitudinal_curvature, [point])
        return x[0], y

    def friction_points_batch(
        self, gap: FloatArray, longitudinal_curvature: float, points: Sequence[OperatingPoint]
    ) -> tuple[FloatArray, FloatArray]:
        """Return `friction_points` of every contact, x of shape (contacts, mx, strips)."""
        if isinstance(points, OperatingPoints):
            forces = points.normal_force
        else:
            forces = np.array([point.normal_force for point in points])
        half_length, failed = self._batch.half_lengths(gap, longitudinal_curvature, forces)
        if failed is not None:
            raise self._failure_of(failed, gap, longitudinal_curvature, points)
        places = np.linspace(1.0, -1.0, self.options.mx + 1)[1:, None]
        return places * half_length[:, None, :], self._grid.y

    def _failure_of(
        self,
        number: int,
        gap: FloatArray,
        longitudinal_curvature: float,
        points: Sequence[OperatingPoint],
    ) -> ContactError:
        """Return the error of a contact of a batch that failed."""
        shape = gap.shape[:-1]
        own, point = gap[np.unravel_index(number, shape)], points[number]
        try:
            strips = self._strips(own, longitudinal_curvature, point)
            self.theory.flexibilities(strips, self._pair)
            error = _not_finite(own, point)
        except ContactError as caught:
            error = caught
        return naming_contact(error, number, shape)

    def fields(
        self,
        solution: ContactSolution,
        gap: FloatArray,
        longitudinal_curvature: float,
        point: OperatingPoint,
        points_along: int = 101,
    ) -> ContactFields:
        """Return tractions and slip inside a solved contact."""
        strips = self._strips(gap, longitudinal_curvature, point)
        slip = local_slip(strips, point, solution.longitudinal_creepage)
        if np.ndim(point.friction) > 1:
            if point.friction_carried:
                raise CapabilityError(
                    "friction that particles carry through the contact has no one field inside it;"
                    " give friction that stays in the contact (frame = 'contact')"
                )
            friction = np.asarray(point.friction)
        else:
            friction = friction_per_strip(strips, point)
        return self.theory.fields(
            strips, self._pair, slip, friction, point.rolling_speed, points_along
        )

    def _strips(
        self, gap: FloatArray, longitudinal_curvature: float, point: OperatingPoint
    ) -> EllipseStrips:
        """Solve the normal problem and cut its patch into the grid's strips."""
        gap = np.require(gap, np.float64, ["C", "W"])
        _check(gap, longitudinal_curvature, point.normal_force)
        if self.options.patch is None:
            patch, centre, height, iterations = self._fitted(
                gap, longitudinal_curvature, point.normal_force
            )
        else:
            patch, centre, height = self._prescribed(self.options.patch, gap, point.normal_force)
            iterations = 0
        y, spacing = self._grid.y, self._grid.spacing
        reach = (1.0 - 1e-9) * patch.b  # a grid cut to the patch holds it
        first, last = float(y[0]) - 0.5 * spacing, float(y[-1]) + 0.5 * spacing
        if centre - reach < first or centre + reach > last:
            raise self._leaves(centre, patch.b, {"gap": gap, "normal_force": point.normal_force})
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
        """Return the patch that its own fit makes, its centre, the gap there and the iterations."""
        y = self._grid.y
        curvature, b, centre, height, iterations, status = kernels.hertz_on_profile(
            y,
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
        if status == kernels.LEAVES_STRIPS:
            raise self._leaves(centre, b, state)
        if status != kernels.CONVERGED:
            raise _failure(status, state, self._grid.spacing)
        modulus = self._pair.contact_modulus
        patch = hertz(0.5 * longitudinal_curvature, curvature, normal_force, modulus)
        return patch, centre, height, iterations

    def _prescribed(
        self, patch: Patch, gap: FloatArray, normal_force: float
    ) -> tuple[HertzContact, float, float]:
        """Return the prescribed patch, its centre and the fitted gap there."""
        curvature, centre, height, span, status = fit_within(
            self._grid.y, gap, self._grid.spacing, TOLERANCE
        )
        if status != kernels.CONVERGED:
            state = {"gap": gap, "normal_force": normal_force, "half_width": span}
            raise _failure(status, state | {"curvature": curvature}, self._grid.spacing)
        ellipse = given_ellipse(patch.a, patch.b, normal_force, self._pair.contact_modulus)
        return ellipse, centre, height

    def _leaves(self, centre: float, b: float, state: Mapping[str, Any]) -> ContactError:
        y, half = self._grid.y, 0.5 * self._grid.spacing
        return ContactError(
            f"the Hertz patch, {(centre - b) * 1e3:.4g} to {(centre + b) * 1e3:.4g} mm, leaves its"
            f" strips, which span {(y[0] - half) * 1e3:.4g} to {(y[-1] + half) * 1e3:.4g} mm;"
            " raise contact.width or move contact.centre",
            dict(state),
        )


def _refuse(wear_compliance: FloatArray | None) -> None:
    if wear_compliance is not None:
        raise CapabilityError(
            "hertz-fastsim takes no wear compliance; use evolution.stepper = 'explicit' or"
            " 'per-pass', or contact.model = 'slender'"
        )


def _not_finite(gap: FloatArray, point: OperatingPoint) -> ContactError:
    return ContactError(
        "the dissipated power is not finite; check creepage, friction and rolling speed",
        {"gap": gap, "point": point},
    )


def _check(gap: FloatArray, longitudinal_curvature: float, normal_force: float) -> None:
    state = {"gap": gap, "normal_force": normal_force}
    if not np.isfinite(gap).all():
        raise ContactError("the gap holds a value that is not finite", state)
    if not (normal_force > 0.0 and math.isfinite(normal_force)):
        raise ContactError(
            f"the contact is lost: its load is {normal_force:.4g} N; raise the load", state
        )
    if not (longitudinal_curvature > 0.0 and math.isfinite(longitudinal_curvature)):
        raise ContactError(
            f"the relative curvature along rolling is {longitudinal_curvature:.4g} 1/m and must be"
            " positive; check the radii",
            state,
        )


def _failure(status: int, state: Mapping[str, Any], spacing: float) -> ContactError:
    width = 2e3 * state["half_width"]
    if status == kernels.NO_CURVATURE:
        text = (
            f"the gap's fitted curvature over {width:.4g} mm is {state['curvature']:.4g} 1/m, and"
            " Hertz needs it positive: the profile is worn past what one parabola can stand for;"
            " use contact.model = 'slender'"
        )
    elif status == kernels.TOO_FEW_STRIPS:
        text = (
            f"the patch, {width:.4g} mm wide, holds fewer than three strips of"
            f" {spacing * 1e3:.4g} mm, and no parabola can be fitted; raise contact.strips"
        )
    else:
        text = (
            f"the patch and the parabola fitted over it did not agree after {LIMIT} tries;"
            " use contact.model = 'slender'"
        )
    return ContactError(text, dict(state))


SPEC = ContactModelSpec(
    name="hertz-fastsim",
    factory=HertzFastsim,
    options=HertzFastsimOptions,
    capabilities=HertzFastsim.capabilities,
    summary="exact Hertz and Kalker's FASTSIM, refitted as the profile wears: the paper's model",
    references=(
        "Kalker (1982), FASTSIM, Vehicle System Dynamics 11, DOI 10.1080/00423118208968684",
        "Kalker (1990), Three-Dimensional Elastic Bodies, DOI 10.1007/978-94-015-7889-9",
        "Johnson (1985), Contact Mechanics, DOI 10.1017/CBO9781139171731",
    ),
)

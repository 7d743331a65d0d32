"""The contact model `hertz-fastsim`: exact Hertz and Kalker's FASTSIM, as the paper has it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import ClassVar

import numpy as np
from pydantic import Field

from wearsim.contact_batch import BatchSolution, OperatingPoints
from wearsim.errors import CapabilityError, ContactError
from wearsim.mechanics.tangential.kalker_coefficients import CreepageCoefficients
from wearsim.models.contact.hertz import LIMIT, TOLERANCE, HertzModel, Patch
from wearsim.models.contact.hertz_fastsim_batch import HertzFastsimBatch
from wearsim.models.tangential.base import Strips, power_not_finite
from wearsim.models.tangential.fastsim import (
    Bound,
    ClosedForm,
    Dissipation,
    FastsimTheory,
    Flexibility,
    Kalker,
)
from wearsim.plugins import Capabilities, ContactModelSpec, Options
from wearsim.plugins.contact_model import naming_contact
from wearsim.types import ContactSolution, FloatArray, Grid, Material, OperatingPoint


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
    flexibility: Flexibility = Field(
        "three", description="flexibilities: Kalker's three, or one weighted by the creepages"
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


class HertzFastsim(HertzModel):
    """Exact Hertz on the grid's strips, with FASTSIM for the tractions.

    Parameters
    ----------
    options : HertzFastsimOptions, optional
        The options; their defaults where left out.
    """

    name: ClassVar[str] = "hertz-fastsim"
    capabilities = Capabilities(
        creepage_variation=True,
        bearing_torque=True,
        local_friction=True,
        friction_field=True,
        fields=True,
    )
    theory: FastsimTheory

    def __init__(self, options: HertzFastsimOptions | None = None) -> None:
        self.options = options if options is not None else HertzFastsimOptions()
        given = self.options.kalker_coefficients
        theory = FastsimTheory(
            bound=self.options.bound,
            mx=self.options.mx,
            dissipation=self.options.dissipation,
            kalker=self.options.kalker,
            coefficients=None
            if given is None
            else CreepageCoefficients(given.c11, given.c22, given.c23, math.nan),
            closed_form=self.options.closed_form,
            flexibility=self.options.flexibility,
        )
        super().__init__(theory, self.options.my, self.options.patch)

    def prepare(self, grid: Grid, materials: tuple[Material, Material]) -> None:
        """Take the strips and the two bodies' materials."""
        super().prepare(grid, materials)
        given = (0.0, 0.0) if self.patch is None else (self.patch.a, self.patch.b)
        self._batch = HertzFastsimBatch(grid, self._pair, self.theory, given, TOLERANCE, LIMIT)

    def solve(
        self,
        gap: FloatArray,
        longitudinal_curvature: float,
        point: OperatingPoint,
        wear_compliance: FloatArray | None = None,
        warm: ContactSolution | None = None,
    ) -> ContactSolution:
        """Solve one contact as `HertzModel` does, or under friction that differs within it.

        Raises
        ------
        ContactError
            As `HertzModel.solve`.
        CapabilityError
            If a wear compliance is given, or a bearing torque where friction differs from point to
            point.
        """
        if np.ndim(point.friction) > 1 and point.bearing_torque is None:
            self._refuse(wear_compliance)
            if not np.isfinite(point.friction).all():
                raise power_not_finite(point, gap=gap)
            return self.solve_batch(gap[None, :], longitudinal_curvature, [point]).solutions[0]
        return super().solve(gap, longitudinal_curvature, point, wear_compliance, warm)

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
        self._refuse(wear_compliance)
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
            error = power_not_finite(point, gap=own)
        except ContactError as caught:
            error = caught
        return naming_contact(error, number, shape)

    def _friction(self, strips: Strips, point: OperatingPoint) -> FloatArray:
        """Return friction as the fields take it, per strip or per point of the march."""
        if np.ndim(point.friction) <= 1:
            return super()._friction(strips, point)
        if point.friction_carried:
            raise CapabilityError(
                "friction that particles carry through the contact has no one field inside it;"
                " give friction that stays in the contact (frame = 'contact')"
            )
        return np.asarray(point.friction)


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

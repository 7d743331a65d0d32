"""The contact model `hertz-fastsim`: exact Hertz and Kalker's FASTSIM, the model of the paper."""

from __future__ import annotations

import math
from typing import Self

import numpy as np
from pydantic import Field

from wearsim.contact_batch import ContactBatch, ContactBatchSolution
from wearsim.errors import CapabilityError, ContactError
from wearsim.mechanics.hertz.parabola_fit import CONVERGED
from wearsim.mechanics.hertz.patches import Bodies, Patches, find_patches, half_lengths
from wearsim.mechanics.tangential.hertz_fastsim_batch import (
    ContactInputs,
    ContactResults,
    solve_contacts,
)
from wearsim.mechanics.tangential.kalker_coefficients import CreepageCoefficients
from wearsim.models.contact.hertz import LIMIT, TOLERANCE, HertzModel, Patch, strips_over_patch
from wearsim.models.tangential.base import Strips, power_not_finite
from wearsim.models.tangential.fastsim import (
    Bound,
    ClosedForm,
    Dissipation,
    FastsimTheory,
    Flexibility,
    Kalker,
)
from wearsim.models.tangential.torque_balance import with_balanced_creepage
from wearsim.plugins import (
    Capabilities,
    ContactModelSpec,
    Options,
    SharedWear,
    refuse_unclaimed,
)
from wearsim.plugins.contact_model import naming_contact
from wearsim.types import ContactSolution, FloatArray, Grid, IntArray, Material, OperatingPoint


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
        description="integrate in closed form instead of marching: exact (without spin), always"
        " (neglects the lateral slip of spin along rolling: fast, 0.2 % rms in power) or never",
    )
    flexibility: Flexibility = Field(
        "three", description="flexibilities: Kalker's three, or one weighted by the creepages"
    )
    kalker: Kalker = Field(
        "table",
        description="creepage coefficients: Kalker's table, or line-limit (long contacts)",
    )
    kalker_coefficients: KalkerCoefficients | None = Field(
        None, description="prescribed creepage coefficients instead: c11, c22, c23"
    )
    patch: Patch | None = Field(
        None, description="prescribed contact ellipse instead of Hertz's: a, b; p0 from the load"
    )


class HertzFastsim(HertzModel):
    """Exact Hertzian contact on the strips of a grid, with FASTSIM for the tractions.

    Parameters
    ----------
    options : HertzFastsimOptions
    grid : Grid
        The strips.
    materials : tuple of Material
        Materials of cylinder and roller.
    """

    capabilities = Capabilities(
        creepage_variation=True,
        bearing_torque=True,
        local_friction=True,
        friction_field=True,
        creep_factor=True,
        fields=True,
    )
    theory: FastsimTheory

    def __init__(
        self, options: HertzFastsimOptions, grid: Grid, materials: tuple[Material, Material]
    ) -> None:
        coefficients = options.kalker_coefficients
        theory = FastsimTheory(
            bound=options.bound,
            mx=options.mx,
            kalker=options.kalker,
            coefficients=None
            if coefficients is None
            else CreepageCoefficients(
                coefficients.c11, coefficients.c22, coefficients.c23, math.nan
            ),
            flexibility=options.flexibility,
        )
        super().__init__(theory, grid, materials, options.patch)
        self._integrals = options.dissipation, options.closed_form
        self._compiled = theory.compiled(self._pair, *self._integrals)

    def with_creep_factor(self, factor: float) -> Self:
        """Return the model with Kalker's flexibilities divided by a factor."""
        model = super().with_creep_factor(factor)
        model._compiled = model.theory.compiled(model._tangential, *model._integrals)
        return model

    def solve_contact(
        self,
        gap: FloatArray,
        longitudinal_curvature: float,
        point: OperatingPoint,
        wear_compliance: FloatArray | None = None,
        warm: ContactSolution | None = None,
    ) -> ContactSolution:
        """Solve one contact as a batch of one."""
        return self.solve_one(gap, longitudinal_curvature, point, wear_compliance, warm)

    def solve(
        self,
        batch: ContactBatch,
        wear_compliance: FloatArray | None = None,
        coupling: SharedWear | None = None,
        warm: ContactBatchSolution | None = None,
    ) -> ContactBatchSolution:
        """Solve the contacts in one call of compiled code; `warm` guesses creepages.

        Raises
        ------
        ContactError
            As `HertzModel.solve_contact`, with the place of the first contact that fails; or if
            friction cannot transmit the torque of a free roller.
        CapabilityError
            If a wear compliance is given.
        """
        refuse_unclaimed(self, batch, wear_compliance, coupling)
        self._check_shapes(batch)
        if batch.bearing_torque is not None:
            _, normal = self._solved(batch)  # line loads do not depend on the creepage
            batch = with_balanced_creepage(
                batch,
                normal.line_load,
                normal.half_length,
                self._grid,
                self._tangential,
                warm,
                lambda trial: self._solved(trial)[1].torque,
            )
        patches, results = self._solved(batch)
        return ContactBatchSolution(
            y=_column(self._grid.y),
            **{name: column for name, column in results._asdict().items() if name != "torque"},
            approach=patches.approach,
            peak_pressure=patches.peak_pressure,
            longitudinal_creepage=np.array(batch.longitudinal, dtype=np.float64),
            iterations=patches.iterations,
        )

    def _solved(self, batch: ContactBatch) -> tuple[Patches, ContactResults]:
        """Return patches and tractions of the contacts, and the torques on free rollers."""
        strips = self._grid.strips
        gaps, row = _distinct_gaps(batch.gap)
        patches, contacts = _new_patches(len(row)), len(row)
        results = ContactResults(*np.zeros((3, contacts, strips)), *np.zeros((6, contacts)))
        # axes without variation have the length 1
        rank, radius = batch.friction.ndim, batch.rolling_radius
        shape = {1: (contacts, 1, 1), 2: (contacts, 1, strips)}.get(rank, batch.friction.shape)
        # by a closed form, friction that is not a number would give no traction
        known = np.isfinite(batch.friction).reshape(contacts, -1).all(axis=1)
        inputs = ContactInputs(
            np.where(known, _usable_loads(batch), math.nan),
            _column(batch.longitudinal),
            _column(batch.lateral),
            _column(batch.spin),
            _column(batch.friction).reshape(shape),
            batch.friction_carried,
            np.zeros((0, strips)) if batch.variation is None else _column(batch.variation),
            _column(batch.rolling_speed),
            np.zeros((0, strips)) if radius is None else _column(radius),
        )
        first_failed = solve_contacts(
            self._bodies(batch), self._compiled, gaps, row, inputs, patches, results
        )
        if first_failed < contacts:
            raise self._error_of(first_failed, batch)
        return patches, results

    def friction_points(self, batch: ContactBatch) -> tuple[FloatArray, FloatArray]:
        """Return the points of the friction coefficients: the ends of the `mx` steps."""
        gaps, row = _distinct_gaps(batch.gap)
        bodies, patches = self._bodies(batch), _new_patches(len(row))
        loads = _usable_loads(batch)
        find_patches(bodies, gaps, row, loads, patches)
        if (patches.status != CONVERGED).any():
            raise self._error_of(int(np.argmax(patches.status != CONVERGED)), batch)
        places = np.linspace(1.0, -1.0, self.theory.mx + 1)[1:, None]
        return places * half_lengths(bodies, patches, loads)[:, None, :], self._grid.y

    def _error_of(self, number: int, batch: ContactBatch) -> ContactError:
        """Return the error of a contact of a batch that failed."""
        gap, point = batch.gap[number], batch.point(number)
        try:
            strips = self._strips(gap, float(batch.longitudinal_curvature[number]), point)
            self.theory.flexibilities(strips, self._tangential)
            error = power_not_finite(point, gap=gap)
        except ContactError as caught:
            error = caught
        return naming_contact(error, number, batch)

    def _friction(self, strips: Strips, point: OperatingPoint) -> FloatArray:
        """Return the friction coefficients of the fields, per strip or per point."""
        if np.ndim(point.friction) <= 1:
            return super()._friction(strips, point)
        if point.friction_carried:
            raise CapabilityError(
                "friction that is carried through the contact has no stationary field inside it;"
                " give friction that is fixed to the contact (frame = 'contact')"
            )
        return np.asarray(point.friction)

    def _bodies(self, batch: ContactBatch) -> Bodies:
        return Bodies(
            _column(self._grid.y),
            float(self._grid.spacing),
            _column(0.5 * batch.longitudinal_curvature),
            self._pair.contact_modulus,
            *((0.0, 0.0) if self.patch is None else (self.patch.a, self.patch.b)),
            TOLERANCE,
            LIMIT,
        )

    def _check_shapes(self, batch: ContactBatch) -> None:
        strips, shape = self._grid.strips, batch.friction.shape[1:]
        if shape not in {(), (strips,), (self.theory.mx, strips)}:
            raise ValueError(
                f"friction has the shape {shape} per contact, expected (), (strips,) = "
                f"({strips},) or (mx, strips) = ({self.theory.mx}, {strips}); take it at"
                " `friction_points`"
            )
        if batch.variation is not None and batch.variation.shape[1:] != (strips,):
            raise ValueError(
                f"the creepage varies over {batch.variation.shape[1:]} strips, expected {strips}"
            )


def _usable_loads(batch: ContactBatch) -> FloatArray:
    """Return the loads, NaN where the curvature along rolling is not positive and finite."""
    curvature = batch.longitudinal_curvature
    return np.where((curvature > 0.0) & np.isfinite(curvature), batch.normal_force, math.nan)


def _column(values: FloatArray) -> FloatArray:
    """Return the values contiguous and writeable, so that kernels are compiled only once."""
    return np.require(values, np.float64, ["C", "W"])


def _new_patches(contacts: int) -> Patches:
    return Patches(*np.zeros((6, contacts)), *np.zeros((2, contacts), dtype=np.int64))


def _distinct_gaps(gap: FloatArray) -> tuple[FloatArray, IntArray]:
    """Return the distinct gaps, (rows, strips), and the row of each contact."""
    if gap.strides[0] == 0:  # all are the same
        return _column(gap[:1]), np.zeros(len(gap), dtype=np.int64)
    return _column(gap), np.arange(len(gap))


SPEC = ContactModelSpec(
    name="hertz-fastsim",
    factory=HertzFastsim,
    suggest_grid=strips_over_patch,
    protocol=2,
    options=HertzFastsimOptions,
    capabilities=HertzFastsim.capabilities,
    summary="exact Hertz and Kalker's FASTSIM, fitted to the worn profile: the paper's model",
    references=(
        "Kalker (1982), FASTSIM, Vehicle System Dynamics 11, DOI 10.1080/00423118208968684",
        "Kalker (1990), Three-Dimensional Elastic Bodies, DOI 10.1007/978-94-015-7889-9",
        "Johnson (1985), Contact Mechanics, DOI 10.1017/CBO9781139171731",
    ),
)

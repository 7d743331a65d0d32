"""The contact model `hertz-fastsim`: exact Hertz and Kalker's FASTSIM, the model of the paper."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import ClassVar

import numpy as np
from pydantic import Field

from wearsim.contact_batch import BatchSolution, OperatingPoints
from wearsim.errors import CapabilityError, ContactError
from wearsim.mechanics.hertz.parabola_fit import CONVERGED
from wearsim.mechanics.hertz.patches import Bodies, Patches, find_patches, half_lengths
from wearsim.mechanics.tangential.hertz_fastsim_batch import (
    ContactInputs,
    ContactResults,
    solve_contacts,
)
from wearsim.mechanics.tangential.kalker_coefficients import CreepageCoefficients
from wearsim.models.contact.hertz import LIMIT, TOLERANCE, HertzModel, Patch
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
    options : HertzFastsimOptions, optional
        The options; by default their defaults.
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
        """Set the strips and the materials of both bodies."""
        super().prepare(grid, materials)
        self._compiled = self.theory.compiled(self._pair)

    def solve(
        self,
        gap: FloatArray,
        longitudinal_curvature: float,
        point: OperatingPoint,
        wear_compliance: FloatArray | None = None,
        warm: ContactSolution | None = None,
    ) -> ContactSolution:
        """Solve one contact; friction may vary from point to point.

        Raises
        ------
        ContactError
            As `HertzModel.solve`.
        CapabilityError
            If a wear compliance is given, or a bearing torque with friction that varies from point
            to point.
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
        """Solve many contacts in one call of compiled code; equal to `solve` up to round-off.

        Points with a bearing torque, or of different kinds, are solved one after another.

        Raises
        ------
        ContactError, CapabilityError
            As `solve`, with the position of the first contact that fails.
        """
        self._refuse(wear_compliance)
        columns = OperatingPoints.of(points)
        if columns is None:
            return super().solve_batch(gap, longitudinal_curvature, points)
        shape, strips = gap.shape[:-1], self._grid.strips
        gaps, row = _distinct_gaps(gap)
        forces = _usable_loads(columns.normal_force, longitudinal_curvature)
        self._check_shapes(len(row), columns)
        patches = _new_patches(len(row))
        results = ContactResults(*np.zeros((3, len(row), strips)), *np.zeros((5, len(row))))
        inputs = ContactInputs(
            forces,
            _column(columns.longitudinal),
            _column(columns.lateral),
            _column(columns.spin),
            self._friction_array(columns.friction),
            columns.friction_carried,
            np.zeros((0, strips)) if columns.variation is None else _column(columns.variation),
            float(columns.rolling_speed),
        )
        bodies = self._bodies(longitudinal_curvature)
        first_failed = solve_contacts(bodies, self._compiled, gaps, row, inputs, patches, results)
        if first_failed < len(row):
            raise self._error_of(first_failed, gap, longitudinal_curvature, points)
        fields = results._asdict() | {
            "approach": patches.approach,
            "peak_pressure": patches.peak_pressure,
            "longitudinal_creepage": np.array(columns.longitudinal, dtype=np.float64),
            "iterations": patches.iterations,
        }
        shaped = {name: value.reshape(shape + value.shape[1:]) for name, value in fields.items()}
        return BatchSolution(shape, bodies.y, shaped)

    def friction_points(
        self, gap: FloatArray, longitudinal_curvature: float, point: OperatingPoint
    ) -> tuple[FloatArray, FloatArray]:
        """Return the points of the friction coefficients: the ends of the `mx` steps."""
        x, y = self.friction_points_batch(gap[None, :], longitudinal_curvature, [point])
        return x[0], y

    def friction_points_batch(
        self, gap: FloatArray, longitudinal_curvature: float, points: Sequence[OperatingPoint]
    ) -> tuple[FloatArray, FloatArray]:
        """Return `friction_points` of all contacts, x of shape (contacts, mx, strips)."""
        forces = (
            points.normal_force
            if isinstance(points, OperatingPoints)
            else np.array([point.normal_force for point in points])
        )
        gaps, row = _distinct_gaps(gap)
        bodies, patches = self._bodies(longitudinal_curvature), _new_patches(len(row))
        loads = _usable_loads(forces, longitudinal_curvature)
        find_patches(bodies, gaps, row, loads, patches)
        if (patches.status != CONVERGED).any():
            failed = int(np.argmax(patches.status != CONVERGED))
            raise self._error_of(failed, gap, longitudinal_curvature, points)
        places = np.linspace(1.0, -1.0, self.options.mx + 1)[1:, None]
        return places * half_lengths(bodies, patches, loads)[:, None, :], self._grid.y

    def _error_of(
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
        """Return the friction coefficients of the fields, per strip or per point."""
        if np.ndim(point.friction) <= 1:
            return super()._friction(strips, point)
        if point.friction_carried:
            raise CapabilityError(
                "friction that is carried through the contact has no stationary field inside it;"
                " give friction that is fixed to the contact (frame = 'contact')"
            )
        return np.asarray(point.friction)

    def _bodies(self, longitudinal_curvature: float) -> Bodies:
        return Bodies(
            _column(self._grid.y),
            float(self._grid.spacing),
            0.5 * float(longitudinal_curvature),
            self._pair.contact_modulus,
            *((0.0, 0.0) if self.patch is None else (self.patch.a, self.patch.b)),
            TOLERANCE,
            LIMIT,
        )

    def _friction_array(self, friction: FloatArray) -> FloatArray:
        """Return friction as (contacts, points, strips), axes without variation of length 1."""
        contacts = len(friction)
        shape = {1: (contacts, 1, 1), 2: (contacts, 1, self._grid.strips)}
        return _column(friction).reshape(shape.get(friction.ndim, friction.shape))

    def _check_shapes(self, contacts: int, points: OperatingPoints) -> None:
        if len(points) != contacts:
            raise ValueError(f"{len(points)} operating points for a batch of {contacts} contacts")
        strips, given = self._grid.strips, points.friction.shape[1:]
        if given not in {(), (strips,), (self.theory.mx, strips)}:
            raise ValueError(
                f"friction has the shape {given} per contact, expected (), (strips,) = "
                f"({strips},) or (mx, strips) = ({self.theory.mx}, {strips}); take it at"
                " `friction_points`"
            )
        if points.variation is not None and points.variation.shape[1:] != (strips,):
            raise ValueError(
                f"the creepage varies over {points.variation.shape[1:]} strips, expected {strips}"
            )


def _usable_loads(forces: FloatArray, curvature: float) -> FloatArray:
    """Return the loads, or NaN if the curvature along rolling is not positive and finite."""
    usable = curvature > 0.0 and math.isfinite(curvature)
    return _column(forces if usable else np.full(len(forces), math.nan))


def _column(values: FloatArray) -> FloatArray:
    """Return the values contiguous and writeable, so that kernels are compiled only once."""
    return np.require(values, np.float64, ["C", "W"])


def _new_patches(contacts: int) -> Patches:
    return Patches(*np.zeros((6, contacts)), *np.zeros((2, contacts), dtype=np.int64))


def _distinct_gaps(gap: FloatArray) -> tuple[FloatArray, IntArray]:
    """Return the distinct gaps, (rows, strips), and the row of each contact.

    An axis of stride 0 repeats one gap, which is not copied.
    """
    shape = gap.shape[:-1]
    own = gap[tuple(slice(0, 1) if step == 0 else slice(None) for step in gap.strides[:-1])]
    rows = np.arange(math.prod(own.shape[:-1])).reshape(own.shape[:-1])
    return _column(own).reshape(-1, gap.shape[-1]), np.broadcast_to(rows, shape).flatten()


SPEC = ContactModelSpec(
    name="hertz-fastsim",
    factory=HertzFastsim,
    options=HertzFastsimOptions,
    capabilities=HertzFastsim.capabilities,
    summary="exact Hertz and Kalker's FASTSIM, fitted to the worn profile: the paper's model",
    references=(
        "Kalker (1982), FASTSIM, Vehicle System Dynamics 11, DOI 10.1080/00423118208968684",
        "Kalker (1990), Three-Dimensional Elastic Bodies, DOI 10.1007/978-94-015-7889-9",
        "Johnson (1985), Contact Mechanics, DOI 10.1017/CBO9781139171731",
    ),
)

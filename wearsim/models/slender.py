"""The contact model `slender`: line-contact strips on any gap profile, any tangential theory."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from wearsim.errors import ContactError
from wearsim.mechanics import slender as kernels
from wearsim.mechanics.elasticity import ElasticPair, combine
from wearsim.mechanics.hertz import hertz
from wearsim.mechanics.influence import HIGHEST, influence_table
from wearsim.mechanics.strip import SUMS, strip_contacts
from wearsim.models.strip_theory import StripTheory
from wearsim.models.tangential import (
    Strips,
    TangentialTheory,
    complete,
    friction_per_strip,
    local_slip,
)
from wearsim.models.tangential_options import TangentialOptions, tangential_theory
from wearsim.plugins import (
    Capabilities,
    ContactModel,
    ContactModelSpec,
    PassLoop,
    SharedWear,
)
from wearsim.plugins.protocols import naming_contact
from wearsim.plugins.shared_wear import NO_BODY
from wearsim.types import (
    BatchSolution,
    ContactFields,
    ContactSolution,
    FloatArray,
    Grid,
    IntArray,
    Material,
    OperatingPoint,
    OperatingPoints,
)

_REMEDY = {
    kernels.SINGULAR: "its equations are singular: are the gap, the load and the materials sound?",
    kernels.TOO_FINE: (
        f"a half-length exceeds {np.exp(HIGHEST):.0f} strip widths: lower contact.strips"
    ),
    kernels.NO_CONVERGENCE: "Newton's method did not settle on the strips in contact",
    kernels.NOT_FINITE: "a value is not finite",
}


class SlenderOptions(TangentialOptions):
    """Options of the contact model `slender`."""


class Slender(ContactModel):
    """Strips pressed together as lines (Kalker 1972), on any profile, with any wear compliance."""

    capabilities = Capabilities(
        wear_compliance=True,
        coupled=True,
        creepage_variation=True,
        bearing_torque=True,
        local_friction=True,
        pass_loop=True,
        fields=True,
    )

    def __init__(self, theory: TangentialTheory) -> None:
        self.theory = theory
        if not isinstance(theory, StripTheory):
            self.capabilities = replace(self.capabilities, pass_loop=False)

    def prepare(self, grid: Grid, materials: tuple[Material, Material]) -> None:
        """Tabulate the influence of one strip on another."""
        self._grid = grid
        self._pair: ElasticPair = combine(*materials)
        self._table = influence_table(grid.strips)

    def suggest_grid(
        self,
        gap_curvature: float,
        longitudinal_curvature: float,
        normal_force: float,
        materials: tuple[Material, Material],
    ) -> Grid | None:
        """Return 121 strips over 1.2 times the width of the Hertzian patch."""
        modulus = combine(*materials).contact_modulus
        patch = hertz(0.5 * longitudinal_curvature, 0.5 * gap_curvature, normal_force, modulus)
        return Grid.spanning(-1.2 * patch.b, 1.2 * patch.b, 121)

    def solve(
        self,
        gap: FloatArray,
        longitudinal_curvature: float,
        point: OperatingPoint,
        wear_compliance: FloatArray | None = None,
        warm: ContactSolution | None = None,
    ) -> ContactSolution:
        """Solve one contact."""
        compliance = np.zeros_like(gap) if wear_compliance is None else wear_compliance
        return self.solve_coupled(
            gap[None, :],
            longitudinal_curvature,
            [point],
            SharedWear.of_one(compliance),
            None if warm is None else [warm],
        )[0]

    def solve_coupled(
        self,
        gap: FloatArray,
        longitudinal_curvature: float,
        points: Sequence[OperatingPoint],
        wear: SharedWear,
        warm: Sequence[ContactSolution] | None = None,
    ) -> list[ContactSolution]:
        """Solve several contacts that wear a profile they share, all at once."""
        line_load = np.zeros(gap.shape)
        approach = np.zeros(len(points))
        if warm is not None:
            line_load[:] = [solution.line_load for solution in warm]
            approach[:] = [solution.approach for solution in warm]
        columns = self._columns(points)
        if columns is not None:
            loads = _own(columns.normal_force)
        else:
            loads = np.array([point.normal_force for point in points])
        iterations = self._solve_normal(
            _own(gap), wear.reduced, loads, longitudinal_curvature, line_load, approach
        )
        if columns is not None:
            count = np.full(len(loads), iterations, dtype=np.int64)
            shape = (len(loads),)
            found = self._completed(
                line_load, approach, count, longitudinal_curvature, columns, shape
            )
            return list(found.solutions)
        return [
            self._complete(line_load[k], approach[k], iterations, longitudinal_curvature, point)
            for k, point in enumerate(points)
        ]

    def _solve_normal(
        self,
        gap: FloatArray,
        wear: tuple[FloatArray, IntArray, FloatArray],
        loads: FloatArray,
        longitudinal_curvature: float,
        line_load: FloatArray,
        approach: FloatArray,
    ) -> int:
        """Solve normal contacts in place from what they start with; return the iterations."""
        arguments = (
            gap,
            *wear,
            loads,
            self._grid.spacing,
            self._pair.contact_modulus,
            longitudinal_curvature,
            self._table,
        )
        started = bool(line_load.any())
        status, iterations = kernels.solve_slender(*arguments, line_load, approach)
        if status != kernels.CONVERGED and started:
            # a start from far away can mislead Newton; the foundation's guess is always near
            line_load[:] = 0.0
            status, iterations = kernels.solve_slender(*arguments, line_load, approach)
        self._check(status, gap, loads, line_load, approach)
        return int(iterations)

    def solve_batch(
        self,
        gap: FloatArray,
        longitudinal_curvature: float,
        points: Sequence[OperatingPoint],
        wear_compliance: FloatArray | None = None,
        warm: Sequence[ContactSolution] | None = None,
    ) -> BatchSolution:
        """Solve many independent contacts, in one call where strip theory takes them."""
        columns = self._columns(points)
        if columns is None:
            return super().solve_batch(gap, longitudinal_curvature, points, wear_compliance, warm)
        shape, strips = gap.shape[:-1], gap.shape[-1]
        gaps = _own(gap).reshape(-1, strips)
        compliance = np.zeros_like(gaps)
        if wear_compliance is not None:
            compliance = _own(wear_compliance).reshape(gaps.shape)
        line_load, approach = np.zeros(gaps.shape), np.zeros(len(gaps))
        if warm is not None:
            line_load[:] = [solution.line_load for solution in warm]
            approach[:] = [solution.approach for solution in warm]
        iterations, loads = np.zeros(len(gaps), dtype=np.int64), _own(columns.normal_force)
        alone, nothing = np.full((1, 2), NO_BODY), np.zeros((1, 2, strips))
        for k in range(len(gaps)):
            one = slice(k, k + 1)
            try:
                iterations[k] = self._solve_normal(
                    gaps[one],
                    (compliance[one], alone, nothing),
                    loads[one],
                    longitudinal_curvature,
                    line_load[one],
                    approach[one],
                )
            except ContactError as error:
                raise naming_contact(error, k, shape) from error
        return self._completed(
            line_load, approach, iterations, longitudinal_curvature, columns, shape
        )

    def _columns(self, points: Sequence[OperatingPoint]) -> OperatingPoints | None:
        """Return the points as columns where strip theory can take them all at once, or None."""
        if not isinstance(self.theory, StripTheory):
            return None
        columns = OperatingPoints.of(points)
        plain = columns is not None and columns.friction.ndim < 3 and not columns.friction_carried
        return columns if plain else None

    def _completed(
        self,
        line_load: FloatArray,
        approach: FloatArray,
        iterations: IntArray,
        curvature: float,
        points: OperatingPoints,
        leading: tuple[int, ...],
    ) -> BatchSolution:
        """Return the solutions of normal contacts by strip theory, all in one call."""
        y, shape = self._grid.y, line_load.shape
        variation = points.variation
        if variation is None:
            variation = -points.spin[:, None] * y
        friction = points.friction if points.friction.ndim > 1 else points.friction[:, None]
        half_length, dissipation = np.empty(shape), np.empty(shape)
        sums = np.empty((len(SUMS), len(approach)))
        strip_contacts(
            line_load,
            y,
            self._grid.spacing,
            curvature,
            self._pair.contact_modulus,
            self._pair.shear_modulus,
            points.rolling_speed,
            _own(points.longitudinal),
            _own(points.lateral),
            _own(variation),
            _own(np.broadcast_to(friction, shape)),
            half_length,
            dissipation,
            sums,
        )
        columns = {
            "half_length": half_length,
            "line_load": line_load,
            "dissipation": dissipation,
            "approach": approach,
            "longitudinal_creepage": points.longitudinal,
            "iterations": iterations,
            **dict(zip(SUMS, sums, strict=True)),
        }
        shaped = {name: a.reshape(leading + a.shape[1:]) for name, a in columns.items()}
        return BatchSolution(leading, y, shaped)

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
        at_edge = (line_load[:, 0] > 0.0) | (line_load[:, -1] > 0.0)
        if self._grid.strips > 2 and at_edge.any():
            y = self._grid.y
            raise ContactError(
                f"the contact reaches the edge of its strips, which span {y[0] * 1e3:.4g} to"
                f" {y[-1] * 1e3:.4g} mm; raise contact.width or move contact.centre",
                state,
            )

    def _strips(
        self, line_load: FloatArray, approach: float, iterations: int, curvature: float
    ) -> Strips:
        modulus = self._pair.contact_modulus
        half_length = np.sqrt(4.0 * line_load / (np.pi * modulus * curvature))
        return Strips(
            y=self._grid.y,
            half_length=half_length,
            line_load=line_load,
            spacing=self._grid.spacing,
            longitudinal_curvature=curvature,
            approach=float(approach),
            peak_pressure=0.5 * modulus * curvature * float(half_length.max()),
            iterations=iterations,
        )

    def _complete(
        self,
        line_load: FloatArray,
        approach: float,
        iterations: int,
        curvature: float,
        point: OperatingPoint,
    ) -> ContactSolution:
        strips = self._strips(line_load, approach, iterations, curvature)
        return complete(self.theory, strips, self._pair, point)

    def pass_loop(self, loop: PassLoop) -> int:
        """Run roller passes in compiled code; strip theory only."""
        if not self.capabilities.pass_loop:
            return super().pass_loop(loop)
        from wearsim.mechanics import slender_pass  # noqa: PLC0415  (slow to load, rarely needed)

        status, done, full_solves = slender_pass.run_passes(
            loop.order,
            loop.first_pass,
            slender_pass.Passes(loop.base_load, loop.creepage, loop.friction, loop.tilt, loop.spin),
            float(loop.stiffness),
            loop.terms,
            loop.term_rates,
            loop.nominal_gap,
            loop.from_apex,
            loop.rolling_speed,
            loop.similar,
            slender_pass.medium(
                self._grid.spacing,
                self._pair.contact_modulus,
                self._pair.shear_modulus,
                loop.longitudinal_curvature,
                self._table,
            ),
            slender_pass.Wear(
                loop.slip_base,
                loop.spin_arm,
                loop.slip_rates,
                loop.wear,
                loop.cylinder_depth,
                loop.roller_depth,
            ),
            slender_pass.Loads(
                loop.line_load, loop.anchor, loop.anchor_gap, loop.approach, loop.anchor_approach
            ),
            slender_pass.empty_follower(*loop.nominal_gap.shape),
            loop.energy,
        )
        gap = loop.nominal_gap + loop.cylinder_depth + loop.roller_depth
        if status == slender_pass.LOST:
            raise ContactError(
                f"contact is lost at pass {loop.first_pass + done}: the load is not positive",
                {"line_load": loop.line_load, "gap": gap},
            )
        loads = loop.line_load.sum(axis=1) * self._grid.spacing
        self._check(status, gap, loads, loop.line_load, loop.approach)
        return int(full_solves)

    def fields(
        self,
        solution: ContactSolution,
        gap: FloatArray,
        longitudinal_curvature: float,
        point: OperatingPoint,
        points_along: int = 101,
    ) -> ContactFields:
        """Return tractions and slip inside a solved contact."""
        strips = self._strips(
            solution.line_load, solution.approach, solution.iterations, longitudinal_curvature
        )
        slip = local_slip(strips, point, solution.longitudinal_creepage)
        friction = friction_per_strip(strips, point)
        return self.theory.fields(
            strips, self._pair, slip, friction, point.rolling_speed, points_along
        )


def _own(array: FloatArray) -> FloatArray:
    """Return a copy that can be written to, since a kernel is compiled for such arrays alone."""
    return np.array(array, dtype=np.float64, order="C")


def _build(options: SlenderOptions) -> Slender:
    return Slender(tangential_theory(options))


SPEC = ContactModelSpec(
    name="slender",
    factory=_build,
    options=SlenderOptions,
    capabilities=Slender.capabilities,
    summary="line-contact strips on any profile, closed-form strip theory; the default for replays",
    references=(
        "Kalker, On elastic line contact, J. Appl. Mech. 39 (1972), DOI 10.1115/1.3422842",
        "Carter, Proc. R. Soc. A 112 (1926), DOI 10.1098/rspa.1926.0100",
    ),
)

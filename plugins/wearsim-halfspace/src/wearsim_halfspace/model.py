"""Contact model `halfspace`: steady rolling of elastic half-spaces after Kalker."""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from dataclasses import replace
from typing import Annotated, Literal, NamedTuple

import numpy as np

import wearsim.plugins as ws
from wearsim.types import (
    ContactFields,
    ContactSolution,
    Creepage,
    FloatArray,
    Grid,
    Material,
    OperatingPoint,
)
from wearsim_halfspace.grids import Problem, Solution, densities, solve, with_slip
from wearsim_halfspace.normal import NormalSolution, solve_normal
from wearsim_halfspace.strips import (
    combined,
    difference,
    elliptic_pressure,
    half_lengths,
    half_width,
)

SAME = 1e-3  # relative difference of element lengths that are not corrected
MARGIN = 0.05  # columns ahead of and behind the longest strip, over those across it
FEWEST = 0.8  # elements across the longest strip, relative to the requested number
SPARE = 3  # rows and columns around the contact
COARSER = 4  # elements across an element of the second coarser grid
#: number of grids for which the length of elements must agree with the solution, and of all grids
FREE_GRIDS, MAX_GRIDS = 3, 12
MAX_COUPLED = 50  # iterations that solve the normal and the tangential problem in turn
COUPLED = 10.0  # change of the pressure at which this iteration ends, over the tolerance
ALTERNATING = 3e-4  # change at which it ends if a row alternates between two states

Elements_ = Annotated[int, ws.Field(ge=8, le=400)]


class HalfspaceOptions(ws.Options):
    """Options of the contact model `halfspace`, validated with their units."""

    mx: Elements_ = ws.Field(50, description="elements across the longest strip along rolling")
    my: Elements_ = ws.Field(
        100, description="strips across a fresh contact, if neither their number nor width is given"
    )
    extrapolate: bool = ws.Field(
        True,
        description="extrapolate forces and power from these elements and ones of twice the length",
    )
    order: Literal[1, 2] = ws.Field(
        2, description="of convergence with elements along rolling: 2, or 1 as in CONTACT"
    )
    tolerance: float = ws.Field(1e-6, ge=1e-12, le=1e-2, description="of pressure and traction")
    coupling: bool = ws.Field(
        True, description="of pressure and traction, where the materials of the bodies differ"
    )


class Patch(NamedTuple):
    """Problem and normal solution of a contact.

    `strips` are those of the rows of elements; `load` and `half_length` are the line load and the
    half-length of all strips.
    """

    problem: Problem
    normal: NormalSolution
    strips: slice
    load: FloatArray
    half_length: FloatArray


class Halfspace(ws.SingleContactModel):
    """Exact theory of elastic half-spaces, normal and tangential.

    Parameters
    ----------
    options : HalfspaceOptions
    grid : Grid
        Strips; their width is the width of the elements.
    materials : sequence of Material
        Of both bodies.
    """

    capabilities = ws.Capabilities(
        wear_compliance=True,
        creepage_variation=True,
        local_friction=True,
        friction_field=True,
        creep_factor=True,
        fields=True,
    )

    def __init__(
        self, options: HalfspaceOptions, grid: Grid, materials: Sequence[Material]
    ) -> None:
        self.options, self.grid = options, grid
        # an even number, so that the larger elements end at the ends of the longest strip too
        self._across = options.mx + options.mx % 2
        self.shear_modulus, self.poisson_ratio = combined(materials)
        self._difference = difference(materials) if options.coupling else 0.0
        #: contact modulus E* of both bodies [Pa]
        self.contact_modulus = self.shear_modulus / (1.0 - self.poisson_ratio)
        self._creep_factor = 1.0

    def with_creep_factor(self, factor: float) -> Halfspace:
        """Return the model with tangential displacements by traction divided by a factor."""
        model = copy(self)
        model._creep_factor = factor
        return model

    def solve_contact(
        self,
        gap: FloatArray,
        longitudinal_curvature: float,
        point: OperatingPoint,
        wear_compliance: FloatArray | None = None,
        warm: ContactSolution | None = None,
    ) -> ContactSolution:
        """Solve one contact; see `SingleContactModel.solve_contact`."""
        patch = self._patch(gap, longitudinal_curvature, point, wear_compliance, warm)
        return self._solution(*self._rolled(patch, point.creepage), point)

    def friction_points(self, batch: ws.ContactBatch) -> tuple[FloatArray, FloatArray]:
        """Return the points of the friction coefficients: `mx` along each strip."""
        lengths = [
            self._patch(
                batch.gap[k], float(batch.longitudinal_curvature[k]), batch.point(k), None, None
            ).half_length
            for k in range(len(batch))
        ]
        return self._places()[:, None] * np.array(lengths)[:, None, :], self.grid.y

    def fields(
        self,
        solution: ContactSolution,
        gap: FloatArray,
        longitudinal_curvature: float,
        point: OperatingPoint,
        points_along: int = 101,
    ) -> ContactFields:
        """Return pressure, traction and slip, those of the element at each point."""
        patch = self._patch(gap, longitudinal_curvature, point, None, solution)
        patch, solved = self._rolled(patch, point.creepage)
        rolling, problem = solved.rolling, patch.problem
        length, columns = patch.half_length, len(problem.x)
        x = np.linspace(-1.0, 1.0, points_along)[:, None] * length
        place = np.rint((x - problem.x[0]) / problem.dx).astype(np.int64)
        place = np.clip(place, 0, columns - 1)
        density = np.where(patch.normal.pressure > 0.0, densities(rolling), 0.0)
        # what is dissipated as particles leave the contact belongs to its strips
        inside = density.sum(axis=1) * problem.dx
        shares = solution.dissipation[patch.strips] / np.where(inside > 0.0, inside, 1.0)
        density *= shares[:, None]

        def sampled(values: FloatArray) -> FloatArray:
            samples = np.zeros((points_along, len(length)))
            rows = np.arange(patch.strips.stop - patch.strips.start)
            samples[:, patch.strips] = values[rows, place[:, patch.strips]]
            return np.where(length > 0.0, samples, 0.0)

        return ContactFields(
            x=x,
            y=self.grid.y,
            pressure=sampled(patch.normal.pressure),
            traction_x=sampled(rolling.traction[0]),
            traction_y=sampled(rolling.traction[1]),
            slip_x=sampled(rolling.slip[0]),
            slip_y=sampled(rolling.slip[1]),
            adhesion=sampled(rolling.sticks.astype(np.float64)) > 0.0,
            power_density=sampled(density),
        )

    def _patch(
        self,
        gap: FloatArray,
        longitudinal_curvature: float,
        point: OperatingPoint,
        wear_compliance: FloatArray | None,
        warm: ContactSolution | None,
    ) -> Patch:
        """Return the solution of the normal problem on elements that suit the contact."""
        force, creepage = point.normal_force, point.creepage
        inputs = (
            force,
            point.rolling_speed,
            creepage.longitudinal,
            creepage.lateral,
            creepage.spin,
        )
        finite = np.isfinite([*inputs, np.sum(point.friction)]).all() and np.isfinite(gap).all()
        if creepage.variation is not None:
            finite = finite and np.isfinite(creepage.variation).all()
        if not (finite and force > 0.0 and np.min(point.friction) >= 0.0):
            raise ws.ContactError(
                f"no contact: load {force:.4g} N, or a gap, creepage or friction that is not finite"
            )
        compliance = np.zeros_like(gap) if wear_compliance is None else wear_compliance
        # the elements must not depend on the warm start; those of a solution that determines
        # them again do not depend on the estimate either
        load, half_length = self._estimate(gap, longitudinal_curvature, force, compliance)
        for number in range(MAX_GRIDS):
            strips, x = self._elements(load, half_length)
            guess = (load, half_length) if warm is None else (warm.line_load, warm.half_length)
            problem = Problem(
                dx=self._length(half_length),
                dy=self.grid.spacing,
                shear_modulus=self.shear_modulus,
                poisson_ratio=self.poisson_ratio,
                gap=0.5 * longitudinal_curvature * x**2 + gap[strips, None],
                force=force,
                compliance=compliance[strips],
                friction=np.zeros((strips.stop - strips.start, len(x))),
                rigid_slip=np.zeros((2, strips.stop - strips.start, len(x))),
                spin=creepage.spin,
                x=x,
                y=self.grid.y[strips],
                order=self.options.order,
                difference=self._difference,
                creep_factor=self._creep_factor,
            )
            normal = solve_normal(
                problem.elements,
                problem.gap,
                force,
                elliptic_pressure(guess[0][strips], guess[1][strips], x),
                self.options.tolerance,
                problem.compliance,
            )
            load, half_length, suits = self._extent(normal, strips, x)
            if suits and (
                number >= FREE_GRIDS or abs(self._length(half_length) / problem.dx - 1.0) < SAME
            ):
                problem = with_slip(problem, creepage, self.grid.y, load, strips)
                problem = replace(problem, friction=self._friction(point, half_length, strips, x))
                return Patch(problem, normal, strips, load, half_length)
            warm = None
        raise ws.ContactError("no grid suits the contact; its strips differ too much in length")

    def _places(self) -> FloatArray:
        """Return the points along a strip from the leading edge on, over its half-length."""
        steps = np.arange(self.options.mx, dtype=np.float64) + 0.5
        return np.asarray(1.0 - steps * (2.0 / self.options.mx))

    def _friction(
        self, point: OperatingPoint, half_length: FloatArray, strips: slice, x: FloatArray
    ) -> FloatArray:
        """Return the friction coefficient of each element."""
        friction = np.asarray(point.friction, dtype=np.float64)
        if friction.ndim < 2:
            rows = np.broadcast_to(friction, half_length.shape)[strips]
            return np.repeat(rows[:, None], len(x), axis=1)
        if friction.shape != (self.options.mx, len(half_length)):
            raise ValueError(
                f"friction has the shape {friction.shape}, expected (mx, strips) ="
                f" {(self.options.mx, len(half_length))}; take it at `friction_points`"
            )
        if point.friction_carried and np.ptp(friction, axis=0).any():
            raise ws.CapabilityError(
                "friction that is carried through the contact is not steady; contact.model ="
                " 'halfspace' solves steady rolling: give friction that is fixed to the contact"
                " (frame = 'contact'), or use 'hertz-fastsim'"
            )
        places = self._places()[::-1]
        return np.array(
            [
                np.interp(x, length * places, values[::-1])
                if length > 0.0
                else values.mean() + 0.0 * x
                for length, values in zip(half_length[strips], friction.T[strips], strict=True)
            ]
        )

    def _estimate(
        self, gap: FloatArray, curvature: float, force: float, compliance: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Return line loads and half-lengths of independent strips, as a first guess."""
        depth, spacing = gap - gap.min(), self.grid.spacing
        slenderness = 10.0  # half-width of the contact over its half-length
        for _ in range(4):
            # approach of a line contact of finite width, over its line load
            soft = (2.0 * np.log(2.0 * slenderness) + 1.0) / (np.pi * self.contact_modulus)
            total_compliance = soft + compliance
            low, high = 0.0, force * float(np.max(total_compliance)) / spacing
            for _ in range(60):
                approach = 0.5 * (low + high)
                carried = (
                    float((np.maximum(approach - depth, 0.0) / total_compliance).sum()) * spacing
                )
                low, high = (approach, high) if carried < force else (low, approach)
            load = np.maximum(high - depth, 0.0) / total_compliance
            half_length = np.sqrt(4.0 * load / (np.pi * self.contact_modulus * curvature))
            width = 0.5 * spacing * np.count_nonzero(load)
            slenderness = max(width / float(half_length.max()), 1.0)
        return load, half_length

    def _elements(self, load: FloatArray, half_length: FloatArray) -> tuple[slice, FloatArray]:
        """Return the strips of the rows of elements, and the positions of the columns [m]."""
        touching = np.flatnonzero(load > 0.0)
        first = max(int(touching[0]) - SPARE, 0)
        last = min(int(touching[-1]) + SPARE, len(load) - 1)
        # the ends of the longest strip are ends of elements on the coarser grids too
        spare = COARSER * int(np.ceil((MARGIN * self._across + SPARE) / COARSER))
        columns = self._across + 2 * spare
        places = np.arange(columns) - 0.5 * (columns - 1)
        return slice(first, last + 1), np.asarray(places * self._length(half_length))

    def _length(self, half_length: FloatArray) -> float:
        """Return the length of the elements along rolling [m]."""
        return 2.0 * float(half_length.max()) / self._across

    def _extent(
        self, normal: NormalSolution, strips: slice, x: FloatArray
    ) -> tuple[FloatArray, FloatArray, bool]:
        """Return line load and half-length of all strips, and whether the grid suits them."""
        pressure, dx = normal.pressure, float(x[1] - x[0])
        load, half_length = np.zeros(self.grid.strips), np.zeros(self.grid.strips)
        load[strips] = pressure.sum(axis=1) * dx
        half_length[strips] = half_lengths(pressure, x)
        if load[0] > 0.0 or load[-1] > 0.0:
            raise ws.ContactError("the contact reaches the edge of its strips", cause="edge")
        inside = not pressure[[0, -1]].any() or len(pressure) == self.grid.strips
        inside &= not pressure[:, [0, -1]].any()
        across = int((pressure > 0.0).sum(axis=1).max())
        fits = FEWEST * self._across <= across <= pressure.shape[1] - 2
        return load, half_length, inside and fits

    def _rolled(self, patch: Patch, creepage: Creepage) -> tuple[Patch, Solution]:
        """Return normal and tangential solution.

        Tractions open the gap where the materials differ: both are then solved in turn.
        """
        tolerance, gap, change = self.options.tolerance, patch.problem.gap, np.inf
        solution = solve(patch.problem, patch.normal, tolerance)
        if not self._difference:
            return patch, solution
        for _ in range(MAX_COUPLED):
            opening = patch.problem.elements.opening.total(solution.rolling.traction)
            problem = replace(patch.problem, gap=gap + opening)
            before = patch.normal.pressure
            known = problem.gap, problem.force, before, tolerance, problem.compliance
            normal = solve_normal(problem.elements, *known)
            load, half_length, suits = self._extent(normal, patch.strips, problem.x)
            if not suits:
                raise ws.ContactError("traction shifts the contact beyond its elements")
            problem = with_slip(problem, creepage, self.grid.y, load, patch.strips)
            patch = Patch(problem, normal, patch.strips, load, half_length)
            solution = solve(problem, normal, tolerance)
            last, change = change, float(np.abs(normal.pressure - before).max() / before.max())
            if change <= COUPLED * tolerance or 0.5 * last < change <= ALTERNATING:
                return patch, solution
        raise ws.ContactError(
            f"different materials: pressure still changes by {change:.1e}; raise contact.tolerance"
        )

    def _solution(self, patch: Patch, solution: Solution, point: OperatingPoint) -> ContactSolution:
        """Return forces, powers and lengths of a solved contact."""
        work = solution.extrapolated() if self.options.extrapolate else solution.work()
        speed, load, pressure = point.rolling_speed, patch.load, patch.normal.pressure
        power, dissipation = max(work.power, 0.0) * speed, np.zeros_like(load)
        dissipation[patch.strips] = np.maximum(work.rows, 0.0)
        dissipation[load == 0.0] = 0.0
        total = float(dissipation.sum()) * self.grid.spacing
        if total > 0.0:  # the elastic energy is recovered: the total is that of `Work.power`
            dissipation *= power / total
        return ContactSolution(
            y=self.grid.y,
            half_length=patch.half_length,
            line_load=load,
            dissipation=dissipation,
            force_x=work.force_x,
            force_y=work.force_y,
            spin_moment=work.moment,
            approach=patch.normal.approach,
            peak_pressure=float(pressure.max()),
            adhesion_fraction=float(solution.rolling.sticks[pressure > 0.0].mean()),
            power=power,
            longitudinal_creepage=point.creepage.longitudinal,
            iterations=patch.normal.iterations,
        )


def suggest_grid(
    options: HalfspaceOptions,
    gap_curvature: float,
    longitudinal_curvature: float,
    normal_force: float,
    materials: Sequence[Material],
) -> Grid:
    """Return `options.my` strips across a fresh contact, and a fifth more around it."""
    shear_modulus, poisson_ratio = combined(materials)
    modulus = shear_modulus / (1.0 - poisson_ratio)
    half = half_width(0.5 * longitudinal_curvature, 0.5 * gap_curvature, normal_force, modulus)
    spare = int(np.ceil(0.1 * options.my)) + 1
    outer = half * (1.0 + 2.0 * spare / options.my)
    return Grid.spanning(-outer, outer, options.my + 2 * spare)


SPEC = ws.ContactModelSpec(
    *("halfspace", HalfspaceOptions, "exact theory of elastic half-spaces in steady rolling"),
    factory=Halfspace,
    capabilities=Halfspace.capabilities,
    suggest_grid=suggest_grid,
    reference=True,
    protocol=2,
)


@ws.hookimpl
def wearsim_contact_models():  # type: ignore[no-untyped-def]
    """Yield the contact model."""
    yield SPEC

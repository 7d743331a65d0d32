"""Contact model `halfspace`: steady rolling of elastic half-spaces after Kalker."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Annotated, NamedTuple

import numpy as np

import wearsim.plugins as ws
from wearsim.types import (
    ContactFields,
    ContactSolution,
    FloatArray,
    Grid,
    Material,
    OperatingPoint,
)
from wearsim_halfspace.influence import Elements
from wearsim_halfspace.normal import NormalSolution, solve_normal
from wearsim_halfspace.rolling import RollingSolution, solve_rolling

LADDER = 1.05  # ratio of successive element lengths, so that coefficients are used again
ROW_BLOCK = 8  # numbers of rows are multiples of it, for the same reason
MARGIN = 1.3  # columns over the elements across the longest strip
FEWEST = 0.8  # elements across the longest strip, relative to the requested number
MAX_GRIDS = 12

Elements_ = Annotated[int, ws.Field(ge=8, le=400)]


class HalfspaceOptions(ws.Options):
    """Options of the contact model `halfspace`, validated with their units."""

    mx: Elements_ = ws.Field(50, description="elements across the longest strip along rolling")
    tolerance: float = ws.Field(1e-6, gt=0.0, le=1e-2, description="of pressure and traction")


@lru_cache(maxsize=32)
def elements_of(
    rows: int, columns: int, dx: float, dy: float, shear_modulus: float, poisson_ratio: float
) -> Elements:
    """Return elements; their influence coefficients are computed once for each grid."""
    return Elements(rows, columns, dx, dy, shear_modulus, poisson_ratio)


class Patch(NamedTuple):
    """Normal solution, elements, strips of their rows, positions along rolling [m].

    `load` and `half_length` are the line load and the half-length of all strips of the grid.
    """

    normal: NormalSolution
    elements: Elements
    strips: slice
    x: FloatArray
    load: FloatArray
    half_length: FloatArray


class Halfspace(ws.SingleContactModel):
    """Exact theory of elastic half-spaces, normal and tangential, for quasi-identical bodies.

    Parameters
    ----------
    options : HalfspaceOptions
    grid : Grid
        Strips; their width is the width of the elements.
    materials : sequence of Material
        Of both bodies.
    """

    capabilities = ws.Capabilities(
        wear_compliance=True, creepage_variation=True, local_friction=True, fields=True
    )

    def __init__(
        self, options: HalfspaceOptions, grid: Grid, materials: Sequence[Material]
    ) -> None:
        moduli = [m.youngs_modulus / (2.0 * (1.0 + m.poisson_ratio)) for m in materials]
        softness = [0.5 / modulus for modulus in moduli]
        self.options, self.grid = options, grid
        self.shear_modulus = 1.0 / sum(softness)
        self.poisson_ratio = self.shear_modulus * sum(
            part * m.poisson_ratio for part, m in zip(softness, materials, strict=True)
        )
        #: contact modulus E* of both bodies [Pa]
        self.contact_modulus = self.shear_modulus / (1.0 - self.poisson_ratio)

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
        return self._solution(patch, point, *self._rolled(patch, point))

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
        _, rolling = self._rolled(patch, point)
        length, columns = patch.half_length, len(patch.x)
        x = np.linspace(-1.0, 1.0, points_along)[:, None] * length
        place = np.rint((x - patch.x[0]) / patch.elements.dx).astype(np.int64)
        place = np.clip(place, 0, columns - 1)
        density = np.where(patch.normal.pressure > 0.0, _densities(rolling), 0.0)
        # what is dissipated as particles leave the contact belongs to its strips
        inside = density.sum(axis=1) * patch.elements.dx
        shares = solution.dissipation[patch.strips] / np.where(inside > 0.0, inside, 1.0)
        density *= shares[:, None]

        def sampled(values: FloatArray) -> FloatArray:
            found = np.zeros((points_along, len(length)))
            rows = np.arange(patch.strips.stop - patch.strips.start)
            found[:, patch.strips] = values[rows, place[:, patch.strips]]
            return np.where(length > 0.0, found, 0.0)

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
        given = (force, point.rolling_speed, creepage.longitudinal, creepage.lateral, creepage.spin)
        finite = np.isfinite([*given, np.sum(point.friction)]).all() and np.isfinite(gap).all()
        if creepage.variation is not None:
            finite = finite and np.isfinite(creepage.variation).all()
        if not (finite and force > 0.0 and np.min(point.friction) >= 0.0):
            raise ws.ContactError(
                f"no contact: load {force:.4g} N, or a gap, creepage or friction that is not finite"
            )
        compliance = np.zeros_like(gap) if wear_compliance is None else wear_compliance
        # the elements must not depend on the warm start
        load, half_length = self._estimate(gap, longitudinal_curvature, force, compliance)
        for _ in range(MAX_GRIDS):
            strips, elements, x = self._elements(load, half_length)
            near = (load, half_length) if warm is None else (warm.line_load, warm.half_length)
            start = _elliptic(near[0][strips], near[1][strips], x)
            whole = 0.5 * longitudinal_curvature * x**2 + gap[strips, None]
            normal = solve_normal(
                elements, whole, force, start, self.options.tolerance, compliance[strips]
            )
            load, half_length, suits = self._extent(normal, strips, x)
            if suits:
                return Patch(normal, elements, strips, x, load, half_length)
            warm = None
        raise ws.ContactError("no grid suits the contact; its strips differ too much in length")

    def _estimate(
        self, gap: FloatArray, curvature: float, force: float, compliance: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Return line loads and half-lengths of independent strips, as a first guess."""
        depth, spacing = gap - gap.min(), self.grid.spacing
        slenderness = 10.0  # half-width of the contact over its half-length
        for _ in range(4):
            # approach of a line contact of finite width, over its line load
            soft = (2.0 * np.log(2.0 * slenderness) + 1.0) / (np.pi * self.contact_modulus)
            each = soft + compliance
            low, high = 0.0, force * float(np.max(each)) / spacing
            for _ in range(60):
                approach = 0.5 * (low + high)
                carried = float((np.maximum(approach - depth, 0.0) / each).sum()) * spacing
                low, high = (approach, high) if carried < force else (low, approach)
            load = np.maximum(high - depth, 0.0) / each
            half_length = np.sqrt(4.0 * load / (np.pi * self.contact_modulus * curvature))
            width = 0.5 * spacing * np.count_nonzero(load)
            slenderness = max(width / float(half_length.max()), 1.0)
        return load, half_length

    def _elements(
        self, load: FloatArray, half_length: FloatArray
    ) -> tuple[slice, Elements, FloatArray]:
        """Return the strips near the contact, their elements, and positions along rolling [m]."""
        touching = np.flatnonzero(load > 0.0)
        strips = len(load)
        wanted = int(touching[-1] - touching[0]) + 1 + ROW_BLOCK
        rows = min(-(-wanted // ROW_BLOCK) * ROW_BLOCK, strips)
        first = int(np.clip((touching[0] + touching[-1] + 1 - rows) // 2, 0, strips - rows))
        exact = 2.0 * float(half_length.max()) / self.options.mx
        dx = float(LADDER ** np.ceil(np.log(exact) / np.log(LADDER)))
        columns = 2 * int(np.ceil(0.5 * MARGIN * self.options.mx)) + 4
        elements = elements_of(
            rows, columns, dx, self.grid.spacing, self.shear_modulus, self.poisson_ratio
        )
        x = np.asarray((np.arange(columns) - 0.5 * (columns - 1)) * dx, dtype=np.float64)
        return slice(first, first + rows), elements, x

    def _extent(
        self, normal: NormalSolution, strips: slice, x: FloatArray
    ) -> tuple[FloatArray, FloatArray, bool]:
        """Return line load and half-length of all strips, and whether the grid suits them."""
        pressure, dx = normal.pressure, float(x[1] - x[0])
        load, half_length = np.zeros(self.grid.strips), np.zeros(self.grid.strips)
        load[strips] = pressure.sum(axis=1) * dx
        half_length[strips] = _half_lengths(pressure, x)
        if load[0] > 0.0 or load[-1] > 0.0:
            raise ws.ContactError("the contact reaches the edge of its strips; raise contact.width")
        inside = not pressure[[0, -1]].any() or len(pressure) == self.grid.strips
        across = int((pressure > 0.0).sum(axis=1).max())
        fits = FEWEST * self.options.mx <= across <= pressure.shape[1] - 3
        return load, half_length, inside and fits

    def _rolled(self, patch: Patch, point: OperatingPoint) -> tuple[FloatArray, RollingSolution]:
        """Return the rigid slip, shape (2, rows, columns), and the tangential solution."""
        creepage, load = point.creepage, patch.load
        varies = -creepage.spin * self.grid.y
        if creepage.variation is not None:
            varies = creepage.variation
        along = creepage.longitudinal + varies - float(load @ varies) / float(load.sum())
        rigid = np.empty((2, *patch.normal.pressure.shape))
        rigid[0] = along[patch.strips, None]
        rigid[1] = creepage.lateral + creepage.spin * patch.x
        friction = np.broadcast_to(np.asarray(point.friction, dtype=np.float64), load.shape)
        bound = friction[patch.strips, None] * patch.normal.pressure
        if not bound.any() or not rigid.any():
            nothing = np.zeros_like(rigid)
            return rigid, RollingSolution(nothing, nothing, patch.normal.pressure > 0.0)
        return rigid, solve_rolling(patch.elements, bound, rigid, self.options.tolerance)

    def _solution(
        self, patch: Patch, point: OperatingPoint, rigid: FloatArray, rolling: RollingSolution
    ) -> ContactSolution:
        """Return forces, powers and lengths of a solved contact."""
        y, load, strips = self.grid.y, patch.load, patch.strips
        area, pressure = patch.elements.dx * patch.elements.dy, patch.normal.pressure
        power = -float((rolling.traction * rigid).sum()) * area * point.rolling_speed
        force_x, force_y = (float(part.sum()) * area for part in rolling.traction)
        arms = y[strips, None] - float(load @ y) / float(load.sum())
        moment = (patch.x * rolling.traction[1] - arms * rolling.traction[0]).sum() * area
        dissipation = np.zeros_like(y)
        dissipation[strips] = _row_powers(rolling, patch.elements.dx) * point.rolling_speed
        total = float(dissipation.sum()) * patch.elements.dy
        if total > 0.0:  # the elastic energy returns: the total is the work of the rigid slip
            dissipation *= max(power, 0.0) / total
        return ContactSolution(
            y=y,
            half_length=patch.half_length,
            line_load=load,
            dissipation=dissipation,
            force_x=force_x,
            force_y=force_y,
            spin_moment=float(moment),
            approach=patch.normal.approach,
            peak_pressure=float(pressure.max()),
            adhesion_fraction=float(rolling.sticks[pressure > 0.0].mean()),
            power=max(power, 0.0),
            longitudinal_creepage=point.creepage.longitudinal,
            iterations=patch.normal.iterations,
        )


def _elliptic(load: FloatArray, half_length: FloatArray, x: FloatArray) -> FloatArray:
    """Return the pressure of strips with elliptic distributions [Pa]."""
    length = np.where(load > 0.0, np.maximum(half_length, x[1] - x[0]), 1.0)[:, None]
    shape = np.sqrt(np.maximum(1.0 - (x / length) ** 2, 0.0))
    return np.asarray(2.0 * load[:, None] / (np.pi * length) * shape)


def _half_lengths(pressure: FloatArray, x: FloatArray) -> FloatArray:
    """Return the half-length of each row [m].

    The square of the pressure is linear near an edge; its zero is extrapolated from the two
    outermost elements of both ends.
    """
    found, dx = np.zeros(len(pressure)), float(x[1] - x[0])
    for row, values in enumerate(pressure):
        touching = np.flatnonzero(values > 0.0)
        if len(touching) == 0:
            continue
        ends = 0.5 * dx * (len(touching) - 1)
        for outer, inner in ((touching[0], touching[0] + 1), (touching[-1], touching[-1] - 1)):
            square, rise = values[outer] ** 2, values[inner] ** 2 - values[outer] ** 2
            ends += 0.5 * dx * (min(square / rise, 1.0) if rise > 0.0 else 0.5)
        found[row] = ends
    return found


def _row_powers(rolling: RollingSolution, dx: float) -> FloatArray:
    """Return the power that each row dissipates per rolling velocity [N/m].

    While a particle moves over an element, its traction is the mean of those before and after.
    """
    return np.asarray(_densities(rolling).sum(axis=1) * dx)


def _densities(rolling: RollingSolution) -> FloatArray:
    """Return the power that each element dissipates per area and rolling velocity [Pa]."""
    before = np.zeros_like(rolling.traction)
    before[..., :-1] = rolling.traction[..., 1:]
    return np.asarray(-(0.5 * (rolling.traction + before) * rolling.slip).sum(axis=0))


SPEC = ws.ContactModelSpec(
    *("halfspace", HalfspaceOptions, "exact theory of elastic half-spaces in steady rolling"),
    factory=Halfspace,
    capabilities=Halfspace.capabilities,
    reference=True,
    protocol=2,
)


@ws.hookimpl
def wearsim_contact_models():  # type: ignore[no-untyped-def]
    """Yield the contact model."""
    yield SPEC

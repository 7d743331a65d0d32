"""The contacts on which a contact model is put to the test."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from typing import Any

import numpy as np

from wearsim.plugins import Capabilities, ContactModel, ContactModelSpec
from wearsim.testing.specs import Chosen
from wearsim.types import (
    ContactSolution,
    Creepage,
    FloatArray,
    Grid,
    Material,
    OperatingPoint,
)

STEEL = Material(youngs_modulus=210e9, poisson_ratio=0.3)
NUMBERS = tuple(item.name for item in fields(ContactSolution) if item.type == "float")
STRIPS = ("half_length", "line_load", "dissipation")


@dataclass(frozen=True)
class ContactCase:
    """The contact that the checks start from: by default a steel roller on a steel cylinder.

    Parameters
    ----------
    normal_force : float
        Load [N].
    cylinder_radius, roller_radius, crown_radius : float
        Radii [m].
    friction : float
        Friction coefficient.
    rolling_speed : float
        V [m/s].
    materials : tuple of Material
        The cylinder's and the roller's.
    width : float
        Width of the strips together [m]; the contact must lie within, also when it is a fifth of
        a crown's patch off centre.
    strips : int
        Their number; convergence is looked at with two and four times as many.
    tolerance : float
        Relative error with which balances must hold: round-off for closed forms, more for a model
        that integrates over points.
    """

    normal_force: float = 300.0
    cylinder_radius: float = 25e-3
    roller_radius: float = 20e-3
    crown_radius: float = 0.5
    friction: float = 0.1
    rolling_speed: float = 2.618
    materials: tuple[Material, Material] = (STEEL, STEEL)
    width: float = 5e-3
    strips: int = 61
    tolerance: float = 1e-6

    @property
    def curvature(self) -> float:
        """Relative curvature along rolling [1/m]."""
        return 1.0 / self.cylinder_radius + 1.0 / self.roller_radius

    def grid(self, times: int = 1) -> Grid:
        """Return the strips, or `times` as many over the same width."""
        return Grid.spanning(-0.5 * self.width, 0.5 * self.width, times * self.strips)

    def gap(self, grid: Grid, centre: float = 0.0, groove: float = 0.0) -> FloatArray:
        """Return the gap of a crown whose apex lies at `centre` on a shallow groove, (strips,).

        Parameters
        ----------
        grid : Grid
            The strips.
        centre : float
            Position of the apex as a part of the width.
        groove : float
            Depth of the groove, beside the apex, as a part of the gap at an eighth of the width.
        """
        y = grid.y - centre * self.width
        depth = groove * (0.125 * self.width) ** 2 / (2.0 * self.crown_radius)
        shape = np.exp(-(((y - 0.06 * self.width) / (0.1 * self.width)) ** 2))
        gap: FloatArray = y * y / (2.0 * self.crown_radius) + depth * shape
        return gap


CREEPAGES = {
    "rolling with traction": Creepage(1e-3),
    "partial slip": Creepage(2e-4),
    "braking": Creepage(-4e-4, 1e-4),
    "all creepages": Creepage(3e-4, 4e-4, 0.3),
    "gross sliding": Creepage(2e-2, -1e-2),
}


@dataclass(frozen=True)
class ContactBench:
    """A contact model with options, and the contacts that it is asked to solve.

    Parameters
    ----------
    chosen : Chosen
        The model's spec and options.
    case : ContactCase
        The contact to start from.
    """

    chosen: Chosen[ContactModelSpec]
    case: ContactCase = field(default_factory=ContactCase)

    def __str__(self) -> str:
        return str(self.chosen)

    def fresh(self, grid: Grid | None = None) -> ContactModel:
        """Return a new model, prepared for `grid`, by default that of the case."""
        model = self.chosen.spec.factory(self.chosen.options)
        model.prepare(self.grid if grid is None else grid, self.case.materials)
        return model

    @cached_property
    def grid(self) -> Grid:
        """The case's strips."""
        return self.case.grid()

    @cached_property
    def model(self) -> ContactModel:
        """One model for all checks: what it was asked before must not matter."""
        return self.fresh()

    @property
    def capabilities(self) -> Capabilities:
        """What the model says that it can take."""
        return self.model.capabilities

    @cached_property
    def gap(self) -> FloatArray:
        """The gap of a crown in the middle of the strips [m]."""
        return self.case.gap(self.grid)

    @cached_property
    def gaps(self) -> Mapping[str, FloatArray]:
        """Gaps of several kinds [m]: fresh, off centre and worn."""
        return {
            "fresh": self.gap,
            "off centre": self.case.gap(self.grid, centre=0.05),
            "worn": self.case.gap(self.grid, centre=-0.02, groove=0.3),
        }

    def point(self, creepage: Creepage | None = None, **changes: Any) -> OperatingPoint:
        """Return the case's operating point with a creepage and other values of its own."""
        case = self.case
        point = OperatingPoint(
            case.normal_force, case.rolling_speed, creepage or Creepage(1e-3), case.friction
        )
        return replace(point, **changes)

    def solve(
        self,
        point: OperatingPoint | None = None,
        gap: FloatArray | None = None,
        wear_compliance: FloatArray | None = None,
        warm: ContactSolution | None = None,
    ) -> ContactSolution:
        """Solve one contact with the shared model; by default the fresh one in the middle."""
        own = self.gap if gap is None else gap
        asked = self.point() if point is None else point
        return self.model.solve(own, self.case.curvature, asked, wear_compliance, warm)

    @cached_property
    def solution(self) -> ContactSolution:
        """The solved contact of the case."""
        return self.solve()

    @cached_property
    def solutions(self) -> Mapping[str, tuple[OperatingPoint, ContactSolution]]:
        """Contacts on all gaps and with all creepages, by what they are."""
        return {
            f"{name}, {how}": (point, self.solve(point, gap))
            for name, gap in self.gaps.items()
            for how, point in ((how, self.point(creep)) for how, creep in CREEPAGES.items())
        }

    @property
    def sliding_power(self) -> float:
        """Power of the whole load sliding at the case's creepage [W]; a size to measure against."""
        case = self.case
        return case.friction * case.normal_force * case.rolling_speed * 1e-3

"""Contacts for the conformance tests of contact models."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from typing import Any

import numpy as np

from wearsim.contact_batch import ContactBatch
from wearsim.plugins import ContactModel, ContactModelSpec
from wearsim.testing.checks import Fixture, require
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
_MOST_OF_OVERLAP = 1.001
CREEPAGES = {
    "rolling with traction": Creepage(1e-3),
    "partial slip": Creepage(2e-4),
    "braking": Creepage(-4e-4, 1e-4),
    "all creepages": Creepage(3e-4, 4e-4, 0.3),
    "gross sliding": Creepage(2e-2, -1e-2),
}


@dataclass(frozen=True)
class ContactCase:
    """The base contact of the checks: by default a steel roller on a steel cylinder.

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
        Materials of cylinder and roller.
    width : float
        Total width of the strips [m]; it must contain the contact, also if the contact is off
        centre by a fifth of the width of a crown's patch.
    strips : int
        Number of strips; convergence is checked with two and four times as many.
    tolerance : float
        Relative error allowed in the balances: round-off for closed forms, more for a model that
        integrates over points.
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
        """Return the gap of a crown over a shallow groove, shape (strips,) [m].

        Parameters
        ----------
        grid : Grid
            The strips.
        centre : float
            Position of the crown's apex as a fraction of the width.
        groove : float
            Depth of the groove next to the apex, as a fraction of the gap at an eighth of the
            width.
        """
        y = grid.y - centre * self.width
        depth = groove * (0.125 * self.width) ** 2 / (2.0 * self.crown_radius)
        shape = np.exp(-(((y - 0.06 * self.width) / (0.1 * self.width)) ** 2))
        return np.asarray(y * y / (2.0 * self.crown_radius) + depth * shape)


@dataclass(frozen=True)
class ContactFixture(Fixture[ContactModelSpec]):
    """A contact model under test, and the contacts to solve.

    Parameters
    ----------
    configured : ConfiguredSpec
        The model's spec and options.
    case : ContactCase
        The base contact.
    """

    case: ContactCase = field(default_factory=ContactCase)

    def fresh(self, grid: Grid | None = None) -> ContactModel:
        """Return a new model for `grid`, by default the grid of the case."""
        return self.configured.spec.factory(
            self.configured.options, grid or self.grid, self.case.materials
        )

    @cached_property
    def grid(self) -> Grid:
        """The strips of the case."""
        return self.case.grid()

    @property
    def model(self) -> ContactModel:
        """The model that all checks share."""
        return self.instance  # type: ignore[no-any-return]

    @property
    def gap(self) -> FloatArray:
        """Gap of a crown in the middle of the strips [m]."""
        return self.gaps["fresh"]

    @cached_property
    def gaps(self) -> Mapping[str, FloatArray]:
        """Gaps by description: fresh, off centre and worn [m]."""
        return {
            "fresh": self.case.gap(self.grid),
            "off centre": self.case.gap(self.grid, centre=0.05),
            "worn": self.case.gap(self.grid, centre=-0.02, groove=0.3),
        }

    def point(self, creepage: Creepage | None = None, **changes: Any) -> OperatingPoint:
        """Return the operating point of the case with another creepage and other values."""
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
        """Solve one contact with the shared model, by default the base contact."""
        return self.model.solve_one(
            self.gap if gap is None else gap,
            self.case.curvature,
            point or self.point(),
            wear_compliance,
            warm,
        )

    def batch(self, points: Sequence[OperatingPoint], gaps: Sequence[FloatArray]) -> ContactBatch:
        """Return contacts of the case with other operating points and gaps."""
        return ContactBatch.of(np.array(gaps), self.case.curvature, points)

    @cached_property
    def solution(self) -> ContactSolution:
        """The solution of the base contact."""
        return self.solve()

    @cached_property
    def solutions(self) -> Mapping[str, tuple[OperatingPoint, ContactSolution]]:
        """Operating points and solutions of all gaps with all creepages, by description."""
        return {
            f"{shape}, {slip}": (point, self.solve(point, gap))
            for shape, gap in self.gaps.items()
            for slip, point in ((slip, self.point(creep)) for slip, creep in CREEPAGES.items())
        }

    def require_overlap(self, case: str, solution: ContactSolution) -> None:
        """Check that no half-length exceeds that of the overlap, kappa a^2/2 = approach - gap."""
        overlap = solution.approach - self.gaps[case.partition(",")[0]]
        most = np.sqrt(2.0 * np.maximum(overlap, 0.0) / self.case.curvature)
        place = int(np.argmax(solution.half_length - most))
        require(
            solution.half_length[place] <= _MOST_OF_OVERLAP * most[place],
            f"{case}: half_length is {solution.half_length[place]:.4g} m in a strip whose"
            f" overlap, approach less gap, has {most[place]:.4g} m; both must be in metres",
        )

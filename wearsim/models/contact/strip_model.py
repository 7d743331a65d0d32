"""Base class of contact models that solve loaded strips on any gap profile."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from wearsim.errors import ContactError
from wearsim.mechanics.hertz.elasticity import ElasticPair, combine
from wearsim.mechanics.hertz.ellipse import hertz
from wearsim.mechanics.slender.influence import influence_table
from wearsim.models.tangential.base import (
    Strips,
    TangentialTheory,
    complete,
    friction_per_strip,
    local_slip,
)
from wearsim.plugins import ContactModel
from wearsim.types import (
    ContactFields,
    ContactSolution,
    FloatArray,
    Grid,
    Material,
    OperatingPoint,
)

_WIDTH = 1.2  # of the grid, over that of the Hertzian patch
_STRIPS = 121


class StripModel(ContactModel):
    """Contact model with semi-elliptic pressure along rolling in each strip.

    Parameters
    ----------
    theory : TangentialTheory
        Theory of the tangential contact.
    grid : Grid
        The strips.
    materials : tuple of Material
        Materials of cylinder and roller.
    """

    def __init__(
        self, theory: TangentialTheory, grid: Grid, materials: tuple[Material, Material]
    ) -> None:
        self.theory = theory
        self._grid = grid
        self._pair: ElasticPair = combine(*materials)
        self._table = influence_table(grid.strips)

    def fields(
        self,
        solution: ContactSolution,
        gap: FloatArray,
        longitudinal_curvature: float,
        point: OperatingPoint,
        points_along: int = 101,
    ) -> ContactFields:
        """Return pressure, traction and slip in a solved contact."""
        strips = self._strips(
            solution.line_load,
            solution.half_length,
            longitudinal_curvature,
            solution.approach,
            solution.iterations,
        )
        return self.theory.fields(
            strips,
            self._pair,
            local_slip(strips, point, solution.longitudinal_creepage),
            friction_per_strip(strips, point),
            point.rolling_speed,
            points_along,
        )

    def _complete(
        self,
        line_load: FloatArray,
        half_length: FloatArray,
        longitudinal_curvature: float,
        approach: float,
        iterations: int,
        point: OperatingPoint,
    ) -> ContactSolution:
        """Solve the tangential problem of a solved normal contact."""
        strips = self._strips(line_load, half_length, longitudinal_curvature, approach, iterations)
        return complete(self.theory, strips, self._pair, point)

    def _strips(
        self,
        line_load: FloatArray,
        half_length: FloatArray,
        longitudinal_curvature: float,
        approach: float,
        iterations: int,
    ) -> Strips:
        loaded = line_load > 0.0
        peak = 2.0 * (line_load[loaded] / (np.pi * half_length[loaded])).max()
        return Strips(
            y=self._grid.y,
            half_length=half_length,
            line_load=line_load,
            spacing=self._grid.spacing,
            longitudinal_curvature=longitudinal_curvature,
            approach=float(approach),
            peak_pressure=float(peak),
            iterations=iterations,
        )


def grid_about_hertz(
    options: object,
    gap_curvature: float,
    longitudinal_curvature: float,
    normal_force: float,
    materials: tuple[Material, Material],
) -> Grid:
    """Return 121 strips over 1.2 times the width of the Hertzian patch.

    Parameters
    ----------
    options : Options
        Not used.
    gap_curvature, longitudinal_curvature : float
        Relative curvatures across and along rolling [1/m].
    normal_force : float
        Load [N].
    materials : tuple of Material
        Materials of the two bodies.
    """
    modulus = combine(*materials).contact_modulus
    patch = hertz(0.5 * longitudinal_curvature, 0.5 * gap_curvature, normal_force, modulus)
    return Grid.spanning(-_WIDTH * patch.b, _WIDTH * patch.b, _STRIPS)


def check_edges(grid: Grid, line_load: FloatArray, state: Mapping[str, Any]) -> None:
    """Raise an error if a contact reaches its first or last strip.

    Parameters
    ----------
    grid : Grid
        The strips; not checked if there are only one or two.
    line_load : ndarray, shape (strips,) or (contacts, strips)
        q [N/m].
    state : mapping
        State of the error.

    Raises
    ------
    ContactError
        If the line load of an edge strip is positive.
    """
    at_edge = (line_load[..., 0] > 0.0) | (line_load[..., -1] > 0.0)
    if grid.strips > 2 and at_edge.any():
        y = grid.y
        raise ContactError(
            f"the contact reaches the edge of its strips, which span {y[0] * 1e3:.4g} to"
            f" {y[-1] * 1e3:.4g} mm; raise contact.width or move contact.centre",
            dict(state),
        )

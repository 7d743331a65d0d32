"""The grid that models of strips suggest, and the check that contact ends before it does."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from wearsim.errors import ContactError
from wearsim.mechanics.hertz.elasticity import combine
from wearsim.mechanics.hertz.ellipse import hertz
from wearsim.types import FloatArray, Grid, Material

_ROOM = 1.2  # half of the strips' span over half of the patch's
_STRIPS = 121


def grid_about_hertz(
    gap_curvature: float,
    longitudinal_curvature: float,
    normal_force: float,
    materials: tuple[Material, Material],
) -> Grid:
    """Return 121 strips over 1.2 times the width of the Hertzian patch.

    Parameters
    ----------
    gap_curvature, longitudinal_curvature : float
        Relative curvatures across and along rolling [1/m].
    normal_force : float
        Load [N].
    materials : tuple of Material
        Of the two bodies.
    """
    modulus = combine(*materials).contact_modulus
    patch = hertz(0.5 * longitudinal_curvature, 0.5 * gap_curvature, normal_force, modulus)
    return Grid.spanning(-_ROOM * patch.b, _ROOM * patch.b, _STRIPS)


def check_edges(grid: Grid, line_load: FloatArray, state: Mapping[str, Any]) -> None:
    """Raise ContactError if a contact reaches the first or the last of its strips.

    Parameters
    ----------
    grid : Grid
        The strips; one or two of them have no edge to reach.
    line_load : ndarray, shape (strips,) or (contacts, strips)
        q [N/m].
    state : mapping
        What led there, for the error.

    Raises
    ------
    ContactError
        If a line load at an edge is positive.
    """
    at_edge = (line_load[..., 0] > 0.0) | (line_load[..., -1] > 0.0)
    if grid.strips > 2 and at_edge.any():
        y = grid.y
        raise ContactError(
            f"the contact reaches the edge of its strips, which span {y[0] * 1e3:.4g} to"
            f" {y[-1] * 1e3:.4g} mm; raise contact.width or move contact.centre",
            dict(state),
        )

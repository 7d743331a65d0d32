"""Contact must end before the strips do: the check that all models of strips share."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from wearsim.errors import ContactError
from wearsim.types import FloatArray, Grid


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

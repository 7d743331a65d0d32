"""Strips of contacts that end where the roller ends."""

from __future__ import annotations

import math

import numpy as np

from wearsim.scenario import Scenario
from wearsim.types import Grid

_ROUNDING = 1e-12
STRIPS_BEYOND = 2  # the ends of a roller, so that no contact reaches the first or last strip
STRIPS_PER_EDGE = 5  # over the part of an edge in contact
LEAST_PER_EDGE = 3  # with fewer there is a warning
MOST_STRIPS_PER_ROLLER = 241  # chosen for an edge


def width_between_edges(scenario: Scenario) -> float:
    """Return the width of a roller without its rounded or cut edges [m]; infinite if not given."""
    roller = scenario.roller
    return (roller.width or math.inf) - 2.0 * (roller.edge_radius or roller.chamfer or 0.0)


def roller_grid(scenario: Scenario, strips: int, away: float = 0.0) -> Grid:
    """Return strips over the width of all rollers, and further ones beyond their ends.

    The ends of the first roller are edges of strips, so that the contact is exactly as wide.

    Parameters
    ----------
    scenario : Scenario
        With the width of the rollers.
    strips : int
        Number of strips over the width of one roller and those beyond its ends.
    away : float
        Distance by which rollers may be away from their offsets [m].
    """
    width, beyond = scenario.roller.width or 0.0, STRIPS_BEYOND
    offsets = np.array(scenario.per_roller(scenario.roller.offset))
    spacing = width / max(strips - 2 * beyond, 1)
    before, after = (
        math.ceil(float(distance + away) / spacing - _ROUNDING) + beyond
        for distance in (offsets[0] - offsets.min(), offsets.max() - offsets[0])
    )
    start = float(offsets[0]) - 0.5 * width
    stop = start + width + after * spacing
    start -= before * spacing
    return Grid.spanning(start, stop, round((stop - start) / spacing))


def edge_in_contact(scenario: Scenario, load: float) -> float:
    """Return the width of an edge that comes into contact under `load` [N], roughly [m].

    It is where the edge is less than the elastic approach below the crown, which in a line contact
    is about twelve times q/(pi E*).
    """
    roller, modulus = scenario.roller, scenario.pair.contact_modulus
    approach = 12.0 * load / (roller.width or math.inf) / (math.pi * modulus)
    if roller.edge_radius:
        return min(roller.edge_radius, math.sqrt(2.0 * roller.edge_radius * approach))
    return min(roller.chamfer, approach / math.tan(roller.chamfer_angle)) if roller.chamfer else 0.0


def strips_of_roller(scenario: Scenario, least: int, load: float) -> int:
    """Return the number of strips for the width of a roller: `least`, or more for its edges."""
    width, edge = scenario.roller.width or 0.0, edge_in_contact(scenario, load)
    resolves = edge * MOST_STRIPS_PER_ROLLER > STRIPS_PER_EDGE * width
    needed = math.ceil(STRIPS_PER_EDGE * width / edge) if resolves else 0
    strips = max(least, needed) + 2 * STRIPS_BEYOND
    return strips + (strips + 1) % 2

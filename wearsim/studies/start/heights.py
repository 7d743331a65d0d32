"""Start profiles of the bodies: their extent, and heights between strips."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from wearsim.scenario import Scenario
from wearsim.types import FloatArray, Profile


class StartExtent(NamedTuple):
    """Extent of the start profiles of a scenario.

    Parameters
    ----------
    low, high : float
        Outer positions of the profiles on the track [m].
    relief : float
        Greatest less least height, of roller and cylinder together [m].
    """

    low: float
    high: float
    relief: float


def start_extent(scenario: Scenario, offsets: Iterable[float]) -> StartExtent:
    """Return the extent of the start profiles, of which there is one; offsets of rollers [m]."""
    cylinder = scenario.cylinder
    bodies = [body for body in (cylinder.profile, cylinder.start_surface) if body is not None]
    rollers = ((roller_profile(scenario, number), end) for number, end in enumerate(offsets))
    ends = [(body.y, 0.0) for body in bodies]
    ends += [(profile.y, offset) for profile, offset in rollers if profile is not None]
    return StartExtent(
        min(float(y[0]) + offset for y, offset in ends),
        max(float(y[-1]) + offset for y, offset in ends),
        sum(float(np.ptp(body.height, axis=-1).max()) for body in bodies)
        + max((float(np.ptp(profile.height)) for profile in scenario.roller.profiles), default=0.0),
    )


def roller_profile(scenario: Scenario, number: int) -> Profile | None:
    """Return the start profile of a roller by its number."""
    profiles = scenario.roller.profiles
    return profiles[min(number, len(profiles) - 1)] if profiles else None


def excess_between_strips(values: FloatArray) -> float:
    """Return by how much the greatest of values, (..., strips), may be exceeded between strips.

    It is half the greatest difference from a neighbour: that of a straight line to the edge of the
    strip.
    """
    *row, strip = np.unravel_index(values.argmax(), values.shape)
    return 0.5 * float(np.ptp(values[tuple(row)][max(strip - 1, 0) : strip + 2]))

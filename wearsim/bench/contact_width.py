"""How wide a contact is, finer than a strip: where the line load would fall to zero."""

from __future__ import annotations

import math

import numpy as np

from wearsim.types import FloatArray

_SHOWN = 4  # strips from an edge inwards that show how the line load falls
_ALIKE = 0.1  # of the second strip's line load: how far the first may be from the parabola's


def contact_width(line_load: FloatArray, spacing: float) -> float:
    """Return the distance between a contact's outermost edges [m].

    A strip at an edge is in contact in part, and models differ in what they give it: the line load
    at its middle, or the mean over it. So the edge is where the parabola through the line loads of
    the next three strips vanishes, which on an ellipse is exact for both. Where the first strip
    carries neither what that parabola has at its middle nor its mean, the line load does not fall
    like a parabola, and the straight line through the first two takes its place.

    Parameters
    ----------
    line_load : ndarray, shape (strips,)
        q [N/m], some of it positive.
    spacing : float
        Width of a strip [m].
    """
    inside = np.flatnonzero(line_load > 0.0)
    across = line_load[inside[0] : inside[-1] + 1]
    return (len(across) - 1 + _edge(across) + _edge(across[::-1])) * spacing


def _edge(line_load: FloatArray) -> float:
    """Return how far, in strips, the edge lies outside the middle of the first strip."""
    shown = line_load[:_SHOWN].tolist()
    parabolic = _edge_of_parabola(shown) if len(shown) == _SHOWN and min(shown) > 0.0 else None
    edge = _edge_of_line(shown) if parabolic is None else parabolic
    return min(max(edge, -0.5), 1.0)


def _edge_of_line(shown: list[float]) -> float:
    """Return the same by a straight line, or the outer side of the strip where there is none."""
    if len(shown) < 2 or shown[1] <= shown[0]:
        return 0.5
    return shown[0] / (shown[1] - shown[0])


def _edge_of_parabola(shown: list[float]) -> float | None:
    """Return the same by a parabola through all but the first, if that one agrees with it."""
    first, second, third, fourth = shown
    bend = fourth - 2.0 * third + second
    slope = third - second - 0.5 * bend  # at the second strip
    discriminant = slope**2 - 2.0 * bend * second
    if slope <= 0.0 or discriminant < 0.0:
        return None
    steepness = math.sqrt(discriminant)  # at the edge
    edge = 2.0 * second / (slope + steepness) - 1.0
    covered = min(max(edge + 0.5, 0.0), 1.0)
    at_middle, mean = (
        second - slope + 0.5 * bend,
        steepness * covered * (edge + 0.5 - 0.5 * covered),
    )
    slack = _ALIKE * second
    agrees = min(at_middle, mean) - slack <= first <= max(at_middle, mean) + slack
    return edge if agrees else None

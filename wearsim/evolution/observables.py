"""What is observed of a worn profile, defined once."""

from __future__ import annotations

import numpy as np

from wearsim.types import FloatArray


def depth(worn: FloatArray) -> FloatArray:
    """Return the greatest worn depth along the last axis [m]."""
    greatest: FloatArray = worn.max(axis=-1)
    return greatest


def width(y: FloatArray, worn: FloatArray, threshold: float) -> float:
    """Return the extent of the groove where it is deeper than `threshold` [m].

    The crossing is interpolated between strips, so that the width grows smoothly.
    """
    above = np.flatnonzero(worn > threshold)
    if len(above) == 0:
        return 0.0
    first, last = int(above[0]), int(above[-1])
    left, right = y[first], y[last]
    if first > 0:
        part = (worn[first] - threshold) / (worn[first] - worn[first - 1])
        left = y[first] - part * (y[first] - y[first - 1])
    if last < len(y) - 1:
        part = (worn[last] - threshold) / (worn[last] - worn[last + 1])
        right = y[last] + part * (y[last + 1] - y[last])
    return float(right - left)


def worn_volume(worn: FloatArray, spacing: float, radius: float) -> FloatArray:
    """Return the worn volume of a body of revolution, 2 pi R times the worn area [m^3].

    First order in depth over radius: the volume for which Archard's balance with energy is exact.
    """
    volume: FloatArray = 2.0 * np.pi * radius * worn.sum(axis=-1) * spacing
    return volume


def centroid(y: FloatArray, worn: FloatArray) -> float:
    """Return the axial position of the worn area's centre [m], or 0 where nothing is worn."""
    total = worn.sum()
    return float(np.dot(y, worn) / total) if total > 0.0 else 0.0


def oscillation(line_load: FloatArray) -> float:
    """Return how much a line load jumps from strip to strip, relative to its peak.

    The median over the loaded strips of the second difference's size: a smooth contact gives
    O(dy^2), loads that alternate between strips give order one. The median leaves the contact's
    edges and honest kinks out of account.
    """
    loaded = np.flatnonzero(line_load > 0.0)
    if len(loaded) < 3:
        return 0.0
    inside = line_load[loaded[0] : loaded[-1] + 1]
    second = np.abs(np.diff(inside, n=2))
    return float(np.median(second) / line_load.max())

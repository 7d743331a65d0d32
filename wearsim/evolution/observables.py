"""Observables of a worn profile, and sums independent of the number of realisations."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from wearsim.types import FloatArray, IntArray


def width(y: FloatArray, worn: FloatArray, threshold: float) -> float:
    """Return the extent of the groove where it is deeper than `threshold` [m].

    The crossing is interpolated linearly between strips, so that the width grows continuously.
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

    First order in depth over radius: the volume for which Archard's wear law holds exactly.
    """
    volume: FloatArray = 2.0 * np.pi * radius * worn.sum(axis=-1) * spacing
    return volume


def centroid(y: FloatArray, worn: FloatArray) -> float:
    """Return the axial position of the worn area's centroid [m], or 0 without wear."""
    total = worn.sum()
    return float(np.dot(y, worn) / total) if total > 0.0 else 0.0


def oscillation(line_load: FloatArray) -> float:
    """Return the strip-to-strip oscillation of a line load, relative to its peak.

    It is the median over the loaded strips of the size of the second difference: O(dy^2) for a
    smooth contact, of order one for loads that alternate between strips. The median excludes the
    edges of the contact and single kinks of the profile.
    """
    loaded = np.flatnonzero(line_load > 0.0)
    if len(loaded) < 3:
        return 0.0
    second = np.abs(np.diff(line_load[loaded[0] : loaded[-1] + 1], n=2))
    return float(np.median(second) / line_load.max())


def is_every(places: IntArray, count: int) -> bool:
    """Return whether places are those of all `count` realisations in their order."""
    return len(places) == count and (count == 1 or bool((places == np.arange(count)).all()))


def values_between(
    values: Sequence[Callable[[float, float], float]], start: FloatArray, stop: FloatArray
) -> FloatArray:
    """Return ``values[v](start[v], stop[v])`` for each realisation v."""
    each = zip(values, start.tolist(), stop.tolist(), strict=True)
    return np.array([value(first, last) for value, first, last in each])


def sum_along(values: FloatArray, axis: int) -> FloatArray:
    """Return the sum along an axis, which is kept; a view if the axis has length one."""
    return values if values.shape[axis] == 1 else values.sum(axis=axis, keepdims=True)


def mean_along(values: FloatArray, axis: int) -> FloatArray:
    """Return the mean along an axis, which is kept; a view if the axis has length one."""
    return values if values.shape[axis] == 1 else values.mean(axis=axis, keepdims=True)


def sum_in_order(values: FloatArray, axis: int) -> FloatArray:
    """Return a sum whose round-off does not depend on the number of realisations in the batch.

    The order in which numpy sums along an axis depends on the lengths of the other axes.
    """
    if values.shape[axis] == 1:
        return values.squeeze(axis)
    return np.asarray(np.take(np.add.accumulate(values, axis=axis), -1, axis=axis))

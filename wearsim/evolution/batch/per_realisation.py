"""Numbers per realisation, and sums independent of the batch size."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from wearsim.types import FloatArray, IntArray


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

"""Numbers per realisation, and sums independent of the batch size."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from wearsim.types import FloatArray, Number


def first_of(numbers: Number) -> float:
    """Return a number shared by all realisations, or that of the first realisation."""
    return numbers if isinstance(numbers, float) else float(np.ravel(numbers)[0])


def values_between(
    values: Sequence[Callable[[float, float], float]], start: Number, stop: Number
) -> FloatArray:
    """Return ``values[v](start, stop)`` for each realisation v, with its own times [s] if given."""
    if len(values) == 1:  # broadcasting costs more than the value
        return np.array([values[0](first_of(start), first_of(stop))])
    first, last = (np.broadcast_to(time, len(values)).tolist() for time in (start, stop))
    return np.array([value(a, b) for value, a, b in zip(values, first, last, strict=True)])


def per_strip(number: Number) -> Number:
    """Return a number, or one per realisation, that broadcasts over a last axis of strips."""
    return number[..., None] if isinstance(number, np.ndarray) else number


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

"""Numbers that may differ from realisation to realisation, and sums that do not mind company."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from wearsim.types import FloatArray, Number


def one_of(numbers: Number) -> float:
    """Return a number that is one for all realisations, or that of the first."""
    return numbers if isinstance(numbers, float) else float(np.ravel(numbers)[0])


def each_between(
    values: Sequence[Callable[[float, float], float]], start: Number, stop: Number
) -> FloatArray:
    """Return values between two times [s], each between its own where these differ."""
    count = len(values)
    if count == 1:
        return np.array([values[0](one_of(start), one_of(stop))])
    first, last = (np.broadcast_to(time, count).tolist() for time in (start, stop))
    return np.array([value(a, b) for value, a, b in zip(values, first, last, strict=True)])


def per_strip(number: Number) -> Number:
    """Return a number, or one per realisation, to go with arrays whose last axis is strips."""
    return number[..., None] if isinstance(number, np.ndarray) else number


def sum_along(values: FloatArray, axis: int) -> FloatArray:
    """Return the sum along an axis, which stays; of a single entry, for nothing, itself."""
    return values if values.shape[axis] == 1 else values.sum(axis=axis, keepdims=True)


def mean_along(values: FloatArray, axis: int) -> FloatArray:
    """Return the mean along an axis, which stays; of a single entry, for nothing, itself."""
    return values if values.shape[axis] == 1 else values.mean(axis=axis, keepdims=True)


def sum_in_order(values: FloatArray, axis: int) -> FloatArray:
    """Return a sum that is the same to the bit however many realisations stand beside it.

    The order in which numpy sums an axis depends on the lengths of the others.
    """
    if values.shape[axis] == 1:
        return values.squeeze(axis)
    total: FloatArray = np.take(np.add.accumulate(values, axis=axis), -1, axis=axis)
    return total

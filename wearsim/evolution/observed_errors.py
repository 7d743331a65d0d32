"""Errors of observables of wear tests, such as power and peak pressure, due to steps and strips.

The coarse test of `strip_errors` has strips of twice the width and a greater tolerance of its
steps. Its observables differ from those of the test by at least the errors of the test where these
are proportional to the width of the strips, and by three times as much where they are proportional
to its square. The error estimate is the greatest of the last differences times a safety factor,
since a peak pressure rises and falls as single strips come into contact.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from wearsim.evolution.strip_errors import BACK, Course
from wearsim.types import FloatArray

COVER = 1.5  # safety factor on the greatest of the last differences


def observed_errors(
    coarse: Course | None, passes: FloatArray, observed: Mapping[str, FloatArray]
) -> dict[str, FloatArray]:
    """Return the estimated errors of observables of a test.

    Parameters
    ----------
    coarse : Course or None
        The coarse test with its observables; without it the errors are not known, nan.
    passes : ndarray, shape (points,)
        Rising, from the start of the test, 0.
    observed : mapping of str to ndarray, shape (points, ...)
        Observables of the test by name; angles end on "angle" [rad].
    """
    if coarse is None:
        return {name: np.full(values.shape, np.nan) for name, values in observed.items()}
    steps = np.array([0.0, *coarse.passes])
    there = np.append(steps[steps < passes[-1]], passes[-1])
    # logarithmic but for the first step, before which a pressure is that of the unworn bodies
    first = float(max(there[1:].min(initial=np.inf), 1e-300))
    at_steps, at_there, at_passes = (np.log1p(points / first) for points in (steps, there, passes))
    # the error at a point is the greatest of the last steps, as it may cross zero
    back = there[None, :] / np.where(there > 0.0, there, 1.0)[:, None]
    decay = np.where((back > 1.0 / BACK) & (back <= 1.0), np.sqrt(back), 0.0) + np.eye(
        len(there)
    ) * (there == 0.0)
    errors = {}
    for name, values in observed.items():
        own = values.reshape(len(passes), -1)
        other = np.array([np.ravel(item[name]) for item in coarse.observed])
        fine = _interpolated(at_there, at_passes, own)
        difference = np.abs(_interpolated(at_there, at_steps, other) - fine)
        size = np.where(fine != 0.0, np.abs(fine), np.inf)
        if name.endswith("angle"):
            difference, size = np.minimum(difference, math.tau - difference), np.ones_like(fine)
        greatest = (decay[..., None] * (difference / size)).max(axis=1)
        part = np.column_stack([np.interp(at_passes, at_there, one) for one in greatest.T])
        scale = 1.0 if name.endswith("angle") else np.abs(own)
        errors[name] = (COVER * part * scale).reshape(values.shape)
    return errors


def _interpolated(at: FloatArray, points: FloatArray, columns: FloatArray) -> FloatArray:
    """Return columns of values at points, by a power law where they are positive."""
    found = []
    for values in columns.T:
        if (values > 0.0).all():
            found.append(np.exp(np.interp(at, points, np.log(values))))
        elif (values[1:] > 0.0).all() and values[0] == 0.0 and len(values) > 1:
            # what is worn: a power law from the first step on
            logs = np.interp(at, points[1:], np.log(values[1:]))
            found.append(np.where(at < points[1], np.interp(at, points, values), np.exp(logs)))
        else:
            found.append(np.interp(at, points, values))
    return np.column_stack(found)

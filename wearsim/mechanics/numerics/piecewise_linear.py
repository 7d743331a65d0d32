"""Piecewise linear function of time with exact integrals."""

from __future__ import annotations

import math

import numpy as np

from wearsim.types import FloatArray

_KNOWN = 16  # times whose integrals are kept


class PiecewiseLinear:
    """Function of time that is linear between its samples, defined from the first to the last.

    Parameters
    ----------
    time : ndarray, shape (samples,)
        Increasing times [s].
    value : ndarray, shape (samples,)
        Values at those times.
    """

    def __init__(self, time: FloatArray, value: FloatArray) -> None:
        self.time, self.value = time, value
        steps, first, last = np.diff(time), value[:-1], value[1:]
        areas = 0.5 * steps * (first + last)
        squares = steps * (first**2 + first * last + last**2) / 3.0
        self._area = np.concatenate([[0.0], np.cumsum(areas)])
        self._square = np.concatenate([[0.0], np.cumsum(squares)])
        self._known: dict[float, tuple[float, float]] = {}

    def at(self, time: FloatArray) -> FloatArray:
        """Return the value at each `time` [s], shape as `time`."""
        return np.interp(time, self.time, self.value)

    def _integrals(self, time: float) -> tuple[float, float]:
        """Return the integrals of the value and of its square from the first sample to `time`.

        Those of the last times are kept: the solutions of a step ask for the same ones.
        """
        if (known := self._known.get(time)) is not None:
            return known
        # Python floats, which are faster than arrays for the few values of a step
        k = min(max(int(self.time.searchsorted(time)) - 1, 0), len(self.time) - 2)
        start, stop = float(self.time[k]), float(self.time[k + 1])
        first, last = float(self.value[k]), float(self.value[k + 1])
        part = min(max((time - start) / (stop - start), 0.0), 1.0)
        here, duration = first + (last - first) * part, time - start
        square = duration * (first * first + first * here + here * here) / 3.0
        area = float(self._area[k]) + 0.5 * duration * (first + here)
        if len(self._known) >= _KNOWN:
            self._known = {}
        integrals = self._known[time] = area, float(self._square[k]) + square
        return integrals

    def mean(self, start: float, stop: float) -> float:
        """Return the exact mean between two times [s]."""
        if stop <= start:
            return float(self.at(np.array([start]))[0])
        return (self._integrals(stop)[0] - self._integrals(start)[0]) / (stop - start)

    def extremes(self, start: float, stop: float) -> tuple[float, float]:
        """Return the exact least and greatest value between two times [s]."""
        inside = self.value[(self.time >= start) & (self.time <= stop)]
        values = np.concatenate([self.at(np.array([start, stop])), inside])
        return float(values.min()), float(values.max())

    def deviation(self, start: float, stop: float) -> float:
        """Return the exact standard deviation between two times [s]."""
        if stop <= start:
            return 0.0
        before, after = self._integrals(start), self._integrals(stop)
        mean, square = ((b - a) / (stop - start) for a, b in zip(before, after, strict=True))
        return math.sqrt(max(0.0, square - mean**2))

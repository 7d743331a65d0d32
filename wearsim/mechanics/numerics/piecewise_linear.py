"""Piecewise linear functions of time with exact integrals."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from wearsim.types import FloatArray, IntArray

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
        self._area, self._square = _integrals_to_samples(time, value)
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


@dataclass(frozen=True)
class Paths:
    """Paths of a process in several realisations, linear between the same times.

    Parameters
    ----------
    time : ndarray, shape (samples,)
        Increasing times [s].
    value : ndarray, shape (paths, samples)
        Values at those times.
    area, square : ndarray, shape (paths, samples)
        Integrals of the value and of its square up to those times.
    row : ndarray of int, shape (realisations,)
        Path of each realisation.
    """

    time: FloatArray
    value: FloatArray
    area: FloatArray
    square: FloatArray
    row: IntArray

    @classmethod
    def through(cls, time: FloatArray, value: FloatArray) -> Paths:
        """Return the paths through values at some times, (paths, samples) or one of (samples,)."""
        value = np.atleast_2d(value)
        return cls(time, value, *_integrals_to_samples(time, value), np.arange(len(value)))

    @classmethod
    def joined(cls, paths: Sequence[Paths]) -> Paths:
        """Return the paths of several tests, all with the same times."""
        value, area, square = (
            np.concatenate([getattr(item, name)[item.row] for item in paths])
            for name in ("value", "area", "square")
        )
        return cls(paths[0].time, value, area, square, np.arange(len(value)))

    def at(self, realisations: IntArray) -> Paths:
        """Return the paths of some realisations, by number and in that order."""
        return replace(self, row=self.row[realisations])

    def of_first(self, time: FloatArray) -> FloatArray:
        """Return the values of the first realisation at several times [s], shape as `time`."""
        return np.asarray(np.interp(time, self.time, self.value[self.row[0]]))

    def mean(self, start: FloatArray, stop: FloatArray) -> FloatArray:
        """Return the exact mean of each path between its two times [s], shape (realisations,)."""
        return self._moments(start, stop)[0]

    def deviation(self, start: FloatArray, stop: FloatArray) -> FloatArray:
        """Return the exact standard deviation of each path between its two times [s]."""
        mean, square = self._moments(start, stop)
        return np.sqrt(np.maximum(square - mean**2, 0.0))

    def _moments(self, start: FloatArray, stop: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the means of each path and of its square; those at one time if both are equal."""
        value, *before = self._up_to(start)
        _, *after = self._up_to(stop)
        instant = stop <= start
        duration = np.where(instant, 1.0, stop - start)
        area, square = ((b - a) / duration for a, b in zip(before, after, strict=True))
        return np.where(instant, value, area), np.where(instant, value**2, square)

    def _up_to(self, time: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return each value at its `time`, and its integral and that of its square up to it."""
        row, place = self.row, self.time.searchsorted(time) - 1
        place = np.minimum(np.maximum(place, 0), len(self.time) - 2)
        start, first = self.time[place], self.value[row, place]
        duration = time - start
        part = np.minimum(np.maximum(duration / (self.time[place + 1] - start), 0.0), 1.0)
        value = first + (self.value[row, place + 1] - first) * part
        area = self.area[row, place] + 0.5 * duration * (first + value)
        square = duration * (first * first + first * value + value * value) / 3.0
        return value, area, self.square[row, place] + square


def _integrals_to_samples(time: FloatArray, value: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the integrals of values and of their squares up to each sample, on the last axis."""
    steps, first, last = np.diff(time), value[..., :-1], value[..., 1:]
    areas = 0.5 * steps * (first + last)
    squares = steps * (first**2 + first * last + last**2) / 3.0
    start = np.zeros((*value.shape[:-1], 1))
    area, square = (
        np.concatenate([start, np.cumsum(parts, axis=-1)], axis=-1) for parts in (areas, squares)
    )
    return area, square

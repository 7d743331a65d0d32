"""Points on smooth curves of a cam: by the distance of the chords from the curve, or by number.

A chord of length h deviates from a curve of curvature kappa by kappa h^2/8, so that the number of
chords within a tolerance t is the integral of sqrt(kappa/(8 t)) over the length.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import TypeAlias

import numpy as np

from wearsim.types import FloatArray

#: points of some curves at rising angles, shape (curves, angles), x + i y [m]
Points: TypeAlias = Callable[[FloatArray], FloatArray]

_FINE = 801  # samples of a part
_BETWEEN = np.linspace(0.0, 1.0, 11)[1:-1]  # places on a chord at which its distance is computed
_MOST_TRIALS = 20
_CLOSE = 0.9  # of the tolerance, at which the search for the number of chords ends


def angles_by_chord(points: Points, start: float, stop: float, tolerance: float) -> FloatArray:
    """Return angles whose chords stay within a tolerance of some smooth curves.

    Parameters
    ----------
    points : callable
        Points of the curves at angles.
    start, stop : float
        Ends of the part, which are the first and the last angle [rad].
    tolerance : float
        Greatest distance of a chord from its curve [m].
    """
    fine = np.linspace(start, stop, _FINE)
    step = np.diff(points(fine), axis=1)
    length = np.abs(step)
    turned = np.abs(np.angle(step[:, 1:] * np.conj(step[:, :-1])))
    chords = np.sqrt(turned * 0.5 * (length[:, 1:] + length[:, :-1]) / (8.0 * tolerance)).max(0)
    chords = np.pad(chords, 1, mode="edge")
    passed = np.concatenate([[0.0], np.cumsum(0.5 * (chords[1:] + chords[:-1]))])
    passed += 1e-9 * np.arange(_FINE)  # rises also on straight lines
    count = max(1, math.ceil(passed[-1]))
    for _ in range(_MOST_TRIALS):
        angles = np.interp(np.linspace(0.0, passed[-1], count + 1), passed, fine)
        angles[0], angles[-1] = start, stop
        away = _deviation(points, angles)
        if away <= tolerance:
            break
        count = max(count + 1, math.ceil(count * min(2.0, math.sqrt(away / (_CLOSE * tolerance)))))
    return angles


def _deviation(points: Points, angles: FloatArray) -> float:
    """Return the greatest distance of the curves from the chords between angles [m]."""
    low, high = angles[:-1, None], angles[1:, None]
    between = points((low + (high - low) * _BETWEEN).ravel())
    ends = points(angles)
    chord = np.repeat(np.diff(ends, axis=1), len(_BETWEEN), axis=1)
    away = between - np.repeat(ends[:, :-1], len(_BETWEEN), axis=1)
    length = np.maximum(np.abs(chord), np.finfo(float).tiny)
    return float(np.abs((away * np.conj(chord)).imag / length).max())


def angles_by_number(parts: Sequence[tuple[Points, float, float]], number: int) -> list[FloatArray]:
    """Return angles of points that are equally spaced along the first curve of all parts.

    Parameters
    ----------
    parts : sequence of (callable, float, float)
        Points at angles, start and stop of each part, in the order of the angle.
    number : int
        Number of points; the first is at the start of the first part.

    Returns
    -------
    list of ndarray
        Angles in each part [rad].
    """
    fine = [np.linspace(start, stop, _FINE) for _, start, stop in parts]
    lengths = [
        np.concatenate([[0.0], np.cumsum(np.abs(np.diff(points(angles)[0])))])
        for (points, _, _), angles in zip(parts, fine, strict=True)
    ]
    ends = np.cumsum([0.0, *(length[-1] for length in lengths)])
    wanted = ends[-1] * np.arange(number) / number
    places = np.searchsorted(ends, wanted, side="right") - 1
    return [
        np.interp(wanted[places == part] - ends[part], length, angles)
        for part, (length, angles) in enumerate(zip(lengths, fine, strict=True))
    ]

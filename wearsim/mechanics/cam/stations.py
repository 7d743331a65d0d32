"""Stations along the angle of a cam: Chebyshev-Lobatto points with Clenshaw-Curtis weights.

The weights integrate a polynomial of degree n - 1 through n points exactly: Clenshaw, Curtis,
Numerische Mathematik 2 (1960), DOI 10.1007/BF01386223. Between the points that polynomial is
evaluated by the barycentric formula: Berrut, Trefethen, SIAM Review 46 (2004),
DOI 10.1137/S0036144502417715.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import TypeAlias

import numpy as np

from wearsim.mechanics.cam.motion import Panel
from wearsim.types import FloatArray, IntArray

NUMBERS = (7, 13, 25)  # of stations on a panel; every set contains the one before
_MOST_HALVINGS = 6
_SAMPLES = 193  # of a panel
_REFINED, _REFINEMENTS = 33, 7  # samples about the greatest one; the last 2e-11 of a panel apart
_EQUAL = 1e-13  # relative difference of equal values of two panels


@lru_cache
def lobatto(number: int) -> tuple[FloatArray, FloatArray]:
    """Return the Chebyshev-Lobatto points on [0, 1] and their weights; one point is the middle."""
    if number == 1:
        return np.array([0.5]), np.ones(1)
    n = number - 1
    points = 0.5 - 0.5 * np.cos(np.pi * np.arange(number) / n)
    even = np.arange(2, n + 1, 2)
    factor = np.where(even == n, 1.0, 2.0) / (even**2 - 1.0)
    weights = (1.0 - np.cos(np.pi * np.outer(np.arange(number), even) / n) @ factor) / n
    weights[[0, -1]] *= 0.5
    return points, weights


def interpolation(number: int, places: FloatArray) -> FloatArray:
    """Return the matrix that interpolates values at `lobatto` points.

    Parameters
    ----------
    number : int
        Number of points.
    places : ndarray, shape (places,)
        Positions between 0 and 1.

    Returns
    -------
    ndarray, shape (places, number)
    """
    if number == 1:
        return np.ones((len(places), 1))
    signs = np.where(np.arange(number) % 2, -1.0, 1.0)
    signs[[0, -1]] *= 0.5
    difference = np.asarray(places)[:, None] - lobatto(number)[0]
    hit = difference == 0.0
    matrix = signs / np.where(hit, 1.0, difference)
    matrix = np.where(hit.any(axis=1, keepdims=True), hit.astype(np.float64), matrix)
    return np.asarray(matrix / matrix.sum(axis=1, keepdims=True))


@dataclass(frozen=True)
class Stations:
    """Stations of all panels, in the order of the angle; two at an angle between panels.

    Parameters
    ----------
    panels : tuple of Panel
        Panels, halved where a polynomial would need too many points.
    numbers : tuple of int
        Stations on each.
    """

    panels: tuple[Panel, ...]
    numbers: tuple[int, ...]

    @property
    def count(self) -> int:
        """Number of stations."""
        return sum(self.numbers)

    @cached_property
    def panel(self) -> IntArray:
        """Number of the panel of each station."""
        return np.repeat(np.arange(len(self.panels)), self.numbers)

    @cached_property
    def first(self) -> IntArray:
        """Number of the first station of each panel."""
        return np.cumsum([0, *self.numbers[:-1]])

    @cached_property
    def groups(self) -> list[tuple[IntArray, IntArray]]:
        """Panels with equal numbers of stations: their numbers, and those of their stations."""
        numbers = np.array(self.numbers)
        panels = [np.flatnonzero(numbers == number) for number in sorted(set(self.numbers))]
        return [(p, self.first[p, None] + np.arange(numbers[p[0]])) for p in panels]

    @cached_property
    def angle(self) -> FloatArray:
        """Angle of each station, shape (stations,) [rad]."""
        panels = zip(self.panels, self.numbers, strict=True)
        return np.concatenate([p.start + (p.stop - p.start) * lobatto(n)[0] for p, n in panels])

    @cached_property
    def weight(self) -> FloatArray:
        """Weight of each station in an integral over a turn, shape (stations,) [rad]."""
        panels = zip(self.panels, self.numbers, strict=True)
        return np.concatenate([(p.stop - p.start) * lobatto(n)[1] for p, n in panels])

    def values_at(self, values: FloatArray, samples: int) -> tuple[FloatArray, FloatArray]:
        """Return values between the stations.

        Parameters
        ----------
        values : ndarray, shape (stations, ...)
        samples : int
            Equally spaced points of every panel, its ends among them.

        Returns
        -------
        angle : ndarray, shape (points,)
        values : ndarray, shape (points, ...)
        """
        places = np.linspace(0.0, 1.0, samples)
        angles = [panel.start + (panel.stop - panel.start) * places for panel in self.panels]
        return np.concatenate(angles), self.values_between(values, places)

    def values_at_angles(self, values: FloatArray, angles: FloatArray) -> FloatArray:
        """Return values at increasing angles from 0 to 2 pi [rad], shape (angles, ...)."""
        interpolated = np.empty((len(angles), *values.shape[1:]))
        for panel, number, first in zip(self.panels, self.numbers, self.first, strict=True):
            low, high = np.searchsorted(angles, (panel.start, panel.stop)).tolist()
            high = len(angles) if panel is self.panels[-1] else high
            if low == high:
                continue
            places = (angles[low:high] - panel.start) / (panel.stop - panel.start)
            matrix = interpolation(number, np.clip(places, 0.0, 1.0))
            interpolated[low:high] = np.tensordot(matrix, values[first : first + number], axes=1)
        return interpolated

    def values_between(self, values: FloatArray, places: FloatArray) -> FloatArray:
        """Return values at positions of every panel, from 0 to 1, (points, ...)."""
        return np.concatenate(
            [
                np.tensordot(interpolation(number, places), values[first : first + number], axes=1)
                for number, first in zip(self.numbers, self.first, strict=True)
            ]
        )


def moved_stations(old: Stations, new: Stations) -> tuple[FloatArray, IntArray, IntArray]:
    """Return the matrix from values at stations to those at other stations of the same turn.

    Parameters
    ----------
    old, new : Stations

    Returns
    -------
    matrix : ndarray, shape (new stations, old stations)
        Interpolates within the panels of `old`; equal panels keep their values.
    old_part, new_part : ndarray of int, shape (old stations,), (new stations,)
        Number of the part of the turn of each station: parts lie between edges that both have; -1
        where both have the same panel.
    """
    panels = {
        (panel.start, panel.stop, number): int(first)
        for panel, number, first in zip(old.panels, old.numbers, old.first, strict=True)
    }
    starts = np.array([panel.start for panel in old.panels])
    common = sorted({panel.start for panel in old.panels} & {panel.start for panel in new.panels})
    matrix, parts = np.zeros((new.count, old.count)), []
    kept = np.zeros(old.count, dtype=np.bool_)
    for panel, number, first in zip(new.panels, new.numbers, new.first, strict=True):
        same = panels.get((panel.start, panel.stop, number))
        if same is not None:
            matrix[first : first + number, same : same + number] = np.eye(number)
            kept[same : same + number] = True
            parts += [-1] * number
            continue
        middle = 0.5 * (panel.start + panel.stop)
        angles = panel.start + (panel.stop - panel.start) * lobatto(number)[0]
        # on this side of an edge
        within = np.searchsorted(starts, angles + 1e-9 * (middle - angles), side="right") - 1
        for row, place in enumerate(within.tolist()):
            other, count, begin = old.panels[place], old.numbers[place], int(old.first[place])
            part = np.clip((angles[row] - other.start) / (other.stop - other.start), 0.0, 1.0)
            matrix[first + row, begin : begin + count] = interpolation(count, np.array([part]))[0]
        parts += [int(np.searchsorted(common, middle))] * number
    middles = np.array([0.5 * (panel.start + panel.stop) for panel in old.panels])[old.panel]
    return matrix, np.where(kept, -1, np.searchsorted(common, middles)), np.array(parts)


#: Values at angles [rad] within panels, both of shape (panels, points), or several of such values.
Quantity: TypeAlias = Callable[[Sequence[Panel], FloatArray], FloatArray]


def choose_stations(
    panels: Sequence[Panel], quantities: Quantity, tolerance: float, number: int | None = None
) -> Stations:
    """Return stations that represent some quantities and their integrals.

    Parameters
    ----------
    panels : sequence of Panel
        Smooth parts of the turn.
    quantities : Quantity
        Their values, shape (quantities, panels, points).
    tolerance : float
        Allowed error between the stations and of the integrals, of the greatest value.
    number : int, optional
        Stations on each moving panel, instead of 7, 13 or 25 as the tolerance requires; a dwell
        has one.
    """

    def values_at(places: FloatArray) -> FloatArray:
        start, stop = (np.array([panel[end] for panel in moving])[:, None] for end in (1, 2))
        return quantities(moving, start + (stop - start) * places)

    moving, places, halvings = list(panels), np.linspace(0.0, 1.0, _SAMPLES), 0
    scale = np.abs(values_at(places[::8])).max(axis=(1, 2))[:, None]
    moving = [panel for panel in panels if not panel.dwell and number is None]
    chosen = [(panel, 1 if panel.dwell else number or 1) for panel in panels if panel not in moving]
    while moving:
        exact = values_at(places)
        counts = [NUMBERS[-1] if halvings == _MOST_HALVINGS else 0] * len(moving)
        for count in reversed(NUMBERS):
            between = values_at(lobatto(count)[0]) @ interpolation(count, places).T
            error = np.abs(between - exact).max(axis=2)
            for place in np.flatnonzero((error <= tolerance * scale).all(axis=0)):
                counts[place] = count
        pairs = list(zip(moving, counts, strict=True))
        chosen += [pair for pair in pairs if pair[1]]
        middles = [(panel, 0.5 * (panel.start + panel.stop)) for panel, count in pairs if not count]
        moving = [
            half
            for panel, middle in middles
            for half in (panel._replace(stop=middle), panel._replace(start=middle))
        ]
        halvings += 1
    chosen.sort(key=lambda item: item[0].start)
    return Stations(*zip(*chosen, strict=True))


def extremes(panels: Sequence[Panel], quantities: Quantity) -> list[tuple[float, float]]:
    """Return the greatest value of quantities over a turn, and its angle [rad], the first if equal.

    Parameters
    ----------
    panels : sequence of Panel
    quantities : Quantity
        Their values, shape (quantities, panels, points); not a number where one is not defined.
    """
    theta = np.stack([np.linspace(panel.start, panel.stop, _SAMPLES) for panel in panels])
    values = quantities(panels, theta)
    found = np.zeros((2, *values.shape[:2]))
    found[0] = -np.inf
    rows = list(np.ndindex(values.shape[:2]))  # quantity and panel of each row that is searched
    theta, values = np.tile(theta, (len(values), 1)), values.reshape(len(rows), -1)
    spans: dict[tuple[int, ...], tuple[float, float]] = {}
    for refinement in range(1 + _REFINEMENTS):
        if refinement:
            rows = [(q, k) for q, k in rows if not panels[k].dwell]
            if not rows:
                break
            theta = np.stack([np.linspace(*spans[row], _REFINED) for row in rows])
            of_all = quantities([panels[k] for _, k in rows], theta)
            values = of_all[[q for q, _ in rows], range(len(rows))]
        values = np.where(np.isnan(values), -np.inf, values)
        for row, numbers, angles in zip(rows, values, theta, strict=True):
            place = int(numbers.argmax())
            if numbers[place] > found[0][row]:
                found[:, *row] = numbers[place], angles[place]
            spans[row] = angles[max(place - 1, 0)], angles[min(place + 1, len(angles) - 1)]
    greatest = []
    for of_panels in found.transpose(1, 2, 0).tolist():
        best, at = -np.inf, 0.0
        for value, angle in of_panels:
            if value > best and not math.isclose(value, best, rel_tol=_EQUAL):
                best, at = value, angle
        greatest.append((best, at))
    return greatest


def extreme(panels: Sequence[Panel], quantity: Quantity) -> tuple[float, float]:
    """Return the greatest value of one quantity, shape (panels, points), as of `extremes`."""
    return extremes(panels, lambda some, theta: quantity(some, theta)[None])[0]

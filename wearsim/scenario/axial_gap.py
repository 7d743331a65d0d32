"""Gap of two bodies along their axis, without start profiles, and the width of grooves in it."""

from __future__ import annotations

import math
from functools import cached_property

import numpy as np

from wearsim.plugins import AxialProfile
from wearsim.types import FloatArray

_POINTS = 4001  # of the tabulated drop
_FIRST = 1e-3  # m, first half-length of a table
_LONGEST = 1.0  # m, half-length of a body that nothing ends


class AxialGap:
    """Gap of roller and cylinder along the axis where neither is worn.

    Of a circular crown all values are those of its parabola; of other forms they are taken from a
    table, as they serve to choose strips and to forecast wear.

    Parameters
    ----------
    roller, cylinder : AxialProfile
        Forms of the bodies, both with their middle at y = 0.
    width : float or None
        Width of the roller [m].
    greatest : float
        Drop beyond which nothing is of interest, the radius of the roller [m].

    Attributes
    ----------
    crown_radius : float or None
        Relative crown radius of circular crowns, infinite for straight bodies [m].
    is_crowned : bool
        Whether the gap is a parabola, as contact models for ellipses need it.
    has_crowned_cylinder : bool
        Whether the cylinder is not straight.
    apex_share : float
        Position of a contact of unworn bodies over the offset of its roller, without tilt.
    roller_drop : callable
        Drop of the roller at axial distances from its apex [m].
    """

    def __init__(
        self, roller: AxialProfile, cylinder: AxialProfile, width: float | None, greatest: float
    ) -> None:
        self._cylinder, self._length, self.roller_drop = cylinder, roller.length, roller.drop
        self._half = 0.5 * width if width else math.inf
        self._greatest, self.apex_share = greatest, 1.0
        crown, other = roller.crown_radius, cylinder.crown_radius
        self.crown_radius: float | None = crown
        self.has_crowned_cylinder = other != math.inf
        if crown is None or other is None:
            self.crown_radius = None
        elif self.has_crowned_cylinder:
            self.crown_radius = 1.0 / (1.0 / crown + 1.0 / other)
            self.apex_share = self.crown_radius / crown
        self.is_crowned = self.crown_radius is not None and math.isfinite(self.crown_radius)

    def cylinder_drop(self, y: FloatArray) -> FloatArray:
        """Return the drop of the cylinder at axial positions [m]; beyond its ends it is great."""
        if not self.has_crowned_cylinder:
            return np.zeros_like(y)
        half = 0.5 * self._cylinder.length
        if math.isinf(half):
            return self._cylinder.drop(y)
        return np.where(
            np.abs(y) > half, self._greatest, self._cylinder.drop(np.clip(y, -half, half))
        )

    def drop(self, s: FloatArray) -> FloatArray:
        """Return the gap of the bodies at an axial distance from their coinciding apexes [m]."""
        return self.roller_drop(s) + self.cylinder_drop(s)

    def half_width(self, depth: FloatArray | float) -> FloatArray:
        """Return the half-width of a conformal groove of a depth, at most half the roller [m].

        Of circular crowns it is (2 R d)^(1/2), also beyond the ends of the roller.
        """
        if self.is_crowned:
            return np.asarray(np.sqrt(2.0 * (self.crown_radius or 0.0) * depth))
        return np.asarray(np.interp(depth, self._table[1], self._table[0]))

    def depth_of(self, area: FloatArray | float) -> FloatArray:
        """Return the depth of a conformal groove with a cross-section [m^2] [m]."""
        if self.is_crowned:
            root = np.sqrt(2.0 * (self.crown_radius or 0.0))
            return np.asarray((0.75 * np.asarray(area) / root) ** (2.0 / 3.0))
        places, drops, areas = self._table
        beyond = np.maximum(np.asarray(area) - areas[-1], 0.0) / (2.0 * places[-1])
        return np.asarray(np.interp(area, areas, drops) + beyond)

    @property
    def greatest_half_width(self) -> float:
        """Greatest half-width of a contact: of the roller, or where the drop is great [m]."""
        return float(self._table[0][-1])

    def radius_at(self, half_width: float) -> float:
        """Return the radius of the parabola with the same drop at a half-width [m]."""
        if self.is_crowned:
            return self.crown_radius or math.inf
        drop = self.depth_at(half_width)
        return half_width**2 / (2.0 * drop) if drop > 0.0 else math.inf

    def depth_at(self, half_width: float) -> float:
        """Return the depth of a conformal groove of a half-width [m]."""
        return float(np.interp(half_width, *self._table[:2]))

    def mean_drop(self, half_width: float) -> float:
        """Return the mean of the gap over a half-width [m]."""
        places, _, areas = self._table
        area = float(np.interp(half_width, places, areas))
        return self.depth_at(half_width) - area / (2.0 * half_width)

    def shift(self, tilt: FloatArray, half_width: float) -> FloatArray:
        """Return the axial distance by which tilt moves a contact from the apex [m].

        A tilted contact is where both of its ends have the same gap; it stays on the roller.

        Parameters
        ----------
        tilt : ndarray
            [rad].
        half_width : float
            Half-width of the contact [m].
        """
        if self.is_crowned:
            moved = -(self.crown_radius or 0.0) * tilt
        else:
            most = self._table[0][-1]
            half = min(half_width, 0.5 * most)
            middles = np.linspace(-(most - half), most - half, _POINTS)
            rise = self.drop(middles + half) - self.drop(middles - half)
            slope = np.maximum.accumulate(rise / (2.0 * half))
            rising = np.concatenate([[True], np.diff(slope) > 0.0])  # the first of equal ones
            moved = np.interp(-np.asarray(tilt), slope[rising], middles[rising])
            moved = np.where(np.asarray(tilt) == 0.0, 0.0, moved)
        return np.clip(moved, -self._half, self._half)

    @cached_property
    def _table(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Distances from the apex, drops there, and areas of conformal grooves that deep.

        On each side the lower of both drops counts, so that grooves are not too narrow.
        """
        most = min(self._half, 0.5 * self._length)
        if math.isinf(most):
            most = _FIRST
            while most < _LONGEST and self._lower(np.array([most]))[0] < self._greatest:
                most *= 2.0
        # dense in the middle and at the end, where logarithmic profiles are steep
        places = 0.5 * most * (1.0 - np.cos(np.linspace(0.0, np.pi, _POINTS)))
        drops = np.maximum.accumulate(self._lower(places))
        drops -= drops[0]
        steps = np.diff(places) * 0.5 * (drops[1:] + drops[:-1])
        return places, drops, 2.0 * (places * drops - np.append(0.0, np.cumsum(steps)))

    def _lower(self, s: FloatArray) -> FloatArray:
        return np.minimum(self.drop(s), self.drop(-s))

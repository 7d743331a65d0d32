"""Checks of the values that laws of plugins compute: of wear, fatigue, motion and form."""

from __future__ import annotations

import math

import numpy as np

from wearsim.plugins.checked import Checked, is_numeric
from wearsim.plugins.laws import Body, FatigueLaw, MotionLaw, WearLaw
from wearsim.plugins.specs import (
    AxialProfile,
    AxialProfileSpec,
    FatigueLawSpec,
    MotionLawSpec,
    WearLawSpec,
)
from wearsim.types import ContactSolution, FloatArray


class CheckedWearLaw(Checked, WearLaw):
    """Wear law of a plugin, with checks of its depths; errors as of `Checked`."""

    spec = WearLawSpec

    def depth_per_pass(
        self, body: Body, solution: ContactSolution, rolling_speed: float
    ) -> FloatArray:
        """Return the depth worn off `body` in one pass, shape (strips,) [m]."""
        return self._checked(
            f"depth_per_pass of the {body}",
            self._plugin.depth_per_pass(body, solution, rolling_speed),
            np.shape(solution.dissipation),
            "m",
            half_length=solution.half_length,
            line_load=solution.line_load,
            dissipation=solution.dissipation,
            rolling_speed=rolling_speed,
        )

    def depth_per_dissipation(self, body: Body, rolling_speed: float) -> float | None:
        """Return depth per pass over dissipation [m/(W/m)], or None."""
        factor: float | None = self._plugin.depth_per_dissipation(body, rolling_speed)
        if factor is None:
            return None
        what = f"depth_per_dissipation of the {body}"
        return self._checked(what, factor, (), "m^2/W", rolling_speed=rolling_speed)


class CheckedFatigueLaw(Checked, FatigueLaw):
    """Fatigue law of a plugin, with checks of its damages; errors as of `Checked`."""

    spec = FatigueLawSpec

    def damage_per_pass(self, pressure: FloatArray) -> FloatArray:
        """Return the damage that an overrolling adds, shape as `pressure`."""
        return self._called(
            "damage_per_pass", self._plugin.damage_per_pass, np.shape(pressure), pressure=pressure
        )


class CheckedMotionLaw(Checked, MotionLaw):
    """Motion law of a plugin, with checks of its lifts; errors as of `Checked`.

    Parameters
    ----------
    plugin, name
        As in `Checked`.
    angle : float
        Of the segment [rad].
    """

    spec = MotionLawSpec

    def __init__(self, plugin: MotionLaw, name: str, angle: float) -> None:
        super().__init__(plugin, name)
        breaks = plugin.breaks
        inside = isinstance(breaks, tuple | list) and all(map(is_numeric, breaks))
        if not (inside and (np.diff([0.0, *breaks, angle]) > 0.0).all()):
            expected = f"a tuple of angles that rise within the segment, 0 to {angle:.6g} rad"
            raise self._kind_error(f"breaks {breaks!r}", breaks, expected)
        self.breaks = tuple(breaks)

    def lift(self, angle: FloatArray) -> FloatArray:
        """Return lift and derivatives, shape (3, points)."""
        return self._called("lift", self._plugin.lift, (3, len(angle)), signed=True, angle=angle)


class CheckedAxialProfile(Checked, AxialProfile):
    """Form along the axis of a plugin, with checks of its drops; errors as of `Checked`."""

    spec = AxialProfileSpec

    def __init__(self, plugin: AxialProfile, name: str) -> None:
        super().__init__(plugin, name)
        self.length, self.crown_radius = plugin.length, plugin.crown_radius
        for what, value in (("length", self.length), ("crown_radius", self.crown_radius)):
            if value is not None and value != math.inf:
                self._checked(what, value, (), "m")

    def drop(self, s: FloatArray) -> FloatArray:
        """Return the distance of the surface below its highest line, shape as `s` [m]."""
        return self._called("drop", self._plugin.drop, np.shape(s), signed=True, s=s)

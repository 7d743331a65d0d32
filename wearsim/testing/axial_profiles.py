"""Conformance tests of axial profiles."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from wearsim.plugins import AxialPair, AxialProfile, AxialProfileSpec
from wearsim.testing.checks import (
    Checks,
    Fixture,
    agree,
    require,
    require_repeatable,
    require_values,
    spec_checks,
)
from wearsim.types import FloatArray

#: steel on steel, radii 25 and 20 mm
PAIR = AxialPair(10e-3, 200e9 / (2.0 * (1.0 - 0.3**2)), 90.0)
_HALF = 5e-3  # m, of a body without an end
_POINTS = 401
_ROUNDING = 1e-12  # m
_DROP = "wearsim.plugins.AxialProfile.drop"
AXIAL_PROFILE: Checks[AxialProfileFixture] = spec_checks()


@dataclass(frozen=True)
class AxialProfileFixture(Fixture[AxialProfileSpec]):
    """An axial profile under test.

    Parameters
    ----------
    configured : ConfiguredSpec
        Its spec and options.
    pair : AxialPair
        The bodies.
    """

    pair: AxialPair = PAIR

    def fresh(self) -> Any:
        """Return a new instance."""
        return self.configured.spec.factory(self.configured.options, self.pair)

    @property
    def places(self) -> FloatArray:
        """Distances from the middle, up to just before the ends [m]."""
        half = min(0.5 * self.instance.length, _HALF) * (1.0 - 1e-9)
        return np.linspace(-half, half, _POINTS)


@AXIAL_PROFILE.specified_in("wearsim.plugins.AxialProfileSpec")
def factory_builds_an_axial_profile(fixture: AxialProfileFixture) -> None:
    """The factory builds an AxialProfile with a length above zero."""
    profile = fixture.instance
    require(isinstance(profile, AxialProfile), f"{type(profile).__name__} is not an AxialProfile")
    require(profile.length > 0.0, f"the length is {profile.length!r}")


@AXIAL_PROFILE.specified_in(_DROP)
def drop_is_elementwise(fixture: AxialProfileFixture) -> None:
    """The drop is repeatable, of the shape of its argument, and one point ignores the others."""
    places, drop = fixture.places, fixture.instance.drop
    others = {"that of a new instance": fixture.fresh().drop}
    values = require_repeatable("the drop", drop, others, places)
    require_values("the drop", values, places.shape)
    agree("the drop in two rows", drop(places[:-1].reshape(2, -1)).ravel(), values[:-1], 1e-12)
    singly = np.array([drop(places[k : k + 1])[0] for k in range(0, _POINTS, 20)])
    agree("the drop at one point", singly, values[::20], 1e-12)


@AXIAL_PROFILE.specified_in(_DROP)
def drop_is_counted_from_the_highest_line(fixture: AxialProfileFixture) -> None:
    """The drop is not negative within the length, and zero at the highest line."""
    places = fixture.places
    values = fixture.instance.drop(places)
    require((values >= 0.0).all(), f"the drop is {values.min():.4g} m at one point")
    around = places[values.argmin()] + np.linspace(-1.0, 1.0, _POINTS) * (places[1] - places[0])
    least = float(fixture.instance.drop(np.clip(around, places[0], places[-1])).min())
    require(least <= _ROUNDING, f"the drop is {least:.4g} m at the highest line")


@AXIAL_PROFILE.specified_in("wearsim.plugins.AxialProfile")
def crown_radius_is_that_of_the_drop(fixture: AxialProfileFixture) -> None:
    """With a crown radius R the drop is s^2/(2 R)."""
    radius, places = fixture.instance.crown_radius, fixture.places
    if radius is not None:
        expected = places**2 / (2.0 * radius)
        agree("the drop of a crown", fixture.instance.drop(places), expected, 1e-9, _ROUNDING)

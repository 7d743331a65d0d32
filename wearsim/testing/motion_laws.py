"""Conformance tests of motion laws."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import Any

import numpy as np

from wearsim.plugins import MotionLaw, MotionLawSpec
from wearsim.testing.checks import (
    Checks,
    Fixture,
    agree,
    require,
    require_instance,
    require_values,
    spec_checks,
)
from wearsim.types import FloatArray

_POINTS = 2001
MOTION_LAW: Checks[MotionLawFixture] = spec_checks()
_LIFT = "wearsim.plugins.MotionLaw.lift"


@dataclass(frozen=True)
class MotionLawFixture(Fixture[MotionLawSpec]):
    """A motion law under test.

    Parameters
    ----------
    configured : ConfiguredSpec
        Its spec and options.
    angle, rise : float
        Of the segment [rad], [m].
    """

    angle: float = 1.5
    rise: float = 8e-3

    def fresh(self) -> Any:
        """Return a new instance."""
        return self.configured.spec.factory(self.configured.options, self.angle, self.rise, "m")

    def lift(self, angle: FloatArray) -> FloatArray:
        """Return lift and derivatives, shape (3, points)."""
        return np.asarray(self.instance.lift(angle))

    @property
    def parts(self) -> list[FloatArray]:
        """Angles between the breaks, with both ends of every part."""
        edges = [0.0, *self.instance.breaks, self.angle]
        return [np.linspace(*pair, _POINTS) for pair in itertools.pairwise(edges)]


@MOTION_LAW.specified_in("wearsim.plugins.MotionLawSpec")
def factory_builds_a_motion_law(fixture: MotionLawFixture) -> None:
    """The factory builds a MotionLaw."""
    require_instance(fixture, MotionLaw)


@MOTION_LAW.specified_in("wearsim.plugins.MotionLaw")
def breaks_are_inside_the_segment(fixture: MotionLawFixture) -> None:
    """The breaks increase and are inside the segment."""
    breaks = np.array([0.0, *fixture.instance.breaks, fixture.angle])
    require((np.diff(breaks) > 0.0).all(), f"the breaks are {fixture.instance.breaks}")


@MOTION_LAW.specified_in(_LIFT)
def lift_is_elementwise(fixture: MotionLawFixture) -> None:
    """Lift and derivatives have shape (3, points), and one point does not depend on others."""
    angle = np.linspace(0.0, fixture.angle, 11)
    values, kept = fixture.lift(angle), angle.copy()
    require_values("the lift", values, (3, 11))
    require(np.array_equal(angle, kept), "lift changes its argument")
    singly = np.concatenate([fixture.lift(angle[k : k + 1]) for k in range(11)], axis=1)
    agree("the lift at one point, compared with that at several,", singly, values, 1e-12)


@MOTION_LAW.specified_in(_LIFT)
def lift_spans_the_rise(fixture: MotionLawFixture) -> None:
    """The lift is zero at the start and, where a rise is required, the rise at the end."""
    ends, scale = fixture.lift(np.array([0.0, fixture.angle]))[0], fixture.rise
    agree("the lift at the start", ends[0], 0.0, 1e-9, scale)
    if fixture.configured.spec.rise != "own":
        rise = scale if fixture.configured.spec.rise == "required" else 0.0
        agree("the lift at the end", ends[1], rise, 1e-9, scale)


@MOTION_LAW.specified_in(_LIFT)
def derivatives_match_the_lift(fixture: MotionLawFixture) -> None:
    """The derivatives belong to the lift, and are continuous within the segment."""
    scale, last = fixture.rise / fixture.angle, None
    for angle in fixture.parts:
        values = fixture.lift(angle)
        for order, size in ((1, scale), (2, scale / fixture.angle)):
            numeric = np.gradient(values[order - 1], angle, edge_order=2)
            agree(f"derivative {order}", values[order], numeric, 1e-4, size)
        if last is not None:
            agree("lift and derivatives after a break", values[:, 0], last, 1e-6, scale)
        last = values[:, -1]

"""Cams for tests: the reference cases and random motions."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from wearsim.mechanics.cam import Follower, Motion, Panel, Segment
from wearsim.plugins import MotionLawSpec, registry
from wearsim.types import IntArray

MM = 1e-3
OMEGA = 1000.0 * math.tau / 60.0
ROLLER = 20.0 * MM


def segment(law: str, degrees: float, rise: float = 0.0, unit: str = "m", **options) -> Segment:
    """Return a segment of an installed motion law."""
    spec = registry().get(MotionLawSpec, law)
    angle = math.radians(degrees)
    built = spec.factory(spec.options.model_validate(options), angle, rise, unit)
    return Segment(law, angle, built.lift, built.breaks, law == "dwell")


def rise_and_return(law: str, height: float = 8.0 * MM) -> Motion:
    """Return dwell, rise, dwell and return of 90 deg each."""
    dwell = segment("dwell", 90.0)
    parts = dwell, segment(law, 90.0, height), dwell, segment(law, 90.0, -height)
    return Motion(parts)


class Waves:
    """Random smooth lift over a turn, for floats of any precision."""

    def __init__(self, generator: np.random.Generator, size: float) -> None:
        self.orders = np.arange(1, 5)
        self.cosines, self.sines = size * generator.normal(size=(2, 4)) / self.orders**2
        self.mean = 4.0 * size

    def __call__(self, theta):
        """Return the lift and two derivatives."""
        found = []
        for order in range(3):
            angles = np.multiply.outer(theta, self.orders) + 0.5 * np.pi * order
            waves = self.cosines * np.cos(angles) + self.sines * np.sin(angles)
            found.append((self.orders.astype(float) ** order * waves).sum(axis=-1))
        found[0] = found[0] + self.mean
        return np.stack(found)


def random_follower(generator: np.random.Generator, kind: str) -> Follower:
    """Return a follower of random dimensions."""
    base, roller = generator.uniform(20.0, 40.0) * MM, generator.uniform(5.0, 20.0) * MM
    if kind == "translating":
        return Follower(base, roller, offset=generator.uniform(-10.0, 10.0) * MM)
    distance = generator.uniform(85.0, 110.0) * MM
    arm = generator.uniform(0.7, 0.95) * distance
    return Follower(
        base,
        roller,
        "swinging",
        centre_distance=distance,
        arm_length=arm,
        towards=bool(generator.integers(2)),
    )


def segments_of(panels: Sequence[Panel]) -> IntArray:
    """Return the segments of panels, which broadcast to angles of the shape (panels, points)."""
    return np.array([[panel.segment] for panel in panels])

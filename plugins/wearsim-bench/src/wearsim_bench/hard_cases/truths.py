"""True depths of hard cases in full slip, by rigid bodies.

The groove in the cylinder has the profile of the roller, d - y^2/(2 R_crown), as far as that
reaches: its area grows by (K/H) mu xi N per roller pass, and a mounting spring of stiffness k takes
k d off the load, which is never below zero. An elastic contact is wider than this groove at first;
the difference is below 1 % once the groove is several times wider than the patch of the unworn
bodies.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from wearsim.scenario import Scenario

_STEPS = 20_000  # of the classical Runge-Kutta method


def rigid_depth(scenario: Scenario) -> float:
    """Return the depth of the groove at the end of a test [m].

    Parameters
    ----------
    scenario : Scenario
        Without wear of the rollers; its load may vary in time and have a spring.
    """
    crown = scenario.roller.crown_radius
    half = 0.5 * (scenario.roller.width or math.inf)
    load, rate = scenario.load.built, scenario.pass_rate
    creepage, friction = scenario.creepage.longitudinal, scenario.friction.coefficient
    assert creepage is not None
    per_load = _wear_factor(scenario) * friction * abs(creepage)
    passes = float(scenario.total_passes)
    # loads at the ends and the middle of every step
    times = np.linspace(0.0, passes / rate, 2 * _STEPS + 1)
    forces = load.force(times).tolist()

    def worn(area: float, force: float) -> float:
        """Return the increase of the area per pass [m^2]."""
        depth = _depth(area, crown, half)
        return float(per_load * max(force - load.stiffness * depth, 0.0))

    area, step = 0.0, passes / _STEPS
    for first, middle, last in zip(forces[:-1:2], forces[1::2], forces[2::2], strict=True):
        k1 = worn(area, first)
        k2 = worn(area + 0.5 * step * k1, middle)
        k3 = worn(area + 0.5 * step * k2, middle)
        k4 = worn(area + step * k3, last)
        area += step * (k1 + 2.0 * k2 + 2.0 * k3 + k4) / 6.0
    return _depth(area, crown, half)


def _wear_factor(scenario: Scenario) -> float:
    """Return K/H of the cylinder [1/Pa]."""
    options: Any = scenario.wear.options if scenario.wear else None
    return float(options.cylinder.k_over_h)


def _depth(area: float, crown: float, half: float) -> float:
    """Return the depth of a groove with a cross-section, under a roller of half-width `half`."""
    depth: float = (0.75 * area / math.sqrt(2.0 * crown)) ** (2.0 / 3.0)
    if math.sqrt(2.0 * crown * depth) <= half:
        return depth
    return float((area + half**3 / (3.0 * crown)) / (2.0 * half))

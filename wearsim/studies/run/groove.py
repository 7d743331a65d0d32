"""Initial contact patch of a run, and its final groove as predicted."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial

import numpy as np

from wearsim.mechanics.hertz.elasticity import combine
from wearsim.mechanics.hertz.ellipse import HertzContact, hertz
from wearsim.plugins import WearLaw
from wearsim.scenario import Scenario
from wearsim.scenario.axial_gap import AxialGap
from wearsim.studies.cam.point import Point
from wearsim.studies.cam.turn import turn_of
from wearsim.studies.run.draws import Draws
from wearsim.studies.start.heights import start_extent
from wearsim.types import ContactSolution, FloatArray

_BISECTIONS = 40
LINE_APPROACH = 12.0  # of a line contact, roughly, over q/(pi E*)


def fresh_patch(scenario: Scenario, load: float, curvature: float | None = None) -> HertzContact:
    """Return the patch of the unworn bodies under `load` [N] after Hertz.

    Where a roller ends within it, the patch is a line contact as wide as the roller. The
    relative curvature along rolling [1/m] is taken from cylinder and roller unless it is given.
    """
    modulus = combine(scenario.cylinder.material, scenario.roller.material).contact_modulus
    if curvature is None:
        curvature = 1.0 / scenario.cylinder.radius + 1.0 / scenario.roller.radius
    along = 0.5 * curvature
    half, gap = 0.5 * (scenario.roller.width or math.inf), scenario.axial_gap
    if not gap.is_crowned:
        return _patch_of_form(gap, along, load, modulus)
    patch = hertz(along, 0.5 / gap.radius_at(half), load, modulus)
    if patch.b <= half:
        return patch
    line_load = load / (2.0 * half)
    half_length = math.sqrt(2.0 * line_load / (math.pi * modulus * along))
    pressure = 2.0 * line_load / (math.pi * half_length)
    return replace(patch, a=half_length, b=half, peak_pressure=max(pressure, patch.peak_pressure))


def _patch_of_form(gap: AxialGap, along: float, load: float, modulus: float) -> HertzContact:
    """Return the approximate patch of bodies that are not circular crowns.

    It is as wide as that of the crown with the same gap at its ends. The line loads are those of a
    foundation that yields by the gap there, or by the approach of a line contact if that is more.
    """
    half = _half_width(gap, along, load, modulus)
    line_load = load / (2.0 * half)
    approach = LINE_APPROACH * line_load / (math.pi * modulus)
    level = max(gap.depth_at(half), approach)
    greatest = line_load * level / (level - gap.mean_drop(half))
    half_length = math.sqrt(2.0 * greatest / (math.pi * modulus * along))
    pressure = 2.0 * greatest / (math.pi * half_length)
    return HertzContact(half_length, half, pressure, approach, load)


def _half_width(gap: AxialGap, along: float, load: float, modulus: float) -> float:
    """Return the half-width of the patch of a crown with the same gap there [m]."""
    low, high = 0.0, gap.greatest_half_width
    if _patch_is_wider(gap, along, load, modulus, high):
        return high
    for _ in range(_BISECTIONS):
        middle = 0.5 * (low + high)
        wider = _patch_is_wider(gap, along, load, modulus, middle)
        low, high = (middle, high) if wider else (low, middle)
    return high


def _patch_is_wider(
    gap: AxialGap, along: float, load: float, modulus: float, half_width: float
) -> bool:
    """Return whether the crown with the same gap at a half-width has a wider patch."""
    radius = gap.radius_at(half_width)
    return math.isinf(radius) or hertz(along, 0.5 / radius, load, modulus).b > half_width


def patches_at(scenario: Scenario, point: Point) -> list[HertzContact]:
    """Return the patch of the unworn bodies at the points of a turn, with its load there."""
    loads, curvatures = point.normal_force.tolist(), point.kinematics.relative_curvature.tolist()
    return list(map(partial(fresh_patch, scenario), loads, curvatures))


def hardest_patch(scenario: Scenario, load: float) -> tuple[HertzContact, float]:
    """Return the patch of the greatest peak pressure and its load [N].

    It is that under `load` [N] on a cylinder, and one of those at the stations of a cam.
    """
    if scenario.cam is None:
        return fresh_patch(scenario, load), load
    turn = turn_of(scenario)
    point = turn.at_stations(turn.stations)
    pairs = zip(patches_at(scenario, point), point.normal_force.tolist(), strict=True)
    return max(pairs, key=lambda pair: pair[0].peak_pressure)


def widest_patch(scenario: Scenario, load: float) -> HertzContact:
    """Return the widest patch under `load` [N] around the cylinder or the cam."""
    if scenario.cam is None:
        return fresh_patch(scenario, load)
    curvatures = turn_of(scenario).curvatures
    patches = [fresh_patch(scenario, load, max(curvature, 1e-3)) for curvature in curvatures]
    return max(patches, key=lambda patch: patch.b)


def predicted_half_width(draws: Draws, load: float, full_slip: bool = True) -> float:
    """Return half the final width of the groove predicted for full slip [m].

    Rigid bodies in full slip wear to a depth d = [(3/4) c N n / sqrt(2 R)]^(2/3) and a width
    2 sqrt(2 R d), where c is the depth per pass and load of both bodies; with another form than a
    circular crown, to the depth of a conformal groove with the same cross-section. For a nonlinear
    wear law c is the greater value of the initial contact and the final groove. Without `full_slip`
    the slip is less by the adhesion in the initial patch, after Carter.
    """
    scenario, creepage = draws.scenario, draws.scenario.creepage
    if scenario.wear is None:
        return 0.0
    law, patch, roller = scenario.wear.build(), fresh_patch(scenario, load), scenario.roller
    friction = draws.greatest_mean("friction", scenario.friction.coefficient)
    longitudinal = draws.greatest_mean("longitudinal", creepage.longitudinal or 0.0)
    differs = creepage.drive == "free" or creepage.differential_slip
    if scenario.cam is not None:
        turn, differs = turn_of(scenario), creepage.differential_slip
        saturation = friction * patch.a * turn.curvatures[1] / scenario.friction.creep_factor
        creep = saturation * turn.greatest_demand if turn.free else 0.0
        longitudinal = max(longitudinal, creep, turn.greatest_skid)
    yaw, tilt = (
        max(abs(angle) for angle in (*draws.range_of(name), *scenario.per_roller(given)))
        for name, given in (("yaw", creepage.yaw), ("tilt", creepage.tilt))
    )
    curvature = 1.0 / roller.radius + 1.0 / scenario.cylinder.radius if differs else 0.0
    gap, profile = scenario.axial_gap, start_extent(scenario)
    slipping = 1.0
    if not full_slip:
        saturated = friction * patch.a * (1.0 / roller.radius + 1.0 / scenario.cylinder.radius)
        saturated /= scenario.friction.creep_factor
        ratio = min(float(np.hypot(longitudinal, yaw)) / saturated, 1.0)
        slipping = ratio * (2.0 - ratio)
    start = 0.0 if profile is None else profile.relief
    half = patch.b
    for _ in range(20):  # the slip at the sides of the groove depends weakly on its width
        rise = half**2 / (2.0 * gap.radius_at(half))
        along = longitudinal + tilt / roller.radius * half + rise * curvature
        line_loads = 0.75 * load / np.array([patch.b, max(half, patch.b)])
        sliding = slipping * friction * float(np.hypot(along, yaw))
        per_load = wear_per_load(scenario, law, line_loads, sliding)
        depth = gap.depth_of(per_load * load * scenario.total_passes)
        before, half = half, float(gap.half_width(depth + start))
        if half == before:
            break
    return half


def wear_per_load(
    scenario: Scenario, law: WearLaw, line_load: FloatArray, friction_slip: float
) -> float:
    """Return the greatest depth per pass and line load in full slip, of both bodies [m/(N/m)].

    Parameters
    ----------
    scenario : Scenario
    law : WearLaw
    line_load : ndarray, shape (strips,)
        Line loads at which it is evaluated [N/m].
    friction_slip : float
        Friction coefficient times slip.
    """
    modulus = combine(scenario.cylinder.material, scenario.roller.material).contact_modulus
    curvature = 1.0 / scenario.cylinder.radius + 1.0 / scenario.roller.radius
    half_length = np.sqrt(4.0 * line_load / (np.pi * modulus * curvature))
    speed = scenario.rolling_speed
    dissipation = friction_slip * line_load * speed
    sliding = ContactSolution(
        y=np.zeros_like(line_load),
        half_length=half_length,
        line_load=line_load,
        dissipation=dissipation,
        force_x=0.0,
        force_y=0.0,
        spin_moment=0.0,
        approach=0.0,
        peak_pressure=float((2.0 * line_load / (np.pi * half_length)).max()),
        adhesion_fraction=0.0,
        power=float(dissipation.sum()),
        longitudinal_creepage=0.0,
        iterations=0,
    )
    radius = scenario.cylinder.radius
    if scenario.cam is not None:
        radius = turn_of(scenario).integral("travel") / math.tau
    share = radius / scenario.roller.radius / scenario.operation.rollers
    depth = law.depth_per_pass("cylinder", sliding, speed)
    depth = depth + share * law.depth_per_pass("roller", sliding, speed)
    return float((depth / line_load).max())

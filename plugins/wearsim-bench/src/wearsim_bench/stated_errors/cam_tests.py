"""Random wear tests of cams: the shipped cams with random motion, sizes, load and wear."""

from __future__ import annotations

import math

from wearsim.mechanics.hertz.ellipse import hertz
from wearsim_bench.stated_errors.random_tests import Draws, rounded, shipped

BASES = {"cam-cycloidal": 0.5, "cam-eccentric": 0.3, "cam-swinging": 0.2}
#: laws without breaks, whose stations are few, and one with them
LAWS = {"cycloidal": 0.3, "polynomial-345": 0.3, "polynomial-4567": 0.3, "modified-sine": 0.1}
PRELOAD, CROWN, ROLLER, CAM = (20.0, 1500.0), (50.0, 1000.0), (8.0, 25.0), (15.0, 40.0)  # N, mm
GROOVE, DEPTH, TURNS = (1.02, 6.0), (1e-8, 3e-4), (1e4, 1e9)
K_OVER_H = 1e-13, 1e-9  # 1/Pa
MOST_PRESSURE = 3e9  # Pa, of the fresh contact on the base circle
ARM = 0.08  # m, of the swinging follower
FREE = 0.3  # part of the tests whose roller is driven by the cam


def cam_changes(draws: Draws, share: float) -> str:
    """Set the changes of a test of a cam, and return the name of its base.

    Parameters
    ----------
    draws : Draws
        Random numbers and changes of the test.
    share : float
        Part of its turns that the test has.
    """
    changes, base = draws.changes, draws.choice(BASES)
    rig = shipped(base)
    modulus = rig.pair.contact_modulus
    while True:
        radius, roller = draws.log_uniform(*CAM), draws.log_uniform(*ROLLER)
        crown, preload = draws.log_uniform(*CROWN), draws.log_uniform(*PRELOAD)
        if base == "cam-swinging":  # the lengths of the arm suit the shipped cam
            radius, roller = 20.0, 20.0
        curvature = 1e3 * (1.0 / radius + 1.0 / roller)
        patch = hertz(0.5 * curvature, 0.5e3 / crown, preload, modulus)
        if roller <= radius and patch.peak_pressure < MOST_PRESSURE and patch.b > 1.5 * patch.a:
            break
    lift = rounded(radius * draws.uniform(0.08, 0.25))
    rpm = draws.log_uniform(100.0, 1000.0)
    _set_cam(draws, base, radius, lift)
    changes["cam.stations"] = int(draws.uniform(2, 5))
    changes["roller.radius"] = f"{roller} mm"
    changes["roller.crown_radius"] = f"{crown} mm"
    changes["operation.speed"] = f"{rpm} rpm"
    if base == "cam-swinging":
        changes["load.preload"] = f"{rounded(preload * ARM)} N m"
    else:
        changes["load.preload"] = f"{preload} N"
        changes["load.stiffness"] = f"{rounded(preload / lift * draws.uniform(0.05, 0.5))} N/mm"
        # the inertia takes at most a third of the preload off
        acceleration = 8.0 * 1e-3 * lift * (rpm * math.pi / 30.0) ** 2
        changes["follower.mass"] = f"{rounded(preload / acceleration * draws.uniform(0, 0.3))} kg"
    friction = draws.log_uniform(0.05, 0.3)
    changes["friction.coefficient"] = friction
    saturation = friction * patch.a * curvature
    if base != "cam-eccentric" and draws.chance(FREE):
        part = draws.log_uniform(1e-3, 0.1)
        torque = part * friction * preload * roller
        changes["creepage.bearing_torque"] = f"{torque:.4g} N mm"
        changes["roller.inertia"] = f"{2e-5 * (roller / 20.0) ** 4:.4g} kg m^2"
        changes["creepage.yaw"] = f"{draws.log_uniform(0.1, 3.0)} mrad"
        slip = 1e-3 * float(str(changes["creepage.yaw"]).split()[0])
    else:
        slip = draws.log_uniform(1e-4, 1e-2)
        changes["creepage"] = {"longitudinal": slip}
        if draws.chance(0.2):
            changes["creepage"] = {"longitudinal": slip, "differential_slip": True}
    ratio = min(slip / saturation, 1.0)
    slip *= ratio * (2.0 - ratio)
    _set_wear(draws, friction * slip * preload, patch.b, 1e-3 * crown, radius / roller, share)
    if draws.chance(0.3):
        changes["load.feedback"] = draws.choice({"none": 0.5, "static": 0.5})
    return base


def _set_cam(draws: Draws, base: str, radius: float, lift: float) -> None:
    """Set the base circle [mm] and the motion with a lift [mm]."""
    changes = draws.changes
    changes["cam.base_radius"] = f"{radius} mm"
    if base != "cam-cycloidal":
        changes["cam.eccentricity"] = f"{rounded(0.5 * lift)} mm"
        return
    law = draws.choice(LAWS)
    changes["cam.motion"] = [
        {"law": "dwell", "angle": "80 deg"},
        {"law": law, "angle": "120 deg", "rise": f"{lift} mm"},
        {"law": "dwell", "angle": "40 deg"},
        {"law": law, "angle": "120 deg", "rise": f"-{lift} mm"},
    ]


def _set_wear(
    draws: Draws, power: float, half_width: float, crown: float, revolutions: float, share: float
) -> None:
    """Set wear factors, and the turns to a random final depth on the base circle.

    Parameters
    ----------
    draws : Draws
        Random numbers and changes of the test.
    power : float
        Dissipated power over the rolling velocity [N].
    half_width, crown : float
        Half-width of the fresh patch and crown radius [m].
    revolutions : float
        Revolutions of the roller in a turn.
    share : float
        Part of the turns.
    """
    widened = draws.log_uniform(*GROOVE) ** 2 - 1.0
    depth = min(max(widened * half_width**2 / (2.0 * crown), DEPTH[0]), DEPTH[1])
    half = math.sqrt(half_width**2 + 2.0 * crown * depth)
    ratio = draws.log_uniform(0.01, 3.0) if draws.chance(0.5) else 0.0
    per_factor = 0.75 * power * (1.0 + ratio * revolutions)
    work = (half**3 - half_width**3) / (3.0 * crown) / per_factor
    factor = min(max(work / draws.log_uniform(*TURNS), K_OVER_H[0]), K_OVER_H[1])
    turns = min(max(work / factor, TURNS[0]), TURNS[1])
    draws.changes["operation.turns"] = max(int(share * rounded(turns)), 10)
    draws.changes["wear.cylinder.k_over_h"] = f"{factor:.4g} 1/Pa"
    draws.changes["wear.roller.k_over_h"] = f"{ratio * factor:.4g} 1/Pa"

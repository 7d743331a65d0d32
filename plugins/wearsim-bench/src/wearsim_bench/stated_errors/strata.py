"""Random wear tests in strata over wide ranges of sizes, loads, slip and wear."""

from __future__ import annotations

import math
from dataclasses import dataclass

from wearsim.mechanics.hertz.ellipse import HertzContact, hertz
from wearsim_bench.stated_errors.cam_tests import cam_changes
from wearsim_bench.stated_errors.random_tests import Draws, RandomTest, rounded, shipped
from wearsim_bench.stated_errors.varying_inputs import process, set_recorded_load

RIG = "rig-450min"
ADHESION, SPRING, CAM, FREE = "adhesion", "spring", "cam", "free roller"
STRATA = ("ordinary", ADHESION, SPRING, CAM, FREE)
TOLERANCES = (1e-2, 1e-3, 1e-4)
RADIUS, CROWN, LOAD = (5.0, 50.0), (20.0, 1000.0), (5.0, 3000.0)  # mm, mm, N
SMALL_RADIUS, LIGHT_LOAD = (5.0, 20.0), (5.0, 200.0)  # of the stratum adhesion
CYLINDER_RADIUS = 8.0, 100.0  # mm
MOST_PRESSURE, LEAST_RATIO = 3e9, 1.5  # Pa; of the patch's width to its length
K_OVER_H, PASSES = (1e-13, 1e-9), (1e4, 3e9)  # 1/Pa
#: passes of tests with inputs drawn at every pass or along a process: each pass takes long
FEW_PASSES = 2e3, 1e4
DEPTH, GROOVE = (1e-8, 3e-4), (1.02, 8.0)  # m, final width over that of the fresh patch
ROLLERS = {"1": 0.5, "2": 0.25, "3": 0.25}
MODELS = {"strip": 0.9, "fastsim": 0.05, "semi-hertzian": 0.05}
MAX_STEPS = 20_000


@dataclass(frozen=True)
class Sizes:
    """Sizes, load and creepage of a test on a cylinder, in SI.

    Parameters
    ----------
    roller, cylinder, crown : float
        Radii [m].
    load : float
        Normal force [N].
    friction, creepage : float
        Coefficient of friction, longitudinal creepage.
    rollers : int
        Number of rollers.
    """

    roller: float
    cylinder: float
    crown: float
    load: float
    friction: float
    creepage: float
    rollers: int

    @property
    def curvature(self) -> float:
        """Relative curvature along rolling [1/m]."""
        return 1.0 / self.roller + 1.0 / self.cylinder

    @property
    def patch(self) -> HertzContact:
        """The patch of the unworn bodies."""
        rig = shipped(RIG)
        modulus = rig.pair.contact_modulus
        return hertz(0.5 * self.curvature, 0.5 / self.crown, self.load, modulus)

    @property
    def saturation(self) -> float:
        """Creepage of full slip after Carter."""
        return self.friction * self.patch.a * self.curvature

    @property
    def is_valid(self) -> bool:
        """Whether the patch is wider than long, and the pressure that of a rolling contact."""
        patch = self.patch
        return patch.b > LEAST_RATIO * patch.a and patch.peak_pressure < MOST_PRESSURE


def random_test(seed: int, number: int, share: float = 1.0) -> RandomTest:
    """Return a random test; the strata alternate, and each seed gives another sequence of tests.

    Parameters
    ----------
    seed, number : int
        Not negative.
    share : float
        Part of its passes that the test has.
    """
    draws, stratum = Draws(seed, number), STRATA[number % len(STRATA)]
    draws.changes["evolution.tolerance"] = TOLERANCES[min(int(draws.uniform(0, 3)), 2)]
    draws.changes["evolution.max_steps"] = MAX_STEPS
    base = cam_changes(draws, share) if stratum == CAM else _cylinder(draws, stratum, share)
    return RandomTest(f"{seed}-{number}", base, draws.changes, draws.files, stratum)


def _sizes(draws: Draws, stratum: str) -> Sizes:
    """Return random sizes and creepage with a valid contact."""
    adhesion = stratum == ADHESION
    while True:
        sizes = Sizes(
            1e-3 * draws.log_uniform(*(SMALL_RADIUS if adhesion else RADIUS)),
            1e-3 * draws.log_uniform(*CYLINDER_RADIUS),
            1e-3 * draws.log_uniform(*CROWN),
            draws.log_uniform(*(LIGHT_LOAD if adhesion else LOAD)),
            draws.log_uniform(0.05, 0.6),
            draws.log_uniform(1e-5, 1e-4) if adhesion else draws.log_uniform(1e-4, 1e-2),
            int(draws.choice(ROLLERS)),
        )
        if sizes.is_valid:
            return sizes


def _cylinder(draws: Draws, stratum: str, share: float) -> str:
    """Set the changes of a test on a cylinder, and return the name of its base."""
    changes, sizes, ordinary = draws.changes, _sizes(draws, stratum), stratum == "ordinary"
    kind = draws.choice({"usual": 0.88, "t-gamma": 0.06, "per-pass": 0.06}) if ordinary else ""
    model = draws.choice(MODELS)
    rollers = sizes.rollers if model == "strip" and kind != "per-pass" else 1
    changes["operation.rollers"] = rollers
    for key, value in (
        ("roller.radius", sizes.roller),
        ("roller.crown_radius", sizes.crown),
        ("cylinder.radius", sizes.cylinder),
    ):
        changes[key] = _mm(value)
    changes["load.normal_force"] = f"{sizes.load!r} N"
    changes["friction.coefficient"] = sizes.friction
    creepage, yaw = _angles(draws, sizes, rollers, stratum)
    slip = math.hypot(sizes.creepage, yaw)
    ratio = min(slip / sizes.saturation, 1.0)
    slip *= ratio * (2.0 - ratio)
    if stratum == FREE:
        share_of_friction = draws.log_uniform(1e-3, 0.7)
        torque = share_of_friction * sizes.friction * sizes.load * sizes.roller * 1e3
        creepage |= {"drive": "free", "bearing_torque": f"{torque:.4g} N mm"}
        slip = sizes.saturation * (1.0 - math.sqrt(1.0 - share_of_friction)) * share_of_friction
        slip = math.hypot(slip, yaw)
    else:
        creepage["longitudinal"] = sizes.creepage
    differs = stratum == FREE or draws.chance(0.1 if stratum == ADHESION else 0.2)
    if differs and stratum != FREE:
        creepage["differential_slip"] = True
    changes["creepage"] = creepage
    ratio = draws.log_uniform(0.01, 10.0) if draws.chance(0.4) else 0.0
    load = "constant"
    if ordinary and model == "strip" and kind == "usual":
        load = draws.choice({"constant": 0.65, "recorded": 0.2, "process": 0.15})
    few = load == "process" or kind == "per-pass"
    passes = _set_wear(draws, sizes, slip, ratio, share, kind, differs=differs, few=few)
    duration = 60.0 * passes / (rollers * 1000.0)  # s, at the 1000 rpm of the rig
    if stratum == SPRING:
        changes["load.kind"] = "spring"
        changes["load.stiffness"] = f"{draws.log_uniform(1e2, 2e5)!r} N/mm"
    elif load == "recorded":
        set_recorded_load(draws, sizes.load, duration)
    elif load == "process":
        spread = f"{sizes.load * draws.log_uniform(0.03, 0.2):.4g} N"
        changes["load.normal_force"] = process(draws, f"{sizes.load!r} N", spread, duration)
    elif ordinary and draws.chance(0.15):
        time, gain = draws.log_uniform(0.02, 1.0) * duration, draws.log_uniform(0.01, 0.3)
        power = sizes.friction * sizes.load * slip * 100.0 * sizes.cylinder  # W, at 100 rad/s
        changes["load.thermal"] = {
            "gain": f"{gain * sizes.load / power:.4g} N/W",
            "time_constant": f"{time:.4g} s",
        }
    if kind == "per-pass":
        changes["friction.coefficient"] = {
            "distribution": "maxent",
            "support": [0, "inf"],
            "mean": sizes.friction,
            "std": rounded(draws.uniform(0.05, 0.3) * sizes.friction),
            "persistence": "per-pass",
        }
    if model == "fastsim":
        changes["contact.tangential"] = "fastsim"
    elif model == "semi-hertzian":
        changes["contact.model"] = model
    return RIG


def _mm(value: float) -> str:
    return f"{1e3 * value:.4g} mm"


def _angles(
    draws: Draws, sizes: Sizes, rollers: int, stratum: str
) -> tuple[dict[str, object], float]:
    """Set offsets; return the keys of yaw and tilt and the greatest yaw [rad]."""
    half_width = sizes.patch.b
    if rollers > 1 and draws.chance(0.4):
        spread = half_width * draws.log_uniform(0.05, 2.0)
        draws.changes["roller.offset"] = [_mm(spread * at) for at in draws.normal(rollers)]
    # a tilt moves the contact by up to its half-width
    greatest = {"yaw": 2e-3, "tilt": min(2e-3, half_width / sizes.crown)}
    if stratum == ADHESION:
        greatest["yaw"] = 0.5 * sizes.creepage
    keys: dict[str, object] = {}
    greatest_yaw = 0.0
    for name, limit in greatest.items():
        angles = [draws.uniform(-limit, limit) for _ in range(rollers)]
        if draws.chance(0.2):
            texts = [f"{1e3 * angle:.4g} mrad" for angle in angles]
            same = rollers == 1 or draws.chance(0.5)
            keys[name] = texts[0] if same else texts
            greatest_yaw = max(map(abs, angles)) if name == "yaw" else greatest_yaw
    return keys, greatest_yaw


def _set_wear(
    draws: Draws,
    sizes: Sizes,
    slip: float,
    ratio: float,
    share: float,
    kind: str,
    *,
    differs: bool,
    few: bool,
) -> int:
    """Set wear factors and the passes to a random final depth, and return the passes.

    The depth d follows from rigid bodies on a groove of the half-width sqrt(b^2 + 2 R d).
    """
    changes, patch = draws.changes, sizes.patch
    widened = draws.log_uniform(*GROOVE) ** 2 - 1.0
    depth = widened * patch.b**2 / (2.0 * sizes.crown)
    depth = min(max(depth, DEPTH[0]), DEPTH[1], 0.05 * sizes.roller)
    half_width = math.sqrt(patch.b**2 + 2.0 * sizes.crown * depth)
    if differs:
        across = 0.2 * half_width**2 / (2.0 * sizes.crown) * sizes.curvature
        adhering = min(across / sizes.saturation, 1.0)
        slip = math.hypot(slip, across * adhering * (2.0 - adhering))
    both_bodies = 1.0 + ratio * sizes.cylinder / sizes.roller
    per_factor = (
        sizes.friction * slip * 0.75 * sizes.load * both_bodies
    )  # depth per pass times width
    work = (half_width**3 - patch.b**3) / (3.0 * sizes.crown) / per_factor  # K/H times passes
    passes = draws.log_uniform(*(FEW_PASSES if few else PASSES))
    factor = min(max(work / passes, K_OVER_H[0]), K_OVER_H[1])
    if not few:
        passes = min(max(work / factor, PASSES[0]), PASSES[1])
    passes = max(int(share * rounded(passes)), 10)
    # whole turns: within a turn, steps do not know which of different rollers has passed
    passes += -passes % sizes.rollers
    changes["operation.passes"] = passes
    if kind != "t-gamma":
        changes["wear.cylinder.k_over_h"] = f"{factor:.4g} 1/Pa"
        changes["wear.roller.k_over_h"] = f"{ratio * factor:.4g} 1/Pa"
        return passes
    onset = sizes.friction * slip * patch.peak_pressure * draws.log_uniform(0.1, 3.0)
    mild = 7850.0 * factor
    regimes = {
        "mild": f"{mild:.4g} kg/J",
        "severe": f"{onset * mild:.4g} kg/m^3",
        "catastrophic": f"{mild * draws.log_uniform(1.0, 10.0):.4g} kg/J",
        "catastrophic_from": f"{onset * draws.log_uniform(1.5, 10.0):.4g} Pa",
    }
    roller = {**regimes, "factor": rounded(min(ratio, 10.0))}
    changes["wear"] = {"law": "t-gamma", "cylinder": regimes, "roller": roller}
    return passes

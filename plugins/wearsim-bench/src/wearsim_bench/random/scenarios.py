"""Random scenarios over the whole language: further keys on the random tests of stated errors."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from wearsim.errors import ScenarioError
from wearsim_bench.stated_errors.random_tests import Draws, RandomTest, rounded
from wearsim_bench.stated_errors.strata import CAM, random_test

GROOVE = "cam-groove"
GROOVES = 0.25  # part of the cams that are grooves
MOST_PASSES, MOST_PER_PASS = 3e6, 1e4  # of any test, and of those that solve many passes
TOLERANCES = {"1e-2": 0.5, "1e-3": 0.5}
ATTEMPTS = 50  # attempts to draw values that the scenario language accepts
MODELS = {
    "hertz": 0.3, "hertz-fastsim": 0.25, "semi-hertzian": 0.25, "slender": 0.2,
}  # fmt: skip
VARIANTS = {"kik-piotrowski": 0.3, "ayasse-chollet": 0.3, "analyn": 0.4}
MARCHES = {"fastrip": 0.5, "fastsim": 0.5}
SOFT = {"youngs_modulus": "110 GPa", "poisson_ratio": 0.34}
DAMAGE = {
    "law": "pressure-life",
    "reference_passes": 1e6,
    "reference_pressure": "1 GPa",
    "exponent": 8,
    "source": "a random test",
}


def random_scenario(seed: int, number: int) -> tuple[RandomTest, int]:
    """Return a random scenario that can be read, and how many drawn before it were refused.

    Parameters
    ----------
    seed, number : int
        Not negative; each pair gives another scenario.

    Raises
    ------
    ScenarioError
        If none of `ATTEMPTS` drawn scenarios can be read: the last mistake.
    """
    for refused in range(ATTEMPTS):
        test = _drawn(seed, number, Draws(seed, number + (refused + 1) * 1_000_000))
        try:
            test.scenario()
        except ScenarioError as error:
            last = error
        else:
            return test, refused
    raise last


def _drawn(seed: int, number: int, draws: Draws) -> RandomTest:
    """Return a test of stated errors with further random keys, which may not go together."""
    test = random_test(seed, number)
    draws.changes |= test.changes
    draws.files |= test.files
    base = test.base
    if test.stratum == CAM and draws.chance(GROOVES):
        base = GROOVE
        _groove_cam(draws)
    draws.changes["evolution.tolerance"] = float(draws.choice(TOLERANCES))
    for key in ("operation.passes", "operation.turns"):
        if key in draws.changes:
            draws.changes[key] = int(min(float(str(draws.changes[key])), MOST_PASSES))
    of_all: tuple[tuple[float, Callable[[Draws, str], None]], ...] = (
        (0.15, _materials),
        (0.1, _fatigue),
        (0.15, _records),
        (0.2, _random_inputs),
    )
    of_cylinders: tuple[tuple[float, Callable[[Draws, str], None]], ...] = (
        (0.3, _contact_model),
        (0.15, _width),
        (0.15, _worn_start),
        (0.1, _form),
        (0.12, _stepper),
        (0.1, _third_body),
    )
    for probability, change in of_all + (() if test.stratum == CAM else of_cylinders):
        if draws.chance(probability):
            change(draws, base)
    return replace(test, base=base, changes=draws.changes, files=draws.files)


def _groove_cam(draws: Draws) -> None:
    """Replace the changes of another cam by those of a groove cam."""
    wear = {key: value for key, value in draws.changes.items() if key.startswith("wear.")}
    draws.changes.clear()
    draws.changes |= wear | {
        "operation.turns": int(draws.log_uniform(1e3, 1e6)),
        "operation.speed": f"{draws.log_uniform(100.0, 700.0)} rpm",
        "follower.mass": f"{draws.log_uniform(1.0, 6.0)} kg",
        "follower.clearance": f"{draws.log_uniform(10.0, 100.0)} um",
        "load.preload": f"{draws.log_uniform(10.0, 300.0)} N",
        "creepage.yaw": f"{draws.log_uniform(0.1, 3.0)} mrad",
        "roller.crown_radius": f"{draws.log_uniform(50.0, 1000.0)} mm",
        "cam.stations": int(draws.uniform(2, 5)),
    }


def _materials(draws: Draws, base: str) -> None:
    draws.changes["roller.material"] = SOFT
    if draws.chance(0.5):
        draws.changes["cylinder.material" if "rig" in base else "cam.material"] = SOFT


def _fatigue(draws: Draws, _base: str) -> None:
    draws.changes["fatigue"] = {"slope": 1.125, "cylinder": DAMAGE, "roller": DAMAGE}


def _records(draws: Draws, _base: str) -> None:
    draws.changes["outputs.records"] = int(draws.log_uniform(2.0, 60.0))
    draws.changes["outputs.spacing"] = draws.choice({"even": 0.4, "log": 0.6})


def _random_inputs(draws: Draws, base: str) -> None:
    """Make friction and wear factor random, at times with persistence along the test."""
    spread = {"distribution": "lognormal", "factor": rounded(draws.uniform(1.05, 1.6))}
    friction = draws.changes.get("friction.coefficient", 0.1)
    if not isinstance(friction, dict) and draws.chance(0.7):
        draws.changes["friction.coefficient"] = {**spread, "median": friction}
    factor = draws.changes.get("wear.cylinder.k_over_h")
    if factor is not None:
        draws.changes["wear.cylinder.k_over_h"] = {**spread, "median": factor}
    if "rig" in base and "creepage" in draws.changes and draws.chance(0.3):
        creepage = draws.changes["creepage"]
        assert isinstance(creepage, dict)
        without_angles = {
            key: value for key, value in creepage.items() if key not in ("yaw", "tilt")
        }
        radius = f"{draws.log_uniform(0.05, 1.0)} mrad"
        angles = {"distribution": "disc", "radius": radius, "persistence": "per-roller"}
        draws.changes["creepage"] = {**without_angles, "misalignment": angles}


def _contact_model(draws: Draws, _base: str) -> None:
    model = draws.choice(MODELS)
    draws.changes.pop("contact.tangential", None)
    draws.changes["contact.model"] = model
    if model == "semi-hertzian":
        draws.changes["contact.variant"] = draws.choice(VARIANTS)
    elif model == "slender":
        draws.changes["contact.tangential"] = draws.choice(MARCHES)
        draws.changes["contact.mx"] = 20
    else:
        _end_at(draws, MOST_PER_PASS * 10)


def _width(draws: Draws, _base: str) -> None:
    """Give the roller a width between a third and three times its radius."""
    radius = float(str(draws.changes["roller.radius"]).split()[0])
    width = rounded(radius * draws.log_uniform(0.3, 3.0))
    draws.changes["roller.width"] = f"{width} mm"
    if draws.chance(0.5):
        draws.changes["roller.edge_radius"] = f"{rounded(0.05 * width)} mm"
    elif draws.chance(0.5):
        draws.changes["roller.chamfer"] = f"{rounded(0.05 * width)} mm"


def _worn_start(draws: Draws, _base: str) -> None:
    """Start from a groove of a smooth form on the cylinder."""
    half = draws.log_uniform(0.5, 10.0)  # mm
    depth = draws.log_uniform(0.1, 20.0)  # um
    middle = draws.uniform(-0.5, 0.5) * half
    y = np.linspace(-2.0 * half, 2.0 * half, 201)
    inside = np.clip(1.0 - ((y - middle) / half) ** 2, 0.0, None)
    rows = [f"{at:.6g}, {-depth * value**2:.6g}" for at, value in zip(y, inside, strict=True)]
    draws.files["worn.csv"] = "\n".join(["y [mm],height [um]", *rows])
    draws.changes["cylinder.profile"] = "worn.csv"


def _form(draws: Draws, _base: str) -> None:
    """Give the roller a logarithmic profile or a partial crown in place of its crown."""
    radius = float(str(draws.changes["roller.radius"]).split()[0])
    width = f"{rounded(radius * draws.log_uniform(0.3, 1.5))} mm"
    load = draws.changes.get("load.normal_force", "300 N")
    draws.changes["roller.width"] = width
    draws.changes["roller.crown_radius"] = None
    if draws.chance(0.6):
        form: dict[str, object] = {"form": "logarithmic", "design_load": load}
    else:
        straight, arcs = rounded(0.1 * radius), rounded(radius * draws.log_uniform(5.0, 50.0))
        form = {"form": "partial-crown", "straight": f"{straight} mm", "radius": f"{arcs} mm"}
    draws.changes["roller.axial_profile"] = form


def _stepper(draws: Draws, _base: str) -> None:
    stepper = draws.choice({"stabilised": 0.5, "explicit": 0.3, "per-pass": 0.2})
    draws.changes["evolution.stepper"] = stepper
    _end_at(draws, MOST_PER_PASS if stepper == "per-pass" else MOST_PER_PASS * 10)


def _third_body(draws: Draws, _base: str) -> None:
    draws.changes["friction.creep_factor"] = rounded(draws.uniform(0.2, 1.0))


def _end_at(draws: Draws, passes: float) -> None:
    """Limit the passes of a test on a cylinder."""
    today = float(str(draws.changes.get("operation.passes", 1e6)))
    draws.changes["operation.passes"] = int(min(today, passes))

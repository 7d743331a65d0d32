"""Definitions of the hard cases."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache

from wearsim.mechanics.hertz.ellipse import hertz
from wearsim.scenario import Scenario, parse_scenario
from wearsim.scenario.examples import shipped_scenario
from wearsim_bench.hard_cases.input_files import (
    edge,
    groove,
    log_of_load,
    profile,
    ridges,
    roughness,
    step,
    waviness,
)

BASE = "rig-450min"

LONG, SHORT = 1_350_000, 60_000  # roller passes

RIGID = {"youngs_modulus": "2e5 GPa", "poisson_ratio": 0.3}

INCOMPRESSIBLE = {"youngs_modulus": "200 GPa", "poisson_ratio": 0.4999}


@dataclass(frozen=True)
class RobustnessCase:
    """A hard case: a difficult scenario and its expected outcome.

    Parameters
    ----------
    name : str
        Name of the case.
    changes : mapping of str to object
        Changes of the shipped scenario `rig-450min`, by dotted key.
    files : mapping of str to str
        Content of the files named in the scenario.
    refused : tuple of str
        Words of the required error; empty if the case must complete.
    patches : tuple of int
        Required sequence of the number of contact patches; empty if arbitrary.
    strips : int
        Smallest number of strips that resolves the problem; 0 if `changes` sets it.
    rough : bool
        Whether the profile is rough or discontinuous, and the line load with it.
    of_default_model : bool
        Whether the outcome is expected of the default contact model only.
    steps : int
        Factor on the number of fixed steps, for inputs that vary in time.
    true_within : float
        Greatest relative difference from the depth that rigid bodies in full slip have; 0 if
        that is not known.
    """

    name: str
    changes: Mapping[str, object]
    files: Mapping[str, str] = field(default_factory=dict)
    refused: tuple[str, ...] = ()
    patches: tuple[int, ...] = ()
    strips: int = 40
    rough: bool = False
    of_default_model: bool = False
    steps: int = 1
    true_within: float = 0.0

    def passes(self, usual: int) -> int:
        """Return the roller passes of the case, by default `usual`."""
        passes = self.changes.get("operation.passes", usual)
        assert isinstance(passes, int)
        return passes

    def scenario(self, passes: int, further: Mapping[str, object]) -> Scenario:
        """Return the scenario with further changes; `passes` is the default of the case."""
        base = _base()
        changes = {"operation.passes": passes, **self.changes, **further}
        return parse_scenario(base.text, f"{self.name}.toml", self.files.__getitem__, changes)


@cache
def _base() -> Scenario:
    return shipped_scenario(BASE)


def hard_cases(passes: int) -> tuple[RobustnessCase, ...]:
    """Return all hard cases.

    Parameters
    ----------
    passes : int
        Roller passes of cases that do not set them.
    """
    duration = passes / _base().pass_rate
    return (
        RobustnessCase("unchanged rig", {}),
        *_shapes(),
        *_profiles(),
        *_loads(duration),
        *_known(passes, duration),
        *_rubbing(),
        *_wear(),
        *_bodies(),
        *_strips(),
        *_refused(duration),
    )


def crown_radius_of(ratio: float) -> float:
    """Return the crown radius of the rig for a fresh patch with b/a = `ratio` [m]."""
    base = _base()
    along = 0.5 * (1.0 / base.cylinder.radius + 1.0 / base.roller.radius)
    modulus = base.pair.contact_modulus
    low, high = 1e-4, 1e4
    while high > low * (1.0 + 1e-12):
        middle = (low * high) ** 0.5
        # the ratio does not depend on the load
        patch = hertz(along, 0.5 / middle, 1.0, modulus)
        low, high = (middle, high) if patch.b < ratio * patch.a else (low, middle)
    return low


def _shapes() -> list[RobustnessCase]:
    return [
        RobustnessCase(f"b/a = {ratio:g}", {"roller.crown_radius": f"{crown_radius_of(ratio)!r} m"})
        for ratio in (200.0, 60.0, 1.0, 0.3)
    ]


def _profiles() -> list[RobustnessCase]:
    def case(name: str, heights: str, **more: object) -> RobustnessCase:
        changes = {"cylinder.profile": "profile.csv"}
        return RobustnessCase(name, changes, {"profile.csv": heights}, **more)  # type: ignore[arg-type]

    return [
        case("roller over an edge", profile(edge), rough=True),
        case(
            "groove with a step",
            profile(step),
            patches=(2, 1),
            strips=80,
            rough=True,
        ),
        case("groove of two patches", profile(groove), patches=(2, 1)),
        case(
            "one patch, two, then one",
            profile(ridges),
            patches=(1, 2, 1),
            strips=80,
            rough=True,
        ),
        case("waviness 0.5 um at 0.4 mm", profile(waviness), strips=80, rough=True),
        RobustnessCase(
            "roughness 0.5 um at 0.1 mm",
            {"cylinder.profile": "profile.csv", "operation.passes": 2000},
            {"profile.csv": profile(roughness, finer=4)},
            strips=100,
            rough=True,
        ),
    ]


def _loads(duration: float) -> list[RobustnessCase]:
    def logged(name: str, *levels: float, steps: int = 1) -> RobustnessCase:
        parts = tuple(k / len(levels) for k in range(1, len(levels)))
        log = log_of_load(duration, parts, levels)
        return RobustnessCase(
            name, {"load": {"kind": "recorded", "file": "log.csv"}}, {"log.csv": log}, steps=steps
        )

    def spring(stiffness: str) -> dict[str, object]:
        return {"load": {"kind": "spring", "normal_force": "300 N", "stiffness": stiffness}}

    return [
        logged("load to 1 N and back", 300.0, 1.0, 300.0),
        logged("pause at zero load", 300.0, 0.0, 300.0),
        logged("load steps x10", 30.0, 300.0, 30.0, 300.0, 30.0, steps=2),
        RobustnessCase("spring unloaded by wear", spring("6.9 kN/mm")),
        RobustnessCase(
            "spring unloaded to zero",
            # the load falls to 1 mN; models that cannot reach it stop at the limit of the steps
            {**spring("69 kN/mm"), "operation.passes": 600_000, "evolution.max_steps": 2000},
            steps=16,
        ),
    ]


def _known(passes: int, duration: float) -> list[RobustnessCase]:
    """Return cases whose depth is known, with the wear of a long test in any number of passes."""
    wear = {"wear.cylinder.k_over_h": f"{1.1e-11 * LONG / passes!r} 1/Pa"}
    recorded = {"kind": "recorded", "file": "log.csv"}
    # the spring holds the roller off the cylinder until the load exceeds its force
    rising = log_of_load(duration, (0.4, 0.5), (300.0, 0.0, 400.0), last=0.4)
    return [
        RobustnessCase(
            "roller lifts off and returns",
            {**wear, "load": {**recorded, "stiffness": "1000 N/mm"}},
            {"log.csv": rising},
            steps=4,
            of_default_model=True,
            true_within=0.01,
        ),
        RobustnessCase(
            "load step x3",
            {**wear, "load": recorded},
            {"log.csv": log_of_load(duration, (1.0 / 3.0,), (150.0, 450.0))},
            steps=2,
            of_default_model=True,
            true_within=0.005,
        ),
        RobustnessCase(
            "groove reaches the ends of the roller",
            {**wear, "roller.width": "10 mm"},
            strips=60,
            of_default_model=True,
            true_within=0.005,
        ),
    ]


def _rubbing() -> list[RobustnessCase]:
    wandering = {
        "distribution": "ornstein-uhlenbeck",
        "correlation_time": "20 min",
        "marginal": {"distribution": "normal", "mean": 0.0, "std": 1e-3},
    }
    scattered = {
        "distribution": "maxent",
        "support": [0, "inf"],
        "mean": 0.1,
        "std": 0.05,
        "persistence": "per-pass",
    }
    return [
        RobustnessCase("friction 0.001", {"friction.coefficient": 0.001}),
        RobustnessCase("friction 1", {"friction.coefficient": 1.0}),
        RobustnessCase(
            "friction per pass, 50 % scatter",
            {"friction.coefficient": scattered, "evolution.nodes": 8, "evolution.tolerance": 1e-2},
        ),
        RobustnessCase("creepage 1e-6", {"creepage.longitudinal": 1e-6}),
        RobustnessCase("creepage negative", {"creepage.longitudinal": -1e-3}),
        RobustnessCase("no creepage", {"creepage.longitudinal": 0.0}),
        RobustnessCase("pure spin", {"creepage.longitudinal": 0.0, "creepage.tilt": "2 mrad"}),
        RobustnessCase("pure lateral", {"creepage.longitudinal": 0.0, "creepage.yaw": "1 mrad"}),
        RobustnessCase(
            "creepage through zero in y",
            {"creepage.longitudinal": 1e-4, "creepage.differential_slip": True},
            rough=True,  # two ridges remain where the slip is zero
        ),
        RobustnessCase(
            "creepage through zero in time",
            {"creepage.longitudinal": wandering},
            steps=64,  # paths are rough, so that the error falls irregularly from step to step
        ),
    ]


def _wear() -> list[RobustnessCase]:
    def both(ratio: float) -> dict[str, object]:
        return {"wear.roller.k_over_h": f"{1.1e-11 * ratio!r} 1/Pa"}

    return [
        RobustnessCase(
            "K/H x 1e3", {"wear.cylinder.k_over_h": "1.1e-8 1/Pa", "operation.passes": 1360}
        ),
        RobustnessCase(
            "the whole groove in ten passes",
            {"wear.cylinder.k_over_h": "1.5e-6 1/Pa", "operation.passes": 10},
        ),
        RobustnessCase("K/H x 1e-6", {"wear.cylinder.k_over_h": "1.1e-17 1/Pa"}),
        RobustnessCase("1e9 passes", {"operation.passes": 10**9, "evolution.allow_deep": True}),
        RobustnessCase("rollers wear 1e3 times more", both(1e3) | {"evolution.allow_deep": True}),
        RobustnessCase("equal wear of both bodies", both(1.0)),
        RobustnessCase("rollers wear 1e3 times less", both(1e-3)),
    ]


def _bodies() -> list[RobustnessCase]:
    return [
        RobustnessCase("near-incompressible cylinder", {"cylinder.material": INCOMPRESSIBLE}),
        RobustnessCase(
            "near-incompressible bodies",
            {"cylinder.material": INCOMPRESSIBLE, "roller.material": INCOMPRESSIBLE},
        ),
        RobustnessCase("near-rigid bodies", {"cylinder.material": RIGID, "roller.material": RIGID}),
        RobustnessCase(
            "three rollers with offsets and slack",
            {
                "roller.offset": ["-3 mm", "0 mm", "2 mm"],
                "creepage.tilt": ["1 mrad", "-2 mrad", "0.5 mrad"],
                "creepage.yaw": ["0.3 mrad", "0 mrad", "-1 mrad"],
            },
        ),
    ]


def _strips() -> list[RobustnessCase]:
    return [
        RobustnessCase("3 strips", {"contact.strips": 3, "contact.width": "60 mm"}, strips=0),
        RobustnessCase(
            "2000 strips",
            {
                "contact.strips": 2000,
                "contact.width": "24 mm",
                "wear.cylinder.k_over_h": "1.1e-8 1/Pa",
                "operation.passes": 8,  # a few steps are sufficient
            },
            strips=0,
        ),
    ]


def _refused(duration: float) -> list[RobustnessCase]:
    recorded = {"kind": "recorded", "file": "log.csv"}
    below_zero = log_of_load(duration, (0.4, 0.6), (300.0, -10.0, 300.0))
    slow = {"gain": "1 N/W", "time_constant": "20 min"}
    falling = log_of_load(duration, (0.4, 0.6), (300.0, 20.0, 300.0))
    sprung = {"kind": "recorded", "file": "falling.csv", "stiffness": "15000 N/mm"}
    white = {
        "distribution": "white",
        "marginal": {"distribution": "maxent", "support": [0, "inf"], "mean": 0.1, "std": 0.05},
    }

    def case(name: str, changes: dict[str, object], *words: str) -> RobustnessCase:
        files = {"log.csv": below_zero, "falling.csv": falling}
        return RobustnessCase(name, changes, files, words)

    return [
        case("1 strip", {"contact.strips": 1}, "[contact] strips", "3"),
        case("2 strips", {"contact.strips": 2}, "[contact] strips", "3"),
        case("load below zero and back", {"load": recorded}, "[load]", "falls to zero", "-10 N"),
        case(
            "load below zero and back, heated",
            {"load": {**recorded, "thermal": slow}},
            "contact is lost",
            "pass",
            "recorded load",
        ),
        case(
            "spring that lifts the roller off under load",
            {"load": sprung},
            "contact is lost",
            "has run out of travel",
        ),
        case(
            "tilt that moves the contact off the strips",
            {"creepage.tilt": "50 mrad", "contact.width": "10 mm", "contact.centre": "0 mm"},
            "[contact] width",
            "does not fit",
        ),
        case(
            "groove that outgrows the strips",
            {"contact.width": "4 mm", "operation.passes": LONG},
            "edge of its strips",
            "contact.width",
        ),
        RobustnessCase(
            "strips much narrower than long",
            {"roller.crown_radius": f"{crown_radius_of(0.3)!r} m", "contact.strips": 640},
            refused=("longer than wide",),
            of_default_model=True,
        ),
        case(
            "friction field in a run",
            {"friction.coefficient": white},
            "friction.coefficient",
            "field",
        ),
    ]

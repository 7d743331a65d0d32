"""Files that hard cases name: worn, rough and broken profiles, and logs of loads."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cache

import numpy as np

from wearsim.mechanics.hertz.elasticity import combine
from wearsim.mechanics.hertz.ellipse import hertz
from wearsim.scenario import Scenario, parse_scenario
from wearsim.scenario.examples import shipped_scenario
from wearsim.types import FloatArray

_REACH, _POINTS = 16.0, 801  # mm to either side of the middle, and how many heights

_ROUGHNESS_WAVES = 24

_EDGE = 1e-3  # of a test: how long a load takes from one level to the next


def profile(height: Callable[[FloatArray], FloatArray], finer: int = 1) -> str:
    """Return the CSV of a profile.

    Parameters
    ----------
    height : callable
        Height [um] over the axial position [mm].
    finer : int
        How many times closer its points are, over as many times less width.
    """
    y = np.linspace(-_REACH / finer, _REACH / finer, _POINTS)
    return _csv("y [mm], height [um]", y, height(y))


def log_of_load(duration: float, parts: tuple[float, ...], levels: tuple[float, ...]) -> str:
    """Return the CSV of a load that holds one level after another.

    Parameters
    ----------
    duration : float
        Length of the test [s].
    parts : tuple of float
        Where each level but the first begins, as part of the test.
    levels : tuple of float
        Loads [N].
    """
    time, load = [0.0], [levels[0]]
    for part, before, after in zip(parts, levels[:-1], levels[1:], strict=True):
        time += [part * duration, (part + _EDGE) * duration]
        load += [before, after]
    return _csv("time [s], load [N]", np.array([*time, duration]), np.array([*load, levels[-1]]))


def step(y: FloatArray) -> FloatArray:
    """Return a groove 5 um deep with upright sides, 0.5 mm to either side of the middle."""
    return np.where(np.abs(y) < 0.5, -5.0, 0.0)


def groove(y: FloatArray) -> FloatArray:
    """Return a smooth groove 8 um deep, which leaves two patches."""
    return -8.0 * np.exp(-np.square(y / 0.5))


def edge(y: FloatArray) -> FloatArray:
    """Return a track that ends 0.8 mm beside the middle."""
    return np.where(y > 0.8, -60.0, 0.0)


def ridges(y: FloatArray) -> FloatArray:
    """Return two ridges: the roller first touches the higher, then both, then all between."""
    first, second = (np.exp(-np.square((y - at) / 0.2)) for at in (-0.8, 0.8))
    found: FloatArray = 30.0 * first + 8.0 * second
    return found


def waviness(y: FloatArray) -> FloatArray:
    """Return waves of 0.4 mm, 0.5 um high, that come and go."""
    return 0.5 * np.sin(2.0 * np.pi * y / 0.4) * np.cos(1.7 * y)


def roughness(y: FloatArray) -> FloatArray:
    """Return roughness as it is measured: 0.5 um rms, correlated over 0.1 mm, of fixed phases.

    Waves of a Gaussian spectrum, equally spaced in wave number, with phases of the golden ratio.
    """
    length, number = 0.1, np.arange(1, _ROUGHNESS_WAVES + 1)
    wave = 4.0 / length * (number - 0.5) / _ROUGHNESS_WAVES
    amplitude = np.exp(-np.square(0.5 * wave * length) / 2.0)
    phase = 2.0 * np.pi * ((0.5 * (np.sqrt(5.0) - 1.0) * np.square(number)) % 1.0)
    found: FloatArray = amplitude @ np.cos(wave[:, None] * y + phase[:, None])
    found *= 0.5 / np.sqrt(0.5 * np.square(amplitude).sum())
    return found


def _csv(head: str, *columns: FloatArray) -> str:
    rows = (", ".join(map(repr, row)) for row in np.stack(columns, axis=1).tolist())
    return "\n".join([head, *rows])


BASE = "rig-450min"

LONG, SHORT = 1_350_000, 60_000  # roller passes

RIGID = {"youngs_modulus": "2e5 GPa", "poisson_ratio": 0.3}

INCOMPRESSIBLE = {"youngs_modulus": "200 GPa", "poisson_ratio": 0.4999}


@dataclass(frozen=True)
class HardCase:
    """A problem, and what is expected of it.

    Parameters
    ----------
    name : str
    changes : mapping of str to object
        What sets it apart from the shipped `rig-450min`, by dotted key.
    files : mapping of str to str
        Content of the files that it names.
    refused : tuple of str
        Words of the error that it must end with; empty where it must run to its end.
    patches : tuple of int
        How many patches the contact must have, one after another; empty where that is no matter.
    strips : int
        The coarsest strips that can show the problem; 0 where it has strips of its own.
    rough : bool
        Whether the line load follows a profile that is rough or broken itself.
    of_default_model : bool
        Whether only the default contact model is expected to do so.
    steps : int
        Times the usual forced steps that follow what changes in time.
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

    def passes(self, usual: int) -> int:
        """Return the roller passes of its test: its own, or the usual."""
        own = self.changes.get("operation.passes", usual)
        assert isinstance(own, int)
        return own

    def scenario(self, passes: int, others: Mapping[str, object]) -> Scenario:
        """Return the scenario of so many passes unless it has its own, with further changes."""
        base = _base()
        changes = {"operation.passes": passes, **self.changes, **others}
        return parse_scenario(base.text, f"{self.name}.toml", self.files.__getitem__, changes)


@cache
def _base() -> Scenario:
    return shipped_scenario(BASE)


def hard_cases(passes: int) -> tuple[HardCase, ...]:
    """Return all hard cases.

    Parameters
    ----------
    passes : int
        Of a test, where a case has no number of its own.
    """
    duration = passes / _base().pass_rate
    return (
        HardCase("the rig as it is", {}),
        *_shapes(),
        *_profiles(),
        *_loads(duration),
        *_rubbing(),
        *_wear(),
        *_bodies(),
        *_strips(),
        *_refused(duration),
    )


def crown_radius_of(ratio: float) -> float:
    """Return the crown radius [m] that makes the rig's fresh patch `ratio` times as wide as long.

    Parameters
    ----------
    ratio : float
        b/a.
    """
    base = _base()
    along = 0.5 * (1.0 / base.cylinder.radius + 1.0 / base.roller.radius)
    modulus = combine(base.cylinder.material, base.roller.material).contact_modulus
    low, high = 1e-4, 1e4
    while high > low * (1.0 + 1e-12):
        middle = (low * high) ** 0.5
        # the ratio does not depend on the load
        patch = hertz(along, 0.5 / middle, 1.0, modulus)
        # a and b are half axes along and across rolling
        low, high = (middle, high) if patch.b < ratio * patch.a else (low, middle)
    return low


def _shapes() -> list[HardCase]:
    return [
        HardCase(f"b/a = {ratio:g}", {"roller.crown_radius": f"{crown_radius_of(ratio)!r} m"})
        for ratio in (200.0, 60.0, 1.0, 0.3)
    ]


def _profiles() -> list[HardCase]:
    def case(name: str, heights: str, **more: object) -> HardCase:
        changes = {"cylinder.profile": "profile.csv"}
        return HardCase(name, changes, {"profile.csv": heights}, **more)  # type: ignore[arg-type]

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
        HardCase(
            "roughness 0.5 um at 0.1 mm",
            {"cylinder.profile": "profile.csv", "operation.passes": 2000},
            {"profile.csv": profile(roughness, finer=4)},
            strips=100,
            rough=True,
        ),
    ]


def _loads(duration: float) -> list[HardCase]:
    def logged(name: str, *levels: float) -> HardCase:
        parts = tuple(k / len(levels) for k in range(1, len(levels)))
        log = log_of_load(duration, parts, levels)
        return HardCase(name, {"load": {"kind": "recorded", "file": "log.csv"}}, {"log.csv": log})

    def spring(stiffness: str) -> dict[str, object]:
        return {"load": {"kind": "spring", "normal_force": "300 N", "stiffness": stiffness}}

    return [
        logged("load to 1 N and back", 300.0, 1.0, 300.0),
        logged("load steps x10", 30.0, 300.0, 30.0, 300.0, 30.0),
        HardCase("spring unloaded by wear", spring("6.9 kN/mm")),
        HardCase(
            "spring unloaded to nothing",
            # to a thousandth of a newton; a model that cannot get there must not hold up the others
            {**spring("69 kN/mm"), "operation.passes": 600_000, "evolution.max_steps": 2000},
            steps=16,
        ),
    ]


def _rubbing() -> list[HardCase]:
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
        HardCase("friction 0.001", {"friction.coefficient": 0.001}),
        HardCase("friction 1", {"friction.coefficient": 1.0}),
        HardCase(
            "friction per pass, 50 % scatter",
            {"friction.coefficient": scattered, "evolution.nodes": 8, "evolution.tolerance": 1e-2},
        ),
        HardCase("creepage 1e-6", {"creepage.longitudinal": 1e-6}),
        HardCase("creepage negative", {"creepage.longitudinal": -1e-3}),
        HardCase("no creepage", {"creepage.longitudinal": 0.0}),
        HardCase("pure spin", {"creepage.longitudinal": 0.0, "creepage.tilt": "2 mrad"}),
        HardCase("pure lateral", {"creepage.longitudinal": 0.0, "creepage.yaw": "1 mrad"}),
        HardCase(
            "creepage through zero in y",
            {"creepage.longitudinal": 1e-4, "creepage.differential_slip": True},
            rough=True,  # nothing wears where nothing slips: two ridges are left standing
        ),
        HardCase("creepage through zero in time", {"creepage.longitudinal": wandering}, steps=8),
    ]


def _wear() -> list[HardCase]:
    def both(ratio: float) -> dict[str, object]:
        return {"wear.roller.k_over_h": f"{1.1e-11 * ratio!r} 1/Pa"}

    return [
        HardCase("K/H x 1e3", {"wear.cylinder.k_over_h": "1.1e-8 1/Pa", "operation.passes": 1360}),
        HardCase(
            "the whole groove in ten passes",
            {"wear.cylinder.k_over_h": "1.5e-6 1/Pa", "operation.passes": 10},
        ),
        HardCase("K/H x 1e-6", {"wear.cylinder.k_over_h": "1.1e-17 1/Pa"}),
        HardCase("1e9 passes", {"operation.passes": 10**9}),
        HardCase("rollers wear 1e3 times more", both(1e3)),
        HardCase("both bodies wear alike", both(1.0)),
        HardCase("rollers wear 1e3 times less", both(1e-3)),
    ]


def _bodies() -> list[HardCase]:
    return [
        HardCase("near-incompressible cylinder", {"cylinder.material": INCOMPRESSIBLE}),
        HardCase(
            "near-incompressible bodies",
            {"cylinder.material": INCOMPRESSIBLE, "roller.material": INCOMPRESSIBLE},
        ),
        HardCase("near-rigid bodies", {"cylinder.material": RIGID, "roller.material": RIGID}),
        HardCase(
            "three rollers with offsets and slack",
            {
                "roller.offset": ["-3 mm", "0 mm", "2 mm"],
                "creepage.tilt": ["1 mrad", "-2 mrad", "0.5 mrad"],
                "creepage.yaw": ["0.3 mrad", "0 mrad", "-1 mrad"],
            },
        ),
    ]


def _strips() -> list[HardCase]:
    return [
        HardCase("3 strips", {"contact.strips": 3, "contact.width": "60 mm"}, strips=0),
        HardCase(
            "2000 strips",
            {
                "contact.strips": 2000,
                "contact.width": "24 mm",
                "wear.cylinder.k_over_h": "1.1e-8 1/Pa",
                "operation.passes": 8,  # a few steps are enough to see 2000 strips through
            },
            strips=0,
        ),
    ]


def _refused(duration: float) -> list[HardCase]:
    to_zero = log_of_load(duration, (0.4, 0.6), (300.0, 0.0, 300.0))
    recorded = {"kind": "recorded", "file": "log.csv"}
    below_zero = log_of_load(duration, (0.4, 0.6), (300.0, -10.0, 300.0))
    slow = {"gain": "1 N/W", "time_constant": "20 min"}
    white = {
        "distribution": "white",
        "marginal": {"distribution": "maxent", "support": [0, "inf"], "mean": 0.1, "std": 0.05},
    }

    def case(name: str, changes: dict[str, object], *words: str) -> HardCase:
        return HardCase(name, changes, {"log.csv": to_zero, "below.csv": below_zero}, words)

    return [
        case("1 strip", {"contact.strips": 1}, "[contact] strips", "3"),
        case("2 strips", {"contact.strips": 2}, "[contact] strips", "3"),
        case("load to zero and back", {"load": recorded}, "[load]", "falls to nothing", "0 N"),
        case(
            "load below zero and back, heated",
            {"load": {**recorded, "file": "below.csv", "thermal": slow}},
            "contact is lost",
            "pass",
            "the log",
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
        HardCase(
            "strips much narrower than long",
            {"roller.crown_radius": f"{crown_radius_of(0.3)!r} m", "contact.strips": 640},
            refused=("half-length exceeds", "contact.strips"),
            of_default_model=True,
        ),
        case(
            "friction from point to point in a run",
            {"friction.coefficient": white},
            "friction.coefficient",
            "field",
        ),
    ]

"""Random wear tests: shipped scenarios with random changes."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache

import numpy as np

from wearsim.scenario import Scenario, parse_scenario
from wearsim.scenario.examples import shipped_scenario

RIG, THREE, LOGGED = "rig-450min", "rig-three-rollers", "rig-logged-load"
TOLERANCES = (1e-2, 1e-3, 1e-4)
K_OVER_H = 1.1e-11  # 1/Pa, of the rig
#: product of friction, creepage, load and passes of the rig [N], and the largest worn volume
#: relative to that of the rig; wear factors are a tenth where it would be larger
RIG_SLIDING, LARGEST = 0.1 * 1e-3 * 300.0 * 1.35e6, 2.0
DIFFERENTIAL_SLIP = 1e-3  # greatest differential slip in a groove of the rig
PASSES = 5e3, 1.35e6
#: passes of tests without a compiled loop over passes, and of those with inputs drawn at every
#: pass: each pass takes long
SLOW_PASSES = 5e3, 1e4
#: passes of tests with differential slip, which have many strips, and of tests that are compared
#: with a solver of differential equations
FEWER_PASSES = 5e3, 1e5


@dataclass(frozen=True)
class RandomTest:
    """A shipped scenario with random changes.

    Parameters
    ----------
    name : str
        Seed and number of the test.
    base : str
        Name of the shipped scenario.
    changes : mapping of str to object
        Changed values by dotted key.
    files : mapping of str to str
        Content of the files that the changes name.
    """

    name: str
    base: str
    changes: Mapping[str, object]
    files: Mapping[str, str] = field(default_factory=dict)

    def scenario(self, **others: object) -> Scenario:
        """Return the scenario with further changes; two underscores represent the dot of a key."""
        base = _shipped(self.base)
        changes = {**self.changes, **{k.replace("__", "."): v for k, v in others.items()}}
        files = {**base.files, **self.files}
        return parse_scenario(base.text, f"{self.name}.toml", files.__getitem__, changes)

    @property
    def tolerance(self) -> float:
        """Tolerance of the test."""
        return self.scenario().evolution.tolerance

    @property
    def digest(self) -> str:
        """Hash of base, changes and files."""
        content = json.dumps([self.base, self.changes, self.files], sort_keys=True)
        return hashlib.sha256(content.encode()).hexdigest()[:12]

    @property
    def settings(self) -> str:
        """The changes in one line."""
        changes = {k: v for k, v in self.changes.items() if k not in _UNINTERESTING}
        return ", ".join([self.base, *(f"{key} = {_brief(v)}" for key, v in changes.items())])


_UNINTERESTING = {"load.file", "sampling.realisation", "outputs.records"}


def _brief(value: object) -> str:
    """Return a value of a scenario without braces and quotation marks."""
    if isinstance(value, dict):
        return "(" + ", ".join(f"{key} {_brief(item)}" for key, item in value.items()) + ")"
    return ", ".join(map(str, value)) if isinstance(value, list) else str(value)


@cache
def _shipped(name: str) -> Scenario:
    return shipped_scenario(name)


class _Draws:
    """Random numbers of one test, and the changes that they make."""

    def __init__(self, seed: int, number: int) -> None:
        self._random = np.random.default_rng([seed, number])
        self.changes: dict[str, object] = {}
        self.files: dict[str, str] = {}

    def chance(self, probability: float) -> bool:
        return bool(self._random.random() < probability)

    def uniform(self, low: float, high: float) -> float:
        return _rounded(self._random.uniform(low, high))

    def log_uniform(self, low: float, high: float) -> float:
        return _rounded(np.exp(self._random.uniform(np.log(low), np.log(high))))

    def choice(self, weights: Mapping[str, float]) -> str:
        return str(self._random.choice(list(weights), p=list(weights.values())))

    def normal(self, size: int) -> list[float]:
        return [float(value) for value in self._random.standard_normal(size)]


def _rounded(value: float) -> float:
    return float(f"{value:.4g}")


def random_test(seed: int, number: int, share: float = 1.0) -> RandomTest:
    """Return a random test; each seed gives another sequence of tests.

    Parameters
    ----------
    seed, number : int
        Not negative.
    share : float
        Part of its passes that the test has.
    """
    draws = _Draws(seed, number)
    changes = draws.changes
    changes["evolution.tolerance"] = TOLERANCES[min(int(draws.uniform(0, 3)), 2)]
    kind = draws.choice({"usual": 0.82, "t-gamma": 0.06, "free": 0.07, "per-pass": 0.05})
    load = draws.choice({"constant": 0.3, "spring": 0.3, "recorded": 0.2, "process": 0.2})
    heated, differs = draws.chance(0.2), draws.chance(0.2)
    passes = draws.log_uniform(*(FEWER_PASSES if differs else PASSES))
    if kind == "per-pass":
        passes = draws.log_uniform(*SLOW_PASSES)
    elif kind != "usual":
        smooth = load in {"constant", "spring"} and not heated
        passes = draws.log_uniform(*(FEWER_PASSES if smooth else SLOW_PASSES))
    passes = max(share * passes, 10.0)
    changes["operation.passes"] = int(passes)
    base = RIG if draws.chance(0.75) else THREE
    if load == "recorded" and draws.chance(0.3):
        base = LOGGED
    elif base == RIG and draws.chance(0.25):
        changes["operation.rollers"] = 1
    rollers = 1 if "operation.rollers" in changes else 3
    duration = passes / _shipped(RIG).pass_rate * 3 / rollers
    if base == THREE:
        spread = draws.log_uniform(0.05, 1.0)
        changes["roller.offset"] = [f"{_rounded(spread * at)!r} mm" for at in draws.normal(3)]
    crown = draws.log_uniform(0.15, 1.5)
    changes["roller.crown_radius"] = f"{crown * 1e3:.4g} mm"
    force = draws.log_uniform(50.0, 1000.0)
    _set_load(draws, base, load, force, duration, pauses=kind != "free")
    if heated:
        time = draws.log_uniform(0.02, 1.0) * duration
        gain = draws.log_uniform(5.0, 100.0)
        changes["load.thermal"] = {"gain": f"{gain!r} N/W", "time_constant": f"{time:.4g} s"}
    friction, creepage = draws.log_uniform(0.03, 0.4), draws.log_uniform(1e-4, 4e-3)
    _set_friction(draws, kind, friction, creepage, force, duration)
    yaw = _set_angles(draws, rollers, crown)
    if differs:
        changes["creepage.differential_slip"] = True
    slip = float(np.hypot(creepage, yaw)) + (DIFFERENTIAL_SLIP if differs else 0.0)
    _set_wear(draws, kind, friction, slip, force, crown, int(passes))
    return RandomTest(f"{seed}-{number}", base, changes, draws.files)


def _set_load(
    draws: _Draws, base: str, load: str, force: float, duration: float, *, pauses: bool
) -> None:
    """Set the load: constant, with a spring, logged, or an Ornstein-Uhlenbeck process."""
    changes = draws.changes
    stiffness = f"{draws.log_uniform(20.0, 5000.0)!r} N/mm"
    sprung = load == "spring" or (load in {"process", "recorded"} and draws.chance(0.4))
    if load == "recorded":
        if base != LOGGED:
            draws.files["log.csv"] = _log(draws, force, duration, pauses=pauses)
            changes["load"] = {"kind": "recorded", "file": "log.csv"}
    else:
        changes["load.kind"] = "spring" if sprung else "constant"
        changes["load.normal_force"] = f"{force!r} N"
    if sprung:
        changes["load.stiffness"] = stiffness
    if load == "process":
        spread = force * draws.log_uniform(0.03, 0.2)
        changes["load.normal_force"] = _process(draws, f"{force!r} N", f"{spread:.4g} N", duration)


def _log(draws: _Draws, force: float, duration: float, *, pauses: bool) -> str:
    """Return the CSV of a log: ramps between random levels, steps between them, or a pause.

    A free roller would skid next to a pause.
    """
    kind = draws.choice({"ramps": 0.5, "steps": 0.3, "pause": 0.2})
    kind = "steps" if kind == "pause" and not pauses else kind
    count = int(draws.log_uniform(4.0, 60.0))
    if kind == "pause":
        count = 4
    levels = [force * np.exp(0.3 * value) for value in draws.normal(count)]
    if kind == "pause":
        levels[2] = 0.0
    times = np.linspace(0.0, duration, count + (kind != "ramps"))
    rows = list(zip(times.tolist(), levels, strict=False))
    if kind != "ramps":  # a level lasts until shortly before the next one
        ends = [*(times[1:-1] - 1e-3 * duration / count).tolist(), duration]
        rows = sorted([*rows, *zip(ends, levels, strict=True)])
    lines = [f"{time!r}, {_rounded(level)!r}" for time, level in rows]
    return "\n".join(["time [s], load [N]", *lines])


def _process(draws: _Draws, mean: object, std: object, duration: float) -> dict[str, object]:
    """Return an Ornstein-Uhlenbeck process of a positive value."""
    time = draws.log_uniform(0.02, 0.5) * duration
    zero = "0 N" if isinstance(mean, str) else 0
    marginal = {"distribution": "maxent", "support": [zero, "inf"], "mean": mean, "std": std}
    return {
        "distribution": "ornstein-uhlenbeck",
        "correlation_time": f"{time:.4g} s",
        "marginal": marginal,
    }


def _set_friction(
    draws: _Draws, kind: str, friction: float, creepage: float, force: float, duration: float
) -> None:
    """Set friction and creepage: numbers, processes, drawn at every pass, or a free roller."""
    changes = draws.changes
    values = {"friction.coefficient": friction, "creepage.longitudinal": creepage}
    chosen = list(values)[int(draws.chance(0.5))]
    spread = draws.uniform(0.05, 0.3)
    varies = draws.chance(0.15) and kind == "usual"
    changes.update(values)
    if varies:
        value = values[chosen]
        changes[chosen] = _process(draws, value, _rounded(spread * value), duration)
    if kind == "per-pass":
        value = values[chosen]
        changes[chosen] = {
            "distribution": "maxent",
            "support": [0, "inf"],
            "mean": value,
            "std": _rounded(spread * value),
            "persistence": "per-pass",
        }
    if kind == "free":
        torque = draws.log_uniform(0.01, 0.3) * friction * force * 20.0  # of a roller of 20 mm
        changes["creepage"] = {"drive": "free", "bearing_torque": f"{torque:.4g} N mm"}
        del changes["creepage.longitudinal"]


def _set_angles(draws: _Draws, rollers: int, crown: float) -> float:
    """Set yaw and tilt, and return the largest yaw [rad]."""
    changes, largest = draws.changes, 0.0
    for name in ("yaw", "tilt"):
        # a tilt moves the contact by at most 1.5 mm
        greatest = 2.0 if name == "yaw" else min(2.0, 1.5 / crown)
        angles = [draws.uniform(-greatest, greatest) for _ in range(rollers)]
        if draws.chance(0.25):
            texts = [f"{angle!r} mrad" for angle in angles]
            same = rollers == 1 or draws.chance(0.7)
            changes[f"creepage.{name}"] = texts[0] if same else texts
            largest = 1e-3 * max(map(abs, angles)) if name == "yaw" else largest
    if draws.chance(0.3):
        changes["creepage.tilt_shifts_contact"] = False
    return largest


def _set_wear(
    draws: _Draws,
    kind: str,
    friction: float,
    slip: float,
    force: float,
    crown: float,
    passes: int,
) -> None:
    """Set the wear law: Archard's, or T gamma with transitions near the initial load."""
    changes = draws.changes
    factor = K_OVER_H * draws.log_uniform(0.1, 10.0)
    ratio = draws.log_uniform(0.01, 10.0) if draws.chance(0.3) else 0.0
    sliding = friction * slip * force * passes / RIG_SLIDING
    while factor / K_OVER_H * (1.0 + ratio) * sliding > LARGEST:
        factor /= 10.0
    if kind != "t-gamma":
        changes["wear.cylinder.k_over_h"] = f"{factor:.4g} 1/Pa"
        changes["wear.roller.k_over_h"] = f"{ratio * factor:.4g} 1/Pa"
        return
    pressure = 5e8 * (force / 300.0 * 0.5 / crown) ** (1.0 / 3.0)  # Pa, near the mean of Hertz
    onset = friction * slip * pressure * draws.log_uniform(0.1, 3.0)
    mild = 7850.0 * factor
    regimes = {
        "mild": f"{mild:.4g} kg/J",
        "severe": f"{onset * mild:.4g} kg/m^3",
        "catastrophic": f"{mild * draws.log_uniform(1.0, 10.0):.4g} kg/J",
        "catastrophic_from": f"{onset * draws.log_uniform(1.5, 10.0):.4g} Pa",
    }
    changes["wear"] = {
        "law": "t-gamma",
        "cylinder": regimes,
        "roller": {**regimes, "factor": ratio},
    }

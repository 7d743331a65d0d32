"""Short wear tests of all kinds, and functions to stop, finish and compare them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from tests.results_compared import differences
from tests.rig_text import BODIES, RUBBING
from wearsim.errors import Interrupted
from wearsim.evolution.steppers import per_pass
from wearsim.scenario import Scenario, parse_scenario
from wearsim.studies.run import run as studies
from wearsim.studies.run.result import Result, RunData

RIG = (
    'title = "a rig"\n\n'
    + BODIES
    + """
[operation]
speed = "1000 rpm"
passes = 6000
rollers = 3

[load]
normal_force = "300 N"

"""
    + RUBBING
    + """
[contact]
strips = 41
width = "5 mm"

[wear]
cylinder = { k_over_h = "1.1e-11 1/Pa" }
roller = { k_over_h = "0 1/Pa" }


[outputs]
records = 4
"""
)

# 50 passes a second: a log of 12 minutes lasts 36 000 passes
LOG = "time [min],load [N]\n" + "".join(f"{k / 4},{300 + 60 * (-1) ** k + k}\n" for k in range(49))

STEPPERS: dict[str, dict[str, object]] = {
    "implicit": {"evolution.tolerance": 0.005},
    "stabilised": {"evolution.stepper": "stabilised", "evolution.tolerance": 1e-4},
    "explicit": {"evolution.stepper": "explicit", "evolution.tolerance": 0.02},
    "compiled passes": {"evolution.stepper": "per-pass"},
    "passes in Python": {
        "evolution.stepper": "per-pass",
        "contact.tangential": "fastsim",
        "contact.mx": 4,
        "operation.passes": 100,
    },
}
LOADS: dict[str, dict[str, object]] = {
    "constant": {},
    "spring": {"load.kind": "spring", "load.stiffness": "20000 N/mm"},
    "recorded and thermal": {
        "load": {
            "kind": "recorded",
            "file": "load.csv",
            "thermal": {"gain": "300 N/W", "time_constant": "30 s"},
        }
    },
}
ROLLERS: dict[str, dict[str, object]] = {
    "identical": {},
    "offset": {"roller.offset": ["-1 mm", "0.3 mm", "1 mm"], "contact.width": "7 mm"},
    "wearing": {"wear.roller.k_over_h": "1e-11 1/Pa"},
}
PITTING = {
    "law": "pressure-life",
    "source": "a test",
    "reference_passes": 1e6,
    "reference_pressure": "700 MPa",
    "exponent": 8.0,
}
OTHERS: dict[str, dict[str, object]] = {
    "hertz-fastsim": {
        "contact.model": "hertz-fastsim",
        "contact.mx": 10,
        "contact.my": 10,
        "contact.width": "6 mm",
    },
    "free rollers": {
        "creepage": {"drive": "free", "bearing_torque": "0.3 N*m", "differential_slip": True}
    },
    "tilted and yawed": {
        "creepage.tilt": ["0.05 deg", "0 deg", "-0.05 deg"],
        "creepage.yaw": "0.02 deg",
        "contact.width": "6 mm",
    },
    "log spacing": {"outputs.records": 30, "outputs.spacing": "log"},
    "forced steps": {"evolution.step": 700},
    "fatigue": {"fatigue": {"slope": 1.125, "cylinder": PITTING, "roller": PITTING}},
    "fatigue under a log, removed by wear": {
        "operation.passes": 3000,
        "fatigue": {"slope": 1.125, "remove": True, "cylinder": PITTING},
        "load": {"kind": "recorded", "file": "load.csv"},
    },
}


def short(**overrides: object) -> Scenario:
    """Return the rig's scenario with overrides; `__` in a name is the dot of a key."""
    dotted = {key.replace("__", "."): value for key, value in overrides.items()}
    return parse_scenario(RIG, "rig.toml", {"load.csv": LOG}.__getitem__, dotted)


def run_once(scenario: Scenario) -> Result:
    """Return the run of a scenario in memory, computed once; it is not to be changed."""
    key = scenario.sha256, per_pass.CHUNK, per_pass.SLOW_CHUNK
    if key not in _RUNS:
        _RUNS[key] = studies.run(scenario)
    return _RUNS[key]


_RUNS: dict[tuple[str, int, int], Result] = {}


def run_differences(one: Result | RunData, other: Result | RunData) -> list[str]:
    """Return the names of values that differ between two runs, except times of day."""
    first, second = (item.raw if isinstance(item, Result) else item for item in (one, other))
    times = {"wall_seconds", "created", "failed_at"}
    return [name for name in differences(first, second) if name not in times]


def after(steps: int) -> Callable[[], bool]:
    """Return a function that requests a stop after a number of steps."""
    left = steps

    def requested() -> bool:
        nonlocal left
        left -= 1
        return left <= 0

    return requested


def run_in_parts(scenario: Scenario, path: Path, *steps: int) -> tuple[Result, int]:
    """Run a test in parts of the given numbers of steps; return the number of parts too.

    The last number of steps applies to all further parts.
    """
    counts = list(steps)
    parts = 0
    while True:
        stop = after(counts.pop(0) if len(counts) > 1 else counts[0])
        parts += 1
        try:
            if parts == 1:
                return studies.run(scenario, path, stop_requested=stop), parts
            return studies.resume(path, stop_requested=stop), parts
        except Interrupted:
            continue

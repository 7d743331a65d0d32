"""Synthetic runs of any size, which need only the results package."""

from __future__ import annotations

import numpy as np

from wearsim.results.content import Arrays
from wearsim.studies.run.result import RunData
from wearsim.studies.run.schema import AXES, VARIABLES

SCENARIO = 'title = "a rig"\n# µ = 0.1\n[load]\nfile = "load.csv"\n'
LOG = "time [s],load [N]\n0,300\n60,310\n"
COUNTS = {"rejected", "solves", "full_solves"}


def some_run(
    seed: int = 0,
    steps: int = 5,
    records: int = 3,
    strips: int = 7,
    stations: int = 1,
    rollers: int = 1,
    realisations: int = 1,
    **changes: object,
) -> RunData:
    """Return a run with random arrays; `changes` replaces fields."""
    lengths = dict(zip(AXES, (steps, records, stations, rollers, realisations), strict=True))
    arrays = _random_arrays(np.random.default_rng(seed), lengths | {"y": strips})

    def of_kind(kind: str) -> Arrays:
        return {n: array for n, array in arrays.items() if VARIABLES[n].kind == kind}

    values: dict[str, object] = {
        "scenario_text": SCENARIO,
        "scenario_file": "scenarios/rig.toml",
        "title": "a rig",
        "sha256": "ab" * 32,
        "seed": 2**63 - 1 - seed,
        "files": {"load.csv": LOG},
        "software": {"wearsim": "0.1.0", "numpy": "2.0"},
        "plugins": [{"kind": "contact model", "name": "slender", "distribution": "wearsim"}],
        "model": "slender",
        "stepper": "implicit",
        "tolerance": 1e-3,
        "width_threshold": 1e-6,
        "total_passes": 1.35e6,
        "notes": ["a note with a µ"],
        "warnings": [],
        "kinematics": {"rolling_speed": 2.618, "pass_rate": 0.1 + 0.2},
        "static": of_kind("static"),
        "history": of_kind("history"),
        "records": of_kind("record"),
        "checkpoint": some_checkpoint(seed, strips),
        "finished": False,
        "wall_seconds": 1.25,
        "created": "2030-01-02T03:04:05+00:00",
    }
    return RunData(**(values | changes))  # type: ignore[arg-type]


def _random_arrays(random: np.random.Generator, lengths: dict[str, int]) -> Arrays:
    arrays: Arrays = {}
    for name, variable in VARIABLES.items():
        shape = tuple(lengths[dim] for dim in variable.dims)
        arrays[name] = random.integers(0, 99, shape) if name in COUNTS else random.random(shape)
    arrays["y"] = 1e-3 * np.arange(lengths["y"], dtype=float)
    arrays["passes"] = 1000.0 * np.arange(lengths["step"])
    arrays["record_passes"] = 2000.0 * np.arange(lengths["record"])
    return arrays


def some_checkpoint(seed: int = 0, strips: int = 7, count: int = 0) -> Arrays:
    """Return arrays of every type that a state may contain."""
    random = np.random.default_rng(seed + 1)
    extra = {f"coarse_contact_{k}": random.random(strips) for k in range(count)}
    return extra | {
        "passes": np.asarray(1234.5),
        "steps": np.asarray(17),
        "stable": np.asarray(True),
        "terms": np.zeros((0, 3, 1)),
        "cylinder_depth": random.random((1, 1, 1, strips)),
        "odd": np.array([np.nan, np.inf, -0.0, 5e-324]),
        "iterations": random.integers(0, 9, 4).astype(np.int32),
        "touching": random.random(strips) > 0.5,
        "strided": random.random((6, strips))[::2, ::-1],
    }

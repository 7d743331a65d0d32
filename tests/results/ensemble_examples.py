"""Synthetic ensembles of any size, which need only the results package."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from run_examples import LOG, SCENARIO

from wearsim.results.content import Arrays
from wearsim.studies.ensemble.file.data import EnsembleData, Outcome
from wearsim.studies.ensemble.file.parts import read_ensemble
from wearsim.studies.ensemble.file.schema import OBSERVABLES, STATISTICS
from wearsim.studies.ensemble.file.writer import EnsembleFile

RECORDS, ROLLERS, STRIPS = 4, 3, 9
SCALARS = ("steps", "solves", "depth_error", "volume_error")
INPUTS = [
    {"key": "load.normal_force", "unit": "N", "input": "load.normal_force", "rollers": ""},
    {"key": "creepage.yaw", "unit": "1", "input": "misalignment", "rollers": "each"},
]


def some_header(requested: int = 20, **changes: object) -> EnsembleData:
    """Return the data known before the first realisation; `changes` replaces fields."""
    values: dict[str, object] = {
        "scenario_text": SCENARIO,
        "scenario_file": "scenarios/rig.toml",
        "title": "a rig",
        "sha256": "ab" * 32,
        "seed": 2**63 - 1,
        "files": {"load.csv": LOG},
        "software": {"wearsim": "0.1.0"},
        "plugins": [],
        "model": "slender",
        "stepper": "implicit",
        "tolerance": 1e-3,
        "width_threshold": 1e-6,
        "total_passes": 1.35e6,
        "total_time": 27000.1,
        "strip_width": 6e-5,
        "plan": "sobol",
        "requested": requested,
        "until": "depth.mean 1%",
        "inputs": INPUTS,
        "groups": [{"name": "misalignment", "role": "joint", "persistence": "per-roller"}],
        "notes": ["a note with a µ"],
        "warnings": [],
        "finished": False,
        "wall_seconds": 0.0,
        "created": "2030-01-02T03:04:05+00:00",
    }
    return EnsembleData(**(values | changes))  # type: ignore[arg-type]


def some_static(strips: int = STRIPS) -> Arrays:
    """Return the arrays common to all realisations."""
    return {
        "y": 1e-3 * np.arange(strips),
        "multiplicity": np.ones(ROLLERS),
        "record_passes": 2000.0 * np.arange(RECORDS),
        "record_time": 40.0 * np.arange(RECORDS),
    }


def some_outcome(number: int, strips: int = STRIPS, error: str = "") -> Outcome:
    """Return an outcome that depends only on the number of the realisation."""
    random = np.random.default_rng(number)
    drawn: dict[str, float | np.ndarray] = {
        "load.normal_force": random.random(),
        "creepage.yaw": random.random(ROLLERS),
    }
    if error:
        return Outcome(number=number, error=error, values=drawn)
    courses = {name: random.random(RECORDS) for name in OBSERVABLES}
    scalars = {name: random.random() for name in SCALARS}
    profile = random.random(strips)
    return Outcome(number=number, values={**drawn, **courses, **scalars, "depth_profile": profile})


def some_statistics(data: EnsembleData) -> Arrays:
    """Return arrays for all statistics of an ensemble."""
    random = np.random.default_rng(1)
    return {name: random.random(data.shapes[name]) for name in STATISTICS}


def finish(file: EnsembleFile, **fields: object) -> None:
    """Merge the parts of an ensemble, with some statistics and changed fields."""
    file.finish(lambda data: ({"finished": True, **fields}, some_statistics(data)))


def contents(path: Path) -> dict[str, bytes]:
    """Return the content of an ensemble without its run id and its part files."""
    data = read_ensemble(path)
    arrays = {name: array.tobytes() for name, array in data.variables.items()}
    fields = {name: repr(value).encode() for name, value in data.attributes.items()}
    del fields["run_id"], fields["merged"], fields["wall_seconds"]
    status = {"status": data.status.tobytes(), "errors": repr(data.errors).encode()}
    return {**arrays, **fields, **status}


def differences(one: Path, other: Path | dict[str, bytes]) -> list[str]:
    """Return the names of the fields in which an ensemble differs from another, or its contents."""
    first = contents(one)
    second = contents(other) if isinstance(other, Path) else other
    return [name for name in first.keys() | second.keys() if first.get(name) != second.get(name)]

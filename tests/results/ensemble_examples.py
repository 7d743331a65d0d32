"""Synthetic ensembles of any size, which need only the results package."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from run_examples import LOG, SCENARIO

from wearsim.results import EnsembleData, EnsembleFile, Outcome
from wearsim.results.content import Arrays
from wearsim.results.ensemble.schema import OBSERVABLES, STATISTICS

RECORDS, ROLLERS, STRIPS = 4, 3, 9
SCALARS = ("steps", "solves", "depth_error", "volume_error")
INPUTS = [
    {"key": "load.normal_force", "unit": "N", "input": "load.normal_force", "rollers": ""},
    {"key": "creepage.yaw", "unit": "1", "input": "misalignment", "rollers": "each"},
]


def some_header(asked: int = 20, **changes: object) -> EnsembleData:
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
        "asked": asked,
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
        return Outcome(number=number, error=error, drawn=drawn)
    return Outcome(
        number=number,
        drawn=drawn,
        observables={name: random.random(RECORDS) for name in OBSERVABLES},
        scalars={name: random.random() for name in SCALARS},
        profile=random.random(strips),
    )


def some_statistics(path: Path) -> Arrays:
    """Return arrays for all statistics of a file."""
    with EnsembleFile.open(path) as file:
        shapes = {name: file.data.variables[name].shape for name in STATISTICS}
    random = np.random.default_rng(1)
    return {name: random.random(shape) for name, shape in shapes.items()}


def without_state(path: Path) -> bytes:
    """Return the bytes of a file, with the two slots of its state set to zero."""
    import h5py

    content = bytearray(path.read_bytes())
    with h5py.File(path, locking=False) as file:
        for place in file["checkpoint"].values():
            start, size = place.id.get_offset(), place.id.get_storage_size()
            content[start : start + size] = bytes(size)
    return bytes(content)

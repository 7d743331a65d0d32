"""Small ensembles of short, fast-wearing tests, and their bitwise comparison."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from tests.studies.random_examples import CREEPAGE, LOAD, SLACK, scenario_of
from wearsim.scenario import Scenario
from wearsim.studies.ensemble.api import ensemble
from wearsim.studies.ensemble.file.parts import read_ensemble
from wearsim.studies.ensemble.result import EnsembleResult

LOGNORMAL = {"distribution": "lognormal", "median": "2e-9 1/Pa", "factor": 1.5}


def small(**changes: object) -> Scenario:
    """Return the rig with random load, creepage, misalignment and K/H per test, quick to run."""
    inputs: dict[str, object] = {
        "passes": 3000,
        "contact__strips": 41,
        "evolution__tolerance": 1e-2,
        "outputs__records": 2,
        "load__normal_force": LOAD,
        "creepage__longitudinal": CREEPAGE,
        "creepage__misalignment": SLACK,
        "wear__cylinder__k_over_h": LOGNORMAL,
    }
    given = {**inputs, **changes}
    passes, factor = given.pop("passes"), given.pop("wear__cylinder__k_over_h")
    return scenario_of(passes, factor, **given)


def partly_failing(**changes: object) -> Scenario:
    """Return tests of which some fail, by a limit on the number of steps."""
    return small(evolution__max_steps=median_steps(), **changes)


@cache
def median_steps() -> int:
    """Return the median of the steps of twelve of the small tests."""
    with TemporaryDirectory() as folder:
        tests = ensemble(small(), 12, Path(folder) / "tests.h5", scheduler="serial")
        return int(np.median(tests.values("steps")))


def contents(path: Path | EnsembleResult) -> dict[str, bytes]:
    """Return all arrays of an ensemble's file and its errors, as bytes by name."""
    data = path.raw if isinstance(path, EnsembleResult) else read_ensemble(path)
    found = {name: array.tobytes() for name, array in data.variables.items()}
    return {**found, "status": data.status.tobytes(), "errors": repr(data.errors).encode()}


def differences(one: Path | EnsembleResult, other: Path | EnsembleResult) -> list[str]:
    """Return the names of the arrays that differ between two ensembles."""
    first, second = contents(one), contents(other)
    return [name for name in first.keys() | second.keys() if first.get(name) != second.get(name)]

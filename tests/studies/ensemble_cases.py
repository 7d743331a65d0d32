"""Small ensembles of short, fast-wearing tests, and how two files of them are compared."""

from __future__ import annotations

from pathlib import Path

from tests.studies.random_examples import CREEPAGE, LOAD, SLACK, scenario_of
from wearsim.results import EnsembleResult, read_ensemble
from wearsim.scenario import Scenario

LOGNORMAL = {"distribution": "lognormal", "median": "2e-9 1/Pa", "factor": 1.5}


def small(**changes: object) -> Scenario:
    """Return the rig with load, creepage, slack and K/H drawn once per test, quick to run."""
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
    passes, law = given.pop("passes"), given.pop("wear__cylinder__k_over_h")
    return scenario_of(passes, law, **given)


def frail(**changes: object) -> Scenario:
    """Return tests of which a part fails: they may take no more steps than most of them need."""
    return small(evolution__max_steps=14, **changes)


def contents(path: Path | EnsembleResult) -> dict[str, bytes]:
    """Return all arrays of an ensemble's file and its errors, as bytes by name."""
    data = path.raw if isinstance(path, EnsembleResult) else read_ensemble(path)
    found = {name: array.tobytes() for name, array in data.variables.items()}
    return {**found, "status": data.status.tobytes(), "errors": repr(data.errors).encode()}


def unlike(one: Path | EnsembleResult, other: Path | EnsembleResult) -> list[str]:
    """Return the names of what two ensembles differ in, to the bit."""
    mine, theirs = contents(one), contents(other)
    return [name for name in mine.keys() | theirs.keys() if mine.get(name) != theirs.get(name)]

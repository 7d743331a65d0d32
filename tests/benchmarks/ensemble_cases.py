"""Ensembles of the rig with the random inputs of the paper, for the benchmarks."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

import wearsim
from wearsim.scenario import Scenario
from wearsim.studies.ensemble.api import ensemble
from wearsim.types import FloatArray

SCENARIOS = Path(__file__).parents[2] / "scenarios"
RIG, ALL = SCENARIOS / "rig-450min.toml", SCENARIOS / "rig-ensemble.toml"
_LOAD = {"distribution": "maxent", "support": ["0 N", "inf"], "mean": "307 N", "std": "32 N"}
PAPER: Mapping[str, dict[str, object]] = {
    "load.normal_force": _LOAD,
    "friction.coefficient": {
        "distribution": "maxent",
        "support": [0, "inf"],
        "mean": 0.1,
        "std": 0.02,
    },
    "creepage.longitudinal": {
        "distribution": "maxent",
        "support": [0, 1],
        "mean": 1e-3,
        "std": 4e-4,
    },
    "creepage.misalignment": {"distribution": "disc", "radius": "2 mrad"},
}
"""Random inputs of the paper."""


@dataclass(frozen=True)
class Size:
    """Size of the ensembles.

    Parameters
    ----------
    tests : int
        Number of tests of each ensemble.
    passes : int, optional
        Roller passes of a shortened test, with a wear factor that is increased in proportion; by
        default tests are not shortened.
    """

    tests: int = 300
    passes: int | None = None

    def shortened(self) -> dict[str, object]:
        """Return the overrides that shorten a test of the rig."""
        if self.passes is None:
            return {}
        whole = wearsim.load_scenario(RIG).total_passes
        return {
            "operation.passes": self.passes,
            "wear.cylinder.k_over_h": f"{1.1e-11 * whole / self.passes!r} 1/Pa",
        }


def drawn(persistence: str, size: Size, more: Mapping[str, object] | None = None) -> Scenario:
    """Return the rig with the paper's inputs, drawn per test, per roller or per pass."""
    changes: dict[str, object] = {
        key: {**given, "persistence": persistence} for key, given in PAPER.items()
    }
    changes |= {"evolution.tolerance": 1e-2, "outputs.records": 1}
    return wearsim.load_scenario(RIG, {**changes, **size.shortened(), **(more or {})})


@dataclass(frozen=True)
class Variation:
    """A coefficient of variation with its 95 % interval."""

    value: float
    low: float
    high: float

    @classmethod
    def of(cls, values: FloatArray) -> Variation:
        """Estimate it, with an error from the influence of each realisation."""
        unit, count = values / values.mean() - 1.0, len(values)
        square = float((unit**2).sum()) / (count - 1)
        found = math.sqrt(square)
        if found < 1e-12:
            return cls(0.0, 0.0, 0.0)
        influence = (unit**2 - square) / (2.0 * found) - found * unit
        error = 1.96 * float(influence.std(ddof=1)) / math.sqrt(count)
        return cls(found, found - error, found + error)

    def __str__(self) -> str:
        return f"{self.value:.2%} ({self.low:.2%} to {self.high:.2%})"


def end_values(scenario: Scenario, count: int, **options: Any) -> dict[str, FloatArray]:
    """Run an ensemble and return its final values by observable; no realisation may fail."""
    with TemporaryDirectory() as folder:
        result = ensemble(scenario, count, Path(folder) / "ensemble.h5", **options)
        if result.failed:
            raise RuntimeError(f"{result.failed} realisations failed: {dict(result.errors)}")
        return {name: np.array(result.at_end(name)) for name in result.observables}

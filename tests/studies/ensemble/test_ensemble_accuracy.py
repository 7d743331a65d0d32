"""Accuracy of realisations compared with tests in which every pass is solved."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import wearsim
from tests.studies.random_examples import CREEPAGE, FRICTION, LOAD, SLACK, scenario_of
from wearsim.studies.ensemble.api import ensemble

ALL = Path(__file__).parents[3] / "scenarios" / "rig-ensemble.toml"
FAST = {"distribution": "lognormal", "median": "2e-9 1/Pa", "factor": 1.5}
SHORT = {
    "operation.passes": 6000,
    "wear.cylinder.k_over_h": FAST,
    "load.normal_force.correlation_time": "20 s",
}


def test_realisations_agree_with_per_pass_reference(tmp_path):
    result = ensemble(wearsim.load_scenario(ALL, SHORT), 5, tmp_path / "e.h5", scheduler="serial")
    assert result.count == 5
    for number in range(5):
        chosen = {"sampling.realisation": number, "evolution.stepper": "per-pass"}
        reference = wearsim.run(wearsim.load_scenario(ALL, {**SHORT, **chosen}))
        for name in ("depth", "worn_volume"):
            expected = float(getattr(reference, name)[-1])
            assert result.at_end(name)[number] == pytest.approx(expected, rel=0.01)


def test_per_pass_scatter_decreases_with_passes(tmp_path):
    """The scatter is inversely proportional to the square root of the number of passes."""
    inputs = {
        "load__normal_force": LOAD,
        "friction__coefficient": FRICTION,
        "creepage__longitudinal": CREEPAGE,
        "creepage__misalignment": SLACK,
    }
    inputs = {key: {**table, "persistence": "per-pass"} for key, table in inputs.items()}
    passes = 1500
    scenario = scenario_of(
        passes, contact__strips=31, evolution__stepper="per-pass", outputs__records=1, **inputs
    )
    volume = ensemble(scenario, 10, tmp_path / "e.h5", scheduler="serial").at_end("worn_volume")
    spread = volume.std(ddof=1) / volume.mean()
    # one contact of the paper scatters by 0.44; the scatter of ten tests is known to a quarter
    assert spread == pytest.approx(0.44 / np.sqrt(passes), rel=0.75)
    assert spread * np.sqrt(passes / 1.35e6) < 0.01

"""RealisationRunner of ensembles beside tests in which every pass is solved by itself."""

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


def test_that_five_members_are_within_a_percent_of_single_passes(tmp_path):
    members = ensemble(wearsim.load_scenario(ALL, SHORT), 5, tmp_path / "e.h5", scheduler="serial")
    assert members.count == 5
    for number in range(5):
        chosen = {"sampling.realisation": number, "evolution.stepper": "per-pass"}
        truth = wearsim.run(wearsim.load_scenario(ALL, {**SHORT, **chosen}))
        for name in ("depth", "worn_volume"):
            true = float(getattr(truth, name)[-1])
            assert members.at_end(name)[number] == pytest.approx(true, rel=0.01)


def test_that_draws_at_every_pass_average_out(tmp_path):
    """The fewer the passes the more they leave: by the root of their number."""
    inputs = {
        "load__normal_force": LOAD,
        "friction__coefficient": FRICTION,
        "creepage__longitudinal": CREEPAGE,
        "creepage__misalignment": SLACK,
    }
    inputs = {key: {**law, "persistence": "per-pass"} for key, law in inputs.items()}
    passes = 1500
    scenario = scenario_of(
        passes, contact__strips=31, evolution__stepper="per-pass", outputs__records=1, **inputs
    )
    volume = ensemble(scenario, 10, tmp_path / "e.h5").at_end("worn_volume")
    spread = volume.std(ddof=1) / volume.mean()
    # one contact of the paper scatters by 0.44; ten tests tell their spread to a quarter of it
    assert spread == pytest.approx(0.44 / np.sqrt(passes), rel=0.75)
    assert spread * np.sqrt(passes / 1.35e6) < 0.01

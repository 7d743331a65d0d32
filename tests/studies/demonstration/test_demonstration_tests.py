"""Demonstration tests of simulated designs: requirements, acceleration, and the shell."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest
from scipy.special import ndtr, ndtri
from typer.testing import CliRunner

import wearsim
from tests.studies.identify.grooves import TEXT
from wearsim.cli.app import app
from wearsim.studies.demonstration.result import Requirement

FACTOR = {"distribution": "lognormal", "median": "1.1e-11 1/Pa", "factor": 1.5}
R, C, SCATTER = 0.9, 0.95, math.log(1.5)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with lives of a rig at two loads, with K/H alone random."""
    found = tmp_path_factory.mktemp("demonstration")
    (found / "rig.toml").write_text(TEXT + '\n[limit]\ndepth = "50 um"\n')
    for load in (300, 400):
        changed = {"wear.cylinder.k_over_h": FACTOR, "load.normal_force": f"{load} N"}
        scenario = wearsim.load_scenario(found / "rig.toml", changed)
        wearsim.life(scenario, 1, found / f"{load}N.h5", scheduler="serial")
    return found


def test_requirement_is_read_in_passes_and_in_time():
    found = Requirement.parse("R=0.9 C=0.95 at 500 h", "passes")
    assert found == (0.9, 0.95, pytest.approx(500.0), "h", 3600.0, 2)
    found = Requirement.parse("r = 0.99, c = 0.9 at 1e6 turns with 5 failures", "turns")
    assert found == (0.99, 0.9, 1e6, "turns", 0.0, 5)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("R=0.9 C=0.95", "expected a survival, a confidence and a life"),
        ("R=1.2 C=0.95 at 500 h", "R must be between 0 and 1, got 1.2"),
        ("R=0.9 C=0 at 500 h", "C must be between 0 and 1, got 0"),
        ("R=x C=0.9 at 500 h", "R is not a number"),
        ("R=0.9 C=0.9 at -500 h", "must be above zero"),
        ("R=0.9 C=0.9 at 5 mm", "is not a life"),
        ("R=0.9 C=0.9 at 500 h with 99 failures", "at most 20 failures"),
    ],
)
def test_wrong_requirements_are_refused(text: str, words: str):
    with pytest.raises(ValueError, match="'") as caught:
        Requirement.parse(text, "passes")
    assert words in str(caught.value)


def test_lognormal_shape_gives_specimens_in_closed_form(folder: Path):
    lives = wearsim.open_results(folder / "300N.h5")
    found = wearsim.demonstration(lives, f"R={R} C={C} at 400000")
    assert found.by_binomial == [29, 46, 61]
    for ratio in (0.7, 1.0, 2.0):
        survived = ndtr(-(ndtri(1.0 - R) + math.log(ratio) / SCATTER))
        plan = found.plan(400_000 * ratio)
        assert plan.specimens == math.ceil(math.log(1.0 - C) / math.log(survived))
        assert (plan.low, plan.high) == (plan.specimens, plan.specimens)
        passing = lives.survival(400_000 * ratio).value ** plan.specimens
        assert plan.passing.value == pytest.approx(passing, rel=1e-2)
    assert found.life.value == pytest.approx(lives.b(10).value, rel=1e-4)
    assert found.survival.value == pytest.approx(lives.survival(400_000).value, rel=1e-4)


def test_acceleration_is_the_ratio_of_lives(folder: Path):
    lives, harder = (wearsim.open_results(folder / f"{load}N.h5") for load in (300, 400))
    found = wearsim.demonstration([lives, harder], f"R={R} C={C} at 100 h", labels=["300", "400"])
    factor = found.acceleration(1)
    assert factor.value == pytest.approx(lives.b(10).value / harder.b(10).value, rel=1e-4)
    assert factor.value > 1.2
    assert factor.low == factor.high
    # a test that is shorter by the acceleration takes the same specimens
    assert found.plan(100.0 / factor.value, 0, 1).specimens == found.plan(100.0).specimens == 29


def test_scatter_of_other_inputs_gives_intervals(folder: Path):
    friction = {"distribution": "lognormal", "median": 0.1, "factor": 1.2}
    changed = {"wear.cylinder.k_over_h": FACTOR, "friction.coefficient": friction}
    scenario = wearsim.load_scenario(folder / "rig.toml", changed)
    lives = wearsim.life(scenario, 12, scheduler="serial")
    found = wearsim.demonstration(lives, f"R={R} C={C} at 400000")
    plan = found.plan(200_000)
    assert plan.low < plan.specimens < plan.high
    assert plan.passing.low < plan.passing.value < plan.passing.high
    assert found.life.low < found.life.value < found.life.high
    assert np.log(found.life.value / lives.b(10).value) == pytest.approx(0.0, abs=0.05)


def test_shell_shows_and_writes_tests(folder: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.chdir(folder)
    text = f"R={R} C={C} at 100 h"
    both = ["life", "300N.h5", "400N.h5"]
    found = CliRunner().invoke(app, [*both, "--demonstrate", text, "--json", "--table", "t.csv"])
    assert found.exit_code == 0, found.stderr
    data = json.loads(found.stdout)
    assert data["specimens_by_binomial"] == [29, 46, 61]
    assert data["tests"][1]["acceleration"]["value"] > 1.2
    assert (folder / "t.csv").read_text().startswith("conditions,duration [h],failures,specimens")
    shown = CliRunner().invoke(app, [*both, "--demonstrate", text, "--figure", "t.png"])
    assert "acceleration by 400N" in shown.stdout
    assert (folder / "t.png").stat().st_size > 1000
    for wrong in ("R=0.9 C=2 at 100 h", "nothing"):
        refused = CliRunner().invoke(app, ["life", "300N.h5", "--demonstrate", wrong])
        assert refused.exit_code == 2

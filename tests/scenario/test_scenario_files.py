"""Shipped scenarios: they load with the installed plugins and have the documented values."""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np
import pytest

from wearsim.csv_tables import read_columns
from wearsim.scenario import Scenario, load_scenario, require_run
from wearsim.types import Grid

FOLDER = Path(__file__).parents[2] / "scenarios"


def _load(name: str) -> Scenario:
    return load_scenario(FOLDER / f"{name}.toml")


@pytest.mark.parametrize("path", sorted(FOLDER.glob("*.toml")), ids=lambda path: path.stem)
def test_shipped_scenario_loads_and_builds_its_plugins(path: Path) -> None:
    scenario = load_scenario(path)
    assert tomllib.loads(scenario.text)["title"] == scenario.title
    materials = scenario.cylinder.material, scenario.roller.material
    scenario.contact.build(Grid.spanning(-1e-3, 1e-3, 11), materials)
    assert scenario.load.built
    for term in scenario.load.terms:
        assert term.built
    if scenario.wear is not None:
        require_run(scenario)
        assert scenario.wear.built


def test_rig_has_the_corrected_radii() -> None:
    rig = _load("rig-450min")
    assert (rig.roller.radius, rig.roller.crown_radius, rig.cylinder.radius) == (0.02, 0.5, 0.025)
    assert rig.total_passes == 1_350_000
    assert rig.rolling_speed == pytest.approx(2.618, abs=5e-4)
    assert rig.wear is not None
    assert rig.wear.options.model_dump(exclude_none=True) == {
        "factor": 1.0,
        "cylinder": {"k_over_h": 1.1e-11},
        "roller": {"k_over_h": 0.0},
    }


def test_printed_rig_is_twice_as_large() -> None:
    rig, printed = _load("rig-450min"), _load("rig-as-printed")
    assert printed.roller.radius == 2 * rig.roller.radius
    assert printed.roller.crown_radius == 2 * rig.roller.crown_radius
    assert printed.cylinder.radius == 2 * rig.cylinder.radius
    assert "are diameters" in printed.text


def test_three_rollers_have_different_offsets() -> None:
    scenario = _load("rig-three-rollers")
    assert scenario.per_roller(scenario.roller.offset) == (-1e-3, 3e-4, 1e-3)


def test_log_is_labelled_synthetic_and_covers_the_test() -> None:
    scenario = _load("rig-logged-load")
    [(path, text)] = scenario.files.items()
    assert "synthetic" in scenario.title
    assert text.startswith("# SYNTHETIC")
    log = read_columns(text, path, {"time": "s", "load": "N"}, rising="time")
    assert log["time"][0] == 0.0
    assert log["time"][-1] >= scenario.total_time
    assert np.mean(log["load"]) == pytest.approx(307.0, abs=0.1)
    assert np.std(log["load"]) == pytest.approx(32.0, abs=0.1)
    assert np.polyfit(log["time"], log["load"], 1)[0] < 0.0

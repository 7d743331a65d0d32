"""Worn profiles as the start of another test: halves of a test against the whole."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import wearsim
from wearsim.cli.app import app
from wearsim.errors import ResultsFileError, ScenarioError
from wearsim.scenario.tables.start_profiles import StartSurface

SCENARIOS = Path(__file__).parents[3] / "scenarios"
Y = np.linspace(-8e-3, 8e-3, 321)
BOTH = {"wear.roller.k_over_h": "1.1e-11 1/Pa"}


def halves(scenario: wearsim.Scenario, length: str, folder: Path):
    """Return the whole test, its first half, and the second half from the worn profiles."""
    key, number, unit = length.partition(" ")[0], *length.split(" ")[1:]
    whole, half = (
        scenario.changed({key: f"{size} {unit}" if unit else size})
        for size in (int(number), int(number) // 2)
    )
    first = wearsim.run(half)
    files = wearsim.export_running_in(first, folder)
    return wearsim.run(whole), first, wearsim.run(wearsim.load_scenario(files.paths[0]))


def profile(result: wearsim.Result, body: str, place: int = 0) -> np.ndarray:
    """Return the worn depth of a body at positions of these tests, (positions,)."""
    rows = result.raw.records[f"{body}_depth_profile"][-1, place, 0]
    return np.interp(Y, result.y, rows)


def agree(whole, first, second, body: str, places: int = 1) -> None:
    """Require that the halves add up to the whole within the errors that they state."""
    rows = [np.array([profile(r, body, k) for k in range(places)]) for r in (whole, first, second)]
    difference = rows[1] + rows[2] - rows[0]
    stated = [float(result.values("profile_error")[-1]) for result in (whole, first, second)]
    assert np.sqrt((difference**2).sum() / (rows[0] ** 2).sum()) < sum(stated)
    greatest = (rows[1] + rows[2]).max()
    errors = [float(result.depth_error[-1]) for result in (whole, first, second)]
    assert greatest == pytest.approx(rows[0].max(), abs=sum(errors))


def test_two_halves_of_the_rig_equal_the_whole_test(tmp_path):
    rig = wearsim.load_scenario(SCENARIOS / "rig-450min.toml", BOTH)
    whole, first, second = halves(rig, "operation.duration 450 min", tmp_path)
    agree(whole, first, second, "cylinder")
    agree(whole, first, second, "roller")
    for name in ("worn_volume", "dissipated_energy"):
        total = getattr(first, name)[-1] + getattr(second, name)[-1]
        assert total == pytest.approx(getattr(whole, name)[-1], rel=1e-3)


def test_different_rollers_start_from_their_own_profiles(tmp_path):
    rig = wearsim.load_scenario(
        SCENARIOS / "rig-three-rollers.toml", {**BOTH, "contact.strips": 61}
    )
    whole, first, second = halves(rig, "operation.duration 60 min", tmp_path)
    assert sorted(path.name for path in tmp_path.glob("roller-*.csv")) == [
        f"roller-{number}-worn.csv" for number in (1, 2, 3)
    ]
    agree(whole, first, second, "cylinder")
    agree(whole, first, second, "roller", 3)


CAM = {
    "creepage": {"drive": "creepage", "longitudinal": 1e-3},
    "load.feedback": "none",
    "cam.stations": 1,
    "contact.strips": 61,
}


def test_two_halves_of_a_cam_equal_the_whole_at_every_station(tmp_path):
    cam = wearsim.load_scenario(SCENARIOS / "cam-cycloidal.toml", CAM)
    whole, first, second = halves(cam, "operation.turns 40000 ", tmp_path)
    angles = [result.values("station_angle") for result in (whole, first, second)]
    assert np.array_equal(angles[0], angles[2])
    depths = np.array([profile(whole, "cylinder", k).max() for k in range(len(angles[0]))])
    assert np.ptp(depths) > 0.05 * depths.max()
    agree(whole, first, second, "cylinder", len(depths))
    agree(whole, first, second, "roller")


def test_shell_writes_and_runs_a_worn_start(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    shell = CliRunner()
    log = SCENARIOS / "synthetic-load.csv"
    text = (SCENARIOS / "rig-logged-load.toml").read_text().replace(log.name, f"../{log.name}")
    (tmp_path / "a").mkdir()
    (tmp_path / "a" / "rig.toml").write_text(text)
    (tmp_path / log.name).write_text(log.read_text())
    short = ["--set", "operation.duration=2 min", "-o", "rig.h5"]
    assert shell.invoke(app, ["run", "a/rig.toml", *short]).exit_code == 0
    made = shell.invoke(app, ["export", "rig.h5", "--running-in", "worn"])
    assert made.exit_code == 0, made.stderr
    assert made.stdout.splitlines()[:2] == ["worn/rig-worn.toml", "worn/cylinder-worn.csv"]
    assert "the load begins again at time 0" in made.stderr
    scenario = wearsim.load_scenario("worn/rig-worn.toml")
    assert scenario.cylinder.profile.height.min() < 0.0
    assert "inputs/synthetic-load.csv" in scenario.files
    assert wearsim.run(scenario).depth[-1] > 0.0
    again = shell.invoke(app, ["export", "rig.h5", "--running-in", "worn"])
    assert again.exit_code == 2
    assert "already exists" in again.stderr


def test_worn_profiles_are_those_of_one_test(tmp_path):
    scenario = wearsim.load_scenario(SCENARIOS / "rig-450min.toml")
    study = wearsim.study_contact(scenario)
    with pytest.raises(ResultsFileError, match=r"one wear test.*not of a ContactStudy"):
        wearsim.export_running_in(study, tmp_path)


def test_start_surface_is_linear_between_its_angles_and_closed():
    y = np.array([-1.0, 1.0])
    angle = np.array([1.0, 3.0, 3.0, 6.0])
    surface = StartSurface(angle, y, np.array([[1.0, 1.0], [2.0, 2.0], [5.0, 7.0], [8.0, 8.0]]))
    at = np.array([1.0, 2.0, 3.0, 3.0, 4.5, 6.0, 6.0 + 0.5 * (math.tau - 5.0)])
    found = surface.at(at, np.array([-1.0, 0.0]))
    assert found[:, 0] == pytest.approx([1.0, 1.5, 2.0, 5.0, 6.5, 8.0, 4.5])
    assert found[3, 1] == pytest.approx(6.0)


SURFACES = {
    "different positions": ("0,-1,0\n0,1,0\n90,-2,0\n90,1,0", "the same positions y"),
    "an angle beyond a turn": ("0,-1,0\n0,1,0\n400,-1,0\n400,1,0", "within 0 to 360 deg"),
    "an angle three times": ("0,-1,0\n0,1,0\n" * 3, "at most twice"),
    "a single position": ("0,1,0\n90,1,0", "at least two"),
}


@pytest.mark.parametrize("name", SURFACES)
def test_mistakes_of_a_start_surface_are_reported(name, tmp_path):
    rows, message = SURFACES[name]
    (tmp_path / "worn.csv").write_text(f"angle [deg],y [mm],height [um]\n{rows}\n")
    text = (SCENARIOS / "cam-cycloidal.toml").read_text()
    changes = {"cam.start_profile": "worn.csv"}
    with pytest.raises(ScenarioError, match=rf"start_profile: worn\.csv.*{message}"):
        wearsim.Scenario.from_toml(text, changes, folder=tmp_path)


def test_number_of_start_profiles_is_that_of_the_rollers(tmp_path):
    (tmp_path / "worn.csv").write_text("y [mm],depth [um]\n-1,0\n1,0\n")
    text = (SCENARIOS / "rig-450min.toml").read_text()
    with pytest.raises(ScenarioError, match="profile: a list has one value per roller"):
        wearsim.Scenario.from_toml(text, {"roller.profile": ["worn.csv"] * 2}, folder=tmp_path)

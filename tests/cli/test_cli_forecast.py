"""Forecast and refusals of `wearsim check`, and limits and deep grooves of `run` and `resume`."""

import json
import re
from pathlib import Path

import pytest
from cli_examples import SCENARIOS, Command

import wearsim
from wearsim.errors import Interrupted, ResultsFileError
from wearsim.studies.opening import open_results

FREE = """\
drive = "free"
bearing_torque = "700 N mm"
"""


def test_check_prints_the_forecast(command: Command, scenario: Path) -> None:
    result = command("check", scenario)
    assert result.exit_code == 0
    rows = " ".join(result.stdout.split())
    assert "forecast depth 0.8" in rows
    assert "(within a factor of 3)" in rows
    data = json.loads(command("check", scenario, "--json").stdout)["forecast"]
    run = json.loads(command("run", scenario, "-q", "--json").stdout)
    assert data["depth_m"] == pytest.approx(run["depth_m"], rel=0.12)
    keys = {"steps", "wall_time_s", "memory_bytes", "file_bytes", "peak_pressure_Pa"}
    assert all(data[key] > 0.0 for key in keys)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ("contact.width=2.9 mm", "raise contact.width = 2.9 mm"),
        ("roller.crown_radius=0.3 mm", "is longer than wide"),
    ],
)
def test_check_refuses_what_the_run_would(
    command: Command, scenario: Path, change: str, message: str
) -> None:
    longer = ("--set", "operation.duration=100 min", "--set", change)
    checked = command("check", scenario, *longer)
    assert checked.exit_code in (1, 2)
    assert command("run", scenario, "-q", *longer).exit_code == checked.exit_code
    assert message in checked.stderr or "the initial contact does not fit" in checked.stderr


def test_check_refuses_a_roller_that_skids(command: Command, scenario: Path) -> None:
    scenario.write_text(scenario.read_text().replace("longitudinal = 1e-3", FREE))
    result = command("check", scenario)
    assert result.exit_code == 1
    assert "lower creepage.bearing_torque = 700 N mm to below 600 N mm" in result.stderr


def test_records_of_gigabytes_give_a_warning_with_a_remedy(
    command: Command, scenario: Path
) -> None:
    long = ("--set", "operation.duration=450 min", "--set")
    (warning,) = re.findall(
        r"warning: outputs\.every_passes = 1: 1,350,001 records make a results file of .*",
        command("check", scenario, *long, "outputs.every_passes=1").stderr,
    )
    least = int(re.findall(r"at least (\d+) makes one below 1 GB", warning)[0])
    assert least > 1
    enough = command("check", scenario, *long, f"outputs.every_passes={least}")
    assert "outputs" not in enough.stderr
    timed = command("check", scenario, *long, "outputs.every=0.02 s").stderr
    assert "warning: outputs.every = " in timed
    numbered = command("check", scenario, *long, "outputs.records=1000000").stderr
    assert "warning: outputs.records = 1000000: 1,000,001 records" in numbered


def test_run_warns_of_records_of_gigabytes(scenario: Path) -> None:
    output, large = (
        scenario.with_name("x.h5"),
        {"operation.duration": "450 min", "outputs.every_passes": 1},
    )
    with pytest.raises(Interrupted):
        wearsim.run(wearsim.load_scenario(scenario, large), output, stop_requested=lambda: True)
    assert any("1,350,001 records" in text for text in open_results(output).warnings)


def test_run_is_refused_where_the_disk_has_no_place_for_its_records(scenario: Path) -> None:
    output = scenario.with_name("x.h5")
    larger = {"operation.duration": "1e9 min", "outputs.every_passes": 1}
    with pytest.raises(ResultsFileError, match=r"x\.h5: outputs\.every_passes = 1: .* GB left"):
        wearsim.run(wearsim.load_scenario(scenario, larger), output)
    assert not output.exists()


def test_check_warns_of_a_deep_groove(command: Command, scenario: Path) -> None:
    result = command("check", scenario, "--set", "operation.duration=200000 min")
    assert result.exit_code == 0
    assert "warning: forecast: the worn depth of" in result.stderr
    assert "the run ends there" in result.stderr


def test_limit_in_a_wrong_unit_is_refused_before_the_run(command: Command, tmp_path: Path) -> None:
    file = tmp_path / "cam.h5"
    cam = SCENARIOS / "cam-cycloidal.toml"
    result = command("run", cam, "-q", "-o", file, "--until", "lift error 30 mm")
    assert result.exit_code == 2
    assert "got lift error 30 mm, expected at most 2 mm" in result.stderr
    assert not file.exists()


def test_deep_run_ends_with_its_results_and_is_continued_by_an_option(
    command: Command, scenario: Path
) -> None:
    deep = ("--set", "wear.cylinder.k_over_h=1e-6 1/Pa")
    result = command("run", scenario, "-q", *deep)
    assert result.exit_code == 1
    assert "exceeds a tenth of roller.radius = 20 mm" in result.stderr
    assert "lower operation.duration, or set evolution.allow_deep = true" in result.stderr
    file = Path(f"{scenario.stem}.h5")
    assert open_results(file).depth[-1] > 2e-3
    resumed = command("resume", file, "-q", "--allow-deep", "--json")
    assert resumed.exit_code == 0
    assert json.loads(resumed.stdout)["finished"]

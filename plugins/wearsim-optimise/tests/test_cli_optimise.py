"""`wearsim optimise`: its output and files, and one clear error for each bad input."""

from __future__ import annotations

import json
import re

import pytest

import wearsim
from wearsim.scenario.examples import shipped_scenario

CAM = shipped_scenario("cam-cycloidal").file
VARY = ("--vary", "cam.base_radius=25mm:45mm")
GOAL = ("--minimise", "outer_radius", "--subject-to", "pressure_angle < 9 deg")
FAST = ("--evaluations", 10, "--starts", 1, "--scheduler", "serial", "-q")


def test_best_design_is_printed_kept_and_runs(command, tmp_path):
    files = ("--best", "best.toml", "--figure", "designs.png", "--json")
    done = command("optimise", CAM, *VARY, *GOAL, *FAST, *files)
    assert done.exit_code == 0, done.output
    data = json.loads(done.stdout)
    assert data["quantities"]["pressure_angle"] == pytest.approx(0.15708, rel=1e-3)
    assert (tmp_path / "designs.png").stat().st_size > 1000
    best = wearsim.load_scenario("best.toml")
    assert wearsim.study_cam(best).max_radius[0] == pytest.approx(
        data["quantities"]["outer_radius"]
    )
    shown = command("show", "cam-cycloidal-optimise.h5")
    assert "pressure_angle < 9 deg" in shown.stdout
    assert "active; relaxing it by 1 % changes outer_radius by" in " ".join(shown.stdout.split())
    assert command("resume", "cam-cycloidal-optimise.h5").exit_code == 0
    again = command("optimise", CAM, *VARY, *GOAL, *FAST)
    assert again.exit_code == 2
    assert "--force" in again.stderr
    exported = command("export", "cam-cycloidal-optimise.h5", "-o", "csv")
    assert exported.exit_code == 0
    head = (tmp_path / "csv" / "designs.csv").read_text().splitlines()[0]
    assert "cam.base_radius [mm]" in head
    assert "pressure_angle [deg]" in head


def test_table_of_the_scenario_is_used(command, tmp_path):
    text = f"""{shipped_scenario("cam-cycloidal").text}
[optimise]
vary = ["cam.base_radius=25mm:45mm"]
minimise = ["outer_radius"]
subject_to = ["pressure_angle < 9 deg"]
starts = 1
evaluations = 6
"""
    (tmp_path / "design.toml").write_text(text)
    done = command("optimise", "design.toml", "--scheduler", "serial", "-q", "--json")
    assert done.exit_code == 0, done.output
    assert json.loads(done.stdout)["quantities"]["pressure_angle"] < 0.1571


LIMITED = (*VARY, "--minimise", "outer_radius", "--subject-to")


@pytest.mark.parametrize(
    ("options", "option", "message"),
    [
        ((), "--vary", "nothing is varied"),
        (VARY, "--maximise", "one objective or two"),
        ((*VARY, "--minimise", "outer_radios"), "", "did you mean 'outer_radius'"),
        ((*VARY, "--minimise", "cam.depth"), "", "no quantity is named 'cam.depth'"),
        (("--vary", "cam.base_radius=40mm:25mm", *GOAL), "--vary", "is not above the lower one"),
        (("--vary", "cam.base_radios=25mm:45mm", *GOAL), "--vary", "[cam] base_radios: unknown"),
        (("--vary", "cam.base_radius=25:45", *GOAL), "--vary", "needs a unit"),
        (("--vary", "cam.material=steel,butter", *GOAL), "--vary", "butter"),
        ((*LIMITED, "peak_pressure < 3 mm"), "--subject-to", "3 mm"),
        ((*LIMITED, "peak_pressure < 3"), "--subject-to", "lacks a unit"),
        ((*LIMITED, "peak_pressure"), "--subject-to", "is not a constraint"),
        ((*VARY, *GOAL, "--tolerance", "roller.radius=1mm"), "--tolerance", "not the tolerance of"),
        ((*VARY, *GOAL, "--method", "best"), "--method", "is no method"),
        ((*VARY, *VARY, *GOAL), "--vary", "varied twice"),
        ((*VARY, "--maximise", "life.b10"), "", "one limit or more"),
    ],
)
def test_bad_input_is_one_clear_error_of_its_option(command, options, option, message):
    done = command("optimise", CAM, *options, *FAST)
    assert done.exit_code == 2, done.output
    flat = " ".join(done.stderr.replace("│", " ").split())
    assert message in flat, done.stderr
    assert (f"Invalid value for {option}:" in flat) == bool(option), done.stderr


def test_mistake_of_the_table_names_file_and_key(command, tmp_path):
    text = shipped_scenario("cam-cycloidal").text + (
        '\n[optimise]\nvary = ["cam.base_radius=45mm:25mm"]\nminimise = ["outer_radius"]\n'
    )
    (tmp_path / "design.toml").write_text(text)
    done = command("optimise", "design.toml", *FAST)
    assert done.exit_code == 2
    assert done.stderr.startswith("design.toml: [optimise] vary: 'cam.base_radius=45mm:25mm'")


def test_designs_after_the_search_do_not_count_against_its_budget(command):
    loud = ("--evaluations", 6, "--starts", 1, "--scheduler", "serial")
    done = command("optimise", CAM, *VARY, *GOAL, *loud)
    assert done.exit_code == 0, done.output
    shown = re.findall(r"(\d+) of (\d+), designs", done.stderr)
    assert all(int(number) <= int(most) == 6 for number, most in shown)
    (stated,) = re.findall(r"budget +(\d+) of at most 6 designs in the search", done.stdout)
    assert int(stated) <= 6
    assert f"\n{stated} of at most 6 designs in the search and " in done.stdout


def test_random_value_cannot_be_varied(command):
    life = shipped_scenario("cam-life").file
    done = command("optimise", life, "--vary", "friction.coefficient=0.05:0.2", *GOAL, *FAST)
    assert done.exit_code == 2
    assert "is random" in done.stderr


def test_no_feasible_start_is_one_clear_error(command):
    fast = ("--set", "operation.speed='4000 rpm'")
    done = command("optimise", CAM, *VARY, *GOAL, *FAST, *fast)
    assert done.exit_code == 1
    assert "no feasible start" in done.stderr
    assert "cam.base_radius" in done.stderr

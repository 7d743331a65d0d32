"""Outputs of cams: motion tables, surfaces and animations, and bad names of these files."""

from __future__ import annotations

import csv
import math
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from cli_examples import SCENARIOS, Command
from typer.testing import CliRunner

from wearsim.cli.app import app
from wearsim.mechanics.cam.motion import Motion, Segment
from wearsim.models.motion import LiftSpline
from wearsim.report.animation import Animation
from wearsim.report.panels import Panel
from wearsim.scenario import load_scenario
from wearsim.studies.cam import drawing

CAM, ARM = (str(SCENARIOS / f"cam-{name}.toml") for name in ("cycloidal", "swinging"))


@pytest.fixture(scope="module")
def run_of_arm(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("arm") / "arm.h5"
    settings = ("operation.turns=20000", "evolution.tolerance=1e-2", "contact.strips=31")
    options = [text for setting in settings for text in ("--set", setting)]
    done = CliRunner().invoke(app, ["run", ARM, *options, "-o", str(path), "-q"])
    assert done.exit_code == 0, done.output
    return path


def table(path: str) -> dict[str, list[str]]:
    with Path(path).open(newline="") as file:
        rows = list(csv.DictReader(file))
    return {name: [row[name] for row in rows] for name in rows[0]}


def numbers(columns: dict[str, list[str]], name: str) -> np.ndarray:
    return np.array([float(cell) for cell in columns[name]])


def test_motion_table_has_its_ranges_and_derivatives(command: Command) -> None:
    done = command("cam", CAM, "--at", "0:359:1 deg, 12.5 deg", "--table", "m.csv")
    assert done.exit_code == 0, done.output
    assert "outer radius" in done.stdout
    assert "greatest pressure" in done.stdout
    assert "p0 [MPa]" not in done.stdout  # the rows are in the file
    found = table("m.csv")
    degrees = numbers(found, "angle [deg]")
    assert degrees == pytest.approx([*range(360), 12.5])
    speed, rise, angle = 1000.0 * math.tau / 60.0, 8e-3, math.pi / 2.0
    part = (np.radians(degrees[:360]) - math.pi / 2.0) / angle
    moving = (part >= 0.0) & (part < 1.0 - 1e-9)
    for name, order, shape in (
        ("velocity [m/s]", 1, lambda x: 1.0 - np.cos(math.tau * x)),
        ("acceleration [m/s^2]", 2, lambda x: math.tau * np.sin(math.tau * x)),
        ("jerk [m/s^3]", 3, lambda x: math.tau**2 * np.cos(math.tau * x)),
    ):
        exact = rise * (speed / angle) ** order * shape(part[moving])
        scale = np.abs(exact).max()
        assert numbers(found, name)[:360][moving] == pytest.approx(exact, abs=1e-8 * scale)
    radius = np.hypot(numbers(found, "x [mm]"), numbers(found, "y [mm]"))
    assert radius[[0, 180]] == pytest.approx([25.0, 33.0])
    assert found["segment"][:2] == ["dwell", "dwell"]
    assert {"drive torque [N m]", "rolling speed [m/s]", "radius of curvature [mm]"} < set(found)


def test_motion_table_of_an_arm_has_its_angle_and_path(command: Command) -> None:
    assert command("cam", ARM, "--at", "30:60:15 deg", "--table", "m.csv").exit_code == 0
    found = table("m.csv")
    angle = np.radians(numbers(found, "lift of the arm [deg]"))
    assert numbers(found, "lift [mm]") == pytest.approx(80.0 * angle)
    turned = load_scenario(ARM).cam.motion
    assert numbers(found, "velocity [m/s]") == pytest.approx(
        80e-3 * (1000.0 * math.tau / 60.0) * turned.lift(np.radians([30.0, 45.0, 60.0]))[1]
    )


def test_jerk_of_a_spline_is_its_third_derivative() -> None:
    theta = np.linspace(0.0, math.tau, 73)
    spline = LiftSpline(theta, 1e-3 * (1.0 - np.cos(theta)), closed=True)
    motion = Motion((Segment("lift", math.tau, spline),))
    at = np.linspace(0.0, 6.2, 40)
    assert motion.jerk(at) == pytest.approx(-1e-3 * np.sin(at), abs=1e-8)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--at", "0:359 deg"), "is no range, expected one such as 0:359:1 deg"),
        (("--at", "0:359:0 deg"), "is no range of 1 to 100,000 angles"),
        (("--at", "9:1:1 deg"), "is no range of 1 to 100,000 angles"),
        (("--table", "m.txt"), "no known format of a table, expected .csv"),
        (("--table", "no/m.csv"), "folder no does not exist"),
        (("--surface", "m.step"), "no known format of a surface, expected .csv or .dxf"),
        (("--surface", "no/m.dxf"), "folder no does not exist"),
        (("--surface", "m.csv", "--chord", "0 um"), "is not above 0"),
        (("--surface", "m.csv", "--chord", "1 um", "--points", "9"), "given beside --chord"),
        (("--surface", "m.csv", "--spline"), "is for a .dxf, and the surface is m.csv"),
        (("--chord", "1 um"), "needs a file, --surface"),
    ],
)
def test_bad_name_is_refused_before_anything_is_computed(
    command: Command, monkeypatch, arguments: tuple[str, ...], message: str
) -> None:
    monkeypatch.setattr("wearsim.study_cam", lambda *_: pytest.fail("it was computed"))
    refused = command("cam", CAM, *arguments)
    assert refused.exit_code == 2
    assert message in " ".join(refused.stderr.split())
    assert len([line for line in refused.stderr.splitlines() if "Error" in line]) == 1


def test_missing_extra_is_named_before_anything_is_computed(command: Command, monkeypatch) -> None:
    monkeypatch.setitem(sys.modules, "ezdxf", None)
    monkeypatch.setattr("wearsim.study_cam", lambda *_: pytest.fail("it was computed"))
    refused = command("cam", CAM, "--surface", "m.dxf")
    assert refused.exit_code == 2
    assert "pip install 'wearsim[cad]'" in refused.stderr


def test_surface_of_a_run_is_exported_alone(command: Command, run_of_arm: Path) -> None:
    done = command("export", run_of_arm, "--surface", "w.csv", "--points", 36, "--position", "1 mm")
    assert done.exit_code == 0, done.output
    assert "36 points" in done.stderr
    assert [path.name for path in Path().iterdir()] == ["w.csv"]
    found = table("w.csv")
    assert len(found["x worn [mm]"]) == 36
    assert command("export", run_of_arm, "--surface", "w.csv").exit_code == 2  # it exists


def test_depth_and_lift_error_are_exported_along_the_angle(
    command: Command, run_of_arm: Path
) -> None:
    import wearsim

    assert command("export", run_of_arm, "-o", "csv").exit_code == 0
    found, result = table("csv/along_angle.csv"), wearsim.open_results(run_of_arm)
    assert numbers(found, "angle [deg]") == pytest.approx(np.arange(361.0))
    last = f"at {result.record_passes[-1]:.12g} passes"
    lift = numbers(found, f"lift error {last} [um]")
    assert np.ptp(lift) == pytest.approx(1e6 * result.final["lift_error_m"], rel=1e-3)
    of_arm = np.radians(numbers(found, f"lift error of the arm {last} [deg]"))
    assert of_arm == pytest.approx(1e-6 * lift / 80e-3)
    depth = numbers(found, f"depth {last} [um]")
    assert depth.max() == pytest.approx(1e6 * float(result.depth[-1]), rel=1e-3)
    heads = Path("csv/history.csv").read_text().splitlines()[0]
    assert "station_depth at 90 deg [um]" in heads
    assert "station 5" not in heads
    dataset = result.to_xarray()
    assert dataset["lift_error_along_angle"].sel(angle=0.0).isel(record=-1) == pytest.approx(
        1e-6 * lift[0]
    )
    assert dataset["arm_error_along_angle"].attrs["units"] == "rad"
    assert "station_angle" in dataset.coords
    data = result.view.data()
    assert data["lift_error_rad"] == pytest.approx(data["lift_error_m"] / 80e-3)


def test_animation_turns_once(
    command: Command, run_of_arm: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from PIL import Image

    def shortened(frame: Callable[[int], Panel], count: int, rate: int) -> Animation:
        assert count == 72
        return Animation(lambda number: frame(18 * number), 4, rate)

    monkeypatch.setattr(drawing, "Animation", shortened)
    done = command("plot", run_of_arm, "--animate", "arm.gif")
    assert done.exit_code == 0, done.output
    with Image.open("arm.gif") as film:
        assert film.n_frames == 4
        first = np.asarray(film.convert("RGB"), dtype=float)
        film.seek(2)
        assert np.abs(np.asarray(film.convert("RGB"), dtype=float) - first).max() > 100.0
    assert [path.name for path in Path().iterdir()] == ["arm.gif"]


def test_animation_that_cannot_be_written_is_refused(
    command: Command, run_of_arm: Path, monkeypatch
) -> None:
    monkeypatch.setenv("PATH", "")
    refused = command("plot", run_of_arm, "--animate", "arm.mp4")
    assert (refused.exit_code, "ffmpeg" in refused.stderr) == (2, True)
    refused = command("plot", run_of_arm, "--animate", "arm.avi")
    assert (refused.exit_code, "expected .gif or .mp4" in refused.stderr) == (2, True)


def test_comparison_of_cams_has_all_answers(command: Command, run_of_arm: Path, tmp_path) -> None:
    other = tmp_path / "other.h5"
    other.write_bytes(run_of_arm.read_bytes())
    done = command("compare", run_of_arm, other, "--observable", "lift_error")
    assert done.exit_code == 0, done.output
    for label in ("depth", "roller depth", "peak pressure", "lift error, peak to peak"):
        assert any(line.startswith(f"{label}  ") for line in done.stdout.splitlines())
    assert "estimated errors" in done.stdout

"""The verbs show, plot and export."""

import json
from pathlib import Path

import numpy as np
import pytest
from cli_examples import SCENARIOS, Command

import wearsim
from wearsim.csv_tables import read_columns
from wearsim.errors import Interrupted
from wearsim.studies.opening import open_results


def test_show_prints_the_content_of_a_file(command: Command, finished: Path) -> None:
    result = command("show", finished)
    assert result.exit_code == 0
    for words in (
        "a short [test]",
        "finished: 6,000 passes, 2.000 min",
        "contact model slender (wearsim ",
        "numba ",
        "implicit, tolerance 0.001",
        "at passes 0 to 6,000",
        "end state",
        "estimated error of depth",
    ):
        assert words in result.stdout


def test_show_prints_the_progress_of_an_unfinished_run(command: Command, scenario: Path) -> None:
    with pytest.raises(Interrupted):
        wearsim.run(wearsim.load_scenario(scenario), "short.h5", stop_requested=lambda: True)
    passes = open_results("short.h5").passes[-1]
    result = command("show", "short.h5")
    assert f"unfinished: pass {passes:,.0f} of 6,000" in result.stdout
    assert "current state" in result.stdout


def test_show_prints_why_and_when_a_run_failed(command: Command, scenario: Path) -> None:
    command("run", scenario, "-q", "--set", "evolution.max_steps=2")
    left = open_results("short.h5")
    result = command("show", "short.h5")
    assert f"failed after pass {left.passes[-1]:,.0f} of 6,000" in result.stdout
    shown = " ".join(result.stdout.split())
    assert "failure 2 steps have reached pass" in shown
    assert "raise evolution.max_steps" in shown
    assert f"failed at {left.raw.failed_at}" in shown
    assert "state before the failure" in result.stdout
    data = json.loads(command("show", "short.h5", "--json").stdout)
    assert data["failure"] == left.failure
    assert data["failed_at"] == left.raw.failed_at


def test_show_json_has_scenario_and_software(command: Command, finished: Path) -> None:
    result = command("show", finished, "--json")
    data = json.loads(result.stdout)
    found = open_results(finished)
    assert data["scenario"] == found.raw.scenario_text
    assert data["software"] == found.raw.software
    assert data["depth_m"] == found.depth[-1]
    assert len(data["record_passes"]) == len(found.record_passes)


def test_show_names_the_input_files(command: Command) -> None:
    command(
        "run", SCENARIOS / "rig-logged-load.toml", "-q", "-o", "x.h5",
        "--set", "operation.duration=2 min",
    )  # fmt: skip
    assert "synthetic-load.csv" in command("show", "x.h5").stdout


@pytest.mark.parametrize("verb", ["show", "plot", "resume", "export"])
def test_foreign_file_is_bad_input(command: Command, tmp_path: Path, verb: str) -> None:
    foreign = tmp_path / "foreign.h5"
    foreign.write_text("not HDF5")
    result = command(verb, foreign, *(["-o", "out"] if verb == "export" else []))
    assert result.exit_code == 2
    assert result.stderr.startswith(f"error: {foreign}: ")
    assert result.stdout == ""


def test_plot_names_its_figure_after_the_file(command: Command, finished: Path) -> None:
    assert command("plot", finished).exit_code == 0
    figure = Path("short.png")
    assert figure.read_bytes().startswith(b"\x89PNG")
    figure.write_text("mine")
    assert command("plot", finished).exit_code == 2
    assert figure.read_text() == "mine"
    assert command("plot", finished, "--force").exit_code == 0
    assert figure.read_bytes().startswith(b"\x89PNG")


def test_plot_draws_measurements(command: Command, finished: Path) -> None:
    Path("probe.csv").write_text("y [mm], depth [um]\n-1, 0.1\n0, 0.5\n1, 0.1\n")
    result = command("plot", finished, "-o", "x.svg", "--measured", "probe.csv")
    assert result.exit_code == 0
    assert "measured: probe" in Path("x.svg").read_text()


@pytest.mark.usefixtures("unwritten_figures")
def test_plot_prints_the_residual_of_measurements(command: Command, finished: Path) -> None:
    found = open_results(finished)
    height = -np.interp([0.0, 0.5e-3], found.y, found.profiles[-1]) * 1e6 + [0.3, -0.4]
    rows = "".join(f"{y}, {value:.9f}\n" for y, value in zip((0.0, 0.5), height, strict=True))
    Path("probe.csv").write_text(f"y [mm], height [um]\n{rows}90, 5\n")
    result = command("plot", finished, "-o", "x.svg", "--measured", "probe.csv")
    assert "probe: residual rms 0.354 um, mean -0.0500 um, 2 points" in result.stderr
    Path("far.csv").write_text("y [mm], height [um]\n80, 5\n90, 5\n")
    result = command("plot", finished, "-o", "y.svg", "--measured", "far.csv")
    assert "far: no point on the strips, no residual" in result.stderr


@pytest.mark.usefixtures("unwritten_figures")
def test_plot_suggests_and_applies_levelling(command: Command, finished: Path) -> None:
    found = open_results(finished)
    y = found.y * 1.5
    height = 1e-5 + 1e-3 * y - np.interp(y, found.y, found.profiles[-1], 0.0, 0.0)
    rows = [f"{1e3 * a:.6f},{1e6 * b:.6f}" for a, b in zip(y + 2e-4, height, strict=True)]
    Path("trace.csv").write_text("\n".join(["y [mm],height [um]", *rows]))
    assert "with --level" in command("plot", finished, "--measured", "trace.csv").stderr
    text = command("plot", finished, "--measured", "trace.csv", "--level", "--force").stderr
    assert "with --level" not in text
    rms = float(text.split("residual rms ")[1].split(" um")[0])
    assert rms < 0.05 * 1e6 * found.depth[-1]
    assert command("plot", finished, "--level", "--force").exit_code == 2


def test_export_overwrites_and_writes_decimal_commas(command: Command, finished: Path) -> None:
    assert command("export", finished, "-o", "out").exit_code == 0
    again = command("export", finished, "-o", "out")
    assert again.exit_code == 2
    assert "or --force" in again.stderr
    forced = command("export", finished, "-o", "out", "--force", "--decimal", ",")
    assert forced.exit_code == 0
    found = read_columns(Path("out/history.csv").read_text(), "history.csv", {"depth": "m"})
    np.testing.assert_allclose(found["depth"], open_results(finished).depth, rtol=1e-11)
    assert ";" in Path("out/history.csv").read_text().splitlines()[0]
    assert "." not in Path("out/history.csv").read_text()
    assert Path("out/scenario.toml").read_text() == open_results(finished).raw.scenario_text
    refused = command("export", finished, "-o", "out", "--decimal", "x")
    assert refused.exit_code == 2
    assert "--decimal" in refused.stderr


def test_plot_takes_columns_and_units_of_a_measurement(command: Command, finished: Path) -> None:
    Path("probe.csv").write_text("position;trace\n1;-0,1\n0;-0,5\n-1;-0,1\n")
    named = "--measured", "probe.csv", "--columns", "position,trace", "--units", "mm,um"
    result = command("plot", finished, "-o", "x.svg", *named)
    assert result.exit_code == 0
    assert "measured: probe" in Path("x.svg").read_text()
    Path("deep.csv").write_text("position;trace\n1;0\n0;0,5\n-1;0\n")
    result = command("plot", finished, "-o", "z.svg", "--measured", "deep.csv", *named[2:])
    assert "note: deep.csv: column 'trace' rises 0.5 um above its ends" in result.stderr
    for option, value in (("--columns", "y"), ("--mean-rows", "3"), ("--at", "2 kg")):
        result = command("plot", finished, "-o", "y.svg", *named[:2], option, value)
        assert result.exit_code == 2
        assert option in result.stderr
    result = command("plot", finished, "-o", "y.svg", *named, "--row", 1)
    assert "row is for the rows of a surface, and this is a CSV file" in result.stderr


@pytest.mark.usefixtures("unwritten_figures")
def test_plot_takes_a_row_of_a_surface(command: Command, finished: Path) -> None:
    sdfio = pytest.importorskip("sdfio")
    heights = 1e-6 * np.array([[-0.1, -0.5, -0.1], [-0.2, -0.6, -0.2]])
    sdfio.write("map.sdf", heights, x_scale=1e-3, y_scale=1e-3)
    result = command("plot", finished, "-o", "x.svg", "--measured", "map.sdf")
    assert result.exit_code == 2
    assert "map.sdf: has several rows, got 2 rows, 0 to 1 mm" in result.stderr
    for option in (("--row", 1), ("--mean-rows", "0:2"), ("--at", "0.9 mm")):
        shown = command(
            "plot", finished, "-o", "x.svg", "--force", "--measured", "map.sdf", *option
        )
        assert shown.exit_code == 0


def test_bad_measurement_is_bad_input_and_draws_nothing(command: Command, finished: Path) -> None:
    Path("probe.csv").write_text("y [mm], depth\n-1, 0.1\n0, 0.5\n")
    result = command("plot", finished, "--measured", "probe.csv")
    assert result.exit_code == 2
    assert "probe.csv: line 1: column 'depth' has no unit" in result.stderr
    assert not Path("short.png").exists()


def test_export_writes_csv_with_units(command: Command, finished: Path) -> None:
    result = command("export", finished, "-o", "out")
    assert result.exit_code == 0
    written = [Path(line) for line in result.stdout.splitlines()]
    assert all(path.is_file() for path in written)
    header = Path("out/history.csv").read_text().splitlines()[0]
    assert "depth [um]" in header
    assert command("export", finished, "-o", "out").exit_code == 2
    assert command("export", finished).exit_code == 0
    assert Path("short/history.csv").read_text() == Path("out/history.csv").read_text()


@pytest.mark.parametrize(
    ("verb", "output"), [("plot", "rig.png"), ("report", "rig.html"), ("compare", "c.png")]
)
def test_wrong_input_is_refused_before_an_existing_output(
    command: Command, verb: str, output: str
) -> None:
    Path("rig.toml").write_text("[roller]\n")
    Path(output).write_text("kept")
    more = ("other.toml", "-o", output) if verb == "compare" else ()
    refused = command(verb, "rig.toml", *more)
    assert refused.exit_code == 2
    assert "rig.toml: is not a results file" in refused.stderr

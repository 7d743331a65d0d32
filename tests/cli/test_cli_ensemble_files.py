"""The commands `show`, `plot`, `export` and `resume` on the file of an ensemble."""

from __future__ import annotations

import json
from contextlib import nullcontext
from pathlib import Path

import numpy as np
import pytest
from cli_examples import Command

import wearsim
from tests.studies.ensemble_cases import differences, small
from wearsim.errors import Interrupted, ResultsFileError
from wearsim.studies.ensemble.api import ensemble
from wearsim.studies.ensemble.result import EnsembleResult
from wearsim.studies.opening import open_ensemble


@pytest.fixture(scope="session")
def done_once(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("ensemble") / "e.h5"
    ensemble(small(), 20, path, scheduler="serial")
    return path


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> EnsembleResult:
    """An ensemble that is done without an interruption."""
    path = tmp_path_factory.mktemp("whole") / "whole.h5"
    return ensemble(small(), 12, path, scheduler="serial")


@pytest.fixture
def done(done_once: Path, tmp_path: Path) -> Path:
    """A copy of the file of a finished ensemble."""
    path = tmp_path / "e.h5"
    path.write_bytes(done_once.read_bytes())
    return path


def test_show_prints_the_content_of_the_file(command: Command, done: Path) -> None:
    result = command("show", done)
    assert result.exit_code == 0
    for text in ("20 done, 0 failed, of 20", "software", "random creepage.misalignment", "disc"):
        assert text in result.stdout
    assert max(len(line.rstrip()) for line in result.stdout.splitlines()) <= 110
    data = json.loads(command("show", done, "--json").stdout)
    assert data["depth_m"]["count"] == 20
    assert "[load.normal_force]" in data["scenario"]


def test_plot_draws_an_ensemble(command: Command, done: Path) -> None:
    assert command("plot", done).exit_code == 0
    assert Path("e.png").read_bytes().startswith(b"\x89PNG")


def test_plot_draws_measurements_over_the_band_of_an_ensemble(command: Command, done: Path) -> None:
    band = open_ensemble(done).band()
    offset = -np.interp(0.0, band.y, band.mean) * 1e6 + 0.5
    Path("probe.csv").write_text(f"y [mm], height [um]\n0, {offset:.9f}\n1e-9, {offset:.9f}\n")
    result = command("plot", done, "-o", "b.svg", "--measured", "probe.csv")
    assert result.exit_code == 0, result.output
    assert "measured: probe" in Path("b.svg").read_text()
    assert "probe: residual rms 0.500 um, mean 0.500 um, 2 points, 100 % in the band" in (
        result.stderr
    )


def test_export_writes_realisations_courses_and_profile(command: Command, done: Path) -> None:
    result = command("export", done, "-o", "out")
    assert result.exit_code == 0, result.output
    assert result.stdout.splitlines() == [
        f"out/{name}"
        for name in ("realisations.csv", "courses.csv", "profile.csv", "scenario.toml")
    ]
    kept = open_ensemble(done)
    text = Path("out/realisations.csv").read_text().splitlines()
    table = np.loadtxt(text[1:], delimiter=",")
    head = text[0].split(",")
    for title, values in {
        "load.normal_force [N]": kept.inputs["load.normal_force"],
        "depth [um]": kept.at_end("depth") * 1e6,
        "width [mm]": kept.at_end("width") * 1e3,
    }.items():
        np.testing.assert_allclose(table[:, head.index(title)], values, rtol=1e-11)


def test_resumed_ensemble_equals_unbroken_ensemble(command: Command, whole: EnsembleResult) -> None:
    with pytest.raises(Interrupted):
        ensemble(small(), 12, "part.h5", scheduler="serial", stop_requested=lambda: True)
    assert open_ensemble("part.h5").count < 12
    result = command("resume", "part.h5", "--scheduler", "serial", "-q")
    assert result.exit_code == 0, result.output
    assert "12 done, 0 failed, of 12" in result.stdout
    found = open_ensemble("part.h5")
    np.testing.assert_array_equal(found.values("depth"), whole.values("depth"))


def test_commands_open_an_ensemble_that_is_in_parts(command: Command) -> None:
    ensemble(small(), 5, "whole.h5", scheduler="serial")
    with pytest.raises(Interrupted):
        ensemble(small(), 12, "part.h5", scheduler="serial", stop_requested=lambda: True)
    assert Path("part.h5.parts/000001.h5").is_file()
    for arguments in (
        ["show", "part.h5"],
        ["plot", "part.h5", "-o", "part.png"],
        ["export", "part.h5", "-o", "tables"],
        ["compare", "part.h5", "whole.h5"],
    ):
        result = command(*arguments)
        assert result.exit_code == 0, result.output
    Path("part.h5.parts").rename("elsewhere")
    result = command("show", "part.h5")
    assert result.exit_code == 2
    assert "part.h5: is unfinished, and part of it is missing: there is no" in result.stderr


@pytest.mark.parametrize("finished", [False, True])
def test_resume_extends_an_ensemble(
    command: Command, whole: EnsembleResult, finished: bool
) -> None:
    with nullcontext() if finished else pytest.raises(Interrupted):
        ensemble(small(), 5, "part.h5", scheduler="serial", stop_requested=lambda: not finished)
    result = command("resume", "part.h5", "-n", "12", "--scheduler", "serial", "-q")
    assert result.exit_code == 0, result.output
    assert "12 done, 0 failed, of 12" in result.stdout
    assert differences(open_ensemble("part.h5"), whole) == []
    assert not Path("part.h5.parts").exists()
    result = command("resume", "part.h5", "-n", "12", "-q")
    assert result.exit_code == 2
    assert "part.h5: has 12 realisations; give a larger number with -n" in result.stderr


@pytest.mark.parametrize("plan", ["latin-hypercube", "saltelli"])
def test_plan_of_fixed_size_is_not_extended(command: Command, plan: str) -> None:
    ensemble(small(), 6, "fixed.h5", plan=plan, scheduler="serial")
    before = Path("fixed.h5").read_bytes()
    result = command("resume", "fixed.h5", "-n", "500", "-q")
    assert result.exit_code == 2
    assert f'got "{plan}" with more realisations' in " ".join(result.stderr.split())
    assert Path("fixed.h5").read_bytes() == before


def test_failed_realisations_are_not_repeated_while_extending(command: Command, done: Path) -> None:
    result = command("resume", done, "-n", "500", "--failed")
    assert result.exit_code == 2
    assert "extend the ensemble first" in result.stderr


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--until", "5 min"], "has no meaning for a file that holds an ensemble"),
        (["--scheduler", "cloud"], "no scheduler 'cloud'"),
    ],
)
def test_resume_refuses_options_of_runs_for_an_ensemble(
    command: Command, done: Path, arguments: list[str], message: str
) -> None:
    result = command("resume", done, *arguments)
    assert result.exit_code == 2
    assert message in " ".join(result.stderr.split())


@pytest.mark.parametrize(
    "arguments",
    [["--failed"], ["--workers", "2"], ["--scheduler", "serial"], ["--realisations", "9"]],
)
def test_resume_refuses_options_of_ensembles_for_a_run(
    command: Command, finished: Path, arguments: list[str]
) -> None:
    result = command("resume", finished, *arguments)
    assert result.exit_code == 2
    assert f"for {arguments[0]}: has no meaning for a file that holds a wear test" in result.stderr


def test_resume_of_a_run_names_resume_ensemble(done: Path) -> None:
    with pytest.raises(ResultsFileError, match="which resume_ensemble continues"):
        wearsim.resume(done)
    assert wearsim.resume_ensemble(done).count == wearsim.open_ensemble(done).count == 20


def test_resume_reports_that_there_is_nothing_to_do(command: Command, done: Path) -> None:
    finished = command("resume", done, "-q")
    assert finished.stderr.startswith("note: nothing to do: the ensemble is finished")
    none = command("resume", done, "--failed", "-q")
    assert none.stderr.startswith("note: nothing to do: no realisation has failed")


def test_export_refuses_a_file_as_its_folder(command: Command, done: Path) -> None:
    Path("a.png").write_text("mine")
    result = command("export", done, "-o", "a.png")
    assert result.exit_code == 2
    assert "a.png: is a file; tables are written to a folder" in result.stderr


def test_ensemble_opened_as_another_kind_names_open_results(done: Path) -> None:
    with pytest.raises(ResultsFileError, match=r"In Python, wearsim\.open_results opens it"):
        wearsim.open_dissipation(done)

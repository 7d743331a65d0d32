"""`wearsim ensemble`, and the other verbs on its file."""

from __future__ import annotations

import io
import json
import re
import signal
import subprocess
from pathlib import Path

import numpy as np
import pytest
from cli_examples import SCENARIOS, Command
from rich.console import Console

import wearsim
from tests.interruptible import interruptible
from tests.report.made_up_ensembles import made_up
from tests.studies.ensemble_cases import partly_failing, small
from wearsim.cli.progress import realisations as progress
from wearsim.cli.progress.realisations import (
    EnsembleLines,
    LiveEnsemble,
    progress_text,
    watching_ensemble,
)
from wearsim.cli.render.ensemble_table import write_ensemble
from wearsim.errors import Interrupted, ResultsFileError
from wearsim.results import EnsembleResult, open_ensemble
from wearsim.studies.ensemble.api import ensemble
from wearsim.studies.ensemble.designs import interim_sizes
from wearsim.studies.ensemble.driver import EnsembleProgress
from wearsim.uq.estimation.intervals import UNKNOWN, Interval
from wearsim.uq.estimation.stopping_rule import Target

HERE = ("--scheduler", "serial", "-q")


@pytest.fixture(scope="session")
def done_once(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("ensemble") / "e.h5"
    ensemble(small(), 40, path, scheduler="serial")
    return path


@pytest.fixture
def done(done_once: Path, tmp_path: Path) -> Path:
    """A copy of the file of a finished ensemble."""
    path = tmp_path / "e.h5"
    path.write_bytes(done_once.read_bytes())
    return path


@pytest.fixture
def tests(tmp_path: Path) -> Path:
    """A scenario of a short run."""
    path = tmp_path / "tests.toml"
    path.write_text(small().text)
    return path


@pytest.fixture
def failing(tmp_path: Path) -> Path:
    """A scenario of a short run in which some realisations fail."""
    path = tmp_path / "failing.toml"
    path.write_text(partly_failing().text)
    return path


def test_table_has_estimates_and_intervals(command: Command, tests: Path) -> None:
    result = command("ensemble", tests, "-n", 40, *HERE)
    assert result.exit_code == 0, result.output
    found = open_ensemble("tests-ensemble.h5")
    depth = found.estimate("depth").mean
    lines = result.stdout.splitlines()
    place = next(k for k, line in enumerate(lines) if line.startswith("depth [um]"))
    assert float(lines[place].split()[2]) == pytest.approx(depth.value * 1e6, rel=1e-2)
    low, high = lines[place + 1].split()[3].split("..")
    assert float(low) == pytest.approx(depth.low * 1e6, rel=1e-2)
    assert float(high) == pytest.approx(depth.high * 1e6, rel=1e-2)
    for text in (
        "40 done, 0 failed, of 40",
        "monte-carlo, seed 1",
        "3,000 passes",
        "implicit, tolerance 0.01",
        "Sobol indices of the depth",
        "drawn load.normal_force",
        "realisations per second",
        "tests-ensemble.h5",
    ):
        assert text in result.stdout
    assert "worn volume [mm^3]" in result.stdout
    assert "roller depth" not in result.stdout  # the rollers do not wear


def test_json_is_si_and_all_of_stdout(command: Command, tests: Path) -> None:
    result = command("ensemble", tests, "-n", 12, *HERE, "-o", "a.h5", "--json")
    assert result.exit_code == 0
    assert result.stderr == ""
    data, kept = json.loads(result.stdout), open_ensemble("a.h5")
    for key, name in (
        ("depth_m", "depth"),
        ("worn_volume_m3", "worn_volume"),
        ("dissipated_energy_J", "dissipated_energy"),
        ("peak_pressure_Pa", "peak_pressure"),
    ):
        assert data[key]["mean"]["value"] == kept.estimate(name).mean.value
        assert data[key]["std"]["high"] == kept.estimate(name).std.high
    assert data["depth_m"]["quantiles"][0]["low"] is None  # too few for it
    assert {item["input"] for item in data["sensitivity_of_depth"]} == {
        item["name"] for item in kept.raw.groups
    }
    assert data["inputs"]["load.normal_force"]["unit"] == "N"
    assert (data["realisations"], data["failed"], data["finished"]) == (12, 0, True)
    assert (data["plan"], data["until_reached"], data["output"]) == ("monte-carlo", None, "a.h5")


def test_plan_and_seed_reach_the_file(command: Command, tests: Path) -> None:
    arguments = ("--plan", "saltelli", "--seed", 7, "-n", 10, *HERE)
    result = command("ensemble", tests, *arguments)
    assert result.exit_code == 0, result.output
    kept = open_ensemble("tests-ensemble.h5")
    assert (kept.plan, kept.raw.seed, kept.scenario.seed) == ("saltelli", 7, 7)
    assert " total" not in result.stdout  # two rows are too few for an index
    assert f"of {kept.asked}" in result.stdout


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--plan", "sobo"], "unknown plan 'sobo', expected one of monte-carlo"),
        (["--until", "depth"], 'cannot read the target "depth"'),
        (["--until", "dept.mean 1%"], "'dept', which is not an observable, expected one of depth"),
        (["--scheduler", "cloud"], "no scheduler 'cloud', expected processes"),
        (["--scheduler", "serial", "--workers", "3"], "there is one worker"),
        (["--workers", "0"], "--workers"),
        (["--sweep", "load.normal_force"], "is not a key with values"),
        (["--sweep", "load.normal_force=250N"], "has one value, expected two or more"),
        (["--sweep", "load.normal_force=250N,"], "has an empty value"),
        (["--sweep", "load.normal_force=250N,0.25 kN"], "are the same value"),
        (["--sweep", "seed=1,1.0"], "'1' and '1.0' are the same value"),
        (["--sweep", "seed=1,2", "--seed", "3"], "seed is also the key of --sweep"),
        (["--figure", "a.gif"], "has no known figure format"),
    ],
)
def test_invalid_options_are_refused_before_the_study(
    command: Command, tests: Path, arguments: list[str], message: str
) -> None:
    result = command("ensemble", tests, *arguments)
    assert result.exit_code == 2
    assert message in " ".join(result.stderr.split())
    assert not list(tests.parent.glob("*.h5"))


def test_plan_that_cannot_grow_has_no_target(command: Command, tests: Path) -> None:
    options = ("--plan", "latin-hypercube", "--until", "depth.mean 1%")
    result = command("ensemble", tests, *options)
    assert result.exit_code == 2
    assert "cannot grow" in result.stderr


def test_target_is_reached_with_a_control_variate(command: Command, tests: Path) -> None:
    options = ("--plan", "control-variate", "--until", "depth.mean 20%")
    result = command("ensemble", tests, "-n", 200, *options, *HERE)
    assert result.exit_code == 0, result.output
    found = open_ensemble("tests-ensemble.h5")
    assert found.count < 200
    assert f"% with {found.count} realisations" in result.stdout
    assert "reached: within" in result.stdout
    assert "not reached" not in result.stdout
    assert "of the variance of the mean depth, equivalent to" in result.stdout


def test_missed_target_is_reported(command: Command, tests: Path) -> None:
    result = command("ensemble", tests, "-n", 10, "--until", "depth.mean 1%", *HERE)
    assert result.exit_code == 0
    found = open_ensemble("tests-ensemble.h5")
    target = Target.parse(found.until)
    within = 100.0 * target.achieved(found.estimate_for(target))
    assert f"not reached: within {within:.2g} % with 10 realisations" in result.stdout


def test_failed_realisations_are_reported_and_repeated(command: Command, failing: Path) -> None:
    result = command("ensemble", failing, "-n", 30, *HERE, "-o", "f.h5")
    found = open_ensemble("f.h5")
    assert 0 < found.failed < 30
    assert result.exit_code == 0
    first = min(found.errors)
    assert (
        f"warning: {found.failed} of 30 realisations failed; the first is number {first}: "
        f"{found.errors[first]}"
    ) in result.stderr
    assert "the same draws fail again unless the scenario or the software" in result.stderr
    assert "wearsim resume f.h5 --failed" in result.stderr
    assert f"{found.count} done, {found.failed} failed, of 30" in result.stdout
    again = command("resume", "f.h5", "--failed", "--scheduler", "serial", "--workers", 1, "-q")
    assert again.exit_code == 0
    assert "this process, one realisation at a time" in again.stdout
    assert f"warning: {found.failed} of 30 realisations failed" in again.stderr


def test_ensemble_of_failures_only_fails(command: Command, failing: Path) -> None:
    few = ("--set", "evolution.max_steps=1")
    result = command("ensemble", failing, "-n", 3, *few, *HERE, "-o", "f.h5")
    assert result.exit_code == 1
    assert "0 done, 3 failed, of 3" in result.stdout
    assert "warning: 3 of 3 realisations failed" in result.stderr
    assert "error: f.h5: all realisations failed" in result.stderr
    as_json = command("ensemble", failing, "-n", 3, *few, *HERE, "-o", "f.h5", "--json", "--force")
    assert as_json.exit_code == 1
    assert len(json.loads(as_json.stdout)["errors"]) == 3
    assert command("show", "f.h5").exit_code == 0
    assert command("plot", "f.h5").exit_code == 0


def test_figure_and_results_need_different_files(command: Command, tests: Path) -> None:
    arguments = ("ensemble", tests, "-n", 4, *HERE, "-o", "a.h5", "--figure", "a.png")
    assert command(*arguments).exit_code == 0
    assert Path("a.png").read_bytes().startswith(b"\x89PNG")
    assert "a.png exists; choose another name with --figure" in command(*arguments).stderr
    Path("a.png").unlink()
    assert "a.h5: already exists" in command(*arguments).stderr
    assert command(*arguments, "--force").exit_code == 0
    both = command("ensemble", tests, "-o", "b.png", "--figure", "b.png")
    assert both.exit_code == 2
    assert "is also the results file" in both.stderr


def test_sweep_writes_one_file_per_value_and_compares_them(command: Command, tests: Path) -> None:
    swept = ("--sweep", "load.normal_force=250N,350 N", "-o", "s.h5", "--figure", "s.svg")
    result = command("ensemble", tests, "-n", 12, *swept, *HERE)
    assert result.exit_code == 0, result.output
    light, heavy = (open_ensemble(f"s-{value}.h5") for value in ("250N", "350N"))
    assert light.scenario.load.build().mean(0.0, 1.0) == 250.0
    assert (heavy.at_end("depth") > light.at_end("depth")).all()
    rows = " ".join(result.stdout.split())
    assert "compared depth at the end, for values of load.normal_force" in rows
    assert "350 N deeper than 250 N" in rows
    assert "with the same draws in 100.0 %" in rows
    figure = Path("s.svg").read_text()
    assert f"{light.title}, for values of load.normal_force" in figure
    again = command("ensemble", tests, "-n", 12, *swept, *HERE)
    assert again.exit_code == 2


def test_sweep_in_json_is_its_comparison(command: Command, tests: Path) -> None:
    swept = ("--sweep", "friction.coefficient=0.08,0.12", "-o", "s.h5", "--json")
    result = command("ensemble", tests, "-n", 8, *swept, *HERE)
    assert result.exit_code == 0, result.output
    data = json.loads(result.stdout)
    assert [item["file"] for item in data["compared"]] == ["s-0.08.h5", "s-0.12.h5"]
    assert data["title"] == "friction.coefficient"
    kept = open_ensemble("s-0.12.h5").estimate("depth").mean.value
    assert data["compared"][1]["value"]["value"] == kept


def test_unknown_key_of_a_sweep_is_refused(command: Command, tests: Path) -> None:
    result = command("ensemble", tests, "--sweep", "lod.normal_force=250N,300N", *HERE)
    assert result.exit_code == 2
    assert "did you mean 'load'?" in result.stderr
    assert not list(tests.parent.glob("*.h5"))


def test_show_prints_the_content_of_the_file(command: Command, done: Path) -> None:
    result = command("show", done)
    assert result.exit_code == 0
    for text in ("40 done, 0 failed, of 40", "software", "random creepage.misalignment", "disc"):
        assert text in result.stdout
    assert max(len(line.rstrip()) for line in result.stdout.splitlines()) <= 110
    data = json.loads(command("show", done, "--json").stdout)
    assert data["depth_m"]["count"] == 40
    assert "[load.normal_force]" in data["scenario"]


def test_plot_draws_an_ensemble(command: Command, done: Path) -> None:
    assert command("plot", done).exit_code == 0
    assert Path("e.png").read_bytes().startswith(b"\x89PNG")
    refused = command("plot", done, "-o", "b.png", "--measured", "m.csv")
    assert refused.exit_code == 2
    assert "requires the file of a wear test" in refused.stderr


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


def test_resumed_ensemble_equals_unbroken_ensemble(command: Command) -> None:
    whole = ensemble(small(), 12, "whole.h5", scheduler="serial")
    with pytest.raises(Interrupted):
        ensemble(small(), 12, "part.h5", scheduler="serial", stop_requested=lambda: True)
    assert open_ensemble("part.h5").count < 12
    result = command("resume", "part.h5", "--scheduler", "serial", "-q")
    assert result.exit_code == 0, result.output
    assert "12 done, 0 failed, of 12" in result.stdout
    found = open_ensemble("part.h5")
    np.testing.assert_array_equal(found.values("depth"), whole.values("depth"))


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--until", "5 min"], "only wear tests can be extended"),
        (["--scheduler", "cloud"], "no scheduler 'cloud'"),
    ],
)
def test_resume_refuses_options_of_runs_for_an_ensemble(
    command: Command, done: Path, arguments: list[str], message: str
) -> None:
    result = command("resume", done, *arguments)
    assert result.exit_code == 2
    assert message in " ".join(result.stderr.split())


@pytest.mark.parametrize("arguments", [["--failed"], ["--workers", "2"], ["--scheduler", "serial"]])
def test_resume_refuses_options_of_ensembles_for_a_run(
    command: Command, finished: Path, arguments: list[str]
) -> None:
    result = command("resume", finished, *arguments)
    assert result.exit_code == 2
    assert f"for {arguments[0]}: is an option for ensembles only" in result.stderr


def test_signal_ends_an_ensemble_that_can_be_resumed(tests: Path, tmp_path: Path) -> None:
    options = ["-n", "100000", "-o", "a.h5", "--workers", "1"]
    arguments = interruptible("-m", "wearsim", "ensemble", tests, *options)
    with subprocess.Popen(arguments, cwd=tmp_path, stderr=subprocess.PIPE, text=True) as running:
        assert running.stderr is not None
        for line in running.stderr:
            if "100,000 realisations" in line:
                break
        running.send_signal(signal.SIGINT)
        message = running.stderr.read()
    assert running.returncode == 130
    assert "stopping after the next batch" in message
    kept = open_ensemble(tmp_path / "a.h5")
    assert not kept.finished
    assert f"stopped after {kept.count} of 100000 realisations" in message
    assert "continue with: wearsim resume a.h5" in message


PROGRESS = EnsembleProgress(
    done=1200,
    failed=3,
    asked=5000,
    rate=12.34,
    left=307.7,
    what="depth.mean",
    estimate=Interval(21.5e-6, 21.0e-6, 22.0e-6),
    workers="2 processes",
)


def test_progress_has_rate_time_left_and_estimate() -> None:
    assert progress_text(PROGRESS) == (
        "1,200 of 5,000 realisations, 3 failed, 12.3/s, 5 min 8 s left,"
        " depth.mean 21.50 um [21.00, 22.00]"
    )


def test_progress_omits_unknown_values() -> None:
    none = PROGRESS.__class__(0, 5, 5, 2.0, 0.0, "depth.mean", UNKNOWN, "serial")
    assert progress_text(none) == "0 of 5 realisations, 5 failed, 2/s"


def test_progress_lines_are_a_second_apart() -> None:
    times = iter([0.0, 0.5, 1.1, 1.2, 2.2])
    lines: list[str] = []
    watch = EnsembleLines(lines.append, lambda: next(times))
    for _ in range(4):
        watch(PROGRESS)
    assert lines == [progress_text(PROGRESS)] * 2
    assert watch.workers == "2 processes"


@pytest.mark.parametrize(
    ("columns", "line"),
    [
        (53, "1,200 of 5,000, 3 failed, 12.3/s, 5 min 8 s left"),
        (30, "1,200 of 5,000, 3 failed"),
        (5, "1,200 of 5,000"),
        (76, "1,200 of 5,000, 3 failed, 5 min 8 s left, depth.mean 21.50 um [21.00, 22.00]"),
    ],
)
def test_narrow_line_drops_whole_parts(columns: int, line: str) -> None:
    assert progress_text(PROGRESS, "", columns) == line


def test_line_of_60_columns_is_not_cut(monkeypatch: pytest.MonkeyPatch) -> None:
    screen = io.StringIO()
    terminal = Console(file=screen, force_terminal=True, width=60, markup=False, highlight=False)
    monkeypatch.setattr(progress, "console", lambda **_: terminal)
    with watching_ensemble(quiet=False) as watch:
        watch(PROGRESS)
    assert "12.3/s, 5 min 8 s left" in screen.getvalue()
    assert "\u2026" not in screen.getvalue()
    assert "um" not in screen.getvalue()


def test_terminal_shows_a_live_line(monkeypatch: pytest.MonkeyPatch) -> None:
    screen = io.StringIO()
    terminal = Console(file=screen, force_terminal=True, width=140, markup=False, highlight=False)
    monkeypatch.setattr(progress, "console", lambda **_: terminal)
    with watching_ensemble(quiet=False) as watch:
        assert isinstance(watch, LiveEnsemble)
        watch(PROGRESS)
    assert "24 %" in screen.getvalue()
    assert progress_text(PROGRESS, items="") in screen.getvalue()


def test_quiet_shows_nothing(capsys: pytest.CaptureFixture[str]) -> None:
    with watching_ensemble(quiet=True) as watch:
        watch(PROGRESS)
    assert capsys.readouterr() == ("", "")
    assert watch.workers == "2 processes"


def test_scenario_without_random_inputs_is_bad_input(command: Command) -> None:
    result = command("ensemble", SCENARIOS / "rig-450min.toml", *HERE)
    assert result.exit_code == 2
    assert "no random input" in result.stderr


def test_insignificant_effect_is_listed_with_its_bound(
    capsys: pytest.CaptureFixture[str],
) -> None:
    found = made_up(400, seed=2)
    write_ensemble(found, [])
    (none,) = [item for item in found.sensitivity() if item.without_effect]
    rows = " ".join(capsys.readouterr().out.split())
    assert f"{none.name} not significant, at most {100.0 * none.first.high:.2g} %" in rows


def test_one_realisation_and_constant_ones_have_no_spread(
    capsys: pytest.CaptureFixture[str],
) -> None:
    write_ensemble(made_up(1), [])
    one = capsys.readouterr().out
    assert "95 % interval" not in one
    assert "Sobol indices of the depth: too few realisations," in one
    write_ensemble(made_up(20, spread=0.0), [])
    same = capsys.readouterr().out
    assert ["depth", "[um]", "20.00", "constant", "-", "-", "-"] in [
        line.split() for line in same.splitlines()
    ]
    assert "Sobol indices of the depth: none, the depth is equal in all realisations" in same


def test_saltelli_has_total_indices(capsys: pytest.CaptureFixture[str]) -> None:
    found = made_up(5 * 60, "saltelli")
    write_ensemble(found, [])
    assert " total" in capsys.readouterr().out


def test_resume_of_a_run_names_resume_ensemble(done: Path) -> None:
    with pytest.raises(ResultsFileError, match="which resume_ensemble continues"):
        wearsim.resume(done)
    assert wearsim.resume_ensemble(done).count == wearsim.open_ensemble(done).count == 40


@pytest.mark.parametrize(
    ("found", "message"),
    [
        (made_up(20, until="depth.q95 50%"), "not reached: too few realisations"),
        (
            made_up(20, until="roller_depth.mean 5%"),
            "not reached: equal in all 20 realisations, but the sample is too small",
        ),
        (
            made_up(40, until="roller_depth.mean 5%"),
            "reached: equal in all 40 realisations",
        ),
        (
            made_up(20, until="depth.mean 90%"),
            "% with 20 realisations, but the sample is too small",
        ),
    ],
)
def test_target_is_described_by_its_half_width(
    capsys: pytest.CaptureFixture[str], found: EnsembleResult, message: str
) -> None:
    write_ensemble(found, [])
    output = " ".join(capsys.readouterr().out.split())
    assert f"{message} drawn" in output
    assert "within -" not in output


def test_too_few_realisations_name_the_needed_number(
    capsys: pytest.CaptureFixture[str],
) -> None:
    write_ensemble(made_up(10), [])
    output = capsys.readouterr().out
    number = re.search(r"too few realisations, (\d+) are sufficient", output)
    assert number is not None
    needed = int(number[1])
    assert all(np.isfinite(item.first.value) for item in made_up(needed).sensitivity())
    fewer = made_up(needed - 1)
    (unknown,) = [item for item in fewer.sensitivity() if not np.isfinite(item.first.value)]
    write_ensemble(fewer, [])
    output = " ".join(capsys.readouterr().out.split())
    assert f"{unknown.name} too few realisations, {needed} are sufficient" in output


def test_needed_number_of_saltelli_counts_whole_rows(
    capsys: pytest.CaptureFixture[str],
) -> None:
    write_ensemble(made_up(5 * 3, "saltelli"), [])
    output = capsys.readouterr().out
    number = re.search(r"too few realisations, (\d+) are sufficient", output)
    assert number is not None
    needed = int(number[1])
    assert needed % 5 == 0
    for count, is_known in ((needed, True), (needed - 5, False)):
        effects = made_up(count, "saltelli").sensitivity()
        assert all(np.isfinite(item.first.value) == is_known for item in effects)


def test_resume_reports_that_there_is_nothing_to_do(command: Command, done: Path) -> None:
    finished = command("resume", done, "-q")
    assert finished.stderr.startswith("note: nothing to do: the ensemble is finished")
    none = command("resume", done, "--failed", "-q")
    assert none.stderr.startswith("note: nothing to do: no realisation has failed")


def test_help_of_until_has_the_first_interim_analysis(command: Command) -> None:
    output = " ".join(command("ensemble", "--help").stdout.split())
    first = interim_sizes("monte-carlo", 1000)[0]
    assert f"First checked after {first} realisations" in output


def test_export_refuses_a_file_as_its_folder(command: Command, done: Path) -> None:
    Path("a.png").write_text("mine")
    result = command("export", done, "-o", "a.png")
    assert result.exit_code == 2
    assert "a.png: is a file; tables are written to a folder" in result.stderr


def test_ensemble_opened_as_a_run_names_open_ensemble(done: Path) -> None:
    with pytest.raises(ResultsFileError, match=r"In Python, wearsim\.open_ensemble opens it"):
        wearsim.open_results(done)

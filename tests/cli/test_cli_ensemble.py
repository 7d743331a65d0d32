"""The command `wearsim ensemble`."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
from pathlib import Path

import pytest
from cli_examples import SCENARIOS, Command

from tests.interruptible import interruptible
from tests.studies.ensemble_cases import partly_failing, small
from wearsim.studies.ensemble.designs import interim_sizes
from wearsim.studies.opening import open_ensemble
from wearsim.uq.estimation.estimates import Target

HERE = ("--scheduler", "serial", "-q")


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
    result = command("ensemble", tests, "-n", 20, *HERE)
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
        "20 done, 0 failed, of 20",
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
    assert f"of {kept.requested}" in result.stdout


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--plan", "sobo"], "unknown plan 'sobo', expected one of monte-carlo"),
        (["--precision", "depth"], 'cannot read the target "depth"'),
        (
            ["--precision", "dept.mean 1%"],
            "'dept', which is not an observable, expected one of depth",
        ),
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


def test_former_name_of_precision_is_accepted_with_a_warning(command: Command, tests: Path) -> None:
    result = command("ensemble", tests, "-n", 3, "--until", "depth.mean 1%", *HERE)
    assert result.exit_code == 0, result.output
    assert "warning: --until of ensembles is now --precision" in result.stderr
    assert "  precision depth.mean 1% " in result.stdout
    assert open_ensemble("tests-ensemble.h5").until == "depth.mean 1%"
    both = command("ensemble", tests, "--until", "depth.mean 1%", "--precision", "depth.mean 2%")
    assert both.exit_code == 2
    assert "former name of --precision" in both.stderr
    assert "--until" not in command("ensemble", "--help").stdout


def test_plan_that_cannot_grow_has_no_target(command: Command, tests: Path) -> None:
    options = ("--plan", "latin-hypercube", "--precision", "depth.mean 1%")
    result = command("ensemble", tests, *options)
    assert result.exit_code == 2
    assert "cannot grow" in result.stderr


def test_intervals_of_a_latin_hypercube_are_called_too_wide(command: Command, tests: Path) -> None:
    result = command("ensemble", tests, "-n", 4, "--plan", "latin-hypercube", *HERE)
    assert result.exit_code == 0, result.output
    words = "95 % intervals as for independent realisations, and therefore too wide"
    assert words in " ".join(result.stdout.split())


def test_target_is_reached_with_a_control_variate(command: Command, tests: Path) -> None:
    options = ("--plan", "control-variate", "--precision", "depth.mean 20%")
    result = command("ensemble", tests, "-n", 200, *options, *HERE)
    assert result.exit_code == 0, result.output
    found = open_ensemble("tests-ensemble.h5")
    assert found.count < 200
    assert f"% with {found.count} realisations" in result.stdout
    assert "reached: within" in result.stdout
    assert "not reached" not in result.stdout
    assert "of the variance of the mean depth, equivalent to" in result.stdout


def test_missed_target_is_reported(command: Command, tests: Path) -> None:
    result = command("ensemble", tests, "-n", 10, "--precision", "depth.mean 1%", *HERE)
    assert result.exit_code == 0
    found = open_ensemble("tests-ensemble.h5")
    target = Target.parse(found.until)
    within = 100.0 * target.achieved(found.estimate_for(target))
    assert f"not reached: within {within:.2g} % with 10 realisations" in result.stdout


def test_failed_realisations_are_reported_and_repeated(command: Command, failing: Path) -> None:
    result = command("ensemble", failing, "-n", 12, *HERE, "-o", "f.h5")
    found = open_ensemble("f.h5")
    assert 0 < found.failed < 12
    assert result.exit_code == 0
    first = min(found.errors)
    assert (
        f"warning: {found.failed} of 12 realisations failed; the first is number {first}: "
        f"{found.errors[first]}"
    ) in result.stderr
    assert "the same draws fail again unless the scenario or the software" in result.stderr
    assert "wearsim resume f.h5 --failed" in result.stderr
    assert f"{found.count} done, {found.failed} failed, of 12" in result.stdout
    again = command("resume", "f.h5", "--failed", "--scheduler", "serial", "--workers", 1, "-q")
    assert again.exit_code == 0
    assert "this process, one realisation at a time" in again.stdout
    assert f"warning: {found.failed} of 12 realisations failed" in again.stderr


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
    assert light.scenario.load.built.mean(0.0, 1.0) == 250.0
    assert (heavy.at_end("depth") > light.at_end("depth")).all()
    rows = " ".join(result.stdout.split())
    assert "compared depth at the end, for values of load.normal_force" in rows
    assert "350 N deeper than 250 N" in rows
    assert "with the same draws in 100.0 %" in rows
    texts = " ".join(re.findall(r"<!--(.*?)-->", Path("s.svg").read_text(), re.DOTALL))
    assert f"{light.title}, for values of load.normal_force" in " ".join(texts.split())
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


def test_signal_ends_an_ensemble_that_can_be_resumed(tests: Path, tmp_path: Path) -> None:
    options = ["-n", "100000", "-o", "a.h5", "--workers", "1", "--set", "operation.passes=100"]
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


def test_second_signal_ends_an_ensemble_at_once(tests: Path, tmp_path: Path) -> None:
    temporary = tmp_path / "temporary"
    temporary.mkdir()
    options = ["-n", "100000", "-o", "a.h5", "--workers", "2"]
    with subprocess.Popen(
        interruptible("-m", "wearsim", "ensemble", tests, *options),
        cwd=tmp_path,
        env=os.environ | {"TMPDIR": str(temporary)},
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    ) as running:
        assert running.stderr is not None
        while "100,000 realisations" not in running.stderr.readline():
            pass
        os.killpg(running.pid, signal.SIGINT)
        message = running.stderr.readline()
        os.killpg(running.pid, signal.SIGINT)
        rest = running.stderr.read()  # ends with the last process
    assert "stopping after the next batch" in message
    if running.returncode != 130:  # a batch ended between the two signals
        assert (running.returncode, rest) == (-signal.SIGINT, "")
    assert list(temporary.iterdir()) == []
    assert not open_ensemble(tmp_path / "a.h5").finished


def test_scenario_without_random_inputs_is_bad_input(command: Command) -> None:
    result = command("ensemble", SCENARIOS / "rig-450min.toml", *HERE)
    assert result.exit_code == 2
    assert "no random input" in result.stderr


def test_help_of_precision_has_the_first_interim_analysis(command: Command) -> None:
    output = " ".join(command("ensemble", "--help").stdout.split())
    first = interim_sizes("monte-carlo", 1000)[0]
    assert f"First checked after {first} realisations" in output

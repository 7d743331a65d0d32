"""The verbs run and resume."""

import json
import signal
import subprocess
from pathlib import Path

import pytest
from cli_examples import SCENARIOS, Command

from tests.interruptible import interruptible
from wearsim.errors import Interrupted
from wearsim.studies.opening import open_results


def test_results_file_is_named_after_the_scenario(command: Command, scenario: Path) -> None:
    result = command("run", scenario)
    assert result.exit_code == 0
    found = open_results("short.h5")
    assert found.finished
    assert found.passes[-1] == 6000
    assert result.stdout.startswith("a short [test]")
    assert found.view.rows()[0].text in result.stdout
    assert "short.h5" in result.stdout


# the error due to the strips of so short a test gives a warning
WITHOUT_STRIPS = ("--set", "evolution.strip_error=false")


def test_progress_goes_to_stderr_in_plain_lines(command: Command, scenario: Path) -> None:
    lines = command("run", scenario, *WITHOUT_STRIPS).stderr.splitlines()
    assert lines[0] == "running 6,000 passes, 2.000 min, with slender, implicit"
    assert lines[1].startswith("pass ")
    assert lines[-2].startswith("pass 6,000 (100 %)")
    assert lines[-1].startswith("done in ")
    assert len(lines) < 20


def test_automatic_choice_of_the_contact_model_is_a_note(command: Command, scenario: Path) -> None:
    lines = command("run", scenario, "--set", "contact.model=auto").stderr.splitlines()
    (note,) = [line for line in lines if line.startswith("note: contact.model = 'auto' has taken")]
    assert "estimated error of P_l(y)" in note


def test_quiet_shows_no_progress(command: Command, scenario: Path) -> None:
    result = command("run", scenario, "--quiet", *WITHOUT_STRIPS)
    assert result.stderr == ""
    assert "depth" in result.stdout


@pytest.mark.parametrize("options", [(), ("--quiet",)], ids=["progress", "quiet"])
def test_warning_of_a_run_is_written_once(
    command: Command, scenario: Path, options: tuple[str, ...]
) -> None:
    first = command("run", scenario, "--until", "5000 passes", *options)
    for result in (first, command("resume", "short.h5", *options)):
        lines = [line for line in result.stderr.splitlines() if line.startswith("warning")]
        assert [line for line in lines if "estimated error of depth" in line]
        assert len(set(lines)) == len(lines)


def test_json_is_the_end_state_and_all_of_stdout(command: Command, scenario: Path) -> None:
    data = json.loads(command("run", scenario, "--json", "-o", "x.h5", *WITHOUT_STRIPS).stdout)
    found = open_results("x.h5")
    assert data["depth_m"] == found.depth[-1]
    assert (data["output"], data["finished"], data["stepper"]) == ("x.h5", True, "implicit")
    assert data["steps"] == found.steps
    assert data["warnings"] == []


def test_file_is_overwritten_only_with_force(command: Command, scenario: Path) -> None:
    Path("short.h5").write_text("mine")
    refused = command("run", scenario)
    assert (refused.exit_code, Path("short.h5").read_text()) == (2, "mine")
    assert command("run", scenario, "--force", "-q").exit_code == 0
    assert open_results("short.h5").finished


def test_settings_reach_the_stored_scenario(command: Command, scenario: Path) -> None:
    command("run", scenario, "-q", "--set", "load.normal_force=150 N")
    found = open_results("short.h5")
    assert found.normal_force[-1] == pytest.approx(150.0)
    assert '"150 N"' in found.raw.scenario_text


def test_scenario_of_one_contact_cannot_be_run(command: Command) -> None:
    result = command("run", SCENARIOS / "mean-contact.toml")
    assert result.exit_code == 2
    assert "[operation] duration or passes: is needed for a run" in result.stderr


def test_failed_run_ends_with_1_and_keeps_its_file(command: Command, scenario: Path) -> None:
    result = command("run", scenario, "-q", "--set", "evolution.max_steps=2")
    assert result.exit_code == 1
    assert result.stderr.startswith("error: 2 steps have reached pass")
    state, kept = result.stderr.splitlines()[-2:]
    assert "cylinder depth" in state
    assert kept == "the last accepted step is kept: wearsim show short.h5"
    assert not open_results("short.h5").finished


def test_interrupted_run_ends_with_130(
    command: Command, scenario: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def stopped(*_: object, **__: object) -> None:
        raise Interrupted("stopped at pass 5; go on with: wearsim resume short.h5")

    monkeypatch.setattr("wearsim.run", stopped)
    result = command("run", scenario)
    assert result.exit_code == 130
    assert result.stderr == "stopped at pass 5; go on with: wearsim resume short.h5\n"


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_signal_stops_a_run_that_resume_finishes(
    command: Command, scenario: Path, tmp_path: Path, number: signal.Signals
) -> None:
    per_pass = ["--set", "evolution.stepper=per-pass", "--set", "operation.duration=600 min"]
    arguments = interruptible("-m", "wearsim", "run", scenario, *per_pass)
    with subprocess.Popen(arguments, cwd=tmp_path, stderr=subprocess.PIPE, text=True) as running:
        assert running.stderr is not None
        for line in running.stderr:
            if line.startswith("pass "):
                break
        running.send_signal(number)
        message = running.stderr.read()
    assert running.returncode == 130
    assert "stopping at a checkpoint" in message
    assert "wearsim resume short.h5" in message
    stopped = open_results("short.h5")
    assert 0 < stopped.passes[-1] < stopped.raw.total_passes
    minutes = stopped.time[-1] / 60.0 + 1.0
    resumed = command("resume", "short.h5", "-q", "--json", "--until", f"{minutes} min")
    assert resumed.exit_code == 0
    assert json.loads(resumed.stdout)["finished"]


def test_second_signal_ends_a_run_at_once(tmp_path: Path) -> None:
    code = (
        "import os, signal, time\nfrom wearsim.cli.progress import stop_on_signals\n"
        "with stop_on_signals() as stop:\n"
        "    os.kill(os.getpid(), signal.SIGINT)\n"
        "    assert stop.is_set()\n    print('requested', flush=True)\n    time.sleep(60)\n"
    )
    arguments = interruptible("-c", code)
    quiet = {"stdout": subprocess.PIPE, "stderr": subprocess.DEVNULL}
    with subprocess.Popen(arguments, **quiet) as running:
        assert running.stdout is not None
        assert running.stdout.readline() == b"requested\n"
        running.send_signal(signal.SIGINT)
        assert running.wait() == -signal.SIGINT


def test_signal_handlers_are_restored_after_a_run(command: Command, scenario: Path) -> None:
    before = signal.getsignal(signal.SIGINT), signal.getsignal(signal.SIGTERM)
    command("run", scenario, "-q")
    assert (signal.getsignal(signal.SIGINT), signal.getsignal(signal.SIGTERM)) == before


def test_resume_extends_a_finished_run(command: Command, finished: Path) -> None:
    result = command("resume", finished, "--until", "3 min", "--json")
    assert result.exit_code == 0
    data = json.loads(result.stdout)
    assert data["passes"] == 9000
    assert result.stderr.startswith("continuing from pass 6,000 of 9,000")


def test_run_stops_at_a_limit_and_resumes(command: Command, scenario: Path) -> None:
    result = command("run", scenario, "-q", "--until", "depth 0.5 um")
    assert result.exit_code == 0, result.output
    assert "stopped at depth 0.5 um: pass" in result.stdout
    file = Path(f"{scenario.stem}.h5")
    data = json.loads(command("resume", file, "-q", "--until", "depth 0.7 um", "--json").stdout)
    assert data["until"] == "depth 0.7 um"
    assert data["depth_m"] == pytest.approx(0.7e-6, rel=1e-6)
    data = json.loads(command("resume", file, "-q", "--json").stdout)
    assert (data["until"], data["passes"]) == (None, open_results(file).raw.total_passes)


@pytest.mark.parametrize("verb", ["run", "resume"])
def test_limit_that_cannot_be_read_is_a_usage_error(
    verb: str, command: Command, scenario: Path, finished: Path
) -> None:
    result = command(verb, finished if verb == "resume" else scenario, "--until", "depth 5 N")
    assert result.exit_code == 2
    message = " ".join(result.stderr.split())
    assert "--until" in message
    assert "expected a length" in message


@pytest.mark.parametrize("until", ["3", "3 mm", "-3 min"])
def test_until_must_be_a_time(command: Command, finished: Path, until: str) -> None:
    result = command("resume", finished, f"--until={until}")
    assert result.exit_code == 2
    assert "--until" in result.stderr


def test_resume_refuses_an_earlier_end(command: Command, finished: Path) -> None:
    result = command("resume", finished, "--until", "1 min")
    assert result.exit_code == 2
    assert "past 1 min" in result.stderr


def test_force_does_not_replace_the_scenario(command: Command, scenario: Path) -> None:
    before = scenario.read_bytes()
    result = command("run", scenario, "--force", "-o", scenario)
    assert result.exit_code == 2
    assert f"the scenario is read from {scenario}" in result.stderr
    assert scenario.read_bytes() == before


def test_run_and_show_print_draws_and_random_inputs(command: Command, scenario: Path) -> None:
    changes = (
        'wear.cylinder.k_over_h={distribution="constant", value="2e-11 1/Pa"}',
        'creepage.yaw={distribution="uniform", low="1 mrad", high="2 mrad"}',
        (
            'load.normal_force={distribution="ornstein-uhlenbeck", correlation_time="5 min",'
            ' marginal={distribution="uniform", low="280 N", high="320 N"}}'
        ),
    )
    settings = [word for text in changes for word in ("--set", text)]
    done = command("run", scenario, "-q", *settings)
    assert done.exit_code == 0, done.output
    found = open_results("short.h5")
    yaw = found.drawn["creepage.yaw"]
    assert found.drawn["wear.cylinder.k_over_h"] == (2e-11,)
    for result in (done, command("show", "short.h5")):
        flat = " ".join(result.stdout.split())
        assert f"drawn creepage.yaw {yaw[0] * 1e3:.6g} mrad" in flat
        assert "drawn wear.cylinder.k_over_h 2e-11 1/Pa" in flat
        assert "random load.normal_force ornstein-uhlenbeck, correlation time 5 min, of" in flat
    assert json.loads(command("show", "short.h5", "--json").stdout)["random"].keys() == {
        "load.normal_force"
    }

"""`wearsim dissipation`, and what the other verbs do with its file."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from cli_examples import SCENARIOS, Command

from wearsim.cli.counting import CountedLines
from wearsim.cli.progress import Clock
from wearsim.results import open_dissipation

PAPER = SCENARIOS / "paper-monte-carlo.toml"
SMALL = ("--set", "contact.mx=8", "--set", "contact.my=12", "-n", 50)


@pytest.fixture(scope="session")
def studied_once(tmp_path_factory: pytest.TempPathFactory) -> Path:
    from wearsim.scenario import load_scenario
    from wearsim.studies.dissipation import dissipation

    path = tmp_path_factory.mktemp("studied") / "a.h5"
    dissipation(load_scenario(PAPER, {"contact.mx": 8, "contact.my": 12}), 50, path)
    return path


@pytest.fixture
def studied(studied_once: Path, tmp_path: Path) -> Path:
    """A finished study's own copy of its file."""
    path = tmp_path / "study.h5"
    path.write_bytes(studied_once.read_bytes())
    return path


def test_that_dissipation_tells_the_power_and_its_spread(command: Command) -> None:
    result = command("dissipation", PAPER, *SMALL)
    assert result.exit_code == 0, result.output
    found = open_dissipation("paper-monte-carlo-dissipation.h5").summaries["power"]
    assert f"{found.mean:.4f} W" in result.stdout
    for text in (
        "50, monte-carlo, seed 1",
        "power, 2.5 to 97.5 %",
        "power, 5 to 95 %",
        "95 % confidence",
        "inputs at their mean",
        "drawn load.normal_force",
        "paper-monte-carlo-dissipation.h5",
    ):
        assert text in result.stdout


def test_that_json_is_si_and_all_of_stdout(command: Command) -> None:
    result = command("dissipation", PAPER, *SMALL, "--json", "--quiet", "-o", "a.h5")
    assert result.exit_code == 0
    assert result.stderr == ""
    data, kept = json.loads(result.stdout), open_dissipation("a.h5")
    power = kept.summaries["power"]
    assert data["power_W"]["mean"] == power.mean
    assert data["power_W"]["std_error"] == power.std_error
    assert data["power_W"]["quantiles"][0]["low"] is None  # too few for it
    assert data["spin_moment_N_m"]["std"] == kept.summaries["spin_moment"].std
    assert data["inputs"]["load.normal_force"]["unit"] == "N"
    assert data["inputs"]["load.normal_force"]["mean"] == kept.inputs["load.normal_force"].mean()
    assert data["strips"]["dissipation_mean_W_per_m"] == kept.values("dissipation_mean").tolist()
    assert (data["realisations"], data["finished"], data["output"]) == (50, True, "a.h5")


def test_that_plan_and_seed_reach_the_stored_scenario(command: Command) -> None:
    result = command(
        "dissipation", PAPER, *SMALL, "--plan", "latin-hypercube", "--seed", 7, "-o", "a.h5"
    )
    assert result.exit_code == 0
    assert "standard errors and intervals are those of plain Monte Carlo" in result.stderr
    stored = open_dissipation("a.h5")
    assert (stored.raw.plan, stored.raw.seed) == ("latin-hypercube", 7)
    assert stored.scenario.seed == 7
    assert stored.scenario.sampling.plan == "latin-hypercube"


def test_that_an_unknown_plan_is_bad_input(command: Command) -> None:
    result = command("dissipation", PAPER, "--plan", "sobo")
    assert result.exit_code == 2
    assert "[sampling] plan: unknown choice (did you mean 'sobol'?)" in result.stderr


def test_that_a_study_draws_a_figure_and_leaves_existing_files(command: Command) -> None:
    arguments = ("dissipation", PAPER, *SMALL, "-o", "a.h5", "--figure", "a.png")
    assert command(*arguments).exit_code == 0
    assert Path("a.png").read_bytes().startswith(b"\x89PNG")
    again = command(*arguments)
    assert again.exit_code == 2
    assert "a.png exists; choose another name with --figure, or --force" in again.stderr
    Path("a.png").unlink()
    assert "a.h5: already exists" in command(*arguments).stderr
    assert command(*arguments, "--force").exit_code == 0


def test_that_a_figure_of_no_known_kind_is_bad_input(command: Command) -> None:
    result = command("dissipation", PAPER, "--figure", "a.gif")
    assert result.exit_code == 2
    assert "--figure" in result.stderr
    assert not Path("paper-monte-carlo-dissipation.h5").exists()


def test_that_a_scenario_without_random_inputs_is_bad_input(command: Command) -> None:
    result = command("dissipation", SCENARIOS / "mean-contact.toml")
    assert result.exit_code == 2
    assert "no random input acts on the contact" in result.stderr


def test_that_show_tells_what_is_in_the_file_of_a_study(command: Command, studied: Path) -> None:
    result = command("show", studied)
    assert result.exit_code == 0
    for text in ("50, monte-carlo, seed 1", "random input disc (wearsim", "software", "skewness"):
        assert text in result.stdout
    data = json.loads(command("show", studied, "--json").stdout)
    assert data["power_W"]["count"] == 50
    assert "[creepage.misalignment]" in data["scenario"]


def test_that_plot_draws_a_study(command: Command, studied: Path) -> None:
    result = command("plot", studied)
    assert result.exit_code == 0
    assert Path("study.png").read_bytes().startswith(b"\x89PNG")
    refused = command("plot", studied, "-o", "b.png", "--measured", "m.csv")
    assert refused.exit_code == 2
    assert "goes with a wear test" in refused.stderr


@pytest.mark.parametrize("arguments", [("resume",), ("export", "-o", "out")])
def test_that_a_study_is_no_wear_test(
    command: Command, studied: Path, arguments: tuple[str, ...]
) -> None:
    verb, *options = arguments
    result = command(verb, studied, *options)
    assert result.exit_code == 2
    assert result.stderr == (
        f"error: {studied}: holds realisations of one contact, from `wearsim dissipation`; what is"
        " needed is a wear test, from `wearsim run`\n"
    )


def test_that_a_signal_ends_a_study_that_keeps_what_is_done(tmp_path: Path) -> None:
    slow = ["--set", "contact.mx=400", "--set", "contact.my=400", "-n", "200000", "-o", "a.h5"]
    arguments = [sys.executable, "-m", "wearsim", "dissipation", str(PAPER), *slow]
    with subprocess.Popen(arguments, cwd=tmp_path, stderr=subprocess.PIPE, text=True) as running:
        assert running.stderr is not None
        for line in running.stderr:
            if "200,000 realisations" in line:
                break
        running.send_signal(signal.SIGINT)
        said = running.stderr.read()
    assert running.returncode == 130
    assert "realisations; they are in a.h5" in said
    kept = open_dissipation(tmp_path / "a.h5")
    assert not kept.finished
    assert 0 < kept.count < 200_000


def test_that_counted_lines_are_a_second_apart() -> None:
    times = iter([0.0, 0.0, 0.5, 1.1, 1.2, 2.2])
    lines: list[str] = []
    counted = CountedLines(lines.append, "realisations", Clock(lambda: next(times)))
    for done in (10, 20, 30, 40):
        counted(done, 1040)
    assert lines == ["20 of 1,040 realisations, 56 s left", "40 of 1,040 realisations, 55 s left"]

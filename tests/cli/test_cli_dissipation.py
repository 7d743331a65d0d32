"""`wearsim dissipation`, and the other verbs on its file."""

from __future__ import annotations

import json
import re
import signal
import subprocess
from pathlib import Path

import numpy as np
import pytest
from cli_examples import SCENARIOS, Command

from tests.interruptible import interruptible
from wearsim.cli.progress import Counter
from wearsim.studies.opening import open_dissipation
from wearsim.studies.preparation import MOST_BYTES

PAPER = SCENARIOS / "paper-monte-carlo.toml"
SMALL = ("--set", "contact.mx=8", "--set", "contact.my=12", "-n", 50)


@pytest.fixture(scope="session")
def studied_once(tmp_path_factory: pytest.TempPathFactory) -> Path:
    from wearsim.scenario import load_scenario
    from wearsim.studies.dissipation.monte_carlo import dissipation

    path = tmp_path_factory.mktemp("studied") / "a.h5"
    dissipation(load_scenario(PAPER, {"contact.mx": 8, "contact.my": 12}), 50, path)
    return path


@pytest.fixture
def studied(studied_once: Path, tmp_path: Path) -> Path:
    """A copy of the file of a finished study."""
    path = tmp_path / "study.h5"
    path.write_bytes(studied_once.read_bytes())
    return path


def test_dissipation_prints_power_and_its_spread(command: Command) -> None:
    result = command("dissipation", PAPER, *SMALL)
    assert result.exit_code == 0, result.output
    found = open_dissipation("paper-monte-carlo-dissipation.h5").summaries["power"]
    assert f"{found.mean:.4f} W" in result.stdout
    for text in (
        "50, monte-carlo, seed 1",
        "dissipated power, 95 %",
        "dissipated power, 90 %",
        "95 % confidence",
        "inputs at their means",
        "drawn load.normal_force",
        "paper-monte-carlo-dissipation.h5",
    ):
        assert text in result.stdout


def test_json_is_si_and_all_of_stdout(command: Command) -> None:
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


def test_plan_and_seed_reach_the_stored_scenario(command: Command) -> None:
    result = command(
        "dissipation", PAPER, *SMALL, "--plan", "latin-hypercube", "--seed", 7, "-o", "a.h5"
    )
    assert result.exit_code == 0
    assert "standard errors and intervals are those of plain Monte Carlo" in result.stderr
    stored = open_dissipation("a.h5")
    assert (stored.raw.plan, stored.raw.seed) == ("latin-hypercube", 7)
    assert stored.scenario.seed == 7
    assert stored.scenario.sampling.plan == "latin-hypercube"


def test_unknown_plan_is_bad_input(command: Command) -> None:
    result = command("dissipation", PAPER, "--plan", "sobo")
    assert result.exit_code == 2
    assert "[sampling] plan: unknown choice (did you mean 'sobol'?)" in result.stderr


def test_figure_is_drawn_and_existing_files_are_kept(command: Command) -> None:
    arguments = ("dissipation", PAPER, *SMALL, "-o", "a.h5", "--figure", "a.png")
    assert command(*arguments).exit_code == 0
    assert Path("a.png").read_bytes().startswith(b"\x89PNG")
    again = command(*arguments)
    assert again.exit_code == 2
    assert "a.png exists; choose another name with --figure, or --force" in again.stderr
    Path("a.png").unlink()
    assert "a.h5: already exists" in command(*arguments).stderr
    assert command(*arguments, "--force").exit_code == 0


def test_unknown_figure_format_is_bad_input(command: Command) -> None:
    result = command("dissipation", PAPER, "--figure", "a.gif")
    assert result.exit_code == 2
    assert "--figure" in result.stderr
    assert not Path("paper-monte-carlo-dissipation.h5").exists()


def test_scenario_without_random_inputs_is_bad_input(command: Command) -> None:
    result = command("dissipation", SCENARIOS / "mean-contact.toml")
    assert result.exit_code == 2
    assert "no random input acts on the contact" in result.stderr


def test_show_prints_the_content_of_a_study(command: Command, studied: Path) -> None:
    result = command("show", studied)
    assert result.exit_code == 0
    for text in ("50, monte-carlo, seed 1", "random input disc (wearsim", "software", "skewness"):
        assert text in result.stdout
    data = json.loads(command("show", studied, "--json").stdout)
    assert data["power_W"]["count"] == 50
    assert "[creepage.misalignment]" in data["scenario"]


def test_plot_draws_a_study(command: Command, studied: Path) -> None:
    result = command("plot", studied)
    assert result.exit_code == 0
    assert Path("study.png").read_bytes().startswith(b"\x89PNG")
    refused = command("plot", studied, "-o", "b.png", "--measured", "m.csv")
    assert refused.exit_code == 2
    assert "requires wear tests" in refused.stderr


def test_resume_refuses_a_study(command: Command, studied: Path) -> None:
    result = command("resume", studied)
    assert result.exit_code == 2
    assert result.stderr == (
        f"error: {studied}: holds realisations of one contact, from `wearsim dissipation`, which"
        " cannot be continued\n"
    )


def test_signal_ends_a_study_that_keeps_its_results(tmp_path: Path) -> None:
    slow = ["--set", "contact.mx=400", "--set", "contact.my=400", "-n", "200000", "-o", "a.h5"]
    arguments = interruptible("-m", "wearsim", "dissipation", PAPER, *slow)
    with subprocess.Popen(arguments, cwd=tmp_path, stderr=subprocess.PIPE, text=True) as running:
        assert running.stderr is not None
        for line in running.stderr:
            if "200,000 realisations" in line:
                break
        running.send_signal(signal.SIGINT)
        message = running.stderr.read()
    assert running.returncode == 130
    assert "results are kept" in message
    assert "checkpoint" not in message
    assert "realisations; they are in a.h5; plot them with: wearsim plot a.h5" in message
    kept = open_dissipation(tmp_path / "a.h5")
    assert not kept.finished
    assert 0 < kept.count < 200_000


def test_counted_lines_are_a_second_apart(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    now = [0.0]
    with Counter(quiet=False, now=lambda: now[0]) as counted:
        for time, done in ((0.5, 10), (1.1, 20), (1.2, 30), (2.2, 40)):
            now[0] = time
            counted(done, 1040)
    assert capsys.readouterr().err.splitlines() == [
        "20 of 1,040 realisations",
        "40 of 1,040 realisations, 57 s left",
    ]


def _changed(name: str = "u.toml", **changes: str) -> Path:
    """Write the paper's scenario, coarse and with changes, into the current folder."""
    text = PAPER.read_text()
    for old, new in changes.values():
        assert old in text
        text = text.replace(old, new)
    path = Path(name)
    path.write_text(text)
    return path


def test_force_replaces_no_input(command: Command) -> None:
    scenario = _changed()
    before = scenario.read_bytes()
    refused = command("dissipation", scenario, *SMALL, "-o", "u.toml", "--force")
    assert refused.exit_code == 2
    assert refused.stderr == (
        "error: u.toml: the scenario is read from u.toml, and no input is replaced; choose"
        " another name with -o\n"
    )
    assert scenario.read_bytes() == before


def test_force_replaces_no_file_that_the_scenario_reads(command: Command) -> None:
    table = '{distribution = "table", file = "samples.csv"}'
    text = PAPER.read_text()
    start = text.index("[friction.coefficient]")
    end = text.index("\n[", start)
    Path("u.toml").write_text(f"{text[:start]}[friction]\ncoefficient = {table}\n{text[end:]}")
    Path("samples.csv").write_text("value\n0.08\n0.1\n0.12\n")
    for name in ("samples.csv", "./samples.csv", str(Path("samples.csv").resolve())):
        refused = command("dissipation", "u.toml", *SMALL, "-o", name, "--force")
        assert refused.exit_code == 2, refused.output
        assert "the scenario is read from samples.csv" in refused.stderr
    Path("link.png").symlink_to("samples.csv")
    refused = command("dissipation", "u.toml", *SMALL, "--figure", "link.png", "--force")
    assert refused.exit_code == 2
    assert "choose another name with --figure" in refused.stderr
    assert Path("samples.csv").read_text().startswith("value")


def test_figure_and_results_need_different_files(command: Command) -> None:
    result = command("dissipation", PAPER, *SMALL, "-o", "a.png", "--figure", "./a.png")
    assert result.exit_code == 2
    assert "is also the results file" in result.stderr
    assert not Path("a.png").exists()


def test_realisations_beyond_memory_are_bad_input(command: Command) -> None:
    result = command("dissipation", PAPER, "-n", 100_000_000_000)
    assert result.exit_code == 2
    found = re.search(r"(\S+) GB of memory, (\d+) bytes each, .* at most (\d+),", result.stderr)
    assert found is not None
    assert float(found[1]) == pytest.approx(1e11 * int(found[2]) / 1e9, rel=1e-3)
    assert int(found[3]) == MOST_BYTES // int(found[2])


def test_drawn_values_are_in_engineering_units(command: Command, studied: Path) -> None:
    rows = command("show", studied).stdout
    yaw = open_dissipation(studied).inputs["creepage.yaw"]
    assert f"mean {yaw.mean() * 1e3:.4g} mrad, std {yaw.std(ddof=1) * 1e3:.4g} mrad" in rows


def test_printed_interval_contains_its_printed_estimate(command: Command) -> None:
    result = command("dissipation", PAPER, *SMALL[:-1], 1000, "-q", "-o", "a.h5")
    for line in result.stdout.splitlines():
        number = r"(\d+\.\d+)"
        found = re.search(
            rf"{number} to {number} W \(95 % confidence: {number}\.\.{number} and"
            rf" {number}\.\.{number}\)",
            line,
        )
        if found:
            low, high, *ends = (float(text) for text in found.groups())
            assert ends[0] <= low <= ends[1]
            assert ends[2] <= high <= ends[3]
            break
    else:
        pytest.fail("no interval is printed")


def test_few_realisations_have_no_confidence_interval(command: Command) -> None:
    few = command("dissipation", PAPER, *SMALL[:-1], 5, "-q", "-o", "a.h5").stdout
    assert "(95 % confidence: too few realisations)" in few
    assert "?" not in few
    one = command("dissipation", PAPER, *SMALL[:-1], 1, "-q", "-o", "b.h5").stdout
    assert "confidence" not in one
    assert " to " not in one


def test_field_is_described_by_its_parameters(command: Command) -> None:
    field = (
        'friction.coefficient={distribution="gaussian-field", correlation_length="500 um",'
        ' marginal={distribution="uniform", low=0.08, high=0.12}}'
    )
    arguments = ("--set", field, "--set", "contact.mx=30", "--set", "contact.my=30", "-n", 3)
    result = command("dissipation", PAPER, *arguments, "-q", "-o", "a.h5")
    assert result.exit_code == 0, result.output
    flat = " ".join(result.stdout.split())
    assert (
        "random friction.coefficient gaussian-field, correlation length 500 um, frame contact, of"
        " uniform, mean 0.1, std 0.011547, on [0.08, 0.12], per-test"
    ) in flat
    assert " ".join(command("show", "a.h5").stdout.split()).count("correlation length 500 um") == 1
    shown = json.loads(command("show", "a.h5", "--json").stdout)
    assert shown["random"].keys() == {"friction.coefficient"}


def test_rounding_errors_are_shown_as_zero(command: Command) -> None:
    _changed(angles=("[creepage.misalignment]", "[creepage.none]"))
    text = Path("u.toml").read_text()
    start = text.index("[creepage.none]")
    end = text.find("\n[", start)
    Path("u.toml").write_text(text[:start] + (text[end:] if end > 0 else ""))
    steady = ("--set", "load.normal_force=300 N", "--set", "friction.coefficient=0.1")
    result = command("dissipation", "u.toml", *SMALL, *steady, "-q", "-o", "a.h5")
    assert result.exit_code == 0, result.output
    rows = {line[:18].strip(): line[18:].split() for line in result.stdout.splitlines()}
    assert rows["normal force"] == ["300.0", "N", "-", "constant", "-", "-"]
    assert rows["spin moment"] == ["0", "N", "mm", "-", "constant", "-", "-"]
    assert rows["lateral force"] == ["0", "N", "-", "constant", "-", "-"]


def test_export_writes_a_study(command: Command, studied: Path) -> None:
    result = command("export", studied, "-o", "out")
    assert result.exit_code == 0, result.output
    assert result.stdout.splitlines() == [
        f"out/{name}" for name in ("realisations.csv", "strips.csv", "scenario.toml")
    ]
    kept = open_dissipation(studied)
    text = Path("out/realisations.csv").read_text()
    head = text.splitlines()[0].split(",")
    table = np.loadtxt(text.splitlines()[1:], delimiter=",")
    for title, values in {
        "load.normal_force [N]": kept.inputs["load.normal_force"],
        "creepage.yaw [mrad]": kept.inputs["creepage.yaw"] * 1e3,
        "power [W]": kept.power,
        "spin_moment [N mm]": kept.values("spin_moment") * 1e3,
        "peak_pressure [MPa]": kept.values("peak_pressure") * 1e-6,
    }.items():
        np.testing.assert_allclose(table[:, head.index(title)], values, rtol=1e-11)
    strips = Path("out/strips.csv").read_text().splitlines()
    assert strips[0].split(",")[:2] == ["y [mm]", "dissipation_mean [W/m]"]
    found = np.loadtxt(strips[1:], delimiter=",")
    np.testing.assert_allclose(found[:, 0], kept.y * 1e3, rtol=1e-11)
    np.testing.assert_allclose(found[:, 1], kept.values("dissipation_mean"), rtol=1e-11)
    assert not any(cell == "-0" for line in strips for cell in line.split(","))

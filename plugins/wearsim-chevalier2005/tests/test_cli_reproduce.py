"""Verb `reproduce`: table, JSON in SI units, figure, and refused arguments."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.cli.cli_examples import Command
from wearsim.report import figures

FEW = ("reproduce", "-n", "40", "--quiet")


def test_table_has_printed_and_computed_values(command: Command, tmp_path: Path) -> None:
    result = command(*FEW)
    assert (result.exit_code, result.stderr) == (0, "")
    lines = result.stdout.splitlines()
    assert "DOI 10.1016/j.wear.2004.11.012" in lines[0]
    assert "40 realisations, seed 1" in lines[1]
    assert [line.split()[:4] for line in lines if "width 2b  " in line] == [
        ["width", "2b", "3.1", "mm"]
    ]
    assert (
        sum(line.startswith("                 ") and "why they differ" in line for line in lines)
        == 1
    )
    for part in ("contact", "inputs", "mean problem", "convergence"):
        assert part in (line.strip() for line in lines)
    (speed,) = [line for line in lines if "rolling speed V  " in line]
    assert "2 to 3 m/s" in speed
    assert "2.618 m/s" in speed
    assert not list(tmp_path.iterdir())  # no files without -o


def test_json_has_all_rows_in_si_units(command: Command) -> None:
    result = command(*FEW, "--json")
    data = json.loads(result.stdout)
    assert (result.stderr, data["realisations"], data["seed"]) == ("", 40, 1)
    rows = {row["name"]: row for row in data["rows"]}
    assert len(rows) == len(data["rows"])
    length = rows["contact: length 2a"]
    assert (length["paper"], length["unit"]) == (0.27e-3, "m")
    assert length["here"] == pytest.approx(0.2726e-3, abs=5e-8)
    assert length["standard_error"] is None
    band = rows["range of P_d, all inputs random: 2.5 to 97.5 %, uniform friction"]
    assert band["paper"] == [0.012, 0.29]
    assert len(band["here"]) == 2
    mean = rows["mean of P_d, all inputs random: uniform friction"]
    assert (mean["paper"], mean["printed_in"], mean["unit"]) == (0.127, "section 5.1", "W")
    assert 0.0 < mean["standard_error"] < mean["here"]


def test_seed_option_sets_the_seed(command: Command) -> None:
    first, second = (
        json.loads(command("reproduce", "-n", 2, "--seed", seed, "--json", "-q").stdout)
        for seed in (1, 2)
    )
    assert (first["seed"], second["seed"]) == (1, 2)
    name = "mean of P_d, all inputs random: white friction"
    here = [{row["name"]: row for row in data["rows"]}[name]["here"] for data in (first, second)]
    assert here[0] != here[1]


def test_figure_is_overwritten_only_with_force(
    command: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(figures, "DPI", 50)
    figure = tmp_path / "reproduce.png"
    figure.write_text("existing")
    result = command("reproduce", "-n", 2, "-o", figure, "-q")
    assert result.exit_code == 2
    assert figure.read_text() == "existing"
    result = command("reproduce", "-n", 2, "-o", figure, "-q", "--force")
    assert (result.exit_code, result.stderr) == (0, f"figure: {figure}\n")
    assert figure.read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(
    ("arguments", "message"), [(("-n", "1"), "'--realisations' / '-n'"), (("-o", "x.txt"), ".png")]
)
def test_invalid_arguments_are_refused(
    command: Command, arguments: tuple[str, ...], message: str
) -> None:
    result = command("reproduce", *arguments)
    assert result.exit_code == 2
    assert message in result.stderr

"""`wearsim compare`: wear tests and ensembles side by side."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from cli_examples import SCENARIOS, Command

from tests.studies.ensemble_cases import small
from wearsim.results import open_ensemble, open_results
from wearsim.scenario import load_scenario
from wearsim.studies.compare import compare
from wearsim.studies.dissipation import dissipation
from wearsim.studies.ensemble import ensemble
from wearsim.studies.replay import run


@pytest.fixture(scope="module", autouse=True)
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two ensembles with the same draws, a run, and what cannot be compared."""
    path = tmp_path_factory.mktemp("compared")
    ensemble(small(), 30, path / "a.h5", scheduler="serial")
    heavy = small(load__normal_force="400 N")
    ensemble(heavy, 30, path / "b.h5", scheduler="serial")
    run(small(), path / "r.h5")
    paper = load_scenario(SCENARIOS / "paper-monte-carlo.toml", {"contact.mx": 4, "contact.my": 4})
    dissipation(paper, 5, path / "d.h5")
    (path / "other").mkdir()
    (path / "other" / "a.h5").write_bytes((path / "b.h5").read_bytes())
    return path


@pytest.fixture
def here(folder: Path, command: Command, monkeypatch: pytest.MonkeyPatch) -> Command:
    """The command, in the folder of the files."""
    monkeypatch.chdir(folder)
    return command


def test_that_ensembles_are_told_beside_each_other(here: Command) -> None:
    result = here("compare", "a.h5", "b.h5")
    assert result.exit_code == 0, result.output
    found = compare([open_ensemble("a.h5"), open_ensemble("b.h5")], ["a", "b"])
    rows = [line.split() for line in result.stdout.splitlines()]
    for row in found.rows:
        told = next(line for line in rows if line[:1] == [row.label] and len(line) == 6)
        assert float(told[1]) == pytest.approx(row.value.value * 1e6, rel=1e-2)
        assert float(told[4]) == pytest.approx(row.quantiles[1][1].value * 1e6, rel=1e-2)
    deeper = found.rows[1].deeper
    assert deeper is not None
    assert f"in {100.0 * deeper.value:.1f} % [" in result.stdout
    assert "b deeper than a" in result.stdout
    assert "with the same draws" in result.stdout


def test_that_a_run_is_told_with_its_stated_error(here: Command) -> None:
    result = here("compare", "a.h5", "r.h5", "-o", "c.png")
    assert result.exit_code == 0, result.output
    kept = open_results("r.h5")
    rows = [line.split() for line in result.stdout.splitlines()]
    (told,) = [line for line in rows if line[:1] == ["r"] and line[2:] == ["-"] * 4]
    assert float(told[1]) == pytest.approx(kept.depth[-1] * 1e6, rel=1e-3)
    (error,) = [line for line in rows if line[:2] == ["stated", "error"]]
    low, high = (float(end) for end in error[2].split(".."))
    assert high - low == pytest.approx(2e6 * kept.depth_error[-1], rel=0.1)
    assert Path("c.png").read_bytes().startswith(b"\x89PNG")
    refused = here("compare", "a.h5", "r.h5", "-o", "c.png")
    assert refused.exit_code == 2
    assert "c.png exists" in refused.stderr
    assert here("compare", "a.h5", "r.h5", "-o", "c.png", "--force").exit_code == 0


def test_that_json_is_si(here: Command) -> None:
    result = here("compare", "a.h5", "b.h5", "r.h5", "--observable", "worn_volume", "--json")
    assert result.exit_code == 0, result.output
    data = json.loads(result.stdout)
    assert data["observable"] == "worn_volume_m3"
    first, second, run_too = data["compared"]
    assert first["value"]["value"] == open_ensemble("a.h5").estimate("worn_volume").mean.value
    assert first["probability_of_more_than_first"] is None
    assert 0.0 <= second["probability_of_more_than_first"]["value"] <= 1.0
    assert second["paired_with_first"]["mean_difference"]["value"] > 0.0
    assert (run_too["kind"], run_too["realisations"]) == ("run", 1)


def test_that_files_of_one_name_are_told_apart_by_their_folders(here: Command) -> None:
    result = here("compare", "a.h5", "other/a.h5")
    assert result.exit_code == 0, result.output
    assert "other/a.h5 deeper than a.h5" in result.stdout


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["a.h5"], "there is one file, a.h5; name another"),
        (["a.h5", "a.h5"], "a.h5 is there twice"),
        (["a.h5", "d.h5"], "holds realisations of one contact"),
        (["a.h5", "none.h5"], "there is no such file"),
        (["a.h5", "b.h5", "--observable", "dept"], "a has no 'dept', expected one of depth"),
        (["a.h5", "r.h5", "--observable", "mean_power"], "r has no 'mean_power'"),
        (["a.h5", "b.h5", "-o", "a.gif"], "ends in no kind of figure"),
    ],
)
def test_that_what_cannot_be_compared_is_bad_input(
    here: Command, arguments: list[str], words: str
) -> None:
    result = here("compare", *arguments)
    assert result.exit_code == 2
    assert words in " ".join(result.stderr.split())
    assert result.stdout == ""

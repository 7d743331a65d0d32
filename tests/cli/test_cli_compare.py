"""`wearsim compare`: comparison of runs and ensembles."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest
from cli_examples import SCENARIOS, Command

from tests.studies.ensemble_cases import partly_failing, small
from wearsim.errors import Interrupted
from wearsim.scenario import load_scenario
from wearsim.studies.comparison.compare import compare
from wearsim.studies.dissipation.monte_carlo import dissipation
from wearsim.studies.ensemble.api import ensemble
from wearsim.studies.opening import open_ensemble, open_results
from wearsim.studies.run.run import run


@pytest.fixture(scope="module", autouse=True)
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Files of ensembles with the same draws, of runs, and of studies that cannot be compared."""
    path = tmp_path_factory.mktemp("compared")
    ensemble(small(), 30, path / "a.h5", scheduler="serial")
    heavy = small(load__normal_force="400 N")
    ensemble(heavy, 30, path / "b.h5", scheduler="serial")
    run(small(), path / "r.h5")
    run(small(passes=2000), path / "short.h5")
    ensemble(partly_failing(), 12, path / "f.h5", scheduler="serial")
    with pytest.raises(Interrupted):
        ensemble(small(), 12, path / "u.h5", scheduler="serial", stop_requested=lambda: True)
    ensemble(small(), 1, path / "one.h5", scheduler="serial")
    paper = load_scenario(SCENARIOS / "paper-monte-carlo.toml", {"contact.mx": 4, "contact.my": 4})
    dissipation(paper, 5, path / "d.h5")
    (path / "other").mkdir()
    (path / "other" / "a.h5").write_bytes((path / "b.h5").read_bytes())
    return path


@pytest.fixture
def here(folder: Path, command: Command, monkeypatch: pytest.MonkeyPatch) -> Command:
    """The command, run in the folder of the files."""
    monkeypatch.chdir(folder)
    return command


def test_table_of_two_ensembles(here: Command) -> None:
    result = here("compare", "a.h5", "b.h5")
    assert result.exit_code == 0, result.output
    found = compare([open_ensemble("a.h5"), open_ensemble("b.h5")], ["a", "b"])
    rows = [line.split() for line in result.stdout.splitlines()]
    for row in found.rows:
        cells = next(line for line in rows if line[:1] == [row.label] and len(line) == 6)
        assert float(cells[1]) == pytest.approx(row.value.value * 1e6, rel=1e-2)
        assert float(cells[4]) == pytest.approx(row.quantiles[1][1].value * 1e6, rel=1e-2)
    deeper = found.rows[1].deeper
    assert deeper is not None
    assert f"in {100.0 * deeper.value:.1f} % [" in result.stdout
    assert "b deeper than a" in result.stdout
    assert "with the same draws" in result.stdout


def test_run_is_listed_with_its_error_estimate(here: Command) -> None:
    result = here("compare", "a.h5", "r.h5", "-o", "c.png")
    assert result.exit_code == 0, result.output
    kept = open_results("r.h5")
    rows = [line.split() for line in result.stdout.splitlines()]
    (cells,) = [line for line in rows if line[:1] == ["r"] and line[2:] == ["-"] * 4]
    assert float(cells[1]) == pytest.approx(kept.depth[-1] * 1e6, rel=1e-3)
    (error,) = [line for line in rows if line[:2] == ["error", "estimate"]]
    low, high = (float(end) for end in error[2].split(".."))
    assert high - low == pytest.approx(2e6 * kept.depth_error[-1], rel=0.1)
    assert Path("c.png").read_bytes().startswith(b"\x89PNG")
    refused = here("compare", "a.h5", "r.h5", "-o", "c.png")
    assert refused.exit_code == 2
    assert "c.png exists" in refused.stderr
    assert here("compare", "a.h5", "r.h5", "-o", "c.png", "--force").exit_code == 0


def test_json_is_in_si_units(here: Command) -> None:
    result = here("compare", "a.h5", "b.h5", "r.h5", "--observable", "worn_volume", "--json")
    assert result.exit_code == 0, result.output
    data = json.loads(result.stdout)
    assert data["observable"] == "worn_volume_m3"
    first, second, of_run = data["compared"]
    assert first["value"]["value"] == open_ensemble("a.h5").estimate("worn_volume").mean.value
    assert first["probability_of_more_than_first"] is None
    assert 0.0 <= second["probability_of_more_than_first"]["value"] <= 1.0
    assert second["paired_with_first"]["mean_difference"]["value"] > 0.0
    assert (of_run["kind"], of_run["realisations"]) == ("run", 1)


def test_labels_of_equal_file_names_include_the_folder(here: Command) -> None:
    result = here("compare", "a.h5", "other/a.h5")
    assert result.exit_code == 0, result.output
    assert "other/a.h5 deeper than a.h5" in result.stdout


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["a.h5"], "there is one file, a.h5; give another one"),
        (["a.h5", "a.h5"], "a.h5 is given twice"),
        (["a.h5", "d.h5"], "holds realisations of one contact"),
        (["a.h5", "d.h5"], "only runs and ensembles can be compared"),
        (["a.h5", "none.h5"], "there is no such file"),
        (
            ["a.h5", "b.h5", "--observable", "dept"],
            "'dept' is not an observable of a (did you mean 'depth'?); known: depth",
        ),
        (["a.h5", "r.h5", "--observable", "mean_power"], "'mean_power' is not an observable of r"),
        (["a.h5", "b.h5", "-o", "a.gif"], "has no known figure format"),
    ],
)
def test_invalid_comparison_is_bad_input(here: Command, arguments: list[str], message: str) -> None:
    result = here("compare", *arguments)
    assert result.exit_code == 2
    assert message in " ".join(result.stderr.split())
    assert result.stdout == ""


def test_unequal_lengths_of_tests_give_a_warning(here: Command) -> None:
    result = here("compare", "a.h5", "short.h5")
    assert "warning: the tests differ in length (a: 3,000 passes" in result.stderr
    rows = " ".join(result.stdout.split())
    assert "ensemble of 30; 3,000 passes, 1.000 min; a.h5" in rows
    assert "run; 2,000 passes" in rows
    data = json.loads(here("compare", "a.h5", "short.h5", "--json").stdout)
    assert not data["same_length"]
    assert [item["passes"] for item in data["compared"]] == [3000.0, 2000.0]
    assert data["compared"][0]["time_s"] == open_ensemble("a.h5").record_time[-1]
    assert "length" not in here("compare", "a.h5", "r.h5").stderr


def test_failed_and_unfinished_ensembles_are_marked(here: Command) -> None:
    result = here("compare", "a.h5", "f.h5", "u.h5")
    failing, part = open_ensemble("f.h5"), open_ensemble("u.h5")
    assert 0 < failing.failed < 12
    rows = " ".join(result.stdout.split())
    assert f"ensemble of {failing.count} of 12, {failing.failed} failed;" in rows
    assert f"ensemble of {part.count} of 12, unfinished;" in rows
    assert f"warning: {failing.failed} of the 12 realisations of f failed" in result.stderr
    assert "may be biased" in result.stderr
    items = json.loads(here("compare", "a.h5", "f.h5", "u.h5", "--json").stdout)["compared"]
    assert [item["failed"] for item in items] == [0, failing.failed, 0]
    assert [item["requested"] for item in items] == [30, 12, 12]
    assert [item["finished"] for item in items] == [True, True, False]
    assert "biased" not in here("compare", "a.h5", "u.h5").stderr


def test_ties_and_a_single_pair_of_tests(here: Command) -> None:
    same = here("compare", "a.h5", "other/../a.h5").stdout
    assert "with the same draws equal in all tests" in " ".join(same.split())
    equal = " ".join(here("compare", "one.h5", "a.h5").stdout.split())
    assert "with the same draws equal in the only pair of tests" in equal
    difference = open_ensemble("b.h5").at_end("depth")[0]
    difference -= open_ensemble("a.h5").at_end("depth")[0]
    pair = " ".join(here("compare", "one.h5", "b.h5").stdout.split())
    assert f"with the same draws deeper by {difference * 1e6:.4g} um in the only" in pair
    none = " ".join(here("compare", "a.h5", "b.h5", "--observable", "roller_depth").stdout.split())
    assert "b more than a equal in all tests" in none


def test_difference_of_two_runs_beyond_their_errors(here: Command) -> None:
    result = here("compare", "r.h5", "short.h5")
    one, other = open_results("r.h5"), open_results("short.h5")
    by = float(one.depth[-1] - other.depth[-1]) * 1e6
    assert by > 1e6 * (one.depth_error[-1] + other.depth_error[-1])
    rows = " ".join(result.stdout.split())
    found = re.search(r"short against r shallower by ([\d.]+) um \(estimated errors", rows)
    assert found is not None
    assert float(found[1]) == pytest.approx(by, rel=1e-3)
    assert "pairs of tests" not in rows
    item = json.loads(here("compare", "r.h5", "short.h5", "--json").stdout)["compared"][1]
    assert item["difference_from_first"]["value"] * 1e6 == pytest.approx(-by)
    assert item["difference_from_first"]["high"] < 0.0


def test_difference_of_two_runs_within_their_errors(here: Command) -> None:
    run(small(evolution__tolerance=5e-3), Path("finer.h5"), force=True)
    rows = " ".join(here("compare", "r.h5", "finer.h5").stdout.split())
    assert "finer against r not significant: " in rows
    assert "um, within the estimated errors" in rows
    rows = " ".join(here("compare", "r.h5", "other/../r.h5").stdout.split())
    assert "equal (estimated errors" in rows

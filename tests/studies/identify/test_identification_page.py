"""Tutorial of identification: three grooves with known wear factors."""

from __future__ import annotations

import json
import re
import shutil
import tomllib
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from wearsim.cli.app import app

ROOT = Path(__file__).parents[3]
PAGE = (ROOT / "docs" / "tutorials" / "identify.md").read_text(encoding="utf-8")
CELLS = re.findall(r"^```\{code-cell\} ipython3\n(.*?)^```$", PAGE, flags=re.DOTALL | re.MULTILINE)
GROOVES, TESTS = (cell for cell in CELLS if not cell.startswith(("%", ":tags:")))
INPUTS = [("321 N", 0.093, 1.25e-3)]


def identified(*words: str) -> dict[str, Any]:
    scenario = "scenarios/rig-identify.toml"
    done = CliRunner().invoke(app, ["identify", scenario, *words, "--json", "-q"])
    assert done.exit_code == 0, done.output
    found: dict[str, Any] = json.loads(done.stdout)
    return found


@pytest.mark.coverage
def test_intervals_of_the_tutorial_hold_the_truth(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
):
    monkeypatch.chdir(tmp_path)
    shutil.copytree(ROOT / "scenarios", tmp_path / "scenarios")
    names: dict[str, Any] = {}
    exec(GROOVES, names)
    true_depths = [float(text) for text in re.findall(r"([\d.]+) um", capsys.readouterr().out)]
    exec(TESTS, names)
    unknown = identified("t1.csv", "t2.csv", "t3.csv")
    measured = identified("--tests", "tests.toml")
    assert unknown["verdict"] == "undecided"
    for depth, test in zip(true_depths, unknown["tests"], strict=True):
        low, high = test["depth_interval_m"]
        assert low < 1e-6 * depth < high
    for wide, narrow in zip(unknown["tests"], measured["tests"], strict=True):
        ends = [
            (one["k_over_h_per_Pa"]["low"], one["k_over_h_per_Pa"]["high"])
            for one in (wide, narrow)
        ]
        assert all(low < 1e-11 < high for low, high in ends)
        assert ends[1][1] - ends[1][0] < 0.6 * (ends[0][1] - ends[0][0])


def test_tests_file_of_the_tutorial_is_valid(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.chdir(tmp_path)
    exec(TESTS, {"inputs": INPUTS})
    (test,) = tomllib.loads((tmp_path / "tests.toml").read_text())["test"]
    assert set(test) == {"profile", "set", "std"}
    assert set(test["std"]) == set(test["set"])

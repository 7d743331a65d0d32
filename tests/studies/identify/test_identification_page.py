"""Example of the page on identification: three grooves whose truth is stated."""

from __future__ import annotations

import json
import re
import runpy
import shutil
import tomllib
from pathlib import Path

import pytest
from typer.testing import CliRunner

from wearsim.cli.app import app

ROOT = Path(__file__).parents[3]


@pytest.mark.slow
def test_example_of_the_page_gives_the_printed_verdict(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    page = (ROOT / "docs" / "identification.md").read_text(encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    for name in ("rig-450min.toml", "rig-identify.toml"):
        shutil.copy(ROOT / "scenarios" / name, tmp_path)
    (code,) = re.findall(r"^```python\n(.*?)^```$", page, flags=re.DOTALL | re.MULTILINE)
    (tmp_path / "grooves.py").write_text(code)
    runpy.run_path("grooves.py")
    files = ["t1.csv", "t2.csv", "t3.csv"]
    done = CliRunner().invoke(app, ["identify", "rig-identify.toml", *files, "--json", "-q"])
    assert done.exit_code == 0, done.output
    found = json.loads(done.stdout)
    assert found["verdict"] == "undecided"
    printed = re.findall(r"^t\d.csv .*?  (\d+\.\d+) \(", page, flags=re.MULTILINE)[:3]
    depths = [1e6 * test["depth_m"] for test in found["tests"]]
    assert depths == pytest.approx([float(text) for text in printed], rel=0.005)
    assert depths == pytest.approx([52.2, 36.7, 47.2], rel=0.015)
    for test in found["tests"]:
        assert test["k_over_h_per_Pa"]["low"] < 1e-11 < test["k_over_h_per_Pa"]["high"]


def test_tests_file_of_the_page_is_valid():
    page = (ROOT / "docs" / "identification.md").read_text(encoding="utf-8")
    (text,) = re.findall(r"^```toml\n(.*?)^```$", page, flags=re.DOTALL | re.MULTILINE)
    (test,) = tomllib.loads(text)["test"]
    assert set(test) == {"profile", "set", "std"}
    assert set(test["std"]) == set(test["set"])

"""Measurements of the site: committed with date and machine, and rendered without Sphinx."""

from __future__ import annotations

import json
import re
import sys
from datetime import date
from pathlib import Path

import pytest

DOCS = Path(__file__).parents[1] / "docs"
sys.path.insert(0, str(DOCS / "_ext"))

from wearsim_measurements import MEASURED, TEMPLATE, Measurements  # noqa: E402

FILES = sorted(MEASURED.glob("*.json"))
GENERATED = {"_build", "generated"}
TEMPLATES = [
    page
    for page in sorted(DOCS.rglob("*.md"))
    if not GENERATED.intersection(page.parts) and TEMPLATE in page.read_text(encoding="utf-8")
]


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_measurements_have_date_machine_and_command(file: Path):
    data = json.loads(file.read_text(encoding="utf-8"))
    assert date.fromisoformat(data["machine"]["date"]) <= date.today()
    assert data["machine"]["processor"]
    assert "command" in data or "effort" in data  # of `wearsim bench`
    assert data["machine"]["date"] in Measurements().measured(file.stem)


@pytest.mark.parametrize("page", TEMPLATES, ids=lambda page: page.stem)
def test_pages_of_measurements_are_complete(page: Path):
    text = Measurements().page(page.read_text(encoding="utf-8"))
    assert TEMPLATE not in text
    assert "nan" not in re.findall(r"\w+", text)


def test_every_file_is_on_a_page():
    texts = "".join(page.read_text(encoding="utf-8") for page in TEMPLATES)
    functions = {"hard": "verdicts()"}
    missing = [f.stem for f in FILES if functions.get(f.stem, f'"{f.stem}"') not in texts]
    assert not missing


def test_missing_measurements_are_named():
    with pytest.raises(KeyError, match=r"stepping\.json has no 'rig, 450 min', 'implicit', 'fast'"):
        Measurements().time("stepping", "rig, 450 min", "implicit", "fast")
    with pytest.raises(KeyError, match=r"report\.json: table 'One contact' has 0 rows 'none'"):
        Measurements().cell("report", "One contact", "none", "measured")


def test_numbers_are_those_of_the_file(tmp_path: Path):
    row = {"group": "g", "method": "m", "setting": "s", "seconds": 0.03, "errors": {"e": 0.0123}}
    words = {"name": "t", "title": "T", "about": "", "seconds": "one", "error": "e"}
    topic = {**words, "errors": {"e": "E"}, "counts": {"c": "C"}, "floor": 0.0, "details": []}
    rows = [{**row, "counts": {"c": 195.0}, "default": True, "failed": "", "remark": ""}]
    (tmp_path / "t.json").write_text(json.dumps({**topic, "conclusions": {}, "measurements": rows}))
    text = '{{ time("t", "g", "m", "default") }}, {{ error("t", "g", "m", "s") }}, '
    text += '{{ count("t", "g", "m", "s", "c") }}, {{ setting("t", "g", "m") }}'
    assert Measurements(tmp_path).page(text) == "30 ms, 1.2 %, 195, s"

"""Tests of the documentation: printed examples run, and named files exist."""

from __future__ import annotations

import json
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
from typer.testing import CliRunner

from tests.benchmarks.first_contact import MEASURED, sentence
from wearsim.cli.app import app
from wearsim.studies.dissipation.result import DISSIPATION
from wearsim.studies.ensemble.file.schema import ENSEMBLE
from wearsim.studies.opening import open_results
from wearsim.studies.run.schema import RUN

ROOT = Path(__file__).parents[1]
GENERATED = {"_build", "generated"}
PAGES_OF_SITE = [
    page
    for page in sorted((ROOT / "docs").rglob("*.md"))
    if not GENERATED.intersection(page.relative_to(ROOT).parts)
]
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *PAGES_OF_SITE]
README = PAGES[0].read_text(encoding="utf-8")


def blocks(text: str, language: str) -> list[str]:
    """Return the fenced blocks of a language."""
    fenced = re.findall(r"^```(\w*)\n(.*?)^```$", text, flags=re.DOTALL | re.MULTILINE)
    return [block for name, block in fenced if name == language]


def test_readme_is_one_and_a_half_screens():
    assert len(README.splitlines()) <= 120


def test_readme_states_the_measured_way_to_a_first_figure():
    assert sentence(json.loads(MEASURED.read_text(encoding="utf-8"))) in README


def test_readme_scenario_gives_the_printed_output(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.chdir(tmp_path)
    (scenario,) = blocks(README, "toml")
    (tmp_path / "rig.toml").write_text(scenario)
    done = CliRunner().invoke(app, ["run", "rig.toml"])
    assert done.exit_code == 0, done.output
    (printed,) = [block for block in blocks(README, "") if "wearsim run rig.toml" in block]
    for line in printed.splitlines()[1:]:
        if "wall time" not in line and "tolerance" not in line:
            assert " ".join(line.split()) in " ".join(done.output.split()), line
    for verb, file in re.findall(r"`wearsim (plot|resume) (rig\.h5)`", README):
        done = CliRunner().invoke(app, [verb, file])
        assert done.exit_code == 0, done.output
    (code,) = blocks(README, "python")
    (tmp_path / "example.py").write_text(code)
    script = [sys.executable, "example.py"]  # next to the files of the run at the shell
    done = subprocess.run(script, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert float(done.stdout.split()[0]) == open_results("rig.h5").final["depth_m"]


GUIDE = (ROOT / "docs" / "guide.md").read_text(encoding="utf-8")


def test_scenario_of_the_guide_runs(tmp_path: Path):
    (scenario,) = blocks(GUIDE, "toml")
    (tmp_path / "rig.toml").write_text(scenario)
    assert CliRunner().invoke(app, ["check", str(tmp_path / "rig.toml")]).exit_code == 0


@pytest.mark.slow
@pytest.mark.parametrize("number", range(2))
def test_examples_of_the_guide_run_as_scripts(number: int, tmp_path: Path):
    assert CliRunner().invoke(app, ["new", "scenario", str(tmp_path / "rig.toml")]).exit_code == 0
    code = blocks(GUIDE, "python")
    assert len(code) == 2
    (tmp_path / "example.py").write_text(code[number])
    for _ in range(2):  # also where files of the first time exist
        script = [sys.executable, "example.py"]
        done = subprocess.run(script, cwd=tmp_path, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr


def test_example_of_deprecation_runs(tmp_path: Path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert CliRunner().invoke(app, ["new", "scenario", "rig.toml"]).exit_code == 0
    (code,) = blocks((ROOT / "docs" / "compatibility.md").read_text(encoding="utf-8"), "python")
    short = code.replace('"rig.toml", {', '"rig.toml", {"operation.duration": "1 min", ')
    exec(short, {})
    assert capsys.readouterr().out.strip() == code.rpartition("# ")[2].strip()


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_bits_that_are_claimed_are_those_of_numbers(page: Path):
    text = " ".join(page.read_text(encoding="utf-8").split())
    claims = re.findall(r"[^.|]*(?:resum|continues)[^.|]*(?:bit for bit|same bits)[^.|]*", text)
    assert not [claim for claim in claims if "numbers" not in claim]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_lead_to_files(page: Path):
    text = page.read_text(encoding="utf-8")
    targets = [target for target in re.findall(r"\]\(([^)#]+)", text) if "://" not in target]
    targets = [target for target in targets if not GENERATED.intersection(Path(target).parts)]
    missing = [target for target in targets if not (page.parent / target).exists()]
    assert not missing


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_test_files_that_pages_name_exist(page: Path):
    text = page.read_text(encoding="utf-8")
    named = re.findall(r"`((?:tests|plugins|scenarios|docs|constraints)/[\w./-]+)`", text)
    missing = [name for name in named if not (ROOT / name).exists()]
    missing += [
        name
        for name in re.findall(r"python -m (tests[\w.]+)", text)
        if not (ROOT / name.replace(".", "/")).with_suffix(".py").exists()
    ]
    assert not missing


def test_files_of_the_architecture_exist():
    text = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
    files = {path.relative_to(ROOT).as_posix() for path in ROOT.glob("wearsim/**/*")}
    for name in re.findall(r"`([\w/]+(?:\.py|/))`", text):
        path = name.rstrip("/")
        assert (
            any(file == path or file.endswith(f"/{path}") for file in files)
            or (ROOT / path).exists()
        ), name


def test_layout_numbers_are_documented():
    text = (ROOT / "docs" / "compatibility.md").read_text(encoding="utf-8")
    for schema in (RUN, DISSIPATION, ENSEMBLE):
        assert f"| `{schema.format}` | {schema.version} |" in text


def test_guide_names_every_verb():
    text = (ROOT / "docs" / "guide.md").read_text(encoding="utf-8")
    shown = CliRunner().invoke(app, ["--help"]).output
    verbs = re.findall(r"^  ([a-z]+)  ", shown.split("Commands:")[1], flags=re.MULTILINE)
    assert len(verbs) >= 14
    missing = [verb for verb in verbs if not re.search(rf"wearsim {verb}\b", text)]
    assert not missing


def test_answers_to_the_twelve_questions_exist():
    questions = tomllib.loads((ROOT / "tests" / "questions.toml").read_text())["question"]
    assert len(questions) == 12
    assert all((ROOT / question["file"]).is_file() for question in questions)

"""The rooms of the house: who may import whom, and who may speak."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
MODULES = sorted((ROOT / "wearsim").rglob("*.py"))


def lint_imports() -> subprocess.CompletedProcess[str]:
    command = "from importlinter.cli import lint_imports; raise SystemExit(lint_imports())"
    return subprocess.run(
        [sys.executable, "-c", command], cwd=ROOT, capture_output=True, text=True, check=False
    )


def test_that_no_room_imports_from_above_and_guests_stay_in_their_rooms():
    done = lint_imports()
    assert done.returncode == 0, done.stdout + done.stderr
    assert "0 broken" in done.stdout


def test_that_every_room_stands_in_the_layers():
    pyproject = (ROOT / "pyproject.toml").read_text()
    rooms = {path.parent.name for path in (ROOT / "wearsim").glob("*/__init__.py")}
    assert len(rooms) >= 9
    missing = [room for room in sorted(rooms) if f'"wearsim.{room}",\n' not in pyproject]
    assert not missing, f"rooms outside the layers contract: {missing}"


@pytest.mark.parametrize("path", MODULES, ids=lambda path: str(path.relative_to(ROOT)))
def test_that_no_module_prints(path: Path):
    calls = [node for node in ast.walk(ast.parse(path.read_text())) if isinstance(node, ast.Call)]
    names = {call.func.id for call in calls if isinstance(call.func, ast.Name)}
    assert "print" not in names


def test_that_every_module_has_a_docstring():
    silent = [str(path) for path in MODULES if not ast.get_docstring(ast.parse(path.read_text()))]
    assert not silent

"""Fixture `command`, and the marker `bench` for all tests of this folder."""

from __future__ import annotations

from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

from wearsim.cli.app import app
from wearsim.report import figures

collect_ignore_glob = [] if find_spec("wearsim_optimise") else ["*"]


def pytest_itemcollected(item: pytest.Item) -> None:  # called for this folder only
    item.add_marker(pytest.mark.bench)


@pytest.fixture
def command(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., Result]:
    """Return a function that runs `wearsim` in an empty folder, and draws coarse figures."""
    monkeypatch.setattr(figures, "DPI", 60)
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("WEARSIM_TRACEBACK", raising=False)

    def run(*args: object) -> Result:
        return CliRunner().invoke(app, [str(arg) for arg in args])

    return run

"""Scenarios of the tests, and the marker `bench` for all tests of this folder."""

from __future__ import annotations

import os
from importlib.util import find_spec
from pathlib import Path

import pytest

FOLDER = Path(__file__).parent
collect_ignore_glob = [] if find_spec("wearsim_explore") else ["*"]


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    for item in items:  # all tests of all folders: texts are compared faster than paths
        if str(item.path).startswith(f"{FOLDER}{os.sep}"):
            item.add_marker(pytest.mark.bench)


@pytest.fixture
def rig(tmp_path: Path) -> Path:
    """Return the file of a short test in an empty folder."""
    path = tmp_path / "rig.toml"
    path.write_text((FOLDER / "rig.toml").read_text())
    return path

"""Scenarios of the tests, and the marker `bench` for all tests of this folder."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path

import pytest

FOLDER = Path(__file__).parent
collect_ignore_glob = [] if find_spec("wearsim_explore") else ["*"]


def pytest_itemcollected(item: pytest.Item) -> None:  # called for this folder only
    item.add_marker(pytest.mark.bench)


@pytest.fixture
def rig(tmp_path: Path) -> Path:
    """Return the file of a short test in an empty folder."""
    path = tmp_path / "rig.toml"
    path.write_text((FOLDER / "rig.toml").read_text())
    return path

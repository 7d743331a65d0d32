"""The marker `bench` for all tests of this folder, which are skipped without the plugin."""

from __future__ import annotations

import os
from importlib.util import find_spec
from pathlib import Path

import pytest

FOLDER = Path(__file__).parent
collect_ignore_glob = [] if find_spec("wearsim_halfspace") else ["*"]
if find_spec("wearsim_bench") is None:  # has the worn profiles
    collect_ignore_glob.append("test_reference_solutions.py")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    for item in items:  # all tests of all folders: texts are compared faster than paths
        if str(item.path).startswith(f"{FOLDER}{os.sep}"):
            item.add_marker(pytest.mark.bench)

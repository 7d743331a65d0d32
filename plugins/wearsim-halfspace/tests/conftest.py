"""The marker `bench` for all tests of this folder, which are skipped without the plugin."""

from __future__ import annotations

from importlib.util import find_spec

import pytest

collect_ignore_glob = [] if find_spec("wearsim_halfspace") else ["*"]
if find_spec("wearsim_bench") is None:  # has the worn profiles
    collect_ignore_glob.append("test_reference_solutions.py")


def pytest_itemcollected(item: pytest.Item) -> None:  # called for this folder only
    item.add_marker(pytest.mark.bench)

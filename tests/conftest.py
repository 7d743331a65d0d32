"""Test modules that import a plugin: skipped without it, and marked `bench`.

No example of hypothesis fails because of its run time.
"""

from __future__ import annotations

import re
from functools import cache
from importlib.util import find_spec
from pathlib import Path

import pytest
from hypothesis import settings

settings.register_profile("wearsim", settings(), deadline=None)
settings.load_profile("wearsim")

#: tests.benchmarks imports wearsim_bench
PLUGINS = r"wearsim_(?:bench|chevalier2005|explore|halfspace|optimise|validation)"
NAMES = rf"{PLUGINS}|tests\.benchmarks import"
IMPORT = re.compile(rf"^\s*(?:from|import)\s+({NAMES})", re.M)


@cache
def plugins_of(path: Path) -> set[str]:
    """Return the plugins that a test module imports."""
    if path.suffix != ".py" or not path.name.startswith("test_"):
        return set()
    found = set(IMPORT.findall(path.read_text(encoding="utf-8")))
    return {"wearsim_bench" if name.startswith("tests") else name for name in found}


def pytest_ignore_collect(collection_path: Path) -> bool | None:
    missing = [name for name in plugins_of(collection_path) if find_spec(name) is None]
    return True if missing else None


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    for item in items:
        if plugins_of(item.path):
            item.add_marker(pytest.mark.bench)

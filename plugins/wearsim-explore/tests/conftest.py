"""Scenarios of the tests, and the marker `bench` for all tests of this folder."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path

import pytest

FOLDER = Path(__file__).parent
collect_ignore_glob = [] if find_spec("wearsim_explore") else ["*"]
RIG = """
title = "a short test"

[roller]
radius = "20 mm"          # of the rig
crown_radius = "500 mm"
material = "steel"
[cylinder]
radius = "25 mm"
material = "steel"
[operation]
speed = "1000 rpm"
duration = "3 min"        # short
[load]
kind = "constant"
normal_force = "300 N"
[friction]
coefficient = 0.1
[creepage]
longitudinal = 1e-3
[contact]
model = "slender"
[wear]
law = "archard-dissipation"
[wear.cylinder]
k_over_h = "1.1e-11 1/Pa" # measured
[wear.roller]
k_over_h = "0 1/Pa"
[outputs]
records = 3
"""


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    for item in items:
        if item.path.is_relative_to(FOLDER):
            item.add_marker(pytest.mark.bench)


@pytest.fixture
def rig(tmp_path: Path) -> Path:
    """Return the file of a short test in an empty folder."""
    path = tmp_path / "rig.toml"
    path.write_text(RIG)
    return path

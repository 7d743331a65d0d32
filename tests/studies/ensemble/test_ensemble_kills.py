"""Killed ensembles: the file can be read, and the resumed ensemble is bitwise identical."""

from __future__ import annotations

import os
import signal
from pathlib import Path

import pytest
from killed_scripts import rows_of

pytestmark = pytest.mark.skipif(not hasattr(os, "fork"), reason="needs fork and SIGKILL")


@pytest.mark.parametrize("extent", ["each stage", pytest.param("sixths", marks=pytest.mark.slow)])
def test_killed_ensemble_resumes_bit_for_bit(tmp_path: Path, extent: str) -> None:
    head, *rows = rows_of("killed_ensemble.py", "stages", tmp_path, extent)
    stages = head["stages"]
    killed_at = {row["number"] for row in rows}
    left_out = "after" if extent == "each stage" else "after write"
    expected = {stage for stage in stages if not stage.startswith(left_out)}
    assert {stages[number] for number in killed_at} == expected
    for row in rows:
        assert row["killed"][0] == signal.SIGKILL
        assert row["differences"] == []
    if extent == "sixths":
        assert stages.count("before write") > 50
        assert len(killed_at) > len(stages) // 7
    # no file, no realisation, after the first and after the last
    assert {-1, 0, 1, 2} <= {row["done"] for row in rows}


@pytest.mark.slow
def test_ensemble_killed_at_any_moment_resumes_bit_for_bit(tmp_path: Path) -> None:
    rows = rows_of("killed_ensemble.py", "moments", tmp_path, 10)
    assert len(rows) == 10
    for row in rows:
        assert row["differences"] == []
        assert set(row["killed"]) <= {signal.SIGPROF, 0}
    assert sum(signal.SIGPROF in row["killed"] for row in rows) >= 5
    assert sum(0 <= row["done"] < 8 for row in rows) >= 2  # some between start and end

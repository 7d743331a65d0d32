"""Whatever kills an ensemble, and whenever: its file opens, and goes on to the same bits."""

from __future__ import annotations

import os
import signal
from pathlib import Path

import pytest
from killed_scripts import rows_of

pytestmark = pytest.mark.skipif(not hasattr(os, "fork"), reason="needs fork and SIGKILL")


def test_that_a_kill_around_every_write_costs_nothing(tmp_path: Path) -> None:
    rows = rows_of("killed_ensemble.py", "stages", tmp_path)
    assert sum(row["stage"] == "before write" for row in rows) > 50
    for row in rows:
        assert row["killed"][0] == signal.SIGKILL
        assert row["unlike"] == []
    # fresh, after the first batch, and after the last
    assert {-1, 0, 1, 2} <= {row["done"] for row in rows}


def test_that_a_kill_at_any_moment_costs_nothing(tmp_path: Path) -> None:
    rows = rows_of("killed_ensemble.py", "moments", tmp_path, 10)
    assert len(rows) == 10
    for row in rows:
        assert row["unlike"] == []
        assert set(row["killed"]) <= {signal.SIGKILL, 0}
    assert sum(signal.SIGKILL in row["killed"] for row in rows) >= 5
    assert sum(0 <= row["done"] < 8 for row in rows) >= 2  # some in the midst of it

"""Whatever kills an ensemble, and whenever: its file opens, and goes on to the same bits."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
# one thread, since the process forks; and the same wearsim as here
ENVIRONMENT = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1", "PYTHONPATH": str(ROOT)}

pytestmark = pytest.mark.skipif(not hasattr(os, "fork"), reason="needs fork and SIGKILL")


def _killed(*arguments: object) -> list[dict[str, Any]]:
    done = subprocess.run(
        [sys.executable, str(HERE / "killed_ensemble.py"), *map(str, arguments)],
        capture_output=True,
        text=True,
        check=False,
        env=os.environ | ENVIRONMENT,
        cwd=ROOT,
    )
    assert done.returncode == 0, done.stderr
    return [json.loads(line) for line in done.stdout.splitlines()]


def test_that_a_kill_around_every_write_costs_nothing(tmp_path: Path) -> None:
    rows = _killed("stages", tmp_path)
    assert sum(row["stage"] == "before write" for row in rows) > 50
    for row in rows:
        assert row["killed"][0] == signal.SIGKILL
        assert row["unlike"] == []
    # fresh, after the first batch, and after the last
    assert {-1, 0, 2, 3} <= {row["done"] for row in rows}


def test_that_a_kill_at_any_moment_costs_nothing(tmp_path: Path) -> None:
    rows = _killed("moments", tmp_path, 10)
    assert len(rows) == 10
    for row in rows:
        assert row["unlike"] == []
        assert set(row["killed"]) <= {signal.SIGKILL, 0}
    assert sum(signal.SIGKILL in row["killed"] for row in rows) >= 5
    assert sum(0 <= row["done"] < 8 for row in rows) >= 2  # some in the midst of it

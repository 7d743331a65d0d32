"""Sizes of the batches of an ensemble, from the time that the batches before have taken."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from wearsim.studies.ensemble import driver
from wearsim.studies.ensemble.file.schema import PENDING

START, EACH = 3.0, 0.05  # s: start of a worker, and a realisation


def batch_sizes(monkeypatch: pytest.MonkeyPatch, total: int, batches: int) -> list[int]:
    """Return the sizes of the first batches of an ensemble that one worker runs."""
    clock = [0.0]
    monkeypatch.setattr(driver, "time", SimpleNamespace(monotonic=lambda: clock[0]))
    file: Any = SimpleNamespace(
        status=np.full(total, PENDING),
        data=SimpleNamespace(wall_seconds=0.0, finished=True, life={}),
        put=lambda outcomes: None,
    )
    runner: Any = SimpleNamespace(plan="monte-carlo")
    pool: Any = SimpleNamespace(workers=1, describe="1 process")
    work = driver.EnsembleWork(file, runner, None, pool, None, None)
    sizes = []
    for number in range(batches):
        sizes.append(work._batch_size())
        clock[0] += sizes[-1] * EACH + (START if number == 0 else 0.0)
        work._take([SimpleNamespace(number=0)] * sizes[-1])  # type: ignore[list-item]
    return sizes


def test_batches_grow_to_their_duration_despite_a_slow_start(monkeypatch):
    sizes = batch_sizes(monkeypatch, 10_000, 6)
    assert sizes == [1, 1, 4, 16, 64, round(driver.SECONDS / EACH)]


def test_last_batches_are_small_so_that_all_workers_end_together(monkeypatch):
    assert max(batch_sizes(monkeypatch, 12, 6)) == 6

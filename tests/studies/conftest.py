"""Fixtures of the studies: passes in small helpings, checkpoints as often as they are asked for."""

from __future__ import annotations

from pathlib import Path

import pytest

from wearsim.evolution.steppers import per_pass
from wearsim.studies.run.run import _RunInProgress


@pytest.fixture
def small_chunks(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let the per-pass stepper look up often, so that short tests can be stopped."""
    monkeypatch.setattr(per_pass, "CHUNK", 700)
    monkeypatch.setattr(per_pass, "SLOW_CHUNK", 20)


@pytest.fixture
def quick_disk(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let a run believe that writing takes no time, so that nothing limits its checkpoints."""
    monkeypatch.setattr(
        _RunInProgress, "_last_write", property(lambda _: 0.0, lambda _, seconds: None)
    )


@pytest.fixture
def path(tmp_path: Path) -> Path:
    """Where a run writes."""
    return tmp_path / "run.h5"

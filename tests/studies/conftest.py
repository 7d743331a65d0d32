"""Fixtures of studies: small chunks of passes, and checkpoints without a limit by the disk."""

from __future__ import annotations

from pathlib import Path

import pytest

from wearsim.evolution.steppers import per_pass
from wearsim.studies.run.in_progress import RunInProgress


@pytest.fixture
def small_chunks(monkeypatch: pytest.MonkeyPatch) -> None:
    """Reduce the chunks of the per-pass stepper, so that short tests can be stopped."""
    monkeypatch.setattr(per_pass, "CHUNK", 700)
    monkeypatch.setattr(per_pass, "SLOW_CHUNK", 20)


@pytest.fixture
def quick_disk(monkeypatch: pytest.MonkeyPatch) -> None:
    """Set the measured duration of writing to zero, so that it does not limit the checkpoints."""
    monkeypatch.setattr(
        RunInProgress, "_last_write", property(lambda _: 0.0, lambda _, seconds: None)
    )


@pytest.fixture
def path(tmp_path: Path) -> Path:
    """Results file of a run."""
    return tmp_path / "run.h5"

"""Fixtures of studies: small chunks of passes, and checkpoints without a limit by the disk."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.fixed_batches import batches_of
from wearsim.evolution.steppers import per_pass
from wearsim.studies.run import in_progress


@pytest.fixture
def small_chunks(monkeypatch: pytest.MonkeyPatch) -> None:
    """Reduce the chunks of the per-pass stepper, so that short tests can be stopped."""
    monkeypatch.setattr(per_pass, "CHUNK", 700)
    monkeypatch.setattr(per_pass, "SLOW_CHUNK", 20)


@pytest.fixture
def quick_disk(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let the duration of writing not limit the checkpoints."""
    monkeypatch.setattr(in_progress, "WRITING", math.inf)


@pytest.fixture(scope="module")
def large_batches() -> Iterator[None]:
    """Run 64 realisations in a batch, which costs as much as many realisations.

    The first batches are small otherwise, since they show how long a realisation takes.
    """
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("wearsim.studies.ensemble.driver.BatchSizes", batches_of(64))
        yield


@pytest.fixture
def path(tmp_path: Path) -> Path:
    """Results file of a run."""
    return tmp_path / "run.h5"

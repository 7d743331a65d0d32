"""Fixtures of lives: large batches of realisations."""

from __future__ import annotations

import pytest


@pytest.fixture(scope="module", autouse=True)
def batches(large_batches: None) -> None:
    """Run the realisations of all tests in large batches."""

"""Fixtures of ensembles: large batches of realisations, and few draws for control variates."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from wearsim.studies.ensemble import realisation


@pytest.fixture(scope="module", autouse=True)
def batches(large_batches: None) -> None:
    """Run the realisations of all tests in large batches."""


@pytest.fixture(scope="module", autouse=True)
def few_draws() -> Iterator[None]:
    """Take the mean of a control variate from 8192 draws."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(realisation.control_of, "__defaults__", (8192,))
        yield

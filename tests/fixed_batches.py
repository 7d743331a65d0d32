"""Batches of an ensemble of one size, in place of sizes that depend on the time."""

from __future__ import annotations

from wearsim.studies.ensemble.batch_sizes import BatchSizes


def batches_of(size: int) -> type[BatchSizes]:
    """Return a class of which `wearsim.studies.ensemble.driver` makes batches of this size."""

    class FixedSizes(BatchSizes):
        def next(self, left: int, workers: int) -> int:
            return size

    return FixedSizes

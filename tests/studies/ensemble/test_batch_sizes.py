"""Sizes of the batches of an ensemble, from the time that the batches before have taken."""

from __future__ import annotations

import math

from wearsim.studies.ensemble.batch_sizes import SECONDS, BatchSizes

START, EACH = 3.0, 0.05  # s: start of a worker, and a realisation


def batch_sizes(total: int, batches: int) -> list[int]:
    """Return the sizes of the first batches of an ensemble that one worker runs."""
    now = 0.0
    policy = BatchSizes(lambda: now)
    sizes: list[int] = []
    for number in range(batches):
        sizes.append(policy.next(total - sum(sizes), workers=1))
        now += sizes[-1] * EACH + (START if number == 0 else 0.0)
        policy.finished(sizes[-1])
    return sizes


def test_batches_grow_to_their_duration_despite_a_slow_start():
    assert batch_sizes(10_000, 6) == [1, 1, 4, 16, 64, round(SECONDS / EACH)]


def test_last_batches_are_small_so_that_all_workers_end_together():
    assert batch_sizes(12, 6) == [1, 1, 4, 3, 2, 1]


def test_time_left_does_not_include_the_start_of_a_worker():
    now = 0.0
    policy = BatchSizes(lambda: now)
    for duration in (START, EACH, EACH):
        assert math.isnan(policy.time_left(100))
        now += duration
        policy.finished(1)
    assert math.isclose(policy.time_left(100), 100 * EACH)
    assert math.isclose(policy.rate, 3 / now)

"""Sizes of the batches of an ensemble, from the time that the batches before have taken."""

from __future__ import annotations

import math

from wearsim.studies.ensemble.batch_sizes import LEAST_IN_BATCH, SECONDS, BatchSizes

START, EACH = 3.0, 0.05  # s: start of a worker, and a realisation


def batch_sizes(total: int, batches: int, workers: int = 1) -> list[int]:
    """Return the sizes of the first batches of an ensemble, which run one after the other."""
    now = 0.0
    policy = BatchSizes(lambda: now)
    sizes: list[int] = []
    for number in range(batches):
        sizes.append(policy.next(total - sum(sizes), workers))
        now += sizes[-1] * EACH + (START if number == 0 else 0.0)
        policy.finished(sizes[-1])
    return sizes


def test_batches_grow_to_their_duration_despite_a_slow_start():
    assert batch_sizes(10_000, 5) == [1, 1, 8, 64, round(SECONDS / EACH)]


def test_one_worker_takes_all_that_is_left():
    assert batch_sizes(14, 4) == [1, 1, 8, 4]


def test_several_workers_end_together_without_very_small_batches():
    assert batch_sizes(100, 8, workers=2) == [1, 1, 8, 23, 17, LEAST_IN_BATCH, LEAST_IN_BATCH, 9]


def test_time_left_does_not_include_the_start_of_a_worker():
    now = 0.0
    policy = BatchSizes(lambda: now)
    for duration in (START, EACH, EACH):
        assert math.isnan(policy.time_left(100))
        now += duration
        policy.finished(1)
    assert math.isclose(policy.time_left(100), 100 * EACH)
    assert math.isclose(policy.rate, 3 / now)

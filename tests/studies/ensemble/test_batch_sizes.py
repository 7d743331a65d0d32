"""Sizes of the batches of an ensemble, from the time that the batches before have taken."""

from __future__ import annotations

import heapq
import math

import pytest

from wearsim.studies.ensemble.batch_sizes import LEAST_IN_BATCH, SECONDS, BatchSizes

START, EACH = 3.0, 0.05  # s: start of a worker, and a realisation


def batch_sizes(total: int, workers: int = 1, slow: float = 1.0) -> tuple[list[int], list[float]]:
    """Return the sizes of all batches of an ensemble, and when each worker ends.

    The next batch starts before the end of the last one is noted, as with processes.

    Parameters
    ----------
    total, workers : int
    slow : float
        Duration of a realisation in one of the workers, over that in the others.
    """
    now, left, begun = 0.0, total, 0
    policy = BatchSizes(lambda: now)
    sizes: list[int] = []
    finished = 0
    running = [(0.0, worker, 0) for worker in range(workers)]
    ends = [0.0] * workers
    while running:
        now, worker, size = heapq.heappop(running)
        ends[worker] = now
        if workers == 1 and size:
            policy.finished(size)
            left -= size
        if begun < total:
            sizes.append(min(policy.next(left, workers), total - begun))
            begun += sizes[-1]
            policy.started(sizes[-1])
            duration = EACH * sizes[-1] * (slow if worker == 0 else 1.0)
            duration += START if finished < workers and len(sizes) <= workers else 0.0
            heapq.heappush(running, (now + duration, worker, sizes[-1]))
        if workers > 1 and size:
            policy.finished(size)
            left -= size
            finished += 1
    return sizes, ends


def test_batches_grow_to_their_duration_despite_a_slow_start():
    assert batch_sizes(10_000)[0][:5] == [1, 1, 32, round(SECONDS / EACH), round(SECONDS / EACH)]


def test_one_worker_takes_all_that_is_left():
    assert batch_sizes(44)[0] == [1, 1, 32, 10]


@pytest.mark.parametrize("slow", [1.0, 1.3])
@pytest.mark.parametrize("workers", [2, 3, 8])
@pytest.mark.parametrize("total", [100, 300, 1000, 5000])
def test_several_workers_end_together_with_few_batches(total, workers, slow):
    sizes, ends = batch_sizes(total, workers, slow)
    assert sum(sizes) == total
    assert max(ends) - min(ends) <= max(1.5 * LEAST_IN_BATCH * EACH * slow, 0.1 * max(ends))
    assert len(sizes) <= workers * (8 + EACH * total / workers / SECONDS * 1.4)


def test_batches_of_a_lost_worker_are_not_in_progress():
    now = 0.0
    policy = BatchSizes(lambda: now)
    for _ in range(2):
        policy.started(1)
        now += EACH
        policy.finished(1)
    policy.started(32)
    now += 32 * EACH  # a share without what is assumed to be done
    assert policy.next(40, 2) == LEAST_IN_BATCH
    policy.abandoned()
    assert policy.next(80, 2) == 30


def test_time_left_does_not_include_the_start_of_a_worker():
    now = 0.0
    policy = BatchSizes(lambda: now)
    for duration in (START, EACH, EACH):
        assert math.isnan(policy.time_left(100))
        now += duration
        policy.finished(1)
    assert math.isclose(policy.time_left(100), 100 * EACH)
    assert math.isclose(policy.rate, 3 / now)

"""Sizes of the batches of an ensemble, from the time that the batches before have taken."""

from __future__ import annotations

import math
import time
from collections import deque
from collections.abc import Callable

import numpy as np

SECONDS = 6.0  # duration of a batch; a test costs a third more in batches of 20 than of 40
GROWTH = 32  # greatest ratio of the size of a batch to the greatest before it
MOST_IN_BATCH = 256  # larger batches are not faster
LEAST_IN_BATCH = 16  # of those left, if they take less; a batch costs as much as seven tests more
# part of the realisations left per worker that a batch takes, as their durations are estimates
PART_OF_SHARE = 0.75
BATCHES = 3  # finished batches from which the time left is estimated,
RECENT = 8  # and the greatest number of them


class BatchSizes:
    """Sizes of the next batches, and the time that remains.

    Parameters
    ----------
    clock : callable
        Returns a time [s].

    Attributes
    ----------
    rate : float
        Realisations per second since the start.
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self.rate = 0.0
        self._clock, self._started = clock, clock()
        self._run = self._largest = 0
        # time and number of realisations after each of the last batches
        self._recent: deque[tuple[float, int]] = deque(maxlen=RECENT)
        # start and size of the batches in progress
        self._running: list[tuple[float, int]] = []

    def next(self, left: int, workers: int) -> int:
        """Return the batch size for `SECONDS`, limited so that several workers end together.

        The last batches give the rate: before the first ones the workers load the kernels,
        and a realisation takes longer in a small batch.

        Parameters
        ----------
        left : int
            Realisations that are not finished, those in progress included.
        workers : int
        """
        rate, now = self.rate, self._clock()
        if len(self._recent) > 1:
            (start, before), (end, run) = self._recent[0], self._recent[-1]
            rate = (run - before) / max(end - start, 1e-9)
        each = rate / workers
        # a batch that has just finished may be among those in progress
        done = sum(min(each * (now - start), size) for start, size in self._running[:workers])
        share = (left - done) / workers
        together = share if workers == 1 else max(PART_OF_SHARE * share, LEAST_IN_BATCH)
        most = max(min(math.ceil(together), MOST_IN_BATCH, GROWTH * self._largest), 1)
        return int(np.clip(SECONDS * each, 1, most))

    def started(self, count: int) -> None:
        """Note that a batch of realisations has started."""
        self._running.append((self._clock(), count))

    def abandoned(self) -> None:
        """Note that no batch is in progress any more."""
        self._running.clear()

    def finished(self, count: int) -> None:
        """Note that a batch of realisations has finished."""
        now = self._clock()
        for batch in self._running:
            if batch[1] == count:
                self._running.remove(batch)
                break
        self._run += count
        self._largest = max(self._largest, count)
        self._recent.append((now, self._run))
        self.rate = self._run / max(now - self._started, 1e-9)

    def time_left(self, left: int) -> float:
        """Return the time that realisations will take [s]; nan in the first batches."""
        if len(self._recent) < BATCHES:  # without the first one, which loads the kernels
            return math.nan
        (start, before), (end, run) = self._recent[0], self._recent[-1]
        return left * (end - start) / (run - before)

"""Who does the batches of a study: this process, threads, processes, or a Dask cluster."""

from __future__ import annotations

import operator
import os
import re
from collections.abc import Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from contextlib import contextmanager
from itertools import islice
from typing import Any

from wearsim.studies.execution.base import AHEAD, Batch, Executor, Results, Teller, Work

HERE = ("processes", "threads", "serial", "dask")

CLUSTER = re.compile(r"(tcp|tls)://[^/]+:\d+")
"""The address of a Dask scheduler."""


@contextmanager
def executor(
    scheduler: str = "processes", workers: int | None = None, *, tell: Teller | None = None
) -> Iterator[Executor]:
    """Provide who does the batches of a study.

    The results of a batch do not depend on it, only the time and the order do.

    Parameters
    ----------
    scheduler : str
        "processes" and "threads" of this process, "serial" (in it), "dask" (a cluster of its own
        on this machine), or the address of a Dask scheduler, "tcp://host:port".
    workers : int, optional
        How many; as many as there are processors for this process, if not given. Those of a
        running cluster are all used, and must not be given.
    tell : callable, optional
        Told what a user would want to know: a worker was lost, a cluster has no workers. Without
        it, a cluster that has no workers for a minute is an error.

    Raises
    ------
    TypeError, ValueError
        If the scheduler is none of these, or the number of workers is none.
    WorkerError
        If the cluster cannot be used: not there, not installed here, another version there.
    """
    check_scheduler(scheduler, workers)
    count = available_processors() if workers is None else operator.index(workers)
    if scheduler not in HERE[:3]:
        from wearsim.studies.execution.dask import cluster  # noqa: PLC0415  (slow to import)

        with cluster(None if scheduler == "dask" else scheduler, count, tell) as found:
            yield found
    elif scheduler == "serial" or count == 1:
        yield InProcess()
    elif scheduler == "threads":
        yield Threads(count)
    else:
        from wearsim.studies.execution.processes import Processes  # noqa: PLC0415  (seldom used)

        yield Processes(count, tell)


def check_scheduler(scheduler: str, workers: int | None = None) -> None:
    """Raise unless `executor` takes these arguments, whose meanings are given there.

    Raises
    ------
    TypeError, ValueError
        If it does not.
    """
    remote = CLUSTER.fullmatch(scheduler) is not None
    if scheduler not in HERE and not remote:
        raise ValueError(
            f"there is no scheduler '{scheduler}', expected {', '.join(HERE)}, or the address of"
            " a Dask scheduler such as tcp://host:8786"
        )
    if workers is None:
        return
    try:
        count = operator.index(workers)
    except TypeError:
        raise TypeError(f"workers must be a whole number such as 4, got {workers!r}") from None
    if count < 1:
        raise ValueError(f"workers must be 1 or more, got {count}")
    if remote:
        raise ValueError(f"the workers of {scheduler} are all used; leave out the number {count}")
    if scheduler == "serial" and count > 1:
        raise ValueError(
            f"there is one worker where the scheduler is 'serial', got {count}; use processes"
        )


def available_processors() -> int:
    """Return how many processors this process may use, which can be fewer than there are."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


class InProcess:
    """Does batches itself, one after the other."""

    workers = 1
    describe = "1 process"

    def results(self, work: Work, batches: Iterator[Batch]) -> Results:
        """Yield every batch with its results, as `Executor.results` says."""
        for numbers in batches:
            yield numbers, work(numbers)


class Threads:
    """Has batches done by threads, of use as far as the work releases Python's lock.

    A thread cannot be ended: Python waits at its exit for the batches that threads are doing.

    Parameters
    ----------
    workers : int
    """

    def __init__(self, workers: int) -> None:
        self.workers = workers
        self.describe = f"{workers} threads"

    def results(self, work: Work, batches: Iterator[Batch]) -> Results:
        """Yield every batch with its results, as `Executor.results` says."""
        pool = ThreadPoolExecutor(self.workers, thread_name_prefix="wearsim")
        out: dict[Future[list[Any]], Batch] = {}
        try:
            while True:
                for numbers in islice(batches, AHEAD * self.workers - len(out)):
                    out[pool.submit(work, numbers)] = numbers
                if not out:
                    return
                future = next(iter(wait(out, return_when=FIRST_COMPLETED).done))
                yield out.pop(future), future.result()
        finally:
            pool.shutdown(wait=False, cancel_futures=True)

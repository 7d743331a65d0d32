"""Execution of batches on this machine, and the interface of executors.

Each worker process is a loky executor with a single process and a single batch in progress, so that
the death of a process identifies its batch and fails no other batch.
"""

from __future__ import annotations

import multiprocessing
import os
import pickle
import signal
import sys
import traceback
from collections import Counter
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from contextlib import contextmanager, suppress
from functools import lru_cache
from itertools import islice
from multiprocessing import resource_tracker
from multiprocessing.connection import Connection
from threading import Thread
from typing import Any, Protocol, TypeAlias

from wearsim.errors import WorkerError

# function of realisation numbers that returns one result per number; pickled for other processes
Work: TypeAlias = Callable[[Sequence[int]], list[Any]]
Batch: TypeAlias = Sequence[int]
Results: TypeAlias = Generator[tuple[Batch, list[Any]], None, None]
# results of a batch, or the error raised by the work
Answer: TypeAlias = tuple[list[Any], Exception | None]
Notify: TypeAlias = Callable[[str], None]

AHEAD = 2  # maximum number of batches taken per worker and not yet returned
DEATHS = 3  # worker processes that may die while running a batch before the study fails
ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
# by default loky replaces a process that grows by 0.3 GB, as batches of many realisations may do
_ENVIRONMENT = {**ONE_THREAD, "LOKY_MAX_MEMORY_LEAK_SIZE": "1e18"}


class Executor(Protocol):
    """Interface of executors of batches."""

    @property
    def workers(self) -> int:
        """Number of batches run at the same time."""

    @property
    def describe(self) -> str:
        """Description of the workers, such as "2 processes"."""

    def results(self, work: Work, batches: Iterator[Batch]) -> Results:
        """Yield every batch with its results, in the order in which they finish.

        At most `AHEAD` batches per worker are taken before their results are requested.
        Closing the generator, or an error in it, abandons the batches in progress.

        Parameters
        ----------
        work : callable
        batches : iterator of sequence of int

        Raises
        ------
        WorkerError
            If workers die repeatedly or have another version.
        Exception
            Any error raised by `work`.
        """


def named(numbers: Batch) -> str:
    """Return a description of a batch for messages: "realisations 4 to 7"."""
    first, last, count = min(numbers), max(numbers), len(numbers)
    if count == 1:
        return f"realisation {first}"
    prefix = "realisations" if last - first + 1 == count else f"{count} realisations from"
    return f"{prefix} {first} to {last}"


class InProcess:
    """Execution in the calling process, one batch after the other."""

    workers = 1
    describe = "1 process"

    def results(self, work: Work, batches: Iterator[Batch]) -> Results:
        """Yield every batch with its results, as `Executor.results`."""
        for numbers in batches:
            yield numbers, work(numbers)


class Threads:
    """Execution by threads, faster only as far as the work releases Python's global lock.

    A thread cannot be stopped: Python waits at exit for the batches in progress.

    Parameters
    ----------
    workers : int
    """

    def __init__(self, workers: int) -> None:
        self.workers = workers
        self.describe = f"{workers} threads"

    def results(self, work: Work, batches: Iterator[Batch]) -> Results:
        """Yield every batch with its results, as `Executor.results`."""
        pool = ThreadPoolExecutor(self.workers, thread_name_prefix="wearsim")
        running: dict[Future[list[Any]], Batch] = {}
        try:
            while True:
                for numbers in islice(batches, AHEAD * self.workers - len(running)):
                    running[pool.submit(work, numbers)] = numbers
                if not running:
                    return
                future = next(iter(wait(running, return_when=FIRST_COMPLETED).done))
                yield running.pop(future), future.result()
        finally:
            pool.shutdown(wait=False, cancel_futures=True)


class Processes:
    """Execution by processes of this machine.

    Parameters
    ----------
    workers : int
    on_notice : callable, optional
        Called with a message when a process died.
    """

    def __init__(self, workers: int, on_notice: Notify | None = None) -> None:
        self.workers = workers
        self.describe = f"{workers} processes"
        self._on_notice = on_notice or (lambda message: None)
        self._parent_end, self._kept_open = multiprocessing.Pipe(duplex=False)
        # started at once, while the study is prepared
        self._idle = [_Worker(self._parent_end) for _ in range(workers)]

    def close(self) -> None:
        """Kill the processes."""
        self._kept_open.close()
        self._parent_end.close()
        for worker in self._idle:
            worker.end()

    def results(self, work: Work, batches: Iterator[Batch]) -> Results:
        """Yield every batch with its results, as `Executor.results`."""
        import cloudpickle  # noqa: PLC0415  (used with processes only)
        from loky import BrokenProcessPool  # noqa: PLC0415  (used with processes only)

        pickled = cloudpickle.dumps(work)
        repeated: list[Batch] = []
        deaths: Counter[tuple[int, ...]] = Counter()
        running: dict[Future[Answer], _Worker] = {}
        finished: list[tuple[Batch, list[Any]]] = []
        try:
            while True:
                while len(running) < self.workers:
                    numbers = repeated.pop() if repeated else next(batches, None)
                    if numbers is None:
                        break
                    worker = self._idle.pop() if self._idle else _Worker(self._parent_end)
                    running[worker.submit(pickled, numbers)] = worker
                yield from finished  # after the next batches, which run meanwhile
                finished.clear()
                if not running:
                    return
                future = next(iter(wait(running, return_when=FIRST_COMPLETED).done))
                worker = running.pop(future)
                try:
                    results, error = future.result()
                except BrokenProcessPool:
                    worker.end()
                    repeated.append(worker.numbers)
                    deaths[tuple(worker.numbers)] += 1
                    self._report_death(worker, deaths[tuple(worker.numbers)])
                    continue
                self._idle.append(worker)
                if error is not None:
                    raise error
                finished.append((worker.numbers, results))
        finally:
            for worker in running.values():
                worker.end()

    def _report_death(self, worker: _Worker, deaths: int) -> None:
        """Notify that a batch will be repeated, or raise if it failed too often."""
        # the exit code in the message of loky is missing on a loaded machine
        code = worker.process.exitcode
        cause = f"ended with exit code {code}"
        if code < 0:
            cause = f"was killed by {signal.Signals(-code).name}"
            cause += " (out of memory?)" if cause.endswith("SIGKILL") else ""
        if deaths < DEATHS:
            self._on_notice(f"a worker process {cause}; {named(worker.numbers)} will be done again")
        elif worker.started.exception() is not None:
            raise WorkerError(f"{DEATHS} worker processes ended as they started, the last {cause}")
        else:
            raise WorkerError(
                f"{DEATHS} worker processes died of {named(worker.numbers)}, the last {cause};"
                " fewer workers leave more memory for each",
                worker.numbers,
            )


class _Worker:
    """A process with one batch in progress.

    Parameters
    ----------
    parent_end : Connection
        Pipe that closes when the parent process ends.
    """

    numbers: Batch

    def __init__(self, parent_end: Connection) -> None:
        from loky import ProcessPoolExecutor  # noqa: PLC0415  (used with processes only)

        self._pool = ProcessPoolExecutor(
            1, initializer=_initialise, initargs=(parent_end,), env=_ENVIRONMENT
        )
        with sigint_blocked():
            self.started = self._pool.submit(os.getpid)
        (self.process,) = self._pool._processes.values()
        # otherwise loky waits for ever for the rest of a message whose sender was killed
        self._pool._result_queue._writer.close()

    def submit(self, pickled: bytes, numbers: Batch) -> Future[Answer]:
        """Start a batch and return the future of its `Answer`."""
        self.numbers = numbers
        future: Future[Answer] = self._pool.submit(run_batch, pickled, numbers)
        return future

    def end(self) -> None:
        """Kill the process."""
        self._pool.shutdown(kill_workers=True)


def _initialise(parent_end: Connection) -> None:
    """Prepare a worker process: ignore Ctrl-C, and end with the parent process."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    Thread(target=_end_with_parent, args=(parent_end,), daemon=True).start()


def _end_with_parent(parent_end: Connection) -> None:
    with suppress(EOFError, OSError):
        parent_end.recv()
    os._exit(0)


def run_batch(pickled: bytes, numbers: Batch) -> Answer:
    """Run a batch in a worker process, which unpickles the work once.

    An error is returned in a form that the parent process can unpickle.
    """
    try:
        return _unpickled(pickled)(numbers), None
    except Exception as error:
        error.add_note(f"in a worker:\n{''.join(traceback.format_exception(error))}")
        try:
            pickle.loads(pickle.dumps(error))
        except Exception:
            return [], WorkerError(f"{type(error).__name__}: {error}")
        return [], error


@lru_cache(maxsize=1)
def _unpickled(pickled: bytes) -> Work:
    work: Work = pickle.loads(pickled)
    return work


@contextmanager
def sigint_blocked() -> Iterator[None]:
    """Start processes that do not receive Ctrl-C; the parent process ends them."""
    if sys.platform == "win32":
        yield
        return
    resource_tracker.ensure_running()  # unblocks signals when it starts
    blocked = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, blocked)

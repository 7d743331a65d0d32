"""Execution of batches on this machine, and the interface of executors."""

from __future__ import annotations

import multiprocessing
import os
import pickle
import shutil
import signal
import sys
import traceback
from collections import Counter
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Future, ThreadPoolExecutor, wait
from contextlib import contextmanager, suppress
from functools import lru_cache
from importlib import import_module
from itertools import chain, islice
from multiprocessing import resource_tracker
from multiprocessing.connection import Connection
from pathlib import Path
from tempfile import NamedTemporaryFile, TemporaryDirectory
from threading import Thread
from typing import Any, Protocol, TypeAlias

from wearsim.errors import WorkerError
from wearsim.operating_system import end_of_process, interrupts_blocked

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
        self.workers, self.describe = workers, f"{workers} threads"

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

    Every process is a loky executor with one process and one batch in progress, so that the end of
    a process identifies its batch and fails no other batch. Messages between processes are short
    enough to be written to a pipe in one piece, since loky waits for ever for the rest of a message
    whose sender was killed. The work and its results are files in a temporary folder, which the
    worker processes remove if this process is killed.

    Parameters
    ----------
    workers : int
    on_notice : callable, optional
        Called with a message when a process ended unexpectedly.
    preload : str
        Modules that the processes import as they start, separated by spaces.
    """

    def __init__(
        self, workers: int, on_notice: Notify | None = None, preload: str = "wearsim"
    ) -> None:
        self.workers, self.describe, self._preload = workers, f"{workers} processes", preload
        self._on_notice = on_notice or (lambda message: None)
        self._folder = TemporaryDirectory(prefix="wearsim-", ignore_cleanup_errors=True)
        self._parent_end, self._kept_open = multiprocessing.Pipe(duplex=False)
        # started at once, while the study is prepared
        self._idle = [self._new_worker() for _ in range(workers)]

    def _new_worker(self) -> _Worker:
        return _Worker(self._parent_end, self._folder.name, self._preload)

    def close(self) -> None:
        """Kill the processes and remove the temporary folder."""
        for worker in self._idle:
            worker.end()
        self._kept_open.close()
        self._folder.cleanup()

    def results(self, work: Work, batches: Iterator[Batch]) -> Results:
        """Yield every batch with its results, as `Executor.results`."""
        file = _store(work, self._folder.name)
        deaths: Counter[Batch] = Counter()
        running: dict[Future[str], _Worker] = {}
        finished: list[tuple[Batch, list[Any]]] = []
        try:
            while True:
                for numbers in islice(batches, self.workers - len(running)):
                    worker = self._idle.pop() if self._idle else self._new_worker()
                    running[worker.submit(file, numbers)] = worker
                yield from finished  # after the next batches, which run meanwhile
                if not running:
                    return
                future = next(iter(wait(running, return_when=FIRST_COMPLETED).done))
                worker = running.pop(future)
                self._idle.append(worker)
                try:
                    file_of_answer = future.result()
                except BrokenExecutor:
                    self._idle.pop().end()
                    deaths[tuple(worker.numbers)] += 1
                    self._report_death(worker, deaths[tuple(worker.numbers)])
                    batches, finished = chain([worker.numbers], batches), []
                    continue
                results, error = _load(file_of_answer)
                Path(file_of_answer).unlink()
                if error is not None:
                    raise error
                finished = [(worker.numbers, results)]
        finally:
            for worker in running.values():
                worker.end()

    def _report_death(self, worker: _Worker, deaths: int) -> None:
        """Notify that a batch will be repeated, or raise if it failed too often."""
        cause = worker.cause_of_death()
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
    folder : str
        Temporary folder of the study.
    preload : str
        Modules that the process imports as it starts, separated by spaces.
    """

    numbers: Batch

    def __init__(self, parent_end: Connection, folder: str, preload: str) -> None:
        from loky import ProcessPoolExecutor  # noqa: PLC0415  (used with processes only)

        self._pool = ProcessPoolExecutor(
            1, initializer=_initialise, initargs=(parent_end, folder, preload), env=_ENVIRONMENT
        )
        others = multiprocessing.active_children()
        with sigint_blocked():
            self.started = self._pool.submit(os.getpid)
        self._processes = [p for p in multiprocessing.active_children() if p not in others]

    def submit(self, work: str, numbers: Batch) -> Future[str]:
        """Start a batch and return the future of the file with its `Answer`."""
        self.numbers = numbers
        future: Future[str] = Future()
        try:
            future = self._pool.submit(_run_stored, work, numbers)
        except BrokenExecutor as error:  # the process ended after its last batch
            future.set_exception(error)
        return future

    def cause_of_death(self) -> str:
        """Return how the process ended, as a predicate: "was killed by SIGKILL"."""
        return end_of_process(next((process.exitcode for process in self._processes), None))

    def end(self) -> None:
        """Kill the process."""
        self._pool.shutdown(kill_workers=True)


def _initialise(parent_end: Connection, folder: str, preload: str) -> None:
    """Prepare a worker process: ignore Ctrl-C, end with the parent process, and import modules."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    Thread(target=_end_with_parent, args=(parent_end, folder), daemon=True).start()
    for module in preload.split():
        import_module(module)


def _end_with_parent(parent_end: Connection, folder: str) -> None:
    with suppress(EOFError, OSError):
        parent_end.recv()
    shutil.rmtree(folder, ignore_errors=True)
    os._exit(0)


def _run_stored(file: str, numbers: Batch) -> str:
    """Run a batch in a worker process, and return the file with its `Answer`."""

    def work(numbers: Batch) -> list[Any]:
        return _load_work(file)(numbers)

    return _store(run_batch(work, numbers), str(Path(file).parent))


def _store(content: object, folder: str) -> str:
    """Write an object to a new file in a folder, and return its path."""
    import cloudpickle  # noqa: PLC0415  (used with processes only)

    try:
        with NamedTemporaryFile(dir=folder, delete=False) as stream:
            cloudpickle.dump(content, stream)
    except OSError as error:
        raise WorkerError(f"batches cannot be exchanged through {folder}: {error}") from error
    return stream.name


def _load(file: str) -> Any:
    with Path(file).open("rb") as stream:
        return pickle.load(stream)


_load_work: Callable[[str], Work] = lru_cache(maxsize=1)(_load)


def run_batch(work: Work, numbers: Batch) -> Answer:
    """Run a batch in a worker, and return an error in a form that can be unpickled."""
    try:
        return work(numbers), None
    except SystemExit as error:  # otherwise it would end the study, or the worker
        return [], WorkerError(f"{named(numbers)} called sys.exit({error.code!r})", numbers)
    except Exception as error:
        error.add_note(f"in a worker:\n{''.join(traceback.format_exception(error))}")
        try:
            pickle.loads(pickle.dumps(error))
        except Exception:
            return [], WorkerError(f"{type(error).__name__}: {error}")
        return [], error


@contextmanager
def sigint_blocked() -> Iterator[None]:
    """Start processes that do not receive Ctrl-C; the parent process ends them."""
    if sys.platform != "win32":
        resource_tracker.ensure_running()  # unblocks signals when it starts
    with interrupts_blocked():
        yield

"""Execution of batches by a Dask cluster, whose workers may join, leave and die."""

from __future__ import annotations

import asyncio
import inspect
import logging
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, contextmanager, suppress
from importlib.metadata import PackageNotFoundError, version
from itertools import islice
from tempfile import TemporaryDirectory
from types import FrameType

import cloudpickle
import dask
from distributed import Client, Future, KilledWorker, LocalCluster, Security, as_completed
from distributed.client import ClosedClientError
from distributed.comm.core import connect

from wearsim.errors import Interrupted, WorkerError
from wearsim.studies.execution.processes import (
    AHEAD,
    Answer,
    Batch,
    Notify,
    Results,
    Work,
    named,
    run_batch,
    sigint_blocked,
)

LOOKING = 2.0  # s between two checks of the number of workers
POLLING = 0.05  # s between two checks for finished batches
PATIENCE = 60.0  # s after which a cluster without workers is an error, if there are no notices
CONNECTING = 10.0  # s, time limit for the connection to a scheduler


class Cluster:
    """Execution by the current workers of a Dask cluster.

    Dask repeats the batches of a lost worker, by default three times; a notice names the worker.

    Parameters
    ----------
    client : Client
    address : str
        Address of the scheduler.
    on_notice : callable, optional
        Called with a message when a worker was lost, or the cluster has no workers.
    stop_requested : callable
        Called while the cluster has no workers; True stops the study.
    """

    def __init__(
        self,
        client: Client,
        address: str,
        on_notice: Notify | None,
        stop_requested: Callable[[], bool],
    ) -> None:
        self._client, self._address = client, address
        self._on_notice, self._stop_requested = on_notice, stop_requested
        self._threads, self._checked_at = 1, -LOOKING
        self._present: set[str] = set()
        self._had_workers_at = time.monotonic()

    @property
    def workers(self) -> int:
        """Current number of batches run at the same time."""
        if time.monotonic() - self._checked_at > LOOKING:
            self._count_workers()
        return self._threads

    @property
    def describe(self) -> str:
        """Address of the scheduler and number of workers."""
        count = self.workers
        return f"dask {self._address}, {count} worker{'s' if count != 1 else ''}"

    def check_versions(self) -> None:
        """Wait for a worker, and raise if a worker has another version of wearsim."""
        while not self.workers:
            if self._stop_requested():
                raise Interrupted(f"stopped: there are no workers at {self._address}")
            time.sleep(POLLING)
        for where, theirs in self._client.run(version, "wearsim", on_error="return").items():
            if isinstance(theirs, str | PackageNotFoundError):  # otherwise the worker was lost
                _check_version(theirs if isinstance(theirs, str) else "none", where)

    def results(self, work: Work, batches: Iterator[Batch]) -> Results:
        """Yield every batch with its results, as `Executor.results`."""
        # a task, not scattered data: it runs again if all workers that had its result are lost
        sent = self._client.submit(cloudpickle.loads, cloudpickle.dumps(work), pure=False)
        ours = version("wearsim")
        running: dict[Future[Answer], Batch] = {}
        completed = as_completed(loop=self._client.loop, with_results=True, raise_errors=False)
        try:
            while True:
                free = AHEAD * max(self.workers, 1) - len(running)
                for numbers in islice(batches, max(free, 0)):
                    future = self._client.submit(_run_batch, sent, numbers, ours, pure=False)
                    running[future] = numbers
                    completed.add(future)
                if not running:
                    return
                while not completed.has_ready():
                    if not self.workers and self._stop_requested():
                        raise KeyboardInterrupt
                    time.sleep(POLLING)
                future, answer = next(completed)
                # the status of the future may have changed since, with the loss of a worker
                if not (isinstance(answer, tuple) and isinstance(answer[0], list)):
                    raise self._failure(running[future], answer)
                results, error = answer
                if error is not None:
                    raise error
                yield running.pop(future), results
        except ClosedClientError as error:
            raise self._unreachable() from error
        finally:
            if self._client.status == "running":
                with suppress(OSError, TimeoutError, ClosedClientError):
                    self._client.cancel([sent, *running])

    def _failure(self, numbers: Batch, cause: object) -> WorkerError:
        """Return the error of a batch that was cancelled or failed outside the work."""
        if not isinstance(cause, tuple):
            return self._unreachable()
        _, error, _ = cause
        if isinstance(error, WorkerError):
            return error
        if isinstance(error, KilledWorker):
            return WorkerError(
                f"workers of {self._address} died of {named(numbers)} again and again;"
                " more memory for each may help",
                numbers,
            )
        return WorkerError(
            f"a worker of {self._address} could not run {named(numbers)}:"
            f" {type(error).__name__}: {error}"
        )

    def _unreachable(self) -> WorkerError:
        return WorkerError(
            f"the scheduler at {self._address} is gone; the finished realisations are stored:"
            " start a scheduler and resume the study"
        )

    def _count_workers(self) -> None:
        """Count the workers; give a notice of those that were lost, and if there are none.

        Raises
        ------
        WorkerError
            If there were none for too long without a receiver of notices, or the scheduler ended.
        """
        before = self._threads
        try:
            threads = self._client.nthreads()
        except Exception as error:
            # the client tries to reconnect for some time, then it closes
            if self._client.status not in {"running", "connecting"}:
                raise self._unreachable() from error
            return
        self._checked_at = now = time.monotonic()
        self._threads, lost = sum(threads.values()), sorted(self._present - set(threads))
        self._present = set(threads)
        if self._threads:
            self._had_workers_at = now
            if lost and self._on_notice is not None:
                self._on_notice(
                    f"lost {'workers' if len(lost) > 1 else 'worker'} {', '.join(lost)}, and"
                    f" {len(threads)} {'are' if len(threads) > 1 else 'is'} left; unfinished"
                    " batches are done again"
                )
        elif self._on_notice is not None and before:
            self._on_notice(f"waiting for workers: there are none at {self._address}")
        elif self._on_notice is None and now - self._had_workers_at > PATIENCE:
            raise WorkerError(
                f"the scheduler at {self._address} has had no workers for {PATIENCE:g} s; start"
                f" some with: dask worker {self._address}"
            )


def _run_batch(work: Work, numbers: Batch, ours: str) -> Answer:
    """Run a batch on a worker, which may have joined after the check of the versions."""
    _check_version(version("wearsim"), "that runs it", ours)
    return run_batch(work, numbers)


def _check_version(theirs: str, where: str, ours: str | None = None) -> None:
    ours = ours or version("wearsim")
    if theirs != ours:
        raise WorkerError(
            f"wearsim {ours} is here, and {theirs} on the worker {where}; results of both cannot be"
            " mixed: install the same on all"
        )


@contextmanager
def cluster(
    address: str | None,
    count: int,
    on_notice: Notify | None,
    stop_requested: Callable[[], bool],
) -> Iterator[Cluster]:
    """Provide the workers of a Dask cluster.

    Parameters
    ----------
    address : str, optional
        Address of the scheduler; without it a temporary cluster of `count` processes is started.
    count : int
    on_notice : callable, optional
        Called with a message when the cluster has no workers.
    stop_requested : callable
        Called while the cluster has no workers; True stops the study.

    Raises
    ------
    WorkerError
        If the scheduler is unreachable, or a worker has another version of wearsim.
    Interrupted
        If a stop was requested before the cluster had workers.
    """
    with ExitStack() as stack:
        if address is None:
            folder = stack.enter_context(TemporaryDirectory(prefix="wearsim-dask-"))
            stack.enter_context(dask.config.set({"temporary-directory": folder}))
            address = stack.enter_context(_local_cluster(count)).scheduler_address
        for name in ("distributed.client", "distributed.batched", "tornado.application"):
            log = logging.getLogger(name)  # repeats with tracebacks what is raised as an error here
            stack.callback(log.setLevel, log.level)
            log.setLevel(logging.CRITICAL + 1)
        cluster_of_client = Cluster(
            stack.enter_context(_connected(address)), address, on_notice, stop_requested
        )
        cluster_of_client.check_versions()
        yield cluster_of_client


def _local_cluster(count: int) -> LocalCluster:
    if any(frame.f_globals.get("__name__") == "__mp_main__" for frame in _imports_above()):
        # a worker imports a script without guard, and would start another cluster: it ends
        # without a traceback, and the process that the user started raises the error
        raise SystemExit(1)
    try:
        with sigint_blocked():
            return LocalCluster(
                n_workers=count,
                threads_per_worker=1,
                processes=True,
                # no dashboard; the remaining HTTP server is local, at any free port
                scheduler_kwargs={"dashboard": False, "dashboard_address": "127.0.0.1:0"},
                memory_limit=0,  # a limit would end realisations that fit into the whole memory
                silence_logs=logging.CRITICAL,
            )
    except RuntimeError as error:
        cause = str(error).splitlines()[0]
        raise WorkerError(
            f"no Dask cluster could be started here ({cause}); a script must run its study under"
            ' `if __name__ == "__main__":` and cannot be read from standard input'
        ) from None  # its causes have a hundred lines and no other information


def _imports_above() -> Iterator[FrameType]:
    """Yield the frames of modules that are being imported."""
    frame = inspect.currentframe()
    while frame is not None:
        if frame.f_code.co_name == "<module>":
            yield frame
        frame = frame.f_back


def _connected(address: str) -> Client:
    try:
        with ThreadPoolExecutor(1) as thread:  # a notebook runs an event loop in this one
            thread.submit(asyncio.run, _check_answer(address)).result()
        return Client(address, timeout=CONNECTING, set_as_default=False, name="wearsim")
    except Exception as error:
        cause = next(iter(str(error).splitlines()), "no answer")
        raise WorkerError(
            f"no Dask scheduler answers at {address} within {CONNECTING:g} s: {cause}"
        ) from error


async def _check_answer(address: str) -> None:
    """Connect once; a `Client` waits for ever for a server that is not a scheduler."""
    arguments = Security().get_connection_args("client")
    comm = await asyncio.wait_for(connect(address, timeout=CONNECTING, **arguments), CONNECTING)
    await comm.close()

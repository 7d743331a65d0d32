"""Batches done by the workers of a Dask cluster, which may come, go and die meanwhile."""

from __future__ import annotations

import asyncio
import logging
import pickle
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, contextmanager, suppress
from importlib.metadata import PackageNotFoundError, version
from itertools import islice
from queue import Empty, SimpleQueue
from typing import TYPE_CHECKING

from wearsim.errors import WorkerError
from wearsim.studies.execution.base import AHEAD, GUARDED, Batch, Results, Teller, Work, named
from wearsim.studies.execution.processes import Answer, answer, starting_workers

if TYPE_CHECKING:
    from distributed import Client, Future, LocalCluster


LOOKING = 2.0
"""Time between two looks at who is there [s]."""

PATIENCE = 60.0
"""How long a cluster may be without workers where nobody can be told [s]."""


class Cluster:
    """Has batches done by the workers of a Dask cluster, as many as it has at the time.

    Dask does again what a worker was doing that is lost, thrice unless it is set otherwise.

    Parameters
    ----------
    client : Client
    address : str
        Of the scheduler.
    tell : callable, optional
        Told when the cluster has no workers.
    """

    def __init__(self, client: Client, address: str, tell: Teller | None) -> None:
        self._client, self._address, self._tell = client, address, tell
        self._threads, self._looked = 0, -LOOKING
        self._lacking_since: float | None = None

    @property
    def workers(self) -> int:
        """How many batches the cluster does at the same time, as it is now."""
        if time.monotonic() - self._looked > LOOKING:
            self._look()
        return self._threads

    @property
    def describe(self) -> str:
        """Where the cluster is, and how large."""
        count = self.workers
        return f"dask {self._address}, {count} worker{'s' if count != 1 else ''}"

    def check_versions(self) -> None:
        """Wait for a worker, and raise unless all that are there have this wearsim."""
        while not self.workers:
            time.sleep(min(LOOKING, 0.1))
        found = self._client.run(version, "wearsim", on_error="return")
        for where, theirs in found.items():
            if isinstance(theirs, PackageNotFoundError):
                theirs = "none"  # noqa: PLW2901
            if isinstance(theirs, str):  # else it was lost meanwhile
                _check_version(theirs, version("wearsim"), where)

    def results(self, work: Work, batches: Iterator[Batch]) -> Results:
        """Yield every batch with its results, as `Executor.results` says."""
        from distributed.client import ClosedClientError  # noqa: PLC0415  (slow to import)

        # a task, and not scattered data: it is made again where all who had it are gone
        unpickled = self._client.submit(pickle.loads, pickle.dumps(work), pure=False)
        ours = version("wearsim")
        out: dict[Future[Answer], Batch] = {}
        done: SimpleQueue[Future[Answer]] = SimpleQueue()
        try:
            while True:
                for numbers in islice(batches, max(AHEAD * max(self.workers, 1) - len(out), 0)):
                    future = self._client.submit(_do, unpickled, numbers, ours, pure=False)
                    future.add_done_callback(done.put)
                    out[future] = numbers
                if not out:
                    return
                future = self._next(done)
                results, error = self._fetched(future, out[future])
                if error is not None:
                    raise error
                yield out.pop(future), results
        except ClosedClientError as error:
            raise self._gone() from error
        finally:
            if self._client.status == "running":
                with suppress(OSError, TimeoutError, ClosedClientError):
                    self._client.cancel([unpickled, *out])

    def _next(self, done: SimpleQueue[Future[Answer]]) -> Future[Answer]:
        while True:
            try:
                return done.get(timeout=LOOKING)
            except Empty:
                self._look()

    def _fetched(self, future: Future[Answer], numbers: Batch) -> Answer:
        from distributed import CancelledError, KilledWorker  # noqa: PLC0415  (slow to import)

        patience = LOOKING
        while True:
            try:
                found: Answer = future.result(timeout=patience)
            except KilledWorker as error:
                raise WorkerError(
                    f"workers of {self._address} died of {named(numbers)} again and again;"
                    " more memory for each may help",
                    numbers,
                ) from error
            except CancelledError as error:
                raise self._gone() from error
            except Exception as error:
                if future.status == "error":
                    raise WorkerError(
                        f"a worker of {self._address} could not do {named(numbers)}:"
                        f" {type(error).__name__}: {error}"
                    ) from error
                # they are long, or who had them is gone and they are made again
                patience *= 2.0
                time.sleep(0.1)
                self._look()
            else:
                return found

    def _gone(self) -> WorkerError:
        return WorkerError(f"the scheduler at {self._address} is gone")

    def _look(self) -> None:
        """See how many workers there are, and tell if there are none.

        Raises
        ------
        WorkerError
            If there have been none for too long, and nobody can be told; or if the scheduler is
            gone.
        """
        try:
            self._threads = sum(self._client.nthreads().values())
        except Exception as error:
            # the client tries to connect again for a while, then closes
            if self._client.status not in {"running", "connecting"}:
                raise self._gone() from error
            return
        self._looked = now = time.monotonic()
        if self._threads:
            self._lacking_since = None
            return
        if self._lacking_since is None:
            self._lacking_since = now
            if self._tell is not None:
                self._tell(f"waiting for workers: there are none at {self._address}")
        elif self._tell is None and now - self._lacking_since > PATIENCE:
            raise WorkerError(
                f"the scheduler at {self._address} has had no workers for {PATIENCE:g} s; start"
                f" some with: dask worker {self._address}"
            )


def _do(work: Work, numbers: Batch, ours: str) -> Answer:
    """Do a batch on a worker, if its wearsim is ours; it may have joined after the check."""
    try:
        _check_version(version("wearsim"), ours, "it")
    except WorkerError as error:
        return [], error
    return answer(work, numbers)


def _check_version(theirs: str, ours: str, where: str) -> None:
    if theirs != ours:
        raise WorkerError(
            f"wearsim {ours} is here, and {theirs} on the worker {where}; results of both cannot be"
            " mixed: install the same on all"
        )


CONNECTING = 10.0
"""Time for a scheduler to answer [s]."""


@contextmanager
def cluster(address: str | None, count: int, tell: Teller | None) -> Iterator[Cluster]:
    """Provide the workers of a Dask cluster.

    Parameters
    ----------
    address : str, optional
        Of its scheduler; without it, a cluster of `count` processes lives here meanwhile.
    count : int
    tell : callable, optional
        Told when the cluster has no workers.

    Raises
    ------
    WorkerError
        If there is no such scheduler, Dask is not installed, or another wearsim is on the workers.
    """
    try:
        import distributed  # noqa: F401, PLC0415  (slow to import, and only an extra)
    except ImportError as error:
        raise WorkerError(
            f'Dask is not installed ({error}); install it with: pip install "wearsim[cluster]"'
        ) from error
    with ExitStack() as stack:
        if address is None:
            address = stack.enter_context(_own(count)).scheduler_address
        client = stack.enter_context(_connected(address))
        found = Cluster(client, address, tell)
        found.check_versions()
        yield found


def _own(count: int) -> LocalCluster:
    from distributed import LocalCluster  # noqa: PLC0415  (slow to import)

    try:
        with starting_workers():
            return LocalCluster(
                n_workers=count,
                threads_per_worker=1,
                processes=True,
                # no dashboard; what else it serves by HTTP is for this machine alone, at any port
                scheduler_kwargs={"dashboard": False, "dashboard_address": "127.0.0.1:0"},
                memory_limit=0,  # a share of the memory each would end members that fit
                silence_logs=logging.CRITICAL,
            )
    except RuntimeError as error:
        cause = str(error).splitlines()[0]
        raise WorkerError(f"no Dask cluster could be started here ({cause}); {GUARDED}") from error


def _connected(address: str) -> Client:
    from distributed import Client  # noqa: PLC0415  (slow to import)

    try:
        # in a thread, since a notebook runs an event loop in this one
        with ThreadPoolExecutor(1) as thread:
            thread.submit(asyncio.run, _greeted(address)).result()
        return Client(address, timeout=CONNECTING, set_as_default=False, name="wearsim")
    except Exception as error:
        cause = next(iter(str(error).splitlines()), "there is silence")
        raise WorkerError(
            f"no Dask scheduler answers at {address} within {CONNECTING:g} s: {cause}"
        ) from error


async def _greeted(address: str) -> None:
    """Connect for a moment; a `Client` waits for ever for a server that is no scheduler."""
    from distributed import Security  # noqa: PLC0415  (slow to import)
    from distributed.comm.core import connect  # noqa: PLC0415  (slow to import)

    arguments = Security().get_connection_args("client")
    answering = connect(address, timeout=CONNECTING, **arguments)
    comm = await asyncio.wait_for(answering, CONNECTING)
    await comm.close()

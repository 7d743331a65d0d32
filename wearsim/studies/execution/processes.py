"""Batches done by processes of this machine, each with a pipe of its own.

A process that dies takes down nobody else, even amid sending its results: only its own batches are
done again. Pools whose processes share a queue cannot promise that.
"""

from __future__ import annotations

import multiprocessing
import os
import pickle
import signal
import sys
import traceback
from collections import deque
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from multiprocessing import resource_tracker
from multiprocessing.connection import Connection, wait
from queue import SimpleQueue
from threading import Thread
from typing import TYPE_CHECKING, Any, TypeAlias, cast

from wearsim.errors import WorkerError
from wearsim.studies.execution.base import AHEAD, GUARDED, Batch, Results, Teller, Work, named

if TYPE_CHECKING:
    from multiprocessing.context import (
        ForkServerContext,
        ForkServerProcess,
        SpawnContext,
        SpawnProcess,
    )

    from wearsim.studies.execution.base import Batch, Work


DEATHS = 3
"""Processes that may die of the same batch, or as they begin, until the study gives up."""


class Processes:
    """Has batches done by processes of this machine.

    Parameters
    ----------
    workers : int
    tell : callable, optional
        Told of every process that is lost.
    """

    def __init__(self, workers: int, tell: Teller | None = None) -> None:
        self.workers = workers
        self.describe = f"{workers} processes"
        self._tell: Teller = tell or (lambda message: None)

    def results(self, work: Work, batches: Iterator[Batch]) -> Results:
        """Yield every batch with its results, as `Executor.results` says."""
        crew = _Crew(work, self.workers, map(_Batch, batches), self._tell)
        try:
            yield from crew.results()
        finally:
            crew.end()


@dataclass
class _Batch:
    """A batch, and how many processes have died of it."""

    numbers: Batch
    deaths: int = 0


@dataclass
class _Worker:
    """A process, and the batches it has been given; it does the first."""

    process: ForkServerProcess | SpawnProcess
    given: deque[_Batch] = field(default_factory=deque)
    begun: bool = False


class _Crew:
    """The processes that do one work."""

    def __init__(self, work: Work, most: int, batches: Iterator[_Batch], tell: Teller) -> None:
        self._pickled, self._most, self._tell = pickle.dumps(work), most, tell
        self._batches = batches
        self._again: deque[_Batch] = deque()
        self._crew: dict[Connection, _Worker] = {}
        self._stillborn = 0
        self._context = _context()
        self._context.set_forkserver_preload([work.__module__])

    def results(self) -> Results:
        """Yield every batch with its results."""
        self._hand_out()
        while any(worker.given for worker in self._crew.values()):
            for ready in wait(list(self._crew)):
                pipe = cast("Connection", ready)
                worker = self._crew[pipe]
                try:
                    answer: Answer | None = pipe.recv()
                except (EOFError, OSError):
                    self._lose(pipe)
                    continue
                if answer is None:
                    worker.begun, self._stillborn = True, 0
                    continue
                results, error = answer
                if error is not None:
                    raise error
                yield worker.given.popleft().numbers, results
                self._hand_out()
            self._hand_out()

    def _hand_out(self) -> None:
        """Give batches to those who have fewest, until all have enough or there are no more."""
        while len(self._crew) < self._most or any(
            len(worker.given) < AHEAD for worker in self._crew.values()
        ):
            batch = self._again.popleft() if self._again else next(self._batches, None)
            if batch is None:
                return
            pipe = self._least_busy()
            self._crew[pipe].given.append(batch)
            with suppress(OSError):  # it has just died, as will be seen in its turn
                pipe.send(batch.numbers)

    def _least_busy(self) -> Connection:
        given = {pipe: len(worker.given) for pipe, worker in self._crew.items()}
        pipe = min(given, key=given.__getitem__, default=None)
        if pipe is None or (given[pipe] and len(given) < self._most):
            return self._start()
        return pipe

    def _start(self) -> Connection:
        """Start one more process, and return the pipe to it."""
        ours, theirs = self._context.Pipe()
        process = self._context.Process(
            target=serve, args=(theirs, self._pickled), name="wearsim worker", daemon=True
        )
        try:
            with starting_workers():
                process.start()
        except BaseException:
            ours.close()
            raise
        finally:
            theirs.close()
        self._crew[ours] = _Worker(process)
        return ours

    def _lose(self, pipe: Connection) -> None:
        """Let the batches of a dead process be done again by others."""
        worker = self._crew.pop(pipe)
        pipe.close()
        worker.process.join()
        self._again.extendleft(reversed(worker.given))
        cause = _cause(worker.process.exitcode)
        if not worker.begun:
            self._stillborn += 1
            if self._stillborn == DEATHS:
                raise WorkerError(
                    f"{DEATHS} worker processes in a row ended as they began, the last {cause};"
                    f" {GUARDED}"
                )
        elif worker.given:
            batch = worker.given[0]
            batch.deaths += 1
            if batch.deaths == DEATHS:
                raise WorkerError(
                    f"{DEATHS} worker processes died of {named(batch.numbers)}, the last {cause};"
                    " fewer workers leave more memory for each",
                    batch.numbers,
                )
            self._tell(f"a worker process {cause}; {named(batch.numbers)} will be done again")

    def end(self) -> None:
        """End all processes at once, whatever they are doing."""
        for pipe, worker in self._crew.items():
            pipe.close()
            worker.process.kill()
        for worker in self._crew.values():
            worker.process.join()
        self._crew.clear()


def _context() -> ForkServerContext | SpawnContext:
    """Return how processes are started; a fork would copy locks that other threads hold."""
    if "forkserver" in multiprocessing.get_all_start_methods():
        return multiprocessing.get_context("forkserver")
    return multiprocessing.get_context("spawn")


def _cause(code: int | None) -> str:
    """Return in words how a process ended."""
    if code is None or code >= 0:
        return f"ended with exit code {code}"
    name = signal.Signals(-code).name
    return f"was killed by {name}" + (" (out of memory?)" if name == "SIGKILL" else "")


Answer: TypeAlias = tuple[list[Any], Exception | None]
"""The results of a batch, or what went wrong."""

ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")


def answer(work: Work, numbers: Batch) -> Answer:
    """Do a batch; what is raised is returned, in a form that another process can read."""
    try:
        return work(numbers), None
    except Exception as error:
        return [], _sendable(error)


def serve(pipe: Connection, pickled: bytes) -> None:
    """Do the batches that come through a pipe, and send back an `Answer` to each.

    The first thing sent is None: the process has begun.

    Parameters
    ----------
    pipe : Connection
        Its other end is the parent's alone, so that it closes with the parent, however that ends.
    pickled : bytes
        The `Work`.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C reaches all; the parent decides
    batches: SimpleQueue[Batch] = SimpleQueue()
    Thread(target=_receive, args=(pipe, batches), daemon=True).start()
    with suppress(BrokenPipeError):
        pipe.send(None)
        try:
            work = pickle.loads(pickled)
        except Exception as error:
            pipe.send(([], _sendable(error)))
            return
        while True:
            pipe.send(answer(work, batches.get()))


def _receive(pipe: Connection, batches: SimpleQueue[Batch]) -> None:
    """Take batches from the pipe, so that the parent never waits to get rid of one."""
    try:
        while True:
            batches.put(pipe.recv())
    except (EOFError, OSError):
        os._exit(0)  # nobody wants the results of what is being done


def _sendable(error: Exception) -> Exception:
    """Return an error, or one that says the same, that survives pickling."""
    error.add_note(f"in a worker:\n{''.join(traceback.format_exception(error))}")
    try:
        pickle.loads(pickle.dumps(error))
    except Exception:
        return WorkerError(f"{type(error).__name__}: {error}")
    return error


@contextmanager
def starting_workers() -> Iterator[None]:
    """Let processes that are started meanwhile use one thread each and never see a Ctrl-C."""
    before = {name: os.environ.get(name) for name in ONE_THREAD}
    os.environ.update(ONE_THREAD)
    try:
        if sys.platform == "win32":
            yield
        else:
            resource_tracker.ensure_running()  # unblocks signals when it starts
            blocked = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
            try:
                yield
            finally:
                signal.pthread_sigmask(signal.SIG_SETMASK, blocked)
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value

"""What a worker process does: batch after batch, until its parent is gone."""

from __future__ import annotations

import os
import pickle
import signal
import sys
import traceback
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from multiprocessing import resource_tracker
from multiprocessing.connection import Connection
from queue import SimpleQueue
from threading import Thread
from typing import TYPE_CHECKING, Any, TypeAlias

from wearsim.errors import WorkerError

if TYPE_CHECKING:
    from wearsim.studies.executors import Batch, Work

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

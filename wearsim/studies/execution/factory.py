"""Choice of the executor of a study: this process, threads, processes, or a Dask cluster."""

from __future__ import annotations

import operator
import re
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager

from wearsim.errors import WorkerError
from wearsim.operating_system import processors
from wearsim.studies.execution.processes import Executor, InProcess, Notify, Processes, Threads

LOCAL = ("processes", "threads", "serial", "dask")

ADDRESS = re.compile(r"(tcp|tls)://[^/]+:\d+")  # of a Dask scheduler


@contextmanager
def executor(
    scheduler: str = "processes",
    workers: int | None = None,
    *,
    on_notice: Notify | None = None,
    stop_requested: Callable[[], bool] | None = None,
    preload: str = "wearsim",
    realisations: int | None = None,
) -> Iterator[Executor]:
    """Provide the executor of a study; results do not depend on it, only their order does.

    Parameters
    ----------
    scheduler : str
        "processes", "threads", "serial" (this process), "dask" (a temporary cluster on this
        machine), or the address of a Dask scheduler, "tcp://host:port".
    workers : int, optional
        Number of workers; by default the number of processors available to this process. All
        workers of a running cluster are used, and their number must not be given.
    on_notice : callable, optional
        Called with a message when a worker was lost, or a cluster has no workers. Without it, a
        cluster without workers for a minute is an error.
    stop_requested : callable, optional
        Called while a cluster has no workers; True stops the study.
    preload : str
        Modules that worker processes on this machine import as they start, separated by spaces.
    realisations : int, optional
        Number of realisations, if known; no more processes are started on this machine.

    Raises
    ------
    TypeError, ValueError
        If the scheduler or the number of workers is invalid.
    WorkerError
        If the cluster cannot be used: unreachable, Dask not installed, another version of wearsim.
    Interrupted
        If a stop was requested before a cluster had workers.
    """
    count = check_scheduler(scheduler, workers) or processors()
    if scheduler == "dask" or scheduler not in LOCAL:
        try:
            from wearsim.studies.execution.dask import cluster  # noqa: PLC0415  (optional)
        except ImportError as error:
            raise WorkerError(
                f'Dask is not installed ({error}); install it with: pip install "wearsim[cluster]"'
            ) from error
        address = None if scheduler == "dask" else scheduler
        with cluster(
            address, count, on_notice, stop_requested or (lambda: False)
        ) as workers_of_cluster:
            yield workers_of_cluster
    elif scheduler == "serial" or count == 1:
        yield InProcess()
    elif scheduler == "threads":
        yield Threads(count)
    else:
        with closing(Processes(min(count, realisations or count), on_notice, preload)) as pool:
            yield pool


def whole_number(name: str, value: int, example: int) -> int:
    """Return an argument as an int.

    Raises
    ------
    TypeError, ValueError
        If it is not a whole number, such as `example`, or below 1.
    """
    try:
        count = operator.index(value)
    except TypeError:
        raise TypeError(f"{name} must be a whole number such as {example}, got {value!r}") from None
    if count < 1:
        raise ValueError(f"{name} must be 1 or more, got {count}")
    return count


def check_scheduler(scheduler: str, workers: int | None = None) -> int | None:
    """Check arguments of `executor`, and return the number of workers, if given, as an int.

    Raises
    ------
    TypeError, ValueError
        If the scheduler or the number of workers is invalid.
    """
    is_remote = ADDRESS.fullmatch(scheduler) is not None
    if scheduler not in LOCAL and not is_remote:
        raise ValueError(
            f"there is no scheduler '{scheduler}', expected {', '.join(LOCAL)}, or the address of"
            " a Dask scheduler such as tcp://host:8786"
        )
    if workers is None:
        return None
    count = whole_number("workers", workers, 4)
    if is_remote:
        raise ValueError(f"the workers of {scheduler} are all used; leave out the number {count}")
    if scheduler == "serial" and count > 1:
        raise ValueError(
            f"there is one worker where the scheduler is 'serial', got {count}; use processes"
        )
    return count

"""A Dask cluster to work on: one that runs somewhere, or one of our own."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, contextmanager
from typing import TYPE_CHECKING

from wearsim.errors import WorkerError
from wearsim.studies.executors import GUARDED, Teller
from wearsim.studies.executors_cluster import Cluster
from wearsim.studies.worker_process import starting_workers

if TYPE_CHECKING:
    from distributed import Client, LocalCluster

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

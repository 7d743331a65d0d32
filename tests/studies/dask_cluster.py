"""Dask cluster of separate processes: a scheduler and workers."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
NO_DASHBOARD = ("--no-dashboard", "--dashboard-address", "127.0.0.1:0")


@contextmanager
def started(module: str, *arguments: str, path: str = "") -> Iterator[subprocess.Popen[bytes]]:
    """Provide a Dask process, which is killed at the end."""
    paths = os.pathsep.join(filter(None, [path, str(ROOT), str(HERE)]))
    with subprocess.Popen(
        [sys.executable, "-m", f"distributed.cli.{module}", *NO_DASHBOARD, *arguments],
        env=os.environ | {"PYTHONPATH": paths, "OMP_NUM_THREADS": "1"},
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    ) as process:
        try:
            yield process
        finally:
            process.kill()


@contextmanager
def scheduler(folder: Path) -> Iterator[tuple[str, subprocess.Popen[bytes]]]:
    """Provide the address of a new scheduler, and its process."""
    file = folder / "scheduler.json"
    arguments = ("--host", "127.0.0.1", "--port", "0", "--scheduler-file", str(file))
    with started("dask_scheduler", *arguments) as process:
        while not (file.exists() and file.read_text()):
            assert process.poll() is None
            time.sleep(0.01)
        yield json.loads(file.read_text())["address"], process


@contextmanager
def worker(address: str, folder: Path, path: str = "") -> Iterator[subprocess.Popen[bytes]]:
    """Provide a worker that is not restarted after it ends.

    Parameters
    ----------
    address : str
        Address of the scheduler.
    folder : Path
    path : str
        Folder prepended to the module search path.
    """
    arguments = (address, "--nthreads", "1", "--no-nanny", "--local-directory", str(folder))
    with started("dask_worker", *arguments, path=path) as process:
        yield process

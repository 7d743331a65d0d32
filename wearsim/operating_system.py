"""What wearsim takes from POSIX, and what it does on a system without it.

| needed | without it |
|---|---|
| lock of the file description (Linux), or `flock` | two writers of one file are not noticed |
| synchronising a folder | after a power failure a file may have its former content |
| blocking a signal while processes start | workers receive Ctrl-C as well |
| affinity of a process | all processors of the machine are counted |
| names of signals | the number of the exit code |

Renaming a file over another is atomic on POSIX; on Windows it fails, with both files unchanged,
while another process has the target open.
"""

from __future__ import annotations

import os
import signal
import struct
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import ModuleType

fcntl: ModuleType | None
try:
    import fcntl
except ImportError:
    fcntl = None


def lock_file(handle: int) -> None:
    """Lock an open file against other writers until it is closed or the process ends.

    Where available, the lock belongs to the open file description: HDF5 uses the other kind,
    flock, when it opens a file for reading. A lock of Windows would block readers.

    Raises
    ------
    OSError
        If another process holds the lock.
    """
    if fcntl is None:
        return
    if hasattr(fcntl, "F_OFD_SETLK"):
        whole = struct.pack("hhqqi", fcntl.F_WRLCK, os.SEEK_SET, 0, 0, 0)
        fcntl.fcntl(handle, fcntl.F_OFD_SETLK, whole)
    else:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)


def synchronise_folder(folder: Path) -> None:
    """Wait until the names in a folder are on the disk."""
    if not hasattr(os, "O_DIRECTORY"):  # Windows cannot open folders
        return
    handle = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


@contextmanager
def interrupts_blocked() -> Iterator[None]:
    """Block Ctrl-C in this thread; processes that are started here never receive it."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def end_of_process(code: int | None) -> str:
    """Return how a process ended, as a predicate: "was killed by SIGKILL".

    Parameters
    ----------
    code : int, optional
        Its exit code, of a killed process minus the number of the signal.
    """
    try:
        name = signal.Signals(-(code or 0)).name
    except ValueError:  # no signal, or one that this system does not know
        return f"ended with exit code {code}"
    return f"was killed by {name}" + (" (out of memory?)" if name == "SIGKILL" else "")


def processors() -> int:
    """Return the number of processors that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1

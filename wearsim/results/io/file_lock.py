"""Only one process writes a file; others are told so, and readers are in nobody's way."""

from __future__ import annotations

import errno
import os
import struct
from pathlib import Path
from typing import IO

from wearsim.errors import ResultsFileError


def lock_or_refuse(file: IO[bytes], path: str | Path) -> None:
    """Take the lock of an open file, which holds until it is closed or the process ends.

    The lock is one of the open file (OFD) where the system has such, for HDF5 takes the other
    kind, flock, when it opens a file for reading.

    Parameters
    ----------
    file : binary file
        The file, open for writing.
    path : str or Path
        Its name, as the user calls it.

    Raises
    ------
    ResultsFileError
        If another holds the lock, or if the name stands for another file by now.
    """
    busy = ResultsFileError(f"{path}: is being written by another process")
    try:
        _lock(file.fileno())
    except OSError as error:
        if error.errno in {errno.EAGAIN, errno.EACCES}:
            raise busy from error
        what = error.strerror or str(error)
        raise ResultsFileError(f"{path}: cannot be locked for writing ({what})") from error
    if not os.path.samestat(os.fstat(file.fileno()), os.stat(path)):
        raise busy


def refuse_if_locked(path: str | Path) -> None:
    """Refuse to replace a file that another process is writing.

    Parameters
    ----------
    path : str or Path
        The file; there may be none.

    Raises
    ------
    ResultsFileError
        If another holds its lock.
    """
    if os.access(path, os.R_OK | os.W_OK):  # else there is none, or nobody may write it
        with Path(path).open("r+b", buffering=0) as file:
            lock_or_refuse(file, path)


def _lock(handle: int) -> None:
    if os.name == "nt":  # a lock would keep readers away there
        return
    import fcntl  # noqa: PLC0415  (not on every system)

    if hasattr(fcntl, "F_OFD_SETLK"):
        whole = struct.pack("hhqqi", fcntl.F_WRLCK, os.SEEK_SET, 0, 0, 0)
        fcntl.fcntl(handle, fcntl.F_OFD_SETLK, whole)
    else:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)

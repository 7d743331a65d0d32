"""Exclusive lock of the process that writes a file; readers are not blocked."""

from __future__ import annotations

import errno
import os
import struct
from pathlib import Path
from typing import IO

from wearsim.errors import ResultsFileError


def lock_or_refuse(file: IO[bytes], path: str | Path) -> None:
    """Lock an open file until it is closed or the process ends.

    Where available, the lock belongs to the open file description (OFD): HDF5 uses the other
    kind, flock, when it opens a file for reading.

    Parameters
    ----------
    file : binary file
        The file, open for writing.
    path : str or Path
        Its name, as given by the user.

    Raises
    ------
    ResultsFileError
        If another process holds the lock, or if the file was replaced after it was opened.
    """
    busy = ResultsFileError(f"{path}: is being written by another process")
    try:
        _lock(file.fileno())
    except OSError as error:
        if error.errno in {errno.EAGAIN, errno.EACCES}:
            raise busy from error
        reason = error.strerror or str(error)
        raise ResultsFileError(f"{path}: cannot be locked for writing ({reason})") from error
    if not os.path.samestat(os.fstat(file.fileno()), os.stat(path)):
        raise busy


def refuse_if_locked(path: str | Path) -> None:
    """Refuse a file that another process is writing.

    Parameters
    ----------
    path : str or Path
        The file, which need not exist.

    Raises
    ------
    ResultsFileError
        If another process is writing it.
    """
    if os.access(path, os.R_OK | os.W_OK):
        with Path(path).open("r+b", buffering=0) as file:
            lock_or_refuse(file, path)


def _lock(handle: int) -> None:
    if os.name == "nt":  # a lock would block readers on Windows
        return
    import fcntl  # noqa: PLC0415  (not on every system)

    if hasattr(fcntl, "F_OFD_SETLK"):
        whole = struct.pack("hhqqi", fcntl.F_WRLCK, os.SEEK_SET, 0, 0, 0)
        fcntl.fcntl(handle, fcntl.F_OFD_SETLK, whole)
    else:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)

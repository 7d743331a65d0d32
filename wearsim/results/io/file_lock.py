"""Exclusive lock of the process that writes an ensemble; readers are not blocked."""

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
        The file that it protects, for messages.

    Raises
    ------
    ResultsFileError
        If another process holds the lock, or held it until now and deleted the file.
    """
    busy = ResultsFileError(f"{path}: is being written by another process")
    try:
        _lock(file.fileno())
    except OSError as error:
        if error.errno in {errno.EAGAIN, errno.EACCES}:
            raise busy from error
        reason = error.strerror or str(error)
        raise ResultsFileError(f"{path}: cannot be locked for writing ({reason})") from error
    if os.fstat(file.fileno()).st_nlink == 0:
        raise busy


def parts_folder(path: str | Path) -> Path:
    """Return the folder of the part files of an ensemble, and of the lock of its writer."""
    target = Path(path).resolve()  # follows links
    return target.with_name(f"{target.name}.parts")


def lock_path(path: str | Path) -> Path:
    """Return the file that the writer of an ensemble locks."""
    return parts_folder(path) / "lock"


def refuse_if_locked(path: str | Path) -> None:
    """Refuse an ensemble that another process is writing.

    Parameters
    ----------
    path : str or Path
        Its file, which need not exist.

    Raises
    ------
    ResultsFileError
        If another process is writing it.
    """
    lock = lock_path(path)
    if os.access(lock, os.R_OK | os.W_OK):
        with lock.open("r+b", buffering=0) as file:
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

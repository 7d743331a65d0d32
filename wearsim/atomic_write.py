"""Atomic writing of files, the lock of their writer, and checks of an output path.

After a kill either the old or the new content of a file is complete. The lock is that of a file
beside it, rig.h5.lock for rig.h5: the file itself is replaced while it is locked. The operating
system releases the lock of a killed process.
"""

from __future__ import annotations

import errno
import os
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO

from wearsim import operating_system
from wearsim.errors import ResultsFileError

#: Added to the name of a file while its new content is written.
TEMPORARY = ".tmp"
#: Added to the name of a results file for the file that its writer locks.
LOCK = ".lock"

_BUFFER = 1 << 18  # bytes


class Storage:
    """File operations of the writers of results.

    A subclass may replace single operations, for example to let a test fail at one of them.
    """

    def __repr__(self) -> str:
        return f"{type(self).__name__}()"

    def open(self, path: Path) -> IO[bytes]:
        """Open a file for new content, which can be read back."""
        return path.open("w+b", buffering=_BUFFER)

    def synchronise(self, file: IO[bytes]) -> None:
        """Wait until all that was written to a file is on the disk."""
        file.flush()
        os.fsync(file.fileno())

    def replace(self, source: Path, target: Path) -> None:
        """Rename a file, in place of any with that name."""
        source.replace(target)

    def synchronise_folder(self, folder: Path) -> None:
        """Wait until the names in a folder are on the disk."""
        operating_system.synchronise_folder(folder)

    def remove(self, path: Path) -> None:
        """Delete a file, if it exists."""
        path.unlink(missing_ok=True)


#: The file operations of the operating system.
DISK = Storage()


@contextmanager
def replacement(path: str | Path, storage: Storage = DISK) -> Iterator[IO[bytes]]:
    """Return an empty file that replaces another at the end of the with statement.

    Parameters
    ----------
    path : str or Path
        The file to replace, which need not exist.
    storage : Storage
        File operations.

    Raises
    ------
    ResultsFileError
        If it cannot be written; an existing file is then unchanged, as after any other exception.
    """
    target = Path(path).resolve()  # follows links, which are kept
    temporary = target.with_name(target.name + TEMPORARY)
    with os_errors_converted(path):
        try:
            with storage.open(temporary) as file:
                yield file
                storage.synchronise(file)
            storage.replace(temporary, target)
        except BaseException:
            temporary.unlink(missing_ok=True)
            raise
        storage.synchronise_folder(target.parent)


def save_text(text: str, path: Path) -> None:
    """Write a text in UTF-8.

    Parameters
    ----------
    text : str
    path : Path
        An existing file is replaced.

    Raises
    ------
    ResultsFileError
        If it cannot be written; an existing file is then unchanged.
    """
    with replacement(path) as file:
        file.write(text.encode("utf-8"))


@contextmanager
def os_errors_converted(path: str | Path) -> Iterator[None]:
    """Convert an OSError into a ResultsFileError with a one-line message.

    Parameters
    ----------
    path : str or Path
        The file that is written, as named by the user.
    """
    try:
        yield
    except OSError as error:
        raise ResultsFileError(f"{path}: cannot be written ({error.strerror or error})") from error


def lock_or_refuse(file: IO[bytes], path: str | Path) -> None:
    """Lock an open file until it is closed or the process ends.

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
    busy = _being_written(path)
    try:
        operating_system.lock_file(file.fileno())
    except OSError as error:
        if error.errno in {errno.EAGAIN, errno.EACCES}:
            raise busy from error
        raise ResultsFileError(
            f"{path}: cannot be locked for writing ({error.strerror or error})"
        ) from error
    if os.fstat(file.fileno()).st_nlink == 0:
        raise busy


def parts_folder(path: str | Path) -> Path:
    """Return the folder of the part files of an ensemble."""
    target = Path(path).resolve()  # follows links
    return target.with_name(f"{target.name}.parts")


def _being_written(path: str | Path) -> ResultsFileError:
    """Return the error of a file that another process is writing."""
    remedy = "wait until it ends, or stop it"
    what = f"{path}: is being written by another process"
    return ResultsFileError(what, python=remedy, shell=remedy)


def lock_path(path: str | Path) -> Path:
    """Return the file that the writer of a results file locks."""
    target = Path(path).resolve()  # follows links
    return target.with_name(target.name + LOCK)


def acquire_lock(path: str | Path) -> IO[bytes]:
    """Make this process the only writer of a results file, until `release_lock` or its end.

    Parameters
    ----------
    path : str or Path
        The file, which need not exist.

    Returns
    -------
    binary file
        The locked file beside it.

    Raises
    ------
    ResultsFileError
        If another process is writing it, or the folder cannot be written.
    """
    with os_errors_converted(path):
        lock = lock_path(path).open("a+b")
    try:
        lock_or_refuse(lock, path)
    except BaseException:
        lock.close()
        raise
    return lock


def release_lock(lock: IO[bytes], path: str | Path) -> None:
    """Let other processes write a results file, and delete the file that was locked for it.

    Parameters
    ----------
    lock : binary file
        The file that `acquire_lock` returned, which may be closed already.
    path : str or Path
        The results file.
    """
    if lock.closed:
        return
    if operating_system.fcntl is None:
        lock.close()  # Windows deletes no open file
    with suppress(OSError):  # a file that is left there does not hinder other writers
        lock_path(path).unlink(missing_ok=True)
    lock.close()


@contextmanager
def write_lock(path: str | Path, before: os.stat_result | None = None) -> Iterator[None]:
    """Make this process the only writer of a results file in the context.

    Parameters
    ----------
    path : str or Path
        The file, which need not exist.
    before : os.stat_result, optional
        Status of the file before its content was read.

    Raises
    ------
    ResultsFileError
        If another process is writing it, or has written it since it was read, or the folder cannot
        be written.
    """
    lock = acquire_lock(path)
    try:
        if before is not None:
            now = Path(path).stat()
            if (now.st_ino, now.st_mtime_ns) != (before.st_ino, before.st_mtime_ns):
                raise _being_written(path)
        yield
    finally:
        release_lock(lock, path)


def refuse_if_locked(path: str | Path) -> None:
    """Refuse a results file that another process is writing.

    Parameters
    ----------
    path : str or Path
        The file, which need not exist.

    Raises
    ------
    ResultsFileError
        If another process is writing it.
    """
    lock = lock_path(path)
    if os.access(lock, os.R_OK | os.W_OK):
        with lock.open("r+b", buffering=0) as file:
            lock_or_refuse(file, path)


def refuse_inputs(
    path: str | Path | None, inputs: Iterable[Path], what: str = "the scenario", option: str = "-o"
) -> None:
    """Raise if an output would replace an input file.

    Parameters
    ----------
    path : str or Path, optional
        The output, if there is one.
    inputs : iterable of Path
        The input files.
    what : str
        Description of the inputs.
    option : str
        The option that set the output.

    Raises
    ------
    ResultsFileError
        If the output is one of the inputs, also by another name.
    """
    for source in inputs:
        if path is not None and same_file(path, source):
            raise ResultsFileError(
                f"{path}: {what} is read from {source}, and no input is replaced",
                python="choose another name",
                shell=f"choose another name with {option}",
            )


def same_file(first: str | Path, other: str | Path) -> bool:
    """Return whether two paths refer to the same file.

    Parameters
    ----------
    first, other : str or Path
        The paths; the files need not exist.

    Returns
    -------
    bool
    """
    try:
        return os.path.samefile(first, other)
    except OSError:  # one of them does not exist
        return Path(first).resolve() == Path(other).resolve()

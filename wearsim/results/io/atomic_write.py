"""Atomic writing of files: after a kill either the old or the new content is complete."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO

from wearsim.errors import ResultsFileError

TEMPORARY = ".tmp"
"""Added to the name of a file while its new content is written."""


_BUFFER = 1 << 18  # bytes


class Storage:
    """File operations of the writers of results.

    A subclass may replace single operations, for example to let a test fail at one of them.
    """

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
        if os.name == "nt":  # Windows cannot open folders
            return
        handle = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)

    def remove(self, path: Path) -> None:
        """Delete a file, if it exists."""
        path.unlink(missing_ok=True)


DISK = Storage()
"""The file operations of the operating system."""


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

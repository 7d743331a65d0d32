"""A file that is written in place, by one process alone."""

from __future__ import annotations

import os
from pathlib import Path

from wearsim.errors import ResultsFileError
from wearsim.results.file_lock import lock_or_refuse
from wearsim.results.writer import refused_in_a_line, stage, write_chunks


class FileInPlace:
    """A file open for writing in place, which nobody else can write meanwhile.

    Every call may raise a ResultsFileError that names the file: when the disk is full, say.

    Parameters
    ----------
    path : Path
        The file, which must be there.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        with refused_in_a_line(path):
            self._file = path.open("r+b", buffering=0)
        try:
            lock_or_refuse(self._file, path)
        except BaseException:
            self._file.close()
            raise

    def read(self, offset: int, count: int) -> bytes:
        """Return bytes of the file.

        Parameters
        ----------
        offset, count : int
            Bytes before the first, and how many.
        """
        try:
            self._file.seek(offset)
            return self._file.read(count)
        except OSError as error:
            raise ResultsFileError(f"{self._path}: cannot be read ({error.strerror})") from error

    def write(self, offset: int, content: bytes) -> None:
        """Write bytes over those that stand there.

        Parameters
        ----------
        offset : int
            Bytes before the first.
        content : bytes
            What to write.
        """
        with refused_in_a_line(self._path):
            self._file.seek(offset)
            write_chunks(self._file, content)

    def synchronise(self) -> None:
        """Wait until all that was written is on the disk."""
        with refused_in_a_line(self._path), stage("fsync"):
            os.fsync(self._file.fileno())

    def close(self) -> None:
        """Let go of the file, all of it on the disk."""
        if self._file.closed:
            return
        try:
            self.synchronise()
        finally:
            self._file.close()

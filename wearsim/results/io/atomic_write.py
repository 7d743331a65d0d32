"""Atomic writing of files: after a kill either the old or the new content is complete."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO

from wearsim.errors import ResultsFileError

STAGES = ("open", "write", "flush", "fsync", "close", "rename", "fsync folder")

_CHUNK = 1 << 18


def _do_nothing(stage: str) -> None:
    pass


on_write_stage: Callable[[str], None] = _do_nothing
"""Hook for fault injection, called with "before <stage>" and "after <stage>" for each of STAGES.

A file is written in chunks, each of which is one "write". Tests replace the hook by a function
that raises an exception or kills the process.
"""


@contextmanager
def stage(name: str) -> Iterator[None]:
    """Call the hook before and after the body of the with statement.

    Parameters
    ----------
    name : str
        One of STAGES.
    """
    on_write_stage(f"before {name}")
    yield
    on_write_stage(f"after {name}")


def write_pieces(
    path: str | Path, pieces: Iterable[tuple[int, bytes]], size: int | None = None
) -> None:
    """Write a file atomically; it may have holes.

    Parameters
    ----------
    path : str or Path
        The file; the pieces are first written to `path`.part.
    pieces : iterable of tuple
        Offset of each piece in bytes, and the piece.
    size : int, optional
        Size of the file in bytes, holes included; by default it ends with the last piece.

    Raises
    ------
    ResultsFileError
        If it cannot be written; an existing file is then unchanged.
    """
    target = Path(path).resolve()  # follows links, which are kept
    part = target.with_name(target.name + ".part")
    with os_errors_converted(path):
        try:
            _write_part(part, pieces, size)
            with stage("rename"):
                os.replace(part, target)
        except BaseException:
            part.unlink(missing_ok=True)
            raise
        with stage("fsync folder"):
            _sync_folder(target.parent)


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


def write_chunks(file: IO[bytes], content: bytes | memoryview) -> None:
    """Write at the current position of a file, in chunks that are separate "write" stages.

    Parameters
    ----------
    file : binary file
        Open file, buffered or not.
    content : bytes or memoryview
        The bytes to write.
    """
    view = memoryview(content)
    for start in range(0, len(view), _CHUNK):
        with stage("write"):
            rest = view[start : start + _CHUNK]
            while rest:  # an unbuffered file may write fewer bytes than given
                rest = rest[file.write(rest) :]


def _write_part(part: Path, pieces: Iterable[tuple[int, bytes]], size: int | None) -> None:
    on_write_stage("before open")
    with part.open("wb") as file:
        on_write_stage("after open")
        for offset, piece in pieces:
            file.seek(offset)
            write_chunks(file, piece)
        with stage("flush"):
            file.flush()
            if size is not None:
                file.truncate(size)  # the file may end with a hole
        with stage("fsync"):
            os.fsync(file.fileno())
        with stage("close"):
            file.close()


def _sync_folder(folder: Path) -> None:
    if os.name == "nt":  # Windows cannot open folders
        return
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)

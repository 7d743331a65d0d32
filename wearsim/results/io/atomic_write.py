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
"""The seam for fault injection, called with "before <stage>" and "after <stage>" at each of STAGES.

A file is written in chunks, each a "write" of its own. A test sets this to something that raises
or kills the process.
"""


@contextmanager
def stage(name: str) -> Iterator[None]:
    """Call the seam before and after what is done inside.

    Parameters
    ----------
    name : str
        Which of STAGES it is.
    """
    on_write_stage(f"before {name}")
    yield
    on_write_stage(f"after {name}")


def write_whole(path: str | Path, content: bytes) -> None:
    """Write a file so that its name only ever stands for a whole one.

    Parameters
    ----------
    path : str or Path
        The file; the content goes to `path`.part first.
    content : bytes
        What it shall hold.

    Raises
    ------
    ResultsFileError
        If it cannot be written; a file that stood there is untouched.
    """
    write_pieces(path, [(0, content)], len(content))


def write_pieces(
    path: str | Path, pieces: Iterable[tuple[int, bytes]], size: int | None = None
) -> None:
    """Write a file with holes; see `write_whole`.

    Parameters
    ----------
    path : str or Path
        The file; the pieces go to `path`.part first.
    pieces : iterable of tuple
        How many bytes stand before each piece, and the piece.
    size : int, optional
        Bytes of the file, holes included; by default it ends with the last piece.

    Raises
    ------
    ResultsFileError
        If it cannot be written; a file that stood there is untouched.
    """
    target = Path(path).resolve()  # where a link points: the link stays one
    part = target.with_name(target.name + ".part")
    with refused_in_a_line(path):
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
def refused_in_a_line(path: str | Path) -> Iterator[None]:
    """Turn what the system says of a file that cannot be written into a ResultsFileError.

    Parameters
    ----------
    path : str or Path
        The file, as the user calls it.
    """
    try:
        yield
    except OSError as error:
        raise ResultsFileError(f"{path}: cannot be written ({error.strerror or error})") from error


def write_chunks(file: IO[bytes], content: bytes | memoryview) -> None:
    """Write to an open file where it stands, in chunks that are each a "write" of the seam.

    Parameters
    ----------
    file : binary file
        With or without a buffer.
    content : bytes or memoryview
        What to write.
    """
    view = memoryview(content)
    for start in range(0, len(view), _CHUNK):
        with stage("write"):
            rest = view[start : start + _CHUNK]
            while rest:  # a file without a buffer may take less than it is given
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
                file.truncate(size)  # a hole may be the last
        with stage("fsync"):
            os.fsync(file.fileno())
        with stage("close"):
            file.close()


def _sync_folder(folder: Path) -> None:
    if os.name == "nt":  # folders cannot be opened there
        return
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)

"""File operations that call a function before and after each of them, to inject faults."""

from __future__ import annotations

import io
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from pathlib import Path
from typing import IO, Any

from wearsim.atomic_write import Storage

STAGES = ("open", "write", "fsync", "close", "rename", "fsync folder")
"""File operations of writing a file; "remove" deletes one."""

BUFFER = 1 << 14
"""Size of the buffer of a file, so small that writing a file takes several writes."""

Hook = Callable[[str], object]


class WatchedStorage(Storage):
    """The file operations of the disk, with a function called around each.

    Parameters
    ----------
    hook : callable
        Called with "before open", "after open" and so on; it may raise an exception, or kill the
        process.
    """

    def __init__(self, hook: Hook) -> None:
        self._hook = hook

    def open(self, path: Path) -> IO[bytes]:
        self._hook("before open")
        file = _WatchedFile(path, "w+b")
        try:
            self._hook("after open")
        except BaseException:
            file.close()
            raise
        file.stage = self._stage
        return io.BufferedRandom(file, BUFFER)

    def synchronise(self, file: IO[bytes]) -> None:
        with self._stage("fsync"):
            super().synchronise(file)

    def replace(self, source: Path, target: Path) -> None:
        with self._stage("rename"):
            super().replace(source, target)

    def synchronise_folder(self, folder: Path) -> None:
        with self._stage("fsync folder"):
            super().synchronise_folder(folder)

    def remove(self, path: Path) -> None:
        with self._stage("remove"):
            super().remove(path)

    @contextmanager
    def _stage(self, name: str) -> Iterator[None]:
        self._hook(f"before {name}")
        yield
        self._hook(f"after {name}")


class _WatchedFile(io.FileIO):
    """A file in which a fault can be injected when it is written or closed."""

    stage: Callable[[str], Any] = nullcontext

    def write(self, content: Any, /) -> int:
        with self.stage("write"):
            return super().write(content)

    def close(self) -> None:
        if self.closed:
            return
        try:
            with self.stage("close"):
                super().close()
        finally:
            super().close()


def full_disk(at: str) -> WatchedStorage:
    """Return file operations that fail at one stage, as when the disk is full."""

    def fill(stage: str) -> None:
        if stage == f"before {at}":
            raise OSError(28, "No space left on device")

    return WatchedStorage(fill)


def some_of_each(stages: list[str]) -> list[int]:
    """Return the numbers of all file operations except writes, and of some writes."""
    writes = [number for number, stage in enumerate(stages) if stage.endswith("write")]
    chosen = {*writes[:4], *writes[4:-4:9], *writes[-4:]}
    return [n for n, stage in enumerate(stages) if not stage.endswith("write") or n in chosen]


def one_of_each(stages: list[str]) -> list[int]:
    """Return the number of one call per stage, in turn the first, the middle and the last."""
    chosen = []
    for turn, name in enumerate(dict.fromkeys(stages)):
        calls = [number for number, stage in enumerate(stages) if stage == name]
        chosen.append(calls[(0, len(calls) // 2, -1)[turn % 3]])
    return sorted(chosen)

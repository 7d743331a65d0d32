"""Work functions for tests of executors, in a module that worker processes can import."""

from __future__ import annotations

import os
import signal
import struct
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from multiprocessing.connection import Connection
from pathlib import Path


@dataclass(frozen=True)
class Squares:
    """Squares and process ids, after a delay of `seconds`, or `first` for numbers below 1."""

    seconds: float = 0.0
    first: float = 0.0

    def __call__(self, numbers: Sequence[int]) -> list[tuple[int, int]]:
        time.sleep(self.first if min(numbers) < 1 else self.seconds)
        return [(number * number, os.getpid()) for number in numbers]


@dataclass(frozen=True)
class Held:
    """Squares; the batch of number 0 waits for a file `go` and then writes a file `done`.

    The time limit of two minutes is reached in failing tests only.
    """

    folder: Path

    def __call__(self, numbers: Sequence[int]) -> list[int]:
        if 0 in numbers:
            for _ in range(12_000):
                if (self.folder / "go").exists():
                    break
                time.sleep(0.01)
            (self.folder / "done").touch()
        return [number * number for number in numbers]


@dataclass(frozen=True)
class Deadly:
    """Squares; kills its process at the number `at`, `times` times."""

    folder: Path
    at: int
    times: int

    def __call__(self, numbers: Sequence[int]) -> list[int]:
        time.sleep(0.02)
        if self.at in numbers and not self._kills_done():
            os.kill(os.getpid(), signal.SIGKILL)
        with (self.folder / f"done {min(numbers)}").open("a") as file:
            file.write(".")
        return [number * number for number in numbers]

    def _kills_done(self) -> bool:
        for turn in range(self.times):
            try:
                (self.folder / f"killed {turn}").touch(exist_ok=False)
            except FileExistsError:
                continue
            return False
        return True


class _KilledAsItIsPickled:
    def __reduce__(self) -> tuple[object, ...]:
        os.kill(os.getpid(), signal.SIGKILL)
        return ()


@dataclass(frozen=True)
class KilledAsItWrites:
    """Zero bytes; the process is killed once when a part of the results has been written."""

    folder: Path
    length: int

    def __call__(self, numbers: Sequence[int]) -> list[object]:
        results: list[object] = [bytes(self.length) for _ in numbers]
        if 0 in numbers and not (self.folder / "killed").exists():
            (self.folder / "killed").touch()
            results.append(_KilledAsItIsPickled())
        return results


@dataclass(frozen=True)
class KilledAsItSends:
    """Zero bytes; kills its process once while the results are being sent."""

    folder: Path
    length: int

    def __call__(self, numbers: Sequence[int]) -> list[bytes]:
        if 0 in numbers and not (self.folder / "killed").exists():
            (self.folder / "killed").touch()
            Connection.send_bytes = _send_a_part_and_die
        return [bytes(self.length) for _ in numbers]


def _send_a_part_and_die(connection: Connection, content: bytes) -> None:
    os.write(connection.fileno(), struct.pack("!i", len(content)) + bytes(content[:1000]))
    os.kill(os.getpid(), signal.SIGKILL)


class Exiting:
    """Squares; calls `sys.exit` at number 3."""

    def __call__(self, numbers: Sequence[int]) -> list[int]:
        if 3 in numbers:
            sys.exit("finished")
        return [number * number for number in numbers]


class Raising:
    """Work that raises an error of a given type."""

    def __init__(self, kind: type[Exception], *arguments: object) -> None:
        self.kind, self.arguments = kind, arguments

    def __call__(self, numbers: Sequence[int]) -> list[int]:
        raise self.kind(*self.arguments)


class UnsendableError(Exception):
    """Error that can be pickled but not unpickled."""

    def __init__(self, one: str, other: str) -> None:
        super().__init__(f"{one} and {other}")


@dataclass(frozen=True)
class Unreadable:
    """Work that cannot be unpickled."""

    def __setstate__(self, state: object) -> None:
        raise LookupError("cannot be read here")

    def __getstate__(self) -> dict[str, int]:
        return {"some": 1}

    def __call__(self, numbers: Sequence[int]) -> list[int]:
        return list(numbers)


def surroundings(numbers: Sequence[int]) -> list[tuple[str, bool]]:
    """Return the number of BLAS threads of this process, and whether it ignores SIGINT."""
    ignored = signal.getsignal(signal.SIGINT) == signal.SIG_IGN
    return [(os.environ["OPENBLAS_NUM_THREADS"], ignored) for _ in numbers]

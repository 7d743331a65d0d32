"""Peak memory of processes, as reported by the operating system."""

from __future__ import annotations

import os
import sys
from pathlib import Path

_PROCESSES = Path("/proc")


def peak_bytes() -> int | None:
    """Return the peak memory of this process [bytes], or None if it is not available.

    Linux reports it in the status of the process. `getrusage`, used on other systems, starts with
    the peak of the parent process.
    """
    own = _status_bytes(_PROCESSES / "self" / "status", "VmHWM")
    return own if own is not None else _used(of_children=False)


def family_peak_bytes(workers: int) -> int | None:
    """Return the sum of the peaks of this process and its descendants [bytes].

    Shared pages are counted for every process.

    Parameters
    ----------
    workers : int
        Number of worker processes; used where only the peak of the largest one is available.
    """
    own = peak_bytes()
    if own is None:
        return None
    if (_PROCESSES / "self" / "status").exists():
        return own + sum(_peak_of(process) for process in _descendants(os.getpid()))
    return own + workers * (_used(of_children=True) or 0)


def _peak_of(process: int) -> int:
    return _status_bytes(_PROCESSES / str(process) / "status", "VmHWM") or 0


def _descendants(process: int) -> list[int]:
    """Return the process ids of all descendants."""
    children: dict[int, list[int]] = {}
    for folder in _PROCESSES.iterdir():
        if folder.name.isdecimal():
            parent = _status_number(folder / "status", "PPid")
            children.setdefault(parent or 0, []).append(int(folder.name))
    descendants, pending = list[int](), [process]
    while pending:
        started = children.get(pending.pop(), [])
        descendants += started
        pending += started
    return descendants


def _status_bytes(status: Path, name: str) -> int | None:
    number = _status_number(status, name)
    return None if number is None else 1024 * number


def _status_number(status: Path, name: str) -> int | None:
    """Return a number in the status of a process, or None if it has ended."""
    try:
        lines = status.read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError:
        return None
    words = next((line.split() for line in lines if line.startswith(f"{name}:")), None)
    return int(words[1]) if words else None


def _used(*, of_children: bool) -> int | None:
    if sys.platform == "win32":
        return None
    import resource  # noqa: PLC0415  (not available on Windows)

    whose = resource.RUSAGE_CHILDREN if of_children else resource.RUSAGE_SELF
    peak = resource.getrusage(whose).ru_maxrss
    return peak if sys.platform == "darwin" else 1024 * peak

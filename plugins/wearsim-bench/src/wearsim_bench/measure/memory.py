"""The most memory that processes have held at a time, as their system counts it."""

from __future__ import annotations

import os
import sys
from pathlib import Path

_PROCESSES = Path("/proc")


def peak_bytes() -> int | None:
    """Return the most memory that this process has held at a time, or None where none is told.

    Linux keeps a process's peak in its status. `getrusage` has one as well, but begins with that of
    the process which started this one; elsewhere there is nothing else.
    """
    own = _status_bytes(_PROCESSES / "self" / "status", "VmHWM")
    return own if own is not None else _used(of_children=False)


def family_peak_bytes(workers: int) -> int | None:
    """Return the sum of such peaks over this process and those that it has started.

    Pages that several of them share count once for each.

    Parameters
    ----------
    workers : int
        How many there are; where only the largest of them is told, each counts like it.
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
    """Return all that a process has started, and what they have started in turn."""
    children: dict[int, list[int]] = {}
    for folder in _PROCESSES.iterdir():
        if folder.name.isdecimal():
            parent = _status_number(folder / "status", "PPid")
            children.setdefault(parent or 0, []).append(int(folder.name))
    found, ahead = list[int](), [process]
    while ahead:
        own = children.get(ahead.pop(), [])
        found += own
        ahead += own
    return found


def _status_bytes(status: Path, name: str) -> int | None:
    number = _status_number(status, name)
    return None if number is None else 1024 * number


def _status_number(status: Path, name: str) -> int | None:
    """Return a number of a process's status, or None where there is none or it has ended."""
    try:
        lines = status.read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError:
        return None
    words = next((line.split() for line in lines if line.startswith(f"{name}:")), None)
    return int(words[1]) if words else None


def _used(*, of_children: bool) -> int | None:
    if sys.platform == "win32":
        return None
    import resource  # noqa: PLC0415  (Windows has none)

    whose = resource.RUSAGE_CHILDREN if of_children else resource.RUSAGE_SELF
    peak = resource.getrusage(whose).ru_maxrss
    return peak if sys.platform == "darwin" else 1024 * peak

"""Peak memory of processes, as reported by the operating system."""

from __future__ import annotations

import os
import re
import sys
from pathlib import Path

import psutil


def peak_bytes() -> int | None:
    """Return the peak memory of this process [bytes], or None if it is not available.

    Linux reports it in the status of the process. `getrusage`, used on other systems, starts with
    the peak of the parent process.
    """
    peak = _peak_in_status(os.getpid())
    return peak if peak is not None else _used(of_children=False)


def family_peak_bytes(workers: int) -> int | None:
    """Return the sum of the peaks of this process and its descendants [bytes].

    Shared pages are counted for every process.

    Parameters
    ----------
    workers : int
        Number of worker processes; used where only the peak of the largest process is available.
    """
    peak = peak_bytes()
    if peak is None:
        return None
    if _peak_in_status(os.getpid()) is not None:
        descendants = psutil.Process().children(recursive=True)
        return peak + sum(_peak_in_status(process.pid) or 0 for process in descendants)
    return peak + workers * (_used(of_children=True) or 0)


def _peak_in_status(process: int) -> int | None:
    """Return the peak of a process [bytes], or None if it has ended or Linux does not report it."""
    try:
        lines = Path(f"/proc/{process}/status").read_text(encoding="utf-8", errors="replace")
    except OSError:
        return None
    match = re.search(r"^VmHWM:\s+(\d+) kB", lines, re.MULTILINE)
    return 1024 * int(match[1]) if match else None


def _used(*, of_children: bool) -> int | None:
    if sys.platform == "win32":
        return None
    import resource  # noqa: PLC0415  (not available on Windows)

    whose = resource.RUSAGE_CHILDREN if of_children else resource.RUSAGE_SELF
    peak = resource.getrusage(whose).ru_maxrss
    return peak if sys.platform == "darwin" else 1024 * peak

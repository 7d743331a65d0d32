"""Rows of the report, how they are timed, and the machine they were timed on."""

from __future__ import annotations

import os
import platform
import time
from collections.abc import Callable
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path


@dataclass(frozen=True)
class Row:
    """One line of the report: what was measured, what was asked, and the error beside it."""

    what: str
    seconds: float
    asked: str = ""
    error: str = ""

    def __str__(self) -> str:
        return f"| {self.what} | {lapse(self.seconds)} | {self.asked} | {self.error} |"


@dataclass(frozen=True)
class Effort:
    """How much to spend: repetitions of each timing, and the part of a test's passes to run."""

    repetitions: int = 5
    part: float = 1.0

    @property
    def quick(self) -> bool:
        """Whether the numbers only show that the report works."""
        return self.part < 1.0


def best(function: Callable[[], object], repetitions: int) -> float:
    """Return the least wall time of `function` [s], after one call that is not counted."""
    function()
    return min(timed(function) for _ in range(repetitions))


def best_short(function: Callable[[], object], repetitions: int) -> float:
    """Return the least mean wall time [s] of a function too short to be timed by itself."""
    function()
    calls = max(1, int(0.02 / max(timed(function), 1e-7)))

    def many() -> None:
        for _ in range(calls):
            function()

    return min(timed(many) for _ in range(repetitions)) / calls


def timed(function: Callable[[], object]) -> float:
    """Return the wall time of one call [s]."""
    start = time.perf_counter()
    function()
    return time.perf_counter() - start


def lapse(seconds: float) -> str:
    """Return a time with three digits and a unit that suits it."""
    for unit, scale in (("s", 1.0), ("ms", 1e3)):
        if seconds * scale >= 1.0:
            return f"{seconds * scale:.3g} {unit}"
    return f"{seconds * 1e6:.3g} us"


def part(value: float) -> str:
    """Return a relative error as a signed percentage."""
    return f"{100.0 * value:+.2g} %"


def machine() -> str:
    """Name the processor, its cores as given to this process, Python and the libraries."""
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    libraries = ", ".join(f"{name} {version(name)}" for name in ("numba", "numpy", "wearsim"))
    return f"{_processor()}, {cores} cores, Python {platform.python_version()}, {libraries}"


def _processor() -> str:
    cpuinfo = Path("/proc/cpuinfo")
    if cpuinfo.exists():
        for line in cpuinfo.read_text().splitlines():
            if line.startswith("model name"):
                return line.split(":", 1)[1].strip()
    return platform.processor() or platform.machine()


def markdown(title: str, rows: list[Row]) -> str:
    """Return rows as a Markdown table under a title."""
    head = "| what | measured | asked | error beside it |\n|---|---|---|---|\n"
    return f"## {title}\n\n{head}" + "".join(f"{row}\n" for row in rows)

"""What a benchmark ran on: the processor, the libraries, and a yardstick to compare machines by."""

from __future__ import annotations

import os
import platform
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path

import numpy as np

from wearsim.mechanics.numerics.jit import kernel
from wearsim.types import FloatArray
from wearsim_bench.measure.timing import best_short

LIBRARIES = ("wearsim", "numba", "numpy", "scipy")
_SIZE, _SWEEPS = 128, 16


@dataclass(frozen=True)
class Machine:
    """A machine, as far as timings depend on it.

    Parameters
    ----------
    processor : str
    cores : int
        As many as this process may use.
    python : str
    libraries : dict of str to str
        Versions by name.
    yardstick : float
        Least time of a fixed piece of compiled arithmetic on one core [s].
    """

    processor: str
    cores: int
    python: str
    libraries: dict[str, str]
    yardstick: float

    def __str__(self) -> str:
        libraries = ", ".join(f"{name} {number}" for name, number in self.libraries.items())
        return f"{self.processor}, {self.cores} cores, Python {self.python}, {libraries}"


def this_machine(repetitions: int = 5) -> Machine:
    """Return the machine that this process runs on, its yardstick measured.

    Parameters
    ----------
    repetitions : int
        Of the yardstick; the least counts.
    """
    libraries = {name: version(name) for name in LIBRARIES}
    seconds = yardstick_seconds(repetitions)
    return Machine(_processor(), cores(), platform.python_version(), libraries, seconds)


def cores() -> int:
    """Return how many processors this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def yardstick_seconds(repetitions: int) -> float:
    """Return the least time of the yardstick [s]: some 0.3 million multiplications and divisions.

    Parameters
    ----------
    repetitions : int
    """
    matrix, vector = np.ones((_SIZE, _SIZE)), np.ones(_SIZE)
    return best_short(lambda: yardstick(matrix, vector, _SWEEPS), repetitions)


@kernel
def yardstick(matrix: FloatArray, vector: FloatArray, sweeps: int) -> float:
    """Return the norm after some sweeps of x <- M x / |x|: what a contact's kernel is made of.

    Parameters
    ----------
    matrix : ndarray, shape (n, n)
    vector : ndarray, shape (n,)
        A start, which is overwritten.
    sweeps : int
    """
    n = vector.shape[0]
    held, norm = np.empty(n), 0.0
    for _ in range(sweeps):
        for i in range(n):
            held[i] = 0.0
        for j in range(n):
            for i in range(n):
                held[i] += matrix[j, i] * vector[j]
        norm = 0.0
        for i in range(n):
            norm += held[i] * held[i]
        norm = np.sqrt(norm)
        for i in range(n):
            vector[i] = held[i] / norm
    return norm


def _processor() -> str:
    cpuinfo = Path("/proc/cpuinfo")
    if cpuinfo.exists():
        for line in cpuinfo.read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                return line.split(":", 1)[1].strip()
    return platform.processor() or platform.machine()

"""Machine of a benchmark: processor, libraries, and a reference time for comparisons."""

from __future__ import annotations

import platform
from dataclasses import dataclass
from datetime import date
from importlib.metadata import version
from pathlib import Path

import numpy as np

from wearsim.mechanics.numerics.jit import kernel
from wearsim.operating_system import processors
from wearsim.types import FloatArray
from wearsim_bench.measure.timing import best_short

LIBRARIES = ("wearsim", "numba", "numpy", "scipy")
_SIZE, _SWEEPS = 128, 16


@dataclass(frozen=True)
class Machine:
    """Properties of a machine that affect timings.

    Parameters
    ----------
    processor : str
        Name of the processor.
    cores : int
        Number of cores available to this process.
    python : str
        Version of Python.
    libraries : dict of str to str
        Versions of the libraries by name.
    yardstick : float
        Smallest time of a fixed compiled computation on one core [s].
    date : str
        Date of the measurement, "2026-11-22".
    """

    processor: str
    cores: int
    python: str
    libraries: dict[str, str]
    yardstick: float
    date: str

    def __str__(self) -> str:
        libraries = ", ".join(f"{name} {number}" for name, number in self.libraries.items())
        return f"{self.processor}, {self.cores} cores, Python {self.python}, {libraries}"


def this_machine(repetitions: int = 5) -> Machine:
    """Return the machine of this process, with the measured yardstick.

    Parameters
    ----------
    repetitions : int
        Repetitions of the yardstick; the smallest time is used.
    """
    libraries = {name: version(name) for name in LIBRARIES}
    seconds = yardstick_seconds(repetitions)
    return Machine(
        _processor(),
        processors(),
        platform.python_version(),
        libraries,
        seconds,
        date.today().isoformat(),
    )


def yardstick_seconds(repetitions: int) -> float:
    """Return the smallest time of the yardstick [s], some 0.3 million multiplications."""
    matrix, vector = np.ones((_SIZE, _SIZE)), np.ones(_SIZE)
    return best_short(lambda: yardstick(matrix, vector, _SWEEPS), repetitions)


@kernel
def yardstick(matrix: FloatArray, vector: FloatArray, sweeps: int) -> float:
    """Return the norm after some sweeps of x <- M x / |x|, an operation typical of contact kernels.

    Parameters
    ----------
    matrix : ndarray, shape (n, n)
        M.
    vector : ndarray, shape (n,)
        Initial x, overwritten.
    sweeps : int
        Number of sweeps.
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

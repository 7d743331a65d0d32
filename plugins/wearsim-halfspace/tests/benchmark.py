"""Time, memory and error of the half-space solver, as a Markdown table.

``OMP_NUM_THREADS=1 python plugins/wearsim-halfspace/tests/benchmark.py`` on an idle machine. Each
time is the shortest of several solutions from nothing: influence coefficients, pressure and
tractions, at a tolerance of 1e-6.
"""

from __future__ import annotations

import math
import sys
import tracemalloc
from collections.abc import Callable
from statistics import median
from time import perf_counter

from halfspace_cases import HARD, RANDOM, normal_of, problem_of, solved

MEAN = {
    "A_per_m": 22.5,
    "B_per_m": 0.5,
    "a_m": 1.7173473898160382e-4,
    "b_m": 1.9464336537534505e-3,
    "N_N": 300.0,
    "mu": 0.1,
}
SPIN = 4e-4, 5e-4, 0.05
#: creepages, times of CONTACT with 50 and with 100 elements on one core [ms], order of the elements
CASES = {
    "normal problem": (None, (6.9, 27.1), 2),
    "full slip": ((1e-3, 0.0, 0.0), (99.1, 356.0), 2),
    "partial slip with spin": (SPIN, (201.0, 1496.0), 2),
    "partial slip with spin, order 1": (SPIN, (201.0, 1496.0), 1),
}


def work_of(
    creepage: tuple[float, float, float] | None, n: int, order: int
) -> Callable[[], object]:
    """Return a function that solves the contact of the mean problem."""
    xi, eta, phi = creepage or (0.0, 0.0, 0.0)
    case = {**MEAN, "xi": xi, "eta": eta, "phi_per_m": phi}
    if creepage is None:
        return lambda: normal_of(problem_of(case, n), case, 1e-6)
    return lambda: solved(case, n, order=order)


def measured(work: Callable[[], object], repetitions: int) -> tuple[float, float]:
    """Return the shortest time [s] and the peak memory [B] of a function."""
    times = []
    for _ in range(repetitions):
        start = perf_counter()
        work()
        times.append(perf_counter() - start)
    tracemalloc.start()
    work()
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    return min(times), peak


def put(line: str) -> None:
    """Write a line of the table at once."""
    sys.stdout.write(line + "\n")
    sys.stdout.flush()


def main() -> None:
    """Print times and memory, and the differences from CONTACT."""
    put("| case | elements | time | CONTACT | order of time | memory |\n|---|---|---|---|---|---|")
    for name, (creepage, known, order) in CASES.items():
        before = None
        for n, contact in zip((25, 50, 100, 200), (None, *known, None), strict=True):
            seconds, memory = measured(work_of(creepage, n, order), 20 if n < 100 else 3)
            growth = "-" if before is None else f"{math.log2(seconds / before):.1f}"
            other, before = "-" if contact is None else f"{contact:.3g} ms", seconds
            cells = f"{n} x {n} | {1e3 * seconds:.3g} ms | {other} | {growth}"
            put(f"| {name} | {cells} | {memory / 1e6:.3g} MB |")
    if "--errors" in sys.argv:
        put("\n| contacts | 60 x 60 | 120 x 120 | median order |\n|---|---|---|---|")
        for name, cases in (("40 random", RANDOM), ("20 hard", HARD)):
            powers = {n: [solved(case, n).work().power for case in cases] for n in (30, 60, 120)}
            worst = [
                max(
                    abs(power / case[f"power_{n}_N"] - 1)
                    for power, case in zip(powers[n], cases, strict=True)
                )
                for n in (60, 120)
            ]
            orders = [
                math.log2(abs((coarse - middle) / (middle - fine)))
                for coarse, middle, fine in zip(*powers.values(), strict=True)
            ]
            cells = f"{worst[0]:.1e} | {worst[1]:.1e} | {median(orders):.2f}"
            put(f"| {name}, greatest difference of power | {cells} |")


if __name__ == "__main__":
    main()

"""Runs of several methods timed in turns, and the comparison of their times and errors."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from statistics import median

from wearsim_bench.measure.measurement import Measurement
from wearsim_bench.stepping.runs import EndState

ROUNDS = 7
LONG = 1.0  # s, a method that takes longer is timed once
TIE = 1.05  # times and errors within this factor are equal
NEGLIGIBLE = 1e-6  # errors below it are equal
UNBEATEN = "not dominated"
NOTABLE = 5e-5  # profile error from which on a solver is compared


@dataclass
class TimedRun:
    """A method with one setting, its measurement and its times.

    Parameters
    ----------
    row : Measurement
        Errors and counts, without the time.
    run : callable
        Steps the test to its end.
    times : list of float
        Times of the rounds [s]; empty if the method failed.
    """

    row: Measurement
    run: Callable[[], EndState]
    times: list[float] = field(default_factory=list)

    @property
    def measurement(self) -> Measurement:
        """The measurement, with the median of the times."""
        return replace(self.row, seconds=median(self.times)) if self.times else self.row


def timed(run: Callable[[], EndState]) -> tuple[EndState, float]:
    """Return the result of a run and its time [s]."""
    start = time.perf_counter()
    end = run()
    return end, time.perf_counter() - start


def add_rounds(runs: Sequence[TimedRun], rounds: int) -> None:
    """Time all runs in turns until each has `rounds` times, except for long ones.

    Parameters
    ----------
    runs : sequence of TimedRun
        Each with at most one time, of the first round.
    rounds : int
        Number of rounds with the first one.
    """
    short = [run for run in runs if run.times and run.times[0] <= LONG]
    for _ in range(rounds - 1):
        for run in short:
            run.times.append(timed(run.run)[1])


@dataclass(frozen=True)
class Comparison:
    """Time and errors of a setting of the stepper relative to those of a solver.

    Parameters
    ----------
    setting : str
        Setting of the stepper.
    ratios : mapping of str to float
        Ratios of time and errors; errors below `NEGLIGIBLE` are counted as that.
    """

    setting: str
    ratios: Mapping[str, float]

    @property
    def dominates(self) -> bool:
        """Whether the stepper is as fast and as accurate as the solver, within `TIE`."""
        return max(self.ratios.values()) <= TIE

    def __str__(self) -> str:
        largest = max(self.ratios, key=lambda name: self.ratios[name])
        if self.dominates:
            return f"dominated by {self.setting}, {self.ratios['time']:.2g} x time"
        return f"{UNBEATEN}; nearest {self.setting}, {self.ratios[largest]:.3g} x {largest}"


def comparison(stepper: TimedRun, solver: TimedRun, name: str) -> Comparison:
    """Return the comparison of a stepper called `name` with a solver, by paired times."""
    pairs = zip(stepper.times, solver.times, strict=False)
    ratios = {"time": median(stepper_time / solver_time for stepper_time, solver_time in pairs)}
    for quantity, solver_error in solver.row.errors.items():
        stepper_error = stepper.row.errors[quantity]
        ratios[quantity] = max(stepper_error, NEGLIGIBLE) / max(solver_error, NEGLIGIBLE)
    parts = stepper.row.method.removeprefix(name).lstrip(", "), stepper.row.setting
    return Comparison(", ".join(filter(None, parts)), ratios)


def compared(runs: Sequence[TimedRun], stepper: str, solvers: Sequence[str]) -> list[TimedRun]:
    """Return the runs, with a remark on every solver of more than the least profile error.

    Parameters
    ----------
    runs : sequence of TimedRun
        All runs of a group.
    stepper : str
        Name of the stepper that they are compared with.
    solvers : sequence of str
        Starts of the names of the solvers.
    """
    stepper_runs = [run for run in runs if run.times and run.row.method.startswith(stepper)]
    remarked = []
    for run in runs:
        notable = run.row.errors.get("profile", 0.0) >= NOTABLE
        if stepper_runs and run.times and notable and run.row.method.startswith(tuple(solvers)):
            comparisons = [comparison(stepper_run, run, stepper) for stepper_run in stepper_runs]
            dominating = [item for item in comparisons if item.dominates]
            chosen = (
                min(dominating, key=lambda item: item.ratios["time"])
                if dominating
                else min(comparisons, key=lambda item: max(item.ratios.values()))
            )
            remarked.append(replace(run, row=replace(run.row, remark=str(chosen))))
        else:
            remarked.append(run)
    return remarked


def conclusion(rows: Sequence[Measurement], tolerance: float) -> str:
    """Return sentences on the solvers of a group, and on the tolerance of the default.

    Parameters
    ----------
    rows : sequence of Measurement
        All measurements of the group.
    tolerance : float
        Tolerance of the default.
    """
    remarks = [row for row in rows if row.remark]
    remaining = [row for row in remarks if row.remark.startswith(UNBEATEN)]
    sentences = []
    if remarks:
        names = "; ".join(f"{row.method}, {row.setting}" for row in remaining)
        not_dominated = f"{len(remaining)} are not: {names}" if remaining else "all of them"
        sentences.append(
            f"Dominated by the default stepper, of {len(remarks)} settings of LSODA and BDF with a"
            f" profile error of {100.0 * NOTABLE:g} % or more: {not_dominated}."
        )
    for row in rows:
        if row.default and row.errors:
            beyond = [name for name, error in row.errors.items() if error > tolerance]
            excess = f", except in {' and '.join(beyond)}" if beyond else ""
            sentences.append(f"The default meets its tolerance of {tolerance:g}{excess}.")
    return " ".join(sentences)

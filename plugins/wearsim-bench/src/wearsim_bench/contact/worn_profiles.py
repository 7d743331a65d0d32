"""Errors and time of one contact model with one number of strips over a group of cases."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from wearsim.errors import ContactError, WearsimError
from wearsim.mechanics.slender.influence import curvature_table, influence_table
from wearsim.types import ContactSolution
from wearsim_bench.contact.accuracy import CaseErrors, errors_of, l2, rms, summed
from wearsim_bench.contact.cases import MATERIALS, Case
from wearsim_bench.contact.methods import Method
from wearsim_bench.exact_solutions import POWER_ERRORS
from wearsim_bench.measure.measurement import Measurement
from wearsim_bench.measure.timing import timed

_WARM_LOAD = 0.99  # load of the warm start, relative to that of the case
_ENOUGH = 1.0  # s, after which solves are not repeated: the times of slow models vary less
_SAME_LOADS = 1e-5  # L2 difference allowed between line loads of warm and cold starts
#: allowed difference of power: in pure spin, line loads that differ by 1e-8 change it by 1e-4
_SAME_POWER = POWER_ERRORS[0]
_TABLES = (influence_table, curvature_table)  # cached tables for a number of strips


@dataclass(frozen=True)
class _Solved:
    """A solved case: functions for cold and warm starts, errors, and preparation time."""

    cold: Callable[[], ContactSolution]
    warm: Callable[[], ContactSolution] | None
    errors: CaseErrors
    preparing: float


def measure(
    group: str, cases: Sequence[Case], method: Method, strips: int, repetitions: int
) -> Measurement:
    """Return the errors of a method over a group of cases, and the mean time of one solve.

    Parameters
    ----------
    group : str
        Name of the group.
    cases : sequence of Case
        The contacts.
    method : Method
        The contact model.
    strips : int
        Number of strips.
    repetitions : int
        Repetitions of every solve; the smallest time is used.

    Returns
    -------
    Measurement
        Without times and errors if a case fails, since the other cases may be easier.
    """
    solved, failures = [], []
    for table in _TABLES:
        table.cache_clear()
    for case in cases:
        try:
            solved.append(_solve(case, method, strips))
        except Exception as error:  # a faulty plugin must not stop the benchmark
            failures.append(f"{case.name}: {failure_reason(error)}")
    setting = method.setting(strips)
    if failures:
        reason = failures[0]
        if len(cases) > 1:
            reason = f"{len(failures)} of {len(cases)} fail; {reason}"
        return Measurement(group, method.name, setting, failed=reason)
    counts = {"prepare_seconds": solved[0].preparing}
    warm = [item.warm for item in solved if item.warm is not None]
    if warm:
        counts["warm_seconds"] = _mean_of_least(warm, repetitions)
    seconds = _mean_of_least([item.cold for item in solved], repetitions)
    return Measurement(group, method.name, setting).with_results(seconds, _summed(solved), counts)


def failure_reason(error: Exception) -> str:
    """Return an error in one line; errors other than WearsimError with their type."""
    line = (str(error).strip().splitlines() or [""])[0]
    if isinstance(error, WearsimError):
        return line.split(";", maxsplit=1)[0]
    return f"raised {type(error).__name__}: {line}"


def _solve(case: Case, method: Method, strips: int) -> _Solved:
    choice, built = method.choice(strips), []
    grid = case.grid(choice, strips)
    preparing = timed(lambda: built.append(choice.build(grid, MATERIALS)))
    (model,) = built
    gap, curvature, point = case.gap_at(grid.y), case.longitudinal_curvature, case.point

    def solve(warm: ContactSolution | None = None) -> ContactSolution:
        return model.solve_one(gap, curvature, point, None, warm)

    solution = solve()
    errors = errors_of(solution, grid, case)
    nearby = model.solve_one(
        gap, curvature, replace(point, normal_force=_WARM_LOAD * point.normal_force)
    )
    started = solve(nearby)
    used = started.iterations != solution.iterations or started.power != solution.power
    power = abs(started.power / solution.power - 1.0)
    loads = l2(started.line_load, solution.line_load)
    if not (power <= _SAME_POWER and loads <= _SAME_LOADS):  # also if NaN
        raise ContactError(
            f"the warm start changes the power by {power:.1e}, the line loads by {loads:.1e}",
            {"warm": started},
        )
    return _Solved(solve, (lambda: solve(nearby)) if used else None, errors, preparing)


def _mean_of_least(functions: Sequence[Callable[[], object]], repetitions: int) -> float:
    """Return the mean of the smallest times [s] of several functions, timed in rounds."""
    rounds = [[timed(function) for function in functions]]
    while len(rounds) < repetitions and float(np.sum(rounds)) < _ENOUGH:
        rounds.append([timed(function) for function in functions])
    return float(np.min(rounds, axis=0).mean())


def _summed(solved: Sequence[_Solved]) -> dict[str, float]:
    errors = [item.errors for item in solved]
    powers = summed(errors)
    return {
        "power": powers.rms,
        "worst_power": powers.worst,
        "dissipation": powers.strips,
        "width": rms(error.width for error in errors),
        "peak_pressure": rms(error.peak_pressure for error in errors),
    }

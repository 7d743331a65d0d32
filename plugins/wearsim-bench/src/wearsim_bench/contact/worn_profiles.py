"""One contact model on one number of strips: its errors over a group of cases, and its time."""

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

_LESS = 0.99  # of the load, under which a warm start was solved
_SAME_LOADS = 1e-5  # L2 of the line loads, within which a warm start must come to the cold one's
#: of the power: in pure spin loads that differ by 1e-8 are seen to change it by 1e-4
_SAME_POWER = POWER_ERRORS[0]
_TABLES = (influence_table, curvature_table)  # which a process makes once for a number of strips


@dataclass(frozen=True)
class _Solved:
    """A case that has an answer: how to have it again, from nothing and from one nearby."""

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
    method : Method
    strips : int
    repetitions : int
        Of every solve; the least time counts.

    Returns
    -------
    Measurement
        Without times and errors if one of the cases has no answer: the others may be easier.
    """
    solved, refused = [], []
    for known in _TABLES:
        known.cache_clear()
    for case in cases:
        try:
            solved.append(_solve(case, method, strips))
        except Exception as error:  # a mistake of a plugin is told, and stops nothing
            refused.append(f"{case.name}: {why(error)}")
    setting = method.setting(strips)
    if refused:
        told = refused[0]
        if len(cases) > 1:
            told = f"no answer to {len(refused)} of {len(cases)}; {told}"
        return Measurement(group, method.name, setting, failed=told)
    counts = {"prepare_seconds": solved[0].preparing}
    warm = [item.warm for item in solved if item.warm is not None]
    if warm:
        counts["warm_seconds"] = _mean_of_least(warm, repetitions)
    seconds = _mean_of_least([item.cold for item in solved], repetitions)
    return Measurement(group, method.name, setting).found(seconds, _summed(solved), counts)


def why(error: Exception) -> str:
    """Return in a line why there is no answer; what is no error of wearsim's is a mistake."""
    line = (str(error).strip().splitlines() or [""])[0]
    if isinstance(error, WearsimError):
        return line.split(";", maxsplit=1)[0]
    return f"raised {type(error).__name__}: {line}"


def _solve(case: Case, method: Method, strips: int) -> _Solved:
    model = method.build(strips)
    grid = case.grid(model, strips)
    preparing = timed(lambda: model.prepare(grid, MATERIALS))
    gap, curvature, point = case.gap_at(grid.y), case.longitudinal_curvature, case.point

    def solve(warm: ContactSolution | None = None) -> ContactSolution:
        return model.solve(gap, curvature, point, None, warm)

    solution = solve()
    errors = errors_of(solution, grid, case)
    less = model.solve(gap, curvature, replace(point, normal_force=_LESS * point.normal_force))
    started = solve(less)
    used = started.iterations != solution.iterations or started.power != solution.power
    power = abs(started.power / solution.power - 1.0)
    loads = l2(started.line_load, solution.line_load)
    if not (power <= _SAME_POWER and loads <= _SAME_LOADS):  # nor if it is no number
        told = f"by {power:.1e} in power, {loads:.1e} in line loads"
        raise ContactError(f"warm-started it comes to something else {told}", {"warm": started})
    return _Solved(solve, (lambda: solve(less)) if used else None, errors, preparing)


def _mean_of_least(functions: Sequence[Callable[[], object]], repetitions: int) -> float:
    """Return the mean of the least times [s], in rounds: a disturbance then spoils one of each."""
    rounds = [[timed(function) for function in functions] for _ in range(repetitions)]
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

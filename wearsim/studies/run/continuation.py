"""Continuation of runs: to limits, which are checked, and beyond the end of their scenario."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np

from wearsim.errors import ResultsFileError, ScenarioError, mistake_in
from wearsim.evolution.limits import OF_FATIGUE, SAME_VALUE, Limit
from wearsim.evolution.state import WearState
from wearsim.scenario import Scenario, parse_scenario
from wearsim.scenario.scenario import DEEPEST
from wearsim.studies.forecast import WearForecast
from wearsim.studies.run.assemble import assemble_problem
from wearsim.studies.run.draws import draw
from wearsim.studies.run.grid import start_of_run
from wearsim.studies.run.result import RunData
from wearsim.units import in_engineers_unit

EXTENSIONS = 10  # of a test that ends before its limit, each to twice its length
LONGER = 4.0  # times the test, from which on a limit gives a warning
PRESSURE = 2.0  # times the peak pressure of the fresh contact, which no groove reaches
_DEPTHS = ("depth", "roller depth", "lift error", "clearance")


def stored_scenario(data: RunData, passes: float | None = None) -> Scenario:
    """Return the scenario of a file, with another number of passes if given."""
    return parse_scenario(
        data.scenario_text,
        data.scenario_file,
        data.files.__getitem__,
        None if passes is None else {"operation.passes": round(passes)},
    )


def with_end(scenario: Scenario, limit: Limit | None) -> tuple[Scenario, Limit | None]:
    """Return a scenario that lasts until a limit of time or passes, and the limit if it is needed.

    A test that ends with its limit needs no limit.
    """
    if limit is None or limit.quantity not in {"time", "passes"}:
        return scenario, limit
    override: dict[str, object] = (
        {"operation.passes": round(limit.value)}
        if limit.quantity == "passes"
        else {"operation.duration": f"{limit.value!r} s"}
    )
    ended = parse_scenario(scenario.text, scenario.file, scenario.files.__getitem__, override)
    if ended.total_passes < scenario.total_passes:
        # a time is rounded to whole passes, as the duration of a scenario
        return scenario, Limit("passes", float(ended.total_passes), limit.text)
    return (scenario if ended.total_passes == scenario.total_passes else ended), None


def earlier_warnings(data: RunData) -> list[str]:
    """Return the warnings of a run that is continued, without those on its end."""
    return [text for text in data.warnings if not text.startswith(("estimated error of", "limit "))]


def last_value(data: RunData, limit: Limit) -> float:
    """Return the last value of the quantity of a limit, the greatest of several rollers."""
    return float(np.max(data.history[limit.variable][-1]))


def is_at_limit(path: Path, data: RunData, limit: Limit | None) -> bool:
    """Return whether a run has reached a limit.

    Raises
    ------
    ResultsFileError
        If it is past the limit.
    """
    if limit is None:
        return False
    last = last_value(data, limit)
    if last > limit.value * (1.0 + SAME_VALUE):
        raise ResultsFileError(
            f"{path}: the test has already reached {written_value(limit, last)}, which is past"
            f" {written_value(limit, limit.value)}",
            python="give a later until",
            shell="give a later --until",
        )
    return last >= limit.value * (1.0 - SAME_VALUE)


def written_value(limit: Limit, value: float) -> str:
    """Return a value of the quantity of a limit as text."""
    if limit.quantity == "passes":
        return f"{value:.0f} passes"
    if limit.quantity in OF_FATIGUE:
        return f"{limit.quantity} {value:.6g}"
    text = f"{value * 1e6:.6g} um" if limit.unit == "m" else in_engineers_unit(value, limit.unit, 6)
    return text if limit.quantity == "time" else f"{limit.quantity} {text}"


def without_limit_rows(data: RunData, state: WearState) -> RunData:
    """Return the data of a run without the rows after its checkpoint, written at a limit."""
    passes = float(state.passes[0])
    steps = data.history["passes"] <= passes
    records = data.records["record_passes"] <= passes
    return replace(
        data,
        history={name: array[steps] for name, array in data.history.items()},
        records={name: array[records] for name, array in data.records.items()},
    )


def limit_warnings(scenario: Scenario, limit: Limit) -> list[str]:
    """Return a warning if a run takes several times its test to reach a limit.

    Parameters
    ----------
    scenario : Scenario
    limit : Limit

    Raises
    ------
    ScenarioError
        If the limit is beyond the validity of the models, or no run of `EXTENSIONS` extensions
        reaches it, as forecast.
    """
    if limit.quantity in OF_FATIGUE and scenario.fatigue is None:
        raise _refusal(
            scenario, limit, "needs the fatigue of the bodies", "a table [fatigue] in the scenario"
        )
    if limit.quantity in {"time", "passes", *OF_FATIGUE}:
        return []
    roller, deep = scenario.roller, DEEPEST * scenario.roller.radius
    if not scenario.evolution.allow_deep:
        most, what = (
            math.inf,
            f"which is {DEEPEST:g} times roller.radius = {1e3 * roller.radius:g} mm",
        )
        if limit.quantity in _DEPTHS:
            most, shown = deep, f"{1e3 * deep:.4g} mm"
        elif limit.quantity == "width":
            most = 2.0 * float(scenario.axial_gap.half_width(deep))
            shown = f"{1e3 * most:.4g} mm, a groove of a depth of {1e3 * deep:.4g} mm"
        if limit.value > most:
            raise _refusal(
                scenario,
                limit,
                "is beyond the validity of the contact models",
                f"at most {shown}, {what}, or evolution.allow_deep = true",
            )
    setup = draw(scenario)
    forecast = WearForecast(
        setup.scenario, assemble_problem(setup, start_of_run(scenario, setup))[0]
    )
    test, name = float(scenario.total_passes), limit.variable
    name = {"worn_volume": "volume", "descent": "clearance"}.get(name, name)
    fresh, end = forecast.at(1.0), forecast.at(test)
    if limit.quantity == "peak pressure":
        greatest = max(fresh[name], end[name])
        if limit.value > PRESSURE * greatest:
            raise _refusal(
                scenario,
                limit,
                f"is far above the pressures of the test, {greatest / 1e6:.4g} MPa at most",
                "a lower pressure",
            )
        if limit.value <= fresh[name]:
            raise _refusal(
                scenario,
                limit,
                "is below the pressure of the unworn contact, where the test would end at once",
                f"above {fresh[name] / 1e6:.4g} MPa",
            )
        if limit.value <= greatest:
            return []
        course = f"{fresh[name] / 1e6:.3g} MPa at the start and about {end[name] / 1e6:.3g} MPa"
        return [f"until: {limit.text} may never be reached, with {course} at the end of the test"]
    if end.get(name, 0.0) <= 0.0:
        return []  # nothing is worn, which the run states
    times = 1.0
    while forecast.at(times * test)[name] < limit.value:
        times *= 2.0
        if times > 2.0**EXTENSIONS:
            last = written_value(limit, end[name])
            raise _refusal(
                scenario,
                limit,
                f"is not reached in {2**EXTENSIONS} times the test, whose end has about {last}",
                "a lower limit, or a longer test",
            )
    if times <= LONGER:
        return []
    last = written_value(limit, float(f"{end[name]:.2g}"))
    return [f"until: {limit.text} would take about {times:g} times the test, which ends at {last}"]


def _refusal(scenario: Scenario, limit: Limit, what: str, expected: str) -> ScenarioError:
    return mistake_in(scenario.file, what, limit.text, expected, key="the limit of the run (until)")

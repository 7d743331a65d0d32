"""Continuation of runs from their files: to limits, and beyond the end of their scenario."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from wearsim.errors import ResultsFileError
from wearsim.evolution.limits import SAME_VALUE, Limit
from wearsim.evolution.state import WearState
from wearsim.results import RunData
from wearsim.scenario import Scenario, parse_scenario
from wearsim.units import in_engineers_unit


def stored_scenario(data: RunData, passes: float | None = None) -> Scenario:
    """Return the scenario of a file, with another number of passes if given."""
    overrides = None if passes is None else {"operation.passes": round(passes)}
    return parse_scenario(data.scenario_text, data.scenario_file, data.files.__getitem__, overrides)


def with_end(scenario: Scenario, limit: Limit | None) -> tuple[Scenario, Limit | None]:
    """Return a scenario that lasts until a limit of time or passes, and the limit if it is needed.

    A test that ends with its limit needs no limit.
    """
    if limit is None or limit.quantity not in {"time", "passes"}:
        return scenario, limit
    override: dict[str, object] = {"operation.duration": f"{limit.value!r} s"}
    if limit.quantity == "passes":
        override = {"operation.passes": round(limit.value)}
    files = scenario.files.__getitem__
    ended = parse_scenario(scenario.text, scenario.file, files, override)
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
    text = in_engineers_unit(value, limit.unit, 6)
    if limit.unit == "m":
        text = f"{value * 1e6:.6g} um"
    return text if limit.quantity == "time" else f"{limit.quantity} {text}"


def without_limit_rows(data: RunData, state: WearState) -> RunData:
    """Return the data of a run without the rows after its checkpoint, those at a limit."""
    passes = float(state.passes[0])
    steps = data.history["passes"] <= passes
    records = data.records["record_passes"] <= passes
    return replace(
        data,
        history={name: array[steps] for name, array in data.history.items()},
        records={name: array[records] for name, array in data.records.items()},
    )

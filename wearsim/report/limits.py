"""Limits of [limit] in the summary of a run: reached or not, when, and by how much."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from wearsim.errors import WearsimError
from wearsim.evolution.limits import SAME_VALUE, Limit
from wearsim.report.text import count, in_unit, shown, simulated
from wearsim.results import Result

_UNITS = {"volume": "mm^3", "peak_pressure": "MPa", "width": "mm"}  # the others in um


def limits_json(result: Result) -> list[dict[str, Any]]:
    """Return the limits of a run's scenario and how far the run is from them, in SI units."""
    try:
        given: Mapping[str, float] = result.scenario.limit.given
    except WearsimError:  # a plugin of the scenario is not installed
        return []
    return [_of(result, key, value) for key, value in given.items()]


def _of(result: Result, key: str, value: float) -> dict[str, Any]:
    limit = Limit(key.replace("_", " "), value, key)
    history = np.asarray(result.values(limit.variable), dtype=float)
    course = history.reshape(len(history), -1).max(axis=1)
    passes = np.asarray(result.passes, dtype=float)
    above = np.flatnonzero(course >= value * (1.0 - SAME_VALUE))
    reached = None
    if len(above):
        place = int(above[0])
        reached = float(passes[place])
        if place:
            low, high = course[place - 1 : place + 1]
            part = (value - low) / (high - low) if high > low else 1.0
            reached = float(np.interp(part, [0.0, 1.0], passes[place - 1 : place + 1]))
    return {
        "quantity": key,
        "unit": limit.unit,
        "limit": value,
        "at_end": float(course[-1]),
        "reached": reached is not None,
        "reached_at_passes": reached,
        "excess": float(course[-1] / value - 1.0),
    }


def limit_rows(result: Result) -> list[tuple[str, str]]:
    """Return a row for each limit of [limit]: passed or not, when, and by how much."""
    rows = []
    for item in limits_json(result):
        unit = _UNITS.get(item["quantity"], "um")
        end = f"{in_unit(item['at_end'], unit)} of {shown(item['limit'], unit)}"
        name = item["quantity"].replace("_", " ")
        by = f"{abs(100.0 * item['excess']):.3g} %"
        if not item["reached"]:
            rows.append((f"limit of {name}", f"not reached: {end} at the end, {by} below"))
            continue
        passes = item["reached_at_passes"]
        when = f"{count(round(passes))} passes"
        if "station_angle" in result.raw.static:
            when = f"{count(round(passes / result.raw.kinematics['physical_rollers']))} turns"
        time = simulated(passes / result.raw.kinematics["pass_rate"])
        side = "above" if item["excess"] >= 0.0 else "below"
        rows.append(
            (
                f"limit of {name}",
                f"reached after about {when}, {time}: {end} at the end, {by} {side}",
            )
        )
    return rows

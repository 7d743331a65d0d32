"""Scenarios as notebooks show them: keys as written, and the bodies before wear."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from wearsim.report.notebook import table_html
from wearsim.report.panels import Axis, Line, Panel
from wearsim.report.view import Row
from wearsim.scenario.parse.overrides import flat

if TYPE_CHECKING:
    from wearsim.scenario.scenario import Scenario

_LONGEST = 60  # characters of a value


def scenario_html(scenario: Scenario) -> str:
    """Return a scenario as HTML: its keys, and the unworn bodies; the latter not of a cam.

    Parameters
    ----------
    scenario : Scenario
    """
    random = {key: item.describe() for item in scenario.random for key in item.keys}
    inner = tuple(f"{key}." for key in random)
    texts = {
        key: _value(value)
        for key, value in flat(tomllib.loads(scenario.text))
        if not key.startswith(inner)
    } | random
    rows = [Row(key, text) for key, text in texts.items() if key != "title"]
    return table_html(scenario.title, rows, None if scenario.cam else _bodies(scenario))


def _value(value: object) -> str:
    """Return a value of a scenario on one line."""
    if isinstance(value, Mapping):
        return " ".join(map(_value, value.values()))
    if isinstance(value, list):
        text = "; ".join(map(_value, value))
        return text if len(text) <= _LONGEST else f"{text[:_LONGEST]}..."
    return str(value).lower() if isinstance(value, bool) else str(value)


def _bodies(scenario: Scenario) -> Panel:
    """Return the surfaces of cylinder and roller across the track before wear."""
    gap, width = scenario.axial_gap, scenario.roller.width
    profile = scenario.cylinder.profile
    # where the bodies are 50 um apart, or the roller ends
    half = min(float(gap.half_width(50e-6)), 0.5 * width if width else np.inf)
    y = np.linspace(-half, half, 201)
    height = 0.0 if profile is None else np.interp(y, profile.y, profile.height)
    return Panel(
        "Bodies before wear",
        Axis("y", "mm"),
        Axis("height", "um"),
        [
            Line(y, gap.roller_drop(y), colour="#0072b2", label="roller"),
            Line(y, height - gap.cylinder_drop(y), colour="#b35900", label="cylinder"),
        ],
        "Heights of cylinder and roller across the track before wear.",
    )

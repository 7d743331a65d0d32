"""Scenarios as notebooks show them: keys as written, and the bodies before wear."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from wearsim.report.notebook import table_html
from wearsim.report.panels import Axis, Line, Panel
from wearsim.report.view import Row
from wearsim.scenario.parse.toml import flat

if TYPE_CHECKING:
    from wearsim.scenario.scenario import Scenario

_LONGEST = 60  # characters of a value


def scenario_html(scenario: Scenario) -> str:
    """Return a scenario as HTML: its keys, and the unworn bodies; the latter not of a cam.

    Parameters
    ----------
    scenario : Scenario
    """
    given = dict(flat(tomllib.loads(scenario.text)))
    random = {key: item.describe() for item in scenario.random for key in item.keys}
    inner = {key for key in given for name in random if key.startswith(f"{name}.")}
    rows = [(key, _value(value)) for key, value in given.items() if key not in inner]
    rows = [
        *((key, random.get(key, text)) for key, text in rows if key != "title"),
        *((key, text) for key, text in random.items() if key not in given),
    ]
    panel = None if scenario.cam else _bodies(scenario)
    return table_html(scenario.title, [Row(*row) for row in rows], panel)


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
    half = float(gap.half_width(50e-6))  # where the bodies are 50 um apart
    half = min(half, 0.5 * width) if width else half
    y = np.linspace(-half, half, 201)
    ground = np.zeros_like(y) if profile is None else np.interp(y, profile.y, profile.height)
    ground = ground - gap.cylinder_drop(y)
    axes = Axis("y", "mm"), Axis("height", "um")
    return Panel(
        "Bodies before wear",
        *axes,
        [
            Line(y, gap.roller_drop(y), colour="#0072b2", label="roller"),
            Line(y, ground, colour="#b35900", label="cylinder"),
        ],
        "Heights of cylinder and roller across the track before wear.",
    )

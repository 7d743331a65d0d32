"""Damage by fatigue as rows: of a run, and the laws with the sources of their constants."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from wearsim.errors import WearsimError
from wearsim.report.text import shown, with_error
from wearsim.report.view import Row, Rows

if TYPE_CHECKING:
    from wearsim.scenario import Scenario
    from wearsim.studies.run.result import Result

EXCLUDED = "fatigue (pitting)"  # by a study without the table [fatigue]


def has_fatigue(result: Result) -> bool:
    """Return whether a run has the damage of its bodies."""
    return "damage" in result.raw.history


def fatigue_rows(result: Result) -> Rows:
    """Return rows on damage and pitting at the end of a run; none without fatigue."""
    if not has_fatigue(result):
        return []
    final = result.final
    damage, error = (np.asarray(final[name], dtype=float) for name in ("damage", "damage_error"))
    greatest = f"cylinder {shown(_most(final['cylinder_damage']), '1')}"
    if result.is_cam:
        place = shown(_most(final["damage_angle_rad"]), "deg")
        greatest = f"cam {shown(_most(final['cylinder_damage']), '1')} at {place}"
    greatest += f", roller {shown(_most(final['roller_damage']), '1')}"
    return [
        Row("effective damage", with_error(damage, float(np.max(error)), "1")),
        Row("greatest damage", greatest),
        Row("probability of pitting", np.asarray(final["pitting"], dtype=float), "%"),
        *source_rows(_scenario(result)),
    ]


def _most(value: float | list[float]) -> float:
    return float(np.max(value))


def _scenario(result: Result) -> Scenario | None:
    try:
        return result.scenario
    except WearsimError:  # a plugin of the scenario is not installed
        return None


def source_rows(scenario: Scenario | None) -> Rows:
    """Return a row for each body that may pit: its fatigue law and the source of the constants."""
    if scenario is None or scenario.fatigue is None:
        return []
    names = {"cylinder": "cylinder" if scenario.cam is None else "cam", "roller": "rollers"}
    return [
        Row(f"fatigue of the {names[body]}", f"{law.law}; source: {law.source}")
        for body, law in scenario.fatigue.laws.items()
    ]


def sources(scenario: Scenario | None) -> dict[str, str]:
    """Return the sources of the constants of fatigue by body."""
    if scenario is None or scenario.fatigue is None:
        return {}
    return {body: law.source for body, law in scenario.fatigue.laws.items()}


def sources_of(result: Result) -> dict[str, str]:
    """Return the sources of the constants of fatigue of a run by body."""
    return sources(_scenario(result)) if has_fatigue(result) else {}


def source_line(result: Result) -> str:
    """Return fatigue laws and sources of a run as a further line of a figure; else nothing."""
    rows = source_rows(_scenario(result)) if has_fatigue(result) else []
    return "".join(f"\n{row.label}: {row.text}" for row in rows)

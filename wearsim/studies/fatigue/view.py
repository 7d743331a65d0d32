"""Damage by fatigue as rows: of a run, and the laws with the sources of their constants."""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import numpy as np

from wearsim.report.text import shown, with_error
from wearsim.report.view import Column, Row, Rows
from wearsim.studies.fatigue.observables import fatigue_scenario

if TYPE_CHECKING:
    from wearsim.results.content import StudyResult
    from wearsim.scenario import Scenario
    from wearsim.studies.run.result import Result


def fatigue_rows(result: Result, body: str) -> Rows:
    """Return rows on damage and pitting at the end of a run; none without fatigue.

    Parameters
    ----------
    result : Result
    body : str
        "cylinder" or "cam".
    """
    if not result.raw.fatigue:
        return []
    final = result.final
    angle = final.get("damage_angle_rad")
    place = "" if angle is None else f" at {shown(_most(angle), 'deg')}"
    damage, pitting = (
        with_error(np.asarray(final[name], dtype=float), _most(final[f"{name}_error"]), unit)
        for name, unit in (("damage", "1"), ("pitting", "%"))
    )
    return [
        Row("effective damage", damage),
        Row(
            "greatest damage",
            f"{body} {shown(_most(final['cylinder_damage']), '1', 3)}{place},"
            f" roller {shown(_most(final['roller_damage']), '1', 3)}",
        ),
        Row("probability of pitting", pitting),
        *source_rows(fatigue_scenario(result)),
    ]


def _most(value: float | list[float]) -> float:
    return float(np.max(value))


def source_rows(scenario: Scenario | None) -> Rows:
    """Return a row for each body that may pit: its fatigue law and the source of the constants."""
    if scenario is None or scenario.fatigue is None:
        return []
    names = {"cylinder": scenario.cylinder.name, "roller": "rollers"}
    return [
        Row(f"fatigue of the {names[body]}", f"{law.law}; source: {law.source}")
        for body, law in scenario.fatigue.laws.items()
    ]


def sources(scenario: Scenario | None) -> dict[str, str]:
    """Return the sources of the constants of fatigue by body."""
    if scenario is None or scenario.fatigue is None:
        return {}
    return {body: law.source for body, law in scenario.fatigue.laws.items()}


def fatigue_data(result: StudyResult[Any]) -> dict[str, dict[str, str]]:
    """Return the sources of the constants of fatigue of a result for JSON; nothing without it."""
    by_body = sources(fatigue_scenario(result))
    return {"fatigue_sources": by_body} if by_body else {}


def source_text(scenario: Scenario | None) -> str:
    """Return fatigue laws and sources of a scenario, one line for each body; else nothing."""
    return "\n".join(f"{row.label}: {row.text}" for row in source_rows(scenario))


def with_source_lines(title: str, result: StudyResult[Any]) -> str:
    """Return the title of a figure, with fatigue laws and sources of a result as further lines."""
    return "\n".join(filter(None, [title, source_text(fatigue_scenario(result))]))


def with_sources(columns: Iterable[Column], scenario: Scenario | None) -> list[Column]:
    """Return columns of a CSV file, with the source of the constants of fatigue."""
    text = source_text(scenario)
    return [
        column._replace(source=text) if re.search("damage|pitting", column.name) else column
        for column in columns
    ]

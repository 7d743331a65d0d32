"""Panels of the damage by fatigue in a run."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from wearsim.report.panels import BLACK, Axis, Line, Mark, Panel, Records, worn_limits
from wearsim.report.text import pass_unit, shown

if TYPE_CHECKING:
    from wearsim.studies.run.result import Result

DAMAGE = Axis("damage", "1", limits=(0.0, None))


def damage_panel(result: Result) -> Panel:
    """Return the damage of the cylinder across the track at every record, and of the rollers."""
    records = result.raw.records
    cylinder = np.asarray(records["cylinder_damage_profile"])[:, 0, 0]
    rollers = np.asarray(records["roller_damage_profile"])[-1, :, 0]
    marks: list[Mark] = [Records(result.y, cylinder, result.record_passes)]
    for number, values in enumerate(rollers):
        if values.any():
            name = "roller" if len(rollers) == 1 else f"roller {number + 1}"
            label = f"{name}, at the end"
            marks.append(Line(result.y, values, dash="--", width=1.0, colour=BLACK, label=label))
    limits = worn_limits(result.y, cylinder.max(axis=0))
    text = f"At the end the cylinder has a damage of {shown(float(cylinder[-1].max()), '1')}."
    title = "Damage of the cylinder by fatigue"
    x = Axis("y", "mm", limits=limits)
    return Panel(title, x, DAMAGE, marks, text, legend="upper right")


def pitting_panel(result: Result) -> Panel:
    """Return the effective damage and the probability of pitting against the roller passes."""
    size, name = pass_unit(float(result.passes[-1]))
    damage, chance = (
        np.asarray(result.values(name)).reshape(len(result.passes), -1).max(axis=1)
        for name in ("damage", "pitting")
    )
    marks: list[Mark] = [
        Line(result.passes, damage, label="effective damage"),
        Line(result.passes, chance, dash="--", label="probability of pitting"),
    ]
    text = (
        f"At the end the effective damage is {shown(float(damage[-1]), '1')} and the probability of"
        f" pitting {shown(float(chance[-1]), '%', 3)}."
    )
    x = Axis(name, per_si=1.0 / size)
    return Panel("Effective damage, and pitting", x, DAMAGE, marks, text, legend="lower right")

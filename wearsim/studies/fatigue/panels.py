"""Panels of fatigue: the damage in a run, and lives that end by wear or by pitting."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from wearsim.report.panels import (
    BLACK,
    BLUE,
    ORANGE,
    Axis,
    Line,
    Mark,
    Panel,
    Records,
    message,
    pass_axis,
    share_axis,
    worn_limits,
)
from wearsim.report.text import shown
from wearsim.studies.fatigue.lives import competing_risks, other_end
from wearsim.types import FloatArray

if TYPE_CHECKING:
    from wearsim.studies.life.values import LifeValues
    from wearsim.studies.run.result import Result

_POINTS = 81  # of an incidence
_ENDS = 1e-3, 0.999  # share of the lives at the ends of the axis
DAMAGE = Axis("damage", "1", limits=(0.0, None))


def rollers_at_end(y: FloatArray, values: FloatArray) -> list[Line]:
    """Return values of the rollers across the track at the end, of those that are not zero.

    Parameters
    ----------
    y : ndarray, shape (strips,)
    values : ndarray, shape (rollers, strips)
    """
    names = ["roller"] if len(values) == 1 else [f"roller {k}" for k in range(1, len(values) + 1)]
    return [
        Line(y, curve, "--", width=1.0, colour=BLACK, label=f"{name}, at the end")
        for name, curve in zip(names, values, strict=True)
        if curve.any()
    ]


def damage_panel(result: Result) -> Panel:
    """Return the damage of the cylinder across the track at every record, and of the rollers."""
    records = result.raw.records
    cylinder = np.asarray(records["cylinder_damage_profile"])[:, 0, 0]
    return Panel(
        "Damage of the cylinder by fatigue",
        Axis("y", "mm", limits=worn_limits(result.y, cylinder.max(axis=0))),
        DAMAGE,
        [
            Records(result.y, cylinder, result.record_passes),
            *rollers_at_end(result.y, np.asarray(records["roller_damage_profile"])[-1, :, 0]),
        ],
        f"At the end the cylinder has a damage of {shown(float(cylinder[-1].max()), '1')}.",
        legend="upper right",
    )


def pitting_panel(result: Result) -> Panel:
    """Return the effective damage and the probability of pitting against the roller passes."""
    damage, chance = (
        np.asarray(result.values(name)).reshape(len(result.passes), -1).max(axis=1)
        for name in ("damage", "pitting")
    )
    return Panel(
        "Effective damage, and pitting",
        pass_axis(float(result.passes[-1])),
        DAMAGE,
        [
            Line(result.passes, damage, label="effective damage"),
            Line(result.passes, chance, dash="--", label="probability of pitting"),
        ],
        f"At the end the effective damage is {shown(float(damage[-1]), '1')} and the probability of"
        f" pitting {shown(float(chance[-1]), '%', 3)}.",
        legend="lower right",
    )


def incidence_panel(designs: Sequence[tuple[LifeValues, str, str]], axis: Axis) -> Panel:
    """Return the probability of wear first, of pitting first and of either, against the life.

    Limits of damage and pitting are named in place of wear.

    Parameters
    ----------
    designs : sequence of (LifeValues, str, str)
        Lives with the label and the colour of each design; the label of one alone is empty.
    axis : Axis
        Of the life.
    """
    ends = dict.fromkeys(other_end(result.scenario) for result, _, _ in designs)
    title, marks, text = f"Ended by {' or '.join(ends)} or by pitting", list[Mark](), ""
    for result, label, colour in designs:
        risks = competing_risks(result)
        if risks is None:
            continue
        level, other = risks.at(math.inf), other_end(result.scenario)
        low, high = (risks.life(share * (1.0 - level.survival), "both").value for share in _ENDS)
        if not 0.0 < low < high < math.inf:
            continue
        passes = np.geomspace(low, high, _POINTS)
        levels = np.array([risks.at(life) for life in passes.tolist()])
        curves = {
            f"{other} first": (levels[:, 2], "-", BLUE),
            "pitting first": (levels[:, 1], "--", ORANGE),
            "both": (1.0 - levels[:, 0], ":", BLACK),
        }
        of_design = f"{label}: " if label else ""
        lives = passes / result.settings.per_unit
        marks += [
            Line(lives, share, dash, colour=colour if label else own, label=f"{of_design}{words}")
            for words, (share, dash, own) in curves.items()
        ]
        text += (
            f" {of_design}At last {shown(level.wear, '%', 3)} end by {other} and"
            f" {shown(level.pitting, '%', 3)} by pitting."
        )
    if not marks:
        return message(title, "no life ended")
    return Panel(
        title,
        Axis(axis.name, axis.unit, axis.per_si, log=True),
        share_axis("ended"),
        marks,
        text.strip(),
        legend="upper left",
    )

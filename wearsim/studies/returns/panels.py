"""Panels of lives after returns: survival, failures, and remaining lives."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from wearsim.levelling import Measured
from wearsim.report.panels import (
    Axis,
    Band,
    Bars,
    Line,
    Mark,
    Panel,
    Sheet,
    Span,
    Whiskers,
    dots,
    message,
    several_colours,
    share_axis,
)
from wearsim.report.text import count
from wearsim.studies.returns.result import SHARES, FieldReturns
from wearsim.uq.estimation.intervals import arrays_of
from wearsim.uq.survival.lives import survival_curve

_POINTS = 80
_PALE, _DARK = "0.6", "0.3"


def returns_sheet(result: FieldReturns, measured: Sequence[Measured] = ()) -> Sheet:
    """Return the panels of lives after returns.

    Parameters
    ----------
    result : FieldReturns
    measured : sequence of Measured
        Not drawn.

    Returns
    -------
    Sheet
        Survival before and after, and of the units; failures in bands of lives; remaining life of
        running units against their age.
    """
    panels = {
        "survival": _survival(result),
        "failures": _failures(result),
        "remaining": _remaining(result),
    }
    return Sheet(result.title, panels, [list(panels)], (15.0, 4.6))


def _survival(result: FieldReturns) -> Panel:
    """Return the survival of each design, before and after the returns."""
    marks, colours = list[Mark](), several_colours(len(result.labels))
    fleet, axis = result.returns.fleet, Axis("life", result.unit, 1.0, limits=(0.0, None))
    for number, (label, colour) in enumerate(zip(result.labels, colours, strict=True)):
        after, before = result.lives_after[number], result.lives_before[number]
        name = f"{label}: " if len(result.labels) > 1 else ""
        life = np.linspace(0.0, after.mixture.quantile_of_mean(0.99), _POINTS + 1)[1:]
        for lives, shade, text, alpha in (
            (before, _PALE, "before", 0.2),
            (after, colour, "after", 0.25),
        ):
            chances = [lives.probability_before(float(end)) for end in life]
            value, high, low = 1.0 - arrays_of(chances)
            marks.append(Band(life, low, high, colour=shade, alpha=alpha))
            marks.append(Line(life, value, colour=shade, label=f"{name}{text}"))
        chosen = fleet.design == number
        ends = np.where(fleet.failed, fleet.high, fleet.low)[chosen]
        curve = survival_curve(ends, fleet.failed[chosen])
        if len(curve.life):
            # up to the oldest unit
            steps = np.append(0.0, np.append(curve.life, ends.max()))
            left = np.append(1.0, np.append(curve.survival, curve.survival[-1]))
            text = f"{name}units (Kaplan-Meier)"
            marks.append(Line(steps, left, "--", steps=True, colour=_DARK, label=text))
    target = result.designs[0].target
    if target is not None:
        marks.append(Span(target, dash=":", colour="0.4", label=f"target {count(target)}"))
    text = "Share of the machines that outlast a life, before and after the returns."
    return Panel("Survival, with 95 % bands", axis, share_axis("survival"), marks, text)


def _failures(result: FieldReturns) -> Panel:
    """Return predicted and observed failures in bands of lives."""
    check = result.check
    bands = len(check.edges) - 1
    place = np.arange(bands, dtype=float)
    names = [f"to {count(float(f'{edge:.3g}'))}" for edge in check.edges[1:]]
    colours = several_colours(2)
    marks: list[Mark] = [
        Bars(place - 0.3, place + 0.3, check.observed[:bands], colour=_PALE, label="observed")
    ]
    for shift, predicted, label, colour in (
        (-0.12, check.before, "predicted before", colours[1]),
        (0.12, check.after, "predicted after", colours[0]),
    ):
        ends = predicted.low[:bands], predicted.high[:bands]
        marks.append(Whiskers(place + shift, *ends, colour=colour))
        marks.append(dots(place + shift, predicted.mean[:bands], "o", colour=colour, label=label))
    most = max(float(check.after.high[:bands].max()), float(check.observed[:bands].max()))
    x = Axis(f"life [{result.unit}]", ticks=place.tolist(), names=names, limits=(-0.6, bands - 0.4))
    text = "Failures observed in bands of lives, and predicted with 95 % intervals."
    return Panel("Failures", x, Axis("units", limits=(0.0, 1.6 * most + 1.0)), marks, text)


def _remaining(result: FieldReturns) -> Panel:
    """Return the remaining lives of running units against their age."""
    title = "Further life of running units"
    if not result.running:
        return message(title, "no unit is running")
    marks = list[Mark]()
    age = np.array([unit.age for unit in result.running])
    for place, (share, colour) in enumerate(zip(SHARES, several_colours(len(SHARES)), strict=True)):
        value, low, high = arrays_of(unit.remaining.lives[place] for unit in result.running)
        high = np.where(np.isfinite(high), high, np.nan)
        marks.append(Whiskers(age, low, high, colour=colour))
        marks.append(dots(age, value, "o", colour=colour, label=f"B{share:g}"))
    text = "Further lives that 10 % and 50 % of units of an age do not reach, with 95 % intervals."
    x, y = (Axis(name, result.unit, 1.0, limits=(0.0, None)) for name in ("age", "further life"))
    return Panel(title, x, y, marks, text)

"""Panels of demonstration tests: specimens and the probability of passing against duration."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from wearsim.levelling import Measured
from wearsim.report.panels import Axis, Band, Line, Mark, Panel, Sheet, Span, several_colours
from wearsim.studies.demonstration.result import Demonstration, Plan
from wearsim.types import FloatArray

_DURATIONS = np.geomspace(0.4, 6.0, 25)  # over the life to show


def demonstration_sheet(result: Demonstration, measured: Sequence[Measured] = ()) -> Sheet:
    """Return the panels of demonstration tests.

    Parameters
    ----------
    result : Demonstration
    measured : sequence of Measured
        Not drawn.

    Returns
    -------
    Sheet
        Specimens against duration, and the probability that the design passes.
    """
    need = result.requirement
    curves: list[tuple[str, list[Plan]]] = []
    for failures in range(need.failures + 1):
        plans = [result.plan(need.life * ratio, failures) for ratio in _DURATIONS]
        name = "no failure" if failures == 0 else f"{failures} failure{'s' if failures > 1 else ''}"
        curves.append((name, plans))
    for number in range(1, len(result.designs)):
        factor = result.acceleration(number).value
        plans = [result.plan(need.life * ratio / factor, 0, number) for ratio in _DURATIONS]
        curves.append((f"no failure, {result.labels[number]}", plans))
    panels = {"specimens": _specimens(result, curves), "passing": _passing(result, curves)}
    return Sheet(result.title, panels, [list(panels)], (13.0, 4.8))


def _numbers(plans: Sequence[Plan], name: str) -> FloatArray:
    values = [getattr(plan, name) for plan in plans]
    return np.array([np.nan if item is None else float(item) for item in values])


def _axis(result: Demonstration) -> Axis:
    return Axis("duration", result.requirement.unit, 1.0, log=True)


def _specimens(result: Demonstration, curves: Sequence[tuple[str, list[Plan]]]) -> Panel:
    """Return the specimens against the duration."""
    marks = list[Mark]()
    for (name, plans), colour in zip(curves, several_colours(len(curves)), strict=True):
        time = _numbers(plans, "duration")
        marks.append(Line(time, _numbers(plans, "specimens"), colour=colour, label=name))
        low, high = _numbers(plans, "low"), _numbers(plans, "high")
        if np.any(low < high):
            marks.append(Band(time, low, high, colour=colour, alpha=0.15))
    marks.append(Span(result.requirement.life, dash=":", colour="0.4", label="life to show"))
    caption = "Specimens that show the life, against the duration of their test."
    y = Axis("specimens", log=True)
    return Panel("Specimens", _axis(result), y, marks, caption)


def _passing(result: Demonstration, curves: Sequence[tuple[str, list[Plan]]]) -> Panel:
    """Return the probability of passing against the duration."""
    marks = list[Mark]()
    for (name, plans), colour in zip(curves, several_colours(len(curves)), strict=True):
        passing = [plan.passing for plan in plans]
        time, value = _numbers(plans, "duration"), np.array([item.value for item in passing])
        marks.append(Line(time, value, colour=colour, label=name))
        low, high = (np.array([getattr(item, end) for item in passing]) for end in ("low", "high"))
        if name == "no failure" and np.any(low < high):
            marks.append(Band(time, low, high, colour=colour, alpha=0.15))
    marks.append(Span(result.requirement.life, dash=":", colour="0.4", label="life to show"))
    caption = "Probability that the simulated design passes the test, with a 95 % band."
    y = Axis("passes", "%", limits=(0.0, 1.02))
    return Panel("Probability that the design passes", _axis(result), y, marks, caption)

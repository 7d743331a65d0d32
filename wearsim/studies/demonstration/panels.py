"""Panels of demonstration tests: specimens and the probability of passing against duration."""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np

from wearsim.levelling import Measured
from wearsim.report.panels import (
    Axis,
    Band,
    Line,
    Mark,
    Panel,
    Sheet,
    Span,
    several_colours,
    share_axis,
)
from wearsim.report.text import count_of
from wearsim.studies.demonstration.result import Demonstration
from wearsim.types import FloatArray
from wearsim.uq.estimation.intervals import arrays_of

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
    tests = [(count_of(k, "failure", "no failure"), k, 0, 1.0) for k in range(need.failures + 1)]
    tests += [
        (f"no failure, {label}", 0, number, result.acceleration(number).value)
        for number, label in enumerate(result.labels[1:], 1)
    ]
    names, *_ = zip(*tests, strict=True)
    plans = [
        [result.plan(need.life * ratio / factor, failures, design) for ratio in _DURATIONS]
        for _, failures, design, factor in tests
    ]

    def panel(
        title: str, y: Axis, caption: str, curves: Sequence[FloatArray], banded: Collection[str]
    ) -> Panel:
        """Return values with their ends against the duration; some curves have a band."""
        marks, colours = list[Mark](), several_colours(len(plans))
        for name, row, colour, ends in zip(names, plans, colours, curves, strict=True):
            time, (value, low, high) = np.array([plan.duration for plan in row]), ends
            marks.append(Line(time, value, colour=colour, label=name))
            if name in banded and np.any(low < high):
                marks.append(Band(time, low, high, colour=colour, alpha=0.15))
        marks.append(Span(need.life, dash=":", colour="0.4", label="life to show"))
        return Panel(title, Axis("duration", need.unit, 1.0, log=True), y, marks, caption)

    panels = {
        "specimens": panel(
            "Specimens",
            Axis("specimens", log=True),
            "Specimens that show the life, against the duration of their test.",
            [
                np.array([(plan.specimens, plan.low, plan.high) for plan in row], float).T
                for row in plans
            ],
            names,
        ),
        "passing": panel(
            "Probability that the design passes",
            share_axis("passes"),
            "Probability that the simulated design passes the test, with a 95 % band.",
            [arrays_of(plan.passing for plan in row) for row in plans],
            ["no failure"],
        ),
    }
    return Sheet(result.title, panels, [list(panels)], (13.0, 4.8))

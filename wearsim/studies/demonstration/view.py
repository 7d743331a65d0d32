"""View of demonstration tests: specimens, duration, acceleration, probability of passing."""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from dataclasses import asdict
from typing import Any

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
from wearsim.report.text import NOTHING, count, count_of, part_with_interval, shown, with_ends
from wearsim.report.view import STUDY, Column, Row, Rows, Table
from wearsim.results.study_view import DesignsView, columns_of
from wearsim.studies.demonstration.result import Demonstration, Plan
from wearsim.studies.life.view import limit_texts
from wearsim.types import FloatArray
from wearsim.uq.estimation.intervals import arrays_of


class DemonstrationView(DesignsView):
    """Specimens against duration, and the probability that the design passes.

    Panels: specimens, probability of passing. Files: the tests.
    """

    file, group = "tests.csv", "Demonstration"
    basis = (
        "The simulation gives the shape of the distribution of lives and the acceleration; the"
        " scale is what is demonstrated. Intervals of 95 % contain the sampling of the"
        " realisations, and what is not known of K/H where it has a posterior, but not the error of"
        " the model."
    )
    notes = (
        (
            "tests that are longer or shorter than the life to show, and accelerated ones, assume"
            " the simulated shape of the distribution; by the binomial alone, the life itself is"
            " tested"
        ),
    )

    def __init__(self, result: Demonstration) -> None:
        self.result, self.title = result, result.title
        self.question = f"How many specimens for how long show {self._need()}?"
        share = 1.0 - result.requirement.survival
        obstacles = (
            (label, design.probability_obstacle(design.distribution.quantile_of_mean(share)))
            for label, design in zip(result.labels, result.designs, strict=True)
        )
        self.warnings = tuple(
            f"the life at this survival of {label} is uncertain: {why}"
            for label, why in obstacles
            if why
        )

    def _need(self) -> str:
        need = self.result.requirement
        return (
            f"that {100.0 * need.survival:g} % survive {self._amount(need.life)}"
            f" with {100.0 * need.confidence:g} % confidence"
        )

    def _amount(self, duration: float) -> str:
        return f"{self._number(duration)} {self.result.requirement.unit}"

    @staticmethod
    def _number(duration: float) -> str:
        return count(float(f"{duration:.4g}")) if duration >= 1000.0 else f"{duration:.3g}"

    def rows(self) -> Rows:
        """Return specimens by the binomial, the simulated design, and the acceleration."""
        result, need, numbers = self.result, self.result.requirement, self.result.by_binomial
        allowed = ", ".join(
            f"{number} with {count_of(k, 'failure', 'no failure')}"
            for k, number in enumerate(numbers)
        )
        factors = (
            (label, result.acceleration(number))
            for number, label in enumerate(result.labels[1:], 1)
        )
        return [
            Row("specimens", f"{allowed}, for {self._amount(need.life)}"),
            Row("probability of passing", self._passing(result.plan(need.life))),
            Row(
                f"simulated survival of {self._amount(need.life)}",
                part_with_interval(result.survival),
            ),
            Row(
                f"simulated B{100.0 * (1.0 - need.survival):.3g}",
                f"{with_ends(result.life, self._number)} {need.unit}",
            ),
            Row(
                "probability that the design meets it",
                NOTHING if math.isnan(result.meets) else shown(result.meets, "%", 3),
            ),
            *(
                Row(
                    f"acceleration by {label}",
                    f"{with_ends(factor, '{:.3g}'.format)} times shorter lives; {numbers[0]}"
                    f" specimens without failure take {self._amount(need.life / factor.value)}",
                )
                for label, factor in factors
            ),
        ]

    def tables(self) -> list[Table]:
        """Return the requirement, and the tests of all conditions."""
        design = self.result.designs[0]
        posterior = (
            f", posterior of K/H given {design.levels.specimens or 'the'} specimens"
            if design.levels is not None
            else ""
        )
        return [
            Table(
                STUDY,
                [
                    Row("to show", self._need()),
                    Row("lives", f"{count(design.count)} realisations{posterior}"),
                    Row("limits", ", ".join(limit_texts(design.scenario.limit.given))),
                ],
            ),
            *map(self._tests, range(len(self.result.designs))),
        ]

    def _tests(self, design: int) -> Table:
        """Return specimens against duration for the conditions of a test."""
        need, plans = self.result.requirement, self.result.plans[design]
        size = need.failures + 1
        what = f"test at {self.result.labels[design]}" if design else "test"
        allowed = (count_of(k, "failure", "no failure") for k in range(size))
        by_duration = (plans[place : place + size] for place in range(0, len(plans), size))
        return Table(
            "",
            [
                [self._number(some[0].duration), *map(_cell, some), self._passing(some[0])]
                for some in by_duration
            ],
            [
                f"duration of the {what} [{need.unit}]",
                *(f"specimens, {text}" for text in allowed),
                "passes without failure",
            ],
        )

    def _passing(self, plan: Plan) -> str:
        return NOTHING if plan.specimens is None else part_with_interval(plan.passing)

    def data(self) -> dict[str, Any]:
        """Return all numbers."""
        result, need = self.result, self.result.requirement
        return {
            "title": result.title,
            "requirement": need._asdict(),
            "specimens_by_binomial": result.by_binomial,
            "simulated_survival": asdict(result.survival),
            "simulated_life": asdict(result.life),
            "probability_that_design_meets": result.meets,
            "tests": [
                {
                    "label": label,
                    "acceleration": asdict(result.acceleration(number)),
                    "plans": [
                        {**plan._asdict(), "passing": asdict(plan.passing)} for plan in plans
                    ],
                }
                for number, (label, plans) in enumerate(
                    zip(result.labels, result.plans, strict=True)
                )
            ],
            "notes": list(self.notes),
            "warnings": list(self.warnings),
        }

    def table(self) -> list[Column]:
        """Return the tests as columns."""
        pairs = list(zip(self.result.labels, self.result.plans, strict=True))
        plans = [plan for _, some in pairs for plan in some]
        duration, failures, *specimens = (
            np.array([math.nan if item is None else item for item in numbers])
            for numbers in zip(*(plan[:-1] for plan in plans), strict=True)
        )
        return [
            Column("conditions", [label for label, some in pairs for _ in some]),
            Column("duration", duration, self.result.requirement.unit),
            Column("failures", failures),
            *columns_of("specimens", specimens),
            *columns_of("passes", arrays_of(plan.passing for plan in plans)),
        ]

    def panels(self, measured: Sequence[Measured] = ()) -> Sheet:
        """Return specimens and the probability of passing against the duration."""
        result, need = self.result, self.result.requirement
        tests = [
            *((count_of(k, "failure", "no failure"), k, 0, 1.0) for k in range(need.failures + 1)),
            *(
                (f"no failure, {label}", 0, number, result.acceleration(number).value)
                for number, label in enumerate(result.labels[1:], 1)
            ),
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


def _cell(plan: Plan) -> str:
    """Return the specimens of a test, with the interval by the shape."""
    if plan.specimens is None:
        return NOTHING
    number = count(plan.specimens)
    if plan.low is None or plan.high is None or plan.low == plan.high:
        return number
    return f"{number} ({count(plan.low)}..{count(plan.high)})"


_DURATIONS = np.geomspace(0.4, 6.0, 25)  # over the life to show

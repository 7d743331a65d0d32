"""View of demonstration tests: specimens, duration, acceleration, probability of passing."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

import numpy as np

from wearsim.report.text import NOTHING, count, part_with_interval, shown
from wearsim.report.view import STUDY, Column, Columns, Frame, Overview, Row, Rows, Table, View
from wearsim.studies.demonstration.result import Demonstration, Plan
from wearsim.studies.life.view import limit_texts
from wearsim.uq.estimation.intervals import Interval

_BASIS = (
    "The simulation gives the shape of the distribution of lives and the acceleration; the scale is"
    " what is demonstrated. Intervals of 95 % contain the sampling of the realisations, and what is"
    " not known of K/H where it has a posterior, but not the error of the model."
)
_NO_SHAPE = (
    "tests that are longer or shorter than the life to show, and accelerated ones, assume the"
    " simulated shape of the distribution; by the binomial alone, the life itself is tested"
)


class DemonstrationView(View):
    """Specimens against duration, and the probability that the design passes.

    Panels: specimens, probability of passing. Files: the tests.
    """

    sheet = "wearsim.studies.demonstration.panels:demonstration_sheet"
    basis = _BASIS

    def __init__(self, result: Demonstration) -> None:
        self.result, self.title = result, result.title
        self.question = f"How many specimens for how long show {self._need()}?"
        self.notes = (_NO_SHAPE,)
        share = 1.0 - result.requirement.survival
        obstacles = [
            (label, design.probability_obstacle(design.distribution.quantile_of_mean(share)))
            for label, design in zip(result.labels, result.designs, strict=True)
        ]
        self.warnings = tuple(
            f"the life at this survival of {label} is uncertain: {why}"
            for label, why in obstacles
            if why
        )

    def _need(self) -> str:
        need = self.result.requirement
        survival = f"that {100.0 * need.survival:g} % survive {self._amount(need.life)}"
        return f"{survival} with {100.0 * need.confidence:g} % confidence"

    def _amount(self, duration: float) -> str:
        return f"{self._number(duration)} {self.result.requirement.unit}"

    @staticmethod
    def _number(duration: float) -> str:
        if duration >= 1000.0:
            return count(float(f"{duration:.4g}"))
        return f"{duration:.3g}"

    def _between(self, interval: Interval, number: Any) -> str:
        text = number(interval.value)
        if interval.low == interval.high:
            return str(text)
        return f"{text} [{number(interval.low)}, {number(interval.high)}]"

    def rows(self) -> Rows:
        """Return specimens by the binomial, the simulated design, and the acceleration."""
        result, need = self.result, self.result.requirement
        numbers = result.by_binomial
        allowed = ", ".join(
            f"{number} with {'no' if k == 0 else k} failure{'s' if k > 1 else ''}"
            for k, number in enumerate(numbers)
        )
        plain = result.plan(need.life)
        rows = [
            Row("specimens", f"{allowed}, for {self._amount(need.life)}"),
            Row("probability of passing", self._passing(plain)),
            Row(
                f"simulated survival of {self._amount(need.life)}",
                part_with_interval(result.survival),
            ),
            Row(
                f"simulated B{100.0 * (1.0 - need.survival):.3g}",
                f"{self._between(result.life, self._number)} {need.unit}",
            ),
            Row(
                "probability that the design meets it",
                NOTHING if math.isnan(result.meets) else shown(result.meets, "%", 3),
            ),
        ]
        for number in range(1, len(result.designs)):
            factor = self._between(result.acceleration(number), lambda value: f"{value:.3g}")
            duration = need.life / result.acceleration(number).value
            text = f"{factor} times shorter lives; {numbers[0]} specimens without failure take"
            rows.append(
                Row(f"acceleration by {result.labels[number]}", f"{text} {self._amount(duration)}")
            )
        return rows

    def tables(self) -> list[Table]:
        """Return the requirement, and the tests of all conditions."""
        result, design = self.result, self.result.designs[0]
        given = f"{count(design.count)} realisations"
        if design.levels is not None:
            given += f", posterior of K/H given {design.levels.specimens or 'the'} specimens"
        study = [
            Row("to show", self._need()),
            Row("lives", given),
            Row("limits", ", ".join(limit_texts(design.scenario.limit.given))),
        ]
        return [Table(STUDY, study), *map(self._tests, range(len(result.designs)))]

    def _tests(self, design: int) -> Table:
        """Return specimens against duration for the conditions of a test."""
        result, need = self.result, self.result.requirement
        plans, lines = result.plans[design], []
        for place in range(0, len(plans), need.failures + 1):
            some = plans[place : place + need.failures + 1]
            lines.append(
                [self._number(some[0].duration), *map(_cell, some), self._passing(some[0])]
            )
        what = "test" if design == 0 else f"test at {result.labels[design]}"
        heads = [f"duration of the {what} [{need.unit}]"]
        heads += [
            f"specimens, {'no failure' if k == 0 else f'{k} failure' + ('s' if k > 1 else '')}"
            for k in range(need.failures + 1)
        ]
        return Table("", lines, [*heads, "passes without failure"])

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

    def _columns(self) -> list[Column]:
        """Return the tests as columns."""
        result, unit = self.result, self.result.requirement.unit
        plans = [
            (label, plan)
            for label, some in zip(result.labels, result.plans, strict=True)
            for plan in some
        ]

        def numbers(name: str) -> Any:
            values = [getattr(plan, name) for _, plan in plans]
            return np.array([math.nan if item is None else item for item in values])

        passing = [plan.passing for _, plan in plans]
        return [
            Column("conditions", [label for label, _ in plans]),
            Column("duration", numbers("duration"), unit),
            Column("failures", numbers("failures")),
            Column("specimens", numbers("specimens")),
            Column("specimens low", numbers("low")),
            Column("specimens high", numbers("high")),
            Column("passes", np.array([item.value for item in passing])),
            Column("passes low", np.array([item.low for item in passing])),
            Column("passes high", np.array([item.high for item in passing])),
        ]

    def columns(self) -> Mapping[str, Columns]:
        """Return the tests."""
        return {"tests.csv": [self._columns()]}

    def frame(self) -> Frame:
        """Return the tests as a table of pandas."""
        columns = [(item.name, item.unit, item.values) for item in self._columns()]
        return Frame(columns, "number", range(1, len(columns[0][2]) + 1))

    def stored_files(self) -> list[tuple[str, str]]:
        """Return the scenario of the design and its input files."""
        files: list[tuple[str, str]] = self.result.designs[0].view.stored_files()
        return files

    def overview(self) -> Overview:
        """Return the specimens and the first answers."""
        return Overview(self.panels().first, {"Demonstration": self.rows()[1:]})


def _cell(plan: Plan) -> str:
    """Return the specimens of a test, with the interval by the shape."""
    if plan.specimens is None:
        return NOTHING
    number = count(plan.specimens)
    if plan.low is None or plan.high is None or plan.low == plan.high:
        return number
    return f"{number} ({count(plan.low)}..{count(plan.high)})"

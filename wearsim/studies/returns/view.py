"""View of lives after returns from the field: before, after, fit, and remaining lives."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict
from itertools import pairwise
from typing import Any

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
from wearsim.report.text import count, count_of, part_with_interval, rounded_lives, with_ends
from wearsim.report.view import STUDY, Column, Row, Rows, Table
from wearsim.results.study_view import DesignsView, columns_of
from wearsim.studies.life.view import limit_texts
from wearsim.studies.returns.result import SHARES, FieldReturns
from wearsim.uq.estimation.intervals import Interval, arrays_of
from wearsim.uq.survival.fleet import Predicted
from wearsim.uq.survival.lives import survival_curve
from wearsim.uq.survival.two_levels import UncertainLife

_MOST = 12  # running units in a table
_REACHED = Interval(1.0, 1.0, 1.0)  # probability of a unit that is older than the target


class FieldReturnsView(DesignsView):
    """Lives before and after returns, predicted and observed failures, and remaining lives.

    Panels: survival, failures, remaining lives. Files: the running units.
    """

    file, group = "units.csv", "Life"
    basis = (
        "Intervals hold the value with a probability of 95 %, given the wear tests, the prior of"
        " the life factor and the returns; units are independent given these."
    )

    def __init__(self, result: FieldReturns) -> None:
        self.result, self.title = result, result.title
        self.question = f"How many {result.unit} does the design last, by its returns?"
        self.notes = tuple(
            f"{number} unit{'s' * (number != 1)} withdrawn by another cause, {cause}, count as"
            " suspended"
            for cause, number in result.returns.others.items()
        )
        self.warnings = tuple(_warnings(result))

    def rows(self) -> Rows:
        """Return the lives before and after the returns, and how well they agree."""
        result, check, rows = self.result, self.result.check, list[Row]()
        given, units = f"given {self._tests()}", count_of(len(result.returns.fleet), "unit")
        for number, label in enumerate(result.labels):
            of = f" of {label}" if len(result.labels) > 1 else ""
            before, after = (
                _life(life(10.0, number).interval, f" {result.unit}")
                for life in (result.before, result.after)
            )
            rows += [
                Row(f"B10 after{of}", f"{after} {given} and {units}"),
                Row(f"B10 before{of}", f"{before} {given}"),
            ]
            target = result.designs[number].target
            if target is not None:
                before, after = (
                    part_with_interval(lives[number].probability_before(target))
                    for lives in (result.lives_before, result.lives_after)
                )
                rows.append(
                    Row(f"P(life < {count(target)} {result.unit}){of}", f"{after}, before {before}")
                )
        return [
            *rows,
            Row(
                "failures",
                f"{result.returns.failed} observed, {_numbers(check.before, -1)} predicted before",
            ),
            Row(
                "agreement before",
                _judged(
                    check.surprise,
                    "the number of failures is not the one predicted",
                    "the number of failures is as predicted",
                ),
            ),
            Row(
                "goodness of fit after",
                _judged(
                    check.fit,
                    "lives of the field do not have the predicted distribution",
                    "no contradiction in the distribution of the failures",
                ),
            ),
        ]

    def tables(self) -> list[Table]:
        """Return the returns, lives, failures in bands, what is known, and running units."""
        result, fleet = self.result, self.result.returns.fleet
        known = int((fleet.failed & (fleet.low < fleet.high)).sum())
        inspected = f", {count(known)} of them at an inspection" if known else ""
        units = (
            f"{count_of(len(fleet), 'unit')}: {count(result.returns.failed)} failed{inspected},"
            f" {count(len(result.running))} running"
        )
        factor = result.life_factor
        prior = f"median 1, two of three within {factor:g} times" if factor > 1.0 else "1"
        limits = ", ".join(limit_texts(result.designs[0].scenario.limit.given))
        study = [
            Row("returns", f"{result.returns.file}, {units}"),
            Row("life", f"{result.unit} until the first of: {limits}"),
            Row("wear factor", f"posterior given {self._tests()}, integrated exactly"),
            Row("prior of the life factor", prior),
        ]
        return [
            *(Table(STUDY, study), self._lives(), self._bands(), self._known()),
            *([self._running()] if result.running else []),
        ]

    def _tests(self) -> str:
        return f"{self.result.posterior.before.specimens or 'the'} specimens"

    def _lives(self) -> Table:
        """Return lives of shares before and after the returns."""
        result = self.result
        labels = [f"{label} " if len(result.labels) > 1 else "" for label in result.labels]
        lines = [
            [
                f"{label}B{share:g}",
                *_cells(result.before(share, number)),
                *_cells(result.after(share, number)),
            ]
            for number, label in enumerate(labels)
            for share in result.designs[number].settings.shares
        ]
        columns = ["95 % credible", "sd of ln life"]
        return Table("", lines, [f"life [{result.unit}]", "before", *columns, "after", *columns])

    def _bands(self) -> Table:
        """Return predicted and observed failures in bands of lives."""
        check = self.result.check
        edges = [count(float(f"{edge:.3g}")) for edge in check.edges]
        names = [f"{low} to {high}" for low, high in pairwise(edges)]
        if len(names) > 1:
            names.append("in all")
        return Table(
            "",
            [
                [
                    *(name, f"{check.observed[place]:.3g}"),
                    *(_numbers(item, place) for item in (check.before, check.after)),
                ]
                for place, name in enumerate(names)
            ],
            [f"failures at [{self.result.unit}]", "observed", "predicted before", "after"],
        )

    def _known(self) -> Table:
        """Return wear factor and life factor before and after the returns."""
        result, posterior = self.result, self.result.posterior
        medians, scatters = zip(
            *map(result.wear_factor, (posterior.before, posterior.after)), strict=True
        )
        known = {
            "median of K/H over the life factor [1/Pa]": medians,
            "scatter t of ln K/H": scatters,
            **(
                {"life factor": (result.factor_before, result.factor)}
                if result.life_factor > 1.0
                else {}
            ),
        }
        return Table(
            "",
            [
                [name, *(with_ends(end, "{:.3g}".format) for end in ends)]
                for name, ends in known.items()
            ],
            ["what is not known", "before", "after"],
        )

    def _running(self) -> Table:
        """Return the running units with the least remaining lives."""
        result, target = self.result, self.result.designs[0].target
        units = sorted(result.running, key=lambda unit: unit.remaining.lives[0].value)[:_MOST]
        columns = {
            "running unit": [unit.name for unit in units],
            **(
                {"design": [result.labels[unit.design] for unit in units]}
                if len(result.labels) > 1
                else {}
            ),
            f"age [{result.unit}]": [count(float(f"{unit.age:.4g}")) for unit in units],
            **{
                f"further life, B{share:g}": [_life(unit.remaining.lives[place]) for unit in units]
                for place, share in enumerate(SHARES)
            },
            **(
                {}
                if target is None
                else {
                    f"reaches {count(target)}": [
                        part_with_interval(unit.remaining.survival)
                        if unit.remaining.survival
                        else "reached"
                        for unit in units
                    ]
                }
            ),
        }
        lines = [list(line) for line in zip(*columns.values(), strict=True)]
        if (more := len(result.running) - _MOST) > 0:
            lines.append([f"and {count(more)} more", *[""] * (len(columns) - 1)])
        return Table("", lines, list(columns))

    def data(self) -> dict[str, Any]:
        """Return all numbers, lives in their unit."""
        result, posterior, check = self.result, self.result.posterior, self.result.check
        before, after = (
            dict(zip(("k_over_h", "scatter"), map(asdict, result.wear_factor(levels)), strict=True))
            for levels in (posterior.before, posterior.after)
        )
        return {
            "title": result.title,
            "unit": result.unit,
            "returns": result.returns.file,
            "units": len(result.returns.fleet),
            "failed": result.returns.failed,
            "other_causes": result.returns.others,
            "specimens": posterior.before.specimens,
            "life_factor": {
                "prior_factor": result.life_factor,
                "before": asdict(result.factor_before),
                "after": asdict(result.factor),
            },
            "wear_factor_over_life_factor": {"before": before, "after": after},
            "designs": [self._design_data(number) for number in range(len(result.labels))],
            "failures": {
                "edges": check.edges,
                "observed": check.observed,
                "before": check.before._asdict(),
                "after": check.after._asdict(),
                "agreement_before": check.surprise,
                "goodness_of_fit": check.fit,
            },
            "running": [
                {
                    "unit": unit.name,
                    "design": result.labels[unit.design],
                    "age": unit.age,
                    "further_life": {
                        f"{share:g}": asdict(life)
                        for share, life in zip(SHARES, unit.remaining.lives, strict=True)
                    },
                    "reaches_target": asdict(unit.remaining.survival)
                    if unit.remaining.survival
                    else None,
                }
                for unit in result.running
            ],
            "notes": list(self.notes),
            "warnings": list(self.warnings),
        }

    def _design_data(self, number: int) -> dict[str, Any]:
        """Return lives and probability of a design before and after the returns for JSON."""
        result, design = self.result, self.result.designs[number]
        before, after = result.lives_before[number], result.lives_after[number]
        return {
            "label": result.labels[number],
            "b": {
                f"{share:g}": {
                    "before": asdict(result.before(share, number)),
                    "after": asdict(result.after(share, number)),
                }
                for share in design.settings.shares
            },
            "target": design.target,
            **(
                {}
                if design.target is None
                else {
                    "probability_before_target": {
                        "before": asdict(before.probability_before(design.target)),
                        "after": asdict(after.probability_before(design.target)),
                    }
                }
            ),
        }

    def table(self) -> list[Column]:
        """Return the running units as columns."""
        result, running = self.result, self.result.running
        return [
            Column("unit", [unit.name for unit in running]),
            Column("design", [result.labels[unit.design] for unit in running]),
            Column("age", np.array([unit.age for unit in running]), result.unit),
            *(
                column
                for place, share in enumerate(SHARES)
                for column in columns_of(
                    f"further life B{share:g}",
                    arrays_of(unit.remaining.lives[place] for unit in running),
                    result.unit,
                )
            ),
            *(
                columns_of(
                    "reaches target",
                    arrays_of(unit.remaining.survival or _REACHED for unit in running),
                )
                if result.designs[0].target is not None
                else []
            ),
        ]

    def panels(self, measured: Sequence[Measured] = ()) -> Sheet:
        """Return survival, failures in bands of lives, and remaining lives of running units."""
        panels = {
            "survival": _survival(self.result),
            "failures": _failures(self.result),
            "remaining": _remaining(self.result),
        }
        return Sheet(self.result.title, panels, [list(panels)], (15.0, 4.6))


def _life(life: Interval, unit: str = "") -> str:
    low, value, high = rounded_lives(life.low, life.value, life.high)
    return f"{value}{unit} [{low}..{high}]"


def _cells(life: UncertainLife) -> tuple[str, str, str]:
    """Return a life, its interval, and the deviation of its logarithm."""
    low, value, high = rounded_lives(life.low, life.predictive, life.high)
    return value, f"{low}..{high}", f"{math.sqrt(life.by_tests + life.by_realisations):.2g}"


def _numbers(predicted: Predicted, place: int) -> str:
    mean, low, high = (ends[place] for ends in (predicted.mean, predicted.low, predicted.high))
    return f"{mean:.3g} [{low:.0f}, {high:.0f}]"


def _judged(probability: float, contradicted: str, agreed: str) -> str:
    """Return the p-value of the goodness of fit, and its meaning in words."""
    return f"p = {probability:.2g}: {contradicted if probability < 0.05 else agreed}"


def _warnings(result: FieldReturns) -> list[str]:
    """Return what speaks against the model."""
    fit, factor, prior = result.check.fit, result.factor, result.factor_before
    warnings = (
        (
            fit < 0.05,
            (
                f"the lives in the field do not have the predicted distribution (p = {fit:.2g}):"
                " another limit or another scatter of the inputs than in the scenario"
            ),
        ),
        (
            result.life_factor > 1.0 and not prior.low < factor.value < prior.high,
            (
                f"the life factor of {factor.value:.2g} is outside its prior: the computed life is"
                " systematically wrong, or the units are not those of the scenario"
            ),
        ),
    )
    return [text for applies, text in warnings if applies]


_POINTS = 80
_PALE, _DARK = "0.6", "0.3"


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
            value, high, low = 1.0 - arrays_of(map(lives.probability_before, life.tolist()))
            marks += [
                Band(life, low, high, colour=shade, alpha=alpha),
                Line(life, value, colour=shade, label=f"{name}{text}"),
            ]
        chosen = fleet.design == number
        ends = np.where(fleet.failed, fleet.high, fleet.low)[chosen]
        curve = survival_curve(ends, fleet.failed[chosen])
        if len(curve.life):
            # up to the oldest unit
            marks.append(
                Line(
                    np.concatenate([[0.0], curve.life, [ends.max()]]),
                    np.concatenate([[1.0], curve.survival, curve.survival[-1:]]),
                    "--",
                    steps=True,
                    colour=_DARK,
                    label=f"{name}units (Kaplan-Meier)",
                )
            )
    target = result.designs[0].target
    if target is not None:
        marks.append(Span(target, dash=":", colour="0.4", label=f"target {count(target)}"))
    return Panel(
        "Survival, with 95 % bands",
        axis,
        share_axis("survival"),
        marks,
        "Share of the machines that outlast a life, before and after the returns.",
    )


def _failures(result: FieldReturns) -> Panel:
    """Return predicted and observed failures in bands of lives."""
    check = result.check
    bands = len(check.edges) - 1
    place, observed = np.arange(bands, dtype=float), check.observed[:bands]
    after, before = several_colours(2)
    marks: list[Mark] = [Bars(place - 0.3, place + 0.3, observed, colour=_PALE, label="observed")]
    for shift, predicted, label, colour in (
        (-0.12, check.before, "predicted before", before),
        (0.12, check.after, "predicted after", after),
    ):
        mean, low, high = (ends[:bands] for ends in (predicted.mean, predicted.low, predicted.high))
        marks += [
            Whiskers(place + shift, low, high, colour=colour),
            dots(place + shift, mean, "o", colour=colour, label=label),
        ]
    most = max(float(check.after.high[:bands].max()), float(observed.max()))
    return Panel(
        "Failures",
        Axis(
            f"life [{result.unit}]",
            ticks=place.tolist(),
            names=[f"to {count(float(f'{edge:.3g}'))}" for edge in check.edges[1:]],
            limits=(-0.6, bands - 0.4),
        ),
        Axis("units", limits=(0.0, 1.6 * most + 1.0)),
        marks,
        "Failures observed in bands of lives, and predicted with 95 % intervals.",
    )


def _remaining(result: FieldReturns) -> Panel:
    """Return the remaining lives of running units against their age."""
    title = "Further life of running units"
    if not result.running:
        return message(title, "no unit is running")
    marks, age = list[Mark](), np.array([unit.age for unit in result.running])
    for place, (share, colour) in enumerate(zip(SHARES, several_colours(len(SHARES)), strict=True)):
        value, low, high = arrays_of(unit.remaining.lives[place] for unit in result.running)
        marks += [
            Whiskers(age, low, np.where(np.isfinite(high), high, np.nan), colour=colour),
            dots(age, value, "o", colour=colour, label=f"B{share:g}"),
        ]
    x, y = (Axis(name, result.unit, 1.0, limits=(0.0, None)) for name in ("age", "further life"))
    return Panel(
        title,
        x,
        y,
        marks,
        "Further lives that 10 % and 50 % of units of an age do not reach, with 95 % intervals.",
    )

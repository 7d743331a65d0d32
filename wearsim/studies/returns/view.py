"""View of lives after returns from the field: before, after, goodness of fit, remaining lives."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict
from itertools import pairwise
from typing import Any

import numpy as np

from wearsim.report.text import count, count_of, part_with_interval, rounded_lives
from wearsim.report.view import STUDY, Column, Row, Rows, Table
from wearsim.results.study_view import DesignsView, columns_of
from wearsim.studies.life.view import limit_texts
from wearsim.studies.returns.result import SHARES, FieldReturns, RunningUnit
from wearsim.uq.estimation.intervals import Interval, arrays_of
from wearsim.uq.survival.fleet import Predicted

_MOST = 12  # running units in a table
_REACHED = Interval(1.0, 1.0, 1.0)  # probability of a unit that is older than the target
_BASIS = (
    "Intervals hold the value with a probability of 95 %, given the wear tests, the prior of the"
    " life factor and the returns; units are independent given these."
)


class FieldReturnsView(DesignsView):
    """Lives before and after returns, predicted and observed failures, and remaining lives.

    Panels: survival, failures, remaining lives. Files: the running units.
    """

    sheet = "wearsim.studies.returns.panels:returns_sheet"
    file, group = "units.csv", "Life"
    basis = _BASIS

    def __init__(self, result: FieldReturns) -> None:
        self.result, self.title = result, result.title
        self.question = f"How many {result.unit} does the design last, by its returns?"
        self.notes = tuple(
            f"{number} {'unit' if number == 1 else 'units'} withdrawn by another cause, {cause},"
            " count as suspended"
            for cause, number in result.returns.others.items()
        )
        self.warnings = tuple(_warnings(result))

    def rows(self) -> Rows:
        """Return the lives before and after the returns, and how well they agree."""
        result, check, rows = self.result, self.result.check, list[Row]()
        given = f"given {self._tests()}"
        units = count_of(len(result.returns.fleet), "unit")
        for number, label in enumerate(result.labels):
            of = f" of {label}" if len(result.labels) > 1 else ""
            before, after = (
                _life(life(10.0, number).interval, f" {result.unit}")
                for life in (result.before, result.after)
            )
            rows.append(Row(f"B10 after{of}", f"{after} {given} and {units}"))
            rows.append(Row(f"B10 before{of}", f"{before} {given}"))
            target = result.designs[number].target
            if target is not None:
                name = f"P(life < {count(target)} {result.unit}){of}"
                pair = [
                    part_with_interval(lives[number].probability_before(target))
                    for lives in (result.lives_before, result.lives_after)
                ]
                rows.append(Row(name, f"{pair[1]}, before {pair[0]}"))
        failed = int(result.returns.fleet.failed.sum())
        rows.append(
            Row("failures", f"{failed} observed, {_numbers(check.before, -1)} predicted before")
        )
        rows.append(Row("agreement before", _surprise(check.surprise)))
        rows.append(Row("goodness of fit after", _fit(check.fit)))
        return rows

    def tables(self) -> list[Table]:
        """Return the returns, lives, failures in bands, what is known, and running units."""
        result = self.result
        fleet = result.returns.fleet
        failed = int(fleet.failed.sum())
        known = int((fleet.failed & (fleet.low < fleet.high)).sum())
        units = f"{count_of(len(fleet), 'unit')}: {count(failed)} failed"
        units += f", {count(known)} of them at an inspection" if known else ""
        units += f", {count(len(result.running))} running"
        factor = result.life_factor
        prior = f"median 1, two of three within {factor:g} times" if factor > 1.0 else "1"
        limits = ", ".join(limit_texts(result.designs[0].scenario.limit.given))
        study = [
            Row("returns", f"{result.returns.file}, {units}"),
            Row("life", f"{result.unit} until the first of: {limits}"),
            Row("wear factor", f"posterior given {self._tests()}, integrated exactly"),
            Row("prior of the life factor", prior),
        ]
        tables = [Table(STUDY, study), self._lives(), self._bands(), self._known()]
        return [*tables, *([self._running()] if result.running else [])]

    def _tests(self) -> str:
        levels = self.result.posterior.before
        return f"{levels.specimens} specimens" if levels.specimens else "the specimens"

    def _lives(self) -> Table:
        """Return lives of shares before and after the returns."""
        result, lines = self.result, []
        for number, label in enumerate(result.labels):
            for share in result.designs[number].settings.shares:
                name = f"{label} B{share:g}" if len(result.labels) > 1 else f"B{share:g}"
                cells = [name]
                for life in (result.before(share, number), result.after(share, number)):
                    low, value, high = rounded_lives(life.low, life.predictive, life.high)
                    deviation = math.sqrt(life.by_tests + life.by_realisations)
                    cells += [value, f"{low}..{high}", f"{deviation:.2g}"]
                lines.append(cells)
        columns = ["95 % credible", "sd of ln life"]
        heads = [f"life [{result.unit}]", "before", *columns, "after", *columns]
        return Table("", lines, heads)

    def _bands(self) -> Table:
        """Return predicted and observed failures in bands of lives."""
        check, lines = self.result.check, []
        edges = [count(float(f"{edge:.3g}")) for edge in check.edges]
        names = [f"{low} to {high}" for low, high in pairwise(edges)]
        for place, name in enumerate([*names, "in all"]):
            if len(names) == 1 and place == 1:
                continue
            observed = f"{check.observed[place]:.3g}"
            predicted = (_numbers(item, place) for item in (check.before, check.after))
            lines.append([name, observed, *predicted])
        heads = [f"failures at [{self.result.unit}]", "observed", "predicted before", "after"]
        return Table("", lines, heads)

    def _known(self) -> Table:
        """Return wear factor and life factor before and after the returns."""
        result, posterior = self.result, self.result.posterior
        pairs = [result.wear_factor(levels) for levels in (posterior.before, posterior.after)]
        lines = [
            ["median of K/H over the life factor [1/Pa]", *(_range(pair[0]) for pair in pairs)],
            ["scatter t of ln K/H", *(_range(pair[1]) for pair in pairs)],
        ]
        if result.life_factor > 1.0:
            lines.append(["life factor", _range(result.factor_before), _range(result.factor)])
        return Table("", lines, ["what is not known", "before", "after"])

    def _running(self) -> Table:
        """Return the running units with the least remaining lives."""
        result = self.result
        ordered = sorted(result.running, key=lambda unit: unit.remaining.lives[0].value)
        several, target = len(result.labels) > 1, result.designs[0].target
        lines = []
        for unit in ordered[:_MOST]:
            lives = [_life(life) for life in unit.remaining.lives]
            cells = [unit.name, *([result.labels[unit.design]] if several else [])]
            cells += [count(float(f"{unit.age:.4g}")), *lives]
            if target is not None:
                cells.append(_reaches(unit))
            lines.append(cells)
        heads = ["running unit", *(["design"] if several else []), f"age [{result.unit}]"]
        heads += [f"further life, B{share:g}" for share in SHARES]
        heads += [f"reaches {count(target)}"] if target is not None else []
        if len(ordered) > _MOST:
            rest = f"and {count(len(ordered) - _MOST)} more"
            lines.append([rest, *[""] * (len(heads) - 1)])
        return Table("", lines, heads)

    def data(self) -> dict[str, Any]:
        """Return all numbers, lives in their unit."""
        result, posterior, check = self.result, self.result.posterior, self.result.check
        designs = []
        for number, label in enumerate(result.labels):
            design = result.designs[number]
            b = {
                f"{share:g}": {
                    "before": asdict(result.before(share, number)),
                    "after": asdict(result.after(share, number)),
                }
                for share in design.settings.shares
            }
            entry: dict[str, Any] = {"label": label, "b": b, "target": design.target}
            if design.target is not None:
                entry["probability_before_target"] = {
                    name: asdict(lives[number].probability_before(design.target))
                    for name, lives in (
                        ("before", result.lives_before),
                        ("after", result.lives_after),
                    )
                }
            designs.append(entry)
        before, after = (
            dict(zip(("k_over_h", "scatter"), map(asdict, result.wear_factor(levels)), strict=True))
            for levels in (posterior.before, posterior.after)
        )
        fleet = result.returns.fleet
        return {
            "title": result.title,
            "unit": result.unit,
            "returns": result.returns.file,
            "units": len(fleet),
            "failed": int(fleet.failed.sum()),
            "other_causes": result.returns.others,
            "specimens": posterior.before.specimens,
            "life_factor": {
                "prior_factor": result.life_factor,
                "before": asdict(result.factor_before),
                "after": asdict(result.factor),
            },
            "wear_factor_over_life_factor": {"before": before, "after": after},
            "designs": designs,
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

    def table(self) -> list[Column]:
        """Return the running units as columns."""
        result = self.result
        columns = [
            Column("unit", [unit.name for unit in result.running]),
            Column("design", [result.labels[unit.design] for unit in result.running]),
            Column("age", np.array([unit.age for unit in result.running]), result.unit),
        ]
        for place, share in enumerate(SHARES):
            lives = arrays_of(unit.remaining.lives[place] for unit in result.running)
            columns += columns_of(f"further life B{share:g}", lives, result.unit)
        if result.designs[0].target is not None:
            survival = arrays_of(unit.remaining.survival or _REACHED for unit in result.running)
            columns += columns_of("reaches target", survival)
        return columns


def _range(interval: Interval) -> str:
    return f"{interval.value:.3g} [{interval.low:.3g}, {interval.high:.3g}]"


def _life(life: Interval, unit: str = "") -> str:
    low, value, high = rounded_lives(life.low, life.value, life.high)
    return f"{value}{unit} [{low}..{high}]"


def _reaches(unit: RunningUnit) -> str:
    survival = unit.remaining.survival
    return "reached" if survival is None else part_with_interval(survival)


def _numbers(predicted: Predicted, place: int) -> str:
    ends = (predicted.low[place], predicted.high[place])
    return f"{predicted.mean[place]:.3g} [{ends[0]:.0f}, {ends[1]:.0f}]"


def _surprise(probability: float) -> str:
    text = f"p = {probability:.2g}"
    if probability < 0.05:
        return f"{text}: the number of failures is not the one predicted"
    return f"{text}: the number of failures is as predicted"


def _fit(probability: float) -> str:
    text = f"p = {probability:.2f}"
    if probability < 0.05:
        return f"{text}: lives of the field do not have the predicted distribution"
    return f"{text}: no contradiction in the distribution of the failures"


def _warnings(result: FieldReturns) -> Sequence[str]:
    """Return what speaks against the model."""
    check, warnings = result.check, []
    if check.fit < 0.05:
        warnings.append(
            f"the lives in the field do not have the predicted distribution (p = {check.fit:.2g}):"
            " another limit or another scatter of the inputs than in the scenario"
        )
    factor, prior = result.factor, result.factor_before
    if result.life_factor > 1.0 and not prior.low < factor.value < prior.high:
        warnings.append(
            f"the life factor of {factor.value:.2g} is outside its prior: the computed life is"
            " systematically wrong, or the units are not those of the scenario"
        )
    return warnings

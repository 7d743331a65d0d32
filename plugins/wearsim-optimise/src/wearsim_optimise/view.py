"""View of an optimisation: the best design, its gain, constraints, sensitivity and all designs."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from wearsim.report.text import NOTHING, PER_SI, count, count_of, lapse, shown
from wearsim.report.view import Column, Columns, Frame, Row, Rows, Table
from wearsim.results.study_view import StudyView
from wearsim_optimise.designs import Design
from wearsim_optimise.result import STATUS, OptimisationResult, not_converged

_MOST = 12  # designs in a table
_BASIS = (
    "The search compares designs by common draws. The gain of the best design is estimated with"
    " fresh draws; its interval holds the true value with 95 % confidence for the stated scatter of"
    " the inputs. It does not contain the error of the contact model or of the wear law."
)


class OptimisationView(StudyView[OptimisationResult]):
    """Best design with its gain, active constraints, sensitivity and tolerances.

    Panels: the objective against each variable, progress, the front of two objectives, parallel
    coordinates, and the sensitivity at the optimum. Files: designs; the table of pandas has the
    designs.
    """

    verb, sheet = "optimise", "wearsim_optimise.panels:optimisation_sheet"
    basis = _BASIS

    def __init__(self, result: OptimisationResult) -> None:
        super().__init__(result)
        request = result.raw.request
        words = {1: "greatest", -1: "least"}
        goals = " and ".join(f"the {words[sign]} {name}" for name, sign in request["objectives"])
        varied = ", ".join(variable.name for variable in result.design_variables)
        self.question = f"Which {varied} give {goals}?"
        self.heading = "best design" if result.finished else "designs so far"

    def rows(self) -> Rows:
        """Return the best design: variables, objectives, gains and constraints."""
        result = self.result
        if not result.raw.best:
            return [Row("best design", self._so_far())]
        best, goals = result.best, result.goals
        rows = [
            Row(variable.name, variable.shown(number) + self._at_bound(number, variable))
            for variable, number in zip(result.design_variables, best.numbers, strict=True)
        ]
        rows += [
            Row(name, goals.shown(name, best.values[name]), answers=self._answer(name, best))
            for name, _ in goals.objectives
        ]
        if goals.then:
            rows.append(Row(goals.then, goals.shown(goals.then, best.values[goals.then])))
        rows += [Row(f"gain in {gain['name']}", gain_text(gain)) for gain in result.raw.gains]
        for constraint in goals.constraints:
            value = goals.shown(constraint.name, best.values[constraint.name])
            rows.append(Row(constraint.text, value + self._activity(constraint.text)))
        if result.raw.front:
            rows.append(Row("front", f"{count(len(result.raw.front))} designs, see the table"))
        if (robustness := result.raw.robustness) is not None:
            rows.append(Row("within the tolerances", self._robustness(robustness)))
        rows.append(Row("search", self._convergence()))
        return rows

    def _convergence(self) -> str:
        """Return whether the search has converged, and the remedy if not."""
        raw = self.result.raw
        return "converged" if raw.converged else not_converged(raw.request["evaluations"])

    def _so_far(self) -> str:
        """Return the best feasible design of an unfinished optimisation."""
        text = "unfinished; continue with `wearsim resume`"
        feasible = [design for design in self.result.designs if design.is_feasible]
        if not feasible:
            return text
        best = min(feasible, key=lambda design: (design.loss, design.number))
        name = self.result.goals.objectives[0][0]
        pairs = zip(self.result.design_variables, best.numbers, strict=True)
        values = ", ".join(
            f"{variable.name} {variable.shown(number)}" for variable, number in pairs
        )
        return (
            f"{name} {self.result.goals.shown(name, best.values[name])} so far ({values}); {text}"
        )

    def _answer(self, name: str, best: Design) -> dict[str, tuple[float | None, str]]:
        return {name: (best.values[name], self.result.goals.unit(name))}

    def _at_bound(self, number: float, variable: Any) -> str:
        """Return text on a variable at a bound, with the gain from moving the bound."""
        for item in self.result.raw.active:
            if item["constraint"].startswith(f"{variable.name} "):
                side = "lower" if ">" in item["constraint"] else "upper"
                return f", at its {side} bound{self._brings(item)}"
        return ""

    def _activity(self, text: str) -> str:
        """Return whether a constraint is active, with the gain from relaxing it."""
        matching = [item for item in self.result.raw.active if item["constraint"] == text]
        return f", active{self._brings(matching[0])}" if matching else ""

    def _brings(self, item: Mapping[str, Any]) -> str:
        name = self.result.goals.objectives[0][0]
        if not math.isfinite(item["gain"]):
            return ""
        return f"; relaxing it by 1 % changes {name} by {100.0 * item['gain']:+.2g} %"

    def _robustness(self, robustness: Mapping[str, Any]) -> str:
        """Return the worst neighbour in words."""
        name = self.result.goals.objectives[0][0]
        if robustness["worst"] is None:
            return f"none of {robustness['neighbours']} neighbours could be evaluated"
        change = 100.0 * (robustness["part"] - 1.0)
        text = f"{name} {change:+.2g} % at worst of {robustness['neighbours']} neighbours"
        for constraint, item in robustness["violated"].items():
            text += f"; {constraint} is exceeded by up to {100.0 * item['beyond']:.2g} %"
        return text + (f"; {robustness['failed']} failed" if robustness["failed"] else "")

    def study(self) -> Rows:
        """Return rows on the designs, their number and the effort."""
        result, request = self.result, self.result.raw.request
        by_status = {
            status: sum(design.status == status for design in result.designs) for status in STATUS
        }
        words = ", ".join(f"{number} {name}" for name, number in by_status.items() if number)
        feasible = sum(design.is_feasible for design in result.designs)
        bounds = ", ".join(
            f"{v.name} {v.shown(v.low)} to {v.shown(v.high)}" if not v.choices else v.name
            for v in result.design_variables
        )
        return [
            Row("variables", bounds),
            Row("designs", f"{words}; {feasible} feasible"),
            Row("budget", f"{self._searched()}, {count_of(request['starts'], 'start')}"),
            Row("realisations", f"{request['realisations']}, common draws, seed {result.raw.seed}"),
            Row("contact model", result.described_model),
            Row("wall time", lapse(result.raw.wall_seconds)),
        ]

    def details(self) -> list[Table]:
        """Return sensitivity, front, best designs and failures."""
        result = self.result
        if not result.raw.best:
            return []
        tables = [self._sensitivity()]
        if result.front:
            tables.append(self._designs("front", result.front))
        else:
            feasible = [design for design in result.designs if design.is_feasible]
            ordered = sorted(feasible, key=lambda design: (design.loss, design.number))
            tables.append(self._designs("best designs", ordered[:_MOST]))
        failed = [design for design in result.designs if design.status in {"failed", "infeasible"}]
        if failed:
            lines = [
                [
                    str(design.number),
                    *self._numbers(design),
                    design.outcome["reason"].split("\n")[0],
                ]
                for design in failed[:_MOST]
            ]
            names = [variable.name for variable in result.design_variables]
            tables.append(Table("", lines, ["not evaluated", *names, "reason"]))
        return [table for table in tables if table.rows]

    def _sensitivity(self) -> Table:
        name = self.result.goals.objectives[0][0]
        lines = [
            [
                row["variable"],
                f"{row['elasticity']:+.3g} %" if math.isfinite(row["elasticity"]) else NOTHING,
            ]
            for row in self.result.raw.sensitivity
        ]
        return Table("", lines, ["1 % more of", f"changes {name} by"])

    def _designs(self, title: str, designs: Sequence[Design]) -> Table:
        result = self.result
        names = [variable.name for variable in result.design_variables]
        asked = list(result.goals.named)
        lines = [
            [
                str(design.number),
                *self._numbers(design),
                *(result.goals.shown(name, design.values.get(name, math.nan)) for name in asked),
            ]
            for design in designs
        ]
        return Table("", lines, [title, *names, *asked])

    def _numbers(self, design: Design) -> list[str]:
        pairs = zip(self.result.design_variables, design.numbers, strict=True)
        return [variable.shown(number) for variable, number in pairs]

    def random_inputs(self) -> Rows:
        """Return descriptions of the random inputs."""
        return [Row(item.name, item.describe()) for item in self.result.scenario.random]

    def data(self) -> dict[str, Any]:
        """Return the best design, its gains and all designs in SI."""
        result, raw = self.result, self.result.raw
        variables = result.design_variables
        known = bool(raw.best)
        return {
            "title": result.title,
            "finished": result.finished,
            "objectives": raw.request["objectives"],
            "constraints": [item.text for item in result.goals.constraints] if raw.named else [],
            "best": raw.best or None,
            "converged": raw.converged,
            "best_values": result.best_values if known else None,
            "quantities": dict(result.best.values) if known else None,
            "units": {name: item["unit"] for name, item in raw.named.items()},
            "gains": raw.gains,
            "active": raw.active,
            "sensitivity": raw.sensitivity,
            "robustness": raw.robustness,
            "front": raw.front,
            "designs": [
                {
                    "number": design.number,
                    "purpose": design.purpose,
                    "status": design.status,
                    "reason": design.outcome["reason"] or None,
                    "feasible": design.is_feasible,
                    **{
                        variable.name: variable.choices[round(number)]
                        if variable.choices
                        else number * variable.size
                        for variable, number in zip(variables, design.numbers, strict=True)
                    },
                    **design.values,
                }
                for design in result.designs
            ],
            "seed": raw.seed,
            "wall_seconds": raw.wall_seconds,
            **self.ending(),
        }

    def line(self) -> str:
        """Return designs, realisations and time on one line."""
        result = self.result
        ended = ", converged" if result.raw.converged else ", not converged"
        return (
            f"{self._searched()}{ended if result.raw.best else ''},"
            f" {lapse(result.raw.wall_seconds)}"
        )

    def _searched(self) -> str:
        """Return how much of its budget the search took, and the number of further designs."""
        designs = self.result.designs
        used, most = (
            sum(design.counts for design in designs),
            self.result.raw.request["evaluations"],
        )
        further = sum(not design.is_searched for design in designs)
        text = f"{count(used)} of at most {count(most)} designs in the search"
        return text + (f" and {count(further)} around the best" if further else "")

    def columns(self) -> Mapping[str, Columns]:
        """Return all designs."""
        result = self.result
        designs = result.designs
        columns = [
            Column("design", [str(design.number) for design in designs]),
            Column("purpose", [design.purpose for design in designs]),
            Column("status", [design.status for design in designs]),
            Column("feasible", np.array([float(design.is_feasible) for design in designs])),
        ]
        for number, variable in enumerate(result.design_variables):
            values = [design.numbers[number] for design in designs]
            if variable.choices:
                texts = [str(variable.choices[round(value)]) for value in values]
                columns.append(Column(variable.name, texts))
            else:
                in_si = np.array(values) * variable.size
                columns.append(Column(variable.name, in_si, variable.unit or "1", variable.size))
        for name in result.goals.named if result.raw.named else ():
            unit = result.goals.unit(name)
            values = [design.values.get(name, math.nan) for design in designs]
            columns.append(Column(name, np.array(values), unit, 1.0 / PER_SI[unit]))
        columns.append(
            Column("reason", [design.outcome["reason"].replace("\n", "; ") for design in designs])
        )
        return {"designs.csv": [columns]}

    def frame(self) -> Frame:
        """Return all designs, one row each."""
        result = self.result
        schema = result.raw.schema.variables
        columns = [(name, item.unit, result.raw.variables[name]) for name, item in schema.items()]
        return Frame(columns, "design", range(1, len(result.designs) + 1))

    def options(self) -> Sequence[str]:
        """Return the options of the command that repeats the optimisation."""
        request = self.result.raw.request
        options = []
        for variable in self.result.design_variables:
            options += ["--vary", _as_option(variable)]
        for name, sign in request["objectives"]:
            options += ["--maximise" if sign > 0 else "--minimise", name]
        for item in request["constraints"]:
            options += ["--subject-to", f"{item['name']} {item['sign']} {item['limit']}"]
        options += ["--then", request["then"]] if request["then"] else []
        for name, number in request["tolerances"].items():
            unit = next(v.unit for v in self.result.design_variables if v.name == name)
            options += ["--tolerance", f"{name}={number:g} {unit}".strip()]
        options += ["-n", str(request["realisations"]), "--seed", str(self.result.raw.seed)]
        options += ["--evaluations", str(request["evaluations"]), "--starts"]
        return [*options, str(request["starts"])]


def _as_option(variable: Any) -> str:
    """Return a variable as the argument of --vary."""
    if variable.choices:
        return f"{variable.name}={','.join(map(str, variable.choices))}"
    low, high = (
        f"{round(end)}" if variable.kind == "integer" else f"{end:.12g}{variable.unit}"
        for end in (variable.low, variable.high)
    )
    return f"{variable.name}={low}:{high}"


def gain_text(gain: Mapping[str, Any]) -> str:
    """Return an objective of the best design over that of the first: "2.1 [1.9, 2.3] times"."""
    if "ratio" not in gain:
        return f"not stated: {gain.get('why', '')}".rstrip(": ")
    text = shown(gain["ratio"], "1", 4)
    if gain["fresh"]:
        interval = "too few for an interval"
        if math.isfinite(gain["low"]) and math.isfinite(gain["high"]):
            interval = f"{shown(gain['low'], '1', 4)}, {shown(gain['high'], '1', 4)}"
        return f"{text} [{interval}] times the first design, fresh draws"
    return f"{text} times the first design"

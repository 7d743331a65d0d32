"""Result of an optimisation, and the content of its file."""

from __future__ import annotations

import math
from collections.abc import Container, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, ClassVar

import numpy as np

from wearsim import Scenario
from wearsim.errors import ResultsFileError
from wearsim.results.content import Axis, Schema, StudyData, StudyResult, Variable as Stored
from wearsim_optimise.designs import Design, with_goals
from wearsim_optimise.goals import Constraint, Goals
from wearsim_optimise.variables import Variable, from_table, overrides

AXES = {"design": Axis("design", "evaluated design")}
BASE = Schema(
    "wearsim-optimisation", 2, "designs of an optimisation, from `wearsim optimise`", AXES, {}
)
STATUS = ("evaluated", "before wear", "infeasible", "failed")


@dataclass(frozen=True, eq=False, kw_only=True)
class OptimisationData(StudyData):
    """Data of an optimisation, in addition to `StudyData`.

    Parameters
    ----------
    request : dict
        What was asked for: variables, objectives, constraints, budget and tolerances.
    named : dict
        Study, name, unit and label of each quantity.
    first : dict
        Values and margins of the first design, which give the scales of the search.
    designs : list of dict
        Key, values of the variables and purpose of each design, in order.
    outcomes : dict
        Outcome of each design by its key.
    best : int
        Number of the best design; 0 before it is known.
    converged : bool
        Whether the search has converged within its number of designs.
    front : list of int
        Numbers of the designs of a front.
    sensitivity, active, gains : list of dict
        At the optimum: derivatives, active constraints, and objectives over the first design's.
    robustness : dict, optional
        Worst neighbour within the tolerances.
    variables : dict of str to ndarray
        Variables, quantities, status and time of each design.
    """

    base_schema: ClassVar[Schema] = BASE

    request: dict[str, Any]
    named: dict[str, Any] = field(default_factory=dict)
    first: dict[str, float] = field(default_factory=dict)
    designs: list[dict[str, Any]] = field(default_factory=list)
    outcomes: dict[str, Any] = field(default_factory=dict)
    best: int = 0
    converged: bool = False
    front: list[int] = field(default_factory=list)
    sensitivity: list[dict[str, Any]] = field(default_factory=list)
    active: list[dict[str, Any]] = field(default_factory=list)
    gains: list[dict[str, Any]] = field(default_factory=list)
    robustness: dict[str, Any] | None = None
    variables: dict[str, Any] = field(default_factory=dict)

    @property
    def schema(self) -> Schema:
        """Schema of the results file, with a variable for each design variable and quantity."""
        return self.schema_of(self.attributes, ())

    @classmethod
    def schema_of(cls, attributes: Mapping[str, Any], names: Container[str]) -> Schema:
        """Return the schema of a file by its attributes."""
        rows = [("status", "1", f"0 to 3: {', '.join(STATUS)}"), ("seconds", "s", "time")]
        rows.append(("feasible", "1", "1 for a design within all constraints"))
        rows += [
            (item.name, item.si_unit, "design variable")
            for item in map(from_table, attributes["request"]["variables"])
        ]
        rows += [
            (name, si_of(named["unit"]), named["label"])
            for name, named in attributes["named"].items()
        ]
        variables = {
            name: Stored(name, ("design",), unit, text, "record") for name, unit, text in rows
        }
        return replace(BASE, variables=variables)


def not_converged(evaluations: int) -> str:
    """Return that a search ended at its number of designs, and the remedy."""
    return (
        f"the search ended at its {evaluations} designs before it converged: better designs may"
        f" exist; give it more, such as --evaluations {2 * evaluations}"
    )


def si_of(unit: str) -> str:
    """Return the SI unit of a unit that is shown."""
    from wearsim.plugins import kind_of  # noqa: PLC0415

    return "1" if unit in {"1", "%"} else kind_of(unit).unit


def goals_of(data: OptimisationData) -> Goals | None:
    """Return the goals of an optimisation; None before its first design."""
    if not data.named:
        return None
    request = data.request
    return Goals(
        tuple((name, sign) for name, sign in request["objectives"]),
        tuple(Constraint(**item) for item in request["constraints"]),
        request["then"],
        data.named,
        data.first,
    )


def columns_of(
    variables: list[Variable], goals: Goals | None, designs: list[Design]
) -> dict[str, Any]:
    """Return the arrays of a file: status, variables and quantities of each design."""
    columns: dict[str, Any] = {
        "status": np.array([STATUS.index(d.status) for d in designs], dtype=float),
        "seconds": np.array([d.outcome["seconds"] for d in designs], dtype=float),
        "feasible": np.array([d.is_feasible for d in designs], dtype=float),
    }
    for number, variable in enumerate(variables):
        values = np.array([design.numbers[number] for design in designs], dtype=float)
        columns[variable.name] = values * variable.size
    for name in goals.named if goals else ():
        known = [design.values.get(name, math.nan) for design in designs]
        columns[name] = np.array(known, dtype=float)
    return columns


@dataclass(frozen=True, eq=False)
class OptimisationResult(StudyResult[OptimisationData]):
    """Best values of design variables, and all designs that were evaluated.

    Parameters
    ----------
    raw : OptimisationData
    path : Path, optional
    """

    def __repr__(self) -> str:
        if not self.raw.best:
            return f"<OptimisationResult '{self.title}': {len(self.designs)} designs, unfinished>"
        name = self.goals.objectives[0][0]
        value = self.goals.shown(name, self.best.values[name])
        return f"<OptimisationResult '{self.title}': {len(self.designs)} designs, {name} {value}>"

    @cached_property
    def design_variables(self) -> list[Variable]:
        """The variables."""
        return [from_table(item) for item in self.raw.request["variables"]]

    @cached_property
    def goals(self) -> Goals:
        """Objectives and constraints with the units of their quantities."""
        goals = goals_of(self.raw)
        if goals is None:
            raise ResultsFileError(f"{self.path}: no design has been evaluated yet")
        return goals

    @cached_property
    def designs(self) -> list[Design]:
        """All designs, in the order in which they were asked for."""
        goals = goals_of(self.raw)
        return [
            with_goals(
                Design(
                    number,
                    tuple(item["numbers"]),
                    item["purpose"],
                    self.raw.outcomes[item["key"]],
                    item["key"],
                ),
                goals,
            )
            for number, item in enumerate(self.raw.designs, 1)
        ]

    @property
    def best(self) -> Design:
        """The best design.

        Raises
        ------
        ResultsFileError
            If the optimisation is unfinished.
        """
        if not self.raw.best:
            raise ResultsFileError(f"{self.path}: the optimisation is unfinished")
        return self.designs[self.raw.best - 1]

    @property
    def front(self) -> list[Design]:
        """The designs of the front of two objectives; empty with one."""
        return [self.designs[number - 1] for number in self.raw.front]

    @property
    def best_values(self) -> dict[str, Any]:
        """Values of the best design by dotted key, as in a scenario."""
        return overrides(self.design_variables, self.best.numbers)

    @property
    def best_scenario(self) -> Scenario:
        """The scenario of the best design."""
        return self.scenario.changed(self.best_values)

    def scenario_of(self, number: int) -> Scenario:
        """Return the scenario of a design by its number."""
        design = self.designs[number - 1]
        return self.scenario.changed(overrides(self.design_variables, design.numbers))

    def values(self, name: str) -> Any:
        """Return a variable or a quantity of all designs, shape (designs,) [SI]."""
        return self.raw.variables[name]

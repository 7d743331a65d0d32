"""Objectives and constraints of an optimisation, and their values on the scales of the search."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from wearsim.arguments import ArgumentError
from wearsim.plugins import QuantityError, kind_of, quantity
from wearsim.report.text import PER_SI, shown

_CONSTRAINT = re.compile(r"\s*([A-Za-z][\w.%+-]*)\s*(<=?|>=?)\s*(.+?)\s*")
TIGHTER = 1e-4  # margin within each limit that the search keeps, over the limit
_SMALL = 1e-3  # part of the first value below which the scale of an objective is linear
ONE_PERCENT = math.log(1.01)  # difference of the loss within which `then` selects


@dataclass(frozen=True)
class Constraint:
    """A limit of a quantity.

    Parameters
    ----------
    name : str
        Name of the quantity.
    sign : {"<", ">"}
    limit : str
        Limit as given, "900 MPa".
    """

    name: str
    sign: str
    limit: str

    @property
    def text(self) -> str:
        """The constraint as given."""
        return f"{self.name} {self.sign} {self.limit}"


def parse_constraint(text: str) -> Constraint:
    """Return the constraint of a text such as "peak_pressure < 900 MPa".

    Raises
    ------
    ValueError
        If the text is not a constraint.
    """
    match = _CONSTRAINT.fullmatch(text)
    if match is None:
        raise ValueError(
            f"'{text}' is not a constraint, expected a quantity, < or >, and a limit, such as"
            " peak_pressure < 900 MPa"
        )
    return Constraint(match[1], match[2][0], match[3])


@dataclass(frozen=True)
class Goals:
    """Objectives, constraints and what is known of their quantities.

    Parameters
    ----------
    objectives : tuple of (str, int)
        Names, and 1 for the greatest, -1 for the least.
    constraints : tuple of Constraint
    then : str
        Quantity that is least among designs within 1 % of the best; empty for none.
    named : mapping of str to dict
        Verb, name, unit and label of each quantity, from the first design.
    first : mapping of str to float
        Values and margins of the first design, which give the scales.
    """

    objectives: tuple[tuple[str, int], ...]
    constraints: tuple[Constraint, ...]
    then: str
    named: Mapping[str, Mapping[str, Any]]
    first: Mapping[str, float]

    def limit(self, constraint: Constraint) -> float:
        """Return a limit in SI.

        Raises
        ------
        ArgumentError
            If its unit is not that of the quantity.
        """
        unit = self.named[constraint.name]["unit"]
        try:
            plain = float(constraint.limit)
        except ValueError:
            pass
        else:
            if unit in {"1", "%"}:
                return plain
            example = f"{constraint.name} {constraint.sign} {plain:g} {unit}"
            text = f"'{constraint.text}' lacks a unit, expected one such as '{example}'"
            raise ArgumentError("subject_to", text)
        if unit == "%" and constraint.limit.endswith("%"):
            return 0.01 * float(constraint.limit.removesuffix("%"))
        try:
            return quantity(constraint.limit, kind_of(unit).unit if unit not in {"1", "%"} else "1")
        except (QuantityError, ValueError) as error:
            raise ArgumentError("subject_to", f"'{constraint.text}': {error}") from error

    def loss(self, number: int, value: float) -> float:
        """Return an objective as a number to be made small: its logarithm where it is positive."""
        name, sign = self.objectives[number]
        return self.scaled(name, value, sign)

    def scaled(self, name: str, value: float, sign: int = -1) -> float:
        """Return a value on the scale of the search, which falls as it becomes better."""
        if math.isnan(value):
            return math.nan
        first = self.first.get(name, value)
        if not first > 0.0:
            return -sign * value / (abs(first) or 1.0)
        part = value / first
        if part > _SMALL:
            return -sign * math.log(part)
        return -sign * (math.log(_SMALL) + part / _SMALL - 1.0)

    def slacks(self, values: Mapping[str, float], margins: Mapping[str, float]) -> list[float]:
        """Return how far a design is within each constraint, over its limit; not below zero.

        The margins of a cam follow the given constraints. The slack of an unknown value is NaN.
        """
        slacks = []
        for constraint in self.constraints:
            limit, value = self.limit(constraint), values.get(constraint.name, math.nan)
            side = 1.0 if constraint.sign == "<" else -1.0
            slacks.append(side * (limit - value) / (abs(limit) or 1.0))
        for name in self.margin_names:
            scale, value = abs(self.first[f"margin {name}"]) or 1.0, margins.get(name, math.nan)
            slacks.append(min(value / scale, 1e3))
        return slacks

    @property
    def margin_names(self) -> list[str]:
        """Names of the margins of a cam, above zero for a feasible one."""
        return [name.removeprefix("margin ") for name in self.first if name.startswith("margin ")]

    @property
    def slack_names(self) -> list[str]:
        """Texts of the constraints in the order of `slacks`."""
        return [
            *(constraint.text for constraint in self.constraints),
            *(f"{name} > 0" for name in self.margin_names),
        ]

    def shown(self, name: str, value: float) -> str:
        """Return a value with its unit."""
        named = self.named.get(name)
        if named is None or math.isnan(value):
            return shown(None if math.isnan(value) else value, "1")
        return shown(value, named["unit"], 5)

    def label(self, name: str) -> str:
        """Return the name of a quantity with its unit, for an axis."""
        return name

    def unit(self, name: str) -> str:
        """Return the unit of a quantity that is shown."""
        return str(self.named[name]["unit"]) if name in self.named else "1"

    def per_si(self, name: str) -> float:
        """Return one SI unit in the unit that is shown."""
        return PER_SI[self.unit(name)]


def asked_names(
    objectives: Sequence[tuple[str, int]], constraints: Sequence[Constraint], then: str
) -> list[str]:
    """Return the names of all quantities that are asked for, each once."""
    names = [name for name, _ in objectives] + [item.name for item in constraints]
    return list(dict.fromkeys([*names, *([then] if then else [])]))

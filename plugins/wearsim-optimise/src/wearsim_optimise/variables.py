"""Design variables: keys of the scenario, their bounds, and designs as points of a unit cube."""

from __future__ import annotations

import math
import re
import tomllib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from wearsim import Scenario
from wearsim.plugins import QuantityError, kind_of, quantity

Vector = npt.NDArray[np.float64]

_NUMBER = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*(.*?)\s*")
_WHOLE = re.compile(r"\s*[+-]?\d+\s*")
_DIGITS = 12
LOG_FROM = 4.0  # ratio of the bounds from which a variable is searched by its logarithm
EXAMPLE = "such as cam.base_radius=35mm:60mm, operation.rollers=1:4 or cam.material=steel,bronze"


@dataclass(frozen=True)
class Variable:
    """A design variable.

    Parameters
    ----------
    keys : tuple of str
        Dotted keys of the scenario that have its value.
    kind : {"continuous", "integer", "list"}
    low, high : float
        Bounds, in `unit`; of a list the first and the last number of a choice.
    unit : str
        Unit of the bounds as given; empty for plain numbers.
    choices : tuple
        Values of a list, as in a scenario.
    """

    keys: tuple[str, ...]
    kind: Literal["continuous", "integer", "list"]
    low: float
    high: float
    unit: str = ""
    choices: tuple[Any, ...] = ()

    @property
    def name(self) -> str:
        """The keys, joined by a plus sign."""
        return "+".join(self.keys)

    @property
    def is_log(self) -> bool:
        """Whether the logarithm is searched."""
        return self.kind == "continuous" and self.low > 0.0 and self.high >= LOG_FROM * self.low

    @property
    def size(self) -> float:
        """The unit in SI."""
        return quantity(f"1 {self.unit}", kind_of(self.unit).unit) if self.unit else 1.0

    @property
    def si_unit(self) -> str:
        """Unit of the values in SI; "1" for plain numbers and choices."""
        return kind_of(self.unit).unit if self.unit else "1"

    @property
    def count(self) -> int:
        """Number of values of an integer or a list."""
        return round(self.high - self.low) + 1

    def number(self, place: float) -> float:
        """Return the number at a place between 0 and 1, in `unit`; of a list that of the choice."""
        if self.kind != "continuous":
            return self.low + min(math.floor(place * self.count), self.count - 1)
        number = self.low + place * (self.high - self.low)
        if self.is_log:
            number = self.low * (self.high / self.low) ** place
        return float(f"{number:.{_DIGITS}g}")  # so that a place and its number are one design

    def place(self, number: float) -> float:
        """Return the place of a number between the bounds, 0 to 1."""
        if self.kind != "continuous":
            return (number - self.low + 0.5) / self.count
        if self.is_log:
            return math.log(max(number, 1e-300) / self.low) / math.log(self.high / self.low)
        return (number - self.low) / (self.high - self.low)

    def written(self, number: float) -> Any:
        """Return a number as the value in a scenario."""
        if self.kind == "list":
            return self.choices[round(number)]
        if self.kind == "integer":
            return round(number)
        return f"{number!r} {self.unit}" if self.unit else number

    def shown(self, number: float) -> str:
        """Return a number for a table."""
        if self.kind == "list":
            return str(self.choices[round(number)])
        text = f"{round(number)}" if self.kind == "integer" else f"{number:.5g}"
        return f"{text} {self.unit}" if self.unit else text


def parse_variable(text: str) -> Variable:
    """Return the variable of a text such as "cam.base_radius=35mm:60mm".

    Raises
    ------
    ValueError
        If it is not a variable, or has no range.
    """
    name, equals, values = text.partition("=")
    keys = tuple(part.strip() for part in name.split("+"))
    if not equals or not all(keys) or not values.strip():
        raise ValueError(
            f"'{text}' is not a variable, expected a key with bounds or a list, {EXAMPLE}"
        )
    low, colon, high = values.partition(":")
    if not colon:
        choices = tuple(map(_choice, _parts(values)))
        if len(choices) < 2:
            raise ValueError(f"'{text}' has one value, expected bounds or a list, {EXAMPLE}")
        if any(first == second for n, first in enumerate(choices) for second in choices[:n]):
            raise ValueError(f"'{text}' has a value twice; remove one of them")
        return Variable(keys, "list", 0.0, len(choices) - 1.0, "", choices)
    ends = [_NUMBER.fullmatch(end) for end in (low, high)]
    if ends[0] is None or ends[1] is None:
        raise ValueError(f"'{text}': the bounds are not numbers, expected some {EXAMPLE}")
    unit = ends[1][2]
    numbers = [_in_unit(match, unit, text) for match in ends if match]
    if numbers[0] >= numbers[1]:
        raise ValueError(
            f"'{text}': the upper bound {high.strip()} is not above the lower one, {low.strip()};"
            " exchange them"
        )
    is_whole = not unit and all(_WHOLE.fullmatch(end) for end in (low, high))
    kind: Literal["continuous", "integer"] = "integer" if is_whole else "continuous"
    return Variable(keys, kind, numbers[0], numbers[1], unit)


def _parts(values: str) -> list[str]:
    """Split a list at its commas, but not within brackets and quotes."""
    parts, depth, quoted = [""], 0, False
    for sign in values:
        quoted ^= sign == '"'
        depth += (sign in "[{") - (sign in "]}") if not quoted else 0
        if sign == "," and not depth and not quoted:
            parts.append("")
        else:
            parts[-1] += sign
    return [part.strip() for part in parts]


def _choice(text: str) -> Any:
    """Return a choice of a list as the value in a scenario: TOML if it is some, or a text."""
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError:
        match = _NUMBER.fullmatch(text)
        return f"{match[1]} {match[2]}" if match and match[2] else text


def _in_unit(match: re.Match[str], unit: str, text: str) -> float:
    """Return a bound as a number of a unit."""
    if match[2] == unit or not (unit or match[2]):
        return float(match[1])
    try:
        si = kind_of(unit or match[2]).unit
        return quantity(f"{match[1]} {match[2]}", si) / quantity(f"1 {unit}", si)
    except QuantityError as error:
        raise ValueError(f"'{text}': {error}") from error


def check_variables(variables: Sequence[Variable], scenario: Scenario) -> None:
    """Check variables against a scenario.

    Raises
    ------
    ValueError
        If one is given twice, or is random.
    """
    seen: set[str] = set()
    random = {key: item.describe() for item in scenario.random for key in item.keys}
    for variable in variables:
        for key in variable.keys:
            if key in seen:
                raise ValueError(f"'{key}' is varied twice; delete one of them")
            seen.add(key)
            for name, text in random.items():
                if key == name or key.startswith(f"{name}.") or name.startswith(f"{key}."):
                    raise ValueError(
                        f"'{key}' is random in {scenario.file} ({text}), and cannot be a variable;"
                        f" vary a number of its distribution, or give it a value with"
                        f" --set {name}=..."
                    )


def text_at(scenario: Scenario, key: str) -> Any:
    """Return what a scenario holds at a dotted key; None if there is nothing."""
    value: Any = tomllib.loads(scenario.text)
    for part in key.split("."):
        if isinstance(value, list):
            value = value[int(part) - 1] if part.isdigit() and int(part) <= len(value) else None
        elif isinstance(value, Mapping) and part in value:
            value = value[part]
        else:
            return None
    return value


def number_at(scenario: Scenario, variable: Variable) -> float | None:
    """Return the number of a variable in a scenario, in its unit; None if it has none."""
    value = text_at(scenario, variable.keys[0])
    if variable.kind == "list":
        return float(variable.choices.index(value)) if value in variable.choices else None
    if isinstance(value, bool) or value is None:
        return None
    match = _NUMBER.fullmatch(str(value))
    if match is None:
        return None
    try:
        return _in_unit(match, variable.unit, str(value))
    except ValueError:
        return None


def start_of(scenario: Scenario, variables: Sequence[Variable]) -> tuple[float, ...]:
    """Return the numbers of a scenario, moved to the bounds, or the middle where it has none."""
    numbers = []
    for variable in variables:
        number = number_at(scenario, variable)
        if number is None:
            number = variable.number(0.5)
        numbers.append(min(max(number, variable.low), variable.high))
    return tuple(numbers)


def numbers_at(variables: Sequence[Variable], places: Iterable[float]) -> tuple[float, ...]:
    """Return the numbers at places of the unit cube."""
    return tuple(
        variable.number(min(max(float(place), 0.0), 1.0))
        for variable, place in zip(variables, places, strict=True)
    )


def places_of(variables: Sequence[Variable], numbers: Sequence[float]) -> Vector:
    """Return the places of numbers in the unit cube."""
    return np.array([v.place(number) for v, number in zip(variables, numbers, strict=True)])


def overrides(variables: Sequence[Variable], numbers: Sequence[float]) -> dict[str, Any]:
    """Return the values by dotted key of a design."""
    return {
        key: variable.written(number)
        for variable, number in zip(variables, numbers, strict=True)
        for key in variable.keys
    }


def as_table(variable: Variable) -> dict[str, Any]:
    """Return a variable as plain data."""
    return asdict(variable)


def from_table(table: Mapping[str, Any]) -> Variable:
    """Return the variable of plain data."""
    lists = {name: tuple(table[name]) for name in ("keys", "choices")}
    return Variable(**{**table, **lists})

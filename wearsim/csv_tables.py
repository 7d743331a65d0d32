"""CSV files whose headers carry units, "time [min]", read as SI columns with every mistake told."""

from __future__ import annotations

import csv
import difflib
import re
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from wearsim.errors import Mistake, ScenarioError
from wearsim.quantities import DECIMAL_COMMA, NOT_FINITE, NUMBER
from wearsim.units import QuantityError, conversion

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from wearsim.types import FloatArray

MOST_MISTAKES = 20
_HEADER = re.compile(r"(?P<name>[^\[\]]*?)\s*(?:\[(?P<unit>[^\[\]]*)\])?")
_PLAIN_NUMBER = {"", "-", "1"}  # how the unit of a plain number may be written


@dataclass(frozen=True)
class _Row:
    line: int
    cells: list[str]


@dataclass(frozen=True)
class _Column:
    """A column that was asked for and found: where it stands, and its factor to SI."""

    name: str
    index: int
    factor: float
    unit: str


@dataclass
class _Mistakes:
    """The mistakes of one file, in the order they were met."""

    found: list[Mistake] = field(default_factory=list)

    def add(
        self, line: int | None, what: str, got: str | None = None, expected: str | None = None
    ) -> None:
        key = "" if line is None else f"line {line}"
        self.found.append(Mistake("", key, what, got, expected))

    def capped(self) -> list[Mistake]:
        rest = len(self.found) - MOST_MISTAKES
        if rest <= 0:
            return self.found
        return [*self.found[:MOST_MISTAKES], Mistake("", "", f"and {rest} more")]


def read_columns(
    text: str,
    file: str,
    columns: Mapping[str, str],
    *,
    aliases: Mapping[str, Sequence[str]] | None = None,
    rising: str | None = None,
) -> dict[str, FloatArray]:
    """Read columns of numbers from a CSV file with units in its headers.

    The first line that is neither blank nor a ``#`` comment is the header: cells such as
    ``time [min]``, separated by commas, semicolons or tabs. Columns that are not asked for are
    left alone.

    Parameters
    ----------
    text : str
        The file's content.
    file : str
        Its name, for messages.
    columns : mapping of str to str
        Unit to return for each column by name; "1" for plain numbers.
    aliases : mapping of str to sequence of str, optional
        Other names under which a column may stand.
    rising : str, optional
        A column whose values must rise from row to row.

    Returns
    -------
    dict of str to ndarray, shape (rows,)
        Each column asked for, in its unit.

    Raises
    ------
    ScenarioError
        With every mistake in the file, up to a limit.
    """
    import numpy as np  # noqa: PLC0415  (this room is imported by the shell's every command)

    mistakes = _Mistakes()
    rows, separator = _rows(text)
    if not rows:
        mistakes.add(None, "the file is empty", None, _header_form(columns))
        raise ScenarioError(file, mistakes.found)
    found = _find_columns(rows[0], columns, aliases or {}, mistakes)
    values = _numbers(rows, found, separator, rising, mistakes)
    if len(rows) < 3:
        mistakes.add(None, "too few rows of numbers", str(len(rows) - 1), "at least 2")
    if mistakes.found:
        raise ScenarioError(file, mistakes.capped())
    return {column.name: np.array(values[column.name]) * column.factor for column in found}


def _rows(text: str) -> tuple[list[_Row], str]:
    """Cut the text into rows; the header decides what separates their cells."""
    lines = [
        (number, line)
        for number, line in enumerate(text.lstrip("\ufeff").splitlines(), start=1)
        if line.strip() and not line.lstrip().startswith("#")
    ]
    if not lines:
        return [], ","
    header = lines[0][1]
    separator = next((mark for mark in "\t;," if mark in header), ",")
    cells = (
        next(csv.reader([line], delimiter=separator, skipinitialspace=True)) for _, line in lines
    )
    rows = [
        _Row(number, [cell.strip() for cell in row])
        for (number, _), row in zip(lines, cells, strict=True)
    ]
    return rows, separator


def _header_form(columns: Mapping[str, str]) -> str:
    cells = (name if unit == "1" else f"{name} [{unit}]" for name, unit in columns.items())
    return "a header line such as " + ", ".join(cells)


def _find_columns(
    header: _Row,
    columns: Mapping[str, str],
    aliases: Mapping[str, Sequence[str]],
    mistakes: _Mistakes,
) -> list[_Column]:
    """Find the columns asked for in the header."""
    heads = [_HEADER.fullmatch(cell) for cell in header.cells]
    names = [
        (head["name"] if head else cell) for head, cell in zip(heads, header.cells, strict=True)
    ]
    found = []
    for name, unit in columns.items():
        accepted = {name, *aliases.get(name, ())}
        places = [place for place, other in enumerate(names) if other in accepted]
        if len(places) != 1:
            expected = name if unit == "1" else f"{name} [{unit}]"
            _report_absent(name, expected, len(places), header, mistakes)
            continue
        head = heads[places[0]]
        factor = _factor(header.line, name, head["unit"] if head else None, unit, mistakes)
        found.append(_Column(name, places[0], factor, unit))
    return found


def _report_absent(name: str, expected: str, times: int, header: _Row, mistakes: _Mistakes) -> None:
    if times:
        mistakes.add(header.line, f"column '{name}' stands {times} times")
        return
    names = [cell.split("[")[0].strip() for cell in header.cells]
    near = difflib.get_close_matches(name, names, n=1)
    hint = f" (is it '{near[0]}'?)" if near else ""
    got = ", ".join(header.cells)
    mistakes.add(header.line, f"column '{name}' is missing{hint}", got, expected)


def _factor(line: int, name: str, written: str | None, unit: str, mistakes: _Mistakes) -> float:
    """Return what one `written` is in `unit`; 1 where that cannot be said."""
    if unit == "1":
        if (written or "").strip() not in _PLAIN_NUMBER:
            mistakes.add(line, f"column '{name}': a plain number has no unit", f"[{written}]", name)
        return 1.0
    if not (written or "").strip():
        mistakes.add(line, f"column '{name}' has no unit", name, f"{name} [{unit}]")
        return 1.0
    try:
        return float(conversion(str(written), unit))
    except QuantityError as error:
        mistakes.add(line, f"column '{name}': {error.what}", error.got, error.expected)
        return 1.0


def _numbers(
    rows: list[_Row],
    found: list[_Column],
    separator: str,
    rising: str | None,
    mistakes: _Mistakes,
) -> dict[str, list[float]]:
    """Read every cell of the columns found."""
    width = len(rows[0].cells)
    values: dict[str, list[float]] = {column.name: [] for column in found}
    for row in rows[1:]:
        if len(row.cells) > width:
            comma = " (is a comma meant as decimal point?)" if separator == "," else ""
            got, expected = f"{len(row.cells)} cells", f"{width}, as in the header"
            mistakes.add(row.line, f"too many cells{comma}", got, expected)
            continue
        for column in found:
            cell = row.cells[column.index] if column.index < len(row.cells) else ""
            number = _number(cell, row.line, column, mistakes)
            if number is None:
                continue
            known = values[column.name]
            if column.name == rising and known and number <= known[-1]:
                expected = f"more than {known[-1]:g}"
                mistakes.add(row.line, f"column '{column.name}' must rise", cell, expected)
            known.append(number)
    return values


def _number(cell: str, line: int, column: _Column, mistakes: _Mistakes) -> float | None:
    """Return a cell's number, or None after telling what is wrong with it."""
    if NUMBER.fullmatch(cell):
        number = float(cell)
        if abs(number) != float("inf"):
            return number
    if not cell:
        what, got = "is missing", None
    elif NOT_FINITE.fullmatch(cell) or NUMBER.fullmatch(cell):
        what, got = "must be finite", cell
    elif DECIMAL_COMMA.fullmatch(cell):
        what, got = "needs a decimal point", f"'{cell}'"
    else:
        what, got = "is not a number", f"'{cell}'"
    mistakes.add(line, f"column '{column.name}': {what}", got, "a number")
    return None

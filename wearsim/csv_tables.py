"""CSV files with units in their headers, such as "time [min]", read as columns in SI units."""

from __future__ import annotations

import csv
import difflib
import re
from operator import methodcaller
from typing import TYPE_CHECKING, NamedTuple

from wearsim.errors import Mistake, ScenarioError
from wearsim.quantities import DECIMAL_COMMA, NOT_FINITE, NUMBER
from wearsim.units import QuantityError, conversion

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from wearsim.types import FloatArray

MAX_MISTAKES = 20  # reported of one file
_HEADER = re.compile(r"(?P<name>[^\[\]]*?)\s*(?:\[(?P<unit>[^\[\]]*)\])?")
_PLAIN_NUMBER = {"", "-", "1"}  # spellings of the unit of a plain number


class _Row(NamedTuple):
    line: int
    cells: list[str]


class _Column(NamedTuple):
    """A required column: position in the file and factor to SI."""

    name: str
    place: int
    factor: float


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
    ``time [min]``, separated by commas, semicolons or tabs. Other columns are ignored.

    Parameters
    ----------
    text : str
        Content of the file.
    file : str
        Name of the file, for messages.
    columns : mapping of str to str
        Unit to return for each column by name; "1" for plain numbers.
    aliases : mapping of str to sequence of str, optional
        Other accepted names of a column.
    rising : str, optional
        A column whose values must increase from row to row.

    Returns
    -------
    dict of str to ndarray, shape (rows,)
        Each required column in its unit.

    Raises
    ------
    ScenarioError
        With all mistakes of the file, up to `MAX_MISTAKES`.
    """
    import numpy as np  # noqa: PLC0415  (every command of the shell imports this module)

    mistakes: list[Mistake] = []
    lines = text.removeprefix("\ufeff").splitlines()
    start = next((k for k, line in enumerate(lines) if _has_cells(line)), None)
    if start is None:
        heads = ", ".join(_head(name, unit) for name, unit in columns.items())
        expected = f"a header line such as {heads}"
        raise ScenarioError(file, [Mistake("", "", "the file is empty", None, expected)])
    separator = next((mark for mark in "\t;," if mark in lines[start]), ",")
    header = _cells(lines[start], start, separator)
    found = _find_columns(header, columns, aliases or {}, mistakes)
    body = lines[start + 1 :]
    values: Mapping[str, FloatArray | list[float]] | None = None
    if not mistakes:
        values = _regular_numbers(body, header, found, separator, rising)
    if values is None:
        rows = [
            _cells(line, start + 1 + k, separator)
            for k, line in enumerate(body)
            if _has_cells(line)
        ]
        values = _numbers(rows, header, found, separator, rising, mistakes)
        if len(rows) < 2:
            got = str(len(rows))
            mistakes.append(Mistake("", "", "too few rows of numbers", got, "at least 2"))
    if len(mistakes) > MAX_MISTAKES:
        rest = Mistake("", "", f"and {len(mistakes) - MAX_MISTAKES} more")
        mistakes = [*mistakes[:MAX_MISTAKES], rest]
    if mistakes:
        raise ScenarioError(file, mistakes)
    return {column.name: np.asarray(values[column.name]) * column.factor for column in found}


def _mistake(line: int, what: str, got: str | None = None, expected: str | None = None) -> Mistake:
    return Mistake("", f"line {line}", what, got, expected)


def _head(name: str, unit: str) -> str:
    return name if unit == "1" else f"{name} [{unit}]"


def _has_cells(line: str) -> bool:
    """Return whether a line is neither blank nor a comment."""
    return bool(line.strip()) and not line.lstrip().startswith("#")


def _cells(line: str, place: int, separator: str) -> _Row:
    cells = next(csv.reader([line], delimiter=separator, skipinitialspace=True))
    return _Row(place + 1, [cell.strip() for cell in cells])


def _regular_numbers(
    body: list[str], header: _Row, found: list[_Column], separator: str, rising: str | None
) -> dict[str, FloatArray] | None:
    """Read the columns by numpy's parser, or return None if anything in the file is irregular.

    A file with a mistake is then read row by row, to report the mistake with its line.
    """
    import numpy as np  # noqa: PLC0415

    joined = "\n".join(body)
    marks = set(map(methodcaller("count", separator), body))
    if marks != {len(header.cells) - 1} or "#" in joined or '"' in joined:
        return None
    places = [column.place for column in found]
    try:
        table = np.loadtxt(body, delimiter=separator, usecols=places, ndmin=2, unpack=True)
    except ValueError:
        return None
    values = {column.name: row for column, row in zip(found, table, strict=True)}
    order = values.get(rising or "", np.arange(2.0))
    regular = len(body) > 1 and np.isfinite(table).all() and (order[1:] > order[:-1]).all()
    return values if regular else None


def _find_columns(
    header: _Row,
    columns: Mapping[str, str],
    aliases: Mapping[str, Sequence[str]],
    mistakes: list[Mistake],
) -> list[_Column]:
    """Find the required columns in the header."""
    heads = [_HEADER.fullmatch(cell) for cell in header.cells]
    names = [
        (head["name"] if head else cell) for head, cell in zip(heads, header.cells, strict=True)
    ]
    found = []
    for name, unit in columns.items():
        accepted = {name, *aliases.get(name, ())}
        places = [place for place, other in enumerate(names) if other in accepted]
        if len(places) == 1:
            head = heads[places[0]]
            factor = _factor(header.line, name, head["unit"] if head else None, unit, mistakes)
            found.append(_Column(name, places[0], factor))
        elif places:
            what = f"column '{name}' appears {len(places)} times"
            mistakes.append(_mistake(header.line, what))
        else:
            near = difflib.get_close_matches(
                name, [cell.split("[")[0].strip() for cell in header.cells], n=1
            )
            what = f"column '{name}' is missing" + (f" (is it '{near[0]}'?)" if near else "")
            got, expected = ", ".join(header.cells), _head(name, unit)
            mistakes.append(_mistake(header.line, what, got, expected))
    return found


def _factor(line: int, name: str, written: str | None, unit: str, mistakes: list[Mistake]) -> float:
    """Return the factor from the unit `written` in the header to `unit`; 1 after a mistake."""
    written = (written or "").strip()
    if unit == "1":
        if written not in _PLAIN_NUMBER:
            what = f"column '{name}': a plain number has no unit"
            mistakes.append(_mistake(line, what, f"[{written}]", name))
    elif not written:
        mistakes.append(_mistake(line, f"column '{name}' has no unit", name, _head(name, unit)))
    else:
        try:
            return float(conversion(written, unit))
        except QuantityError as error:
            what = f"column '{name}': {error.what}"
            mistakes.append(_mistake(line, what, error.got, error.expected))
    return 1.0


def _numbers(
    rows: list[_Row],
    header: _Row,
    found: list[_Column],
    separator: str,
    rising: str | None,
    mistakes: list[Mistake],
) -> dict[str, list[float]]:
    """Read every cell of the columns found."""
    width = len(header.cells)
    values: dict[str, list[float]] = {column.name: [] for column in found}
    for row in rows:
        if len(row.cells) > width:
            comma = " (is a comma meant as decimal point?)" if separator == "," else ""
            got, expected = f"{len(row.cells)} cells", f"{width}, as in the header"
            mistakes.append(_mistake(row.line, f"too many cells{comma}", got, expected))
            continue
        for column in found:
            cell = row.cells[column.place] if column.place < len(row.cells) else ""
            number, above = _number(cell, row.line, column, mistakes), values[column.name]
            if number is None:
                continue
            if column.name == rising and above and number <= above[-1]:
                what, expected = f"column '{column.name}' must increase", f"more than {above[-1]:g}"
                mistakes.append(_mistake(row.line, what, cell, expected))
            above.append(number)
    return values


def _number(cell: str, line: int, column: _Column, mistakes: list[Mistake]) -> float | None:
    """Return the number in a cell, or None after a mistake."""
    number = float(cell) if NUMBER.fullmatch(cell) else None
    if number is not None and abs(number) != float("inf"):
        return number
    what, got = "is not a number", f"'{cell}'" if cell else None
    if not cell:
        what = "is missing"
    elif number is not None or NOT_FINITE.fullmatch(cell):
        what, got = "must be finite", cell
    elif DECIMAL_COMMA.fullmatch(cell):
        what = "needs a decimal point"
    mistakes.append(_mistake(line, f"column '{column.name}': {what}", got, "a number"))
    return None

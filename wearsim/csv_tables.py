"""CSV files with units in their headers, such as "time [min]", read as columns in SI units."""

from __future__ import annotations

import csv
import difflib
import re
from operator import methodcaller
from typing import TYPE_CHECKING, NamedTuple, TypeAlias

from wearsim.errors import Mistake, ScenarioError
from wearsim.quantities import DECIMAL_COMMA, NOT_FINITE, NUMBER
from wearsim.units import QuantityError, conversion

if TYPE_CHECKING:
    from collections.abc import Mapping

    from wearsim.types import FloatArray

MAX_MISTAKES = 20  # reported of one file
_HEADER = re.compile(r"(?P<name>[^\[\]]*?)\s*(?:\[(?P<unit>[^\[\]]*)\])?")
_Columns: TypeAlias = "dict[str, tuple[int, float]]"
_PLAIN_NUMBER = {"", "-", "1"}  # spellings of the unit of a plain number


class _Header(NamedTuple):
    """The header: number of its line, counted from 1, separator, and cells."""

    line: int
    separator: str
    cells: list[str]


def column_names(text: str) -> list[str]:
    """Return the names of the columns of a CSV file, without units; see `read_columns`."""
    header = _header(text.removeprefix("\ufeff").splitlines())
    return [_name_and_unit(cell)[0] for cell in header.cells] if header else []


def read_columns(
    text: str,
    file: str,
    columns: Mapping[str, str],
    *,
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

    lines = text.removeprefix("\ufeff").splitlines()
    header = _header(lines)
    if header is None:
        heads = ", ".join(_head(name, unit) for name, unit in columns.items())
        expected = f"a header line such as {heads}"
        raise ScenarioError(file, [Mistake("", "", "the file is empty", None, expected)])
    mistakes: list[Mistake] = []
    found = _find_columns(header, columns, mistakes)
    body = lines[header.line :]
    values: Mapping[str, FloatArray | list[float]] | None = None
    if not mistakes:
        values = _regular_numbers(body, header, found, rising)
    if values is None:
        values = _numbers(body, header, found, rising, mistakes)
    if len(mistakes) > MAX_MISTAKES:
        rest = Mistake("", "", f"and {len(mistakes) - MAX_MISTAKES} more")
        mistakes = [*mistakes[:MAX_MISTAKES], rest]
    if mistakes:
        raise ScenarioError(file, mistakes)
    return {name: np.asarray(values[name]) * factor for name, (_, factor) in found.items()}


def _mistake(line: int, what: str, got: str | None = None, expected: str | None = None) -> Mistake:
    return Mistake("", f"line {line}", what, got, expected)


def _head(name: str, unit: str) -> str:
    return name if unit == "1" else f"{name} [{unit}]"


def _has_cells(line: str) -> bool:
    """Return whether a line is neither blank nor a comment."""
    return bool(line.strip()) and not line.lstrip().startswith("#")


def _header(lines: list[str]) -> _Header | None:
    """Return the header of a file, or None if the file is empty."""
    for number, line in enumerate(lines, 1):
        if _has_cells(line):
            separator = next((mark for mark in "\t;," if mark in line), ",")
            return _Header(number, separator, _cells(line, separator))
    return None


def _cells(line: str, separator: str) -> list[str]:
    cells = next(csv.reader([line], delimiter=separator, skipinitialspace=True))
    return [cell.strip() for cell in cells]


def _name_and_unit(cell: str) -> tuple[str, str]:
    """Split a cell of the header, such as "time [min]"; the unit may be empty."""
    head = _HEADER.fullmatch(cell)
    return (head["name"], (head["unit"] or "").strip()) if head else (cell, "")


def _regular_numbers(
    body: list[str], header: _Header, found: _Columns, rising: str | None
) -> dict[str, FloatArray] | None:
    """Read the columns by numpy's parser, or return None if anything in the file is irregular.

    A file with a mistake is then read row by row, to report the mistake with its line.
    """
    import numpy as np  # noqa: PLC0415

    if not _is_regular(body, header):
        body = [line for line in body if _has_cells(line)]
        if not _is_regular(body, header):
            return None
    places = [place for place, _ in found.values()]
    try:
        table = np.loadtxt(body, delimiter=header.separator, usecols=places, ndmin=2, unpack=True)
    except ValueError:
        return None
    values = dict(zip(found, table, strict=True))
    order = values.get(rising or "", np.arange(2.0))
    regular = len(body) > 1 and np.isfinite(table).all() and (order[1:] > order[:-1]).all()
    return values if regular else None


def _is_regular(rows: list[str], header: _Header) -> bool:
    """Return whether rows have as many cells as the header, and no comments or quotes."""
    joined = "\n".join(rows)
    marks = set(map(methodcaller("count", header.separator), rows))
    return marks == {len(header.cells) - 1} and "#" not in joined and '"' not in joined


def _find_columns(header: _Header, columns: Mapping[str, str], mistakes: list[Mistake]) -> _Columns:
    """Return the positions of the required columns, and their factors to SI."""
    heads = [_name_and_unit(cell) for cell in header.cells]
    found = {}
    for name, unit in columns.items():
        places = [place for place, (other, _) in enumerate(heads) if other == name]
        if len(places) == 1:
            factor = _factor(header.line, name, heads[places[0]][1], unit, mistakes)
            found[name] = places[0], factor
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


def _factor(line: int, name: str, written: str, unit: str, mistakes: list[Mistake]) -> float:
    """Return the factor from the unit `written` in the header to `unit`; 1 after a mistake."""
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
    body: list[str],
    header: _Header,
    found: _Columns,
    rising: str | None,
    mistakes: list[Mistake],
) -> dict[str, list[float]]:
    """Read every cell of the columns found."""
    width, rows = len(header.cells), 0
    values: dict[str, list[float]] = {name: [] for name in found}
    for line, text in enumerate(body, header.line + 1):
        if not _has_cells(text):
            continue
        cells, rows = _cells(text, header.separator), rows + 1
        if len(cells) > width:
            comma = " (is a comma meant as decimal point?)" if header.separator == "," else ""
            got, expected = f"{len(cells)} cells", f"{width}, as in the header"
            mistakes.append(_mistake(line, f"too many cells{comma}", got, expected))
            continue
        for name, (place, _) in found.items():
            cell = cells[place] if place < len(cells) else ""
            number, above = _number(cell, line, name, mistakes), values[name]
            if number is None:
                continue
            if name == rising and above and number <= above[-1]:
                what, expected = f"column '{name}' must increase", f"more than {above[-1]:g}"
                mistakes.append(_mistake(line, what, cell, expected))
            above.append(number)
    if rows < 2:
        mistakes.append(Mistake("", "", "too few rows of numbers", str(rows), "at least 2"))
    return values


def _number(cell: str, line: int, column: str, mistakes: list[Mistake]) -> float | None:
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
    mistakes.append(_mistake(line, f"column '{column}': {what}", got, "a number"))
    return None

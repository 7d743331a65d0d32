"""CSV files of numbers with units in their headers, read as columns in SI units.

The forms that instruments and spreadsheets write are accepted: commas, semicolons or tabs between
the cells; units as ``time [min]``, ``time (min)``, ``time/min``, ``time in min`` or on a line of
their own; lines before the header; decimal commas where the separator is no comma; clock and ISO
8601 times.
"""

from __future__ import annotations

import csv
import difflib
import re
from dataclasses import replace
from operator import methodcaller
from typing import TYPE_CHECKING, Any, NamedTuple

from wearsim.csv_cells import (
    EXPECTED,
    Conversion,
    clock_time,
    comma_number,
    conversion_of,
    in_order,
    is_unit,
    iso_time,
)
from wearsim.errors import Mistake, ScenarioError, mistake_in
from wearsim.quantities import DECIMAL_COMMA, NOT_FINITE, NUMBER
from wearsim.units import QuantityError, conversion

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from wearsim.types import FloatArray


MAX_MISTAKES = 20  # reported of one file
MAX_ALIKE = 3  # of them, if the same mistake is in more than MAX_MISTAKES lines
_USUAL_UNITS = {"m": "mm", "rad": "deg"}  # of the columns that users write, by the SI unit
HEAD_LINES = 100  # the header is one of these
_HEADER = re.compile(
    r"(?P<name>.*?)\s*(?:\[(?P<square>[^\[\]]*)\]|\((?P<round>[^()]*)\)"
    r"|\{(?P<curly>[^{}]*)\}|<(?P<angle>[^<>]*)>"
    r"|(?:\s*/|\s+in\s)\s*(?P<bare>[^\s/()\[\]][^/()\[\]]*))?"
)
_PLAIN_NUMBER = {"", "-", "1"}  # spellings of the unit of a plain number


class _Row(NamedTuple):
    line: int
    cells: list[str]


class _Column(NamedTuple):
    """A required column: position in the file, factor to SI, and reader of its cells."""

    name: str
    place: int
    factor: float
    conversion: Conversion | None


def refuse_mistakes(file: str, mistakes: Sequence[Mistake]) -> None:
    """Raise the mistakes of a table, if there are any; of many the first ones and their number.

    These are `MAX_MISTAKES`, but `MAX_ALIKE` if all are the same mistake in different lines.

    Raises
    ------
    ScenarioError
        With the mistakes.
    """
    if mistakes:
        alike = len({mistake.what for mistake in mistakes}) == 1
        most = MAX_ALIKE if alike and len(mistakes) > MAX_MISTAKES else MAX_MISTAKES
        more = Mistake("", "", f"and {len(mistakes) - most} more")
        raise ScenarioError(file, [*mistakes[:most], *([more] if len(mistakes) > most else [])])


def read_columns(
    text: str,
    file: str,
    columns: Mapping[str, str],
    *,
    aliases: Mapping[str, Sequence[str]] | None = None,
    opposite: Mapping[str, str] | None = None,
    units: Mapping[str, str] | None = None,
    rising: str | None = None,
    either_way: bool = False,
    choice: str = "",
) -> dict[str, FloatArray]:
    """Read columns of numbers from a CSV file with units in its headers.

    The header is the first line that names all columns, without regard to case. Other columns
    are ignored, and so are blank lines and lines that begin with ``#``.

    Parameters
    ----------
    text : str
        Content of the file.
    file : str
        Name of the file, for messages.
    columns : mapping of str to str
        Unit to return for each column by name; "1" for plain numbers. A column in "s" may hold
        clock times (14:05:10) or ISO 8601 times, which are counted from the first row.
    aliases : mapping of str to sequence of str, optional
        Other accepted names of a column.
    opposite : mapping of str to str, optional
        Name of a column that has the values with the opposite sign, accepted instead.
    units : mapping of str to str, optional
        Units of columns, instead of those in the header.
    rising : str, optional
        A column whose values must increase from row to row.
    either_way : bool
        Whether they may also decrease from row to row; the rows are then returned in reverse.
    choice : str
        How the user chooses columns by other names, for messages.

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

    names = {
        name: {name: 1.0, **dict.fromkeys((aliases or {}).get(name, ()), 1.0)} for name in columns
    }
    for name, other in (opposite or {}).items():
        names[name][other] = -1.0
    mistakes: list[Mistake] = []
    lines, header, separator = _find_header(text, names)
    expected = f"a header line such as {', '.join(map(_head, columns, columns.values()))}"
    if header is None:
        raise mistake_in(file, "the file is empty", None, expected)
    if all(map(_starts_as_number, header.cells)):
        got = separator.join(header.cells)
        raise mistake_in(file, "there is no header", got, expected, key=f"line {header.line}")
    if len(header.cells) == 1 < len(columns):
        raise mistake_in(
            file,
            "the header is one column",
            header.cells[0],
            "commas, semicolons or tabs between columns",
            key=f"line {header.line}",
        )
    heads, sample, start = _heads_and_sample(lines, header, separator)
    chosen = _find_columns(header, heads, sample, separator, columns, units or {}, names, mistakes)
    body = lines[start:]
    missing = [k for k, mistake in enumerate(mistakes) if mistake.what.startswith("column")]
    if choice and missing and len(chosen) < len(columns):
        last = mistakes[missing[-1]]
        mistakes[missing[-1]] = replace(last, expected=f"{last.expected}; {choice}")
    numbers: Sequence[int] = range(start + 1, start + 1 + len(body))
    table = None if mistakes else _regular_numbers(body, header, chosen, separator)
    if table is None and not mistakes:  # perhaps there are comments between the rows
        numbers = [number for number, line in zip(numbers, body, strict=True) if _has_cells(line)]
        table = _regular_numbers(list(filter(_has_cells, body)), header, chosen, separator)
    if table is None:
        rows = list(_rows(body, start, separator))
        numbers, values = _numbers(rows, header, chosen, separator, mistakes)
        table = np.array(values).reshape(len(values), len(chosen)).T
        if len(rows) < 2:
            got = str(len(rows))
            mistakes.append(Mistake("", "", "too few rows of numbers", got, "at least 2"))
    data = {}
    for column, cells in zip(chosen, table, strict=True) if table.size else ():
        data[column.name] = in_order(cells, column.conversion)
        if column.name == rising:
            _check_order(numbers, data[column.name], rising, either_way, mistakes)
    refuse_mistakes(file, mistakes)
    step = -1 if rising is not None and data[rising][0] > data[rising][1] else 1
    return {column.name: data[column.name][::step] * column.factor for column in chosen}


class TextRow(NamedTuple):
    """A row of a CSV file: its line in the file, and its cells by the names of the columns."""

    line: int
    cells: dict[str, str]


def read_texts(text: str) -> tuple[dict[str, str | None], list[TextRow]]:
    """Read the cells of a CSV file as texts, for columns that are not all numbers.

    Parameters
    ----------
    text : str
        Content of the file; its first line that is no comment is the header.

    Returns
    -------
    units : dict of str to str or None
        Unit of each column by its name in lower case.
    rows : list of TextRow
        Cells that are missing at the end of a row are empty.
    """
    lines, header, separator = _find_header(text, {})
    if header is None:
        return {}, []
    heads = dict(map(_name_and_unit, header.cells))
    names = [_name_and_unit(cell)[0] for cell in header.cells]
    rows = [
        TextRow(row.line, dict(zip(names, row.cells + [""] * len(names), strict=False)))
        for row in _rows(lines[header.line :], header.line, separator)
    ]
    return heads, rows


def column_names(text: str) -> list[str]:
    """Return the names of the columns of a CSV file, in lower case; see `read_columns`."""
    header = _find_header(text, {})[1]
    return [_name_and_unit(cell)[0] for cell in header.cells] if header else []


def units_of_columns(text: str, names: Mapping[str, Sequence[str]]) -> dict[str, str | None]:
    """Return the units of the columns of a CSV file that are there, None for one without.

    Parameters
    ----------
    text : str
        Content of the file.
    names : mapping of str to sequence of str
        Other accepted names of each column.
    """
    accepted = {name: dict.fromkeys((name, *others), 1.0) for name, others in names.items()}
    lines, header, separator = _find_header(text, accepted)
    if header is None:
        return {}
    return {
        name: unit
        for own_name, unit in _heads_and_sample(lines, header, separator)[0]
        for name, others in accepted.items()
        if own_name in {other.casefold() for other in others}
    }


def _mistake(line: int, what: str, got: str | None = None, expected: str | None = None) -> Mistake:
    return Mistake("", f"line {line}", what, got, expected)


def _head(name: str, unit: str) -> str:
    return name if unit == "1" else f"{name} [{_USUAL_UNITS.get(unit, unit)}]"


def _has_cells(line: str) -> bool:
    """Return whether a line is no comment, and neither blank nor separators only."""
    return bool(line.strip(" \t,;")) and not line.lstrip().startswith("#")


def _cells(line: str, place: int, separator: str) -> _Row:
    cells = next(csv.reader([line], delimiter=separator, skipinitialspace=True))
    return _Row(place + 1, [cell.strip() for cell in cells])


def _rows(body: list[str], start: int, separator: str) -> Iterator[_Row]:
    """Iterate over the rows of a body; `start` is the index of its first line in the file."""
    return (_cells(line, start + k, separator) for k, line in enumerate(body) if _has_cells(line))


def _name_and_unit(cell: str) -> tuple[str, str | None]:
    """Return the name in a cell of the header, without regard to case, and its unit if any."""
    head = _HEADER.fullmatch(cell)
    if head is None:
        return cell.casefold(), None
    units = (head[kind] for kind in ("square", "round", "curly", "angle", "bare"))
    return head["name"].casefold(), next((unit for unit in units if unit is not None), None)


def _find_header(
    text: str, names: Mapping[str, Mapping[str, float]]
) -> tuple[list[str], _Row | None, str]:
    """Return the lines of a file, its header and its separator.

    The header is the first line that names all columns, or a comment that does. In a file without
    such a line it is the last line above the first numbers that holds more than units.
    """
    lines = text.removeprefix("\ufeff").splitlines()
    wanted = [{other.casefold() for other in accepted} for accepted in names.values()]
    complete_comment, before, above = None, None, None
    for place, line in enumerate(lines[:HEAD_LINES]):
        content = line.strip().lstrip("#")
        if not content.strip():
            continue
        separator = next((mark for mark in "\t;," if mark in content), ",")
        row = _cells(content, place, separator)
        heads = {_name_and_unit(cell)[0] for cell in row.cells}
        complete = all(heads & accepted for accepted in wanted)
        if not _has_cells(line):
            complete_comment = complete_comment or ((row, separator) if complete else None)
        elif complete:
            return lines, row, separator
        elif above is None or not all(map(_starts_as_number, row.cells)):
            before, above = above, (row, separator)
        else:
            break
    if before and above and len(before[0].cells) == len(above[0].cells):
        above = before if all(map(is_unit, above[0].cells)) else above
    return (lines, *(complete_comment or above or (None, ",")))


def _heads_and_sample(
    lines: list[str], header: _Row, separator: str
) -> tuple[list[tuple[str, str | None]], list[_Row], int]:
    """Return names and units of the columns, the first rows, and the line above these.

    The units of a header without units may stand on the line below it.
    """
    start, heads = header.line, [_name_and_unit(cell) for cell in header.cells]
    sample = list(_rows(lines[start : start + HEAD_LINES], start, separator))
    below = list(filter(None, sample[0].cells)) if sample else []
    if below and not any(unit for _, unit in heads) and not any(map(_starts_as_number, below)):
        start, cells = sample.pop(0)
        units = {place: cell.strip("[](){}<> ") for place, cell in enumerate(cells)}
        heads = [(name, units.get(place, unit)) for place, (name, unit) in enumerate(heads)]
    return heads, sample, start


def _find_columns(
    header: _Row,
    heads: list[tuple[str, str | None]],
    sample: list[_Row],
    separator: str,
    wanted: Mapping[str, str],
    units: Mapping[str, str],
    names: Mapping[str, Mapping[str, float]],
    mistakes: list[Mistake],
) -> list[_Column]:
    """Find the required columns in the header, with the readers that the first rows need.

    `wanted` holds the unit to return by name, `units` those given by the caller.
    """
    columns, got = [], ", ".join(header.cells)
    for name, unit in wanted.items():
        accepted = {other.casefold(): sign for other, sign in names[name].items()}
        places = [place for place, (other, _) in enumerate(heads) if other in accepted]
        if len(places) == 1:
            (place,) = places
            own_name, written = heads[place]
            cells = [row.cells[place] for row in sample if place < len(row.cells)]
            conversion, factor = conversion_of(cells, separator, unit), accepted[own_name]
            if conversion not in {clock_time, iso_time}:
                given = units.get(name) or written
                factor *= _factor(header.line, own_name, given, unit, mistakes)
            columns.append(_Column(name, place, factor, conversion))
        elif places:
            what = f"column '{name}' appears {len(places)} times"
            mistakes.append(_mistake(header.line, what, got, "one such column"))
        else:
            near = difflib.get_close_matches(name, [other for other, _ in heads], n=1)
            what = f"column '{name}' is missing" + (f" (is it '{near[0]}'?)" if near else "")
            expected = " or ".join(_head(other, unit) for other in names[name])
            mistakes.append(_mistake(header.line, what, got, expected))
    return columns


def _starts_as_number(cell: str) -> bool:
    return cell.lstrip("+-.,")[:1].isdigit() or NOT_FINITE.fullmatch(cell) is not None


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


def _regular_numbers(
    body: list[str], header: _Row, columns: list[_Column], separator: str
) -> FloatArray | None:
    """Read the columns by numpy's parser, or return None if anything in the file is irregular.

    A file with a mistake is then read row by row, to report the mistake with its line.
    """
    import numpy as np  # noqa: PLC0415

    joined = "\n".join(body)
    marks = set(map(methodcaller("count", separator), body))
    if marks != {len(header.cells) - 1} or "#" in joined or '"' in joined:
        return None
    converters: Any = {c.place: c.conversion for c in columns if c.conversion}
    if comma_number in converters.values() and "." not in joined:
        body = joined.replace(",", ".").split("\n")
        converters = {k: read for k, read in converters.items() if read is not comma_number}
    try:
        table = np.loadtxt(
            body,
            delimiter=separator,
            usecols=[column.place for column in columns],
            ndmin=2,
            unpack=True,
            converters=converters or None,
            encoding=None,
        )
    except ValueError:
        return None
    return table if len(body) > 1 and np.isfinite(table).all() else None


def _numbers(
    rows: list[_Row], header: _Row, columns: list[_Column], separator: str, mistakes: list[Mistake]
) -> tuple[list[int], list[list[float]]]:
    """Read every cell of the columns found; return the lines of complete rows and their values."""
    width, lines, values = len(header.cells), [], []
    for row in rows:
        if len(row.cells) > width:
            comma = " (is a comma meant as decimal point?)" if separator == "," else ""
            got, expected = f"{len(row.cells)} cells", f"{width}, as in the header"
            mistakes.append(_mistake(row.line, f"too many cells{comma}", got, expected))
            continue
        cells = [row.cells[c.place] if c.place < len(row.cells) else "" for c in columns]
        numbers = [
            _number(cell, row.line, column, mistakes)
            for cell, column in zip(cells, columns, strict=True)
        ]
        if None not in numbers:
            lines.append(row.line)
            values.append([number for number in numbers if number is not None])
    return lines, values


def _number(cell: str, line: int, column: _Column, mistakes: list[Mistake]) -> float | None:
    """Return the number in a cell, or None after a mistake."""
    number, expected = None, "a number"
    try:
        if column.conversion is not None:
            number = column.conversion(cell)
        elif NUMBER.fullmatch(cell):
            number = float(cell)
    except ValueError:
        expected = EXPECTED[column.conversion]
    if number is not None and abs(number) != float("inf"):
        return number
    is_infinite = bool(cell) and (number is not None or NOT_FINITE.fullmatch(cell))
    reasons = {
        "is missing": not cell,
        "must be finite": is_infinite,
        "is not a time": column.conversion in {clock_time, iso_time},
        "needs a decimal point": DECIMAL_COMMA.fullmatch(cell),
    }
    reason = next((reason for reason, holds in reasons.items() if holds), "is not a number")
    got = cell if is_infinite else f"'{cell}'"
    what = f"column '{column.name}': {reason}"
    mistakes.append(_mistake(line, what, got if cell else None, expected))
    return None


def _check_order(
    lines: Sequence[int], values: FloatArray, name: str, either_way: bool, mistakes: list[Mistake]
) -> None:
    """Add a mistake for each value that breaks the increasing, or decreasing, order."""
    step = values[1:] - values[:-1]
    falling = either_way and len(step) > 0 and step[0] < 0.0
    for k in (step >= 0.0 if falling else step <= 0.0).nonzero()[0].tolist():
        what, limit = ("decrease", "less") if falling else ("increase", "more")
        got, expected = f"{values[k + 1]:g}", f"{limit} than {values[k]:g}"
        mistakes.append(_mistake(lines[k + 1], f"column '{name}' must {what}", got, expected))

"""Cells of CSV files: encodings, decimal commas, and clock and ISO 8601 times."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from datetime import UTC, datetime
from typing import TYPE_CHECKING, TypeAlias

from wearsim.quantities import DECIMAL_COMMA, NUMBER
from wearsim.units import measure

if TYPE_CHECKING:
    from wearsim.types import FloatArray

Conversion: TypeAlias = Callable[[str], float]
"""Function that reads a cell; raises a ValueError for another form."""

_CLOCK = re.compile(
    r"(?P<hours>[0-9]+):(?P<minutes>[0-5]?[0-9])(?::(?P<seconds>[0-5]?[0-9](?:[.,][0-9]*)?))?"
)
_DATE = re.compile(r"[0-9]{4}-?[0-9]{2}-?[0-9]{2}[T ]?.*")
_DAY = 86400.0


def decode(data: bytes) -> str:
    """Return the text of a file in UTF-8, in UTF-16 with a byte order mark, or else in latin-1.

    Parameters
    ----------
    data : bytes
        Content of the file.
    """
    if data[:2] in {b"\xff\xfe", b"\xfe\xff"}:
        return data.decode("utf-16", errors="replace")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("cp1252", errors="replace")


def clock_time(text: str) -> float:
    """Return the seconds since midnight of a clock time."""
    match = _CLOCK.fullmatch(text.strip())
    if match is None:
        raise ValueError(text)
    hours, minutes, seconds = (float((part or "0").replace(",", ".")) for part in match.groups())
    return 3600.0 * hours + 60.0 * minutes + seconds


def iso_time(text: str) -> float:
    """Return the seconds since 1970 of an ISO 8601 time."""
    moment = datetime.fromisoformat(text.strip())
    return (moment if moment.tzinfo else moment.replace(tzinfo=UTC)).timestamp()


def comma_number(text: str) -> float:
    """Return a number with a decimal comma."""
    if "." in text or not NUMBER.fullmatch(text := text.strip().replace(",", ".")):
        raise ValueError(text)
    return float(text)


def is_unit(text: str) -> bool:
    """Return whether a cell is empty or holds a unit alone, such as mm or [mm]."""
    try:
        return not (unit := text.strip("[](){}<> -")) or bool(measure(unit))
    except ValueError:
        return False


def conversion_of(cells: Iterable[str], separator: str, unit: str) -> Conversion | None:
    """Return the function that reads a column by its first cells, or None for plain numbers."""
    known = [cell for cell in cells if cell]
    if unit == "s" and known and not NUMBER.fullmatch(known[0]):
        if _CLOCK.fullmatch(known[0]):
            return clock_time
        if _DATE.fullmatch(known[0]):
            return iso_time
    return comma_number if separator != "," and any(map(DECIMAL_COMMA.fullmatch, known)) else None


def in_order(values: FloatArray, conversion: Conversion | None) -> FloatArray:
    """Return times from the first row on, with a day added at every midnight of a clock."""
    import numpy as np  # noqa: PLC0415

    if conversion is clock_time:
        values = values + _DAY * np.cumsum(np.diff(values, prepend=values[:1]) < -0.5 * _DAY)
    return values - values[0] if conversion in {clock_time, iso_time} else values


EXPECTED: dict[Conversion | None, str] = {
    None: "a number",
    clock_time: "a clock time such as 14:05:10, as in the first row",
    iso_time: "an ISO 8601 time such as 2024-05-31T14:05:10, as in the first row",
    comma_number: "a number with a decimal comma, as in other rows",
}

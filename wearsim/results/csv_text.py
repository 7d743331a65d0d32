"""Tables as CSV in engineers' units, the units in the headers."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Sequence
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from wearsim.quantities import engineers_unit
from wearsim.types import FloatArray

Column: TypeAlias = tuple[str, FloatArray]

# unit a column is written in, and its size in SI
_UNITS = {"m": ("um", 1e-6), "m^3": ("mm^3", 1e-9), "s": ("min", 60.0), "Pa": ("MPa", 1e6)} | {
    "N/m": ("N/mm", 1e3)
}
_LONG = {"y", "width", "half_length"}  # lengths that are written in mm


def unit_of(name: str, unit: str) -> tuple[str, float]:
    """Return the unit in which a computed variable is written, and its size in SI.

    Parameters
    ----------
    name : str
        Of the variable.
    unit : str
        Its SI unit.
    """
    return ("mm", 1e-3) if name in _LONG else _UNITS.get(unit, (unit, 1.0))


def unit_of_drawn(unit: str) -> tuple[str, float]:
    """Return the unit in which a drawn value is written, and its size in SI; see `unit_of`."""
    return _UNITS[unit] if unit == "Pa" else engineers_unit(unit)


def title(name: str, unit: str) -> str:
    """Return the head of a column; plain numbers have no unit."""
    return name if unit == "1" else f"{name} [{unit}]"


def table(columns: Iterable[Column]) -> str:
    """Return a table from its columns, the head first."""
    titles, values = zip(*columns, strict=True)
    return head(titles) + rows(np.column_stack(values))


def head(titles: Sequence[str]) -> str:
    """Return the first line of a table."""
    return _lines([titles])


def rows(numbers: npt.NDArray[Any]) -> str:
    """Return rows of a table, shape (rows, columns)."""
    # plus zero, so that no -0 is written
    return _lines([f"{value + 0.0:.12g}" for value in row] for row in numbers.tolist())


def _lines(cells: Iterable[Sequence[str]]) -> str:
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows(cells)
    return text.getvalue()


def text_table(titles: Sequence[str], cells: Iterable[Sequence[str]]) -> str:
    """Return a table of texts."""
    return _lines([titles, *cells])

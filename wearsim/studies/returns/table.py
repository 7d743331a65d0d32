"""Reading of returns: a CSV file with a row for each unit in service."""

from __future__ import annotations

import difflib
import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from wearsim.csv_tables import TextRow, read_texts, refuse_mistakes
from wearsim.errors import Mistake, mistake_in
from wearsim.types import BoolArray
from wearsim.units import QuantityError, conversion
from wearsim.uq.survival.returns import Fleet

COLUMNS = ("life", "low", "high", "state", "limit", "design", "unit")
_STATES = ("failed", "suspended")
_LIVES = ("life", "low", "high")
_AT_ONCE = 1e-9  # life of a unit that was withdrawn before its first inspection


class UnitsOf(NamedTuple):
    """Design of units in service: its name, unit of life, units per second, and limits."""

    label: str
    unit: str
    rate: float
    limits: Sequence[str]


@dataclass(frozen=True, eq=False)
class Returns:
    """Units in service, as read from a file.

    Parameters
    ----------
    file : str
    units : list of str
        Name of each unit, by default the line of the file.
    fleet : Fleet
    running : ndarray of bool, shape (units,)
        Whether each unit is in service; neither failed nor withdrawn by another cause.
    others : dict of str to int
        Numbers of units that were withdrawn by other causes, which count as suspended, by cause.
    """

    file: str
    units: list[str]
    fleet: Fleet
    running: BoolArray
    others: dict[str, int]

    @property
    def failed(self) -> int:
        """Number of units that failed."""
        return int(self.fleet.failed.sum())


class _Reader:
    """Reader of the rows of a file, which collects the mistakes."""

    def __init__(self, units: dict[str, str | None], designs: Sequence[UnitsOf]) -> None:
        self.designs, self.labels = designs, [design.label for design in designs]
        self.units, self.mistakes = units, list[Mistake]()

    def add(self, line: int, what: str, got: str | None = None, expected: str = "") -> None:
        """Add a mistake of a line of the file."""
        self.mistakes.append(Mistake("", f"line {line}", what, got, expected or None))

    def header(self, line: int) -> None:
        """Check names and units of the columns."""
        for name in self.units:
            if name not in COLUMNS:
                self.add(
                    line, f"unknown column '{name}'{_hint(name, COLUMNS)}", None, ", ".join(COLUMNS)
                )
        if "state" not in self.units:
            self.add(line, "column 'state' is missing", None, " or ".join(_STATES))
        if not {"life", "low"} & set(self.units):
            self.add(line, "column 'life' is missing", None, "life, or low and high")
        unit = self.designs[0].unit
        for name in _LIVES:
            written = self.units.get(name)
            if written not in {None, "", unit} and self._seconds(written) is None:
                self.add(
                    line,
                    f"column '{name}' has an unknown unit",
                    f"[{written}]",
                    f"{name} [{unit}], or a time such as {name} [h]",
                )

    @staticmethod
    def _seconds(unit: str | None) -> float | None:
        """Return the size of a unit of time [s], None for another unit."""
        try:
            return float(conversion(unit or "", "s"))
        except QuantityError:
            return None

    def design(self, row: TextRow) -> int:
        """Return the number of the design of a unit."""
        text, known = row.cells.get("design", ""), ", ".join(self.labels)
        if text in self.labels:
            return self.labels.index(text)
        if text:
            what = f"column 'design': unknown design{_hint(text, self.labels)}"
            self.add(row.line, what, f"'{text}'", known)
        elif len(self.labels) > 1:
            self.add(row.line, "column 'design' is missing", None, known)
        return 0

    def life(self, row: TextRow, name: str, design: int) -> float | None:
        """Return a life in the unit of the design, None without one or after a mistake."""
        text = row.cells.get(name, "")
        if not text:
            return None
        try:
            value = float(text)
        except ValueError:
            self.add(row.line, f"column '{name}': is not a number", f"'{text}'", "a life")
            return None
        if not math.isfinite(value) or value < 0.0 or (value == 0.0 and name != "low"):
            self.add(row.line, f"column '{name}': must be above 0", text)
            return None
        seconds = self._seconds(self.units.get(name)) if self.units.get(name) else None
        return value if seconds is None else value * seconds * self.designs[design].rate

    def span(self, row: TextRow, state: str, design: int) -> tuple[float, float]:
        """Return the life up to which a unit ran, and at which it was found failed."""
        before = len(self.mistakes)
        life, low, high = (self.life(row, name, design) for name in _LIVES)
        if len(self.mistakes) > before:
            return 1.0, math.inf
        if life is not None and (low is not None or high is not None):
            self.add(row.line, "has a life, and low or high", None, "one of the two")
        elif state == "suspended":
            if life is None:
                self.add(row.line, "is suspended without its age", None, "its age in column 'life'")
            return life or 1.0, math.inf
        elif life is not None:
            return life, life
        elif high is None:
            self.add(
                row.line,
                "failed without a life",
                None,
                "a life, or low and high of the inspections",
            )
        elif low is not None and low >= high:
            self.add(row.line, "'low' must be below 'high'", f"{low:g} and {high:g}")
        else:
            return low or 0.0, high
        return 1.0, math.inf


def _hint(text: str, known: Sequence[str]) -> str:
    """Return a question whether the nearest known text is meant, if one is near."""
    near = difflib.get_close_matches(text, known, n=1)
    return f" (is it '{near[0]}'?)" if near else ""


def read_returns(file: str | Path, designs: Sequence[UnitsOf]) -> Returns:
    """Return the units in service that a CSV file holds.

    Parameters
    ----------
    file : path
        Columns: life, or low and high where a failure was found at an inspection, in the unit of
        the lives or in a unit of time; state, "failed" or "suspended"; optionally limit (the cause
        of a failure), design and unit.
    designs : sequence of UnitsOf

    Raises
    ------
    ScenarioError
        With all mistakes of the file.
    """
    try:
        text = Path(file).read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        cause = error.strerror if isinstance(error, OSError) else "it is not text in UTF-8"
        raise mistake_in(str(file), f"the file cannot be read ({cause})") from error
    units, rows = read_texts(text)
    reader = _Reader(units, designs)
    if not rows:
        reader.mistakes.append(Mistake("", "", "has no units", None, ", ".join(COLUMNS)))
    else:
        reader.header(rows[0].line - 1)
    limits = {name.replace("_", " ") for item in designs for name in item.limits}
    units_read, others = [], Counter[str]()
    for row in rows if not reader.mistakes else ():
        state = row.cells["state"].lower()
        if state not in _STATES:
            reader.add(
                row.line,
                f"column 'state'{_hint(state, _STATES)}",
                f"'{row.cells['state']}'" if state else None,
                " or ".join(_STATES),
            )
        number = reader.design(row)
        first, last = reader.span(row, state, number)
        cause = row.cells.get("limit", "").replace("_", " ").lower()
        if cause and cause not in limits:
            others[cause] += 1
            # withdrawn at this failure, or at the last inspection before it
            first, last = first or _AT_ONCE, math.inf
        name = row.cells.get("unit") or f"line {row.line}"
        units_read.append((name, first, last, number, state == "suspended" and not cause))
    refuse_mistakes(str(file), reader.mistakes)
    names, low, high, numbers, running = zip(*units_read, strict=True)
    return Returns(
        str(file),
        list(names),
        Fleet(np.array(low), np.array(high), np.array(numbers)),
        np.array(running, dtype=bool),
        dict(others),
    )

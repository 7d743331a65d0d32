"""Rows of the report, and the JSON files of tables."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path

from wearsim.atomic_write import save_text
from wearsim.report.text import brief
from wearsim_bench.measure.machine import this_machine


@dataclass(frozen=True)
class Row:
    """One line of the report: case, measured time, target and error."""

    case: str
    seconds: float
    target: str = ""
    error: str = ""

    def __str__(self) -> str:
        return f"| {self.case} | {brief(self.seconds)} | {self.target} | {self.error} |"


@dataclass(frozen=True)
class Effort:
    """Effort of a measurement: repetitions of each timing, and fraction of a test's passes."""

    repetitions: int = 5
    part: float = 1.0

    @property
    def quick(self) -> bool:
        """Whether tests are shortened, so that the numbers only show that the report works."""
        return self.part < 1.0


def part(value: float) -> str:
    """Return a relative error as a signed percentage."""
    return f"{100.0 * value:+.2g} %"


def markdown(title: str, rows: list[Row]) -> str:
    """Return rows as a Markdown table under a title."""
    head = "| case | measured | target | error |\n|---|---|---|---|\n"
    return f"## {title}\n\n{head}" + "".join(f"{row}\n" for row in rows)


def save_tables(path: Path, command: str, tables: Mapping[str, str]) -> None:
    """Write Markdown tables by title to a JSON file, with date, machine and command."""
    saved = {title: _read(text) for title, text in tables.items()}
    data = {"machine": asdict(this_machine()), "command": command, "tables": saved}
    path.parent.mkdir(parents=True, exist_ok=True)
    save_text(json.dumps(data, indent=1, ensure_ascii=False) + "\n", path)


def _read(text: str) -> dict[str, object]:
    """Return the columns, rows and other lines of a Markdown table."""
    lines = [line.strip() for line in text.splitlines() if not line.startswith("#")]
    rows = [_cells(line) for line in lines if line.startswith("|")]
    notes = [line for line in lines if line and not line.startswith("|")]
    return {"columns": rows[0], "rows": rows[2:], "notes": notes}


def _cells(line: str) -> list[str]:
    parts = re.split(r"(?<!\\)\|", line.strip("|"))
    return [part.strip().replace(r"\|", "|") for part in parts]

"""Rows of the report."""

from __future__ import annotations

from dataclasses import dataclass

from wearsim.report.text import brief


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

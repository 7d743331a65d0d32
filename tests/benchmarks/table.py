"""Rows of the report."""

from __future__ import annotations

from dataclasses import dataclass

from wearsim.report.text.units import brief


@dataclass(frozen=True)
class Row:
    """One line of the report: what was measured, what was asked, and the error beside it."""

    what: str
    seconds: float
    asked: str = ""
    error: str = ""

    def __str__(self) -> str:
        return f"| {self.what} | {brief(self.seconds)} | {self.asked} | {self.error} |"


@dataclass(frozen=True)
class Effort:
    """How much to spend: repetitions of each timing, and the part of a test's passes to run."""

    repetitions: int = 5
    part: float = 1.0

    @property
    def quick(self) -> bool:
        """Whether the numbers only show that the report works."""
        return self.part < 1.0


def part(value: float) -> str:
    """Return a relative error as a signed percentage."""
    return f"{100.0 * value:+.2g} %"


def markdown(title: str, rows: list[Row]) -> str:
    """Return rows as a Markdown table under a title."""
    head = "| what | measured | asked | error beside it |\n|---|---|---|---|\n"
    return f"## {title}\n\n{head}" + "".join(f"{row}\n" for row in rows)

"""Tables, JSON and figures of the outcomes."""

from __future__ import annotations

import platform
from collections.abc import Sequence
from datetime import date
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from wearsim.cli.shared import console, note
from wearsim.report.text import plain
from wearsim_validation.case import VERDICTS

if TYPE_CHECKING:
    from wearsim_validation.comparison import Comparison, Outcome

_WIDE = 150  # width of tables written to a file or a pipe


def rows_of(comparison: Comparison) -> tuple[list[str], list[list[str]]]:
    """Return heads and rows of the table of a comparison, as text."""
    unit = "" if comparison.unit == "1" else f" [{comparison.unit}]"
    x_unit = "" if comparison.x_unit == "1" else f" [{comparison.x_unit}]"
    heads = [f"{comparison.series.x}{x_unit}", f"published{unit}"]
    columns = [_texts(comparison.x), _texts(comparison.published)]
    for name, values in comparison.columns.items():
        heads += [name, "difference"]
        relative = values / comparison.published - 1.0
        columns += [
            _texts(values),
            [f"{100.0 * part:+.1f} %" if np.isfinite(part) else "" for part in relative],
        ]
    if comparison.spread is not None:
        heads.append("range of what is not published")
        columns.append([f"{low:.3g} to {high:.3g}" for low, high in comparison.spread.T])
    for name, fitted in comparison.fits.items():
        heads.append(name)
        columns.append(["" if value is None else f"{value:.2g}" for value in fitted])
    return heads, [list(row) for row in zip(*columns, strict=True)]


def _texts(values: Any) -> list[str]:
    return ["" if not np.isfinite(value) else f"{value:.4g}" for value in values]


def verdict_line(outcome: Outcome) -> str:
    """Return the verdict of a case in words."""
    text = f"verdict: {VERDICTS[outcome.verdict]}"
    return text if outcome.expected else f"{text}; recorded: {VERDICTS[outcome.case.file.verdict]}"


def show(outcome: Outcome) -> None:
    """Write a case to stdout: its tables, the verdict and the reasons."""
    from rich import box
    from rich.table import Table

    screen, file = console(), outcome.case.file
    if not screen.is_terminal:
        screen.width = _WIDE
    screen.print(f"\n{outcome.case.name}: {file.title}\n{file.source}\nread: {file.read}")
    for comparison in outcome.comparisons:
        table = Table(title=comparison.series.name, title_justify="left", box=box.SIMPLE_HEAD)
        heads, rows = rows_of(comparison)
        for head in heads:
            table.add_column(head, justify="right", overflow="fold")
        for row in rows:
            table.add_row(*row)
        screen.print(table)
        for fact in comparison.facts:
            screen.print(f"  {fact}")
        screen.print(f"  {VERDICTS[comparison.verdict]}")
    screen.print(verdict_line(outcome))
    for reason in file.reasons:
        screen.print(f"  {reason}")
    for text in outcome.notes:
        note(f"note: {text}")


def show_summary(outcomes: Sequence[Outcome]) -> None:
    """Write one line for each case to stdout."""
    from rich import box
    from rich.table import Table

    table = Table(title="Validation", title_justify="left", box=box.SIMPLE_HEAD)
    for head in ("case", "verdict", "published"):
        table.add_column(head, overflow="fold")
    for outcome in outcomes:
        table.add_row(outcome.case.name, VERDICTS[outcome.verdict], outcome.case.file.title)
    screen = console()
    if not screen.is_terminal:
        screen.width = _WIDE
    screen.print(table)


def as_json(outcomes: Sequence[Outcome], command: str) -> dict[str, Any]:
    """Return all outcomes as JSON types, with tables as text for the documentation."""
    tables: dict[str, Any] = {
        "verdicts": {
            "columns": ["case", "published", "verdict"],
            "rows": [
                [outcome.case.name, outcome.case.file.title, VERDICTS[outcome.verdict]]
                for outcome in outcomes
            ],
        }
    }
    for outcome in outcomes:
        for comparison in outcome.comparisons:
            heads, rows = rows_of(comparison)
            notes = [f"- {fact}" for fact in (*comparison.facts, VERDICTS[comparison.verdict])]
            tables[f"{outcome.case.name}: {comparison.series.name}"] = {
                "columns": heads,
                "rows": rows,
                "notes": ["\n".join(notes)],
            }
    data: dict[str, Any] = plain(
        {
            "machine": _machine(),
            "command": command,
            "tables": tables,
            "cases": {outcome.case.name: outcome.as_json() for outcome in outcomes},
        }
    )
    return data


def _machine() -> dict[str, Any]:
    """Return the machine in the form of `wearsim bench`; no times are stated."""
    from wearsim.operating_system import processors

    return {
        "processor": platform.processor() or platform.machine(),
        "cores": processors(),
        "python": platform.python_version(),
        "libraries": {name: version(name) for name in ("wearsim", "numba", "numpy", "scipy")},
        "yardstick": None,
        "date": date.today().isoformat(),
    }


def write_files(outcomes: Sequence[Outcome], data: dict[str, Any], folder: Path) -> list[Path]:
    """Write validation.json and a figure for each case; return the files."""
    import json

    from wearsim.atomic_write import save_text
    from wearsim.report.figures import save_figure
    from wearsim_validation.figure import case_figure

    folder.mkdir(parents=True, exist_ok=True)
    text = json.dumps(data, indent=1, ensure_ascii=False, allow_nan=False)
    files = [folder / "validation.json"]
    save_text(text + "\n", files[0])
    for outcome in outcomes:
        files.append(folder / f"{outcome.case.name}.png")
        save_figure(case_figure(data["cases"][outcome.case.name]), files[-1])
    return files

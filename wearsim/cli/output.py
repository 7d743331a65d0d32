"""Where text goes: tables and JSON to stdout, everything else to stderr."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from wearsim.errors import ResultsFileError

if TYPE_CHECKING:
    from rich.console import Console

    from wearsim.results.study_result import StudyResult

_WIDE = 110  # columns of a table that goes into a file or a pipe


def console(*, err: bool = False) -> Console:
    """Return a console that writes text as it stands: no markup, no highlighting."""
    from rich.console import Console

    made = Console(stderr=err, markup=False, highlight=False, emoji=False)
    if not made.is_terminal:
        made.width = _WIDE
    return made


def write_table(title: str, rows: Iterable[tuple[str, str]]) -> None:
    """Write a table of two columns, what and value, to stdout."""
    from rich import box
    from rich.table import Table

    screen = console()
    table = Table(title=title, title_justify="left", show_header=False, box=box.SIMPLE_HEAD)
    table.min_width = min(len(title), screen.width)  # or a long title would be folded
    table.add_column(no_wrap=True)
    table.add_column(overflow="fold")
    for row in rows:
        table.add_row(*row)
    screen.print(table)


def write_list(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """Write rows to stdout, one line each, their columns aligned under a head."""
    lines = [heads, *rows]
    widths = [max(len(line[column]) for line in lines) for column in range(len(heads))]
    for line in lines:
        cells = (cell.ljust(width) for cell, width in zip(line, widths, strict=True))
        typer.echo("  ".join(cells).rstrip())


def write_line(text: str) -> None:
    """Write a line to stdout."""
    typer.echo(text)


def write_json(data: Mapping[str, Any]) -> None:
    """Write one JSON object to stdout; numbers that are not finite become null."""
    typer.echo(json.dumps(plain(data), indent=2, ensure_ascii=False, allow_nan=False))


def plain(value: Any) -> Any:
    """Return a value made of what JSON knows: arrays as lists, paths as text, NaN as null."""
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if hasattr(value, "tolist"):  # numpy's arrays and scalars
        return plain(value.tolist())
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    if isinstance(value, Path):
        return str(value)
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def note(text: str) -> None:
    """Write a line to stderr."""
    typer.echo(text, err=True)


def tell_notes(result: StudyResult[Any]) -> None:
    """Write what a user should know of a study to stderr."""
    for text in result.notes:
        note(f"note: {text}")
    for text in result.warnings:
        note(f"warning: {text}")


def refuse_existing(path: Path, force: bool, option: str = "-o") -> None:
    """Raise unless `path`, which an option named, may be written.

    Raises
    ------
    ResultsFileError
        If something stands there and `force` is not set.
    """
    if path.exists() and not force:
        raise ResultsFileError(f"{path} exists; choose another name with {option}, or --force")

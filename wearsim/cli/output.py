"""Output of all verbs: tables and JSON on stdout, everything else on stderr."""

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

_WIDTH = 110  # columns of a table in a file or a pipe


def console(*, err: bool = False) -> Console:
    """Return a console without markup and highlighting."""
    from rich.console import Console

    made = Console(stderr=err, markup=False, highlight=False, emoji=False)
    if not made.is_terminal:
        made.width = _WIDTH
    return made


def write_table(title: str, rows: Iterable[tuple[str, str]]) -> None:
    """Write a table with the columns name and value to stdout."""
    from rich import box
    from rich.table import Table

    screen = console()
    table = Table(title=title, title_justify="left", show_header=False, box=box.SIMPLE_HEAD)
    table.min_width = min(len(title), screen.width)  # keeps a long title on one line
    table.add_column(no_wrap=True)
    table.add_column(overflow="fold")
    for row in rows:
        table.add_row(*row)
    screen.print(table)


def write_list(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """Write rows to stdout, one line each, in columns aligned under their heads."""
    lines = [heads, *rows]
    widths = [max(len(line[column]) for line in lines) for column in range(len(heads))]
    for line in lines:
        cells = (cell.ljust(width) for cell, width in zip(line, widths, strict=True))
        typer.echo("  ".join(cells).rstrip())


def write_json(data: Mapping[str, Any]) -> None:
    """Write one JSON object to stdout; numbers that are not finite become null."""
    typer.echo(json.dumps(plain(data), indent=2, ensure_ascii=False, allow_nan=False))


def plain(value: Any) -> Any:
    """Convert a value to JSON types: arrays to lists, paths to text, NaN to null."""
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if hasattr(value, "tolist"):  # arrays and scalars of numpy
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


def write_notes(notes: Iterable[str], warnings: Iterable[str] = ()) -> None:
    """Write notes and warnings on a scenario or a study to stderr."""
    for text in (*(f"note: {text}" for text in notes), *(f"warning: {text}" for text in warnings)):
        note(text)


def refuse_existing(path: Path, force: bool, option: str = "-o") -> None:
    """Refuse to overwrite the file named by an option.

    Raises
    ------
    ResultsFileError
        If the file exists and `force` is false.
    """
    if path.exists() and not force:
        raise ResultsFileError(f"{path} exists; choose another name with {option}, or --force")

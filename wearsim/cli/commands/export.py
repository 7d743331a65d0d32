"""`wearsim export`: a results file as CSV."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from wearsim.cli.arguments import ResultsFile

if TYPE_CHECKING:
    from wearsim.results import DissipationResult, EnsembleResult, Result
    from wearsim.results.io.reader import FileKind

Folder = Annotated[
    Path,
    typer.Option(
        "--output", "-o", metavar="DIR", help="Folder for the CSV files.", show_default=False
    ),
]


def export(file: ResultsFile, output: Folder) -> None:
    """Write a results file as CSV, units in the headers."""
    from wearsim.results import (
        export_csv,
        kind_of,
        open_dissipation,
        open_ensemble,
        open_results,
    )

    openers: dict[FileKind, Callable[[Path], Result | DissipationResult | EnsembleResult]] = {
        "replay": open_results,
        "dissipation": open_dissipation,
        "ensemble": open_ensemble,
    }
    for path in export_csv(openers[kind_of(file)](file), output):
        typer.echo(str(path))

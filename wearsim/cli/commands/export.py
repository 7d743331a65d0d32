"""`wearsim export`: results as CSV files."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from wearsim.cli.shared import ResultsFile, open_any

Folder = Annotated[
    Path,
    typer.Option(
        "--output", "-o", metavar="DIR", help="Folder for the CSV files.", show_default=False
    ),
]


def export(file: ResultsFile, output: Folder) -> None:
    """Write a results file as CSV, with units in the headers."""
    from wearsim.results import export_csv

    for path in export_csv(open_any(file), output):
        typer.echo(str(path))

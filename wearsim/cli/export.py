"""`wearsim export`: a results file as CSV."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from wearsim.cli.arguments import ResultsFile

Folder = Annotated[
    Path,
    typer.Option(
        "--output", "-o", metavar="DIR", help="Folder for the CSV files.", show_default=False
    ),
]


def export(file: ResultsFile, output: Folder) -> None:
    """Write a results file as CSV, units in the headers."""
    from wearsim.results import export_csv, is_dissipation, open_dissipation, open_results

    result = open_dissipation(file) if is_dissipation(file) else open_results(file)
    for path in export_csv(result, output):
        typer.echo(str(path))

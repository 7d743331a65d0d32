"""Verb report: one page on results for a browser."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

import wearsim
from wearsim.atomic_write import refuse_inputs
from wearsim.cli.commands.results import Angle, Level, MeasuredFiles, measured_profiles
from wearsim.cli.shared import (
    At,
    Columns,
    Force,
    MeanRows,
    Row,
    Units,
    check_new_file,
    note,
    profile_choice,
    refuse,
)


def report(
    files: Annotated[
        list[Path],
        typer.Argument(
            metavar="FILE.h5...",
            help="Results files of any kind; several runs and ensembles are also compared.",
            show_default=False,
        ),
    ],
    output: Annotated[
        Path | None,
        typer.Option(
            "--output",
            "-o",
            metavar="PAGE",
            help="Page to write, by default the name of the first file with .html.",
            show_default=False,
        ),
    ] = None,
    measured: MeasuredFiles = None,
    angle: Angle = None,
    level: Level = False,
    columns: Columns = None,
    units: Units = None,
    row: Row = None,
    mean_rows: MeanRows = None,
    at: At = None,
    force: Force = False,
) -> None:
    """Write one page on results for a browser: answers, interactive figures, inputs."""
    path = output if output is not None else Path(f"{files[0].stem}.html")
    is_page = path.suffix.lower() in {".html", ".htm"}
    refuse(not is_page, f"'{path}' does not end in .html", "-o")
    from wearsim.studies.opening import save_report

    refuse_inputs(path, files, "the page")
    refuse_inputs(path, measured or [], "a measured profile")
    results = [wearsim.open_results(file) for file in files]
    check_new_file(path, force)
    choice = profile_choice(columns, units, row, mean_rows, at)
    views = [result.view for result in results]
    save_report(results, path, measured_profiles(measured or [], choice, views, level, angle))
    note(f"page: {path}, {path.stat().st_size / 1e6:.1f} MB")

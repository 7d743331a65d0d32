"""`wearsim reproduce`: comparison with the numbers and figures of the paper."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from wearsim.cli.shared import Figure, Force, Json, Quiet, check_figure, console, note, write_json

if TYPE_CHECKING:
    from pathlib import Path

    from wearsim_chevalier2005.study import Reproduction
    from wearsim_chevalier2005.view import ReproductionView

Count = Annotated[
    int,
    typer.Option(
        "--realisations", "-n", min=2, metavar="N", help="Realisations of each Monte Carlo study."
    ),
]
Seed = Annotated[
    int | None,
    typer.Option(
        min=0, metavar="SEED", help="Seed of the Monte Carlo studies.", show_default=False
    ),
]
_COLUMNS = {"": 28, "paper": 15, "here": 23, "why they differ": None}


app = typer.Typer(
    add_completion=False,
    rich_markup_mode=None,
    context_settings={"help_option_names": ["-h", "--help"]},
)


@app.command()
def reproduce(
    realisations: Count = 1000,
    figure: Figure = None,
    seed: Seed = None,
    json: Json = False,
    force: Force = False,
    quiet: Quiet = False,
) -> None:
    """Compute the numbers of the paper; -o draws its figures too."""
    check_figure(figure, force)
    from wearsim.cli.progress import Counter
    from wearsim_chevalier2005.study import reproduce as study

    with Counter(quiet) as counted:
        results = study(realisations, seed, on_progress=counted)
    view = results.view
    if figure is not None:
        _draw(results, figure)
    if json:
        write_json({**view.data(), "figure": figure})
        return
    _write(view)
    if figure is not None:
        note(f"figure: {figure}")


def _draw(results: Reproduction, path: Path) -> None:
    from wearsim.report.figures import save_figure
    from wearsim_chevalier2005.figures import reproduction_figure

    save_figure(reproduction_figure(results), path)


def _write(view: ReproductionView) -> None:
    """Write a table for each part to stdout."""
    from itertools import groupby

    from rich import box
    from rich.table import Table

    from wearsim.report.text import count
    from wearsim_chevalier2005.view import as_printed, computed

    screen, results = console(), view.result
    screen.print(view.title)
    screen.print(
        f"{count(results.all_inputs.count)} realisations, seed {results.scenario.seed}; ± is the"
        " standard error of values from realisations\n"
    )
    for number, (part, part_rows) in enumerate(groupby(view.compared, lambda row: row.part)):
        table = Table(
            title=part, title_justify="left", show_header=number == 0, box=box.SIMPLE_HEAD
        )
        for head, width in _COLUMNS.items():
            table.add_column(head, width=width)
        for row in part_rows:
            printed = "-" if row.paper is None else as_printed(row)
            table.add_row(row.name, printed, computed(row), row.why)
        screen.print(table)

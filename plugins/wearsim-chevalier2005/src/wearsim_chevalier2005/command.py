"""`wearsim reproduce`: comparison with the numbers and figures of the paper."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import typer

from wearsim.cli.shared import Figure, Force, Json, Quiet, check_figure, console, note, write_json

if TYPE_CHECKING:
    from pathlib import Path

    from wearsim_chevalier2005.comparison_row import Number, Row
    from wearsim_chevalier2005.study import Reproduction

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
_SI = {"mm": "m", "%": "1"}


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
    from wearsim_chevalier2005.comparison import compare
    from wearsim_chevalier2005.study import reproduce as study

    with Counter(quiet) as counted:
        results = study(realisations, seed, on_progress=counted)
    rows = compare(results)
    if figure is not None:
        _draw(results, figure)
    if json:
        write_json(_data(results, rows, figure))
        return
    _write(results, rows)
    if figure is not None:
        note(f"figure: {figure}")


def _draw(results: Reproduction, path: Path) -> None:
    from wearsim.report.figures import save_figure
    from wearsim_chevalier2005.figures import reproduction_figure

    save_figure(reproduction_figure(results), path)


def _write(results: Reproduction, rows: tuple[Row, ...]) -> None:
    """Write a table for each part to stdout."""
    from itertools import groupby

    from rich import box
    from rich.table import Table

    from wearsim.report.text import count
    from wearsim_chevalier2005.paper import REFERENCE

    screen = console()
    screen.print(REFERENCE)
    screen.print(
        f"{count(results.all_inputs.count)} realisations, seed {results.scenario.seed}; ± is the"
        " standard error of values from realisations\n"
    )
    for number, (part, part_rows) in enumerate(groupby(rows, lambda row: row.part)):
        table = Table(
            title=part, title_justify="left", show_header=number == 0, box=box.SIMPLE_HEAD
        )
        for head, width in _COLUMNS.items():
            table.add_column(head, width=width)
        for row in part_rows:
            printed = "-" if row.paper is None else _as_printed(row)
            table.add_row(row.name, printed, _computed(row), row.why)
        screen.print(table)


def _ends(value: Number) -> tuple[float, ...]:
    return value if isinstance(value, tuple) else (value,)


def _with_unit(numbers: str, unit: str) -> str:
    return numbers if unit == "1" else f"{numbers} {unit}"


def _as_printed(row: Row) -> str:
    """Return the printed value with the printed digits."""
    from wearsim.report.text import PER_SI

    factor = PER_SI.get(row.unit, 1.0)
    numbers = (f"{value * factor:.10g}" for value in _ends(row.paper if row.paper else 0.0))
    return _with_unit(" to ".join(numbers), row.unit)


def _computed(row: Row) -> str:
    """Return the computed value with its standard error."""
    digits = 5 if row.part == "inputs" and row.standard_error is None else 4
    text = " to ".join(_shown(value, row.unit, digits) for value in _ends(row.here))
    if row.standard_error is not None:
        errors = " and ".join(_shown(value, row.unit, 2) for value in _ends(row.standard_error))
        text += f" ± {errors}" if isinstance(row.here, float) else f"\n± {errors}"
    return _with_unit(text, row.unit)


def _shown(value: float, unit: str, digits: int) -> str:
    """Return a number converted to a unit, without the unit."""
    from wearsim.report.text import PER_SI, in_unit

    return in_unit(value, unit if unit in PER_SI else "1", digits)


def _data(results: Reproduction, rows: tuple[Row, ...], figure: Path | None) -> dict[str, Any]:
    """Return the rows for JSON, in SI units."""
    from wearsim_chevalier2005.paper import REFERENCE

    return {
        "reference": REFERENCE,
        "realisations": results.all_inputs.count,
        "seed": results.scenario.seed,
        "rows": [
            {
                "name": f"{row.part}: {row.name}",
                "paper": row.paper,
                "printed_in": row.place,
                "here": row.here,
                "standard_error": row.standard_error,
                "unit": _SI.get(row.unit, row.unit),
                "why": row.why,
            }
            for row in rows
        ],
        "figure": figure,
    }

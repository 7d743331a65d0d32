"""`wearsim plot`: the figure of a results file."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from wearsim.cli.arguments import Figure, Force, ResultsFile, check_figure, read_text
from wearsim.cli.output import note, refuse_existing

Measured = Annotated[
    list[Path] | None,
    typer.Option(
        "--measured",
        metavar="CSV",
        help="Measured profile drawn on top: columns 'y [mm]' and 'depth [um]', or 'height [um]'"
        " with worn material negative. May be repeated.",
        show_default=False,
    ),
]


def plot(
    file: ResultsFile, figure: Figure = None, measured: Measured = None, force: Force = False
) -> None:
    """Draw what a results file holds, whatever made it."""
    path = figure if figure is not None else Path(f"{file.stem}.png")
    check_figure(path)
    refuse_existing(path, force)
    from wearsim.results import kind_of, refuse_inputs

    refuse_inputs(path, [file], "the figure")
    refuse_inputs(path, measured or [], "a measured profile")
    kind = kind_of(file)
    if kind == "replay":
        _draw_test(file, path, measured)
    elif measured:
        what = "a study of one contact" if kind == "dissipation" else "an ensemble"
        raise typer.BadParameter(
            f"goes with a wear test, and this is {what}", param_hint="--measured"
        )
    elif kind == "ensemble":
        _draw_ensemble(file, path)
    else:
        _draw_study(file, path)
    note(f"figure: {path}")


def _draw_study(file: Path, path: Path) -> None:
    from wearsim.cli.commands.dissipation import draw
    from wearsim.results import open_dissipation

    draw(open_dissipation(file), path)


def _draw_ensemble(file: Path, path: Path) -> None:
    from wearsim.cli.commands.ensemble import draw
    from wearsim.results import open_ensemble

    draw(open_ensemble(file), path)


def _draw_test(file: Path, path: Path, measured: list[Path] | None) -> None:
    from wearsim.report.parts.measured_profiles import read_measured
    from wearsim.results import open_results

    result = open_results(file)
    profiles = [read_measured(read_text(csv), str(csv)) for csv in measured or []]
    from wearsim.report.figures.run import run_figure
    from wearsim.report.parts.saving import save_figure

    save_figure(run_figure(result, profiles), path)

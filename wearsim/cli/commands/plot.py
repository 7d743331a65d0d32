"""`wearsim plot`: figure of a results file."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from wearsim.cli.shared import Figure, Force, ResultsFile, check_figure, note, open_any, read_text

if TYPE_CHECKING:
    from wearsim.report.parts import Measured
    from wearsim.results import DissipationResult, EnsembleResult, Result

MeasuredFiles = Annotated[
    list[Path] | None,
    typer.Option(
        "--measured",
        metavar="CSV",
        help="Measured profile to draw as points: columns 'y [mm]' and 'depth [um]', or 'height"
        " [um]' with worn material negative. May be repeated.",
        show_default=False,
    ),
]


def plot(
    file: ResultsFile, figure: Figure = None, measured: MeasuredFiles = None, force: Force = False
) -> None:
    """Draw the figure of a results file of any kind."""
    path = figure if figure is not None else Path(f"{file.stem}.png")
    check_figure(path, force)
    from wearsim.report.parts import read_measured
    from wearsim.results import Result, refuse_inputs

    refuse_inputs(path, [file], "the figure")
    refuse_inputs(path, measured or [], "a measured profile")
    result = open_any(file)
    if measured and not isinstance(result, Result):
        raise typer.BadParameter(
            f"requires the file of a wear test; {file} is none", param_hint="--measured"
        )
    draw(result, path, [read_measured(read_text(csv), str(csv)) for csv in measured or []])
    note(f"figure: {path}")


def draw(
    result: Result | DissipationResult | EnsembleResult,
    path: Path,
    measured: Sequence[Measured] = (),
) -> None:
    """Write the figure of a result.

    Parameters
    ----------
    result : Result, DissipationResult or EnsembleResult
    path : Path
        Name of the figure.
    measured : sequence of Measured
        Profiles drawn over those of a run.
    """
    from wearsim.report.parts import save_figure
    from wearsim.results import DissipationResult, EnsembleResult

    if isinstance(result, EnsembleResult):
        from wearsim.report.figures.ensemble import ensemble_figure

        figure = ensemble_figure(result)
    elif isinstance(result, DissipationResult):
        from wearsim.report.figures.contact import dissipation_figure

        figure = dissipation_figure(result)
    else:
        from wearsim.report.figures.run import run_figure

        figure = run_figure(result, measured)
    save_figure(figure, path)

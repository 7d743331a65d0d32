"""`wearsim compare`: comparison of runs and ensembles."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from wearsim.cli.shared import Figure, Force, Json, check_figure, open_any

if TYPE_CHECKING:
    from wearsim.results import EnsembleResult, Result

Files = Annotated[
    list[Path],
    typer.Argument(
        metavar="FILE.h5 FILE.h5...",
        help="Results files of runs and ensembles; all others are compared with the first.",
        show_default=False,
    ),
]
Observable = Annotated[
    str,
    typer.Option(
        metavar="NAME",
        help="Quantity to compare: depth, width, worn_volume, dissipated_energy...",
    ),
]


def compare(
    files: Files,
    observable: Observable = "depth",
    figure: Figure = None,
    json: Json = False,
    force: Force = False,
) -> None:
    """Compare runs and ensembles, with confidence intervals."""
    if len(files) < 2:
        raise typer.BadParameter(
            f"there is one file, {files[0]}; give another one to compare", param_hint="FILE.h5"
        )
    check_figure(figure, force)
    from wearsim.results import refuse_inputs
    from wearsim.studies.ensemble.compare import observables_of

    if figure is not None:
        refuse_inputs(figure, files, "the comparison")
    results = [_open(file) for file in files]
    labels = _labels(files)
    for label, result in zip(labels, results, strict=True):
        known = observables_of(result)
        if observable not in known:
            raise typer.BadParameter(
                f"{label} has no '{observable}', expected one of {', '.join(known)}",
                param_hint="--observable",
            )
    from wearsim.cli.render.ensemble_table import report_comparison

    report_comparison(results, labels, observable, "", figure, json)


def _open(file: Path) -> Result | EnsembleResult:
    from wearsim.errors import ResultsFileError
    from wearsim.results import DissipationResult, EnsembleResult

    result = open_any(file)
    if isinstance(result, DissipationResult):
        from wearsim.results.dissipation import DISSIPATION

        raise ResultsFileError(
            f"{file}: holds {DISSIPATION.holds}; only runs and ensembles can be compared"
        )
    if isinstance(result, EnsembleResult) and result.count == 0:
        raise ResultsFileError(f"{file}: has no completed realisation; nothing to compare")
    return result


def _labels(files: list[Path]) -> list[str]:
    """Return the names of the files, with their folders where the names are not unique."""
    stems = [file.stem for file in files]
    if len(set(stems)) == len(stems):
        return stems
    names = [str(file) for file in files]
    for name in names:
        if names.count(name) > 1:
            raise typer.BadParameter(f"{name} is given twice", param_hint="FILE.h5")
    return names

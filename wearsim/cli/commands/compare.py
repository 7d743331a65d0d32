"""`wearsim compare`: wear tests and ensembles side by side."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from wearsim.cli.arguments import Figure, Force, Json, check_figure
from wearsim.cli.output import refuse_existing

if TYPE_CHECKING:
    from wearsim.results import EnsembleResult, Result

Files = Annotated[
    list[Path],
    typer.Argument(
        metavar="FILE.h5 FILE.h5...",
        help="Results files of runs and ensembles; the others are held against the first.",
        show_default=False,
    ),
]
Observable = Annotated[
    str,
    typer.Option(
        metavar="NAME", help="What is compared: depth, width, worn_volume, dissipated_energy..."
    ),
]


def compare(
    files: Files,
    observable: Observable = "depth",
    figure: Figure = None,
    json: Json = False,
    force: Force = False,
) -> None:
    """Compare runs and ensembles: which wears deeper, how surely."""
    if len(files) < 2:
        raise typer.BadParameter(
            f"there is one file, {files[0]}; name another to compare it with", param_hint="FILE.h5"
        )
    if figure is not None:
        check_figure(figure)
        refuse_existing(figure, force)
    from wearsim.results import refuse_inputs

    if figure is not None:
        refuse_inputs(figure, files, "the comparison")
    results = [_opened(file) for file in files]
    labels = _labels(files)
    _check_observable(results, labels, observable)
    from wearsim.cli.render.comparison_table import report_comparison

    report_comparison(results, labels, observable, "", figure, json)


def _opened(file: Path) -> Result | EnsembleResult:
    from wearsim.errors import ResultsFileError
    from wearsim.results import kind_of, open_ensemble, open_results

    kind = kind_of(file)
    if kind == "dissipation":
        from wearsim.results.dissipation.schema import DISSIPATION

        raise ResultsFileError(
            f"{file}: holds {DISSIPATION.holds}; runs and ensembles can be compared"
        )
    if kind == "replay":
        return open_results(file)
    result = open_ensemble(file)
    if result.count == 0:
        raise ResultsFileError(f"{file}: has no realisation that ended well; nothing to compare")
    return result


def _labels(files: list[Path]) -> list[str]:
    """Return the names of the files, with their folders where the names alone are not enough."""
    stems = [file.stem for file in files]
    if len(set(stems)) == len(stems):
        return stems
    names = [str(file) for file in files]
    for name in names:
        if names.count(name) > 1:
            raise typer.BadParameter(f"{name} is there twice; name it once", param_hint="FILE.h5")
    return names


def _check_observable(
    results: list[Result | EnsembleResult], labels: list[str], observable: str
) -> None:
    from wearsim.studies.ensemble.compare import observables_of

    for label, result in zip(labels, results, strict=True):
        known = observables_of(result)
        if observable not in known:
            raise typer.BadParameter(
                f"{label} has no '{observable}', expected one of {', '.join(known)}",
                param_hint="--observable",
            )

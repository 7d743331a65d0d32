"""Opening, comparison and export of results of every kind."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from wearsim.errors import ResultsFileError
from wearsim.results.kinds import kind_of, open_study
from wearsim.results.viewed import Viewed, kind_of_result

if TYPE_CHECKING:
    from wearsim.levelling import Measured
    from wearsim.report.view import View
    from wearsim.studies.dissipation.result import DissipationResult
    from wearsim.studies.ensemble.result import EnsembleResult


def open_results(path: str | Path) -> Any:
    """Open a results file of any kind.

    Parameters
    ----------
    path : str or Path
        The file.

    Returns
    -------
    Result, DissipationResult, EnsembleResult, IdentificationResult or another
        Of a wear test, of a dissipation study, of an ensemble (of lives, a class derived from it),
        of an identification; or the result of a kind of study that a plugin adds.

    Raises
    ------
    ResultsFileError
        If it is missing, foreign, truncated, damaged, or of another layout.
    PluginError
        If it belongs to a plugin that is not installed.

    Examples
    --------
    >>> wearsim.open_results("rig-ensemble.h5")
    <EnsembleResult 'a wear test': 16 realisations, depth 47.63 um>
    """
    return open_study(path)


def open_dissipation(path: str | Path) -> DissipationResult:
    """Open the file of a dissipation study; errors as of `open_results`.

    Parameters
    ----------
    path : str or Path
        The file.

    Returns
    -------
    DissipationResult

    Examples
    --------
    >>> friction = {"distribution": "uniform", "low": 0.08, "high": 0.12}
    >>> scenario = wearsim.load_scenario("rig.toml", {"friction.coefficient": friction})
    >>> study = wearsim.dissipation(scenario, 10, "powers.h5")
    >>> wearsim.open_dissipation("powers.h5").count
    10
    """
    from wearsim.studies.dissipation.result import (  # noqa: PLC0415  (not of other kinds)
        DissipationResult,
        read_dissipation,
    )

    return DissipationResult(read_dissipation(path), Path(path))


def open_ensemble(path: str | Path) -> EnsembleResult:
    """Open the file of an ensemble or of lives; errors as of `open_results`.

    Parameters
    ----------
    path : str or Path
        The file.

    Returns
    -------
    EnsembleResult
        Of lives, that of `life`.

    Examples
    --------
    >>> wearsim.open_ensemble("rig-ensemble.h5").plan
    'monte-carlo'
    """
    from wearsim.studies.ensemble.file.parts import read_ensemble  # noqa: PLC0415

    data, kind = read_ensemble(path), kind_of(path)
    result: EnsembleResult = kind.load("result")(data, Path(path))
    return result


def comparison_of(
    results: Sequence[Viewed], labels: Sequence[str], observable: str | None = None
) -> View:
    """Return the view of several results that are compared with the first.

    Parameters
    ----------
    results : sequence of results
        Of kinds that can be compared with each other.
    labels : sequence of str
    observable : str, optional
        Quantity to compare, for kinds that have several.

    Raises
    ------
    ResultsFileError
        If they cannot be compared.
    """
    kinds = [kind_of_result(result) for result in results]
    for label, kind in zip(labels, kinds, strict=True):
        if not kind.compare or kind.compare != kinds[0].compare:
            raise ResultsFileError(
                f"{label}: holds {kind.holds}; only runs and ensembles can be compared, or lives"
                " with each other"
            )
    view: View = kinds[0].load("compare")(results, labels, observable)
    return view


def labels_of(results: Sequence[Any]) -> list[str]:
    """Return a label for each result: the name of its file, with its folder if names are equal.

    Results without a file have their title, and a number if labels are still equal.
    """
    short = [result.path.stem if result.path else result.title for result in results]
    long = [str(result.path or result.title) for result in results]
    numbered = [f"{number}: {label}" for number, label in enumerate(short, 1)]
    return next(labels for labels in (short, long, numbered) if len(set(labels)) == len(labels))


def views_of(results: Sequence[Any]) -> list[View]:
    """Return the views of results, after the view that compares several of them.

    Results that cannot be compared, such as a run and lives of the same design, have none.
    """
    views = [result.view for result in results]
    if len(views) == 1 or len({kind_of_result(result).compare for result in results}) > 1:
        return views
    return [comparison_of(results, labels_of(results)), *views]


def save_report(
    results: Sequence[Any], path: str | Path, measured: Sequence[Measured] = ()
) -> None:
    """Write one page on results for a browser; several are also compared.

    Parameters
    ----------
    results : sequence of results
    path : Path
        An existing file is replaced.
    measured : sequence of Measured
        Profiles drawn over computed ones.

    Raises
    ------
    PluginError
        If bokeh or jinja2 is not installed, which are part of the extra ``wearsim[report]``.
    ResultsFileError
        If the page cannot be written, or the results cannot be compared.

    Examples
    --------
    >>> wearsim.save_report([wearsim.run("rig.toml")], "rig.html")
    """
    from wearsim.report.page.page import save_page  # noqa: PLC0415  (only of pages)

    if not isinstance(results, Sequence) or isinstance(results, str):
        raise TypeError(
            f"results must be a list of results, such as [result], got a {type(results).__name__}"
        )
    if not results:
        raise ValueError("no result is given for the page")
    if others := [item for item in results if not isinstance(item, Viewed)]:
        raise TypeError(f"only results can be on a page, got {others[0]!r}")
    save_page(views_of(results), Path(path), measured)


def export_csv(
    result: Viewed, folder: str | Path, *, force: bool = False, decimal: Literal[".", ","] = "."
) -> list[Path]:
    """Write a result of any kind as CSV, and the scenario with its files.

    Parameters
    ----------
    result : Result, DissipationResult, EnsembleResult, IdentificationResult or another
        Of a run, its history and records are written; of a dissipation study, its realisations
        and strips; of an ensemble, its realisations, the estimates at all records, and the profile
        and lift error at the end; of an identification, its tests and traces.
    folder : str or Path
        Target folder, which is created if it does not exist.
    force : bool
        Overwrite existing files.
    decimal : {".", ","}
        Decimal sign of the tables. With a comma, semicolons separate the cells.

    Returns
    -------
    list of Path
        The written files.

    Raises
    ------
    ResultsFileError
        If the folder is a file or cannot be written, or if one of the files exists and `force` is
        false; then no file is written.
    ValueError
        If the decimal sign is neither a point nor a comma.
    """
    from wearsim.report.csv_files import write_csv  # noqa: PLC0415  (only of exports)

    return write_csv(result.view, folder, force=force, decimal=decimal)

"""`wearsim ensemble`: a wear test for each realisation of the random inputs."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

import wearsim
from wearsim.cli.render import show_with_figure
from wearsim.cli.shared import (
    FigureOption,
    Force,
    Json,
    Quiet,
    Realisations,
    ScenarioFile,
    Scheduler,
    Seed,
    Settings,
    Workers,
    check_figure,
    checked_scheduler,
    checking,
    note,
    read_scenario,
    refuse,
    refuse_same_file,
    results_option,
    settings_with,
)
from wearsim.errors import SolverError

if TYPE_CHECKING:
    from wearsim.studies.ensemble.result import EnsembleResult


def ensemble(
    scenario: ScenarioFile,
    realisations: Realisations = 1000,
    output: Annotated[Path | None, results_option("-ensemble.h5")] = None,
    figure: FigureOption = None,
    workers: Workers = None,
    scheduler: Scheduler = None,
    precision: Annotated[
        str | None,
        typer.Option(
            metavar="TARGET",
            help="Stop when the relative half-width of a 95 % confidence interval is reached,"
            " 'depth.mean 1%'. First checked after 64 realisations.",
            show_default=False,
        ),
    ] = None,
    until: Annotated[str | None, typer.Option(metavar="TARGET", hidden=True)] = None,
    plan: Annotated[
        str | None,
        typer.Option(
            metavar="PLAN",
            help="Sampling design: monte-carlo, latin-hypercube, sobol, saltelli or"
            " control-variate; default: that of the scenario.",
            show_default=False,
        ),
    ] = None,
    sweep: Annotated[
        str | None,
        typer.Option(
            metavar="KEY=V1,V2,...",
            help="Run and compare one ensemble per value: load.normal_force=250N,300N.",
            show_default=False,
        ),
    ] = None,
    seed: Seed = None,
    settings: Settings = None,
    json: Json = False,
    force: Force = False,
    quiet: Quiet = False,
) -> None:
    """Run a wear test for each realisation of the random inputs."""
    check_figure(figure, force, "--figure")
    from wearsim.cli.progress import BATCHES, EnsembleWatcher, watching
    from wearsim.studies.comparison.view import comparison_view
    from wearsim.studies.ensemble.api import parse_target
    from wearsim.studies.ensemble.designs import parse_plan
    from wearsim.studies.ensemble.sweep import path_of, run_sweep

    with checking("--plan"):
        chosen_plan = plan and parse_plan(plan)
    if until is not None:
        refuse(precision is not None, "is the former name of --precision", "--until")
        note("warning: --until of ensembles is now --precision; the old name will be removed")
        precision = until
    if precision is not None:
        with checking("--precision"):
            parse_target(precision)
    options: dict[str, Any] = {
        "plan": chosen_plan,
        "workers": workers,
        "force": force,
        "precision": precision,
        "scheduler": checked_scheduler(scheduler, workers),
    }
    texts = settings_with(settings, seed=seed)
    path = output if output is not None else Path(f"{scenario.stem}-ensemble.h5")
    key, values = swept(sweep, texts)
    files = {value: path_of(path, value) for value in values} if key else {"": path}
    scenarios = {
        value: read_scenario(scenario, [*texts, *([f"{key}={value}"] if key else [])])
        for value in files
    }
    for value, file in files.items():
        refuse_same_file(figure, file, scenarios[value].paths)

    def announce(value: str, file: Path | None) -> None:
        if not quiet:
            note(f"{key} = {value}: {file}")

    first = scenarios[next(iter(files))]
    with watching(EnsembleWatcher, first, quiet, BATCHES) as watch:
        options |= watch.callbacks
        if not key:
            result = wearsim.ensemble(first, realisations, path, **options)
        else:
            designs = list(scenarios.values())
            results = run_sweep(
                designs, list(files), realisations, path, on_value=announce, **options
            )
    if not key:
        show_ensemble(result, json, figure, watch.workers)
        return
    for item in results:
        _refuse_failed(item)
    show_with_figure(comparison_view(results, list(files), "depth", key), figure, json=json)


def show_ensemble(
    result: EnsembleResult, json: bool, figure: Path | None, workers: str = ""
) -> None:
    """Write an ensemble or lives to stdout and failures to stderr, and draw the figure.

    Parameters
    ----------
    result : EnsembleResult
    json : bool
        Whether to write JSON instead of tables.
    figure : Path, optional
        Name of the figure.
    workers : str
        Workers that were used, "2 processes".

    Raises
    ------
    SolverError
        If all realisations failed.
    """
    from wearsim.studies.execution.processes import InProcess

    if workers == InProcess.describe:
        workers = "this process, one realisation at a time"
    files, more = {"workers": workers, "results file": result.path}, {"workers": workers or None}
    show_with_figure(result.view, figure, json=json, files=files, more=more)
    _refuse_failed(result)


def _refuse_failed(result: EnsembleResult) -> None:
    """Raise an error if all realisations failed."""
    if result.failed and not result.count:
        raise SolverError(f"{result.path}: all realisations failed")


def swept(sweep: str | None, settings: Sequence[str]) -> tuple[str, tuple[str, ...]]:
    """Return key and values of --sweep, which are empty without it.

    Raises
    ------
    typer.BadParameter
        If it cannot be read, or its key is also the key of a setting.
    """
    if sweep is None:
        return "", ()
    from wearsim.studies.ensemble.sweep import parse_sweep

    with checking("--sweep"):
        key, values = parse_sweep(sweep)
    given = any(text.partition("=")[0].strip() == key for text in settings)
    refuse(given, f"{key} is also the key of --sweep", "--set")
    return key, values

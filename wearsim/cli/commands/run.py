"""Verbs for wear tests: run, ensemble, and resume, which continues both."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

import wearsim
from wearsim.cli.render import show_view, show_with_figure
from wearsim.cli.shared import (
    FigureOption,
    Force,
    Json,
    Quiet,
    Realisations,
    ResultsFile,
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
    refuse_options,
    refuse_same_file,
    results_option,
    settings_with,
    write_notes,
)
from wearsim.errors import ResultsFileError, SolverError, WearsimError

if TYPE_CHECKING:
    from wearsim.cli.progress import Display
    from wearsim.studies.ensemble.result import EnsembleResult


Until = Annotated[
    str | None,
    typer.Option(
        metavar="LIMIT",
        help="Stop a wear test where it first reaches a limit: 'depth 50 um', 'roller_depth 5 um',"
        " 'lift_error 30 um', 'volume 12 mm^3', 'width 14 mm', 'peak_pressure 900 MPa',"
        " 'clearance 60 um', 'damage 1', 'pitting 0.1', '12 h', '2e6 passes' or '5e5 turns'. A"
        " shorter test is extended.",
        show_default=False,
    ),
]


def run(
    scenario: ScenarioFile,
    output: Annotated[Path | None, results_option(".h5")] = None,
    until: Until = None,
    settings: Settings = None,
    force: Force = False,
    json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Run a wear test and write its results file."""
    loaded = read_scenario(scenario, settings)
    path = output if output is not None else Path(f"{scenario.stem}.h5")
    from wearsim.cli.progress import CHECKPOINT, RunWatcher, watching

    write_notes(loaded.notes)
    try:
        with watching(RunWatcher, loaded, quiet, CHECKPOINT) as watch:
            result = wearsim.run(loaded, path, until=until, force=force, **watch.callbacks)
    except SolverError as error:
        with suppress(WearsimError):  # a file that was there before may be of any kind
            if getattr(wearsim.open_results(path), "failure", ""):
                error.add_note(f"the last accepted step is kept: wearsim show {path}")
        raise
    show_view(
        result.view,
        json=json,
        files={"results file": result.path},
        known=[*loaded.notes, *watch.warnings],
    )


def resume(
    file: ResultsFile,
    until: Until = None,
    allow_deep: Annotated[
        bool,
        typer.Option(
            "--allow-deep",
            help="Continue a wear test beyond a depth of a tenth of the roller's radius.",
        ),
    ] = False,
    failed: Annotated[
        bool, typer.Option("--failed", help="Repeat the failed realisations of an ensemble.")
    ] = False,
    realisations: Annotated[
        int | None,
        typer.Option(
            "--realisations",
            "-n",
            min=1,
            help="New number of realisations of an ensemble; extends it.",
            show_default=False,
        ),
    ] = None,
    workers: Workers = None,
    scheduler: Scheduler = None,
    json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Continue a run or an ensemble from its results file."""
    from wearsim.cli import progress
    from wearsim.results.kinds import kind_of, open_study

    kind = kind_of(file)
    if not kind.resume:
        raise ResultsFileError(f"{file}: holds {kind.holds}, which cannot be continued")
    options: dict[str, Any] = {
        "until": until,
        "allow_deep": allow_deep,
        "failed": failed,
        "realisations": realisations,
        "workers": workers,
        "scheduler": scheduler,
    }
    of_tests = ("failed", "realisations", "workers", "scheduler")
    kinds: dict[str, tuple[Sequence[str], type[Display], str]] = {
        "run": (("until", "allow_deep"), progress.RunWatcher, progress.CHECKPOINT),
        **dict.fromkeys(
            ("ensemble", "life"), (of_tests, progress.EnsembleWatcher, progress.BATCHES)
        ),
    }
    names, watcher, stopping = kinds.get(
        kind.name, (("workers", "scheduler"), progress.PartWatcher, progress.PARTS)
    )
    refuse_options(
        {f"--{name.replace('_', '-')}": options[name] for name in options if name not in names},
        f"has no meaning for a file that holds {kind.holds}",
    )
    refuse(failed and realisations is not None, "extend the ensemble first", "--failed")
    options["scheduler"] = checked_scheduler(scheduler, workers)
    before = open_study(file, kind)
    if names == of_tests and realisations is None and (text := _nothing_to_do(before, failed)):
        note(f"note: nothing to do: {text}")
    with progress.watching(watcher, before, quiet, stopping) as watch:
        options = {name: options[name] for name in names} | watch.callbacks
        result = kind.load("resume")(file, **options)
    if isinstance(watch, progress.EnsembleWatcher):
        show_ensemble(result, json, None, watch.workers)
    else:
        show_view(result.view, json=json, files={"results file": result.path}, known=watch.warnings)


def _nothing_to_do(before: EnsembleResult, failed: bool) -> str:
    """Return why there is nothing to do, or an empty text."""
    if not failed:
        what = "study of lives" if before.raw.life else "ensemble"
        return f"the {what} is finished" if before.finished else ""
    if before.failed:
        return ""
    rest = "" if before.finished else f"; continue the others with: wearsim resume {before.path}"
    return f"no realisation has failed{rest}"


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
    from wearsim.studies.ensemble.sweep import path_of, run_sweep

    if until is not None:
        refuse(precision is not None, "is the former name of --precision", "--until")
        note("warning: --until of ensembles is now --precision; the old name will be removed")
        precision = until
    options: dict[str, Any] = {
        "plan": plan,
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
        if key:
            designs, labels = list(scenarios.values()), list(files)
            results = run_sweep(designs, labels, realisations, path, on_value=announce, **options)
        else:
            result = wearsim.ensemble(first, realisations, path, **options)
    if not key:
        show_ensemble(result, json, figure, watch.workers)
        return
    for item in results:
        _refuse_failed(item)
    show_with_figure(comparison_view(results, labels, "depth", key), figure, json=json)


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
    refuse(
        key in (text.partition("=")[0].strip() for text in settings),
        f"{key} is also the key of --sweep",
        "--set",
    )
    return key, values

"""Verbs for wear tests: run, and resume, which also continues ensembles."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from wearsim.cli.shared import (
    Force,
    Json,
    Quiet,
    ResultsFile,
    ScenarioFile,
    Scheduler,
    Settings,
    Workers,
    checked_scheduler,
    checking,
    note,
    read_scenario,
    results_option,
    write_notes,
)
from wearsim.errors import ResultsFileError, SolverError, WearsimError

if TYPE_CHECKING:
    from wearsim.studies.ensemble.result import EnsembleResult
    from wearsim.studies.run.result import Result


Until = Annotated[
    str | None,
    typer.Option(
        metavar="LIMIT",
        help="Stop a wear test where it first reaches a limit: 'depth 50 um', 'roller_depth 5 um',"
        " 'lift_error 30 um', 'volume 12 mm^3', 'width 14 mm', 'peak_pressure 900 MPa',"
        " 'clearance 60 um', '12 h' or '2e6 passes'. A shorter test is extended.",
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
    check_limit(until)
    loaded = read_scenario(scenario, settings)
    path = output if output is not None else Path(f"{scenario.stem}.h5")
    from wearsim.cli.progress import RunWatcher, stop_on_signals
    from wearsim.studies.kernels import kernels_of
    from wearsim.studies.run import run as study

    write_notes(loaded.notes)
    watcher = RunWatcher(quiet, kernels=lambda: kernels_of(loaded))
    try:
        with stop_on_signals() as stop, watcher as watch:
            result = study.run(
                loaded, path, until=until, force=force, on_event=watch, stop_requested=stop.is_set
            )
    except SolverError as error:
        from wearsim.studies.opening import open_results

        with suppress(WearsimError):  # a file that was there before may be of any kind
            if getattr(open_results(path), "failure", ""):
                error.add_note(f"the last accepted step is kept: wearsim show {path}")
        raise
    from wearsim.cli.render import show_view

    files = {"results file": result.path}
    show_view(result.view, json=json, files=files, known=loaded.notes)


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
    from wearsim.cli.render import show_view
    from wearsim.results.kinds import kind_of, open_study

    kind = kind_of(file)
    if not kind.resume:
        raise ResultsFileError(f"{file}: holds {kind.holds}, which cannot be continued")
    if kind.name == "run":
        given = {
            "--failed": failed,
            "--realisations": realisations is not None,
            "--workers": workers is not None,
            "--scheduler": scheduler is not None,
        }
        for option, is_given in given.items():
            if is_given:
                raise typer.BadParameter("is an option for ensembles only", param_hint=option)
        check_limit(until)
        result = _resumed_run(file, until, allow_deep, quiet)
        show_view(result.view, json=json, files={"results file": result.path})
        return
    if until is not None:
        raise typer.BadParameter("only wear tests can be extended", param_hint="--until")
    if allow_deep:
        raise typer.BadParameter("is an option for wear tests only", param_hint="--allow-deep")
    if failed and realisations is not None:
        raise typer.BadParameter("extend the ensemble first", param_hint="--failed")
    chosen = checked_scheduler(scheduler, workers)
    from wearsim.cli.commands.ensemble import STOPPING, report
    from wearsim.cli.progress import EnsembleWatcher, stop_on_signals
    from wearsim.studies.kernels import kernels_of

    before = open_study(file, kind)
    nothing = _nothing_to_do(before, kind.name, failed)
    if nothing and realisations is None:
        note(f"note: nothing to do: {nothing}")
    watcher = EnsembleWatcher(quiet, kernels=lambda: kernels_of(before.scenario))
    with stop_on_signals(STOPPING) as stop, watcher as watch:
        result = kind.load("resume")(
            file,
            failed=failed,
            realisations=realisations,
            workers=workers,
            scheduler=chosen,
            on_progress=watch,
            stop_requested=stop.is_set,
            on_notice=watch.notice,
        )
    report(result, json, None, watch.workers)


def check_limit(until: str | None) -> None:
    """Check the limit of a run, if one is given.

    Raises
    ------
    typer.BadParameter
        If it cannot be read.
    """
    if until is not None:
        from wearsim.evolution.limits import Limit

        with checking("--until"):
            Limit.parse(until)


def _resumed_run(file: Path, until: str | None, allow_deep: bool, quiet: bool) -> Result:
    from wearsim.cli.progress import RunWatcher, stop_on_signals
    from wearsim.studies.kernels import kernels_of
    from wearsim.studies.opening import open_results
    from wearsim.studies.run import run as study

    watcher = RunWatcher(quiet, kernels=lambda: kernels_of(open_results(file).scenario))
    with stop_on_signals() as stop, watcher as watch:
        return study.resume(
            file, until, allow_deep=allow_deep, on_event=watch, stop_requested=stop.is_set
        )


def _nothing_to_do(before: EnsembleResult, kind: str, failed: bool) -> str:
    """Return why there is nothing to do, or an empty text."""
    if not failed:
        what = "study of lives" if kind == "life" else kind
        return f"the {what} is finished" if before.finished else ""
    if before.failed:
        return ""
    rest = "" if before.finished else f"; continue the others with: wearsim resume {before.path}"
    return f"no realisation has failed{rest}"

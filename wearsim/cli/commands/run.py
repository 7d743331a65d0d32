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
    write_json,
    write_notes,
    write_table,
)
from wearsim.errors import SolverError, WearsimError

if TYPE_CHECKING:
    from wearsim.results import EnsembleResult, Result


Output = Annotated[Path | None, results_option(".h5")]


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
    output: Output = None,
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
        from wearsim.results import open_results

        with suppress(WearsimError):  # a file that was there before may be of any kind
            if getattr(open_results(path), "failure", ""):
                error.add_note(f"the last accepted step is kept: wearsim show {path}")
        raise
    report(result, json)
    # the study has chosen the contact model
    write_notes(note for note in result.notes if note not in loaded.notes)


def report(result: Result, json: bool) -> None:
    """Write the summary of a run to stdout."""
    from wearsim.report.limits import limit_rows, limits_json
    from wearsim.report.summary import draws, effort, end_state, run_json, run_line, standing

    if json:
        write_json({**run_json(result), "limits": limits_json(result)})
        return
    state = [*end_state(result), *limit_rows(result)]
    rows = [("test", standing(result)), *draws(result), *state, *effort(result)]
    write_table(result.title, [*rows, ("results file", str(result.path))])
    typer.echo(run_line(result))


More = Annotated[
    int | None,
    typer.Option(
        "--realisations",
        "-n",
        min=1,
        help="New number of realisations of an ensemble; extends it.",
        show_default=False,
    ),
]
AllowDeep = Annotated[
    bool,
    typer.Option(
        "--allow-deep",
        help="Continue a wear test beyond a depth of a tenth of the roller's radius.",
    ),
]
Failed = Annotated[
    bool, typer.Option("--failed", help="Repeat the failed realisations of an ensemble.")
]


def resume(
    file: ResultsFile,
    until: Until = None,
    allow_deep: AllowDeep = False,
    failed: Failed = False,
    realisations: More = None,
    workers: Workers = None,
    scheduler: Scheduler = None,
    json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Continue a run or an ensemble from its results file."""
    from wearsim.results import kind_of

    if kind_of(file) == "ensemble":
        if until is not None:
            raise typer.BadParameter("only wear tests can be extended", param_hint="--until")
        if allow_deep:
            raise typer.BadParameter("is an option for wear tests only", param_hint="--allow-deep")
        if failed and realisations is not None:
            raise typer.BadParameter("extend the ensemble first", param_hint="--failed")
        chosen = checked_scheduler(scheduler, workers)
        from wearsim.cli.commands.ensemble import STOPPING, report
        from wearsim.cli.commands.life import report as report_lives
        from wearsim.cli.progress import EnsembleWatcher, stop_on_signals
        from wearsim.results import open_ensemble
        from wearsim.results.ensemble.life import LifeResult
        from wearsim.studies.ensemble.api import resume_ensemble
        from wearsim.studies.kernels import kernels_of

        before = open_ensemble(file)
        nothing = _nothing_to_do(before, failed)
        if nothing and realisations is None:
            note(f"note: nothing to do: {nothing}")
        watcher = EnsembleWatcher(quiet, kernels=lambda: kernels_of(before.scenario))
        with stop_on_signals(STOPPING) as stop, watcher as watch:
            if isinstance(before, LifeResult):
                from wearsim.studies.life.api import resume_life as resume_ensemble
            result = resume_ensemble(
                file,
                failed=failed,
                realisations=realisations,
                workers=workers,
                scheduler=chosen,
                on_progress=watch,
                stop_requested=stop.is_set,
                on_notice=watch.notice,
            )
        if isinstance(result, LifeResult):
            report_lives([result], [file.stem], json, None)
        else:
            report(result, json, None, watch.workers)
        return
    for option, is_given in (
        ("--failed", failed),
        ("--realisations", realisations is not None),
        ("--workers", workers is not None),
        ("--scheduler", scheduler is not None),
    ):
        if is_given:
            raise typer.BadParameter("is an option for ensembles only", param_hint=option)
    _resume_run(file, until, allow_deep, json, quiet)


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


def _resume_run(file: Path, until: str | None, allow_deep: bool, json: bool, quiet: bool) -> None:
    check_limit(until)
    from wearsim.cli.commands.run import report
    from wearsim.cli.progress import RunWatcher, stop_on_signals
    from wearsim.results import open_results
    from wearsim.studies.kernels import kernels_of
    from wearsim.studies.run import run as study

    watcher = RunWatcher(quiet, kernels=lambda: kernels_of(open_results(file).scenario))
    with stop_on_signals() as stop, watcher as watch:
        result = study.resume(
            file, until, allow_deep=allow_deep, on_event=watch, stop_requested=stop.is_set
        )
    report(result, json)


def _nothing_to_do(before: EnsembleResult, failed: bool) -> str:
    """Return why there is nothing to do, or an empty text."""
    if not failed:
        from wearsim.results.ensemble.life import LifeResult

        what = "study of lives" if isinstance(before, LifeResult) else "ensemble"
        return f"the {what} is finished" if before.finished else ""
    if before.failed:
        return ""
    rest = "" if before.finished else f"; continue the others with: wearsim resume {before.path}"
    return f"no realisation has failed{rest}"

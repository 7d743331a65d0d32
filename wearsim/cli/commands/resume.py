"""`wearsim resume`: go on with a run or an ensemble from its file alone."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from wearsim.cli.arguments import Json, Quiet, ResultsFile, Scheduler, Workers, check_workforce
from wearsim.cli.output import note

if TYPE_CHECKING:
    from wearsim.results import EnsembleResult

Until = Annotated[
    str | None,
    typer.Option(
        metavar="TIME",
        help="New end of a wear test, '600 min'; extends it.",
        show_default=False,
    ),
]
Failed = Annotated[
    bool, typer.Option("--failed", help="Run the realisations of an ensemble that failed again.")
]


def resume(
    file: ResultsFile,
    until: Until = None,
    failed: Failed = False,
    workers: Workers = None,
    scheduler: Scheduler = None,
    json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Go on with a run or an ensemble from its file alone."""
    from wearsim.results import kind_of

    if kind_of(file) == "ensemble":
        _refuse({"--until": until is not None}, "extends a wear test, and this is an ensemble")
        _resume_ensemble(file, failed, workers, scheduler, json, quiet)
        return
    given = {
        "--failed": failed,
        "--workers": workers is not None,
        "--scheduler": scheduler is not None,
    }
    _refuse(given, "goes with an ensemble, and this is none")
    _resume_run(file, until, json, quiet)


def _refuse(given: dict[str, bool], why: str) -> None:
    for option, is_given in given.items():
        if is_given:
            raise typer.BadParameter(f"{why}; leave it out", param_hint=option)


def _resume_run(file: Path, until: str | None, json: bool, quiet: bool) -> None:
    seconds = _seconds(until)
    from wearsim.cli.commands.run import report
    from wearsim.cli.progress.run import watching
    from wearsim.cli.signals import stop_on_signals
    from wearsim.studies.run import run as replay

    with stop_on_signals() as stop, watching(quiet) as watch:
        result = replay.resume(file, seconds, on_event=watch, stop_requested=stop.requested)
    report(result, json)


def _resume_ensemble(
    file: Path, failed: bool, workers: int | None, scheduler: str | None, json: bool, quiet: bool
) -> None:
    chosen = check_workforce(scheduler, workers)
    from wearsim.cli.commands.ensemble import STOPPING, in_words, report
    from wearsim.cli.progress.ensemble import watching_ensemble
    from wearsim.cli.signals import stop_on_signals
    from wearsim.results import open_ensemble
    from wearsim.studies.ensemble.api import resume_ensemble

    nothing = _nothing_to_do(open_ensemble(file), failed)
    if nothing:
        note(f"note: nothing to do: {nothing}")
    with stop_on_signals(STOPPING) as stop, watching_ensemble(quiet) as watch:
        result = resume_ensemble(
            file,
            failed=failed,
            workers=workers,
            scheduler=chosen,
            on_progress=watch,
            stop_requested=stop.requested,
            on_notice=note,
        )
    report(result, json, None, in_words(watch.workers))


def _nothing_to_do(before: EnsembleResult, failed: bool) -> str:
    """Return why there is nothing to do; empty where there is something."""
    if failed:
        none = "no realisation has failed"
        go_on = f"; go on with the others with: wearsim resume {before.path}"
        return "" if before.failed else none + ("" if before.finished else go_on)
    return "the ensemble is finished" if before.finished else ""


def _seconds(text: str | None) -> float | None:
    """Return a simulated time in seconds.

    Raises
    ------
    typer.BadParameter
        If it is no time, or none above zero.
    """
    if text is None:
        return None
    from wearsim.quantities import quantity

    try:
        seconds = quantity(text, "s")
    except ValueError as error:
        raise typer.BadParameter(str(error), param_hint="--until") from error
    if seconds <= 0.0:
        raise typer.BadParameter(f"must be above zero, got '{text}'", param_hint="--until")
    return seconds

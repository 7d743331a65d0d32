"""Verbs for wear tests: run, and resume, which also continues ensembles."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

import wearsim
from wearsim.cli.commands.ensemble import show_ensemble
from wearsim.cli.render import show_view
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
    refuse,
    refuse_options,
    results_option,
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
        " 'clearance 60 um', 'damage 1', 'pitting 0.1', '12 h' or '2e6 passes'. A shorter test"
        " is extended.",
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
    tests = (of_tests, progress.EnsembleWatcher, progress.BATCHES)
    kinds: dict[str, tuple[Sequence[str], type[Display], str]] = {
        "run": (("until", "allow_deep"), progress.RunWatcher, progress.CHECKPOINT),
        **dict.fromkeys(("ensemble", "life"), tests),
    }
    of_plugins = (("workers", "scheduler"), progress.PartWatcher, progress.PARTS)
    names, watcher, stopping = kinds.get(kind.name, of_plugins)
    without = {
        f"--{name.replace('_', '-')}": options[name] for name in options if name not in names
    }
    refuse_options(without, f"has no meaning for a file that holds {kind.holds}")
    refuse(failed and realisations is not None, "extend the ensemble first", "--failed")
    check_limit(until)
    options["scheduler"] = checked_scheduler(scheduler, workers)
    before = open_study(file, kind)
    if names == of_tests and realisations is None and (text := _nothing_to_do(before, failed)):
        note(f"note: nothing to do: {text}")
    with progress.watching(watcher, before, quiet, stopping) as watch:
        given = {name: options[name] for name in names}
        result = kind.load("resume")(file, **given, **watch.callbacks)
    if isinstance(watch, progress.EnsembleWatcher):
        show_ensemble(result, json, None, watch.workers)
    else:
        show_view(result.view, json=json, files={"results file": result.path})


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


def _nothing_to_do(before: EnsembleResult, failed: bool) -> str:
    """Return why there is nothing to do, or an empty text."""
    if not failed:
        what = "study of lives" if before.raw.life else "ensemble"
        return f"the {what} is finished" if before.finished else ""
    if before.failed:
        return ""
    rest = "" if before.finished else f"; continue the others with: wearsim resume {before.path}"
    return f"no realisation has failed{rest}"

"""`wearsim run`: wear test of a scenario."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from wearsim.cli.shared import (
    Force,
    Json,
    Quiet,
    ScenarioFile,
    Settings,
    read_scenario,
    results_option,
    write_json,
    write_notes,
    write_table,
)

if TYPE_CHECKING:
    from wearsim.results import Result

Output = Annotated[Path | None, results_option(".h5")]


def run(
    scenario: ScenarioFile,
    output: Output = None,
    settings: Settings = None,
    force: Force = False,
    json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Run a wear test and write its results file."""
    loaded = read_scenario(scenario, settings)
    path = output if output is not None else Path(f"{scenario.stem}.h5")
    from wearsim.cli.progress import RunWatcher, stop_on_signals
    from wearsim.studies.run import run as study

    write_notes(loaded.notes)
    with stop_on_signals() as stop, RunWatcher(quiet) as watch:
        result = study.run(loaded, path, force=force, on_event=watch, stop_requested=stop.is_set)
    report(result, json)


def report(result: Result, json: bool) -> None:
    """Write the summary of a run to stdout."""
    from wearsim.cli.render.summary import draws, effort, end_state, run_json, run_line, standing

    if json:
        write_json(run_json(result))
        return
    rows = [("test", standing(result)), *draws(result), *end_state(result), *effort(result)]
    write_table(result.title, [*rows, ("results file", str(result.path))])
    typer.echo(run_line(result))

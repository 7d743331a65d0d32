"""`wearsim resume`: go on with a run from its file alone."""

from __future__ import annotations

from typing import Annotated

import typer

from wearsim.cli.arguments import Json, Quiet, ResultsFile
from wearsim.cli.run import report

Until = Annotated[
    str | None,
    typer.Option(
        metavar="TIME", help="New end of the test, '600 min'; extends it.", show_default=False
    ),
]


def resume(
    file: ResultsFile, until: Until = None, json: Json = False, quiet: Quiet = False
) -> None:
    """Go on with a run from its file alone, or extend it."""
    seconds = _seconds(until)
    from wearsim.cli.progress import watching
    from wearsim.cli.stop import stop_on_signals
    from wearsim.studies import replay

    with stop_on_signals() as stop, watching(quiet) as watch:
        result = replay.resume(file, seconds, on_event=watch, stop_requested=stop.requested)
    report(result, json)


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

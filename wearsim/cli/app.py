"""Command `wearsim`: its verbs and its global options."""

from __future__ import annotations

import os
from typing import Annotated

import typer

from wearsim.cli.errors import TRACEBACK, Shell

app = typer.Typer(
    name="wearsim",
    cls=Shell,
    help="Simulate wear of rolling contacts over millions of roller passes.",
    epilog="Exit codes: 0 success, 1 the computation failed, 2 bad input, 130 interrupted.",
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)


def _show_version(requested: bool) -> None:
    if requested:
        from importlib.metadata import version

        typer.echo(f"wearsim {version('wearsim')}")
        raise typer.Exit


@app.callback()
def options(
    version: Annotated[
        bool,
        typer.Option("--version", help="Show the version.", callback=_show_version, is_eager=True),
    ] = False,
    traceback: Annotated[
        bool,
        typer.Option("--traceback", help=f"Show tracebacks of errors; also {TRACEBACK}=1."),
    ] = False,
) -> None:
    """Simulate wear of rolling contacts over millions of roller passes."""
    if traceback:
        os.environ[TRACEBACK] = "1"


def main() -> None:
    """Run the command with the arguments of this process."""
    app(prog_name="wearsim")

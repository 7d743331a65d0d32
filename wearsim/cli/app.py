"""Command `wearsim`: its verbs and its global options."""

from __future__ import annotations

import os
from typing import Annotated

import typer

from wearsim.cli.commands.check import check
from wearsim.cli.commands.compare import compare
from wearsim.cli.commands.contact import contact
from wearsim.cli.commands.dissipation import dissipation
from wearsim.cli.commands.ensemble import ensemble
from wearsim.cli.commands.export import export
from wearsim.cli.commands.maxent import maxent
from wearsim.cli.commands.new import new
from wearsim.cli.commands.plot import plot
from wearsim.cli.commands.plugins import plugins
from wearsim.cli.commands.resume import resume
from wearsim.cli.commands.run import run
from wearsim.cli.commands.schema import schema
from wearsim.cli.commands.show import show
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
for verb in (
    check, contact, dissipation, run, ensemble, resume, show, plot, compare, export, maxent,
    plugins, schema,
):  # fmt: skip
    app.command()(verb)
app.add_typer(new)


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

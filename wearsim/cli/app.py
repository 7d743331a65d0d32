"""Command wearsim: its verbs, its global options, its error messages and exit codes."""

from __future__ import annotations

import gc
import os
import traceback
from collections.abc import Callable
from copy import copy
from functools import partial
from importlib import import_module
from typing import TYPE_CHECKING, Annotated, Any

import typer
from typer.core import TyperCommand, TyperGroup

from wearsim.cli.shared import checking_arguments
from wearsim.errors import (
    Interrupted,
    PluginError,
    ScenarioError,
    SolverError,
    WearsimError,
    described,
)

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint  # slow to import


GROUP = "wearsim.commands"
#: distributions of this project that add a verb
FIRST_PARTY = {
    "bench": "wearsim-bench",
    "explore": "wearsim-explore",
    "optimise": "wearsim-optimise",
    "reproduce": "wearsim-chevalier2005",
    "validate": "wearsim-validation",
}


#: built-in verbs with their help lines, in the order of the help
BUILT_IN = {
    "check": "Check a scenario: print all mistakes, or the inputs and a summary of the run.",
    "contact": "Solve one contact: the first roller at the start of the load.",
    "cam": "Show motion, loads and fresh contact of a cam along its angle.",
    "dissipation": "Solve one contact for many realisations of its random inputs.",
    "run": "Run a wear test and write its results file.",
    "ensemble": "Run a wear test for each realisation of the random inputs.",
    "identify": "Identify the wear factor from measured grooves, and whether it scatters.",
    "life": "Compute the life of a design until a limit is reached, and compare two designs.",
    "resume": "Continue a run or an ensemble from its results file.",
    "show": "Show the content of a results file and the end state.",
    "plot": "Draw the figure of a results file of any kind.",
    "compare": "Compare runs and ensembles, with confidence intervals.",
    "report": "Write one page on results for a browser: answers, interactive figures, inputs.",
    "export": "Write a results file as CSV with units, or what is worn as a new start.",
    "maxent": "Compute a maximum-entropy distribution from moments.",
    "plugins": "List contact models, wear laws, loads, random inputs and motion laws.",
    "schema": "Write the JSON Schema of a scenario, for editors.",
    "new": "Create a new plugin, scenario or cam.",
}
#: modules in `wearsim.cli.commands` of the verbs that have not one of their name
_MODULES = {
    **dict.fromkeys(("check", "schema", "new", "plugins"), "scenarios"),
    **dict.fromkeys(("show", "plot", "compare", "report", "export"), "results"),
    **dict.fromkeys(("ensemble", "resume"), "run"),
    **dict.fromkeys(("cam", "dissipation"), "contact"),
}
#: command-line options by argument of Python, where their names differ
_OPTIONS = {"limits": "--limit", "most": "--max"}
TRACEBACK = "WEARSIM_TRACEBACK"


class LazyVerb(TyperCommand):
    """Verb that is imported when it is called; its help line is known before.

    Parameters
    ----------
    name, line : str
        The verb and its help line.
    load : callable
        Imports the verb and returns its app.
    """

    def __init__(self, name: str, line: str, load: Callable[[], typer.Typer]) -> None:
        super().__init__(name, help=line)
        self._load = load

    def make_context(self, *args: Any, **kwargs: Any) -> Any:
        """Import the verb and return the context of its command, with the arguments parsed."""
        command = typer.main.get_command(self._load())
        command.name = self.name
        # Typer adds two to every app that would install the completion of `wearsim`
        command.params = [p for p in command.params if not str(p.name).endswith("_completion")]
        shared = {item.name: item for item in kwargs["parent"].find_root().command.params}
        _add_option(command, shared["traceback"])
        if command.callback is not None:
            command.callback = checking_arguments(**_OPTIONS)(command.callback)
        return command.make_context(*args, **kwargs)


def _add_option(command: Any, option: Any) -> None:
    """Add a global option to a command, or all commands of a group; only its callback is called."""
    if not any(item.name == option.name for item in command.params):
        added = copy(option)
        added.expose_value = False
        command.params.append(added)
    for inner in getattr(command, "commands", {}).values():
        _add_option(inner, option)


def _built_in(name: str) -> typer.Typer:
    """Return the app of a verb of wearsim."""
    verb = getattr(import_module(f"wearsim.cli.commands.{_MODULES.get(name, name)}"), name)
    if isinstance(verb, typer.Typer):
        return verb
    app = typer.Typer(rich_markup_mode=None)
    app.command()(verb)
    return app


def _installed(verb: str, points: list[EntryPoint]) -> typer.Typer:
    """Return the app of a verb of another distribution.

    Parameters
    ----------
    verb : str
        The verb.
    points : list of EntryPoint
        All entry points of this name.

    Raises
    ------
    PluginError
        If there are several, or the verb cannot be loaded.
    """
    point, name = points[0], f"the verb '{verb}'"
    distributions = sorted(map(_distribution, points))
    if len(points) > 1:
        raise PluginError(
            f"{name} is added by {' and by '.join(distributions)}; uninstall one of them"
        )
    gc.enable()  # the verb may not report progress
    try:
        app = point.load()
        if not isinstance(app, typer.Typer):
            raise TypeError(f"{point.value} is a {type(app).__name__}, expected a typer.Typer")
        typer.main.get_command(app)  # an app without commands cannot be called
    except (Exception, SystemExit) as error:  # an import may even end the process
        raise PluginError(
            f"{name} of {distributions[0]} cannot be loaded:"
            f" {type(error).__name__}: {error}; update or uninstall it"
        ) from error
    return app


def installed_verbs() -> dict[str, LazyVerb]:
    """Return the verbs of all installed distributions by name, sorted."""
    from importlib.metadata import entry_points

    points_by_name, verbs = entry_points(group=GROUP), {}
    for name in sorted(points_by_name.names):
        points = list(points_by_name.select(name=name))
        load = partial(_installed, name, points)
        verbs[name] = LazyVerb(name, "; ".join(map(_summary, points)), load)
    return verbs


def _distribution(point: EntryPoint) -> str:
    return f"{point.dist.name} {point.dist.version}" if point.dist else "an unknown distribution"


def _summary(point: EntryPoint) -> str:
    # the text itself: parsing all metadata as an e-mail message takes longer
    lines = ((point.dist and point.dist.read_text("METADATA")) or "").splitlines()
    summaries = (line.partition(": ")[2] for line in lines if line.startswith("Summary: "))
    return next(summaries, f"From {_distribution(point)}.")


class Shell(TyperGroup):
    """Group of built-in and installed verbs that converts errors to exit codes."""

    def __init__(self, **attributes: Any) -> None:
        super().__init__(**attributes)
        self.commands.update(
            {
                name: LazyVerb(name, line, partial(_built_in, name))
                for name, line in BUILT_IN.items()
            }
        )

    def list_commands(self, ctx: Any) -> list[str]:
        """Return the names of all verbs, built-in ones first."""
        self._add_installed()
        return super().list_commands(ctx)

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """Return a verb, built-in before installed, or None; no plugin is imported."""
        if cmd_name not in self.commands:
            self._add_installed()
        return super().get_command(ctx, cmd_name)

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """Return name, verb and remaining arguments; fail with a hint if it is not installed."""
        name = args[0]
        if self.get_command(ctx, name) is None and name in FIRST_PARTY:
            distribution = FIRST_PARTY[name]
            ctx.fail(
                f"No such command '{name}'. It is part of {distribution}, which is not installed:"
                f" pip install 'wearsim[{distribution.removeprefix('wearsim-')}]', or from a clone"
                f" pip install ./plugins/{distribution}"
            )
        return super().resolve_command(ctx, args)

    def _add_installed(self) -> None:
        for name, verb in installed_verbs().items():
            self.commands.setdefault(name, verb)

    def invoke(self, ctx: Any) -> Any:
        """Run a verb.

        Raises
        ------
        typer.Exit
            With the exit code of the error.
        """
        try:
            return super().invoke(ctx)
        except KeyboardInterrupt as error:
            typer.echo("interrupted", err=True)
            raise typer.Exit(Interrupted.exit_code) from error
        except BrokenPipeError:  # "wearsim schema | head"
            raise
        except Exception as error:
            if type(error).__module__.split(".")[0] in {"click", "typer"}:
                raise
            if os.environ.get(TRACEBACK, "") not in {"", "0"}:
                typer.echo("".join(traceback.format_exception(error)), err=True, nl=False)
            else:
                typer.echo(_message(error), err=True)
            raise typer.Exit(
                error.exit_code if isinstance(error, WearsimError) else WearsimError.exit_code
            ) from error


def _message(error: BaseException) -> str:
    match error:
        case SolverError() if error.state:
            from wearsim.cli.solver_state import solver_state

            state = solver_state(error.state)
            lines = [f"error: {error.at_shell}", state and f"state at the failure: {state}"]
            return "\n".join([*filter(None, lines), *getattr(error, "__notes__", ())])
        case ScenarioError() | Interrupted():  # their messages start with file or progress
            return error.at_shell
        case WearsimError():
            return f"error: {error.at_shell}"
        case OSError():
            return f"error: {error.filename or 'a file'}: {error.strerror or error}"
        case MemoryError():
            return (
                f"error: not enough memory ({described(error)}); fewer strips, records,"
                " realisations or workers take less"
            )
    from wearsim.plugins.manager import registry

    return (
        f"internal error: {type(error).__name__}: {described(error)}\nthis is a defect of"
        f" {registry().raised_in(error) or 'wearsim or of a plugin'}; --traceback shows where"
    )


app = typer.Typer(
    name="wearsim",
    cls=Shell,
    help="Simulate wear of rolling contacts over millions of roller passes.",
    epilog="Exit codes: 0 success, 1 the computation failed, 2 bad input, 130 interrupted.",
    no_args_is_help=True,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)


def _show_version(requested: bool) -> None:
    if requested:
        from importlib.metadata import version

        typer.echo(f"wearsim {version('wearsim')}")
        raise typer.Exit


def _show_tracebacks(requested: bool) -> None:
    if requested:
        os.environ[TRACEBACK] = "1"


@app.callback()
def options(
    version: Annotated[
        bool,
        typer.Option("--version", help="Show the version.", callback=_show_version, is_eager=True),
    ] = False,
    traceback: Annotated[
        bool,
        typer.Option(
            "--traceback",
            help=f"Show tracebacks of errors; also {TRACEBACK}=1.",
            callback=_show_tracebacks,
            is_eager=True,
        ),
    ] = False,
) -> None:
    """Simulate wear of rolling contacts over millions of roller passes."""


def main() -> None:
    """Run the command with the arguments of this process.

    Garbage is not collected until a verb reports progress: almost all objects of the imports
    remain, and collecting among them takes a fifth of the start. At the end they are left to the
    operating system, since collecting them takes a quarter of a second where numba is loaded.
    """
    gc.disable()
    try:
        app(prog_name="wearsim")
    finally:
        gc.freeze()

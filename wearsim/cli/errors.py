"""Errors of all verbs: messages on stderr and exit codes."""

from __future__ import annotations

import os
import traceback
from typing import Any

import typer
from typer.core import TyperGroup

from wearsim.cli.verbs import BUILT_IN, BuiltInVerb, installation_hint, installed_verbs
from wearsim.errors import Interrupted, ScenarioError, SolverError, WearsimError

FAILED = 1
INTERRUPTED = 130
TRACEBACK = "WEARSIM_TRACEBACK"
_INTERNAL = ("contact_", "coarse_step_", "half_quadrature_", "loop_")


class Shell(TyperGroup):
    """Group of built-in and installed verbs that converts errors to exit codes."""

    def __init__(self, **attributes: Any) -> None:
        super().__init__(**attributes)
        self.commands.update({name: BuiltInVerb(name) for name in BUILT_IN})

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
        if self.get_command(ctx, args[0]) is None and (hint := installation_hint(args[0])):
            ctx.fail(hint)
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
            raise typer.Exit(INTERRUPTED) from error
        except BrokenPipeError:  # "wearsim schema | head"
            raise
        except Exception as error:
            if type(error).__module__.split(".")[0] in {"click", "typer"}:
                raise
            write_error(error)
            code = error.exit_code if isinstance(error, WearsimError) else FAILED
            raise typer.Exit(code) from error


def write_error(error: BaseException) -> None:
    """Write the message of an error to stderr, or its traceback if requested."""
    if os.environ.get(TRACEBACK, "") not in {"", "0"}:
        typer.echo("".join(traceback.format_exception(error)), err=True, nl=False)
        return
    typer.echo(_message(error), err=True)


def _state(state: dict[str, Any]) -> str:
    """Return the numbers of a solver state on one line, an array as its range."""
    parts = []
    for name, value in state.items():
        numeric = isinstance(value, int | float) or (hasattr(value, "min") and value.size)
        if not numeric or name.startswith(_INTERNAL):
            continue
        low, high = (value, value) if not hasattr(value, "min") else (value.min(), value.max())
        parts.append(f"{name} {low:.6g}" if low == high else f"{name} {low:.6g} to {high:.6g}")
    return ", ".join(parts)


def _message(error: BaseException) -> str:
    if isinstance(error, SolverError) and error.state:
        return f"error: {error}\nstate at the failure: {_state(error.state)}"
    if isinstance(error, ScenarioError | Interrupted):  # their messages start with file or progress
        return str(error)
    if isinstance(error, WearsimError):
        return f"error: {error}"
    if isinstance(error, OSError):
        return f"error: {error.filename or 'a file'}: {error.strerror or error}"
    return (
        f"internal error: {type(error).__name__}: {error}\n"
        "this is a defect of wearsim or of a plugin; --traceback shows where"
    )

"""What all verbs share: errors told in a line and turned into exit codes."""

from __future__ import annotations

import os
import traceback
from typing import Any

import typer
from typer.core import TyperGroup

from wearsim.cli.installed_verbs import InstalledVerb, installed_verbs, missing_verb
from wearsim.errors import Interrupted, ScenarioError, SolverError, WearsimError

FAILED = 1
BAD_INPUT = 2
INTERRUPTED = 130
TRACEBACK = "WEARSIM_TRACEBACK"


class Shell(TyperGroup):
    """The group of verbs, built-in and installed, which turns errors into exit codes."""

    def list_commands(self, ctx: Any) -> list[str]:
        """Return the names of all verbs, built-in ones first."""
        built_in = super().list_commands(ctx)
        return [*built_in, *(name for name in installed_verbs() if name not in built_in)]

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """Return a verb; an installed one is not imported."""
        return super().get_command(ctx, cmd_name) or installed_verbs().get(cmd_name)

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """Return the verb that is called, imported, and its arguments."""
        hint = missing_verb(args[0]) if self.get_command(ctx, args[0]) is None else None
        if hint:
            ctx.fail(hint)
        name, command, rest = super().resolve_command(ctx, args)
        if isinstance(command, InstalledVerb):
            command = command.load()
        return name, command, rest

    def invoke(self, ctx: Any) -> Any:
        """Run a verb.

        Raises
        ------
        typer.Exit
            With the error's exit code.
        """
        try:
            return super().invoke(ctx)
        except WearsimError as error:
            tell(error)
            raise typer.Exit(error.exit_code) from error
        except KeyboardInterrupt as error:
            typer.echo("interrupted", err=True)
            raise typer.Exit(INTERRUPTED) from error
        except BrokenPipeError:  # "wearsim schema | head"
            raise
        except OSError as error:
            tell(error)
            raise typer.Exit(FAILED) from error
        except Exception as error:
            if type(error).__module__.split(".")[0] in {"click", "typer"}:
                raise
            tell(error)
            raise typer.Exit(FAILED) from error


def tell(error: BaseException) -> None:
    """Write an error to stderr: one clear message, with its traceback only where asked for."""
    if os.environ.get(TRACEBACK, "") not in {"", "0"}:
        typer.echo("".join(traceback.format_exception(error)), err=True, nl=False)
        return
    typer.echo(_message(error), err=True)


def _state(state: dict[str, Any]) -> str:
    """Return the numbers of a state that fit on a line; an array is told by its range."""
    parts = []
    for name, value in state.items():
        numeric = isinstance(value, int | float) or (hasattr(value, "min") and value.size)
        if not numeric or name.startswith(
            ("contact_", "coarse_step_", "half_quadrature_", "loop_")
        ):
            continue
        low, high = (value, value) if not hasattr(value, "min") else (value.min(), value.max())
        parts.append(f"{name} {low:.6g}" if low == high else f"{name} {low:.6g} to {high:.6g}")
    return ", ".join(parts)


def _message(error: BaseException) -> str:
    if isinstance(error, SolverError) and error.state:
        return f"error: {error}\nstate at the failure: {_state(error.state)}"
    if isinstance(error, ScenarioError | Interrupted):  # each says where it stands
        return str(error)
    if isinstance(error, WearsimError):
        return f"error: {error}"
    if isinstance(error, OSError):
        return f"error: {error.filename or 'a file'}: {error.strerror or error}"
    return (
        f"internal error: {type(error).__name__}: {error}\n"
        "this is a fault of wearsim or of a plugin; --traceback shows where"
    )

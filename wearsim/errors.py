"""Errors raised by wearsim, and their exit codes at the shell."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any


def described(error: BaseException) -> str:
    """Return the message of an error; of one of pydantic, place and message of each mistake."""
    if type(error).__name__ != "ValidationError" or not isinstance(error, ValueError):
        return str(error)
    lines = []
    for item in error.errors():  # type: ignore[attr-defined]
        place = ".".join(map(str, item["loc"]))
        message = item["msg"].removeprefix("Value error, ").removeprefix("Assertion failed, ")
        lines.append(f"{place}: {message}" if place else message)
    return "; ".join(lines)


class WearsimError(Exception):
    """Base class of the errors raised by wearsim.

    Parameters
    ----------
    message : str
        What failed.
    python, shell : str
        What to do about it, in terms of the arguments of a function and of the options of a verb,
        where these differ.

    Attributes
    ----------
    message : str
        The message without remedy.
    at_shell : str
        The message with the remedy at the shell; the text of the exception has that in Python.
    """

    exit_code = 1

    def __init__(self, message: str = "", *, python: str = "", shell: str = "") -> None:
        self.message = message
        self.at_shell = f"{message}; {shell}" if shell else message
        super().__init__(f"{message}; {python}" if python else message)


def failure_text(error: Exception) -> str:
    """Return the message of an error, after its type if wearsim did not raise it deliberately."""
    kind = type(error).__name__
    return str(error) or kind if isinstance(error, WearsimError) else f"{kind}: {described(error)}"


@dataclass(frozen=True)
class Mistake:
    """One mistake in an input file: table, key, description, value given and value expected."""

    table: str
    key: str
    what: str
    got: str | None = None
    expected: str | None = None

    def __str__(self) -> str:
        where = " ".join(filter(None, (self.table and f"[{self.table}]", self.key)))
        got = "" if self.got is None else f", got {self.got}"
        expected = "" if self.expected is None else f", expected {self.expected}"
        return (f"{where}: {self.what}" if where else self.what) + got + expected


class ScenarioError(WearsimError):
    """A scenario, or a file named in it, that cannot be used.

    Parameters
    ----------
    file : str
        File with the mistakes.
    mistakes : list of Mistake
        All mistakes of the file.
    python, shell : str
        As in `WearsimError`.
    """

    exit_code = 2

    def __init__(
        self, file: str, mistakes: list[Mistake], *, python: str = "", shell: str = ""
    ) -> None:
        self.file, self.mistakes = file, mistakes
        message = "\n".join(f"{file}: {mistake}" for mistake in mistakes)
        super().__init__(message, python=python, shell=shell)

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.file, self.mistakes), {**self.__dict__, "args": self.args}


class PluginError(WearsimError):
    """A plugin that is missing or broken, or has the name of another."""

    exit_code = 2


class CapabilityError(WearsimError):
    """A contact model without a required capability."""

    exit_code = 2


class ResultsFileError(WearsimError):
    """A results file that cannot be read, or exists and must not be overwritten."""

    exit_code = 2


class UnknownNameError(WearsimError, ValueError):
    """A name that does not exist, with those that do.

    Parameters
    ----------
    message : str
        As from `unknown_name`.
    """

    exit_code = 2


def unknown_name(name: str, kind: str, known: Iterable[str]) -> UnknownNameError:
    """Return the error of an unknown name, with the most similar one and all known ones.

    Parameters
    ----------
    name : str
        The name.
    kind : str
        What it should be the name of, "a variable of this run".
    known : iterable of str
        All names of that kind.
    """
    names = list(known)
    similar = difflib.get_close_matches(name, names, n=1)
    hint = f" (did you mean '{similar[0]}'?)" if similar else ""
    return UnknownNameError(f"'{name}' is not {kind}{hint}; known: {', '.join(names)}")


class SolverError(WearsimError):
    """A failed computation: lost contact, no convergence, a value that is not finite.

    Parameters
    ----------
    message : str
        Failure, where it happened, and possible remedies.
    state : dict
        State before the failure: numbers and arrays by name.
    """

    def __init__(self, message: str, state: dict[str, Any] | None = None) -> None:
        self.state = state or {}
        super().__init__(message)


class ContactError(SolverError):
    """A contact problem without solution, or whose solver did not converge."""


class StepError(SolverError):
    """A step of the evolution that did not converge or would be unstable."""


class WorkerError(WearsimError):
    """Failed distribution of work: workers that crash, are missing or have another version.

    Parameters
    ----------
    message : str
        Failure and possible remedies.
    realisations : sequence of int
        Realisations at which workers crashed.
    """

    def __init__(self, message: str, realisations: Sequence[int] = ()) -> None:
        self.realisations = tuple(realisations)
        super().__init__(message)


class Interrupted(WearsimError):  # noqa: N818  (the end of a run, not an error)
    """A run stopped by the user; its checkpoint holds the state."""

    exit_code = 130

"""Everything wearsim raises on purpose, and the exit code each means at the shell."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any


class WearsimError(Exception):
    """Base of every error wearsim raises on purpose."""

    exit_code = 1


@dataclass(frozen=True)
class Mistake:
    """One mistake in an input file: where it stands, what it is, what was got and expected."""

    table: str
    key: str
    what: str
    got: str | None = None
    expected: str | None = None

    def __str__(self) -> str:
        where = " ".join(
            part for part in (f"[{self.table}]" if self.table else "", self.key) if part
        )
        text = f"{where}: {self.what}" if where else self.what
        if self.got is not None:
            text += f", got {self.got}"
        if self.expected is not None:
            text += f", expected {self.expected}"
        return text


class ScenarioError(WearsimError):
    """A scenario, or a file it names, cannot be used; all its mistakes are held together.

    Parameters
    ----------
    file : str
        The file the mistakes are in.
    mistakes : list of Mistake
        Every mistake found.
    """

    exit_code = 2

    def __init__(self, file: str, mistakes: list[Mistake]) -> None:
        self.file = file
        self.mistakes = mistakes
        super().__init__("\n".join(f"{file}: {mistake}" for mistake in mistakes))

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.file, self.mistakes)


class PluginError(WearsimError):
    """A plugin is missing, broken, or shares its name with another."""

    exit_code = 2


class CapabilityError(WearsimError):
    """A contact model was asked for something it says it cannot do."""

    exit_code = 2


class ResultsFileError(WearsimError):
    """A results file cannot be read, or would be overwritten unasked."""

    exit_code = 2


class SolverError(WearsimError):
    """The physics went wrong: lost contact, no convergence, a value that is not finite.

    Parameters
    ----------
    message : str
        What happened, where, and what to try.
    state : dict
        The state that led there: numbers and arrays by name.
    """

    def __init__(self, message: str, state: dict[str, Any] | None = None) -> None:
        self.state = state or {}
        super().__init__(message)


class ContactError(SolverError):
    """A contact mistake has no solution, or its solver did not find it."""


class StepError(SolverError):
    """A step of the evolution did not converge, or would be unstable."""


class WorkerError(WearsimError):
    """Work cannot be spread over workers: they die of it, are not there, or are not alike.

    Parameters
    ----------
    message : str
        What happened, and what to try.
    realisations : sequence of int
        Those that the workers died of.
    """

    def __init__(self, message: str, realisations: Sequence[int] = ()) -> None:
        self.realisations = tuple(realisations)
        super().__init__(message)


class Interrupted(WearsimError):  # noqa: N818  (it is how a run ends, not what went wrong)
    """A run was stopped by the user; what was done is in the checkpoint."""

    exit_code = 130

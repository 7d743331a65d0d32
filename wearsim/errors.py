"""Errors raised by wearsim, and their exit codes at the shell."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from importlib import import_module
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


def printable(text: str) -> str:
    """Return a text with control characters as escape sequences, which a terminal would obey."""
    if text.isprintable():
        return text
    return "".join(c if c.isprintable() or c in "\n\t" else ascii(c)[1:-1] for c in text)


def optional_library(name: str, missing: Exception) -> Any:
    """Return a module of an optional package; raise an error if it is not installed."""
    try:
        return import_module(name)
    except ImportError as error:
        raise missing from error


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

    Examples
    --------
    >>> try:
    ...     wearsim.open_results("missing.h5")
    ... except wearsim.WearsimError as error:
    ...     print(error)
    missing.h5: there is no such file
    """

    exit_code = 1

    def __init__(self, message: str = "", *, python: str = "", shell: str = "") -> None:
        message, python, shell = printable(message), printable(python), printable(shell)
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
        text = f"{where}: {self.what}" if where else self.what
        more = {"got": self.got, "expected": self.expected}
        return text + "".join(f", {key} {item}" for key, item in more.items() if item is not None)


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

    Examples
    --------
    >>> try:
    ...     wearsim.load_scenario("rig.toml", {"friction.coefficient": -0.1})
    ... except wearsim.ScenarioError as error:
    ...     print(error)
    rig.toml: [friction] coefficient: is out of range, got -0.1, expected a number above 0
    """

    exit_code = 2

    def __init__(
        self, file: str, mistakes: list[Mistake], *, python: str = "", shell: str = ""
    ) -> None:
        self.file, self.mistakes = file, mistakes
        lines = (f"{file}: {mistake}" for mistake in mistakes)
        super().__init__("\n".join(lines), python=python, shell=shell)

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.file, self.mistakes), {**self.__dict__, "args": self.args}


def mistake_in(
    file: str,
    what: str,
    got: str | None = None,
    expected: str | None = None,
    *,
    table: str = "",
    key: str = "",
) -> ScenarioError:
    """Return the error of the only mistake in a file; parameters as of `Mistake`."""
    return ScenarioError(file, [Mistake(table, key, what, got, expected)])


class InfeasibleCamError(ScenarioError):
    """A cam that its roller cannot follow: undercut, jumping or reaching the pivot of its arm.

    Parameters
    ----------
    file, mistakes
        As in `ScenarioError`.
    margins : mapping of str to float
        How far the cam is from being feasible, in SI: ``undercut_margin`` [m],
        ``least_normal_force`` [N] and of an arm ``pivot_margin`` [m]. All are above zero for a
        feasible cam.

    Examples
    --------
    >>> from wearsim.scenario.examples import shipped_scenario
    >>> fast = shipped_scenario("cam-cycloidal", {"operation.speed": "3000 rpm"})
    >>> try:
    ...     wearsim.study_cam(fast)
    ... except wearsim.errors.InfeasibleCamError as error:
    ...     print(f"{error.margins['least_normal_force']:.0f} N")
    -672 N
    """

    def __init__(self, file: str, mistakes: list[Mistake], margins: Mapping[str, float]) -> None:
        super().__init__(file, mistakes)
        self.margins = dict(margins)

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.file, self.mistakes, self.margins), {"args": self.args}


class PluginError(WearsimError):
    """A plugin that is missing or broken, or has the name of another.

    Examples
    --------
    >>> issubclass(wearsim.PluginError, wearsim.WearsimError)
    True
    """

    exit_code = 2


class CapabilityError(WearsimError):
    """A contact model without a required capability.

    Examples
    --------
    >>> model = {"contact.model": "hertz", "evolution.stepper": "implicit"}
    >>> try:
    ...     wearsim.run(wearsim.load_scenario("rig.toml", model))
    ... except wearsim.CapabilityError as error:
    ...     print(error)
    rig.toml: contact model 'hertz' ...
    """

    exit_code = 2


class ResultsFileError(WearsimError):
    """A results file that cannot be read, or exists and must not be overwritten.

    Examples
    --------
    >>> try:
    ...     wearsim.run("rig.toml", "rig.png")
    ... except wearsim.ResultsFileError as error:
    ...     print(error)
    rig.png: no results file ends in .png; choose another, such as rig.h5 as output
    """

    exit_code = 2


class UnknownNameError(WearsimError, ValueError):
    """A name that does not exist, with those that do.

    Parameters
    ----------
    message : str
        As from `unknown_name`.

    Examples
    --------
    >>> try:
    ...     wearsim.run("rig.toml").values("dpth")
    ... except wearsim.UnknownNameError as error:
    ...     print(error)
    'dpth' is not a variable of a run (did you mean 'depth'?); known: y, ...
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
    similar = difflib.get_close_matches(str(name), names, n=1)
    hint = f" (did you mean '{similar[0]}'?)" if similar else ""
    return UnknownNameError(f"'{name}' is not {kind}{hint}; known: {', '.join(names)}")


class SolverError(WearsimError):
    """A failed computation: lost contact, no convergence, a value that is not finite.

    Parameters
    ----------
    message : str
        Failure, and where it happened.
    state : dict
        State before the failure: numbers and arrays by name.
    remedy : str
        What to do about it; a study that knows the scenario may name another.
    cause : str
        "edge" (the contact reaches the edge of its strips), "too fine" (strips that are too narrow
        for the length of the contact), "skid" (friction cannot transmit the torque), "lost" (a load
        falls to zero) or empty.
    places : sequence of int
        Places in a batch of the tests that failed, if they are known.

    Examples
    --------
    >>> few = wearsim.load_scenario("rig.toml", {"evolution.max_steps": 3})
    >>> try:
    ...     wearsim.run(few)
    ... except wearsim.SolverError as error:
    ...     print(error)
    3 steps have reached pass ...; raise evolution.max_steps or evolution.tolerance
    """

    def __init__(
        self,
        message: str,
        state: dict[str, Any] | None = None,
        *,
        remedy: str = "",
        cause: str = "",
        places: Sequence[int] = (),
    ) -> None:
        self.state, self.remedy, self.cause = state or {}, remedy, cause
        self.places = (*places,)
        super().__init__(message, python=remedy, shell=remedy)


class ContactError(SolverError):
    """A contact problem without solution, or a solver that did not converge.

    Examples
    --------
    >>> narrow = wearsim.load_scenario("rig.toml", {"contact.width": "0.2 mm"})
    >>> try:
    ...     wearsim.solve_contact(narrow)
    ... except wearsim.ContactError as error:
    ...     print(error)
    the slender contact ...
    """


class StepError(SolverError):
    """A step of the evolution that did not converge or would be unstable.

    Examples
    --------
    >>> few = wearsim.load_scenario("rig.toml", {"evolution.max_steps": 3})
    >>> try:
    ...     wearsim.run(few)
    ... except wearsim.StepError as error:
    ...     print(error)
    3 steps have reached pass ...; raise evolution.max_steps or evolution.tolerance
    """


class WorkerError(WearsimError):
    """Failed distribution of work: workers that crash, are missing or have another version.

    Parameters
    ----------
    message : str
        Failure and possible remedies.
    realisations : sequence of int
        Realisations at which workers crashed.

    Examples
    --------
    >>> wearsim.WorkerError("workers end at realisation 3", [3]).realisations
    (3,)
    """

    def __init__(self, message: str, realisations: Sequence[int] = ()) -> None:
        self.realisations = tuple(realisations)
        super().__init__(message)


class Interrupted(WearsimError):  # noqa: N818  (the end of a run, not an error)
    """A run stopped by the user; its checkpoint holds the state.

    Examples
    --------
    >>> try:
    ...     wearsim.run("rig.toml", "rig.h5", stop_requested=lambda: True)
    ... except wearsim.Interrupted as error:
    ...     print(error)
    stopped at pass ... of 1350000; continue with wearsim.resume("rig.h5")
    >>> wearsim.resume("rig.h5").finished
    True
    """

    exit_code = 130

"""Checks: a promise, where it is written, and what is said when it is broken."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Generic, TypeVar

import numpy as np
import numpy.typing as npt

from wearsim.errors import WearsimError

B = TypeVar("B")


class PromiseBroken(AssertionError):  # noqa: N818  (an assertion that says what it is)
    """Something does not keep what its protocol promises; the message says what and by how much."""


@dataclass(frozen=True)
class Check(Generic[B]):
    """One promise that can be put to the test.

    Parameters
    ----------
    name : str
        The promise in a few words, as an item of a test report.
    promise : str
        The promise in a sentence.
    promised_in : str
        Dotted name of what promises it, "wearsim.plugins.ContactModel.solve".
    run : callable
        Takes the bench that holds the thing, and raises PromiseBroken.
    """

    name: str
    promise: str
    promised_in: str
    run: Callable[[B], None]

    def __call__(self, bench: B) -> None:
        """Put the thing on a bench to the test.

        Raises
        ------
        PromiseBroken
            If it breaks the promise, or raises an error of wearsim's where it should answer.
        """
        __tracebackhide__ = True
        try:
            self.run(bench)
        except PromiseBroken as broken:
            told = str(broken)
        except WearsimError as error:
            told = f"it raised {type(error).__name__} where it should answer: {error}"
        else:
            return
        raise PromiseBroken(
            f"{bench}: {told}. It breaks a promise: {self.promise} ({self.promised_in})"
        )


class Checks(Generic[B]):
    """The promises of one kind of thing, in order."""

    def __init__(self, *parts: Checks[B]) -> None:
        self._checks: dict[str, Check[B]] = {check.name: check for part in parts for check in part}

    def __iter__(self) -> Iterator[Check[B]]:
        return iter(self._checks.values())

    def __getitem__(self, name: str) -> Check[B]:
        return self._checks[name]

    @property
    def names(self) -> tuple[str, ...]:
        """What the checks are called."""
        return tuple(self._checks)

    def promised_in(self, place: str) -> Callable[[Callable[[B], None]], Check[B]]:
        """Return a decorator that makes a function a check: its name, and its docstring's sentence.

        Parameters
        ----------
        place : str
            Dotted name of what promises it.
        """

        def add(function: Callable[[B], None]) -> Check[B]:
            name, promise = function.__name__.replace("_", "-"), inspect.getdoc(function) or ""
            check = Check(name, promise, place, function)
            self._checks[check.name] = check
            return check

        return add


def require(kept: bool, told: str) -> None:
    """Raise PromiseBroken with what is to be told unless the promise was kept."""
    if not kept:
        raise PromiseBroken(told)


def agree(
    what: str,
    got: npt.ArrayLike,
    expected: npt.ArrayLike,
    tolerance: float,
    scale: float = 0.0,
) -> None:
    """Raise PromiseBroken unless two numbers, or arrays, agree.

    Parameters
    ----------
    what : str
        What they are, for the message.
    got, expected : array_like
        Of the same shape.
    tolerance : float
        Greatest difference, relative to the greatest of `expected` or to `scale`.
    scale : float
        The least size against which a difference is measured.
    """
    found, wanted = np.asarray(got, dtype=np.float64), np.asarray(expected, dtype=np.float64)
    require(found.shape == wanted.shape, f"{what} has the shape {found.shape}, not {wanted.shape}")
    require(bool(np.isfinite(found).all()), f"{what} is not finite")
    size = max(float(np.abs(wanted).max(initial=0.0)), scale)
    difference = np.abs(found - wanted)
    if (difference <= tolerance * size).all():
        return
    worst = int(np.argmax(difference))
    index = ", ".join(str(i) for i in np.unravel_index(worst, found.shape))
    place = f" at index {index}" if found.ndim else ""
    raise PromiseBroken(
        f"{what} is {found.flat[worst]:.9g}{place}, expected {wanted.flat[worst]:.9g}: off by"
        f" {difference.flat[worst] / size if size else np.inf:.2e} of {size:.3g}, and"
        f" {tolerance:.0e} is allowed"
    )

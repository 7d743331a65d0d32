"""How long a call takes: the least of several, since other work on a machine only adds."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from typing import TypeVar

T = TypeVar("T")
_LEAST = 0.02  # s, that a timing should last
_LONG = 1.0  # s, after which a call is not repeated any more


def timed(function: Callable[[], object]) -> float:
    """Return the wall time of one call [s]."""
    start = time.perf_counter()
    function()
    return time.perf_counter() - start


def best(function: Callable[[], object], repetitions: int) -> float:
    """Return the least wall time of `function` [s], after one call that is not counted."""
    function()
    return min(timed(function) for _ in range(repetitions))


def least(function: Callable[[], T], repetitions: int) -> tuple[T, float]:
    """Return what a function returns, compiled already, and its least wall time [s].

    It is called so many times at most; one that takes long is called once.
    """
    start = time.perf_counter()
    found = function()
    seconds = spent = time.perf_counter() - start
    for _ in range(repetitions - 1):
        if spent > _LONG:
            break
        took = timed(function)
        seconds, spent = min(seconds, took), spent + took
    return found, seconds


def best_short(function: Callable[[], object], repetitions: int) -> float:
    """Return the least mean wall time [s] of a function too short to be timed by itself."""
    return best_of({"": function}, repetitions)[""]


def best_of(functions: Mapping[str, Callable[[], object]], repetitions: int) -> dict[str, float]:
    """Return the least mean wall times [s] of several functions, however short, by name.

    They are timed in rounds: a disturbance then spoils one of each. Each is called once before.
    """
    many = {name: _as_long_as_counts(function) for name, function in functions.items()}
    rounds = [
        {name: timed(call) / calls for name, (call, calls) in many.items()}
        for _ in range(repetitions)
    ]
    return {name: min(found[name] for found in rounds) for name in functions}


def _as_long_as_counts(function: Callable[[], object]) -> tuple[Callable[[], None], int]:
    """Return what calls a function so often that it can be timed, and how often that is."""
    function()
    calls = max(1, int(_LEAST / max(timed(function), 1e-7)))

    def many() -> None:
        for _ in range(calls):
            function()

    return many, calls

"""How long a call takes: the least of several, since other work on a machine only adds."""

from __future__ import annotations

import time
from collections.abc import Callable

_LEAST = 0.02  # s, that a timing should last


def timed(function: Callable[[], object]) -> float:
    """Return the wall time of one call [s]."""
    start = time.perf_counter()
    function()
    return time.perf_counter() - start


def best(function: Callable[[], object], repetitions: int) -> float:
    """Return the least wall time of `function` [s], after one call that is not counted."""
    function()
    return min(timed(function) for _ in range(repetitions))


def best_short(function: Callable[[], object], repetitions: int) -> float:
    """Return the least mean wall time [s] of a function too short to be timed by itself."""
    function()
    calls = max(1, int(_LEAST / max(timed(function), 1e-7)))

    def many() -> None:
        for _ in range(calls):
            function()

    return min(timed(many) for _ in range(repetitions)) / calls

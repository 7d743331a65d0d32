"""Timing of calls: the smallest of several times, since other processes only add to it."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from timeit import Timer, repeat, timeit
from typing import TypeVar

T = TypeVar("T")
_SHORTEST = 0.02  # s, minimum duration of a timing
_LONG = 1.0  # s, total time after which a call is not repeated


def timed(function: Callable[[], object]) -> float:
    """Return the wall time of one call [s]."""
    return timeit(function, number=1)


def best(function: Callable[[], object], repetitions: int) -> float:
    """Return the smallest wall time of `function` [s], after one untimed call."""
    return min(repeat(function, number=1, repeat=repetitions + 1)[1:])


def timed_result(function: Callable[[], T], repetitions: int) -> tuple[T, float]:
    """Return the result of a function and its smallest wall time [s].

    There is no untimed call: the function must be compiled. It is called `repetitions` times at
    most, and once if it takes long.
    """
    start = time.perf_counter()
    result = function()
    seconds = spent = time.perf_counter() - start
    for _ in range(repetitions - 1):
        if spent > _LONG:
            break
        duration = timed(function)
        seconds, spent = min(seconds, duration), spent + duration
    return result, seconds


def best_short(function: Callable[[], object], repetitions: int) -> float:
    """Return the smallest mean wall time of a short function [s], timed over many calls."""
    return best_of({"": function}, repetitions)[""]


def best_of(functions: Mapping[str, Callable[[], object]], repetitions: int) -> dict[str, float]:
    """Return the smallest mean wall times of several functions by name [s].

    Short functions are timed over many calls, after one untimed call. The functions are timed in
    rounds, so that a disturbance affects one time of each.
    """
    timers = {name: Timer(function) for name, function in functions.items()}
    calls = {name: _calls(timer) for name, timer in timers.items()}
    rounds = [
        {name: timer.timeit(calls[name]) / calls[name] for name, timer in timers.items()}
        for _ in range(repetitions)
    ]
    return {name: min(times[name] for times in rounds) for name in functions}


def _calls(timer: Timer) -> int:
    """Return the number of calls that last `_SHORTEST`, after one untimed call."""
    timer.timeit(1)
    return max(1, int(_SHORTEST / max(timer.timeit(1), 1e-7)))

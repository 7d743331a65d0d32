"""Turns checks into tests for pytest: one item per check, under the name of the promise."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache
from typing import TypeVar

from wearsim.testing.checks import Check, Checks

B = TypeVar("B")
Tests = Callable[[Check[B]], None]


def tests_of(checks: Checks[B], build: Callable[[], B], without: Mapping[str, str]) -> Tests[B]:
    """Return a parametrised test function, to be bound to a name that pytest collects.

    Parameters
    ----------
    checks : Checks
        What to check.
    build : callable
        Returns the bench; called with the first check, so that collecting costs nothing.
    without : mapping of str to str
        Names of checks that are left out and why; they are reported as skipped.

    Raises
    ------
    ValueError
        If a check that is left out does not exist.
    """
    import pytest  # noqa: PLC0415  (an author's tests have it, wearsim itself does not need it)

    unknown = [name for name in without if name not in checks.names]
    if unknown:
        raise ValueError(f"no check is named '{unknown[0]}'; there are: {', '.join(checks.names)}")
    bench = cache(build)
    params = [
        pytest.param(
            check,
            id=check.name,
            marks=[pytest.mark.skip(reason=without[check.name])] if check.name in without else [],
        )
        for check in checks
    ]

    @pytest.mark.parametrize("check", params)
    def test(check: Check[B]) -> None:
        __tracebackhide__ = True
        check(bench())

    return test

"""Bisection of a batch to isolate failures."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

from wearsim.types import IntArray

T = TypeVar("T")


def bisect_failures(
    work: Callable[[IntArray], T], places: IntArray
) -> tuple[list[tuple[IntArray, T]], dict[int, Exception]]:
    """Process a batch, and its halves recursively where that raises.

    Parameters
    ----------
    work : callable
        Processes a part of the batch. Its result for a place must not depend on the others.
    places : ndarray of int, shape (places,)
        The batch, not empty.

    Returns
    -------
    done : list of tuple
        Places and result of each part, in their order.
    failed : dict of int to Exception
        Exception of each place that fails when processed individually.
    """
    try:
        return [(places, work(places))], {}
    except Exception as error:  # any exception ends the test that raised it and no other
        if len(places) == 1:
            return [], {int(places[0]): error}
    middle = len(places) // 2
    first, failed = bisect_failures(work, places[:middle])
    second, others = bisect_failures(work, places[middle:])
    return first + second, failed | others

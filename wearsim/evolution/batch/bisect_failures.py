"""Work on many at once, divided where it fails until what fails stands alone."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

from wearsim.types import IntArray

T = TypeVar("T")


def bisect_failures(
    work: Callable[[IntArray], T], places: IntArray
) -> tuple[list[tuple[IntArray, T]], dict[int, Exception]]:
    """Do something with all places at once, or with halves of them where it raises.

    Parameters
    ----------
    work : callable
        Takes some of the places. What it makes of each must not depend on the others.
    places : ndarray of int, shape (places,)
        At least one.

    Returns
    -------
    done : list of tuple
        Places and what was made of them, in their order.
    failed : dict of int to Exception
        What was raised at single places.
    """
    try:
        return [(places, work(places))], {}
    except Exception as error:  # whatever it is, it must end what it befell and nothing else
        if len(places) == 1:
            return [], {int(places[0]): error}
    middle = len(places) // 2
    (first, failed), (second, others) = (
        bisect_failures(work, part) for part in (places[:middle], places[middle:])
    )
    return first + second, failed | others

"""The interface of executors and the types they share."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator, Sequence
from typing import Any, Protocol, TypeAlias

Work: TypeAlias = Callable[[Sequence[int]], list[Any]]
"""Does a batch: takes numbers of realisations, returns a result of each.

Other processes get it pickled, once each; threads share it.
"""

Batch: TypeAlias = Sequence[int]

Results: TypeAlias = Generator[tuple[Batch, list[Any]], None, None]

Teller: TypeAlias = Callable[[str], None]

GUARDED = 'a script must run its study under `if __name__ == "__main__":`'

AHEAD = 2
"""Batches that are out with a worker: the one it does, and the one it will go on with."""


class Executor(Protocol):
    """Has batches done."""

    @property
    def workers(self) -> int:
        """How many batches are done at the same time."""

    @property
    def describe(self) -> str:
        """Who does them, such as "2 processes"."""

    def results(self, work: Work, batches: Iterator[Batch]) -> Results:
        """Yield every batch with its results, in the order in which they are done.

        No more than `AHEAD` batches per worker are taken before their results are asked for.
        Closing the generator, or an error in it, abandons the batches that are out.

        Parameters
        ----------
        work : callable
        batches : iterator of sequence of int

        Raises
        ------
        WorkerError
            If workers are lost again and again, or are not those that they should be.
        Exception
            What `work` raises.
        """


def named(numbers: Batch) -> str:
    """Return the realisations of a batch in words for a message."""
    first, last, count = min(numbers), max(numbers), len(numbers)
    if count == 1:
        return f"realisation {first}"
    if last - first + 1 == count:
        return f"realisations {first} to {last}"
    return f"{count} realisations from {first} to {last}"

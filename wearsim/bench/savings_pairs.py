"""Two or more ways to the same result, one of which leaves out what the scene does not need."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial

import numpy as np

from wearsim.bench.accuracy import l2
from wearsim.bench.contact_measured import why
from wearsim.bench.measured import Measurement
from wearsim.bench.timing import timed
from wearsim.types import FloatArray

_LEAST = 0.02  # s, that a timing should last


@dataclass(frozen=True)
class Pair:
    """A saving, and what it saves.

    Parameters
    ----------
    group, method : str
        Which saving, and of whom.
    ways : mapping of str to callable
        What returns the result in each way, the one that wearsim goes by itself first.
    exact : callable, optional
        Returns what the results are held against; that of the last way where left out.
    """

    group: str
    method: str
    ways: Mapping[str, Callable[[], FloatArray]]
    exact: Callable[[], FloatArray] | None = None

    def measured(self, repetitions: int) -> Iterator[Measurement]:
        """Yield time and error of every way; the first counts how many times as fast it is."""
        try:
            results = {name: way() for name, way in self.ways.items()}
            exact = self.exact() if self.exact is not None else list(results.values())[-1]
            seconds = _least(self.ways, repetitions)
        except Exception as error:
            yield Measurement(self.group, self.method, next(iter(self.ways)), failed=why(error))
            return
        first, *_, last = seconds.values()
        for number, name in enumerate(self.ways):
            yield Measurement(
                group=self.group,
                method=self.method,
                setting=name,
                seconds=seconds[name],
                errors={"result": l2(np.atleast_1d(results[name]), np.atleast_1d(exact))},
                counts={} if number else {"times": last / first},
                default=not number,
            )


def _least(ways: Mapping[str, Callable[[], object]], repetitions: int) -> dict[str, float]:
    """Return the least time of every way [s], in rounds: a disturbance then spoils one of each."""
    calls = {name: max(1, int(_LEAST / timed(way))) for name, way in ways.items()}
    found = dict.fromkeys(ways, np.inf)
    for _ in range(repetitions):
        for name, way in ways.items():
            seconds = timed(partial(_again, way, calls[name])) / calls[name]
            found[name] = min(found[name], seconds)
    return found


def _again(way: Callable[[], object], calls: int) -> None:
    for _ in range(calls):
        way()

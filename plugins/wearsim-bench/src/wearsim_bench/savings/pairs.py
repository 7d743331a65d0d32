"""Two or more ways to the same result, one of which leaves out what the problem does not need."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from wearsim.types import FloatArray
from wearsim_bench.contact.accuracy import l2
from wearsim_bench.contact.worn_profiles import why
from wearsim_bench.measure.measurement import Measurement
from wearsim_bench.measure.timing import best_of


@dataclass(frozen=True)
class Ways:
    """All ways to a result.

    Parameters
    ----------
    by_name : mapping of str to callable
        What returns the result in each way, the one that wearsim goes by itself first.
    exact : callable, optional
        Returns what the results are held against; that of the last way where left out.
    """

    by_name: Mapping[str, Callable[[], FloatArray]]
    exact: Callable[[], FloatArray] | None = None


@dataclass(frozen=True)
class Pair:
    """A saving, and what it saves.

    Parameters
    ----------
    group, method : str
        Which saving, and of whom.
    build : callable
        Returns the ways; what it raises, a mistake of a plugin for one, stops no other pair.
    """

    group: str
    method: str
    build: Callable[[], Ways]

    def measured(self, repetitions: int) -> Iterator[Measurement]:
        """Yield time and error of every way; the first counts how many times as fast it is."""
        setting = "any"
        try:
            ways = self.build()
            setting = next(iter(ways.by_name))
            results = {name: way() for name, way in ways.by_name.items()}
            exact = ways.exact() if ways.exact is not None else list(results.values())[-1]
            errors = {name: l2(*np.atleast_1d(found, exact)) for name, found in results.items()}
            seconds = best_of(ways.by_name, repetitions)
        except Exception as error:
            yield Measurement(self.group, self.method, setting, failed=why(error))
            return
        first, *_, last = seconds.values()
        for number, name in enumerate(results):
            row = Measurement(self.group, self.method, name, default=not number)
            counts = {} if number else {"times": last / first}
            yield row.found(seconds[name], {"result": errors[name]}, counts)

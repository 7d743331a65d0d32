"""Alternatives with the same result, one of which omits unnecessary computations."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from wearsim.types import FloatArray
from wearsim_bench.contact.accuracy import l2
from wearsim_bench.contact.worn_profiles import failure_reason
from wearsim_bench.measure.measurement import Measurement
from wearsim_bench.measure.timing import best_of


@dataclass(frozen=True)
class Alternatives:
    """Alternative computations of one result.

    Parameters
    ----------
    by_name : mapping of str to callable
        Functions that return the result, the automatic choice of wearsim first.
    exact : callable, optional
        Returns the reference result; by default that of the last alternative.
    """

    by_name: Mapping[str, Callable[[], FloatArray]]
    exact: Callable[[], FloatArray] | None = None


@dataclass(frozen=True)
class Saving:
    """A saving and its alternatives.

    Parameters
    ----------
    group, method : str
        The saving, and the method to which it applies.
    build : callable
        Returns the alternatives; an error is recorded as a failure of this saving only.
    """

    group: str
    method: str
    build: Callable[[], Alternatives]

    def measured(self, repetitions: int) -> Iterator[Measurement]:
        """Yield time and error of all alternatives; the first has the speed-up."""
        setting = "any"
        try:
            alternatives = self.build()
            setting = next(iter(alternatives.by_name))
            results = {name: compute() for name, compute in alternatives.by_name.items()}
            exact = alternatives.exact() if alternatives.exact else list(results.values())[-1]
            errors = {name: l2(*np.atleast_1d(value, exact)) for name, value in results.items()}
            seconds = best_of(alternatives.by_name, repetitions)
        except Exception as error:
            yield Measurement(self.group, self.method, setting, failed=failure_reason(error))
            return
        first, *_, last = seconds.values()
        for number, name in enumerate(results):
            row = Measurement(self.group, self.method, name, default=not number)
            counts = {} if number else {"times": last / first}
            yield row.with_results(seconds[name], {"result": errors[name]}, counts)

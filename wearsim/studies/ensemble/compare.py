"""Runs and ensembles side by side: how deep each wears, and how surely one wears deeper."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from wearsim.results import EnsembleResult, Result
from wearsim.types import FloatArray, IntArray
from wearsim.uq.estimation.estimates import Design
from wearsim.uq.estimation.intervals import Interval
from wearsim.uq.estimation.mann_whitney import Paired, paired, superiority
from wearsim.uq.sampling.plans import REPLICATES

QUANTILES = (0.05, 0.5, 0.95)
_SAME_LENGTH = 1e-9  # what rounding leaves between the ends of tests of one length
_ERRORS = {"depth": "depth_error", "worn_volume": "volume_error"}

Comparable: TypeAlias = Result | EnsembleResult


@dataclass(frozen=True)
class Compared:
    """One of what is compared.

    Parameters
    ----------
    label : str
        What it is called.
    kind : str
        "run" or "ensemble".
    count : int
        Realisations that are draws by themselves; of Saltelli's plan fewer than were run.
    done, failed, asked : int
        Realisations that ended well, that failed, and that were asked for at most.
    finished : bool
        Whether all that was asked for is done.
    passes, time : float
        Roller passes and simulated time at which it is compared [s].
    value : Interval
        Mean with its confidence interval; of a run its value with its stated error.
    std : Interval, optional
        Standard deviation, of an ensemble.
    quantiles : tuple of (float, Interval)
        Of an ensemble.
    deeper : Interval, optional
        Probability that it has more of the observable than the first, one test against another;
        None for the first.
    paired : Paired, optional
        The same, realisation by realisation, where both have the same random numbers.
    apart : Interval, optional
        Of two runs, how much more this one has than the first, with the stated errors of both.
    values : ndarray, shape (count,)
        Every realisation, rising.
    """

    label: str
    kind: str
    count: int
    done: int
    failed: int
    asked: int
    finished: bool
    passes: float
    time: float
    value: Interval
    std: Interval | None
    quantiles: tuple[tuple[float, Interval], ...]
    deeper: Interval | None
    paired: Paired | None
    apart: Interval | None
    values: FloatArray


@dataclass(frozen=True)
class Comparison:
    """Runs and ensembles side by side.

    Parameters
    ----------
    observable : str
        What is compared at the end of the tests.
    rows : list of Compared
        In the order given.
    """

    observable: str
    rows: list[Compared]

    @property
    def equally_long(self) -> bool:
        """Whether all tests are compared after as many passes and as long a time."""
        ends = np.array([(row.passes, row.time) for row in self.rows])
        return bool(np.allclose(ends, ends[0], rtol=_SAME_LENGTH, atol=0.0))


def compare(
    results: Sequence[Comparable], labels: Sequence[str], observable: str = "depth"
) -> Comparison:
    """Compare runs and ensembles at the ends of their tests.

    Parameters
    ----------
    results : sequence of Result or EnsembleResult
        Two or more.
    labels : sequence of str
        What each is called.
    observable : str
        "depth", "width", "worn_volume", "dissipated_energy" or another that all have.

    Returns
    -------
    Comparison

    Raises
    ------
    ValueError
        If there are fewer than two, one has no realisations, or lacks the observable.
    """
    if len(results) < 2:
        raise ValueError("there must be two or more to compare")
    for label, result in zip(labels, results, strict=True):
        _check(label, result, observable)
    rows = [
        _row(label, result, observable, results[0] if number else None)
        for number, (label, result) in enumerate(zip(labels, results, strict=True))
    ]
    return Comparison(observable, rows)


def observables_of(result: Comparable) -> tuple[str, ...]:
    """Return what can be compared of a run or an ensemble."""
    if isinstance(result, EnsembleResult):
        return result.observables
    return ("depth", "width", "worn_volume", "roller_depth", "dissipated_energy", "power")


def _check(label: str, result: Comparable, observable: str) -> None:
    if observable not in observables_of(result):
        known = ", ".join(observables_of(result))
        raise ValueError(f"{label} has no '{observable}'; it has {known}")
    if isinstance(result, EnsembleResult) and result.count == 0:
        raise ValueError(f"{label} has no realisation that ended well")


def _values(result: Comparable, observable: str) -> tuple[IntArray, FloatArray]:
    """Return numbers and end values of independent tests."""
    if isinstance(result, EnsembleResult):
        return result.independent(observable)
    return np.zeros(1, np.int64), np.array([float(np.max(result.values(observable)[-1]))])


def _row(label: str, result: Comparable, observable: str, first: Comparable | None) -> Compared:
    _, values = _values(result, observable)
    deeper = None if first is None else _deeper(result, first, observable)
    if isinstance(result, Result):
        return Compared(
            label=label,
            kind="run",
            count=1,
            done=1,
            failed=0,
            asked=1,
            finished=result.finished,
            passes=float(result.passes[-1]),
            time=float(result.time[-1]),
            value=_of_run(result, observable),
            std=None,
            quantiles=(),
            deeper=deeper,
            paired=None,
            apart=_apart(result, first, observable) if isinstance(first, Result) else None,
            values=values,
        )
    found = result.estimate(observable, probabilities=QUANTILES)
    return Compared(
        label=label,
        kind="ensemble",
        count=len(values),
        done=result.count,
        failed=result.failed,
        asked=result.asked,
        finished=result.finished,
        passes=float(result.record_passes[-1]),
        time=float(result.record_time[-1]),
        value=found.mean,
        std=found.std,
        quantiles=found.quantiles,
        deeper=deeper,
        paired=_paired(result, first, observable),
        apart=None,
        values=np.sort(values),
    )


def _deeper(result: Comparable, first: Comparable, observable: str) -> Interval:
    """Return the probability that one has more of the observable than the other.

    A run is one test, held against every realisation of an ensemble. Of two runs one has more for
    sure, or it is open where their stated errors overlap.
    """
    if isinstance(result, Result) and isinstance(first, Result):
        apart = _apart(result, first, observable)
        if apart.low <= 0.0 <= apart.high:
            return Interval(0.5, 0.0, 1.0)
        certain = float(apart.value > 0.0)
        return Interval(certain, certain, certain)
    values, others = _values(result, observable)[1], _values(first, observable)[1]
    if isinstance(result, EnsembleResult) and isinstance(first, EnsembleResult):
        return superiority(values, others)
    values, others = np.broadcast_arrays(values, others)
    return paired(values, others).share


def _apart(result: Result, first: Result, observable: str) -> Interval:
    """Return how much more one run has than another, their stated errors added."""
    mine, its = (_of_run(run, observable) for run in (result, first))
    return Interval(mine.value - its.value, mine.low - its.high, mine.high - its.low)


def _paired(result: EnsembleResult, first: Comparable | None, observable: str) -> Paired | None:
    """Return how tests with the same random numbers differ, where there are any."""
    if not isinstance(first, EnsembleResult) or not have_same_draws(result, first):
        return None
    (numbers, values), (others, theirs) = (_values(one, observable) for one in (result, first))
    both, mine, yours = np.intersect1d(numbers, others, assume_unique=True, return_indices=True)
    if len(both) == 0:
        return None
    plan: Design = "sobol" if result.plan == "sobol" else "monte-carlo"
    return paired(values[mine], theirs[yours], plan, both % REPLICATES)


def _of_run(result: Result, observable: str) -> Interval:
    """Return a run's value and what it says of its error; no width where it does not tell."""
    value = float(_values(result, observable)[1][0])
    error = 0.0
    if observable in _ERRORS:
        error = float(np.max(result.values(_ERRORS[observable])[-1]))
    return Interval(value, value - error, value + error)


def have_same_draws(one: EnsembleResult, other: EnsembleResult) -> bool:
    """Tell whether realisation k of two ensembles has the same random numbers."""
    plans = [
        "monte-carlo" if result.plan == "control-variate" else result.plan
        for result in (one, other)
    ]
    keys, groups = (
        [{item[name] for item in getattr(result.raw, kind)} for result in (one, other)]
        for kind, name in (("inputs", "key"), ("groups", "name"))
    )
    # strata depend on the number of realisations, and Saltelli's rows on that of the inputs
    sizes = [one.asked, other.asked] if plans[0] == "latin-hypercube" else [0, 0]
    rows = groups if plans[0] == "saltelli" else [set(), set()]
    same = plans[0] == plans[1] and sizes[0] == sizes[1] and rows[0] == rows[1]
    return same and one.raw.seed == other.raw.seed and bool(keys[0] & keys[1])

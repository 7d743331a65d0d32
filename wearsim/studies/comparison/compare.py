"""Comparison of runs and ensembles at their ends."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias, TypeGuard

import numpy as np

from wearsim.errors import unknown_name
from wearsim.report.text import QUANTILES
from wearsim.results.viewed import Viewed
from wearsim.studies.ensemble.result import EnsembleResult
from wearsim.studies.opening import open_results
from wearsim.studies.run.result import Result
from wearsim.types import FloatArray, IntArray
from wearsim.uq.estimation.intervals import Interval
from wearsim.uq.estimation.mann_whitney import Paired, paired, superiority
from wearsim.uq.sampling.sampler import REPLICATES

_ROUND_OFF = 1e-9  # relative difference of the ends of tests of equal length

Comparable: TypeAlias = Result | EnsembleResult


@dataclass(frozen=True, eq=False)
class Compared:
    """One run or ensemble of a comparison.

    Parameters
    ----------
    label : str
    kind : str
        "run" or "ensemble".
    count : int
        Independent realisations; in Saltelli's plan fewer than were run.
    done, failed, requested : int
        Numbers of realisations: successful, failed, and maximum.
    finished : bool
        Whether the run or ensemble is complete.
    passes, time : float
        Roller passes and simulated time at which it is compared [s].
    value : Interval
        Mean with its confidence interval; for a run its value with its estimated error.
    std : Interval, optional
        Standard deviation of an ensemble.
    quantiles : tuple of (float, Interval)
        Quantiles of an ensemble.
    deeper : Interval, optional
        Probability that a test of it has a greater observable than one of the first; None for the
        first.
    paired : Paired, optional
        Comparison by realisation, if both have the same random numbers.
    difference : Interval, optional
        Difference of two runs, this one minus the first, with the estimated errors of both.
    values : ndarray, shape (count,)
        Values of the realisations, ascending.
    course : ndarray, shape (2, steps), optional
        Roller passes and values of the steps of a run.
    """

    label: str
    kind: str
    count: int
    done: int
    failed: int
    requested: int
    finished: bool
    passes: float
    time: float
    value: Interval
    std: Interval | None
    quantiles: tuple[tuple[float, Interval], ...]
    deeper: Interval | None
    paired: Paired | None
    difference: Interval | None
    values: FloatArray
    course: FloatArray | None = None


@dataclass(frozen=True, eq=False)
class Comparison(Viewed):
    """Comparison of runs and ensembles.

    Parameters
    ----------
    observable : str
        Observable that is compared at the end of the tests.
    rows : list of Compared
        In the order given.
    results : tuple of Result or EnsembleResult
        What was compared.
    """

    observable: str
    rows: list[Compared]
    results: tuple[Comparable, ...] = ()

    def __repr__(self) -> str:
        return f"<Comparison of {self.observable}: {', '.join(row.label for row in self.rows)}>"

    @property
    def equally_long(self) -> bool:
        """Whether all tests are compared at the same passes and time."""
        ends = np.array([(row.passes, row.time) for row in self.rows])
        return bool(np.allclose(ends, ends[0], rtol=_ROUND_OFF, atol=0.0))


def compare(
    results: Sequence[Comparable | str | Path],
    labels: Sequence[str] | None = None,
    observable: str = "depth",
) -> Comparison:
    """Compare runs and ensembles at the ends of their tests.

    Parameters
    ----------
    results : sequence of Result, EnsembleResult or path
        Two or more, or their files.
    labels : sequence of str, optional
        One for each result; by default "1", "2" and so on.
    observable : str
        "depth", "width", "worn_volume", "dissipated_energy" or another that all have.

    Returns
    -------
    Comparison

    Raises
    ------
    UnknownNameError
        If one lacks the observable; it lists the known ones.
    TypeError
        If the results are not a sequence of runs and ensembles.
    ValueError
        If there are fewer than two results, or one has no realisations, or a label is missing.
    ResultsFileError
        If a file cannot be read.

    Examples
    --------
    >>> results = wearsim.sweep("rig.toml", "friction.coefficient", [0.1, 0.2])
    >>> comparison = wearsim.compare(results, ["mild", "severe"])
    >>> print(f"{comparison.rows[1].difference.value * 1e6:.1f} um deeper")
    27.6 um deeper
    """
    if isinstance(results, str) or not isinstance(results, Sequence):
        raise TypeError(f"results must be a list of two or more, got {results!r}")
    tests = [_comparable(item) for item in results]
    if len(tests) < 2:
        raise ValueError("there must be two or more to compare")
    labels = labels or [str(number) for number in range(1, len(tests) + 1)]
    if len(labels) != len(tests):
        raise ValueError(f"{len(tests)} results need as many labels, got {len(labels)}")
    for label, result in zip(labels, tests, strict=True):
        if observable not in observables_of(result):
            raise unknown_name(observable, f"an observable of {label}", observables_of(result))
        if is_ensemble(result) and result.count == 0:
            raise ValueError(f"{label} has no successful realisation")
    rows = [
        _row(label, result, observable, tests[0] if number else None)
        for number, (label, result) in enumerate(zip(labels, tests, strict=True))
    ]
    return Comparison(observable, rows, tuple(tests))


def _comparable(item: Comparable | str | Path) -> Comparable:
    result = open_results(item) if isinstance(item, str | Path) else item
    if isinstance(result, Result | EnsembleResult):
        return result
    raise TypeError(f"only results of wear tests can be compared, got {result!r}")


def is_ensemble(result: object) -> TypeGuard[EnsembleResult]:
    """Return whether a result is an ensemble, not one run."""
    return isinstance(result, EnsembleResult)


def observables_of(result: Comparable) -> tuple[str, ...]:
    """Return the observables of a run or an ensemble that can be compared."""
    if is_ensemble(result):
        return result.observables
    names = (
        *("depth", "width", "worn_volume", "roller_depth", "dissipated_energy", "power"),
        "peak_pressure",
    )
    return (*names, "lift_error") if "lift_error" in getattr(result.raw, "history", ()) else names


def _values(result: Comparable, observable: str) -> tuple[IntArray, FloatArray]:
    """Return numbers and final values of independent tests."""
    if is_ensemble(result):
        return result.independent(observable)
    return np.zeros(1, np.int64), np.array([float(np.max(result.values(observable)[-1]))])


def _row(label: str, result: Comparable, observable: str, first: Comparable | None) -> Compared:
    _, values = _values(result, observable)
    deeper = None if first is None else _deeper(result, first, observable)
    if isinstance(result, Result):
        steps = np.asarray(result.values(observable))
        return Compared(
            label=label,
            kind="run",
            count=1,
            done=1,
            failed=0,
            requested=1,
            finished=result.finished,
            passes=float(result.passes[-1]),
            time=float(result.time[-1]),
            value=_of_run(result, observable),
            std=None,
            quantiles=(),
            deeper=deeper,
            paired=None,
            difference=_difference(result, first, observable)
            if isinstance(first, Result)
            else None,
            values=values,
            course=np.stack([result.passes, steps.reshape(len(steps), -1).max(axis=1)]),
        )
    estimate = result.estimate(observable, probabilities=QUANTILES)
    return Compared(
        label=label,
        kind="ensemble",
        count=len(values),
        done=result.count,
        failed=result.failed,
        requested=result.requested,
        finished=result.finished,
        passes=float(result.record_passes[-1]),
        time=float(result.record_time[-1]),
        value=estimate.mean,
        std=estimate.std,
        quantiles=estimate.quantiles,
        deeper=deeper,
        paired=_paired(result, first, observable),
        difference=None,
        values=np.sort(values),
    )


def _deeper(result: Comparable, first: Comparable, observable: str) -> Interval:
    """Return the probability that one has more of the observable than the other.

    A run is compared with every realisation of an ensemble. Between two runs it is 0 or 1, or
    undetermined where their estimated errors overlap.
    """
    if isinstance(result, Result) and isinstance(first, Result):
        difference = _difference(result, first, observable)
        if difference.low <= 0.0 <= difference.high:
            return Interval(0.5, 0.0, 1.0)
        certain = float(difference.value > 0.0)
        return Interval(certain, certain, certain)
    values, others = _values(result, observable)[1], _values(first, observable)[1]
    if is_ensemble(result) and is_ensemble(first):
        return superiority(values, others)
    values, others = np.broadcast_arrays(values, others)
    return paired(values, others).share


def _difference(result: Result, first: Result, observable: str) -> Interval:
    """Return how much more one run has than another, with the sum of their estimated errors."""
    value, other = (_of_run(run, observable) for run in (result, first))
    return Interval(value.value - other.value, value.low - other.high, value.high - other.low)


def _paired(result: EnsembleResult, first: Comparable | None, observable: str) -> Paired | None:
    """Return the comparison of tests with the same random numbers, where there are any."""
    if not is_ensemble(first) or not have_same_draws(result, first):
        return None
    (numbers, values), (others, firsts) = (_values(tests, observable) for tests in (result, first))
    both, places, places_of_first = np.intersect1d(
        numbers, others, assume_unique=True, return_indices=True
    )
    if len(both) == 0:
        return None
    return paired(
        values[places],
        firsts[places_of_first],
        "sobol" if result.plan == "sobol" else "monte-carlo",
        both % REPLICATES,
    )


def _of_run(result: Result, observable: str) -> Interval:
    """Return a run's value with its estimated error, or with zero width if there is none."""
    value, errors = float(_values(result, observable)[1][0]), result.errors.get(observable)
    error = 0.0 if errors is None else float(np.nan_to_num(np.max(errors[-1])))
    return Interval(value, value - error, value + error)


def have_same_draws(first: EnsembleResult, other: EnsembleResult) -> bool:
    """Return whether realisations of the same number have the same random numbers."""
    plans = [
        "monte-carlo" if result.plan == "control-variate" else result.plan
        for result in (first, other)
    ]
    keys, groups = (
        [{item[name] for item in getattr(result.raw, kind)} for result in (first, other)]
        for kind, name in (("inputs", "key"), ("groups", "name"))
    )
    return (
        plans[0] == plans[1]
        # strata depend on the number of realisations, and Saltelli's rows on that of the inputs
        and (plans[0] != "latin-hypercube" or first.requested == other.requested)
        and (plans[0] != "saltelli" or groups[0] == groups[1])
        and first.raw.seed == other.raw.seed
        and bool(keys[0] & keys[1])
    )

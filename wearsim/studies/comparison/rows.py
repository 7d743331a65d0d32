"""Compared runs and ensembles in words."""

from __future__ import annotations

import math

from wearsim.report.text import (
    OBSERVABLES,
    count,
    part_with_interval,
    shown,
    simulated,
    with_interval,
)
from wearsim.studies.comparison.compare import Compared, Comparison
from wearsim.uq.estimation.intervals import Interval
from wearsim.uq.estimation.mann_whitney import FEWEST, Paired

EQUAL = "equal in all tests"


def realisations(row: Compared) -> str:
    """Return the number of realisations of an ensemble: "7 of 10, 3 failed"."""
    text = count(row.done)
    if row.done < row.requested:
        text += f" of {count(row.requested)}"
        # an ensemble that reached its target, without failures
        text += " at most" if row.finished and row.done + row.failed < row.requested else ""
    text += f", {count(row.failed)} failed" if row.failed else ""
    text += f", {count(row.count)} of them independent" if row.count < row.done else ""
    return text if row.finished else f"{text}, unfinished"


def kind(row: Compared) -> str:
    """Return the kind of a result, "ensemble of 40" or "run"."""
    if row.kind == "run":
        return "run" if row.finished else "run, unfinished"
    return f"ensemble of {realisations(row)}"


def length(row: Compared) -> str:
    """Return the length of the tests, "3,000 passes, 1.000 min"."""
    return f"{count(row.passes)} passes, {simulated(row.time)}"


def against(comparison: Comparison, row: Compared) -> list[tuple[str, str]]:
    """Return the comparison of a result with the first one, as table rows.

    Parameters
    ----------
    comparison : Comparison
    row : Compared
        One of its rows except the first.
    """
    first = comparison.rows[0]
    unit = OBSERVABLES[comparison.observable].unit
    more, less = ("deeper", "shallower") if comparison.observable == "depth" else ("more", "less")
    if row.difference is not None:
        errors = (first.value.half_width, row.value.half_width)
        text = _of_runs(row.difference, errors, unit, more, less)
        return [(f"{row.label} against {first.label}", text)]
    rows = []
    if row.deeper is not None:
        rows.append((f"{row.label} {more} than {first.label}", _of_tests(first, row, row.deeper)))
    if row.paired is not None:
        rows.append(("  with the same draws", _of_pairs(row.paired, unit, more, less)))
    return rows


def _of_runs(
    difference: Interval, errors: tuple[float, float], unit: str, more: str, less: str
) -> str:
    """Return the difference of two runs, with their estimated errors."""
    texts = " and ".join(shown(error, unit, 2) for error in errors)
    stated = f"estimated errors {texts}" if any(errors) else "no error estimate"
    by = difference.value
    if by == 0.0:
        return f"equal ({stated})"
    if difference.low <= 0.0 <= difference.high:
        return f"not significant: difference {shown(abs(by), unit, 3)}, within the {stated}"
    return f"{more if by > 0.0 else less} by {shown(abs(by), unit)} ({stated})"


def _of_tests(first: Compared, row: Compared, deeper: Interval) -> str:
    """Return the probability that a test of one ensemble exceeds a test of the other."""
    low = min(first.values[0], row.values[0])
    high = max(first.values[-1], row.values[-1])
    if low == high and row.count + first.count > 2:
        return EQUAL
    if not math.isfinite(deeper.value):
        return f"too few realisations, {FEWEST} of each are sufficient"
    pairs = "pairs of tests" if row.kind == first.kind else "the tests of the ensemble"
    return f"in {part_with_interval(deeper)} of {pairs}"


def _of_pairs(pairs: Paired, unit: str, more: str, less: str) -> str:
    """Return the difference between tests with the same draws."""
    by = pairs.difference
    if pairs.count == 1:
        amount = f"{more if by.value > 0.0 else less} by {shown(abs(by.value), unit)}"
        return f"{amount if by.value else 'equal'} in the only pair of tests"
    if by.low == by.value == by.high == 0.0:
        return EQUAL
    return f"in {part_with_interval(pairs.share)}, by {with_interval(by, unit)} on average"

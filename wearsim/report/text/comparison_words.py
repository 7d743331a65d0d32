"""Comparison of runs and ensembles as text, for its table and its figure."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from wearsim.report.text.estimates import part_with_interval, with_interval
from wearsim.report.text.labels import OBSERVABLES
from wearsim.report.text.units import count, shown
from wearsim.uq.estimation.mann_whitney import FEWEST

if TYPE_CHECKING:
    from wearsim.studies.ensemble.compare import Compared, Comparison
    from wearsim.uq.estimation.mann_whitney import Paired

EQUAL = "equal in all tests"


def realisations(row: Compared) -> str:
    """Return the number of realisations of an ensemble: "7 of 10, 3 failed"."""
    text = count(row.done)
    if row.done < row.asked:
        text += f" of {count(row.asked)}"
        # an ensemble that reached its target, without failures
        text += " at most" if row.finished and row.done + row.failed < row.asked else ""
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
    return f"{count(row.passes)} passes, {shown(row.time, 'min')}"


def against(found: Comparison, row: Compared) -> list[tuple[str, str]]:
    """Return the comparison of a result with the first one, as table rows.

    Parameters
    ----------
    found : Comparison
    row : Compared
        One of its rows except the first.
    """
    first = found.rows[0]
    unit = OBSERVABLES[found.observable].unit
    more, less = ("deeper", "shallower") if found.observable == "depth" else ("more", "less")
    if row.difference is not None:
        return [(f"{row.label} against {first.label}", _of_runs(first, row, unit, more, less))]
    rows = []
    if row.deeper is not None:
        rows.append((f"{row.label} {more} than {first.label}", _of_tests(first, row)))
    if row.paired is not None:
        rows.append(("  with the same draws", _of_pairs(row.paired, unit, more, less)))
    return rows


def _of_runs(first: Compared, row: Compared, unit: str, more: str, less: str) -> str:
    """Return the difference of two runs, with their estimated errors."""
    assert row.difference is not None
    errors = [item.value.half_width for item in (first, row)]
    texts = " and ".join(shown(error, unit, 2) for error in errors)
    stated = f"estimated errors {texts}" if any(errors) else "no error estimate"
    by = row.difference.value
    if by == 0.0:
        return f"equal ({stated})"
    if row.difference.low <= 0.0 <= row.difference.high:
        return f"not significant: difference {shown(abs(by), unit, 3)}, within the {stated}"
    return f"{more if by > 0.0 else less} by {shown(abs(by), unit)} ({stated})"


def _of_tests(first: Compared, row: Compared) -> str:
    """Return the probability that a test of one ensemble exceeds a test of the other."""
    assert row.deeper is not None
    low = min(first.values[0], row.values[0])
    high = max(first.values[-1], row.values[-1])
    if low == high and row.count + first.count > 2:
        return EQUAL
    if not math.isfinite(row.deeper.value):
        return f"too few realisations, {FEWEST} of each are sufficient"
    pairs = "pairs of tests" if row.kind == first.kind else "the tests of the ensemble"
    return f"in {part_with_interval(row.deeper)} of {pairs}"


def _of_pairs(found: Paired, unit: str, more: str, less: str) -> str:
    """Return the difference between tests with the same draws."""
    by = found.difference
    if found.count == 1:
        if by.value == 0.0:
            return "equal in the only pair of tests"
        word = more if by.value > 0.0 else less
        return f"{word} by {shown(abs(by.value), unit)} in the only pair of tests"
    if by.low == by.value == by.high == 0.0:
        return EQUAL
    return f"in {part_with_interval(found.share)}, by {with_interval(by, unit)} on average"

"""What a comparison of runs and ensembles says in words, for its table and its figure."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from wearsim.report.text.intervals import part_with_interval, with_interval
from wearsim.report.text.labels import OBSERVABLES
from wearsim.report.text.units import count, shown
from wearsim.uq.estimation.mann_whitney import FEWEST

if TYPE_CHECKING:
    from wearsim.studies.ensemble.compare import Compared, Comparison
    from wearsim.uq.estimation.mann_whitney import Paired

SAME = "the same in every test"


def realisations(row: Compared) -> str:
    """Return how many realisations tell it, and of how many: "7 of 10, 3 failed"."""
    text = count(row.done)
    if row.done < row.asked:
        text += f" of {count(row.asked)}"
        # one that its target ended, where none failed
        text += " at most" if row.finished and row.done + row.failed < row.asked else ""
    text += f", {count(row.failed)} failed" if row.failed else ""
    text += f", {count(row.count)} of them independent" if row.count < row.done else ""
    return text if row.finished else f"{text}, unfinished"


def kind(row: Compared) -> str:
    """Return what is compared, "ensemble of 40" or "run"."""
    if row.kind == "run":
        return "run" if row.finished else "run, unfinished"
    return f"ensemble of {realisations(row)}"


def length(row: Compared) -> str:
    """Return after how much of a test it is compared, "3,000 passes, 1.000 min"."""
    return f"{count(row.passes)} passes, {shown(row.time, 'min')}"


def against(found: Comparison, row: Compared) -> list[tuple[str, str]]:
    """Return how one compares with the first, as rows of what and how.

    Parameters
    ----------
    found : Comparison
    row : Compared
        One of its rows, not the first.
    """
    first = found.rows[0]
    unit = OBSERVABLES[found.observable].unit
    more, less = ("deeper", "shallower") if found.observable == "depth" else ("more", "less")
    if row.apart is not None:
        return [(f"{row.label} against {first.label}", _of_runs(first, row, unit, more, less))]
    rows = []
    if row.deeper is not None:
        rows.append((f"{row.label} {more} than {first.label}", _of_tests(first, row)))
    if row.paired is not None:
        rows.append(("  with the same draws", _of_pairs(row.paired, unit, more, less)))
    return rows


def _of_runs(first: Compared, row: Compared, unit: str, more: str, less: str) -> str:
    """Return which of two runs has more, beside what both say of their errors."""
    assert row.apart is not None
    errors = [item.value.half_width for item in (first, row)]
    told = " and ".join(shown(error, unit, 2) for error in errors)
    stated = f"stated errors {told}" if any(errors) else "no error is stated"
    by = row.apart.value
    if by == 0.0:
        return f"the same ({stated})"
    if row.apart.low <= 0.0 <= row.apart.high:
        return f"open: {shown(abs(by), unit, 3)} apart, within the {stated}"
    return f"{more if by > 0.0 else less} by {shown(abs(by), unit)} ({stated})"


def _of_tests(first: Compared, row: Compared) -> str:
    """Return how surely a test of one ensemble has more than one of another."""
    assert row.deeper is not None
    low = min(first.values[0], row.values[0])
    high = max(first.values[-1], row.values[-1])
    if low == high and row.count + first.count > 2:
        return SAME
    if not math.isfinite(row.deeper.value):
        return f"too few realisations to tell, {FEWEST} of each suffice"
    whom = "pairs of tests" if row.kind == first.kind else "the ensemble's tests"
    return f"in {part_with_interval(row.deeper)} of {whom}"


def _of_pairs(found: Paired, unit: str, more: str, less: str) -> str:
    """Return how tests with the same draws differ."""
    by = found.difference
    if found.count == 1:
        if by.value == 0.0:
            return "the same in the one pair of tests"
        word = more if by.value > 0.0 else less
        return f"{word} by {shown(abs(by.value), unit)} in the one pair of tests"
    # nothing apart in any pair: a mean of 0 that is sure
    if by.low == by.value == by.high == 0.0:
        return SAME
    return f"in {part_with_interval(found.share)}, by {with_interval(by, unit)} on average"

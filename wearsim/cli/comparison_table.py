"""Runs and ensembles side by side: a table in engineers' units, or a JSON object in SI."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from wearsim.cli.ensemble_table import INTERVAL, TO_TELL
from wearsim.cli.output import note, write_json, write_list, write_table
from wearsim.report.intervals import cells, part_with_interval, with_interval
from wearsim.report.observables import OBSERVABLES, si_key
from wearsim.report.units import NOTHING, count

if TYPE_CHECKING:
    from wearsim.results import EnsembleResult, Result
    from wearsim.studies.compare import Compared, Comparison


def report_comparison(
    results: Sequence[Result | EnsembleResult],
    labels: Sequence[str],
    observable: str,
    title: str,
    figure: Path | None,
    json: bool,
) -> None:
    """Compare runs and ensembles, draw it, and write it to stdout.

    Parameters
    ----------
    results : sequence of Result or EnsembleResult
        Two or more.
    labels : sequence of str
        What each is called.
    observable : str
        What is compared.
    title : str
        What tells them apart; may be empty.
    figure : Path, optional
        Where to draw it.
    json : bool
        As one JSON object.
    """
    from wearsim.studies.compare import compare

    found = compare(results, labels, observable)
    if figure is not None:
        _draw(found, title, figure)
    if json:
        files = [str(result.path) for result in results]
        write_json({**as_json(found, files), "title": title or None, "figure": figure})
        return
    _write(found, results, title)
    if figure is not None:
        note(f"figure: {figure}")


def _draw(found: Comparison, title: str, path: Path) -> None:
    from wearsim.report.ensemble_comparison import comparison_figure
    from wearsim.report.saving import save_figure

    save_figure(comparison_figure(found, title), path)


def _write(found: Comparison, results: Sequence[Result | EnsembleResult], title: str) -> None:
    named = OBSERVABLES[found.observable]
    what = f"{named.words} at the end" + (f", for values of {title}" if title else "")
    files = [str(result.path) for result in results]
    told = [(row.label, _told(row, file)) for row, file in zip(found.rows, files, strict=True)]
    write_table("", [("compared", what), *told])
    probabilities = [p for p, _ in next((row.quantiles for row in found.rows if row.quantiles), ())]
    heads = ["[" + named.unit + "]", "mean", "std", *(f"{100 * p:g} %" for p in probabilities)]
    write_list(heads, [line for row in found.rows for line in _lines(row, named.unit, len(heads))])
    first = found.rows[0].label
    rows = []
    for row in found.rows[1:]:
        rows += _against(row, first, named.unit, found.observable)
    write_table("", rows)


def _told(row: Compared, file: str) -> str:
    kind = "run" if row.kind == "run" else f"ensemble of {count(row.count)}"
    return f"{kind}, {file}"


def _lines(row: Compared, unit: str, columns: int) -> list[list[str]]:
    """Return the estimates of one of what is compared, and below them their intervals."""
    items = [row.value]
    items += [row.std] if row.std is not None and row.count > 1 else []
    items += [interval for _, interval in row.quantiles] if row.count > 1 else []
    found = [cells(item, unit) for item in items]
    lines = [[row.label, *(value for value, _ in found)]]
    if any(interval for _, interval in found):
        name = "  stated error" if row.kind == "run" else INTERVAL
        lines.append([name, *(interval for _, interval in found)])
    return [
        line + [NOTHING if n == 0 else ""] * (columns - len(line)) for n, line in enumerate(lines)
    ]


def _against(row: Compared, first: str, unit: str, observable: str) -> list[tuple[str, str]]:
    """Return how one compares with the first."""
    word = "deeper" if observable == "depth" else "more"
    rows = []
    if row.deeper is not None:
        known = math.isfinite(row.deeper.value)
        told = f"in {part_with_interval(row.deeper)} of pairs of tests" if known else TO_TELL
        rows.append((f"{row.label} {word} than {first}", told))
    if row.paired is not None:
        share = part_with_interval(row.paired.share)
        apart = with_interval(row.paired.difference, unit)
        rows.append(("  with the same draws", f"in {share}, by {apart} on average"))
    return rows


def as_json(found: Comparison, files: Sequence[str]) -> dict[str, Any]:
    """Return a comparison in SI, the first being what the others are held against."""
    return {
        "observable": si_key(found.observable),
        "compared": [
            {
                "label": row.label,
                "file": file,
                "kind": row.kind,
                "realisations": row.count,
                "value": asdict(row.value),
                "std": asdict(row.std) if row.std is not None else None,
                "quantiles": [{"probability": p, **asdict(found)} for p, found in row.quantiles],
                "probability_of_more_than_first": asdict(row.deeper) if row.deeper else None,
                "paired_with_first": {
                    "share_with_more": asdict(row.paired.share),
                    "mean_difference": asdict(row.paired.difference),
                }
                if row.paired is not None
                else None,
            }
            for row, file in zip(found.rows, files, strict=True)
        ],
    }

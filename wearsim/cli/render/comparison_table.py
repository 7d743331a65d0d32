"""Comparison of runs and ensembles: tables in engineering units, JSON in SI units."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from wearsim.cli.output import note, write_json, write_list, write_notes, write_table
from wearsim.cli.render.ensemble_table import INTERVAL
from wearsim.report.text import NOTHING, OBSERVABLES, against, cells, count, kind, length, si_key

if TYPE_CHECKING:
    from wearsim.results import EnsembleResult, Result
    from wearsim.studies.ensemble.compare import Compared, Comparison


def report_comparison(
    results: Sequence[Result | EnsembleResult],
    labels: Sequence[str],
    observable: str,
    key: str,
    figure: Path | None,
    json: bool,
) -> None:
    """Compare runs and ensembles, draw the figure, and write the comparison to stdout.

    Parameters
    ----------
    results : sequence of Result or EnsembleResult
        Two or more.
    labels : sequence of str
        Labels of the results.
    observable : str
        Quantity to compare.
    key : str
        Scenario key in which the results differ; may be empty.
    figure : Path, optional
        Name of the figure.
    json : bool
        Whether to write JSON instead of tables.
    """
    from wearsim.studies.ensemble.compare import compare

    found = compare(results, labels, observable)
    files = [str(result.path) for result in results]
    suffix = f"for values of {key}" if key else ""
    if figure is not None:
        from wearsim.report.figures.ensemble_comparison import comparison_figure
        from wearsim.report.parts import save_figure

        titles = {result.title for result in results}
        shared = titles.pop() if len(titles) == 1 else ""
        heading = ", ".join(text for text in (shared, suffix) if text)
        save_figure(comparison_figure(found, heading), figure)
    if json:
        write_json({**as_json(found, files), "title": key or None, "figure": figure})
    else:
        _write(found, files, suffix)
        if figure is not None:
            note(f"figure: {figure}")
    write_notes((), _warnings(found))


def _warnings(found: Comparison) -> list[str]:
    """Return warnings of unequal lengths of the tests and of failed realisations."""
    texts = []
    if not found.equally_long:
        ends = "; ".join(f"{row.label}: {length(row)}" for row in found.rows)
        texts.append(f"the tests differ in length ({ends}), which contributes to the differences")
    texts += [
        f"{count(row.failed)} of the {count(row.done + row.failed)} realisations of {row.label}"
        " failed; estimates from the others may be biased"
        for row in found.rows
        if row.failed
    ]
    return texts


def _write(found: Comparison, files: Sequence[str], suffix: str) -> None:
    named = OBSERVABLES[found.observable]
    what = f"{named.words} at the end" + (f", {suffix}" if suffix else "")
    described = [
        (row.label, f"{kind(row)}; {length(row)}; {file}")
        for row, file in zip(found.rows, files, strict=True)
    ]
    write_table("", [("compared", what), *described])
    probabilities = [p for p, _ in next((row.quantiles for row in found.rows if row.quantiles), ())]
    heads = ["[" + named.unit + "]", "mean", "std", *(f"{100 * p:g} %" for p in probabilities)]
    write_list(heads, [line for row in found.rows for line in _lines(row, named.unit, len(heads))])
    write_table("", [line for row in found.rows[1:] for line in against(found, row)])


def _lines(row: Compared, unit: str, columns: int) -> list[list[str]]:
    """Return the estimates of a run or an ensemble, and below them their intervals."""
    items = [row.value]
    if row.count > 1:
        items += [row.std] if row.std is not None else []
        items += [interval for _, interval in row.quantiles]
    values, intervals = zip(*(cells(item, unit) for item in items), strict=True)
    lines = [[row.label, *values, *[NOTHING] * (columns - 1 - len(items))]]
    if any(intervals):
        name = "  error estimate" if row.kind == "run" else INTERVAL
        lines.append([name, *intervals, *[""] * (columns - 1 - len(items))])
    return lines


def as_json(found: Comparison, files: Sequence[str]) -> dict[str, Any]:
    """Return a comparison in SI units; all results are compared with the first."""
    return {
        "observable": si_key(found.observable),
        "same_length": found.equally_long,
        "compared": [
            {
                "label": row.label,
                "file": file,
                "kind": row.kind,
                "realisations": row.count,
                "done": row.done,
                "failed": row.failed,
                "requested": row.requested,
                "finished": row.finished,
                "passes": row.passes,
                "time_s": row.time,
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
                "difference_from_first": asdict(row.difference) if row.difference else None,
            }
            for row, file in zip(found.rows, files, strict=True)
        ],
    }

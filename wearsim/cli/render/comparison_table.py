"""Runs and ensembles side by side: a table in engineers' units, or a JSON object in SI."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from wearsim.cli.output import note, write_json, write_list, write_table
from wearsim.cli.render.ensemble_table import INTERVAL
from wearsim.report.text.comparison_words import against, kind, length
from wearsim.report.text.intervals import cells
from wearsim.report.text.labels import OBSERVABLES, si_key
from wearsim.report.text.units import NOTHING, count

if TYPE_CHECKING:
    from wearsim.results import EnsembleResult, Result
    from wearsim.studies.ensemble.compare import Compared, Comparison


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
    from wearsim.studies.ensemble.compare import compare

    found = compare(results, labels, observable)
    if figure is not None:
        _draw(found, _heading(results, title), figure)
    if json:
        files = [str(result.path) for result in results]
        write_json({**as_json(found, files), "title": title or None, "figure": figure})
    else:
        _write(found, results, title)
        if figure is not None:
            note(f"figure: {figure}")
    for text in _doubts(found):
        note(f"warning: {text}")


def _heading(results: Sequence[Result | EnsembleResult], title: str) -> str:
    """Return what stands above the figure: the tests' title where they share one, and the key."""
    titles = {result.title for result in results}
    shared = titles.pop() if len(titles) == 1 else ""
    return ", ".join([shared] * bool(shared) + [f"for values of {title}"] * bool(title))


def _doubts(found: Comparison) -> list[str]:
    """Return why what is compared may not be alike."""
    texts = []
    if not found.equally_long:
        ends = "; ".join(f"{row.label}: {length(row)}" for row in found.rows)
        texts.append(
            f"the tests are not of the same length ({ends}): what differs at their ends is that too"
        )
    texts += [
        f"{count(row.failed)} of the {count(row.done + row.failed)} realisations of {row.label}"
        " failed: what is told of it is of those that ended well, which may be biased"
        for row in found.rows
        if row.failed
    ]
    return texts


def _draw(found: Comparison, title: str, path: Path) -> None:
    from wearsim.report.figures.ensemble_comparison import comparison_figure
    from wearsim.report.parts.saving import save_figure

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
    write_table("", [line for row in found.rows[1:] for line in against(found, row)])


def _told(row: Compared, file: str) -> str:
    return f"{kind(row)}; {length(row)}; {file}"


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


def as_json(found: Comparison, files: Sequence[str]) -> dict[str, Any]:
    """Return a comparison in SI, the first being what the others are held against."""
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
                "asked": row.asked,
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
                "difference_from_first": asdict(row.apart) if row.apart else None,
            }
            for row, file in zip(found.rows, files, strict=True)
        ],
    }

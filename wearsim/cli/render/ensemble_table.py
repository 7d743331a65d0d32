"""Ensembles and comparisons of them: tables in engineering units, JSON in SI units."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import typer

from wearsim.cli.shared import note, write_json, write_list, write_notes, write_table
from wearsim.report.summary import CONSTANT, Rows, input_data, input_rows, still_random
from wearsim.report.text import (
    NOTHING,
    OBSERVABLES,
    TOO_FEW_REALISATIONS,
    against,
    cells,
    count,
    kind,
    lapse,
    length,
    part_with_interval,
    shown,
    si_key,
    too_few,
)
from wearsim.results import EnsembleResult, Result
from wearsim.results.ensemble.data import Effect
from wearsim.studies.ensemble.compare import Compared, Comparison, compare
from wearsim.uq.estimation.estimates import Estimate, Target

QUANTILES = (0.05, 0.5, 0.95)
_HEADS = ("at the end", "mean", "std", "5 %", "median", "95 %")
INTERVAL = "  95 % interval"


def write_ensemble(result: EnsembleResult, more: Rows, workers: str = "") -> None:
    """Write the estimates of an ensemble to stdout.

    Parameters
    ----------
    result : EnsembleResult
    more : list of (str, str)
        Last rows.
    workers : str
        Workers that were used, if known.
    """
    raw = result.raw
    done = (
        f"{count(result.count)} done, {count(result.failed)} failed, of {count(result.requested)}"
    )
    rows = [
        ("realisations", done if result.finished else f"{done}, unfinished"),
        ("sampling design", f"{raw.plan}, seed {raw.seed}"),
        ("length of a test", f"{count(raw.total_passes)} passes, {shown(raw.total_time, 'min')}"),
        ("contact model", result.described_model),
        ("stepper", f"{raw.stepper}, tolerance {raw.tolerance:g}"),
    ]
    if result.count and result.plan != "monte-carlo":
        rows.append(("95 % intervals", result.estimate("depth", -1, ()).method))
    rows += [("workers", workers)] if workers else []
    write_table(result.title, rows)
    if result.count:
        shown_names = [name for name in result.observables if result.at_end(name).any()]
        write_list(_HEADS, [line for name in shown_names for line in _lines(result, name)])
        _write_effects(result)
    wall, ended = raw.wall_seconds, result.count + result.failed
    effort = lapse(wall)
    if wall and ended:
        effort += f", {shown(ended / wall, '1', 3)} realisations per second"
    write_table("", [*_target_rows(result), *input_rows(result), ("wall time", effort), *more])


def warn_of_failures(result: EnsembleResult) -> None:
    """Write the number of failed realisations and the first error to stderr."""
    if not result.failed:
        return
    first, text = next(iter(result.errors.items()))
    note(
        f"warning: {count(result.failed)} of {count(result.count + result.failed)} realisations"
        f" failed; the first is number {first}: {text}\n"
        "the same draws fail again unless the scenario or the software changes; after a lack of"
        " memory, a killed worker or an updated plugin repeat them with:"
        f" wearsim resume {result.path} --failed"
    )


def _lines(result: EnsembleResult, name: str) -> list[tuple[str, ...]]:
    """Return the estimates of an observable, and below them their intervals."""
    named, found = OBSERVABLES[name], result.estimate(name, -1, QUANTILES)
    if result.is_constant(name) and result.count > 1:
        value, _ = cells(found.mean, named.unit)
        return [(named.label, value, CONSTANT, *[NOTHING] * len(QUANTILES))]
    items = [found.mean, found.std, *(interval for _, interval in found.quantiles)]
    shown_cells = [cells(item, named.unit) for item in items]
    if named.unit == "deg":  # the mean of 359 and 1 deg is not 180 deg
        shown_cells[:2] = [(NOTHING, "")] * 2
    values, intervals = zip(*shown_cells, strict=True)
    if result.count == 1:
        return [(named.label, values[0], *[NOTHING] * (len(items) - 1))]
    return [(named.label, *values), (INTERVAL, *intervals)]


def _write_effects(result: EnsembleResult) -> None:
    """Write the Sobol indices of the depth."""
    head, constant = "Sobol indices of the depth", result.is_constant("depth")
    effects = [] if result.count == 1 or constant else result.sensitivity("depth")
    typer.echo("")
    if not any(math.isfinite(item.first.value) for item in effects):
        equal = result.count > 1 and constant
        why = "none, the depth is equal in all realisations" if equal else too_few(result)
        write_list([f"{head}: {why}"], [])
        return
    totals = any(item.total is not None for item in effects)
    order = sorted(effects, key=lambda item: item.without_effect)
    heads = [head, "first order", *(["total"] if totals else [])]
    write_list(heads, [_effect(result, item, totals) for item in order])


def _effect(result: EnsembleResult, item: Effect, totals: bool) -> list[str]:
    """Return the Sobol indices of a random input as cells."""
    if not math.isfinite(item.first.value):
        return [item.name, too_few(result, [item.name]), *([""] if totals else [])]
    indices = [found for found in (item.first, item.total) if found]
    if item.without_effect:
        bounds = (shown(found.high, "%", 2) for found in indices)
        return [item.name, *(f"not significant, at most {bound}" for bound in bounds)]
    return [item.name, *map(part_with_interval, indices)]


def _target_rows(result: EnsembleResult) -> Rows:
    """Return rows on the target and on the variance removed by a control variate."""
    if not result.count:
        return []
    rows = []
    if result.until:
        rows.append((f"precision {result.until}", _target_met(result, Target.parse(result.until))))
    saved = result.estimate("depth", -1, ()).variance_saved
    if saved is not None:
        text = f"removes {shown(saved, '%', 3)} of the variance of the mean depth"
        if saved < 1.0:
            text += f", equivalent to {count(result.count / (1.0 - saved))} realisations without"
        rows.append(("control variate", text))
    return rows


def _target_met(result: EnsembleResult, target: Target) -> str:
    """Return whether a target is reached, and the half-width of the interval."""
    found = result.estimate_for(target)
    interval, within = target.interval(found), target.achieved(found)
    is_reached, realisations = target.reached(found), f"{count(result.count)} realisations"
    word = "reached" if is_reached else "not reached"
    if not math.isfinite(interval.half_width) or math.isnan(interval.value):
        return f"{word}: {TOO_FEW_REALISATIONS}"
    if interval.half_width == 0.0:
        text = f"{word}: equal in all {realisations}"
    elif math.isinf(within):
        return f"{word}: the estimate is 0, its relative half-width is undefined"
    else:
        text = f"{word}: within {shown(within, '%', 2)} with {realisations}"
    # the interval is narrow by chance in a small sample
    too_small = within <= target.width and not is_reached
    return f"{text}, but the sample is too small" if too_small else text


def ensemble_json(result: EnsembleResult) -> dict[str, Any]:
    """Return the estimates of an ensemble in SI units."""
    raw = result.raw
    is_reached = None
    if result.until:
        target = Target.parse(result.until)
        is_reached = bool(result.count) and bool(target.reached(result.estimate_for(target)))
    return {
        "title": result.title,
        "model": raw.model,
        "stepper": raw.stepper,
        "plan": raw.plan,
        "seed": raw.seed,
        "requested": result.requested,
        "realisations": result.count,
        "failed": result.failed,
        "errors": dict(result.errors.items()),
        "finished": result.finished,
        "until": raw.until or None,
        "until_reached": is_reached,
        "total_passes": raw.total_passes,
        "total_time_s": raw.total_time,
        **{si_key(name): _estimate(result.estimate(name)) for name in result.observables},
        "sensitivity_of_depth": [
            {
                "input": item.name,
                "first_order": asdict(item.first),
                "total": asdict(item.total) if item.total else None,
                "without_effect": bool(item.without_effect),
            }
            for item in (result.sensitivity("depth") if result.count else [])
        ],
        "inputs": input_data(result),
        "random": still_random(result),
        "record_passes": result.record_passes,
        "wall_seconds": raw.wall_seconds,
        "output": str(result.path) if result.path else None,
        "notes": list(result.notes),
        "warnings": list(result.warnings),
    }


def _estimate(found: Estimate) -> dict[str, Any]:
    data = asdict(found)
    data["quantiles"] = [{"probability": p, **asdict(interval)} for p, interval in found.quantiles]
    return data


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
    found = compare(results, labels, observable)
    files = [str(result.path) for result in results]
    suffix = f"for values of {key}" if key else ""
    if figure is not None:
        from wearsim.report.figures.comparison import comparison_figure
        from wearsim.report.parts import save_figure

        titles = {result.title for result in results}
        shared = titles.pop() if len(titles) == 1 else ""
        heading = ", ".join(text for text in (shared, suffix) if text)
        save_figure(comparison_figure(found, heading), figure)
    if json:
        write_json({**comparison_json(found, files), "title": key or None, "figure": figure})
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
    write_list(
        heads, [line for row in found.rows for line in _compared(row, named.unit, len(heads))]
    )
    write_table("", [line for row in found.rows[1:] for line in against(found, row)])


def _compared(row: Compared, unit: str, columns: int) -> list[list[str]]:
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


def comparison_json(found: Comparison, files: Sequence[str]) -> dict[str, Any]:
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

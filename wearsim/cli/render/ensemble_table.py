"""What an ensemble of wear tests tells: tables in engineers' units, or a JSON object in SI."""

from __future__ import annotations

import math
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from wearsim.cli.output import write_list, write_table
from wearsim.cli.render.drawn_inputs import CONSTANT, drawn_data, drawn_rows
from wearsim.cli.render.summary import Rows, still_random
from wearsim.report.text.intervals import cells, part_with_interval
from wearsim.report.text.labels import OBSERVABLES, si_key
from wearsim.report.text.sample_size_advice import TO_TELL, too_few
from wearsim.report.text.units import NOTHING, count, lapse, shown
from wearsim.uq.estimation.stopping_rule import Target

if TYPE_CHECKING:
    from wearsim.results import EnsembleResult
    from wearsim.results.ensemble.result import Effect
    from wearsim.uq.estimation.estimates import Estimate
    from wearsim.uq.estimation.intervals import Interval

QUANTILES = (0.05, 0.5, 0.95)
_HEADS = ("at the end", "mean", "std", "5 %", "median", "95 %")
INTERVAL = "  95 % interval"


def write_ensemble(result: EnsembleResult, more: Rows, workers: str = "") -> None:
    """Write what an ensemble found to stdout.

    Parameters
    ----------
    result : EnsembleResult
    more : list of (str, str)
        Rows to end with.
    workers : str
        Who did the work, where that is known.
    """
    raw = result.raw
    rows = [
        ("realisations", standing(result)),
        ("drawn by", f"{raw.plan}, seed {raw.seed}"),
        ("each", f"{count(raw.total_passes)} passes, {shown(raw.total_time, 'min')}"),
        ("contact model", result.described_model),
        ("stepper", f"{raw.stepper}, tolerance {raw.tolerance:g}"),
    ]
    rows += [("workers", workers)] if workers else []
    write_table(result.title, rows)
    if result.count:
        lines = [line for name in _told(result) for line in _lines(result, name)]
        write_list(_HEADS, lines)
        _write_effects(result)
    drawn = drawn_rows(raw.inputs, result.inputs) if result.count else []
    random = [(f"random {name}", text) for name, text in still_random(result).items()]
    write_table("", [*_reached(result), *drawn, *random, ("wall time", _effort(result)), *more])


def standing(result: EnsembleResult) -> str:
    """Return how many realisations ended well and failed, of how many."""
    text = f"{count(result.count)} done, {count(result.failed)} failed, of {count(result.asked)}"
    return text if result.finished else f"{text}, unfinished"


def _told(result: EnsembleResult) -> list[str]:
    """Return the observables that are more than nothing."""
    return [name for name in result.observables if result.at_end(name).any()]


def _lines(result: EnsembleResult, name: str) -> list[tuple[str, ...]]:
    """Return the estimates of an observable, and below them their intervals."""
    named, found = OBSERVABLES[name], result.estimate(name, -1, QUANTILES)
    if result.is_constant(name) and result.count > 1:
        value, _ = cells(found.mean, named.unit)
        return [(named.label, value, CONSTANT, *[NOTHING] * len(QUANTILES))]
    items = [found.mean, found.std, *(interval for _, interval in found.quantiles)]
    values, intervals = zip(*(cells(item, named.unit) for item in items), strict=True)
    if result.count == 1:
        return [(named.label, values[0], *[NOTHING] * (len(items) - 1))]
    return [(named.label, *values), (INTERVAL, *intervals)]


def _write_effects(result: EnsembleResult) -> None:
    """Write which part of the variance of the depth each random input makes."""
    head, constant = "what moves the depth", result.is_constant("depth")
    effects = [] if result.count == 1 or constant else result.sensitivity("depth")
    print_gap()
    if not any(math.isfinite(item.first.value) for item in effects):
        same = result.count > 1 and constant
        told = "nothing, it is the same in all" if same else too_few(result)
        write_list([f"{head}: {told}"], [])
        return
    totals = any(item.total is not None for item in effects)
    order = sorted(effects, key=lambda item: item.without_effect)
    heads = [head, "by itself", *(["with all others"] if totals else [])]
    write_list(heads, [_effect(result, item, totals) for item in order])


def print_gap() -> None:
    """Write an empty line to stdout."""
    import typer

    typer.echo("")


def _effect(result: EnsembleResult, item: Effect, totals: bool) -> list[str]:
    """Return the parts of the variance that an input makes, as cells."""
    if not math.isfinite(item.first.value):
        return [item.name, too_few(result, [item.name]), *([""] if totals else [])]
    if item.without_effect:
        return [item.name, *(_none_seen(found) for found in (item.first, item.total) if found)]
    return [item.name, *(part_with_interval(found) for found in (item.first, item.total) if found)]


def _none_seen(found: Interval) -> str:
    return f"none seen, at most {shown(found.high, '%', 2)}"


def _reached(result: EnsembleResult) -> Rows:
    """Return whether the target was reached, and what a control variate saved."""
    rows = []
    if result.count and result.until:
        rows.append((f"until {result.until}", _target_met(result, Target.parse(result.until))))
    saved = result.estimate("depth", -1, ()).variance_saved if result.count else None
    if saved is not None:
        worth = f", as good as {count(result.count / (1.0 - saved))} without" if saved < 1.0 else ""
        rows.append(("control variate", f"saves {shown(saved, '%', 3)} of depth's variance{worth}"))
    return rows


def _target_met(result: EnsembleResult, target: Target) -> str:
    """Return whether a target was reached, and how well its estimate is known."""
    found = result.estimate_for(target)
    interval, within = target.interval(found), target.achieved(found)
    is_reached, told = target.reached(found), f"{count(result.count)} realisations"
    word = "reached" if is_reached else "not reached"
    if not math.isfinite(interval.half_width) or math.isnan(interval.value):
        return f"{word}: {TO_TELL}"
    if interval.half_width == 0.0:
        text = f"{word}: it is the same in all {told}"
    elif math.isinf(within):
        return f"{word}: the estimate is 0, of which no interval is a part"
    else:
        text = f"{word}: {told} tell it within {shown(within, '%', 2)}"
    # narrow enough, and yet not taken for it
    by_luck = within <= target.width and not is_reached
    return f"{text}, and so few may agree by luck" if by_luck else text


def _effort(result: EnsembleResult) -> str:
    wall, done = result.raw.wall_seconds, result.count + result.failed
    if not wall or not done:
        return lapse(wall)
    return f"{lapse(wall)}, {shown(done / wall, '1', 3)} realisations a second"


def as_json(result: EnsembleResult) -> dict[str, Any]:
    """Return what an ensemble found, in SI."""
    raw = result.raw
    return {
        "title": result.title,
        "model": raw.model,
        "stepper": raw.stepper,
        "plan": raw.plan,
        "seed": raw.seed,
        "asked": result.asked,
        "realisations": result.count,
        "failed": result.failed,
        "errors": dict(result.errors.items()),
        "finished": result.finished,
        "until": raw.until or None,
        "until_reached": _is_reached(result),
        "total_passes": raw.total_passes,
        "total_time_s": raw.total_time,
        **{si_key(name): _estimate(result.estimate(name)) for name in result.observables},
        "sensitivity_of_depth": [_effect_data(item) for item in result.sensitivity("depth")]
        if result.count
        else [],
        "inputs": drawn_data(raw.inputs, result.inputs) if result.count else {},
        "random": still_random(result),
        "record_passes": result.record_passes,
        "wall_seconds": raw.wall_seconds,
        "output": str(result.path) if result.path else None,
        "notes": list(result.notes),
        "warnings": list(result.warnings),
    }


def _is_reached(result: EnsembleResult) -> bool | None:
    if not result.until:
        return None
    target = Target.parse(result.until)
    return bool(result.count) and bool(target.reached(result.estimate_for(target)))


def _estimate(found: Estimate) -> dict[str, Any]:
    data = asdict(found)
    data["quantiles"] = [{"probability": p, **asdict(interval)} for p, interval in found.quantiles]
    return data


def _effect_data(item: Effect) -> dict[str, Any]:
    return {
        "input": item.name,
        "first_order": asdict(item.first),
        "total": asdict(item.total) if item.total else None,
        "without_effect": bool(item.without_effect),
    }

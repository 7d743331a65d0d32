"""Table of a dissipation study in engineering units."""

from __future__ import annotations

import math

from wearsim.cli.shared import write_list, write_table
from wearsim.report.summary import CONSTANT, QUANTITIES, Rows, input_rows
from wearsim.report.text import NOTHING, count, in_unit, lapse, shown
from wearsim.results import DissipationResult
from wearsim.uq.estimation.intervals import Interval
from wearsim.uq.estimation.moments import Summary, is_constant

_ROUNDING = 1e-12  # rounding errors of forces, relative to the normal force
_TOO_FEW = "too few realisations"


def write_spread(result: DissipationResult, more: Rows) -> None:
    """Write the estimates of a study to stdout.

    Parameters
    ----------
    result : DissipationResult
    more : list of (str, str)
        Last rows.
    """
    raw, done = result.raw, count(result.count)
    words = [raw.plan, f"seed {raw.seed}"]
    standing = (
        [done, *words]
        if result.finished
        else [f"{done} of {count(raw.requested)}", *words, "unfinished"]
    )
    rows = [
        ("realisations", ", ".join(standing)),
        ("contact model", result.described_model),
        ("strips", f"{len(result.y)} of {shown(raw.strip_width, 'um')}"),
    ]
    rows += [("friction sampled on", raw.friction_grid)] if raw.friction_grid else []
    rows += [("inputs at their means", f"{shown(result.mean_problem_power, 'W')} dissipated")]
    write_table(result.title, [*rows, *_power_ranges(result.summaries["power"])])
    heads = ("", "mean", "95 % interval", "std", "95 % interval", "skewness")
    write_list(heads, [_cells(name, result) for name in QUANTITIES])
    effort = f"{lapse(raw.solve_seconds)} for the contacts, {lapse(raw.wall_seconds)} in total"
    write_table("", [*input_rows(result), ("wall time", effort), *more])


def _power_ranges(power: Summary) -> Rows:
    """Return rows on quantile ranges of the power, with the confidence intervals of their ends."""
    if power.count == 1 or power.is_constant:
        equal = "" if power.count == 1 else ", equal in all realisations"
        return [("dissipated power", shown(power.mean, "W") + equal)]
    rows = []
    for low, high in ((0.025, 0.975), (0.05, 0.95)):
        ends = [power.quantile(low), power.quantile(high)]
        values = " to ".join(in_unit(end.value, "W") for end in ends)
        # with the digits of the quantile, so that rounding does not put it outside its interval
        pairs = [(in_unit(end.low, "W"), in_unit(end.high, "W")) for end in ends]
        intervals = [_TOO_FEW if NOTHING in pair else "..".join(pair) for pair in pairs]
        confidence = " and ".join(dict.fromkeys(intervals))
        name = f"dissipated power, {100.0 * (high - low):g} %"
        rows.append((name, f"{values} W (95 % confidence: {confidence})"))
    extremes = f"{in_unit(power.least, 'W')} to {shown(power.greatest, 'W')}"
    return [*rows, ("dissipated power, all", extremes)]


def _cells(name: str, result: DissipationResult) -> tuple[str, ...]:
    """Return mean, standard deviation, their intervals and skewness of a quantity."""
    (words, unit), summary = QUANTITIES[name], result.summaries[name]
    force = float(abs(result.values("normal_force")).max())
    length = result.raw.strip_width * len(result.y)
    scale = {"force_x": force, "force_y": force, "spin_moment": force * length}
    rounding = _ROUNDING * scale.get(name, 0.0)
    mean = 0.0 if abs(summary.mean) <= rounding else summary.mean
    if is_constant(mean, summary.std, rounding):
        return (words, shown(mean, unit), NOTHING, CONSTANT, NOTHING, NOTHING)
    return (
        words,
        shown(mean, unit),
        _ends(summary.mean_interval, unit),
        shown(summary.std, unit),
        _ends(summary.std_interval, unit),
        shown(summary.skewness, "1", 3),
    )


def _ends(interval: Interval, unit: str) -> str:
    """Return the ends of an interval, if the sample suffices for them."""
    ends = [in_unit(end, unit) for end in (interval.low, interval.high)]
    enough = math.isfinite(interval.half_width) and interval.low < interval.high
    return " to ".join(ends) if enough else NOTHING

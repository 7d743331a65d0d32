"""Estimates of a dissipation study: tables in engineering units, JSON in SI units."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from wearsim.cli.output import write_list, write_table
from wearsim.cli.render.summary import CONSTANT, Rows, input_data, input_rows, still_random
from wearsim.report.text import NOTHING, Named, count, in_unit, lapse, shown
from wearsim.uq.estimation.moments import is_constant

if TYPE_CHECKING:
    from wearsim.results import DissipationResult
    from wearsim.uq.estimation.moments import Summary

QUANTITIES = {
    "power": Named("dissipated power", "W"),
    "force_x": Named("longitudinal force", "N"),
    "force_y": Named("lateral force", "N"),
    "spin_moment": Named("spin moment", "N mm"),
    "normal_force": Named("normal force", "N"),
    "peak_pressure": Named("peak pressure", "MPa"),
}
_SI = {"W": "W", "N": "N", "N mm": "N_m", "MPa": "Pa"}
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
    heads = ("", "mean", "standard error", "std", "standard error", "skewness")
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
    """Return mean, standard deviation, their standard errors and skewness of a quantity."""
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
        shown(summary.mean_error, unit, 2),
        shown(summary.std, unit),
        shown(summary.std_error, unit, 2),
        shown(summary.skewness, "1", 3),
    )


def as_json(result: DissipationResult) -> dict[str, Any]:
    """Return the estimates of a study in SI units."""
    raw = result.raw
    return {
        "title": result.title,
        "model": raw.model,
        "plan": raw.plan,
        "seed": raw.seed,
        "realisations": result.count,
        "requested": raw.requested,
        "finished": result.finished,
        "mean_problem_power_W": result.mean_problem_power,
        **{f"{name}_{_SI[named.unit]}": raw.statistics[name] for name, named in QUANTITIES.items()},
        "inputs": input_data(result),
        "random": still_random(result),
        "friction_grid": raw.friction_grid or None,
        "strips": {
            "y_m": result.y,
            "dissipation_mean_W_per_m": result.values("dissipation_mean"),
            "dissipation_std_W_per_m": result.values("dissipation_std"),
            "dissipation_low_W_per_m": result.values("dissipation_low"),
            "dissipation_high_W_per_m": result.values("dissipation_high"),
        },
        "solve_seconds": raw.solve_seconds,
        "wall_seconds": raw.wall_seconds,
        "output": str(result.path) if result.path else None,
        "notes": list(result.notes),
        "warnings": list(result.warnings),
    }

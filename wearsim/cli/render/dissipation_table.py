"""What realisations of one contact tell: tables in engineers' units, or a JSON object in SI."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from wearsim.cli.output import write_list, write_table
from wearsim.cli.render.drawn_inputs import CONSTANT, drawn_data, drawn_rows
from wearsim.cli.render.summary import still_random
from wearsim.report.text.units import NOTHING, count, lapse, shown
from wearsim.uq.estimation.moments import is_constant

if TYPE_CHECKING:
    from wearsim.results import DissipationResult
    from wearsim.uq.estimation.moments import Summary

Rows = list[tuple[str, str]]
UNITS = {
    "power": "W",
    "force_x": "N",
    "force_y": "N",
    "spin_moment": "N mm",
    "normal_force": "N",
    "peak_pressure": "MPa",
}
WORDS = {
    "power": "dissipated power",
    "force_x": "longitudinal force",
    "force_y": "lateral force",
    "spin_moment": "spin moment",
    "normal_force": "normal force",
    "peak_pressure": "peak pressure",
}
_SI = {"W": "W", "N": "N", "N mm": "N_m", "MPa": "Pa"}
_ROUNDING = 1e-12  # of forces, in parts of the load
_TOO_FEW = "too few realisations"


def write_spread(result: DissipationResult, more: Rows) -> None:
    """Write what a study found to stdout.

    Parameters
    ----------
    result : DissipationResult
    more : list of (str, str)
        Rows to end with.
    """
    raw = result.raw
    rows = [
        ("realisations", standing(result)),
        ("contact model", result.described_model),
        ("strips", f"{len(result.y)} of {shown(raw.strip_width, 'um')}"),
    ]
    rows += [("friction taken at", raw.friction_grid)] if raw.friction_grid else []
    rows += [("inputs at their mean", f"{shown(result.mean_problem_power, 'W')} dissipated")]
    write_table(result.title, [*rows, *_power(result.summaries["power"])])
    heads = ("", "mean", "standard error", "std", "standard error", "skewness")
    write_list(heads, [_line(name, result) for name in UNITS])
    effort = f"{lapse(raw.solve_seconds)} for the contacts, {lapse(raw.wall_seconds)} in all"
    random = [(f"random {name}", text) for name, text in still_random(result).items()]
    write_table("", [*drawn_rows(raw.inputs, result.inputs), *random, ("wall time", effort), *more])


def standing(result: DissipationResult) -> str:
    """Return how many realisations are done, and how they were drawn."""
    raw = result.raw
    done = (
        count(result.count) if result.finished else f"{count(result.count)} of {count(raw.asked)}"
    )
    words = [done, raw.plan, f"seed {raw.seed}"]
    return ", ".join(words if result.finished else [*words, "unfinished"])


def _power(power: Summary) -> Rows:
    """Return the ranges of the power, each end with its confidence interval."""
    if power.count == 1 or power.is_constant:
        same = "" if power.count == 1 else ", the same in all realisations"
        return [("power", shown(power.mean, "W") + same)]
    rows = []
    for low, high in ((0.025, 0.975), (0.05, 0.95)):
        ends = [power.quantile(low), power.quantile(high)]
        values = " to ".join(shown(end.value, "W").removesuffix(" W") for end in ends)
        sure = _confidence([_interval(end.low, end.high) for end in ends])
        name = f"power, {100 * low:g} to {100 * high:g} %"
        rows.append((name, f"{values} W (95 % confidence: {sure})"))
    least, greatest = shown(power.least, "W").removesuffix(" W"), shown(power.greatest, "W")
    return [*rows, ("power, least to greatest", f"{least} to {greatest}")]


def _interval(low: float, high: float) -> str:
    # with the digits of the estimate, or it could seem to lie outside
    ends = [shown(value, "W").removesuffix(" W") for value in (low, high)]
    return _TOO_FEW if NOTHING in ends else " to ".join(ends)


def _confidence(intervals: list[str]) -> str:
    return intervals[0] if len(set(intervals)) == 1 else " and ".join(intervals)


def _rounding(name: str, result: DissipationResult) -> float:
    """Return what rounding leaves of a force or a moment that is zero, in SI."""
    load = float(abs(result.values("normal_force")).max())
    length = result.raw.strip_width * len(result.y)
    scale = {"force_x": load, "force_y": load, "spin_moment": load * length}
    return _ROUNDING * scale.get(name, 0.0)


def _line(name: str, result: DissipationResult) -> tuple[str, ...]:
    unit, summary = UNITS[name], result.summaries[name]
    rounding = _rounding(name, result)
    mean = 0.0 if abs(summary.mean) <= rounding else summary.mean
    if is_constant(mean, summary.std, rounding):
        return (WORDS[name], shown(mean, unit), NOTHING, CONSTANT, NOTHING, NOTHING)
    errors = (shown(value, unit, 2) for value in (summary.mean_error, summary.std_error))
    mean_error, std_error = errors
    return (
        WORDS[name],
        shown(mean, unit),
        mean_error,
        shown(summary.std, unit),
        std_error,
        shown(summary.skewness, "1", 3),
    )


def as_json(result: DissipationResult) -> dict[str, Any]:
    """Return what a study found, in SI."""
    raw = result.raw
    found = {f"{name}_{_SI[unit]}": raw.statistics[name] for name, unit in UNITS.items()}
    return {
        "title": result.title,
        "model": raw.model,
        "plan": raw.plan,
        "seed": raw.seed,
        "realisations": result.count,
        "asked": raw.asked,
        "finished": result.finished,
        "mean_problem_power_W": result.mean_problem_power,
        **found,
        "inputs": drawn_data(raw.inputs, result.inputs),
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

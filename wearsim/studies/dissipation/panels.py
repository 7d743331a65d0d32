"""Panels of a dissipation study: convergence, density, and dissipated power per length."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from wearsim.levelling import Measured
from wearsim.report.panels import (
    BLACK,
    GREEN,
    GREY,
    HEADROOM,
    ORANGE,
    Axis,
    Band,
    Line,
    Panel,
    Sheet,
    Span,
    convergence,
    histogram,
    message,
    worn_limits,
)
from wearsim.report.text import count, in_unit, number_of_realisations, shown
from wearsim.studies.dissipation.result import DissipationResult

MOST_LINES = 200
CLASSES = 30
_EQUAL = 1e-9  # relative difference of curves that are drawn as one
_POWER, _PER_LENGTH = Axis("$P_d$", "W"), Axis("$P_l$", "W/mm", limits=(0.0, None))
_LABELS = (
    ("mean", "Mean dissipated power, with standard error"),
    (
        "std",
        "Standard deviation, with standard error",
    ),
)


def dissipation_sheet(result: DissipationResult, measured: Sequence[Measured] = ()) -> Sheet:
    """Return convergence of mean and deviation, density of the power, and power per length."""
    course, constant = result.convergence(), result.summaries["power"].is_constant
    panels = {"density": _density(result)}
    panels |= {"band": _band(result), "realisations": _realisations(result)}
    for name, title in _LABELS:
        value, error = getattr(course, name), getattr(course, f"{name}_error")
        if constant:  # a constant power has rounding errors only
            error = np.zeros_like(error)
            value = np.zeros_like(value) if name == "std" else value
        panels[name] = convergence(
            title, f"{name} of $P_d$", "W", course.count, value, value - error, value + error
        )
    return Sheet(
        f"{result.title}\n{_caption(result)}",
        panels,
        [["mean", "density", "realisations"], ["std", "density", "band"]],
        (13.0, 6.8),
        widths=[1.0, 1.15, 1.1],
    )


def _caption(result: DissipationResult) -> str:
    power, raw = result.summaries["power"], result.raw
    text = (
        f"{number_of_realisations(result.count)} ({raw.plan}, {result.described_model}"
        f"{'' if result.finished else ', unfinished'})\n"
        f"mean dissipated power {shown(power.mean, 'W')}"
    )
    if result.count == 1:
        return text
    if power.is_constant:
        return f"{text}, equal in all realisations"
    band = " to ".join(in_unit(power.quantile(p).value, "W", 3) for p in (0.025, 0.975))
    return f"{text}, std {shown(power.std, 'W')}, 95 % range {band} W"


def _density(result: DissipationResult) -> Panel:
    power, summary, title = result.power, result.summaries["power"], "Density of dissipated power"
    at_means = f"inputs at their means: {shown(result.mean_problem_power, 'W')}"
    if result.count == 1 or summary.is_constant:
        value, number = shown(summary.mean, "W"), number_of_realisations(result.count)
        return message(title, f"{value} in {number}: no density to draw", at_means)
    bars, edges = histogram(power, CLASSES)
    margin = 0.05 * (edges[-1] - edges[0])
    low, high = max(edges[0] - margin, 0.0), edges[-1] + margin  # the power is not negative
    across = np.linspace(low, high, 400)
    score = (across - summary.mean) / summary.std
    normal = np.exp(-0.5 * score**2) / (summary.std * math.sqrt(math.tau))
    label = "normal distribution, same mean and std"
    marks = [bars, Line(across, normal, colour=ORANGE, label=label)]
    reach = 1.0 / (1.0 + HEADROOM)
    for place, colour, style, label in (
        (summary.mean, BLACK, "-", f"mean: {shown(summary.mean, 'W')}"),
        (result.mean_problem_power, GREEN, "--", at_means),
        (summary.quantile(0.025).value, GREY, ":", "2.5 % and 97.5 % quantile"),
        (summary.quantile(0.975).value, GREY, ":", ""),
    ):
        marks.append(Span(place, colour=colour, dash=style, label=label, reach=reach))
    ends = f"from {shown(float(power.min()), 'W')} to {shown(float(power.max()), 'W')}"
    return Panel(
        title,
        Axis("$P_d$", "W", limits=(low, high)),
        Axis("probability density", "1/W", 1.0, limits=(0.0, None), margin=(0.0, HEADROOM)),
        marks,
        f"{count(len(power))} realisations, {ends}.",
        legend="upper right",
    )


def _realisations(result: DissipationResult) -> Panel:
    kept = result.dissipation
    rows = kept[:MOST_LINES]
    title = number_of_realisations(len(rows))
    if len(kept) > 1 and float(np.ptp(kept, axis=0).max()) <= _EQUAL * float(kept.max()):
        rows, title = rows[:1], "equal in all"
    opacity = float(np.clip(15.0 / len(rows), 0.12, 1.0))
    return Panel(
        f"Dissipated power per length, {title}",
        _across(result),
        _PER_LENGTH,
        [Line(result.y, rows, width=0.6, alpha=opacity)],
        "Dissipated power across the track in single realisations.",
    )


def _across(result: DissipationResult) -> Axis:
    return Axis("y", "mm", limits=worn_limits(result.y, result.values("dissipation_high")))


def _band(result: DissipationResult) -> Panel:
    names = ("dissipation_low", "dissipation_high", "dissipation_mean", "mean_problem_dissipation")
    low, high, mean, at_means = (result.values(name) for name in names)
    return Panel(
        "Mean and 95 % range",
        _across(result),
        Axis("$P_l$", "W/mm", limits=(0.0, None), margin=(0.0, HEADROOM)),
        [
            Band(result.y, low, high, label="2.5 to 97.5 %"),
            Line(result.y, mean, colour=BLACK, label="mean"),
            Line(result.y, at_means, colour=GREEN, dash="--", label="inputs at their means"),
        ],
        "Dissipated power per length: mean over the realisations and their 95 % band.",
        legend="upper center",
        columns=3,
    )

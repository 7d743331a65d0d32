"""The figure of realisations of one contact: how estimates settle, the power and P_l(y)."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from wearsim.report.parts.convergence import draw_settling
from wearsim.report.parts.style import BLUE, GREEN, GREY, ORANGE, figure_style, name_axes, say
from wearsim.report.text.units import PER_SI, count, shown

if TYPE_CHECKING:
    from wearsim.results import DissipationResult

MM, W_MM = PER_SI["mm"], PER_SI["W/mm"]
MOST_LINES = 200
CLASSES = 30
_ROOM = 1.28  # height of the density's panel over its highest class, for the legend
_SAME = 1e-9  # of the greatest, by which curves differ that are drawn as one
PANELS: list[Any] = [["mean", "density", "realisations"], ["std", "density", "band"]]


def dissipation_figure(result: DissipationResult) -> Figure:
    """Return the figure of a study of one contact's dissipation.

    Parameters
    ----------
    result : DissipationResult

    Returns
    -------
    Figure
        Five panels: mean and standard deviation against the number of realisations, density of the
        power, its distribution across the track by realisation, and their mean and 95 % band.
    """
    with figure_style():
        figure = Figure(figsize=(13.0, 6.8), layout="constrained")
        panels = figure.subplot_mosaic(PANELS, width_ratios=[1.0, 1.15, 1.1])
        found, constant = result.convergence(), result.summaries["power"].is_constant
        # or rounding would be drawn
        spreads = found.mean_error, found.std, found.std_error
        mean_error, std, std_error = (np.zeros_like(e) if constant else e for e in spreads)
        for name, value, error in (("mean", found.mean, mean_error), ("std", std, std_error)):
            draw_settling(panels[name], found.count, value, value - error, value + error)
        name_axes(panels["mean"], "Mean power, with its standard error", "", "mean of $P_d$ [W]")
        title = "Standard deviation, with its standard error"
        name_axes(panels["std"], title, "realisations", "std of $P_d$ [W]")
        _draw_density(panels["density"], result)
        _draw_realisations(panels["realisations"], result)
        _draw_band(panels["band"], result)
        figure.suptitle(f"{result.title}\n{_caption(result)}", fontsize=10.5)
    return figure


def _caption(result: DissipationResult) -> str:
    power, raw = result.summaries["power"], result.raw
    text = f"{_number_of(result.count)} ({raw.plan}, {result.described_model}"
    text += f"{'' if result.finished else ', unfinished'}): mean {shown(power.mean, 'W')}"
    if result.count == 1:
        return text
    if power.is_constant:
        return f"{text}, the same in all"
    ends = [power.quantile(0.025).value, power.quantile(0.975).value]
    band = " to ".join(shown(value, "W", 3).removesuffix(" W") for value in ends)
    return f"{text}, std {shown(power.std, 'W')}, 95 % within {band} W"


def _number_of(realisations: int) -> str:
    return f"{count(realisations)} realisation{'s' if realisations > 1 else ''}"


def _draw_density(axes: Axes, result: DissipationResult) -> None:
    power, summary = result.power, result.summaries["power"]
    if result.count == 1 or summary.is_constant:
        _tell_one_value(axes, result)
        return
    axes.hist(power, CLASSES, density=True, color=BLUE, alpha=0.45, label="realisations")
    low, high = axes.get_xlim()
    across = np.linspace(max(low, 0.0), high, 400)  # no power is below zero
    score = (across - summary.mean) / summary.std
    normal = np.exp(-0.5 * score**2) / (summary.std * math.sqrt(math.tau))
    axes.plot(across, normal, color=ORANGE, label="normal law of the same mean and std")
    axes.set_xlim(max(low, 0.0), high)
    alone = result.mean_problem_power
    ends = [summary.quantile(probability).value for probability in (0.025, 0.975)]
    marks = [
        (summary.mean, "black", "-", f"mean {shown(summary.mean, 'W')}"),
        (alone, GREEN, "--", f"inputs at their mean {shown(alone, 'W')}"),
        (ends[0], GREY, ":", "2.5 and 97.5 %"),
        (ends[1], GREY, ":", None),
    ]
    for place, colour, style, label in marks:
        axes.axvline(place, 0.0, 1.0 / _ROOM, color=colour, ls=style, lw=1.0, label=label)
    name_axes(axes, "Density of the dissipated power", "$P_d$ [W]", "density [1/W]")
    axes.set_ylim(top=_ROOM * axes.get_ylim()[1])
    axes.legend(loc="upper right")


def _tell_one_value(axes: Axes, result: DissipationResult) -> None:
    """Say what the power is where it has no density."""
    power = shown(result.summaries["power"].mean, "W")
    lines = [f"{power} in {_number_of(result.count)}: no density to draw"]
    lines.append(f"inputs at their mean: {shown(result.mean_problem_power, 'W')}")
    say(axes, "Density of the dissipated power", lines)


def _draw_realisations(axes: Axes, result: DissipationResult) -> None:
    kept, y = result.dissipation, result.y * MM
    rows = kept[:MOST_LINES]
    title = _number_of(len(rows))
    if len(kept) > 1 and float(np.ptp(kept, axis=0).max()) <= _SAME * float(kept.max()):
        rows, title = rows[:1], "the same in all"
    opacity = float(np.clip(15.0 / len(rows), 0.12, 1.0))
    axes.plot(y, rows.T * W_MM, color=BLUE, lw=0.6, alpha=opacity)
    name_axes(axes, f"Power per axial length, {title}", "", r"$P_l$ [W/mm]")
    axes.set_ylim(bottom=0.0)
    axes.margins(x=0.0)


def _draw_band(axes: Axes, result: DissipationResult) -> None:
    y = result.y * MM
    low, high, mean, alone = (
        result.values(name) * W_MM
        for name in (
            "dissipation_low",
            "dissipation_high",
            "dissipation_mean",
            "mean_problem_dissipation",
        )
    )
    axes.fill_between(y, low, high, color=BLUE, alpha=0.25, lw=0, label="2.5 to 97.5 %")
    axes.plot(y, mean, color="black", label="mean")
    axes.plot(y, alone, color=GREEN, ls="--", label="inputs at their mean")
    name_axes(axes, "Its mean and 95 % band", "y [mm]", r"$P_l$ [W/mm]")
    axes.set_ylim(bottom=0.0)
    axes.margins(x=0.0)
    axes.set_ylim(top=1.3 * axes.get_ylim()[1])
    axes.legend(loc="upper center", ncols=3)

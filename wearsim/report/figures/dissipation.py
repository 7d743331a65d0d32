"""Figure of a dissipation study: convergence, distribution of the power, power per length."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from wearsim.report.parts import (
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    draw_convergence,
    name_axes,
    titled_figure,
    write_message,
)
from wearsim.report.text import PER_SI, in_unit, number_of_realisations, shown
from wearsim.results import DissipationResult

MM, W_MM = PER_SI["mm"], PER_SI["W/mm"]
MOST_LINES = 200
CLASSES = 30
_HEADROOM = 1.28  # height of the density's panel relative to its highest class, for the legend
_EQUAL = 1e-9  # relative difference of curves that are drawn as one
PANELS: list[Any] = [["mean", "density", "realisations"], ["std", "density", "band"]]


def dissipation_figure(result: DissipationResult) -> Figure:
    """Return the figure of a dissipation study.

    Parameters
    ----------
    result : DissipationResult

    Returns
    -------
    Figure
        Five panels: mean and standard deviation against the number of realisations, density of the
        dissipated power, and dissipated power per length: realisations, and mean with 95 % range.
    """
    with titled_figure(13.0, 6.8, f"{result.title}\n{_caption(result)}") as figure:
        panels = figure.subplot_mosaic(PANELS, width_ratios=[1.0, 1.15, 1.1])
        found, constant = result.convergence(), result.summaries["power"].is_constant
        # a constant power has rounding errors only
        spreads = found.mean_error, found.std, found.std_error
        mean_error, std, std_error = (np.zeros_like(e) if constant else e for e in spreads)
        for name, value, error in (("mean", found.mean, mean_error), ("std", std, std_error)):
            draw_convergence(panels[name], found.count, value, value - error, value + error)
        name_axes(
            panels["mean"], "Mean dissipated power, with standard error", "", "mean of $P_d$ [W]"
        )
        name_axes(
            panels["std"],
            "Standard deviation, with standard error",
            "realisations",
            "std of $P_d$ [W]",
        )
        _draw_density(panels["density"], result)
        _draw_realisations(panels["realisations"], result)
        _draw_band(panels["band"], result)
    return figure


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


def _draw_density(axes: Axes, result: DissipationResult) -> None:
    power, summary, title = result.power, result.summaries["power"], "Density of dissipated power"
    at_means = f"inputs at their means: {shown(result.mean_problem_power, 'W')}"
    if result.count == 1 or summary.is_constant:
        value, number = shown(summary.mean, "W"), number_of_realisations(result.count)
        write_message(axes, title, [f"{value} in {number}: no density to draw", at_means])
        return
    axes.hist(power, CLASSES, density=True, color=BLUE, alpha=0.45, label="realisations")
    low, high = axes.get_xlim()
    across = np.linspace(max(low, 0.0), high, 400)  # the power is not negative
    score = (across - summary.mean) / summary.std
    normal = np.exp(-0.5 * score**2) / (summary.std * math.sqrt(math.tau))
    axes.plot(across, normal, color=ORANGE, label="normal distribution, same mean and std")
    axes.set_xlim(max(low, 0.0), high)
    for place, colour, style, label in (
        (summary.mean, "black", "-", f"mean: {shown(summary.mean, 'W')}"),
        (result.mean_problem_power, GREEN, "--", at_means),
        (summary.quantile(0.025).value, GREY, ":", "2.5 % and 97.5 % quantile"),
        (summary.quantile(0.975).value, GREY, ":", None),
    ):
        axes.axvline(place, 0.0, 1.0 / _HEADROOM, color=colour, ls=style, lw=1.0, label=label)
    name_axes(axes, title, "$P_d$ [W]", "probability density [1/W]")
    axes.set_ylim(top=_HEADROOM * axes.get_ylim()[1])
    axes.legend(loc="upper right")


def _draw_realisations(axes: Axes, result: DissipationResult) -> None:
    kept, y = result.dissipation, result.y * MM
    rows = kept[:MOST_LINES]
    title = number_of_realisations(len(rows))
    if len(kept) > 1 and float(np.ptp(kept, axis=0).max()) <= _EQUAL * float(kept.max()):
        rows, title = rows[:1], "equal in all"
    opacity = float(np.clip(15.0 / len(rows), 0.12, 1.0))
    axes.plot(y, rows.T * W_MM, color=BLUE, lw=0.6, alpha=opacity)
    name_axes(axes, f"Dissipated power per length, {title}", "", r"$P_l$ [W/mm]")
    axes.set_ylim(bottom=0.0)
    axes.margins(x=0.0)


def _draw_band(axes: Axes, result: DissipationResult) -> None:
    y = result.y * MM
    names = ("dissipation_low", "dissipation_high", "dissipation_mean", "mean_problem_dissipation")
    low, high, mean, at_means = (result.values(name) * W_MM for name in names)
    axes.fill_between(y, low, high, color=BLUE, alpha=0.25, lw=0, label="2.5 to 97.5 %")
    axes.plot(y, mean, color="black", label="mean")
    axes.plot(y, at_means, color=GREEN, ls="--", label="inputs at their means")
    name_axes(axes, "Mean and 95 % range", "y [mm]", r"$P_l$ [W/mm]")
    axes.set_ylim(0.0, 1.3 * axes.get_ylim()[1])
    axes.margins(x=0.0)
    axes.legend(loc="upper center", ncols=3, columnspacing=1.0)

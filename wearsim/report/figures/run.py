"""Figure of a run: profiles, depth, dissipated power and normal force."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LogNorm, Normalize
from matplotlib.figure import Figure

from wearsim.errors import WearsimError
from wearsim.report.measured import Measured
from wearsim.report.parts import (
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    RECORDS,
    RED,
    draw_measured,
    evenly_spaced,
    name_axes,
    set_depth_axes,
    titled_figure,
)
from wearsim.report.summary import width_of
from wearsim.report.text import PER_SI, count, pass_unit, shown, simulated
from wearsim.results import Result
from wearsim.types import FloatArray

UM, MM, MIN, W_MM = PER_SI["um"], PER_SI["mm"], PER_SI["min"], PER_SI["W/mm"]
MOST_RECORDS = 24
ROLLERS = (BLUE, ORANGE, GREEN, RED)
STYLES = ("-", "--", ":", "-.")


def run_figure(result: Result, measured: Sequence[Measured] = ()) -> Figure:
    """Return the figure of a run.

    Parameters
    ----------
    result : Result
    measured : sequence of Measured
        Profiles drawn over the computed ones.

    Returns
    -------
    Figure
        Four panels: profiles and dissipated power per length at records, depth against roller
        passes, normal force against time.
    """
    with titled_figure(11.0, 7.6, f"{result.title}\n{caption(result)}") as figure:
        panels = figure.subplot_mosaic(
            [["profiles", "depth"], ["dissipation", "load"]], width_ratios=[1.15, 1.0]
        )
        colours = Colours(result.record_passes)
        _draw_profiles(panels["profiles"], result, colours, measured)
        _draw_dissipation(panels["dissipation"], result, colours)
        extent = _extent(result, [profile.y for profile in measured])
        for name in ("profiles", "dissipation"):
            panels[name].set_xlim(*extent)
        colours.draw_bar(figure, [panels["profiles"], panels["dissipation"]])
        draw_depth(panels["depth"], result)
        _draw_normal_force(panels["load"], result)
    return figure


def caption(result: Result) -> str:
    """Return passes, time, model, depth and width of a run in words."""
    depth = f"depth {shown(float(np.max(result.depth[-1])), 'um')}"
    if result.start_height.any():
        below = shown(float(np.max(result.depth_below_nominal[-1])), "um")
        depth = f"{depth} worn since the start, depth below nominal {below}"
    unfinished = "" if result.finished else ", failed" if result.failure else ", unfinished"
    if result.until:
        unfinished = f", stopped at {result.until}"
    return (
        f"{count(float(result.passes[-1]))} roller passes in"
        f" {simulated(float(result.time[-1]))}"
        f" ({result.described_model}, {result.stepper}{unfinished})\n"
        f"{depth}, width {width_of(result, np.max(result.width[-1]))}"
    )


def draw_worn_profiles(axes: Axes, result: Result) -> None:
    """Draw the profiles of the cylinder at the records, from black at the start to the end."""
    _draw_profiles(axes, result, Colours(result.record_passes), ())
    axes.set_xlim(*_extent(result, []))


class Colours:
    """Drawn records and their colours, by roller passes; the start of the run is black."""

    def __init__(self, passes: FloatArray) -> None:
        self.records = evenly_spaced(len(passes), MOST_RECORDS)
        worn = passes[passes > 0.0]
        last = float(worn[-1]) if len(worn) else 1.0
        crowded = len(worn) > 2 and float(np.median(worn)) < 0.15 * last
        unit, self.name = (1.0, "roller passes") if crowded else pass_unit(last)
        self._passes = passes / unit
        self._norm = LogNorm(float(worn[0]), last) if crowded else Normalize(0.0, last / unit)
        self._map = colormaps[RECORDS].reversed()

    def of(self, record: int) -> tuple[float, float, float, float] | str:
        """Return the colour of a record."""
        passes = float(self._passes[record])
        return self._map(self._norm(passes)) if passes > 0.0 else "black"

    def draw_bar(self, figure: Figure, panels: list[Axes]) -> None:
        """Draw the scale of the colours next to panels."""
        mapped = ScalarMappable(self._norm, self._map)
        figure.colorbar(mapped, ax=panels, label=self.name, aspect=45, pad=0.02)


def _draw_profiles(
    axes: Axes, result: Result, colours: Colours, measured: Sequence[Measured]
) -> None:
    y = result.y * MM
    worn = np.asarray(result.profiles)
    for record in colours.records:
        axes.plot(y, (result.start_height - worn[record]) * UM, color=colours.of(record), lw=1.1)
    rollers = np.atleast_2d(np.asarray(result.roller_profiles)[-1])
    for number, roller in enumerate(rollers):
        if roller.max() > 0.0:
            label = "roller" if len(rollers) == 1 else f"roller {number + 1}"
            axes.plot(
                y, -roller * UM, color="black", ls=(0, (4 + 2 * number, 2)), lw=1.0,
                label=f"{label}, at the end",
            )  # fmt: skip
    draw_measured(axes, measured)
    name_axes(
        axes,
        "Worn profile of the cylinder (black: start of the run)",
        "y [mm]",
        "height above nominal [um]",
    )
    if axes.get_legend_handles_labels()[0]:
        axes.legend(loc="lower right")


def _extent(result: Result, others: Sequence[FloatArray]) -> tuple[float, float]:
    """Return the range of y with dissipated power, with a margin, that includes `others` [mm]."""
    power = np.asarray(result.dissipation).reshape(-1, len(result.y)).max(axis=0)
    loaded = result.y[power > 1e-3 * power.max()] if power.max() > 0.0 else result.y
    first, last = float(loaded[0]), float(loaded[-1])
    margin = 0.08 * (last - first)
    ends = [first - margin, last + margin, *(float(e) for o in others for e in (o.min(), o.max()))]
    return min(ends) * MM, max(ends) * MM


def draw_depth(axes: Axes, result: Result) -> None:
    """Draw the depth against the roller passes, with its estimated error."""
    drawn, unit, name = set_depth_axes(axes, result.passes, result.depth)
    passes, depth, error = (
        values[drawn] for values in (result.passes, result.depth, result.depth_error)
    )
    visible = bool((error > 0.05 * depth).any())
    estimate = f"estimated error {shown(float(error[-1]), 'um', 2)} at the end"
    if visible:
        low = depth - error
        if axes.get_yscale() == "log":
            low = np.maximum(low, 0.05 * depth)
        band = (low * UM, (depth + error) * UM)
        axes.fill_between(passes / unit, *band, color=ORANGE, alpha=0.35, lw=0, label=estimate)
    if result.stepper == "per-pass":
        style, label, estimate = "-", "depth", "no stepping error: every roller pass is solved"
    elif len(passes) <= 80:
        style, label = "-o", "depth, one dot per step"
    else:
        style, label = "-", "depth"
    label += "" if visible else f"\n({estimate})"
    axes.plot(passes / unit, depth * UM, style, color=BLUE, ms=2.6, label=label)
    title = "Depth worn since the start" if result.start_height.any() else "Depth"
    name_axes(axes, title, name, f"{title.lower()} [um]")
    axes.legend(loc="upper left")


def _draw_dissipation(axes: Axes, result: Result, colours: Colours) -> None:
    y = result.y * MM
    power = np.asarray(result.dissipation) * W_MM
    power = power if power.ndim == 3 else power[:, None]  # (record, roller, strip)
    styles = [STYLES[roller % len(STYLES)] for roller in range(power.shape[1])]
    most = 10 if len(styles) == 1 else 5
    for record in colours.records[evenly_spaced(len(colours.records), most)]:
        for line, style in zip(power[record], styles, strict=True):
            axes.plot(y, line, style, color=colours.of(record), lw=1.1)
    if len(styles) > 1:
        for number, style in enumerate(styles, 1):
            axes.plot([], [], style, color="black", label=f"roller {number}")
        axes.legend(loc="upper right")
    name_axes(
        axes,
        "Dissipated power per length (black: start of the run)",
        "y [mm]",
        r"$P_l$ [W/mm]",
    )
    axes.set_ylim(bottom=0.0)


def _draw_normal_force(axes: Axes, result: Result) -> None:
    force = np.asarray(result.normal_force)
    force = force if force.ndim == 2 else force[:, None]
    if np.ptp(force, axis=1).max() < 1e-6 * force.max():
        force = force[:, :1]  # the same on all rollers
    rollers, time = force.shape[1], np.asarray(result.time)
    base = _base_load(result)
    if base is not None:
        axes.plot(base[0] * MIN, base[1], color=GREY, lw=0.8, label="without feedback")
    # between the steps, a line would contradict the load; at many of them, the dots are a line
    style = "o" if base is not None else "-"
    for roller in range(rollers):
        label = "at the steps" if rollers == 1 else f"roller {roller + 1}"
        colour = ROLLERS[roller % len(ROLLERS)]
        axes.plot(time * MIN, force[:, roller], style, color=colour, ms=2.6, label=label)
    if rollers > 1 or base is not None:
        axes.legend(loc="best")
    name_axes(axes, "Normal force of one roller", "time [min]", "normal force [N]")
    if np.ptp(force) < 0.02 * force.max() and base is None:  # shows a constant as such
        axes.set_ylim(0.0, 1.25 * float(force.max()))
    axes.margins(x=0.02)


def _base_load(result: Result) -> tuple[FloatArray, FloatArray] | None:
    """Return times [s] and the load without feedback [N], or None if constant or unknown."""
    times = np.linspace(0.0, float(result.time[-1]), 2001)
    try:
        force = result.scenario.load.build().force(times)
    except WearsimError:  # a plugin of the scenario is not installed
        return None
    return (times, force) if np.ptp(force) > 1e-3 * force.max() else None

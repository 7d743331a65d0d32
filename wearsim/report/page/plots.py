"""Axes, sources and labels that the interactive figures share."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from bokeh.models.formatters import BasicTickFormatter, NumeralTickFormatter
from bokeh.models.glyphs import Line
from bokeh.models.ranges import Range1d
from bokeh.models.sources import ColumnDataSource
from bokeh.models.tickers import SingleIntervalTicker
from bokeh.models.tools import HoverTool
from bokeh.plotting import figure

from wearsim.report.measured import Measured
from wearsim.report.parts import BLUE, GREEN, ORANGE, RED, depth_scales, evenly_spaced
from wearsim.report.text import PER_SI
from wearsim.types import BoolArray, FloatArray

UM, MM, MIN, W_MM, DEG = (PER_SI[unit] for unit in ("um", "mm", "min", "W/mm", "deg"))
COLOURS = (BLUE, ORANGE, GREEN, RED, "#7a4fa3", "#5a5a5a")
MOST_POINTS = 2000


@dataclass(frozen=True)
class Plot:
    """A figure with its title and description.

    Parameters
    ----------
    title : str
    alt : str
        What the figure shows, for readers who do not see it.
    figure : bokeh figure
    """

    title: str
    alt: str
    figure: Any


def axes(x: str, y: str, **options: Any) -> Any:
    """Return empty axes with labels."""
    plot = figure(
        height=340,
        sizing_mode="stretch_width",
        tools="pan,box_zoom,wheel_zoom,reset,save",
        active_scroll=None,
        x_axis_label=x,
        y_axis_label=y,
        toolbar_location="above",
        min_border_right=14,  # for half of the last tick label
        **options,
    )
    plot.toolbar.logo = None
    for axis in (*plot.xaxis, *plot.yaxis):
        axis.axis_label_text_font_style = "normal"
        axis.axis_label_text_font_size = "14px"
        axis.major_label_text_font_size = "13px"
        axis.axis_label_text_color = axis.major_label_text_color = "#222222"
        if isinstance(axis.formatter, BasicTickFormatter):
            axis.formatter = BasicTickFormatter(
                power_limit_low=-4, power_limit_high=8, precision="auto"
            )
    plot.grid.grid_line_color = "#e4e4e4"
    return plot


def in_degrees(plot: Any) -> None:
    """Show a whole turn on the axis of angles, with a tick at every 45 degrees."""
    plot.x_range = Range1d(start=0, end=360)
    plot.xaxis.ticker = SingleIntervalTicker(interval=45, num_minor_ticks=3)


def columns(**arrays: Any) -> ColumnDataSource:
    """Return columns in single precision."""
    return ColumnDataSource({name: _single(column) for name, column in arrays.items()})


def _single(column: Any) -> Any:
    array = np.asarray(column)
    return array.astype(np.float32) if array.dtype.kind == "f" else column


def hover(plot: Any, renderers: Sequence[Any], *tooltips: tuple[str, str]) -> None:
    """Show values of the drawn data under the pointer, of a line also above and below it."""
    lines = all(isinstance(renderer.glyph, Line) for renderer in renderers)
    mode: Literal["vline", "mouse"] = "vline" if lines else "mouse"
    plot.add_tools(HoverTool(renderers=list(renderers), tooltips=list(tooltips), mode=mode))


def legend(plot: Any) -> None:
    """Move the legend of a figure below its axes; a click on an entry hides its line."""
    for each in plot.legend:
        plot.add_layout(each, "below")
        each.update(ncols=2, orientation="horizontal", border_line_alpha=0.0, click_policy="hide")
        each.update(label_text_font_size="13px", label_text_color="#222222", padding=4)


def worn_range(y: FloatArray, worn: FloatArray) -> Range1d:
    """Return the range of y [mm] of the strips that are worn, with a margin."""
    inside = y[worn > 1e-3 * worn.max()] if worn.max() > 0.0 else y
    low, high = float(inside[0]) * MM, float(inside[-1]) * MM
    margin = 0.15 * (high - low)
    return Range1d(start=low - margin, end=high + margin)


def add_measured(plot: Any, measured: Sequence[Measured]) -> None:
    """Draw measured profiles as points."""
    for number, profile in enumerate(measured):
        every = evenly_spaced(len(profile.y), MOST_POINTS)
        points = columns(y=profile.y[every] * MM, height=profile.height[every] * UM)
        drawn = plot.scatter(
            "y", "height", source=points, size=5, fill_color="white",
            line_color=COLOURS[(number + 3) % len(COLOURS)],
            legend_label=f"measured: {profile.label}",
        )  # fmt: skip
        hover(plot, [drawn], ("y", "@y{0.000} mm"), ("measured", "@height{0.000} um"))


def pass_axes(passes: FloatArray, depth: FloatArray, y: str) -> tuple[Any, BoolArray, float]:
    """Return axes for a depth against passes, the drawn points, and the unit of the passes."""
    drawn, logarithmic, unit, name = depth_scales(passes, depth)
    if not logarithmic:
        return axes(name, y), drawn, unit
    plot = axes(name, y, x_axis_type="log", y_axis_type="log")
    plot.yaxis.formatter = NumeralTickFormatter(format="0.[00000]")
    return plot, drawn, unit

"""Common style and axes of all figures."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter

from wearsim.report.text.units import pass_unit
from wearsim.types import BoolArray, FloatArray, IntArray

RECORDS = "viridis"
PRESSURE = "magma"
BLUE, ORANGE, GREEN, RED, GREY = "#2066a8", "#d1701c", "#3a8a5c", "#b3282d", "#8a8a8a"

_SETTINGS: dict[Any, Any] = {
    "font.size": 9.0,
    "axes.titlesize": 9.5,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.labelsize": 9.0,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": "#e4e4e4",
    "grid.linewidth": 0.6,
    "legend.frameon": False,
    "legend.fontsize": 8.0,
    "lines.linewidth": 1.3,
    "xtick.labelsize": 8.0,
    "ytick.labelsize": 8.0,
    "figure.titlesize": 11.0,
    "svg.fonttype": "none",
    "pdf.fonttype": 42,
}


@contextmanager
def figure_style() -> Iterator[None]:
    """Apply the settings of wearsim to the figures drawn in the context."""
    with mpl.rc_context(_SETTINGS):
        yield


@contextmanager
def titled_figure(width: float, height: float, title: str | None = None) -> Iterator[Figure]:
    """Return a figure of a width and height in inches, drawn with the settings of wearsim."""
    with figure_style():
        figure = Figure(figsize=(width, height), layout="constrained")
        if title is not None:
            figure.suptitle(title, fontsize=10.5)
        yield figure


def name_axes(axes: Axes, title: str, x: str, y: str) -> None:
    """Set the title of a panel and the labels of its axes."""
    axes.set(title=title, xlabel=x, ylabel=y)


def evenly_spaced(count: int, most: int) -> IntArray:
    """Return at most `most` evenly spaced indices of `count` items, with the first and the last."""
    return np.unique(np.linspace(0, count - 1, min(count, most)).round().astype(np.int64))


def write_message(axes: Axes, title: str, lines: Sequence[str]) -> None:
    """Write lines of text into a panel that has nothing to draw."""
    axes.text(0.5, 0.5, "\n".join(lines), ha="center", va="center", transform=axes.transAxes)
    axes.set_title(title)
    axes.set_axis_off()


def set_depth_axes(
    axes: Axes, passes: FloatArray, depth: FloatArray
) -> tuple[BoolArray, float, str]:
    """Set the scales of a panel of depth against passes, logarithmic from two decades of passes on.

    Parameters
    ----------
    axes : Axes
    passes, depth : ndarray, shape (points,)
        Points to be drawn [1, m].

    Returns
    -------
    drawn : ndarray of bool, shape (points,)
        Points that can be drawn on these scales.
    unit : float
        Unit of the axis of passes.
    name : str
        Label of the axis of passes.
    """
    worn = (passes > 0.0) & (depth > 0.0)
    if worn.sum() > 3 and passes[worn][-1] > 100.0 * passes[worn][0]:
        axes.set(xscale="log", yscale="log")
        axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        return worn, 1.0, "roller passes"
    return passes >= 0.0, *pass_unit(float(passes[-1]))

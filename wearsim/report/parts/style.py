"""How all figures look."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import matplotlib as mpl
from matplotlib.axes import Axes

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
    """Draw with wearsim's settings, and leave everyone else's alone."""
    with mpl.rc_context(_SETTINGS):
        yield


def name_axes(axes: Axes, title: str, x: str, y: str) -> None:
    """Write a panel's title and the labels of its axes."""
    axes.set_title(title)
    axes.set_xlabel(x)
    axes.set_ylabel(y)


def say(axes: Axes, title: str, lines: Sequence[str]) -> None:
    """Write a panel's title, and a few lines where there is nothing to draw."""
    axes.text(0.5, 0.5, "\n".join(lines), ha="center", va="center", transform=axes.transAxes)
    axes.set_title(title)
    axes.set_axis_off()

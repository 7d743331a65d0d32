"""The figure of a case, from its entry in validation.json."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from wearsim.report.figures import name_axes, titled_figure
from wearsim.report.panels import BLUE, GREEN, GREY, ORANGE, RED
from wearsim.types import FloatArray

_COLOURS = (BLUE, ORANGE, GREEN, RED, GREY)
_STYLES = ("-", "--", "-.", ":", "-")
_FEW = 3  # rows, below which values are drawn as marks and without differences


def case_figure(case: dict[str, Any]) -> Figure:
    """Return the published and the computed values of each series, and their differences.

    Parameters
    ----------
    case : dict
        An entry of `cases` in validation.json.
    """
    every = case["series"]
    rows = 1 if len(every[0]["x"]["values"]) < _FEW else 2
    size = max(7.0, 4.2 * len(every)), 1.2 + 2.3 * rows
    with titled_figure(*size, case["title"]) as figure:
        panels = figure.subplots(rows, len(every), squeeze=False, sharex="col")
        for number, series in enumerate(every):
            x = np.array(series["x"]["values"], dtype=np.float64)
            _values(panels[0, number], series, x)
            if rows > 1:
                _differences(panels[1, number], series, x)
            unit = series["x"]["unit"]
            label = series["x"]["name"] + ("" if unit == "1" else f" [{unit}]")
            panels[-1, number].set_xlabel(label)
    return figure


def _values(axes: Axes, series: dict[str, Any], x: FloatArray) -> None:
    published = np.array(series["published"]["values"], dtype=np.float64)
    error, unit = series["reading_error"] or 0.0, series["published"]["unit"]
    axes.errorbar(x, published, error, fmt="o", color="black", capsize=2, label="published")
    if series["spread"] is not None:
        axes.fill_between(x, *series["spread"], color=BLUE, alpha=0.15, linewidth=0.0)
    computed = series["computed"].items()
    for colour, style, (name, values) in zip(_COLOURS, _STYLES, computed, strict=False):
        marks = "s" if len(x) < _FEW else style
        axes.plot(x, values, marks, color=colour, label=name, mfc="none")
    if np.nanmin(published) > 0.0 and np.nanmax(published) > 30.0 * np.nanmin(published):
        axes.set(xscale="log", yscale="log")
    if len(x) == 1:
        axes.set(xticks=[], xlim=(x[0] - 1.0, x[0] + 2.0))
    name_axes(axes, series["series"], "", "value" if unit == "1" else f"[{unit}]")
    axes.legend()


def _differences(axes: Axes, series: dict[str, Any], x: FloatArray) -> None:
    """Draw computed less published values, with the error of reading."""
    published = np.array(series["published"]["values"], dtype=np.float64)
    reading = 100.0 * (series["reading_error"] or 0.0) / published
    axes.fill_between(x, -reading, reading, color=GREY, alpha=0.3, linewidth=0.0)
    axes.axhline(0.0, color="black", linewidth=0.8)
    computed = series["computed"].items()
    for colour, style, (_, values) in zip(_COLOURS, _STYLES, computed, strict=False):
        axes.plot(x, 100.0 * (np.array(values) / published - 1.0), style, color=colour)
    axes.set_ylabel("difference [%]")

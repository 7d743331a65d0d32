"""Figure of a comparison of runs and ensembles."""

from __future__ import annotations

from textwrap import fill

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.colors import to_hex
from matplotlib.figure import Figure

from wearsim.report.parts import (
    BLUE,
    GREEN,
    ORANGE,
    RECORDS,
    RED,
    evenly_spaced,
    name_axes,
    titled_figure,
)
from wearsim.report.text import OBSERVABLES, Named, against, realisations, sufficient_for
from wearsim.studies.ensemble.compare import Compared, Comparison

COLOURS = (BLUE, ORANGE, GREEN, RED)
MOST_POINTS = 2000  # of a distribution function
_ROW_HEIGHT = 0.52  # in
_LINE_LENGTH = 48  # characters in a line of a label
_THICK, _THIN = 5.0, 1.4


def comparison_figure(comparison: Comparison, title: str = "") -> Figure:
    """Return the figure of a comparison.

    Parameters
    ----------
    comparison : Comparison
    title : str
        Title of the figure.

    Returns
    -------
    Figure
        Two panels: the distribution function of each ensemble and each run as a line with its
        error; the mean and the 90 % range of each, in rows.
    """
    named, rows = OBSERVABLES[comparison.observable], comparison.rows
    colours = list(COLOURS[: len(rows)])
    if len(rows) > len(COLOURS):
        colours = [to_hex(c) for c in colormaps[RECORDS](np.linspace(0.0, 0.9, len(rows)))]
    with titled_figure(13.0, max(4.6, 1.8 + _ROW_HEIGHT * len(rows)), title) as figure:
        left, right = figure.subplots(1, 2)
        for row, colour in zip(rows, colours, strict=True):
            _draw_distribution(left, row, colour, named)
        label = f"{named.words} at the end [{named.unit}]"
        name_axes(left, "Cumulative distribution", label, "cumulative probability [%]")
        left.set_ylim(0.0, 100.0)
        left.legend(loc="best")
        _draw_ranges(right, comparison, colours, named)
        right.set_xlabel(label)
    return figure


def _draw_distribution(axes: Axes, row: Compared, colour: str, named: Named) -> None:
    """Draw the distribution function of an ensemble, or the value of a run with its error."""
    if row.kind == "run":
        ends = row.value.low * named.per_si, row.value.high * named.per_si
        axes.axvspan(*ends, color=colour, alpha=0.3, lw=0)
        axes.axvline(row.value.value * named.per_si, color=colour, label=f"{row.label} (run)")
        return
    values = row.values * named.per_si
    picks = evenly_spaced(len(values), MOST_POINTS)
    parts = 100.0 * (picks + 1.0) / len(values)
    # from zero, since the function rises at the first value too
    across = np.concatenate([values[:1], values[picks]])
    label = f"{row.label} ({realisations(row)})"
    axes.step(across, np.concatenate([[0.0], parts]), where="post", color=colour, label=label)


def _draw_ranges(axes: Axes, comparison: Comparison, colours: list[str], named: Named) -> None:
    """Draw mean with interval, median and 90 % range, in rows."""
    rows = comparison.rows
    places = np.arange(len(rows))
    for place, row, colour in zip(places, rows, colours, strict=True):
        quantiles = [quantile.value * named.per_si for _, quantile in row.quantiles]
        if _has_range(row):
            axes.plot([quantiles[0], quantiles[-1]], [place] * 2, color=colour, lw=_THIN)
        if row.quantiles:
            middle = dict(row.quantiles)[0.5].value * named.per_si
            axes.plot([middle], [place], "|", color=colour, ms=13.0, mew=_THIN)
        ends = np.array([row.value.low, row.value.high]) * named.per_si
        if np.isfinite(ends).all():
            axes.plot(ends, [place] * 2, color=colour, lw=_THICK, alpha=0.45, solid_capstyle="butt")
        axes.plot([row.value.value * named.per_si], [place], "o", color=colour, ms=4.5)
    axes.set_yticks(places, [_label(comparison, row) for row in rows])
    axes.set_ylim(len(rows) - 0.5, -0.5)
    axes.set_xlim(left=min(0.0, axes.get_xlim()[0]))
    axes.grid(visible=False, axis="y")
    title = "Value and estimated error"
    if any(row.quantiles for row in rows):
        title = "Mean (dot) with 95 % interval, median (bar)"
        title += ", 5 % to 95 % (line)" if any(_has_range(row) for row in rows) else ""
    axes.set_title(title)


def _has_range(row: Compared) -> bool:
    """Return whether the sample size is sufficient for the 90 % range."""
    return bool(row.quantiles) and sufficient_for(row.count, row.quantiles[0][0])


def _label(comparison: Comparison, row: Compared) -> str:
    """Return the label of a row and its comparison with the first."""
    if row is comparison.rows[0]:
        return row.label
    lines = [text for _, text in against(comparison, row)][:1]
    if lines and lines[0].startswith("in "):
        lines = ["more than the first", *lines]
    return "\n".join([row.label, *(fill(line, _LINE_LENGTH) for line in lines)])

"""The figure of runs and ensembles side by side."""

from __future__ import annotations

from textwrap import fill
from typing import TYPE_CHECKING

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.colors import to_hex
from matplotlib.figure import Figure

from wearsim.report.parts.style import BLUE, GREEN, ORANGE, RECORDS, RED, figure_style, name_axes
from wearsim.report.text.comparison_words import against, realisations
from wearsim.report.text.labels import OBSERVABLES, Named
from wearsim.report.text.quantile_thresholds import enough_for

if TYPE_CHECKING:
    from wearsim.studies.ensemble.compare import Compared, Comparison

FEW = (BLUE, ORANGE, GREEN, RED)
MOST_POINTS = 2000  # of a distribution function that is drawn
_ROW = 0.52  # in, height of a row
_LABEL = 48  # letters in a line of a label
_INNER, _OUTER = 5.0, 1.4  # widths of the lines of a range


def comparison_figure(comparison: Comparison, title: str = "") -> Figure:
    """Return the figure of a comparison.

    Parameters
    ----------
    comparison : Comparison
    title : str
        What is compared.

    Returns
    -------
    Figure
        Two panels: the distribution function of each ensemble, a run as a line with its error; and
        mean and ranges of each, one below the other.
    """
    named, rows = OBSERVABLES[comparison.observable], comparison.rows
    with figure_style():
        height = max(4.6, 1.8 + _ROW * len(rows))
        figure = Figure(figsize=(13.0, height), layout="constrained")
        left, right = figure.subplots(1, 2)
        for row, colour in zip(rows, _colours(len(rows)), strict=True):
            _draw_law(left, row, colour, named)
        end = f"{named.words} at the end [{named.unit}]"
        name_axes(left, "Part of the realisations that has less", end, "part [%]")
        left.set_ylim(0.0, 100.0)
        left.legend(loc="best")
        _draw_ranges(right, comparison, named)
        figure.suptitle(title, fontsize=10.5)
    return figure


def _colours(number: int) -> list[str]:
    if number <= len(FEW):
        return list(FEW[:number])
    return [to_hex(colour) for colour in colormaps[RECORDS](np.linspace(0.0, 0.9, number))]


def _draw_law(axes: Axes, row: Compared, colour: str, named: Named) -> None:
    """Draw the distribution function of an ensemble, or the value of a run with its error."""
    if row.kind == "run":
        ends = row.value.low * named.per_si, row.value.high * named.per_si
        axes.axvspan(*ends, color=colour, alpha=0.3, lw=0)
        axes.axvline(row.value.value * named.per_si, color=colour, label=f"{row.label} (run)")
        return
    values = row.values * named.per_si
    picks = np.arange(len(values))
    if len(values) > MOST_POINTS:
        picks = np.unique(np.linspace(0, len(values) - 1, MOST_POINTS).round().astype(np.int64))
    parts = 100.0 * (picks + 1.0) / len(values)
    # from zero up: the first value is a step too
    across = np.concatenate([values[:1], values[picks]])
    label = f"{row.label} ({realisations(row)})"
    axes.step(across, np.concatenate([[0.0], parts]), where="post", color=colour, label=label)


def _draw_ranges(axes: Axes, comparison: Comparison, named: Named) -> None:
    """Draw mean with its interval, and the range of nine in ten realisations, row by row."""
    rows = comparison.rows
    places = np.arange(len(rows))
    for place, row, colour in zip(places, rows, _colours(len(rows)), strict=True):
        level = [place, place]
        if _has_range(row):
            ends = [row.quantiles[0][1].value, row.quantiles[-1][1].value]
            axes.plot(np.array(ends) * named.per_si, level, color=colour, lw=_OUTER)
        if row.quantiles:
            middle = dict(row.quantiles)[0.5].value * named.per_si
            axes.plot([middle], [place], "|", color=colour, ms=13.0, mew=_OUTER)
        if np.isfinite([row.value.low, row.value.high]).all():
            ends = [row.value.low, row.value.high]
            axes.plot(
                np.array(ends) * named.per_si, level, color=colour, lw=_INNER, alpha=0.45,
                solid_capstyle="butt",
            )  # fmt: skip
        axes.plot([row.value.value * named.per_si], [place], "o", color=colour, ms=4.5)
    axes.set_yticks(places, [_told(comparison, row) for row in rows])
    axes.set_ylim(len(rows) - 0.5, -0.5)
    axes.set_xlim(left=min(0.0, axes.get_xlim()[0]))
    axes.grid(visible=False, axis="y")
    title = ["Mean with its 95 % interval (dot)", "median (bar)"]
    title += ["5 to 95 % (line)"] if any(_has_range(row) for row in rows) else []
    if not any(row.quantiles for row in rows):
        title = ["Value with its stated error"]
    name_axes(axes, ", ".join(title), f"{named.words} at the end [{named.unit}]", "")


def _has_range(row: Compared) -> bool:
    """Tell whether there are enough realisations to draw where nine in ten of them end."""
    return bool(row.quantiles) and enough_for(row.count, row.quantiles[0][0])


def _told(comparison: Comparison, row: Compared) -> str:
    """Return a row's label, and how it compares with the first."""
    if row is comparison.rows[0]:
        return row.label
    told = [text for _, text in against(comparison, row)][:1]
    if told and told[0].startswith("in "):
        told = ["more than the first", *told]
    return "\n".join([row.label, *(fill(line, _LABEL) for line in told)])

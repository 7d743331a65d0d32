"""Figure of a comparison of runs and ensembles."""

from __future__ import annotations

from collections.abc import Sequence
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
from wearsim.report.text import (
    OBSERVABLES,
    Named,
    against,
    pass_unit,
    realisations,
    sufficient_for,
)
from wearsim.studies.ensemble.compare import Compared, Comparison

COLOURS = (BLUE, ORANGE, GREEN, RED)
MOST_POINTS = 2000  # of a distribution function
_ROW_HEIGHT = 0.8  # in
_LINE_LENGTH = 88  # characters in a line of a label
_LINE_HEIGHT, _ABOVE = 11.0, 8.0  # of a label, and its distance from the marks [points]
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
        error, or the courses of runs alone; the mean and the 90 % range of each, in rows with
        their labels.
    """
    named, rows = OBSERVABLES[comparison.observable], comparison.rows
    colours = list(COLOURS[: len(rows)])
    if len(rows) > len(COLOURS):
        colours = [to_hex(c) for c in colormaps[RECORDS](np.linspace(0.0, 0.9, len(rows)))]
    caption = fill(title, _LINE_LENGTH)
    with titled_figure(13.0, max(4.6, 1.8 + _ROW_HEIGHT * len(rows)), caption) as figure:
        left, right = figure.subplots(1, 2)
        label = f"{named.words} at the end [{named.unit}]"
        if all(row.course is not None for row in rows):
            _draw_courses(left, rows, colours, named)
        else:
            for row, colour in zip(rows, colours, strict=True):
                _draw_distribution(left, row, colour, named)
            name_axes(left, "Cumulative distribution", label, "cumulative probability [%]")
            left.set_ylim(0.0, 100.0)
        _draw_ranges(right, comparison, colours, named, label)
    return figure


def _draw_courses(
    axes: Axes, rows: Sequence[Compared], colours: Sequence[str], named: Named
) -> None:
    """Draw the observable of each run against roller passes."""
    unit, name = pass_unit(max(row.passes for row in rows))
    for row, colour in zip(rows, colours, strict=True):
        assert row.course is not None
        passes, values = row.course
        across, up = passes / unit, values * named.per_si
        # the dot at the end shows a run that another one covers
        axes.plot(across, up, "-o", markevery=[-1], ms=4.5, color=colour, label=row.label)
    words = named.words[:1].upper() + named.words[1:]
    name_axes(axes, f"{words} against roller passes", name, f"{named.words} [{named.unit}]")


def _draw_distribution(axes: Axes, row: Compared, colour: str, named: Named) -> None:
    """Draw the distribution function of an ensemble, or the value of a run with its error."""
    if row.kind == "run":
        ends = row.value.low * named.per_si, row.value.high * named.per_si
        axes.axvspan(*ends, color=colour, alpha=0.3, lw=0)
        axes.axvline(row.value.value * named.per_si, color=colour, label=row.label)
        return
    values = row.values * named.per_si
    picks = evenly_spaced(len(values), MOST_POINTS)
    parts = 100.0 * (picks + 1.0) / len(values)
    # from zero, since the function rises at the first value too
    across = np.concatenate([values[:1], values[picks]])
    axes.step(across, np.concatenate([[0.0], parts]), where="post", color=colour, label=row.label)


def _draw_ranges(
    axes: Axes, comparison: Comparison, colours: list[str], named: Named, label: str
) -> None:
    """Draw mean with interval, median and 90 % range, in rows under their labels."""
    rows = comparison.rows
    for place, (row, colour) in enumerate(zip(rows, colours, strict=True)):
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
        _label_row(axes, comparison, row, place, colour)
    axes.set_yticks([])
    axes.set_ylim(len(rows) - 0.6, -0.8)
    low, high = min(0.0, axes.get_xlim()[0]), axes.get_xlim()[1]
    axes.set_xlim(low, high + 0.03 * (high - low))
    title, marks = "Value and estimated error", ""
    if any(row.quantiles for row in rows):
        title, marks = (
            "Mean, median and range",
            "\ndot: mean; thick line: 95 % interval; bar: median",
        )
        marks += "; line: 5 % to 95 %" if any(_has_range(row) for row in rows) else ""
    name_axes(axes, title, f"{label}{marks}", "")


def _label_row(axes: Axes, comparison: Comparison, row: Compared, place: int, colour: str) -> None:
    """Write the name of a row, and under it its comparison with the first row."""
    lines = [text for _, text in against(comparison, row)][:1] if place else []
    if lines and lines[0].startswith("in "):
        more = "deeper" if comparison.observable == "depth" else "more"
        lines = [f"{more} than {comparison.rows[0].label} {lines[0]}"]
    under = [part for line in lines for part in fill(line, _LINE_LENGTH).splitlines()]
    size = "run" if row.kind == "run" else f"ensemble of {realisations(row)}"
    head = fill(f"{row.label} ({size})", _LINE_LENGTH).splitlines()
    for number, text in enumerate(reversed([*head, *under])):
        is_head = number >= len(under)
        axes.annotate(
            text,
            (0.0, place),
            xycoords=axes.get_yaxis_transform(),
            xytext=(3.0, _ABOVE + _LINE_HEIGHT * number),
            textcoords="offset points",
            color=colour if is_head else "black",
            weight="bold" if is_head else "normal",
            fontsize=8.0,
        )


def _has_range(row: Compared) -> bool:
    """Return whether the sample size is sufficient for the 90 % range."""
    return bool(row.quantiles) and sufficient_for(row.count, row.quantiles[0][0])

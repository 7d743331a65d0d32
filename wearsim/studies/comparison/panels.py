"""Panels of a comparison of runs and ensembles: distributions or courses, means and profiles."""

from __future__ import annotations

from textwrap import fill

import numpy as np

from wearsim.levelling import ComputedProfile
from wearsim.report.panels import (
    BLACK,
    Axis,
    Band,
    Line,
    Mark,
    Panel,
    Sheet,
    Span,
    Text,
    Whiskers,
    dots,
    evenly_spaced,
    pass_axis,
    several_colours,
    worn_limits,
)
from wearsim.report.text import OBSERVABLES, Named, sufficient_for
from wearsim.studies.comparison.compare import Compared, Comparison
from wearsim.studies.comparison.view import against, realisations
from wearsim.studies.run.panels import HEIGHT, Y

MOST_POINTS = 2000  # of a distribution function
_ROW_HEIGHT = 0.8  # in
_LINE_LENGTH = 88  # characters in a line of a label
_LINE_HEIGHT, _ABOVE = 11.0, 8.0  # of a label, and its distance from the marks [points]
_THICK, _THIN = 5.0, 1.4


def comparison_sheet(
    comparison: Comparison, title: str = "", profiles: dict[str, ComputedProfile] | None = None
) -> Sheet:
    """Return the panels of a comparison.

    Parameters
    ----------
    comparison : Comparison
    title : str
        Title of the figure.
    profiles : dict of str to ComputedProfile, optional
        Profiles at the end by label, for a page.

    Returns
    -------
    Sheet
        The distribution function of each ensemble and each run as a line with its error, or the
        courses of runs alone; the mean and the 90 % range of each, in rows with their labels.
    """
    named, rows = OBSERVABLES[comparison.observable], comparison.rows
    colours = several_colours(len(rows))
    pairs = list(zip(rows, colours, strict=True))
    at_end = Axis(f"{named.words} at the end", named.unit)
    if all(row.course is not None for row in rows):
        left = _courses(pairs, named)
    else:
        marks = [mark for row, colour in pairs for mark in _distribution(row, colour)]
        left = Panel(
            "Cumulative distribution",
            at_end,
            Axis("cumulative probability", "%", limits=(0.0, 1.0)),
            marks,
            "Share of the tests that are below a value.",
            legend="",
        )
    panels = {"ranges": _ranges(comparison, colours, at_end), "values": left}
    if profiles:
        panels["profiles"] = _profiles(profiles)
    size = (13.0, max(4.6, 1.8 + _ROW_HEIGHT * len(rows)))
    return Sheet(fill(title, _LINE_LENGTH), panels, [["values", "ranges"]], size)


def _courses(pairs: list[tuple[Compared, str]], named: Named) -> Panel:
    """Return the observable of each run against roller passes."""
    # the dot at the end shows a run that another one covers
    marks = [
        Line(
            row.course[0],
            row.course[1],
            marker="o",
            size=4.5,
            at_end=True,
            colour=colour,
            label=row.label,
        )
        for row, colour in pairs
        if row.course is not None
    ]
    words = named.words[:1].upper() + named.words[1:]
    x = pass_axis(max(row.passes for row, _ in pairs))
    y, text = Axis(named.words, named.unit), "The course of each run."
    return Panel(f"{words} against roller passes", x, y, marks, text, legend="")


def _distribution(row: Compared, colour: str) -> list[Mark]:
    """Return the distribution function of an ensemble, or the value of a run with its error."""
    if row.kind == "run":
        error = Span(row.value.low, row.value.high, colour=colour, alpha=0.3)
        return [error, Span(row.value.value, colour=colour, label=row.label, width=1.3)]
    picks = evenly_spaced(len(row.values), MOST_POINTS)
    parts = (picks + 1.0) / len(row.values)
    # from zero, since the function rises at the first value too
    across = np.concatenate([row.values[:1], row.values[picks]])
    rising = np.concatenate([[0.0], parts])
    return [Line(across, rising, steps=True, colour=colour, label=row.label)]


def _ranges(comparison: Comparison, colours: list[str], axis: Axis) -> Panel:
    """Return mean with interval, median and 90 % range, in rows under their labels."""
    rows, marks = comparison.rows, list[Mark]()
    for place, (row, colour) in enumerate(zip(rows, colours, strict=True)):
        quantiles = dict(row.quantiles)
        ends = [quantile.value for quantile in quantiles.values()]
        if _has_range(row):
            marks.append(_interval(place, ends[0], ends[-1], colour, _THIN))
        if quantiles:
            marks.append(dots([quantiles[0.5].value], [place], "|", size=13.0, colour=colour))
        if np.isfinite([row.value.low, row.value.high]).all():
            interval = _interval(place, row.value.low, row.value.high, colour, _THICK, 0.45)
            marks.append(interval)
        marks.append(dots([row.value.value], [place], size=4.5, colour=colour))
        marks += _labels(comparison, row, place, colour)
    title, legend = "Value and estimated error", ""
    if any(row.quantiles for row in rows):
        title = "Mean, median and range"
        legend = "\ndot: mean; thick line: 95 % interval; bar: median"
        legend += "; line: 5 % to 95 %" if any(_has_range(row) for row in rows) else ""
    low = min([0.0, *(row.value.value for row in rows)])
    scale = axis.scale
    x = Axis(
        f"{axis.label}{legend}", per_si=scale, margin=(0.0, 0.03), limits=(min(low, 0.0), None)
    )
    y = Axis(limits=(len(rows) - 0.6, -0.8), ticks=())
    return Panel(title, x, y, marks, "Every row is one of the compared results.", legend="")


def _interval(
    place: float, low: float, high: float, colour: str, width: float, alpha: float = 1.0
) -> Whiskers:
    return Whiskers(
        [place], [low], [high], horizontal=True, colour=colour, width=width, alpha=alpha
    )


def _labels(comparison: Comparison, row: Compared, place: int, colour: str) -> list[Mark]:
    """Return the name of a row, and under it its comparison with the first row."""
    lines = [text for _, text in against(comparison, row)][:1] if place else []
    if lines and lines[0].startswith("in "):
        more = "deeper" if comparison.observable == "depth" else "more"
        lines = [f"{more} than {comparison.rows[0].label} {lines[0]}"]
    under = [part for line in lines for part in fill(line, _LINE_LENGTH).splitlines()]
    size = "run" if row.kind == "run" else f"ensemble of {realisations(row)}"
    head = fill(f"{row.label} ({size})", _LINE_LENGTH).splitlines()
    return [
        Text(
            0.0,
            place,
            text,
            parts="x",
            offset=(3.0, _ABOVE + _LINE_HEIGHT * number),
            colour=colour if number >= len(under) else BLACK,
            bold=number >= len(under),
            figure_only=number < len(under),
        )
        for number, text in enumerate(reversed([*head, *under]))
    ]


def _has_range(row: Compared) -> bool:
    """Return whether the sample size is sufficient for the 90 % range."""
    return bool(row.quantiles) and sufficient_for(row.count, row.quantiles[0][0])


def _profiles(profiles: dict[str, ComputedProfile]) -> Panel:
    """Return the worn profiles of several results in one panel."""
    y = np.sort(np.concatenate([profile.y for profile in profiles.values()]))
    worn = [np.interp(y, item.y, item.start - item.low) for item in profiles.values()]
    marks: list[Mark] = []
    for colour, (label, profile) in zip(
        several_colours(len(profiles)), profiles.items(), strict=True
    ):
        if profile.label:
            marks.append(Band(profile.y, profile.low, profile.high, colour=colour))
        marks.append(Line(profile.y, profile.height, colour=colour, label=label))
    banded = any(profile.label for profile in profiles.values())
    text = "Profiles at the end" + (", of ensembles the mean with a band." if banded else ".")
    x = Axis(Y, "mm", limits=worn_limits(y, np.max(worn, axis=0)))
    return Panel("Worn profiles", x, HEIGHT, marks, text)

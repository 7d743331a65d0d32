"""View of a comparison of runs and ensembles: differences in words, estimates, and profiles."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import asdict
from textwrap import fill
from typing import Any

import numpy as np

from wearsim.errors import ResultsFileError
from wearsim.levelling import ComputedProfile, Measured
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
)
from wearsim.report.text import (
    NOTHING,
    OBSERVABLES,
    Named,
    cells,
    count,
    part_with_interval,
    shown,
    si_key,
    si_unit,
    simulated,
    sufficient_for,
    with_interval,
)
from wearsim.report.view import STUDY, Frame, Overview, Row, Rows, Table, View
from wearsim.studies.comparison.compare import Comparable, Compared, Comparison, compare
from wearsim.studies.ensemble.view import INTERVAL
from wearsim.studies.run.panels import HEIGHT, track_axis
from wearsim.uq.estimation.intervals import Interval
from wearsim.uq.estimation.mann_whitney import FEWEST, Paired

EQUAL = "equal in all tests"


class ComparisonView(View):
    """Difference of each run or ensemble from the first, and their estimates with intervals.

    Panels: distributions or courses, ranges with intervals, worn profiles.

    Parameters
    ----------
    comparison : Comparison
    key : str
        Scenario key in which the results differ, of a sweep.
    """

    basis = (
        "Intervals of ensembles are those of their means; those of runs contain the errors of the"
        " steps and strips only."
    )

    def __init__(self, comparison: Comparison, key: str = "") -> None:
        self.comparison, self.results, self.key = comparison, comparison.results, key
        *labels, last = (row.label for row in comparison.rows)
        self.title = f"{', '.join(labels)} and {last}"
        self.question = (
            f"How do the {OBSERVABLES[comparison.observable].words}s at the end of these tests"
            " differ?"
        )
        self._views: list[View] = [result.view for result in self.results]
        self.files = [str(result.path) for result in self.results]
        self.warnings = list(_warnings(comparison))

    def rows(self) -> Rows:
        """Return the comparisons with the first, and the value of each."""
        rows, unit = self.comparison.rows, OBSERVABLES[self.comparison.observable].unit
        return [
            *(Row(*pair) for row in rows[1:] for pair in against(self.comparison, row)),
            *(Row(row.label, f"{with_interval(row.value, unit)}, {kind(row)}") for row in rows),
        ]

    def tables(self) -> list[Table]:
        """Return what is compared, and the estimates with their intervals."""
        rows, named = self.comparison.rows, OBSERVABLES[self.comparison.observable]
        estimated = next((row.quantiles for row in rows if row.quantiles), ())
        quantiles = (f"{100 * probability:g} %" for probability, _ in estimated)
        heads = ["[" + named.unit + "]", "mean", "std", *quantiles]
        study = [
            Row(
                "compared",
                f"{named.words} at the end" + (f", for values of {self.key}" if self.key else ""),
            ),
            *(
                Row(row.label, f"{kind(row)}; {length(row)}; {file}")
                for row, file in zip(rows, self.files, strict=True)
            ),
        ]
        lines = [line for row in rows for line in _lines(row, named.unit, len(heads))]
        return [Table(STUDY, study), Table("", lines, heads), self._side_by_side()]

    def _side_by_side(self) -> Table:
        """Return all answers of the results, one column for each of them."""
        answers = [{row.label: row.text for row in view.rows()} for view in self._views]
        return Table(
            "",
            [
                [label, *(texts.get(label, NOTHING) for texts in answers)]
                for label in dict.fromkeys(label for texts in answers for label in texts)
            ],
            ["at the end", *(row.label for row in self.comparison.rows)],
        )

    def overview(self) -> Overview:
        """Return the comparison, and the limits of each of the results."""
        compared, overviews = super().overview(), [view.overview() for view in self._views]
        limits = {
            f"Limits of {row.label}": overview.groups.get("Limits", [])
            for row, overview in zip(self.comparison.rows, overviews, strict=True)
        }
        excluded = dict.fromkeys(text for overview in overviews for text in overview.excluded)
        return Overview(compared.picture, {**compared.groups, **limits}, list(excluded), alone=True)

    def data(self) -> dict[str, Any]:
        """Return the comparison in SI units; all results are compared with the first."""
        comparison = self.comparison
        return {
            "observable": si_key(comparison.observable),
            "same_length": comparison.equally_long,
            "compared": [
                {**_data(row, file), "at_end": view.data()}
                for row, file, view in zip(comparison.rows, self.files, self._views, strict=True)
            ],
            "title": self.key or None,
        }

    def frame(self) -> Frame:
        """Return the compared results, one row each."""
        rows, unit = self.comparison.rows, si_unit(self.comparison.observable)
        columns = [
            ("label", "", np.array([row.label for row in rows])),
            *(
                (end, unit, np.array([getattr(row.value, end) for row in rows]))
                for end in ("value", "low", "high")
            ),
        ]
        return Frame(columns, "result", range(1, len(rows) + 1))

    def panels(self, measured: Sequence[Measured] = ()) -> Sheet:
        """Return the panels, with the worn profiles for a page."""
        titles = {result.title for result in self.results}
        shared = titles.pop() if len(titles) == 1 else ""
        suffix = f"for values of {self.key}" if self.key else ""
        return comparison_sheet(
            self.comparison,
            ", ".join(filter(None, (shared, suffix))),
            {
                row.label: result.worn_profile()
                for row, result in zip(self.comparison.rows, self.results, strict=False)
            },
        )


def comparison_view(
    results: Sequence[Comparable], labels: Sequence[str], observable: str | None, key: str = ""
) -> ComparisonView:
    """Return the view of runs and ensembles that are compared, by their depths by default.

    Raises
    ------
    ResultsFileError
        If one has no completed realisation, or lacks the observable; the message lists what it has.
    """
    try:
        compared = compare(results, labels, observable or "depth")
    except ValueError as error:
        raise ResultsFileError(str(error)) from error
    return ComparisonView(compared, key)


def _warnings(comparison: Comparison) -> Iterator[str]:
    """Yield warnings of unequal lengths of the tests and of failed realisations."""
    if not comparison.equally_long:
        ends = "; ".join(f"{row.label}: {length(row)}" for row in comparison.rows)
        yield f"the tests differ in length ({ends}), which contributes to the differences"
    yield from (
        f"{count(row.failed)} of the {count(row.done + row.failed)} realisations of {row.label}"
        " failed; estimates from the others may be biased"
        for row in comparison.rows
        if row.failed
    )


def _lines(row: Compared, unit: str, columns: int) -> list[list[str]]:
    """Return the estimates of a run or an ensemble, and below them their intervals."""
    further = (row.std, *(interval for _, interval in row.quantiles)) if row.count > 1 else ()
    items = [row.value, *(item for item in further if item is not None)]
    values, intervals = zip(*(cells(item, unit) for item in items), strict=True)
    more, name = columns - 1 - len(items), "  error estimate" if row.kind == "run" else INTERVAL
    return [
        [row.label, *values, *[NOTHING] * more],
        *([[name, *intervals, *[""] * more]] if any(intervals) else []),
    ]


def _data(row: Compared, file: str) -> dict[str, Any]:
    """Return one of the compared results in SI units."""
    return {
        "label": row.label,
        "file": file,
        "kind": row.kind,
        "realisations": row.count,
        "done": row.done,
        "failed": row.failed,
        "requested": row.requested,
        "finished": row.finished,
        "passes": row.passes,
        "time_s": row.time,
        "value": asdict(row.value),
        "std": asdict(row.std) if row.std is not None else None,
        "quantiles": [{"probability": p, **asdict(quantile)} for p, quantile in row.quantiles],
        "probability_of_more_than_first": asdict(row.deeper) if row.deeper else None,
        "paired_with_first": row.paired
        and {
            "share_with_more": asdict(row.paired.share),
            "mean_difference": asdict(row.paired.difference),
        },
        "difference_from_first": asdict(row.difference) if row.difference else None,
    }


def realisations(row: Compared) -> str:
    """Return the number of realisations of an ensemble: "7 of 10, 3 failed"."""
    # an ensemble that reached its target, without failures
    at_most = " at most" if row.finished and row.done + row.failed < row.requested else ""
    requested = f" of {count(row.requested)}{at_most}" if row.done < row.requested else ""
    failed = f", {count(row.failed)} failed" if row.failed else ""
    independent = f", {count(row.count)} of them independent" if row.count < row.done else ""
    unfinished = "" if row.finished else ", unfinished"
    return f"{count(row.done)}{requested}{failed}{independent}{unfinished}"


def kind(row: Compared) -> str:
    """Return the kind of a result, "ensemble of 40" or "run"."""
    if row.kind == "run":
        return "run" if row.finished else "run, unfinished"
    return f"ensemble of {realisations(row)}"


def length(row: Compared) -> str:
    """Return the length of the tests, "3,000 passes, 1.000 min"."""
    return f"{count(row.passes)} passes, {simulated(row.time)}"


def against(comparison: Comparison, row: Compared) -> list[tuple[str, str]]:
    """Return the comparison of a result with the first one, as table rows.

    Parameters
    ----------
    comparison : Comparison
    row : Compared
        One of its rows except the first.
    """
    first, unit = comparison.rows[0], OBSERVABLES[comparison.observable].unit
    more, less = ("deeper", "shallower") if comparison.observable == "depth" else ("more", "less")
    if row.difference is not None:
        errors = (first.value.half_width, row.value.half_width)
        return [
            (
                f"{row.label} against {first.label}",
                _of_runs(row.difference, errors, unit, more, less),
            )
        ]
    deeper, paired = row.deeper, row.paired
    return [
        *(
            [(f"{row.label} {more} than {first.label}", _of_tests(first, row, deeper))]
            if deeper is not None
            else []
        ),
        *([("  with the same draws", _of_pairs(paired, unit, more, less))] if paired else []),
    ]


def _of_runs(
    difference: Interval, errors: tuple[float, float], unit: str, more: str, less: str
) -> str:
    """Return the difference of two runs, with their estimated errors."""
    texts, by = " and ".join(shown(error, unit, 2) for error in errors), difference.value
    stated = f"estimated errors {texts}" if any(errors) else "no error estimate"
    if by == 0.0:
        return f"equal ({stated})"
    if difference.low <= 0.0 <= difference.high:
        return f"not significant: difference {shown(abs(by), unit, 3)}, within the {stated}"
    return f"{more if by > 0.0 else less} by {shown(abs(by), unit)} ({stated})"


def _of_tests(first: Compared, row: Compared, deeper: Interval) -> str:
    """Return the probability that a test of one ensemble exceeds a test of the other."""
    ends = {first.values[0], row.values[0], first.values[-1], row.values[-1]}
    if len(ends) == 1 and row.count + first.count > 2:
        return EQUAL
    if not math.isfinite(deeper.value):
        return f"too few realisations, {FEWEST} of each are sufficient"
    pairs = "pairs of tests" if row.kind == first.kind else "the tests of the ensemble"
    return f"in {part_with_interval(deeper)} of {pairs}"


def _of_pairs(pairs: Paired, unit: str, more: str, less: str) -> str:
    """Return the difference between tests with the same draws."""
    by = pairs.difference
    if pairs.count == 1:
        amount = f"{more if by.value > 0.0 else less} by {shown(abs(by.value), unit)}"
        return f"{amount if by.value else 'equal'} in the only pair of tests"
    if by.low == by.value == by.high == 0.0:
        return EQUAL
    return f"in {part_with_interval(pairs.share)}, by {with_interval(by, unit)} on average"


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
    pairs = list(zip(rows, several_colours(len(rows)), strict=True))
    at_end = Axis(f"{named.words} at the end", named.unit)
    return Sheet(
        fill(title, _LINE_LENGTH),
        {
            "ranges": _ranges(comparison, pairs, at_end),
            "values": _courses(pairs, named)
            if all(row.course is not None for row in rows)
            else _distributions(pairs, at_end),
            **({"profiles": _profiles(profiles)} if profiles else {}),
        },
        [["values", "ranges"]],
        (13.0, max(4.6, 1.8 + _ROW_HEIGHT * len(rows))),
    )


def _courses(pairs: list[tuple[Compared, str]], named: Named) -> Panel:
    """Return the observable of each run against roller passes."""
    # the dot at the end shows a run that another one covers
    style: dict[str, Any] = {"marker": "o", "size": 4.5, "at_end": True}
    return Panel(
        f"{named.words.capitalize()} against roller passes",
        pass_axis(max(row.passes for row, _ in pairs)),
        Axis(named.words, named.unit),
        [
            Line(*row.course, colour=colour, label=row.label, **style)
            for row, colour in pairs
            if row.course is not None
        ],
        "The course of each run.",
        legend="",
    )


def _distributions(pairs: list[tuple[Compared, str]], axis: Axis) -> Panel:
    """Return the distribution function of each ensemble, and the value of each run."""
    return Panel(
        "Cumulative distribution",
        axis,
        Axis("cumulative probability", "%", limits=(0.0, 1.0)),
        [mark for row, colour in pairs for mark in _distribution(row, colour)],
        "Share of the tests that are below a value.",
        legend="",
    )


def _distribution(row: Compared, colour: str) -> list[Mark]:
    """Return the distribution function of an ensemble, or the value of a run with its error."""
    if row.kind == "run":
        return [
            Span(row.value.low, row.value.high, colour=colour, alpha=0.3),
            Span(row.value.value, colour=colour, label=row.label, width=1.3),
        ]
    picks = evenly_spaced(len(row.values), MOST_POINTS)
    # from zero, since the function rises at the first value too
    across = np.concatenate([row.values[:1], row.values[picks]])
    rising = np.concatenate([[0.0], (picks + 1.0) / len(row.values)])
    return [Line(across, rising, steps=True, colour=colour, label=row.label)]


def _ranges(comparison: Comparison, pairs: list[tuple[Compared, str]], axis: Axis) -> Panel:
    """Return mean with interval, median and 90 % range, in rows under their labels."""
    rows, marks = comparison.rows, list[Mark]()
    for place, (row, colour) in enumerate(pairs):
        quantiles, mean = {p: quantile.value for p, quantile in row.quantiles}, row.value
        ends = list(quantiles.values())
        marks += [
            *([_interval(place, ends[0], ends[-1], colour, _THIN)] if _has_range(row) else []),
            *([dots([quantiles[0.5]], [place], "|", size=13.0, colour=colour)] if ends else []),
            *(
                [_interval(place, mean.low, mean.high, colour, _THICK, 0.45)]
                if np.isfinite([mean.low, mean.high]).all()
                else []
            ),
            dots([mean.value], [place], size=4.5, colour=colour),
            *_labels(comparison, row, place, colour),
        ]
    title, legend = "Value and estimated error", ""
    if any(row.quantiles for row in rows):
        title = "Mean, median and range"
        legend = "\ndot: mean; thick line: 95 % interval; bar: median"
        legend += "; line: 5 % to 95 %" if any(_has_range(row) for row in rows) else ""
    low = min([0.0, *(row.value.value for row in rows)])
    return Panel(
        title,
        Axis(f"{axis.label}{legend}", per_si=axis.scale, margin=(0.0, 0.03), limits=(low, None)),
        Axis(limits=(len(rows) - 0.6, -0.8), ticks=()),
        marks,
        "Every row is one of the compared results.",
        legend="",
    )


def _interval(
    place: float, low: float, high: float, colour: str, width: float, alpha: float = 1.0
) -> Whiskers:
    return Whiskers(
        [place], [low], [high], horizontal=True, colour=colour, width=width, alpha=alpha
    )


def _labels(comparison: Comparison, row: Compared, place: int, colour: str) -> list[Mark]:
    """Return the name of a row, and under it its comparison with the first row."""
    lines = [
        f"{name.removeprefix(f'{row.label} ')} {text}" if text.startswith("in ") else text
        for name, text in (against(comparison, row)[:1] if place else [])
    ]
    under = [part for line in lines for part in fill(line, _LINE_LENGTH).splitlines()]
    size = "run" if row.kind == "run" else f"ensemble of {realisations(row)}"
    head = fill(f"{row.label} ({size})", _LINE_LENGTH).splitlines()
    return [
        Text(
            *(0.0, place, text, "x"),
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
    marks, colours = list[Mark](), several_colours(len(profiles))
    for colour, (label, profile) in zip(colours, profiles.items(), strict=True):
        if profile.label:
            marks.append(Band(profile.y, profile.low, profile.high, colour=colour))
        marks.append(Line(profile.y, profile.height, colour=colour, label=label))
    banded = ", of ensembles the mean with a band" * any(item.label for item in profiles.values())
    return Panel(
        "Worn profiles",
        track_axis(y, np.max(worn, axis=0)),
        HEIGHT,
        marks,
        f"Profiles at the end{banded}.",
    )

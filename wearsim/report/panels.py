"""Panels as data: axes with units and what is drawn on them; all numbers are in SI.

A view describes its panels once. `figures` draws them with matplotlib, `page.plots` with Bokeh.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

import numpy as np

from wearsim.report.text import PER_SI, count, pass_unit
from wearsim.types import BoolArray, FloatArray, IntArray

if TYPE_CHECKING:
    from wearsim.levelling import Measured

BLUE, ORANGE, GREEN, RED, GREY = "#2066a8", "#d1701c", "#3a8a5c", "#b3282d", "#8a8a8a"
BLACK = "black"
COLOURS = (BLUE, ORANGE, GREEN, RED)
DASHES = ("-", "--", ":", "-.")
MARKS = ("o", "s", "^", "D", "v")
RECORDS, PRESSURE = "viridis", "magma"  # colour maps
_CLASSES = (5, 60)
HEADROOM = 0.3  # above a histogram, for the legend
_SCALED_FROM = 10  # realisations from which an estimate sets the scale of the panel,
_SCALED_PART = 1 / 30  # or this part of all realisations
_LINEAR_UP_TO = 20  # realisations
_VIRIDIS = (
    "#440154", "#482475", "#414487", "#355f8d", "#2a788e", "#21918c", "#22a884", "#44bf70",
    "#7ad151", "#bddf26",
)  # fmt: skip


@dataclass(frozen=True)
class Axis:
    """An axis of a panel.

    Parameters
    ----------
    name : str
        Name of the quantity; empty for none.
    unit : str
        Unit that is shown; a key of `PER_SI`, or any with `per_si`.
    per_si : float, optional
        One SI unit in the unit shown.
    log : bool
        Whether the axis is logarithmic.
    limits : tuple of float or None
        Ends of the axis [SI]; None for an end that follows the data.
    margin : tuple of float
        Free parts below and above the data, of their range.
    ticks, names : sequence, optional
        Places of the ticks [SI], and their labels.
    """

    name: str = ""
    unit: str = "1"
    per_si: float | None = None
    log: bool = False
    limits: tuple[float | None, float | None] = (None, None)
    margin: tuple[float, float] = (0.0, 0.0)
    ticks: Sequence[float] | None = None
    names: Sequence[str] | None = None

    @property
    def scale(self) -> float:
        """One SI unit in the unit shown."""
        return PER_SI[self.unit] if self.per_si is None else self.per_si

    @property
    def label(self) -> str:
        """Name with the unit."""
        return f"{self.name} [{self.unit}]" if self.name and self.unit != "1" else self.name

    def ends(self, *default: float) -> list[float | None]:
        """Return the limits in the unit shown; those that follow the data are None by default."""
        ends = zip(self.limits, default or (None, None), strict=True)
        return [other if end is None else float(end * self.scale) for end, other in ends]


@dataclass(frozen=True, kw_only=True)
class Mark:
    """Style of what is drawn: label in the legend, colour, opacity, and whether on the right."""

    label: str = ""
    colour: Any = BLUE
    alpha: float = 1.0
    right: bool = False


@dataclass(frozen=True)
class _Placed(Mark):
    """A mark with coordinates on both axes."""

    x: Any
    y: Any


@dataclass(frozen=True)
class Line(_Placed):
    """A curve, points without a dash, or several curves of one style.

    Parameters
    ----------
    x : ndarray, shape (points,)
    y : ndarray, shape (points,) or (curves, points)
    dash, marker : str
        As in matplotlib: "-", "--", ":", "-." or empty; "o", "s", ".", "|", "+" or empty.
    width, size : float
        Width of the line, and size of the markers [points].
    steps : bool
        Whether the curve keeps each value up to the next place.
    open : bool
        Whether the markers are white inside.
    at_end : bool
        Whether only the last point has a marker.
    more : mapping of str to (ndarray, str)
        Further values under the pointer with their units [SI].
    """

    dash: str = "-"
    marker: str = ""
    width: float = 1.3
    size: float = 4.0
    steps: bool = False
    open: bool = False
    at_end: bool = False
    more: Mapping[str, tuple[Any, str]] = field(default_factory=dict)


@dataclass(frozen=True)
class Records(_Placed):
    """A curve for each record: all of them in a figure, the slider's on a page.

    Parameters
    ----------
    x : ndarray, shape (points,)
    y : ndarray, shape (records, points)
    passes : ndarray, shape (records,)
        Roller passes of the records, which give their colours; zero is black.
    dash : str
    most : int
        Greatest number of curves in a figure.
    """

    passes: Any
    dash: str = "-"
    most: int = 24


@dataclass(frozen=True)
class Band(Mark):
    """Area between two curves, each of shape (points,)."""

    x: Any
    low: Any
    high: Any
    steps: bool = False
    alpha: float = field(default=0.25, kw_only=True)


@dataclass(frozen=True)
class Bars(Mark):
    """Bars from `start` to `value`, between the places `low` and `high`."""

    low: Any
    high: Any
    value: Any
    start: float = 0.0
    horizontal: bool = False
    more: Mapping[str, tuple[Any, str]] = field(default_factory=dict)


@dataclass(frozen=True)
class Whiskers(Mark):
    """Intervals at places: along y, or along x if `horizontal`."""

    place: Any
    low: Any
    high: Any
    horizontal: bool = False
    width: float = 1.0


@dataclass(frozen=True)
class Span(Mark):
    """A place on one axis, or the range up to `high`, over the whole panel.

    Parameters
    ----------
    low, high : float
        The place, or the ends of a range.
    across : {"x", "y"}
        The axis of the place.
    reach : float
        Part of the panel over which the line is drawn.
    """

    low: float
    high: float | None = None
    across: Literal["x", "y"] = "x"
    dash: str = "-"
    width: float = 1.0
    reach: float = 1.0


@dataclass(frozen=True)
class Image(_Placed):
    """Values on a grid as colours, with a scale that starts at zero.

    Parameters
    ----------
    x, y : ndarray
        Places of the values, of one axis each or of the shape of the values.
    value : ndarray, shape (y, x)
    axis : Axis
        Name and unit of the values.
    colours : str
        Name of a colour map.
    """

    value: Any
    axis: Axis
    colours: str = PRESSURE


@dataclass(frozen=True)
class Contours(_Placed):
    """Areas between levels of a value on a grid, of the same shapes as of an `Image`."""

    value: Any
    levels: Sequence[float]
    colours: Sequence[str]
    outlined: bool = False


@dataclass(frozen=True)
class Arrows(_Placed):
    """Vectors at points, drawn relative to the longest one."""

    along_x: Any
    along_y: Any


@dataclass(frozen=True)
class Patch(_Placed):
    """A filled polygon, under the other marks."""


@dataclass(frozen=True)
class Text(_Placed):
    """A text at a place.

    Parameters
    ----------
    x, y : float
        Place [SI], or part of the panel.
    text : str
    parts : {"", "x", "y"}
        The coordinate that is a part of the panel.
    offset : tuple of float
        Distance of the text from the place [points].
    anchor : {"left", "center", "right"}
    bold : bool
    size : float
        Size of the letters [points].
    figure_only : bool
        Whether the text is left out on a page, where the answer states it.
    """

    text: str
    parts: Literal["", "x", "y"] = ""
    offset: tuple[float, float] = (0.0, 0.0)
    anchor: Literal["left", "center", "right"] = "left"
    bold: bool = False
    size: float = 8.0
    figure_only: bool = False


Drawn: TypeAlias = Sequence[Mark]


@dataclass(frozen=True)
class Panel:
    """A panel of a figure, and a figure of a page.

    Parameters
    ----------
    title : str
    x, y : Axis
    marks : sequence of Mark
        From below to above.
    caption : str
        What the panel shows, in a sentence; the alternative text on a page.
    right : Axis, optional
        Axis of the marks at the right.
    legend : str
        Place of the legend in a figure, "below" for under the panel, empty for none.
    columns : int
        Columns of the legend.
    equal : bool
        Whether both axes have one scale.
    message : str
        Text instead of marks, where there is nothing to draw.
    figure_only : bool
        Whether the panel is left out on a page.
    """

    title: str
    x: Axis
    y: Axis
    marks: Drawn
    caption: str = ""
    right: Axis | None = None
    legend: str = "best"
    columns: int = 1
    equal: bool = False
    message: str = ""
    figure_only: bool = False


def dots(x: Any, y: Any, marker: str = "o", **style: Any) -> Line:
    """Return points without a curve."""
    return Line(x, y, dash="", marker=marker, **style)


def message(title: str, *lines: str) -> Panel:
    """Return a panel that has nothing to draw, with the reason."""
    return Panel(title, Axis(), Axis(), (), message="\n".join(lines), figure_only=True)


@dataclass(frozen=True)
class Sheet:
    """All panels of a view, and how a figure arranges them.

    Parameters
    ----------
    title : str
        Title of the figure; further lines are its caption.
    panels : mapping of str to Panel
        By their names; a page shows them in this order.
    rows : sequence of sequence of str
        Names of the panels as they stand in the figure; a name in several places spans them.
    size : tuple of float
        Width and height of the figure [in].
    widths, heights : sequence of float, optional
        Ratios of the columns and the rows.
    scale_beside : sequence of str
        Panels beside which the colours of the records are explained.
    steps : sequence of str
        Text of each record, for the slider of a page.
    main : str
        Name of the panel that stands for all; the first one by default.
    """

    title: str
    panels: Mapping[str, Panel]
    rows: Sequence[Sequence[str]]
    size: tuple[float, float]
    widths: Sequence[float] | None = None
    heights: Sequence[float] | None = None
    scale_beside: Sequence[str] = ()
    steps: Sequence[str] = ()
    main: str = ""

    @property
    def first(self) -> Panel:
        """The panel that stands for all."""
        return self.panels[self.main] if self.main else next(iter(self.panels.values()))


def evenly_spaced(count: int, most: int) -> IntArray:
    """Return at most `most` evenly spaced indices of `count` items, with the first and the last."""
    return np.unique(np.linspace(0, count - 1, min(count, most)).round().astype(np.int64))


def worn_limits(y: FloatArray, worn: FloatArray, *others: FloatArray) -> tuple[float, float]:
    """Return the range of y in which something is worn, with a margin, that includes others [m]."""
    inside = y[worn > 1e-3 * worn.max()] if worn.max() > 0.0 else y
    margin = 0.08 * float(inside[-1] - inside[0])
    ends = [
        *(float(inside[0]) - margin, float(inside[-1]) + margin),
        *(float(end) for other in others for end in (other.min(), other.max())),
    ]
    return min(ends), max(ends)


def depth_axes(
    passes: FloatArray, depth: FloatArray, name: str = "depth"
) -> tuple[BoolArray, Axis, Axis]:
    """Return the points of a depth against passes that are drawn, and their axes.

    Both axes are logarithmic from two decades of passes on.
    """
    worn = (passes > 0.0) & (depth > 0.0)
    if worn.sum() > 3 and passes[worn][-1] > 100.0 * passes[worn][0]:
        return worn, Axis("roller passes", log=True), Axis(name, "um", log=True)
    return passes >= 0.0, pass_axis(float(passes[-1])), Axis(name, "um")


def share_axis(name: str) -> Axis:
    """Return an axis of shares from 0 to 100 %."""
    return Axis(name, "%", limits=(0.0, 1.02))


def pass_axis(greatest: float) -> Axis:
    """Return an axis of roller passes up to a number."""
    size, name = pass_unit(greatest)
    return Axis(name, per_si=1.0 / size)


def histogram(values: FloatArray, classes: int | None = None) -> tuple[Bars, FloatArray]:
    """Return the density of values as bars, and the edges of the classes; by Rice's rule."""
    if classes is None:
        classes = int(np.clip(np.ceil(2.0 * len(values) ** (1.0 / 3.0)), *_CLASSES))
    number, edges = np.histogram(values, classes)
    density = number / (len(values) * np.diff(edges))
    more = {"realisations": (number, "1")}
    return Bars(edges[:-1], edges[1:], density, label="realisations", alpha=0.45, more=more), edges


def convergence(
    title: str,
    name: str,
    unit: str,
    counts: IntArray,
    value: FloatArray,
    low: FloatArray,
    high: FloatArray,
    marks: Drawn = (),
) -> Panel:
    """Return an estimate against the number of realisations, with its interval as a band.

    Parameters
    ----------
    title, name, unit : str
        Title of the panel, and name and unit of the estimate.
    counts : ndarray of int, shape (points,)
        Numbers of realisations, ascending.
    value, low, high : ndarray, shape (points,)
        Estimate and ends of its interval, nan or infinite where unknown.
    marks : sequence of Mark
        Further marks.
    """
    known, last = np.isfinite(low) & np.isfinite(high), int(counts[-1])
    limits: tuple[float | None, float | None] = (None, None)
    if np.isfinite(value[-1]) and not np.any(known & (high > low)):
        top = 2.0 * float(value[-1]) or 1.0
        limits = (-0.05 * top, top)  # keeps a line at zero off the axis
    drawn: list[Mark] = [
        Band(counts, np.where(known, low, np.nan), np.where(known, high, np.nan)),
        Line(counts, value, marker="o" if len(counts) == 1 else ""),
    ]
    scaling = (counts >= min(max(_SCALED_FROM, _SCALED_PART * last), last)) & known
    if scaling.any() and (high - low)[scaling].max() > 0.0:
        least, greatest = float(low[scaling].min()), float(high[scaling].max())
        margin = 0.05 * (greatest - least)
        limits = (least - margin, greatest + margin)
        drawn.append(Span(value[-1], across="y", dash="--", width=0.8, colour=GREY))
    is_log = last > _LINEAR_UP_TO
    ends = (0.5 * _SCALED_FROM if is_log else 1.0, max(2.0, 1.05 * last))
    whole = None if is_log else np.unique(np.linspace(1, last, min(last, 10)).round()).tolist()
    return Panel(
        title,
        Axis("realisations", log=is_log, limits=ends, ticks=whole),
        Axis(name, unit, limits=limits),
        [*drawn, *marks],
        f"The estimate from the first realisations, up to {count(last)} of them.",
    )


def several_colours(number: int) -> list[str]:
    """Return a colour for each of several curves, from a scale if they are many."""
    if number <= len(COLOURS):
        return list(COLOURS[:number])
    places = np.linspace(0, len(_VIRIDIS) - 1, number).round().astype(int)
    return [_VIRIDIS[place] for place in places]


def measured_marks(measured: Sequence[Measured]) -> list[Line]:
    """Return measured profiles as points of a panel."""
    return [
        Line(
            profile.y,
            profile.height,
            dash="",
            marker=MARKS[number % len(MARKS)],
            size=3.2,
            open=True,
            colour=RED,
            label=f"measured: {profile.label}",
        )
        for number, profile in enumerate(measured)
    ]

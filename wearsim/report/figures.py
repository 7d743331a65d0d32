"""Figures of panels drawn with matplotlib, and their style."""

from __future__ import annotations

import io
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from itertools import groupby
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LogNorm, Normalize
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullFormatter, NullLocator

from wearsim.atomic_write import replacement
from wearsim.report.panels import (
    BLACK,
    RECORDS,
    Arrows,
    Axis,
    Band,
    Bars,
    Contours,
    Image,
    Line,
    Mark,
    Panel,
    Patch,
    Records,
    Sheet,
    Span,
    Text,
    Whiskers,
    evenly_spaced,
)
from wearsim.report.text import count, pass_unit
from wearsim.types import FloatArray

DPI = 150
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
_BELOW: dict[str, Any] = {
    "loc": "upper center", "bbox_to_anchor": (0.5, -0.12), "columnspacing": 1.2,
}  # fmt: skip


@contextmanager
def figure_style() -> Iterator[None]:
    """Apply the settings of wearsim to the figures drawn in the context."""
    with mpl.rc_context(_SETTINGS):
        yield


class _Figure(Figure):
    """Figure that notebooks show; figures of pyplot are shown without this."""

    def _repr_png_(self) -> bytes:
        return png_of(self, DPI)


@contextmanager
def titled_figure(width: float, height: float, title: str | None = None) -> Iterator[Figure]:
    """Give a figure of a width and height in inches, drawn with the settings of wearsim."""
    with figure_style():
        figure = _Figure(figsize=(width, height), layout="constrained")
        if title:
            figure.suptitle(title, fontsize=10.5)
        yield figure


def png_of(figure: Figure, dpi: int) -> bytes:
    """Return a figure as the content of a PNG file."""
    content, before = io.BytesIO(), figure.dpi
    canvas: Any = FigureCanvasAgg(figure)
    figure.dpi = dpi
    try:
        canvas.print_png(content)  # savefig would draw twice
    finally:
        figure.dpi = before
    return content.getvalue()


def save_figure(figure: Figure, path: Path) -> None:
    """Write a figure; the suffix gives the format.

    Parameters
    ----------
    figure : Figure
    path : Path
        Ends in .png, .pdf or .svg; an existing file is replaced.

    Raises
    ------
    ResultsFileError
        If it cannot be written; an existing file is then unchanged.
    """
    kind = path.suffix[1:].lower()
    with replacement(path) as file:
        if kind == "png":
            file.write(png_of(figure, DPI))
        else:
            figure.savefig(file, format=kind, dpi=DPI)


def figure_of(sheet: Sheet) -> Figure:
    """Return the figure of all panels of a view, in the arrangement of its sheet."""
    with titled_figure(*sheet.size, sheet.title) as figure:
        axes = dict(_arranged(figure, sheet))
        for name, panel in axes.items():
            draw(panel, sheet.panels[name])
        if sheet.scale_beside:
            _draw_scale(figure, sheet, [axes[name] for name in sheet.scale_beside])
    return figure


def _arranged(figure: Figure, sheet: Sheet) -> Iterator[tuple[str, Axes]]:
    """Yield the names of panels with their axes; rows of different lengths are arranged apart."""
    rows = zip(map(list, sheet.rows), sheet.heights or [1.0] * len(sheet.rows), strict=True)
    groups = [list(zip(*group, strict=True)) for _, group in groupby(rows, lambda row: len(row[0]))]
    parts: Any = [figure]
    if len(groups) > 1:
        parts = figure.subfigures(len(groups), 1, height_ratios=[sum(part) for _, part in groups])
    for part, (mosaic, heights) in zip(parts, groups, strict=True):
        axes = part.subplot_mosaic([*mosaic], width_ratios=sheet.widths, height_ratios=heights)
        yield from axes.items()


def png_of_panel(panel: Panel, dpi: int = 100, height: float = 3.1) -> bytes:
    """Return one panel as the content of a small PNG file."""
    with titled_figure(5.2, height) as figure:  # as wide as the longest title
        draw(figure.subplots(), panel)
        return png_of(figure, dpi)


def draw(axes: Axes, panel: Panel) -> None:
    """Draw a panel on axes."""
    if panel.message:
        write_message(axes, panel.title, [panel.message])
        return
    name_axes(axes, panel.title, _label(panel.x), _label(panel.y))
    axes.set(**{f"{along}scale": "log" for along in "xy" if getattr(panel, along).log})
    sides = {False: (axes, panel.y)}
    if panel.right is not None:
        other = axes.twinx()
        other.set_ylabel(_label(panel.right))
        other.spines["right"].set_visible(True)
        other.grid(visible=False)
        sides[True] = other, panel.right
    for mark in panel.marks:
        _draw(mark, panel.x, *sides[mark.right])
    if panel.equal:
        axes.set_aspect("equal")
        axes.set_anchor("N")
    _set_axis(axes, "x", panel.x)
    for drawn_on, y in sides.values():
        _set_axis(drawn_on, "y", y)
    if panel.legend and axes.get_legend_handles_labels()[0]:
        axes.legend(
            **_BELOW if panel.legend == "below" else {"loc": panel.legend}, ncols=panel.columns
        )


def _set_axis(axes: Axes, along: str, axis: Axis) -> None:
    """Set limits and ticks of an axis, after all marks are drawn."""
    ticks: Any = axes.xaxis if along == "x" else axes.yaxis
    limits = axis.ends()
    if any(axis.margin):
        low, high = ticks.get_view_interval()
        below, above = (part * (high - low) for part in axis.margin)
        limits = axis.ends(low - below, high + above)
    axes.set(**{f"{along}lim": limits})
    if axis.ticks is not None:
        ticks.set_ticks([tick * axis.scale for tick in axis.ticks], labels=axis.names)
        ticks.set_minor_locator(NullLocator())
    elif axis.log:
        low, high = sorted(ticks.get_view_interval())
        decades = float(np.log10(high / low))
        # powers of ten, twice and five times them are too few in less than a decade
        if decades < 1.0:
            ticks.set_major_locator(MaxNLocator(7, steps=[1, 2, 5, 10]))
        elif decades < 2.3:
            ticks.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        ticks.set_major_formatter(FuncFormatter(lambda value, _: _plain(value)))
        ticks.set_minor_formatter(NullFormatter())
        if decades < 2.3:
            ticks.set_minor_locator(NullLocator())


def _label(axis: Axis) -> str:
    return axis.label.replace("^2", "$^2$")


def _plain(value: float) -> str:
    """Return the label of a tick without an exponent, as far as it is short."""
    return count(value) if 1e3 <= value < 1e9 else f"{value:g}"


def _draw(mark: Mark, x: Axis, axes: Axes, y: Axis) -> None:
    """Draw a mark on axes, in the units of both."""
    style: dict[str, Any] = {"color": mark.colour, "alpha": mark.alpha}
    named = {**style, "label": mark.label or None}
    match mark:
        case Line():
            values, style = (
                np.asarray(mark.y),
                style | ({"mfc": "white", "zorder": 5} if mark.open else {}),
            )
            lines = axes.plot(
                np.asarray(mark.x) * x.scale,
                (values.T if values.ndim > 1 else values) * y.scale,
                ls=mark.dash or "none",
                marker=mark.marker,
                lw=mark.width,
                ms=mark.size,
                mew=1.4 if mark.marker == "|" else 0.7,
                drawstyle="steps-post" if mark.steps else "default",
                markevery=[-1] if mark.at_end else None,
                **style,
            )
            lines[0].set_label(mark.label or "_line")
        case Records():
            chosen, colours = evenly_spaced(len(mark.passes), 24), _Colours(mark.passes)
            for record in chosen[evenly_spaced(len(chosen), mark.most)]:
                axes.plot(
                    mark.x * x.scale, mark.y[record] * y.scale, mark.dash,
                    color=colours.of(record), lw=1.1,
                )  # fmt: skip
            if mark.label:
                axes.plot([], [], mark.dash, color=BLACK, label=mark.label)
        case Band():
            step: Any = "post" if mark.steps else None
            low, high = mark.low * y.scale, mark.high * y.scale
            axes.fill_between(mark.x * x.scale, low, high, lw=0, step=step, **named)
        case Bars():
            place, size = (x, y) if not mark.horizontal else (y, x)
            low, start = np.asarray(mark.low) * place.scale, mark.start * size.scale
            width = np.asarray(mark.high) * place.scale - low
            length = np.asarray(mark.value) * size.scale - start
            if mark.horizontal:
                axes.barh(low, length, width, left=start, align="edge", **named)
            else:
                axes.bar(low, length, width, bottom=start, align="edge", **named)
        case Whiskers():
            place, size = (y, x) if mark.horizontal else (x, y)
            ends = np.array([mark.low, mark.high], dtype=float) * size.scale
            places = np.broadcast_to(np.asarray(mark.place, dtype=float) * place.scale, ends.shape)
            both = [places, ends][:: -1 if mark.horizontal else 1]
            axes.plot(*both, lw=mark.width, solid_capstyle="butt", **style)
        case Span():
            along, scale = ("v", x.scale) if mark.across == "x" else ("h", y.scale)
            if mark.high is not None:
                getattr(axes, f"ax{along}span")(mark.low * scale, mark.high * scale, lw=0, **named)
            else:
                getattr(axes, f"ax{along}line")(
                    mark.low * scale, 0.0, mark.reach, ls=mark.dash, lw=mark.width, **named
                )
        case Image():
            grid = mark.x * x.scale, mark.y * y.scale, mark.value * mark.axis.scale
            mesh = axes.pcolormesh(
                *grid, shading="nearest" if np.ndim(mark.x) == 1 else "gouraud",
                cmap=mark.colours, vmin=0.0, rasterized=True,
            )  # fmt: skip
            axes.grid(visible=False)
            figure: Any = axes.figure
            figure.colorbar(mesh, ax=axes, label=_label(mark.axis), pad=0.02, aspect=24)
        case Contours():
            grid = mark.x * x.scale, mark.y * y.scale, mark.value
            axes.contourf(*grid, levels=list(mark.levels), colors=list(mark.colours))
            if mark.outlined:
                axes.contour(*grid, list(mark.levels[:-1]), colors=mark.colour, linewidths=0.8)
        case Arrows():
            longest = float(np.hypot(mark.along_x, mark.along_y).max(initial=0.0))
            if longest > 0.0:
                axes.quiver(
                    mark.x * x.scale, mark.y * y.scale, mark.along_x, mark.along_y,
                    color=mark.colour, scale=17.0 * longest, width=0.004, pivot="middle",
                )  # fmt: skip
        case Patch():
            axes.fill(mark.x * x.scale, mark.y * y.scale, lw=0, zorder=0, **named)
        case Text():
            coordinates = {"x": ("data", mark.x * x.scale), "y": ("data", mark.y * y.scale)}
            if mark.parts:
                coordinates[mark.parts] = "axes fraction", getattr(mark, mark.parts)
            (along, at_x), (up, at_y) = coordinates.values()
            axes.annotate(
                mark.text, (at_x, at_y), xycoords=(along, up),
                xytext=mark.offset, textcoords="offset points", ha=mark.anchor,
                color=mark.colour, weight="bold" if mark.bold else "normal", fontsize=mark.size,
            )  # fmt: skip


class _Colours:
    """Colours of records by roller passes; the start of the run is black."""

    def __init__(self, passes: FloatArray) -> None:
        worn = passes[passes > 0.0]
        last = float(worn[-1]) if len(worn) else 1.0
        crowded = len(worn) > 2 and float(np.median(worn)) < 0.15 * last
        unit, self.name = (1.0, "roller passes") if crowded else pass_unit(last)
        self._passes = passes / unit
        self.norm = LogNorm(float(worn[0]), last) if crowded else Normalize(0.0, last / unit)
        self.map = colormaps[RECORDS].reversed()

    def of(self, record: int) -> Any:
        """Return the colour of a record."""
        passes = float(self._passes[record])
        return self.map(self.norm(passes)) if passes > 0.0 else BLACK


def _draw_scale(figure: Figure, sheet: Sheet, beside: list[Axes]) -> None:
    """Draw the scale of the colours of the records beside panels."""
    marks = sheet.panels[sheet.scale_beside[0]].marks
    colours = _Colours(next(mark.passes for mark in marks if isinstance(mark, Records)))
    figure.colorbar(
        ScalarMappable(colours.norm, colours.map),
        ax=beside,
        label=colours.name,
        aspect=45,
        pad=0.02,
    )


def name_axes(axes: Axes, title: str, x: str, y: str) -> None:
    """Set the title of a panel and the labels of its axes."""
    axes.set(title=title, xlabel=x, ylabel=y)


def write_message(axes: Axes, title: str, lines: Sequence[str]) -> None:
    """Write lines of text into a panel that has nothing to draw."""
    axes.text(0.5, 0.5, "\n".join(lines), ha="center", va="center", transform=axes.transAxes)
    axes.set_title(title)
    axes.set_axis_off()

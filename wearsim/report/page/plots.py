"""Panels drawn with Bokeh, with values under the pointer and a slider over the records."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from bokeh.models.annotations import BoxAnnotation, ColorBar, Label, Span as Rule
from bokeh.models.axes import LinearAxis
from bokeh.models.formatters import BasicTickFormatter, NumeralTickFormatter
from bokeh.models.labeling import NoOverlap
from bokeh.models.mappers import LinearColorMapper
from bokeh.models.ranges import DataRange1d, Range1d
from bokeh.models.sources import ColumnDataSource
from bokeh.models.tickers import FixedTicker
from bokeh.models.tools import HoverTool
from bokeh.palettes import Magma256, Viridis256
from bokeh.plotting import figure

from wearsim.report.panels import (
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
from wearsim.report.text import with_unit

MOST_RECORDS, MOST_CURVES, MOST_POINTS = 60, 20, 2000
RECORD = "record"  # start of the names of the sources that the slider of the page changes
_DASHES: dict[str, Any] = {"-": "solid", "--": "dashed", ":": "dotted", "-.": "dashdot"}
_MARKERS: dict[str, Any] = {
    "o": "circle", ".": "circle", "s": "square", "^": "triangle", "D": "diamond",
    "v": "inverted_triangle", "+": "cross", "|": "dash",
}  # fmt: skip
_PALETTES = {"magma": Magma256, "magma_r": Magma256[::-1], "viridis": Viridis256}
_LABELS: dict[str, Any] = {
    "axis_label_text_font_style": "normal", "axis_label_text_font_size": "14px",
    "major_label_text_font_size": "13px", "axis_label_text_color": "#222222",
    "major_label_text_color": "#222222",
}  # fmt: skip
_LEGEND: dict[str, Any] = {
    "ncols": 2, "orientation": "horizontal", "border_line_alpha": 0.0, "click_policy": "hide",
    "padding": 4, "label_text_font_size": "13px", "label_text_color": "#222222",
}  # fmt: skip
_CELLS = 301  # of an image along each axis, if its places are irregular


def panels_of(sheet: Sheet) -> tuple[dict[str, Panel], list[str]]:
    """Return the panels of a page by name, and the texts of the slider.

    Parameters
    ----------
    sheet : Sheet
    """
    kept = evenly_spaced(len(sheet.steps), MOST_RECORDS) if sheet.steps else ()
    return (
        {name: panel for name, panel in sheet.panels.items() if not panel.figure_only},
        [sheet.steps[number] for number in kept],
    )


def draw(panel: Panel) -> Any:
    """Return the figure of a panel."""
    plot: Any = figure(
        height=340,
        sizing_mode="stretch_width",
        tools="pan,box_zoom,wheel_zoom,reset,save",
        active_scroll=None,
        x_axis_label=plain_label(panel.x.label),
        y_axis_label=plain_label(panel.y.label),
        toolbar_location="above",
        min_border_right=14,  # for half of the last tick label
        x_axis_type="log" if panel.x.log else "linear",
        y_axis_type="log" if panel.y.log else "linear",
        match_aspect=panel.equal,
    )
    plot.toolbar.logo = None
    for along, axis in (("x", panel.x), ("y", panel.y)):
        _set_axis(plot, along, replace(axis, limits=(None, None)) if is_boxed(panel) else axis)
    if panel.right is not None:
        plot.extra_y_ranges = {"right": Range1d(**right_ends(panel, panel.right))}
        plot.add_layout(
            LinearAxis(y_range_name="right", axis_label=plain_label(panel.right.label)), "right"
        )
    for axis in (*plot.xaxis, *plot.yaxis):
        axis.update(major_label_policy=NoOverlap(), **_LABELS)
    plot.grid.grid_line_color = "#e4e4e4"
    draw_marks(plot, panel)
    for legend in plot.legend:
        plot.add_layout(legend, "below")
        legend.update(**_LEGEND)
    return plot


def right_ends(panel: Panel, right: Axis) -> dict[str, Any]:
    """Return the "start" and "end" of the axis at the right of a panel, in its unit.

    They make a plain range, since one that follows the data would follow both axes.
    """
    lines = (mark for mark in panel.marks if isinstance(mark, Line) and mark.right)
    data = np.concatenate([np.ravel(line.y) for line in lines]) * right.scale
    least, greatest = float(np.nanmin(data)), float(np.nanmax(data))
    margin = 0.05 * (greatest - least)
    return range_ends(right, least - margin, greatest + margin)


def is_boxed(panel: Panel) -> bool:
    """Return whether a panel has one scale and fixed ends: its axes must then follow a box.

    Bokeh keeps one scale only on axes that follow the data.
    """
    return panel.equal and None not in (*panel.x.limits, *panel.y.limits)


def draw_marks(plot: Any, panel: Panel) -> None:
    """Draw the marks of a panel on a figure that has its axes."""
    if is_boxed(panel):
        box = _single({"x": panel.x.ends(), "y": panel.y.ends()})
        plot.line("x", "y", source=_source(plot, box), line_alpha=0.0)
    for mark in panel.marks:
        y = panel.right if mark.right and panel.right else panel.y
        _draw(plot, mark, panel.x, y, {"y_range_name": "right"} if mark.right else {})


def plain_label(text: str) -> str:
    """Return a label without the marks of matplotlib's mathematical text."""
    return text.replace("$", "").replace("_l", "").replace("_d", "").replace("\n", " ")


def range_ends(axis: Axis, *default: float) -> dict[str, Any]:
    """Return the "start" and "end" of an axis in its unit, without those that follow the data."""
    ends = zip(("start", "end"), axis.ends(*default), strict=True)
    return {name: end for name, end in ends if end is not None}


def _set_axis(plot: Any, along: str, axis: Axis) -> None:
    ends = range_ends(axis)
    # ticks at the places of the data only, without the lines of annotations
    shown = Range1d(**ends) if len(ends) > 1 else DataRange1d(only_visible=True, **ends)
    plot.update(**{f"{along}_range": shown})
    ticks = plot.xaxis if along == "x" else plot.yaxis
    if axis.ticks is not None:
        places = [float(tick * axis.scale) for tick in axis.ticks]
        ticks.ticker = FixedTicker(ticks=places)
        if axis.names is not None:
            ticks.major_label_overrides = dict(
                zip(places, map(plain_label, axis.names), strict=True)
            )
    else:
        ticks.formatter = (
            NumeralTickFormatter(format="0,0.[00000]")
            if axis.log
            else BasicTickFormatter(power_limit_low=-4, power_limit_high=8, precision="auto")
        )


def _source(plot: Any, columns: Mapping[str, Any], name: str | None = None) -> Any:
    """Return the source of columns on a figure, and the columns alone for a recorder."""
    return ColumnDataSource(columns, name=name) if isinstance(plot, figure) else columns


def _single(columns: Mapping[str, Any]) -> dict[str, Any]:
    """Return columns, numbers in single precision."""
    arrays = {name: np.asarray(values) for name, values in columns.items()}
    return {
        name: array.astype(np.float32) if array.dtype.kind == "f" else array
        for name, array in arrays.items()
    }


def _colour(colour: Any) -> Any:
    """Return a colour of matplotlib as one of CSS; "0.3" is a grey."""
    if not (isinstance(colour, str) and colour.replace(".", "").isdigit()):
        return colour
    return f"#{f'{round(255 * float(colour)):02x}' * 3}"


def _draw(plot: Any, mark: Mark, x: Axis, y: Axis, on: dict[str, Any]) -> None:
    """Draw a mark in the units of both axes."""
    named = {"legend_label": plain_label(mark.label)} if mark.label else {}
    style = {"color": _colour(mark.colour), "alpha": mark.alpha, **on}
    match mark:
        case Line():
            _draw_line(plot, mark, x, y, style, named)
        case Records():
            _draw_records(plot, mark, x, y, named)
        case Band():
            _draw_band(plot, mark, x, y, style, named)
        case Bars():
            _draw_bars(plot, mark, x, y, style, named)
        case Whiskers():
            place, size = (y, x) if mark.horizontal else (x, y)
            at = np.asarray(mark.place, dtype=float) * place.scale
            low, high = (np.asarray(end, dtype=float) * size.scale for end in (mark.low, mark.high))
            data = _source(plot, _single({"at": at, "low": low, "high": high}))
            ends = ("low", "at", "high", "at") if mark.horizontal else ("at", "low", "at", "high")
            plot.segment(*ends, source=data, line_width=max(mark.width, 1.5), **style)
        case Span():
            _draw_span(plot, mark, (x if mark.across == "x" else y).scale, named)
        case Image():
            _draw_image(plot, mark, x, y)
        case Contours():
            plot.contour(
                np.asarray(mark.x) * x.scale, np.asarray(mark.y) * y.scale, mark.value,
                list(mark.levels), fill_color=list(mark.colours),
            )  # fmt: skip
        case Arrows():
            longest = float(np.hypot(mark.along_x, mark.along_y).max(initial=0.0)) or 1.0
            width = 0.04 * float(np.ptp(mark.x)) * x.scale / longest
            height = 0.04 * float(np.ptp(mark.y)) * y.scale / longest
            tail_x, tail_y = np.ravel(mark.x) * x.scale, np.ravel(mark.y) * y.scale
            places = {
                "x": tail_x,
                "y": tail_y,
                "tip_x": tail_x + width * np.ravel(mark.along_x),
                "tip_y": tail_y + height * np.ravel(mark.along_y),
            }
            data = _source(plot, _single(places))
            plot.segment("x", "y", "tip_x", "tip_y", source=data, **style)
        case Patch():
            data = _source(plot, _single({"x": mark.x * x.scale, "y": mark.y * y.scale}))
            plot.patch("x", "y", source=data, line_alpha=0.0, **style, **named)
        case Text() if not mark.figure_only:
            _draw_text(plot, mark, x, y)


def _hover(plot: Any, renderers: Sequence[Any], *tips: tuple[str, str], line: bool = False) -> None:
    """Show values of the drawn data under the pointer, of a line also above and below it."""
    if None in renderers:  # recorded without a figure
        return
    columns = [text.partition("{")[0] for _, text in tips if text[0] == "@" and "{" in text]
    plot.add_tools(
        HoverTool(
            renderers=list(renderers), tooltips=list(tips), mode="vline" if line else "mouse",
            formatters=dict.fromkeys(columns, "printf"),
        )
    )  # fmt: skip


def _tip(axis: Axis, column: str, name: str = "") -> tuple[str, str]:
    """Return the name of an axis, and the text of a column in its unit."""
    text = with_unit(f"@{column}{{%.5g}}", plain_label(axis.unit))
    return plain_label(name or axis.name or "value"), text


def _more(mark: Line | Bars) -> tuple[dict[str, Any], list[tuple[str, str]]]:
    """Return the further values of a mark as columns in their units, and their texts."""
    axes = {Axis(name, unit): values for name, (values, unit) in mark.more.items()}
    columns = {f"more{k}": np.asarray(v) * axis.scale for k, (axis, v) in enumerate(axes.items())}
    return columns, [_tip(axis, name) for axis, name in zip(axes, columns, strict=True)]


def _draw_line(
    plot: Any, mark: Line, x: Axis, y: Axis, style: dict[str, Any], named: dict[str, Any]
) -> None:
    values = np.asarray(mark.y, dtype=float) * y.scale
    places = np.asarray(mark.x, dtype=float) * x.scale
    if values.ndim > 1:
        some = values[:MOST_CURVES].astype(np.float32)
        curves = {"x": [places.astype(np.float32)] * len(some), "y": list(some)}
        plot.multi_line("x", "y", source=_source(plot, curves), line_width=1, **style, **named)
        return
    if not len(places):
        return
    every = evenly_spaced(len(places), len(places) if mark.dash else MOST_POINTS)
    further, more_tips = _more(mark)
    columns = {"x": places, "y": values, **further}
    source = _source(plot, _single({name: column[every] for name, column in columns.items()}))
    line = {
        "source": source,
        "line_width": max(1.5 * mark.width, 1.0),
        "line_dash": _DASHES.get(mark.dash, "solid"),
    }
    if mark.dash and mark.steps:
        plot.step("x", "y", mode="after", **line, **style, **named)
        # values under the pointer need a line, which steps do not have
        pointed = plot.line("x", "y", source=source, line_alpha=0.0)
    elif mark.dash:
        pointed = plot.line("x", "y", **line, **style, **named)
    if mark.marker and not mark.at_end:
        look = {
            "marker": _MARKERS[mark.marker],
            "size": max(mark.size, 2.0) * 1.3,
            **({"fill_color": "white"} if mark.open else {}),
            **({"angle": 0.5 * np.pi} if mark.marker == "|" else {}),
        }
        points = plot.scatter("x", "y", source=source, **look, **style, **named)
        pointed = pointed if mark.dash else points
    tips = [_tip(x, "x"), _tip(y, "y", mark.label.split("\n")[0]), *more_tips]
    _hover(plot, [pointed], *tips, line=bool(mark.dash))


def _draw_records(plot: Any, mark: Records, x: Axis, y: Axis, named: dict[str, Any]) -> None:
    """Draw the record of the slider; the values of the others are kept beside it."""
    chosen = evenly_spaced(len(mark.passes), MOST_RECORDS)
    values = np.asarray(mark.y) * y.scale
    columns = {
        "x": np.asarray(mark.x) * x.scale,
        **{str(place): values[record] for place, record in enumerate(chosen)},
        "shown": values[chosen[-1]],
    }
    source = _source(plot, _single(columns), f"{RECORD} {mark.label or y.name}")
    line = plot.line(
        "x", "shown", source=source,
        color=_colour(mark.colour), line_dash=_DASHES[mark.dash], line_width=2, **named,
    )  # fmt: skip
    _hover(plot, [line], _tip(x, "x"), _tip(y, "shown", mark.label), line=True)


def _draw_band(
    plot: Any, mark: Band, x: Axis, y: Axis, style: dict[str, Any], named: dict[str, Any]
) -> None:
    places = np.asarray(mark.x, dtype=float) * x.scale
    low, high = (np.asarray(end, dtype=float) * y.scale for end in (mark.low, mark.high))
    if mark.steps:
        low, high = (np.repeat(end, 2)[:-1] for end in (low, high))
        places = np.repeat(places, 2)[1:]
    source = _source(plot, _single({"x": places, "low": low, "high": high}))
    plot.varea("x", "low", "high", source=source, **style, **named)
    # values under the pointer need a line, which areas do not have
    line = plot.line("x", "high", source=source, line_alpha=0.0)
    name, end = _tip(y, "high", mark.label or "interval")
    _hover(plot, [line], (name, f"@low{{%.5g}} to {end}"), line=True)


def _draw_bars(
    plot: Any, mark: Bars, x: Axis, y: Axis, style: dict[str, Any], named: dict[str, Any]
) -> None:
    place, size = (y, x) if mark.horizontal else (x, y)
    further, more_tips = _more(mark)
    columns: dict[str, Any] = {
        "low": np.asarray(mark.low, dtype=float) * place.scale,
        "high": np.asarray(mark.high, dtype=float) * place.scale,
        "value": np.asarray(mark.value, dtype=float) * size.scale,
        "start": np.full(len(mark.low), mark.start * size.scale),
        **further,
    }
    if isinstance(mark.colour, list):
        columns["colour"] = mark.colour
        style = {**style, "color": "colour"}
    ends = {"left": "low", "right": "high", "bottom": "start", "top": "value"}
    tips = [_tip(size, "value")]
    if mark.horizontal:
        ends = {"bottom": "low", "top": "high", "left": "start", "right": "value"}
        names = list(place.names or ())
        middle = 0.5 * (np.asarray(mark.low) + np.asarray(mark.high))
        columns["name"] = [names[round(at)] for at in middle] if names else [""] * len(middle)
        tips.insert(0, ("", "@name"))
    elif place.names is None:
        tips.insert(0, (plain_label(place.name), f"@low{{%.5g}} to {_tip(place, 'high')[1]}"))
    bars = plot.quad(**ends, source=_source(plot, _single(columns)), **style, **named)
    _hover(plot, [bars], *tips, *more_tips)


def _draw_span(plot: Any, mark: Span, scale: float, named: dict[str, Any]) -> None:
    low, colour = float(mark.low * scale), _colour(mark.colour)
    across = mark.across == "x"
    if mark.high is not None:
        high: Any = float(mark.high * scale)
        ends = {"left": low, "right": high} if across else {"bottom": low, "top": high}
        plot.add_layout(BoxAnnotation(fill_color=colour, fill_alpha=mark.alpha, **ends))
        return
    plot.add_layout(
        Rule(
            location=low, dimension="height" if across else "width", line_color=colour,
            line_dash=_DASHES[mark.dash], line_width=max(1.5 * mark.width, 1.0),
        )
    )  # fmt: skip
    if named:  # an annotation has no entry in the legend, a line without points has
        plot.line(
            "x", "y", source=_source(plot, _single({"x": [], "y": []})),
            color=colour, line_dash=_DASHES[mark.dash], line_width=2, **named,
        )  # fmt: skip


def _draw_image(plot: Any, mark: Image, x: Axis, y: Axis) -> None:
    """Draw values as colours, on a regular grid."""
    across, up = _regular(mark.x), _regular(mark.y)
    values = np.asarray(mark.value) * mark.axis.scale
    if np.ndim(mark.x) > 1:  # the places along y depend on those along x
        lines = zip(np.asarray(mark.y).T, values.T, strict=True)
        columns = [np.interp(up, *line, left=np.nan, right=np.nan) for line in lines]
        at = np.asarray(mark.x)[0]
        values = np.array([np.interp(across, at, row) for row in np.transpose(columns)])
    else:
        values = np.array([np.interp(across, mark.x, row) for row in values])
        values = np.array([np.interp(up, mark.y, column) for column in values.T]).T
    mapper = LinearColorMapper(
        palette=_PALETTES[mark.colours], low=0.0, high=float(np.nanmax(values)) or 1.0,
        nan_color="rgba(0, 0, 0, 0)",
    )  # fmt: skip
    drawn: dict[str, Any] = {
        "image": [values.astype(np.float32)],
        "x": [float(across[0] * x.scale)],
        "y": [float(up[0] * y.scale)],
        "dw": [float(np.ptp(across) * x.scale)],
        "dh": [float(np.ptp(up) * y.scale)],
    }
    source = _source(plot, drawn)
    picture = plot.image(source=source, color_mapper=mapper, **{name: name for name in drawn})
    plot.add_layout(
        ColorBar(
            color_mapper=mapper, width=12, title=plain_label(mark.axis.label),
            title_text_font_style="normal",
        ),
        "right",
    )  # fmt: skip
    _hover(
        plot,
        [picture],
        (plain_label(x.name), with_unit("$x{0.00}", x.unit)),
        (plain_label(y.name), with_unit("$y{0.00}", y.unit)),
        (plain_label(mark.axis.name), with_unit("@image{%.5g}", mark.axis.unit)),
    )


def _regular(places: Any) -> Any:
    """Return evenly spaced places over the range of given ones."""
    return np.linspace(np.nanmin(places), np.nanmax(places), min(np.shape(places)[-1] * 4, _CELLS))


def _draw_text(plot: Any, mark: Text, x: Axis, y: Axis) -> None:
    places: dict[str, Any] = {
        "x": float(mark.x * x.scale),
        "y": float(mark.y * y.scale),
        **({mark.parts: 3, f"{mark.parts}_units": "screen"} if mark.parts else {}),
    }
    plot.add_layout(
        Label(
            text=plain_label(mark.text), text_color=_colour(mark.colour), text_align=mark.anchor,
            text_font_size=f"{round(1.45 * mark.size)}px", x_offset=mark.offset[0],
            y_offset=mark.offset[1], text_font_style="bold" if mark.bold else "normal", **places,
        )
    )  # fmt: skip

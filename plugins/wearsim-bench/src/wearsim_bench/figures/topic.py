"""Figures of time against error with the Pareto front."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import ceil
from textwrap import fill

from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure, SubFigure

from wearsim.report.figures import figure_style, name_axes, write_message
from wearsim.report.panels import GREY
from wearsim.report.text import brief
from wearsim_bench.figures.lines import EndLabel, label_ends, set_log_axis
from wearsim_bench.figures.sizes import growth_figure, savings_figure
from wearsim_bench.figures.stated_errors import stated_errors_figure
from wearsim_bench.figures.table import measured_on
from wearsim_bench.measure.machine import Machine
from wearsim_bench.measure.measurement import Effort, Measurement, Topic

MOST = 6  # methods in one panel; a group of more has a panel for each family of methods
ACROSS = 3  # panels in a row of groups with few methods
_LETTERS = 120  # characters per line under the title
_FRONT, _DEFAULT = "Pareto front", "default"
_WIDTH, _HEIGHT, _SMALL_HEIGHT = 10.5, 3.1, 2.7  # of the figure and of rows of panels [in]
_PANEL = 0.7  # height of a panel without title and labels, as a part of its row
_TITLE = 0.9  # height of titles and legend [in]
_MARKERS = "osD^vP*X"
#: distinct also for the colour-blind, and dark enough for labels on white
_COLOURS = (
    "#0072b2", "#c2570c", "#117733", "#aa4499", "#8c6d00", "#332288", "#0e8a8a", "#882255",
)  # fmt: skip
_SMALLEST = 1e-8  # lower bound of the errors drawn


def bench_figure(topic: Topic, machine: Machine, effort: Effort) -> Figure:
    """Return the figure of a topic.

    Parameters
    ----------
    topic : Topic
        The topic.
    machine : Machine
        The machine of the measurements.
    effort : Effort
        Number of cases and repetitions.

    Returns
    -------
    Figure
        A panel for each group of problems: a labelled line for each method, a point for each
        setting, the Pareto front, a ring around the default. A group of many methods has a panel
        for each family, with the other families in grey. Or time and memory against size, or
        speed-ups.
    """
    under = fill(measured_on(machine, effort, topic.timing), _LETTERS)
    if "peak_bytes" in topic.counts:
        return growth_figure(topic, under)
    if "covered" in topic.counts:
        return stated_errors_figure(topic, under)
    if "times" in topic.counts:
        return savings_figure(topic, under)
    rows = list(_rows(topic))
    families = [len(_families(topic, row)) for row in rows]
    heights = [_SMALL_HEIGHT * ceil(n / ACROSS) if n else _HEIGHT for n in families]
    with figure_style():
        size = _WIDTH, _TITLE + sum(heights)
        figure = Figure(figsize=size, layout="constrained")
        parts = figure.subfigures(len(rows), 1, squeeze=False, height_ratios=heights).ravel()
        looks = _looks(topic)
        for part, row, several in zip(parts, rows, families, strict=True):
            if several:
                _draw_families(part, topic, row[0], looks)
            else:
                _draw_groups(part, topic, row, looks)
        _write_legend(figure)
        figure.suptitle(f"{topic.title}\n{under}", fontsize=10.0)
    return figure


def _rows(topic: Topic) -> Iterator[list[str]]:
    """Yield the groups of each row of panels: one of many methods, or several of few."""
    row: list[str] = []
    few = [group for group in topic.groups if len(_methods(topic.of(group))) <= MOST]
    across = min(ACROSS, len(few)) or 1
    for group in topic.groups:
        if group in few:
            row.append(group)
        if row and (group not in few or len(row) == across):
            yield row
            row = []
        if group not in few:
            yield [group]
    if row:
        yield row


def _methods(items: Sequence[Measurement]) -> list[str]:
    return list(dict.fromkeys(item.method for item in items))


def _family(method: str) -> str:
    """Return the family of a method: "slender" of "slender, strip"."""
    return method.partition(",")[0]


def _families(topic: Topic, groups: Sequence[str]) -> list[str]:
    """Return the families of a group of many methods; none of groups with few."""
    methods = _methods(_timed(topic, groups[0]))
    many = len(_methods(topic.of(groups[0]))) > MOST
    return list(dict.fromkeys(map(_family, methods))) or [groups[0]] if many else []


def _looks(topic: Topic) -> dict[str, tuple[str, str]]:
    """Return a colour and a marker for every method, different within a family or a group."""
    looks: dict[str, tuple[str, str]] = {}
    # defaults first, so that they get the strongest colours
    methods = _methods(sorted(topic.measurements, key=lambda item: not item.default))
    for group in sorted(topic.groups, key=lambda name: len(_methods(topic.of(name)))):
        items = topic.of(group)
        present = [method for method in methods if method in _methods(items)]
        split = len(present) > MOST
        for method in present:
            side_by_side = [m for m in present if not split or _family(m) == _family(method)]
            used = {looks[m][0] for m in side_by_side if m in looks}
            free = [colour for colour in _COLOURS if colour not in used] or _COLOURS
            looks.setdefault(method, (free[0], _MARKERS[_COLOURS.index(free[0])]))
    return looks


def _timed(topic: Topic, group: str) -> list[Measurement]:
    items = topic.of(group)
    return [item for item in items if item.seconds is not None and topic.error in item.errors]


def _draw_groups(
    part: SubFigure, topic: Topic, groups: Sequence[str], looks: dict[str, tuple[str, str]]
) -> None:
    """Draw groups of few methods side by side."""
    for axes, group in zip(part.subplots(1, len(groups), squeeze=False)[0], groups, strict=True):
        items = _timed(topic, group)
        if not items:
            write_message(axes, group, ["no measurements"])
            continue
        name_axes(axes, group, f"time of {topic.seconds}", f"{topic.errors[topic.error]} [%]")
        names = {method: method for method in _methods(items)}
        _draw_lines(axes, topic, group, items, looks)
        _label_lines(axes, topic, items, names, looks, _HEIGHT)


def _draw_families(
    part: SubFigure, topic: Topic, group: str, looks: dict[str, tuple[str, str]]
) -> None:
    """Draw a group of many methods, a panel for each family, with the others in grey."""
    items, families = _timed(topic, group), _families(topic, [group])
    lines = ceil(len(families) / ACROSS)
    panels = part.subplots(lines, min(ACROSS, len(families)), squeeze=False, sharey=True)
    row = panels.ravel()
    for axes in row[len(families) :]:
        axes.remove()
    if not items:
        write_message(row[0], group, ["no measurements"])
        return
    for axes in row[1 : len(families)]:
        axes.sharex(row[0])
    part.suptitle(group, x=0.01, ha="left", weight="bold", fontsize=9.5)
    for axes, family in zip(row, families, strict=False):
        for method in _methods(items):
            if _family(method) != family:
                drawn = [item for item in items if item.method == method]
                axes.plot(*_coordinates(drawn, topic.error), color=GREY, lw=0.6, alpha=0.35)
    for axes, family in zip(row, families, strict=False):
        of_family = [item for item in items if _family(item.method) == family]
        _draw_lines(axes, topic, group, of_family, looks)
        name_axes(axes, family, f"time of {topic.seconds}", "")
    for first in panels[:, 0]:
        first.set_ylabel(f"{topic.errors[topic.error]} [%]")
    for axes, family in zip(row, families, strict=False):
        of_family = [item for item in items if _family(item.method) == family]
        names = {m: m.removeprefix(family).lstrip(", ") or "no option" for m in _methods(of_family)}
        _label_lines(axes, topic, of_family, names, looks, _SMALL_HEIGHT)


def _draw_lines(
    axes: Axes,
    topic: Topic,
    group: str,
    items: Sequence[Measurement],
    looks: dict[str, tuple[str, str]],
) -> None:
    """Draw the line of each method, the Pareto front of the group, and rings around defaults."""
    for method in _methods(items):
        colour, marker = looks[method]
        drawn = [item for item in items if item.method == method]
        place = _coordinates(drawn, topic.error)
        axes.plot(*place, color=colour, marker=marker, ms=3.5, lw=0.8, label=method)
    front = _coordinates(topic.front(group), topic.error)
    axes.plot(*front, color="k", lw=2.2, alpha=0.25, zorder=1, label=_FRONT)
    default = [item for item in items if item.default]
    if default:
        place = _coordinates(default, topic.error)
        axes.plot(*place, "o", ms=10, mfc="none", mec=GREY, label=_DEFAULT)
    axes.set_xscale("log")
    axes.set_yscale("log")


def _label_lines(
    axes: Axes,
    topic: Topic,
    items: Sequence[Measurement],
    names: dict[str, str],
    looks: dict[str, tuple[str, str]],
    height: float,
) -> None:
    """Set the ticks, and label every line at its slowest setting."""
    set_log_axis(axes.xaxis, brief)
    set_log_axis(axes.yaxis, lambda value: f"{value:g}")
    labels = []
    for method, name in names.items():
        points = zip(
            *_coordinates([i for i in items if i.method == method], topic.error), strict=True
        )
        labels.append(EndLabel(name, looks[method][0], *max(points)))
    label_ends(axes, labels, _PANEL * height)


def _write_legend(figure: Figure) -> None:
    """Write a legend of the front and the default under the panels."""
    named: dict[str, Artist] = {}
    for axes in figure.axes:
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True):
            if label in {_FRONT, _DEFAULT}:
                named.setdefault(label, handle)
    if named:
        figure.legend(named.values(), named.keys(), loc="outside lower center", ncols=2)


def _coordinates(items: Sequence[Measurement], error: str) -> tuple[list[float], list[float]]:
    """Return times [s] and errors [%]."""
    times = [item.seconds for item in items if item.seconds is not None]
    return times, [100.0 * max(item.errors[error], _SMALLEST) for item in items]

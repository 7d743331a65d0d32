"""Figures of time against error with the Pareto front."""

from __future__ import annotations

from math import ceil
from textwrap import fill

from matplotlib import colormaps
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.colors import to_hex
from matplotlib.figure import Figure

from wearsim.report.parts import GREY, figure_style, name_axes, write_message
from wearsim_bench.figures.sizes import growth_figure, savings_figure
from wearsim_bench.figures.table import measured_on
from wearsim_bench.measure.machine import Machine
from wearsim_bench.measure.measurement import Effort, Measurement, Topic

ACROSS = 2  # panels per row
_LETTERS = 120  # characters per line under the title
_FRONT, _DEFAULT = "Pareto front", "default"
_LEGEND = 2.6  # in
_PANEL = (4.9, 3.9)  # in
_MARKERS = "osD^vP*X<>ph"
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
        A panel for each group of problems: a line for each method, a point for each setting, the
        Pareto front, a ring around the default; or time and memory against size, or speed-ups.
    """
    under = fill(measured_on(machine, effort), _LETTERS)
    if "peak_bytes" in topic.counts:
        return growth_figure(topic, under)
    if "times" in topic.counts:
        return savings_figure(topic, under)
    groups = topic.groups
    across = min(ACROSS, len(groups))
    down = ceil(len(groups) / across)
    with figure_style():
        size = (_PANEL[0] * across + _LEGEND, 0.8 + _PANEL[1] * down)
        figure = Figure(figsize=size, layout="constrained")
        panels = figure.subplots(down, across, squeeze=False).ravel()
        colours = _colours(topic)
        for axes, group in zip(panels, groups, strict=False):
            _draw(axes, topic, group, colours)
        for axes in panels[len(groups) :]:
            axes.set_axis_off()
        _write_legend(figure)
        figure.suptitle(f"{topic.title}\n{under}")
    return figure


def _colours(topic: Topic) -> dict[str, tuple[str, str]]:
    """Return a colour and a marker for every method, the same in all panels."""
    # defaults first, so that they get the strongest colours
    items = sorted(topic.measurements, key=lambda item: not item.default)
    methods = list(dict.fromkeys(item.method for item in items))
    wheel = colormaps["tab20" if len(methods) > 10 else "tab10"].colors  # type: ignore[attr-defined]
    return {
        method: (to_hex(wheel[number % len(wheel)]), _MARKERS[number % len(_MARKERS)])
        for number, method in enumerate(methods)
    }


def _draw(axes: Axes, topic: Topic, group: str, colours: dict[str, tuple[str, str]]) -> None:
    """Draw one group of problems."""
    items = [i for i in topic.of(group) if i.seconds is not None and topic.error in i.errors]
    if not items:
        write_message(axes, group, ["no measurements"])
        return
    for method in dict.fromkeys(item.method for item in items):
        of_method = [item for item in items if item.method == method]
        colour, marker = colours[method]
        axes.plot(
            *_coordinates(of_method, topic.error),
            color=colour,
            marker=marker,
            ms=4,
            lw=0.8,
            label=method,
        )
    front = _coordinates(topic.front(group), topic.error)
    axes.plot(*front, color="k", lw=2.2, alpha=0.25, zorder=1, label=_FRONT)
    default = [item for item in items if item.default]
    if default:
        axes.plot(
            *_coordinates(default, topic.error), "o", ms=11, mfc="none", mec=GREY, label=_DEFAULT
        )
    axes.set_xscale("log")
    axes.set_yscale("log")
    name_axes(axes, group, f"{topic.seconds} [s]", f"{topic.errors[topic.error]} [%]")


def _write_legend(figure: Figure) -> None:
    """Write one legend next to the panels, with the entries common to all panels last."""
    named: dict[str, Artist] = {}
    for axes in figure.axes:
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True):
            named.setdefault(label, handle)
    for label in (_FRONT, _DEFAULT):
        if label in named:
            named[label] = named.pop(label)
    if named:
        figure.legend(named.values(), named.keys(), loc="outside right center", fontsize=8.0)


def _coordinates(items: list[Measurement], error: str) -> tuple[list[float], list[float]]:
    """Return times [s] and errors [%]."""
    times = [item.seconds for item in items if item.seconds is not None]
    return times, [100.0 * max(item.errors[error], _SMALLEST) for item in items]

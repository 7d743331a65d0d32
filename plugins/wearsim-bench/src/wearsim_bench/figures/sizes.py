"""Figures of time and memory against the size of a study, and of savings."""

from __future__ import annotations

import re
from itertools import cycle
from math import ceil, log10
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from wearsim.report.figures import figure_style, name_axes
from wearsim.report.panels import BLUE, GREEN, ORANGE
from wearsim_bench.figures.lines import EndLabel, label_ends, set_log_axis
from wearsim_bench.measure.measurement import Measurement, Topic

_NUMBER = re.compile(r"\d[\d.]*(?:e[+-]?\d+)?")
_ACROSS, _PANEL = 3, (3.5, 3.0)  # panels per row, and their size [in]
_BAR, _WIDTH = 0.22, 10.5  # in


def growth_figure(topic: Topic, under: str) -> Figure:
    """Return a figure of time and memory, with a panel for each group.

    Parameters
    ----------
    topic : Topic
        Topic with one number in each setting, and with the count `peak_bytes`.
    under : str
        Text under the title.
    """
    down = ceil(len(topic.groups) / _ACROSS)
    with figure_style():
        size = (_PANEL[0] * _ACROSS, 0.9 + _PANEL[1] * down)
        figure = Figure(figsize=size, layout="constrained")
        panels = figure.subplots(down, _ACROSS, squeeze=False).ravel()
        for axes, group in zip(panels, topic.groups, strict=False):
            _draw_growth(axes, topic.of(group), group)
        for axes in panels[len(topic.groups) :]:
            axes.set_axis_off()
        figure.suptitle(f"{topic.title}\n{under}", fontsize=10.0)
    return figure


def _draw_growth(axes: Axes, items: list[Measurement], group: str) -> None:
    """Draw time and memory against size, for each method."""
    methods = list(dict.fromkeys(item.method for item in items))
    labels = []
    for method, marker in zip(methods, cycle("osD^v"), strict=False):
        timed = [item for item in items if item.method == method and item.seconds is not None]
        sizes = [_size(item) for item in timed]
        name = f"{method}: " if len(methods) > 1 else ""
        look: dict[str, Any] = {"marker": marker, "ms": 4}
        seconds = [item.seconds or 0.0 for item in timed]
        axes.plot(sizes, seconds, color=BLUE, **look)
        memory = [item.counts.get("peak_bytes", float("nan")) / 1e9 for item in timed]
        axes.plot(sizes, memory, ls="--", color=ORANGE, **look)
        labels.append(EndLabel(f"{name}time [s]", BLUE, sizes[-1], seconds[-1]))
        labels.append(EndLabel(f"{name}memory [GB]", ORANGE, sizes[-1], memory[-1]))
    axes.set_xscale("log")
    axes.set_yscale("log")
    name_axes(axes, group, group, "")
    set_log_axis(axes.xaxis, _size_text)
    set_log_axis(axes.yaxis, lambda value: f"{value:g}")
    label_ends(axes, labels, 0.7 * _PANEL[1])


def _size_text(value: float) -> str:
    """Return a size, from 10 000 on as a power of ten."""
    exponent = round(log10(value))
    return f"$10^{{{exponent}}}$" if value >= 1e4 and value == 10.0**exponent else f"{value:g}"


def _size(item: Measurement) -> float:
    """Return the number in a setting, "641 strips" or "n = 100"."""
    match = _NUMBER.search(item.setting)
    return float(match[0]) if match else float("nan")


def savings_figure(topic: Topic, under: str) -> Figure:
    """Return a bar chart of the speed-up of every saving.

    Parameters
    ----------
    topic : Topic
        Topic with the count `times`.
    under : str
        Text under the title.
    """
    items = [item for item in topic.measurements if "times" in item.counts]
    names = [f"{item.group}: {item.method}, {item.setting}" for item in items]
    times = [item.counts["times"] for item in items]
    with figure_style():
        size = (_WIDTH, 1.4 + _BAR * len(items))
        figure = Figure(figsize=size, layout="constrained")
        axes = figure.subplots()
        groups = topic.groups
        colours = [(BLUE, GREEN)[groups.index(item.group) % 2] for item in items]
        axes.set_xscale("log")
        # from 1 on, since a logarithmic axis has no zero
        axes.barh(names, [time - 1.0 for time in times], left=1.0, color=colours)
        axes.axvline(1.0, color="k", lw=0.8)
        for place, time in enumerate(times):
            side = 1 if time >= 1.0 else -1
            axes.annotate(
                f"{time:.3g}",
                (time, place),
                xytext=(3.0 * side, 0.0),
                textcoords="offset points",
                ha="left" if side > 0 else "right",
                va="center",
                fontsize=7.0,
            )
        low, high = axes.get_xlim()
        axes.set(xlim=(low / 1.2, high * 1.1), ylim=(len(items) - 0.4, -0.6))
        set_log_axis(axes.xaxis, lambda value: f"{value:g}")
        axes.grid(visible=False, axis="y")
        name_axes(axes, "", topic.counts["times"], "")
        figure.suptitle(f"{topic.title}\n{under}", fontsize=10.0)
    return figure

"""Figures of time and memory against the size of a study, and of savings."""

from __future__ import annotations

import re
from itertools import cycle
from math import ceil
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from wearsim.report.parts import BLUE, GREEN, ORANGE, figure_style, name_axes
from wearsim_bench.measure.measurement import Measurement, Topic

_NUMBER = re.compile(r"\d[\d.]*(?:e[+-]?\d+)?")
_ACROSS, _PANEL = 3, (4.2, 3.4)  # panels per row, and their size [in]
_BAR, _WIDTH = 0.22, 12.0  # in


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
        figure.suptitle(f"{topic.title}\n{under}")
    return figure


def _draw_growth(axes: Axes, items: list[Measurement], group: str) -> None:
    """Draw time and memory against size, for each method."""
    methods = list(dict.fromkeys(item.method for item in items))
    for method, marker in zip(methods, cycle("osD^v"), strict=False):
        timed = [item for item in items if item.method == method and item.seconds is not None]
        sizes = [_size(item) for item in timed]
        name = f"{method}: " if len(methods) > 1 else ""
        look: dict[str, Any] = {"marker": marker, "ms": 4}
        seconds = [item.seconds or 0.0 for item in timed]
        axes.plot(sizes, seconds, color=BLUE, label=f"{name}time [s]", **look)
        memory = [item.counts.get("peak_bytes", float("nan")) / 1e9 for item in timed]
        axes.plot(sizes, memory, ls="--", color=ORANGE, label=f"{name}memory [GB]", **look)
    axes.set_xscale("log")
    axes.set_yscale("log")
    name_axes(axes, group, group, "")
    axes.legend(loc="best")


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
        axes.barh(names, times, color=colours)
        axes.axvline(1.0, color="k", lw=0.8)
        axes.set_xscale("log")
        axes.invert_yaxis()
        name_axes(axes, "", topic.counts["times"], "")
        figure.suptitle(f"{topic.title}\n{under}")
    return figure

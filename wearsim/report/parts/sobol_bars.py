"""What each random input does to the final depth, as bars."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes

from wearsim.report.parts.style import BLUE, GREY, ORANGE, name_axes, say
from wearsim.report.text.sample_size_advice import too_few

if TYPE_CHECKING:
    from wearsim.results import EnsembleResult
    from wearsim.results.ensemble.result import Effect
    from wearsim.uq.estimation.intervals import Interval

_TITLE = "What moves the final depth"
_MOST = 14  # bars that have room


def draw_effects(axes: Axes, result: EnsembleResult) -> None:
    """Draw first-order indices with their intervals, and total ones where there are any.

    Parameters
    ----------
    axes : Axes
    result : EnsembleResult
        With one realisation or more that ended well.
    """
    effects = result.sensitivity("depth")
    if result.count == 1 or not any(np.isfinite(item.first.value) for item in effects):
        say(axes, _TITLE, [too_few(result)])
        return
    if result.is_constant("depth"):
        say(axes, _TITLE, ["nothing: the depth is the same in all realisations"])
        return
    effects = effects[:_MOST]
    places = np.arange(len(effects))
    colours = [GREY if item.without_effect else BLUE for item in effects]
    widths = [100.0 * np.nan_to_num(item.first.value) for item in effects]
    axes.barh(places, widths, 0.6, color=colours, alpha=0.55)
    for place, item in enumerate(effects):
        if np.isfinite(item.first.value):
            _draw_interval(axes, place, item.first, "black", "")
        if item.total is not None and np.isfinite(item.total.value):
            _draw_interval(axes, place + 0.38, item.total, ORANGE, "D")
    axes.set_yticks(places, [_named(item) for item in effects])
    for label, item in zip(axes.get_yticklabels(), effects, strict=True):
        label.set_color("black" if label.get_text() == item.name else GREY)
    axes.invert_yaxis()
    axes.set_xlim(0.0, 100.0)
    if any(item.total is not None for item in effects):
        axes.plot([], [], "D", color=ORANGE, ms=4.0, label="total, all that it takes part in")
        axes.legend(loc="lower right")
    name_axes(axes, _TITLE, "part of the variance made by the input alone [%]", "")


def _named(item: Effect) -> str:
    if not np.isfinite(item.first.value):
        return f"{item.name} (too few to tell)"
    return f"{item.name} (none seen)" if item.without_effect else item.name


def _draw_interval(axes: Axes, place: float, found: Interval, colour: str, mark: str) -> None:
    low, high = (float(np.clip(end, 0.0, 1.0)) for end in (found.low, found.high))
    axes.plot([100.0 * low, 100.0 * high], [place, place], color=colour, lw=1.0)
    if mark:
        axes.plot([100.0 * found.value], [place], mark, color=colour, ms=4.0)

"""Labels at the ends of lines, and ticks of logarithmic axes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import log10
from typing import NamedTuple

from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

_FONT = 7.5  # points
_SPACING = 9.5  # between two labels [points]
_AWAY = 1.04  # position of the labels, as a part of the panel's width


class EndLabel(NamedTuple):
    """Label of a line.

    Parameters
    ----------
    text, colour : str
    x, y : float
        End of the line.
    """

    text: str
    colour: str
    x: float
    y: float


def label_ends(axes: Axes, labels: Sequence[EndLabel], height: float) -> None:
    """Write the labels of lines to the right of a panel, each with a thin line to its end.

    Parameters
    ----------
    axes : Axes
        Panel with final limits.
    labels : sequence of EndLabel
    height : float
        Approximate height of the panel [in].
    """
    ordered = sorted(labels, key=lambda label: label.y)
    to_panel = axes.transAxes.inverted()
    ends = [float(to_panel.transform(_pixels(axes, label))[1]) for label in ordered]
    places = spread(ends, _SPACING / (72.0 * height))
    for label, place in zip(ordered, places, strict=True):
        axes.annotate(
            label.text,
            (label.x, label.y),
            xytext=(_AWAY, place),
            textcoords="axes fraction",
            color=label.colour,
            fontsize=_FONT,
            va="center",
            arrowprops={"arrowstyle": "-", "color": label.colour, "lw": 0.4, "alpha": 0.6},
            annotation_clip=False,
        )


def _pixels(axes: Axes, label: EndLabel) -> tuple[float, float]:
    x, y = axes.transData.transform((label.x, label.y))
    return float(x), float(y)


def spread(places: Sequence[float], spacing: float) -> list[float]:
    """Return ascending places moved apart to a spacing, within 0 to 1 as far as they fit.

    Parameters
    ----------
    places : sequence of float
        Ascending.
    spacing : float
        Smallest difference of two returned places.
    """
    moved: list[float] = []
    for place in places:
        moved.append(max(place, moved[-1] + spacing) if moved else max(place, 0.0))
    limit = 1.0
    for number in reversed(range(len(moved))):
        moved[number] = min(moved[number], limit)
        limit = moved[number] - spacing
    return moved


def set_log_axis(axis: Axis, text: Callable[[float], str]) -> None:
    """Set few ticks on a logarithmic axis with final limits, so that their labels do not overlap.

    Parameters
    ----------
    axis : Axis
    text : callable
        Returns the label of a value.
    """
    low, high = axis.get_view_interval()
    decades = log10(high / low)
    subs = (1.0, 2.0, 5.0) if decades < 1.3 else (1.0, 3.0) if decades < 2.0 else (1.0,)
    axis.set_major_locator(LogLocator(subs=subs))
    axis.set_major_formatter(FuncFormatter(lambda value, _: text(float(value))))
    axis.set_minor_formatter(NullFormatter())

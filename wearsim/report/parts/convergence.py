"""Panel of the convergence of an estimate with the number of realisations."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullFormatter

from wearsim.report.parts.style import BLUE, GREY
from wearsim.report.text.units import count
from wearsim.types import FloatArray, IntArray

_SCALED_FROM = 10  # realisations from which an estimate sets the scale of the panel,
_SCALED_PART = 1 / 30  # or this part of all realisations
_LINEAR_UP_TO = 20  # realisations
_DECADES_FROM = 3000  # realisations from which powers of ten suffice as ticks


def draw_convergence(
    axes: Axes, counts: IntArray, value: FloatArray, low: FloatArray, high: FloatArray
) -> None:
    """Draw an estimate against the number of realisations, and its interval as a band.

    Parameters
    ----------
    axes : Axes
    counts : ndarray of int, shape (points,)
        Numbers of realisations, ascending.
    value, low, high : ndarray, shape (points,)
        Estimate and ends of its interval, nan or infinite where unknown.
    """
    known = np.isfinite(low) & np.isfinite(high)
    if np.isfinite(value[-1]) and not np.any(known & (high > low)):
        top = 2.0 * float(value[-1]) or 1.0
        axes.set_ylim(-0.05 * top, top)  # keeps a line at zero off the axis
    lower, upper = (np.where(known, end, np.nan) for end in (low, high))
    axes.fill_between(counts, lower, upper, color=BLUE, alpha=0.25, lw=0)
    axes.plot(counts, value, color=BLUE, marker="o" if len(counts) == 1 else "")
    last = int(counts[-1])
    if last > _LINEAR_UP_TO:
        axes.set_xscale("log")
        if last < _DECADES_FROM:
            axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axes.xaxis.set_minor_formatter(NullFormatter())
        axes.xaxis.set_major_formatter(FuncFormatter(lambda number, _: count(number)))
    else:
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    scaling = (counts >= min(max(_SCALED_FROM, _SCALED_PART * last), last)) & known
    if scaling.any() and (high - low)[scaling].max() > 0.0:
        least, greatest = low[scaling].min(), high[scaling].max()
        margin = 0.05 * (greatest - least)
        axes.set_ylim(least - margin, greatest + margin)
        axes.axhline(value[-1], color=GREY, lw=0.8, ls="--")
    axes.set_xlim(0.5 * _SCALED_FROM if last > _LINEAR_UP_TO else 1.0, max(2.0, 1.05 * last))

"""How estimates settle with the number of realisations, and how that is drawn."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullFormatter

from wearsim.report.parts.style import BLUE, GREY
from wearsim.report.text.units import count
from wearsim.results.ensemble.schema import PENDING
from wearsim.types import FloatArray, IntArray

if TYPE_CHECKING:
    from wearsim.results import EnsembleResult
    from wearsim.uq.estimation.intervals import Interval
    from wearsim.uq.estimation.stopping_rule import Target

_WILD = 10  # realisations before which an estimate is too wild to set the scale,
_EARLY = 1 / 30  # or those of this part of all
_FEW = 20  # realisations that are drawn on a linear scale
_MANY = 3000  # that need no numbers between powers of ten


def draw_settling(
    axes: Axes, counts: IntArray, value: FloatArray, low: FloatArray, high: FloatArray
) -> None:
    """Draw an estimate against the number of realisations, and its interval as a band.

    Parameters
    ----------
    axes : Axes
    counts : ndarray of int, shape (points,)
        Numbers of realisations, rising.
    value, low, high : ndarray, shape (points,)
        The estimate and the ends of its interval, nan or infinite where they are unknown.
    """
    known = np.isfinite(low) & np.isfinite(high)
    if np.isfinite(value[-1]) and not np.any(known & (high > low)):
        top = 2.0 * float(value[-1]) or 1.0
        axes.set_ylim(-0.05 * top, top)  # so that a line at zero is seen
    inner, outer = (np.where(known, end, np.nan) for end in (low, high))
    axes.fill_between(counts, inner, outer, color=BLUE, alpha=0.25, lw=0)
    axes.plot(counts, value, color=BLUE, marker="o" if len(counts) == 1 else "")
    last = int(counts[-1])
    if last > _FEW:
        axes.set_xscale("log")
        if last < _MANY:
            axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axes.xaxis.set_minor_formatter(NullFormatter())
        axes.xaxis.set_major_formatter(FuncFormatter(lambda number, _: count(number)))
    else:
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    settled = (counts >= min(max(_WILD, _EARLY * last), last)) & known
    if settled.any() and (high - low)[settled].max() > 0.0:
        least, greatest = low[settled].min(), high[settled].max()
        margin = 0.05 * (greatest - least)
        axes.set_ylim(least - margin, greatest + margin)
        axes.axhline(value[-1], color=GREY, lw=0.8, ls="--")
    start = 0.5 * _WILD if last > _FEW else 1.0
    axes.set_xlim(start, max(2.0, 1.05 * last))


def settling(
    result: EnsembleResult, target: Target, points: int = 40
) -> tuple[IntArray, list[Interval]]:
    """Return what the first realisations of an ensemble tell, for more and more of them.

    Parameters
    ----------
    result : EnsembleResult
        With one realisation or more that ended well.
    target : Target
        What is estimated.
    points : int
        At how many numbers, evenly spaced in their logarithm, about.

    Returns
    -------
    counts : ndarray of int
        Realisations that ended well.
    intervals : list of Interval
    """
    spaced = np.geomspace(1, result.count, min(points, result.count))
    counts = np.unique(spaced.round().astype(np.int64))
    raw, name = result.raw, target.observable
    # read once: a file's arrays are read anew whenever they are asked for
    held = {name: raw.column(name, -1)[:, None]}
    held |= {"control": raw.variables["control"]} if raw.control else {}
    numbers, found = np.arange(raw.asked), []
    for last in result.numbers[counts - 1]:
        status = np.where(numbers <= last, raw.status, PENDING)
        part = replace(result, raw=replace(raw, variables=held, status=status))
        found.append(target.interval(part.estimate_for(target)))
    return counts, found

"""The axes of a depth against passes, alike in all figures."""

from __future__ import annotations

from matplotlib.axes import Axes
from matplotlib.ticker import FuncFormatter

from wearsim.report.text.units import pass_unit
from wearsim.types import BoolArray, FloatArray


def set_depth_axes(
    axes: Axes, passes: FloatArray, depth: FloatArray
) -> tuple[BoolArray, float, str]:
    """Make both scales logarithmic where the passes cover two decades.

    Parameters
    ----------
    axes : Axes
    passes, depth : ndarray, shape (points,)
        What will be drawn.

    Returns
    -------
    drawn : ndarray of bool, shape (points,)
        Which points have a place on the axes.
    unit : float
        What passes are divided by.
    name : str
        Of the axis of passes.
    """
    worn = (passes > 0.0) & (depth > 0.0)
    if worn.sum() > 3 and passes[worn][-1] > 100.0 * passes[worn][0]:
        axes.set_xscale("log")
        axes.set_yscale("log")
        axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        return worn, 1.0, "roller passes"
    return passes >= 0.0, *pass_unit(float(passes[-1]))

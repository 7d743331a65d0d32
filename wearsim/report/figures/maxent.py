"""The figure of a law of maximum entropy: its density and its parent's, its bulk and its mean."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from wearsim.report.parts.style import BLUE, GREY, ORANGE, figure_style, name_axes
from wearsim.report.text.maxent_numbers import multipliers, parent, value
from wearsim.types import FloatArray
from wearsim.uq.distributions.base import MaxentDistribution

_POINTS = 1001


def maxent_figure(law: MaxentDistribution) -> Figure:
    """Return the figure of a law of maximum entropy.

    Parameters
    ----------
    law : MaxentDistribution

    Returns
    -------
    Figure
    """
    with figure_style():
        figure = Figure(figsize=(6.4, 3.6), layout="constrained")
        axes = figure.subplots()
        low, high = law.bulk
        # off the very ends, where a density may be infinite
        x = low + (high - low) * (np.arange(_POINTS) + 0.5) / _POINTS
        density = law.density(x)
        _draw_bulk(axes, law, x, density)
        axes.plot(x, density, color=BLUE, label=law.family)
        _draw_parent(axes, law, x, density)
        axes.axvline(law.mean, color=ORANGE, lw=1.0, label=f"mean {value(law, law.mean):.4g}")
        axes.set_xlim(low, high)
        axes.set_ylim(0.0, 1.08 * float(density.max()))
        axes.legend(loc="best")
        l0, l1, l2 = (f"{number:.5g}" for number in multipliers(law))
        title = f"Maximum entropy: {law.family}\n$\\lambda_0$ = {l0}, $\\lambda_1$ = {l1}"
        name_axes(axes, f"{title}, $\\lambda_2$ = {l2}", "value", "density")
    return figure


def _draw_bulk(axes: Axes, law: MaxentDistribution, x: FloatArray, density: FloatArray) -> None:
    """Shade the middle 95 % of the law."""
    first, last = law.quantile(np.array([0.025, 0.975]))
    inside = (x >= first) & (x <= last)
    label = f"95 %: {first:.4g} to {last:.4g}"
    axes.fill_between(x, density, where=inside.tolist(), color=BLUE, alpha=0.15, lw=0, label=label)


def _draw_parent(axes: Axes, law: MaxentDistribution, x: FloatArray, density: FloatArray) -> None:
    """Draw the parent normal law where it can be told from the law that is cut from it."""
    found = parent(law)
    if found is None:
        return
    mean, std = found
    normal = np.exp(-0.5 * ((x - mean) / std) ** 2) / (std * np.sqrt(2.0 * np.pi))
    if np.abs(normal - density).max() > 1e-3 * density.max():
        label = f"parent: {mean:.4g}, std {std:.4g}"
        axes.plot(x, normal, "--", color=GREY, lw=1.0, label=label)

"""Figure of a maximum-entropy distribution."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from wearsim.report.parts import BLUE, GREY, ORANGE, name_axes, titled_figure
from wearsim.report.text import multipliers, parent, value
from wearsim.uq.distributions.base import MaxentDistribution

_POINTS = 1001


def maxent_figure(distribution: MaxentDistribution) -> Figure:
    """Return the figure of a maximum-entropy distribution.

    Parameters
    ----------
    distribution : MaxentDistribution

    Returns
    -------
    Figure
        Density with its central 95 %, mean, and the parent normal distribution if it differs.
    """
    with titled_figure(6.4, 3.6) as figure:
        axes = figure.subplots()
        low, high = distribution.bulk
        # the ends are left out, where a density may be infinite
        x = low + (high - low) * (np.arange(_POINTS) + 0.5) / _POINTS
        density = distribution.density(x)
        first, last = distribution.quantile(np.array([0.025, 0.975]))
        inside = ((x >= first) & (x <= last)).tolist()
        axes.fill_between(
            x, density, where=inside, color=BLUE, alpha=0.15, lw=0,
            label=f"95 %: {first:.4g} to {last:.4g}",
        )  # fmt: skip
        axes.plot(x, density, color=BLUE, label=distribution.family)
        found = parent(distribution)
        if found is not None:
            mean, std = found
            normal = np.exp(-0.5 * ((x - mean) / std) ** 2) / (std * np.sqrt(2.0 * np.pi))
            if np.abs(normal - density).max() > 1e-3 * density.max():
                axes.plot(
                    x, normal, "--", color=GREY, lw=1.0,
                    label=f"parent: mean {mean:.4g}, std {std:.4g}",
                )  # fmt: skip
        axes.axvline(
            distribution.mean,
            color=ORANGE,
            lw=1.0,
            label=f"mean {value(distribution, distribution.mean):.4g}",
        )
        axes.set(xlim=(low, high), ylim=(0.0, 1.08 * float(density.max())))
        axes.legend(loc="best")
        numbers = enumerate(multipliers(distribution))
        terms = ", ".join(f"$\\lambda_{number}$ = {item:.5g}" for number, item in numbers)
        name_axes(
            axes, f"Maximum entropy: {distribution.family}\n{terms}", "value", "probability density"
        )
    return figure

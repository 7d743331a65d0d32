"""Maximum-entropy distributions as rows, JSON and a panel."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from wearsim.levelling import Measured
from wearsim.report.panels import GREY, ORANGE, Axis, Band, Line, Mark, Panel, Sheet, Span
from wearsim.report.view import Row, Rows, View
from wearsim.uq.distributions.base import MaxentDistribution

PROBABILITIES = (0.025, 0.05, 0.25, 0.5, 0.75, 0.95, 0.975)
_ROUNDING = 1e-12  # in standard deviations
_POINTS = 1001


class MaxentView(View):
    """Multipliers, moments and quantiles of a distribution, and its density."""

    title = "maximum-entropy distribution"

    def __init__(self, distribution: MaxentDistribution) -> None:
        self.distribution, self.warnings = distribution, distribution.warnings
        std, (l0, l1, l2) = distribution.std, distribution.multipliers
        scale = std**2 if distribution.third == "x^2" else 1.0
        self.multipliers = (
            l0,
            0.0 if abs(l1) * std < _ROUNDING else l1,
            0.0 if abs(l2) * scale < _ROUNDING else l2,
        )
        self.mean = self._without_rounding(distribution.mean)
        parent = distribution.parent
        self.parent = parent and (self._without_rounding(parent[0]), parent[1])
        values = map(
            self._without_rounding, distribution.quantile(np.array(PROBABILITIES)).tolist()
        )
        self.quantiles = dict(zip(PROBABILITIES, values, strict=True))

    def _without_rounding(self, number: float) -> float:
        """Return a value, or 0 if it is a rounding error near 0 inside the support."""
        low, high = self.distribution.support
        near = low < 0.0 < high and abs(number) < _ROUNDING * self.distribution.std
        return 0.0 if near else number

    def rows(self) -> Rows:
        """Return family, support, multipliers, moments and quantiles."""
        distribution, parent = self.distribution, self.parent
        return [
            Row("family", distribution.family),
            Row("support", " to ".join(f"{end:g}" for end in distribution.support)),
            Row("density", f"exp(-l0 - l1 x - l2 {distribution.third})"),
            *(Row(f"l{number}", f"{item:.7g}") for number, item in enumerate(self.multipliers)),
            Row(
                "parent normal distribution",
                f"mean {parent[0]:.7g}, standard deviation {parent[1]:.7g}" if parent else "none",
            ),
            Row("mean", f"{self.mean:.7g}"),
            Row("standard deviation", f"{distribution.std:.7g}"),
            *(Row(f"{100.0 * p:g} % quantile", f"{x:.7g}") for p, x in self.quantiles.items()),
        ]

    def data(self) -> dict[str, Any]:
        """Return the distribution in the units of the given moments."""
        distribution, parent = self.distribution, self.parent
        return {
            "family": distribution.family,
            "support": distribution.support,
            "multipliers": dict(zip(("l0", "l1", "l2"), self.multipliers, strict=True)),
            "l2_multiplies": distribution.third,
            "parent": parent and {"mean": parent[0], "std": parent[1]},
            "mean": self.mean,
            "std": distribution.std,
            "quantiles": self.quantiles,
            "warnings": list(distribution.warnings),
        }

    def panels(self, measured: Sequence[Measured] = ()) -> Sheet:
        """Return the density with its central 95 %, mean, and the parent if it differs."""
        distribution = self.distribution
        low, high = distribution.bulk
        # the ends are left out, where a density may be infinite
        x = low + (high - low) * (np.arange(_POINTS) + 0.5) / _POINTS
        density = distribution.density(x)
        first, last = (self.quantiles[p] for p in (0.025, 0.975))
        inside = (x >= first) & (x <= last)
        label = f"95 %: {first:.4g} to {last:.4g}"
        marks: list[Mark] = [
            Band(x[inside], np.zeros(inside.sum()), density[inside], label=label, alpha=0.15),
            Line(x, density, label=distribution.family),
        ]
        if self.parent:
            mean, std = self.parent
            normal = np.exp(-0.5 * ((x - mean) / std) ** 2) / (std * np.sqrt(2.0 * np.pi))
            if np.abs(normal - density).max() > 1e-3 * density.max():
                text = f"parent: mean {mean:.4g}, std {std:.4g}"
                marks.append(Line(x, normal, dash="--", width=1.0, colour=GREY, label=text))
        marks.append(Span(distribution.mean, colour=ORANGE, label=f"mean {self.mean:.4g}"))
        terms = ", ".join(f"$\\lambda_{k}$ = {item:.5g}" for k, item in enumerate(self.multipliers))
        panel = Panel(
            f"Maximum entropy: {distribution.family}\n{terms}",
            Axis("value", limits=(low, high)),
            Axis("probability density", limits=(0.0, 1.08 * float(density.max()))),
            marks,
            "Density of the distribution, with its central 95 %.",
        )
        return Sheet("", {"density": panel}, [["density"]], (6.4, 3.6))

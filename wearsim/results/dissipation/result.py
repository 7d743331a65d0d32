"""Result of a dissipation study: drawn inputs, power and their statistics, in SI."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from wearsim.results.content import Arrays
from wearsim.results.dissipation.data import DissipationData
from wearsim.results.io.reader import read_dissipation
from wearsim.results.study_result import StudyResult
from wearsim.types import FloatArray
from wearsim.uq.estimation.moments import Convergence, Summary, converge, summarise

BAND = (0.025, 0.975)
"""Probabilities that bound 95 % of the realisations."""
PAPER_BAND = (0.05, 0.95)
"""Probabilities of eq. 21 of Chevalier et al. (2005), where the labels P+ and P- are swapped."""

SUMMARISED = ("power", "force_x", "force_y", "spin_moment", "normal_force", "peak_pressure")


@dataclass(frozen=True, eq=False)
class DissipationResult(StudyResult[DissipationData]):
    """Realisations of one contact, finished or not."""

    def __repr__(self) -> str:
        done = f"{self.count}" if self.finished else f"{self.count} of {self.raw.requested}"
        noun = "realisation" if done == "1" else "realisations"
        power = self.summaries["power"]
        std = f", std {power.std:.4g} W" if power.count > 1 else ""
        return f"<DissipationResult '{self.title}': {done} {noun}, power {power.mean:.4g} W{std}>"

    def values(self, name: str) -> FloatArray:
        """Return a variable of the results file, or the drawn values of an input.

        Parameters
        ----------
        name : str
            Name or dotted key, such as "peak_pressure" or "load.normal_force".
        """
        return self.raw.variables[name]

    @property
    def count(self) -> int:
        """Number of finished realisations."""
        return len(self.power)

    @property
    def inputs(self) -> dict[str, FloatArray]:
        """Drawn values by scenario key, shape (realisations,) [SI]."""
        return {item["key"]: self.values(item["key"]) for item in self.raw.inputs}

    @property
    def power(self) -> FloatArray:
        """Dissipated power P_d, shape (realisations,) [W]."""
        return self.values("power")

    @property
    def mean_problem_power(self) -> float:
        """Dissipated power with every random input at its mean [W]."""
        return self.raw.mean_problem_power

    @property
    def y(self) -> FloatArray:
        """Axial position of the strips [m]."""
        return self.values("y")

    @property
    def dissipation(self) -> FloatArray:
        """Dissipated power per axial length, shape (kept realisations, strips) [W/m]."""
        return self.values("dissipation")

    @cached_property
    def summaries(self) -> dict[str, Summary]:
        """Estimates of power, forces, moment and pressure over the realisations, by variable."""
        return summaries(self.raw.variables)

    def convergence(self, points: int = 200) -> Convergence:
        """Return mean and standard deviation of the power against the number of realisations.

        Parameters
        ----------
        points : int
            Approximate number of points, evenly spaced in the logarithm of the sample size.
        """
        counts = np.geomspace(1, self.count, min(points, self.count)).round()
        return converge(self.power, np.unique(counts.astype(np.int64)))


def summaries(variables: Arrays) -> dict[str, Summary]:
    """Return estimates over the realisations, for each variable of `SUMMARISED`.

    Parameters
    ----------
    variables : dict of str to ndarray
        Variables of a dissipation study.

    Returns
    -------
    dict of str to Summary
    """
    probabilities = tuple(sorted({*BAND, *PAPER_BAND, 0.5}))
    return {name: summarise(variables[name], probabilities) for name in SUMMARISED}


def as_numbers(found: dict[str, Summary]) -> dict[str, Any]:
    """Return estimates ready for JSON, with None where they are not finite."""
    return {name: _finite(asdict(summary)) for name, summary in found.items()}


def _finite(value: Any) -> Any:
    if isinstance(value, dict):
        return {name: _finite(item) for name, item in value.items()}
    if isinstance(value, tuple | list):
        return [_finite(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def open_dissipation(path: str | Path) -> DissipationResult:
    """Open the file of a dissipation study; see `open_results`."""
    return DissipationResult(read_dissipation(path), Path(path))

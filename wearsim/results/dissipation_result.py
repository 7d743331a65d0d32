"""What a user gets from realisations of one contact: draws, power and their statistics, in SI."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from wearsim.randomness.statistics import Convergence, Summary, converge, summarise
from wearsim.results.data import Arrays
from wearsim.results.dissipation_data import DissipationData
from wearsim.results.reader import read_dissipation
from wearsim.types import FloatArray

if TYPE_CHECKING:
    from wearsim.scenario import Scenario

BAND = (0.025, 0.975)
"""Probabilities between which 95 % lie."""
PAPER_BAND = (0.05, 0.95)
"""Those of the paper's eq. 21, whose labels P+ and P- are swapped in print."""

SUMMARISED = ("power", "force_x", "force_y", "spin_moment", "normal_force", "peak_pressure")


@dataclass(frozen=True, eq=False)
class DissipationResult:
    """Realisations of one contact, as many as are done.

    Parameters
    ----------
    raw : DissipationData
        All there is.
    path : Path, optional
        The results file, where there is one.
    """

    raw: DissipationData
    path: Path | None = None

    def values(self, name: str) -> FloatArray:
        """Return any variable of the results file, or drawn values by their dotted key.

        Parameters
        ----------
        name : str
            Its name, "peak_pressure" or "load.normal_force".

        Returns
        -------
        ndarray
        """
        return self.raw.variables[name]

    @cached_property
    def scenario(self) -> Scenario:
        """The scenario, read from the text and files that are stored with the study."""
        from wearsim.scenario import parse_scenario  # noqa: PLC0415  (a results file needs none)

        raw = self.raw
        return parse_scenario(raw.scenario_text, raw.scenario_file, raw.files.__getitem__)

    @property
    def title(self) -> str:
        """What the scenario is, in a line."""
        return self.raw.title

    @property
    def finished(self) -> bool:
        """Whether all realisations are done."""
        return self.raw.finished

    @property
    def count(self) -> int:
        """Realisations that are done."""
        return len(self.power)

    @property
    def notes(self) -> tuple[str, ...]:
        """What a user should know of the scenario."""
        return tuple(self.raw.notes)

    @property
    def warnings(self) -> tuple[str, ...]:
        """What a user should know of the study."""
        return tuple(self.raw.warnings)

    @property
    def inputs(self) -> dict[str, FloatArray]:
        """Drawn values by the scenario's key, each shape (realisations,)."""
        return {item["key"]: self.values(item["key"]) for item in self.raw.inputs}

    @property
    def power(self) -> FloatArray:
        """Dissipated power P_d, shape (realisations,) [W]."""
        return self.values("power")

    @property
    def mean_problem_power(self) -> float:
        """Dissipated power with every input at its mean [W]."""
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
        """What the realisations tell of power, forces, load and pressure, by variable."""
        return summaries(self.raw.variables)

    def convergence(self, points: int = 200) -> Convergence:
        """Return mean and standard deviation of the power against the number of realisations.

        Parameters
        ----------
        points : int
            At how many numbers, evenly spaced in their logarithm, about.
        """
        counts = np.geomspace(1, self.count, min(points, self.count)).round().astype(np.int64)
        return converge(self.power, np.unique(counts))


def summaries(variables: Arrays) -> dict[str, Summary]:
    """Return what the realisations tell of each number.

    Parameters
    ----------
    variables : dict of str to ndarray
        Of a dissipation study.

    Returns
    -------
    dict of str to Summary
    """
    probabilities = tuple(sorted({*BAND, *PAPER_BAND, 0.5}))
    return {name: summarise(variables[name], probabilities) for name in SUMMARISED}


def as_numbers(found: dict[str, Summary]) -> dict[str, Any]:
    """Return summaries as JSON has it: what there are too few realisations for is None."""
    return {name: _finite(asdict(summary)) for name, summary in found.items()}


def _finite(value: Any) -> Any:
    if isinstance(value, dict):
        return {name: _finite(item) for name, item in value.items()}
    if isinstance(value, tuple | list):
        return [_finite(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def open_dissipation(path: str | Path) -> DissipationResult:
    """Open the file of a dissipation study.

    Parameters
    ----------
    path : str or Path
        The file.

    Returns
    -------
    DissipationResult

    Raises
    ------
    ResultsFileError
        If it is missing, foreign, truncated, damaged, or written by a newer wearsim.
    """
    return DissipationResult(read_dissipation(path), Path(path))

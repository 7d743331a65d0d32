"""Results of a dissipation study: schema of the file, its content, and the result in SI."""

from __future__ import annotations

import math
from collections.abc import Container, Mapping
from dataclasses import asdict, dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from wearsim.errors import unknown_name
from wearsim.report.text import plain
from wearsim.results.content import (
    Arrays,
    Axis,
    Schema,
    Stored,
    StudyData,
    StudyResult,
    Variable,
    by_name,
    with_random_inputs,
)
from wearsim.results.io.files import read_study
from wearsim.types import FloatArray
from wearsim.uq.estimation.moments import Convergence, Quantile, Summary, converge, summarise

if TYPE_CHECKING:
    from wearsim.uq.estimation.estimates import Design

_DRAW = ("realisation",)
_STRIPS = ("y",)
_PER_LENGTH = "dissipated power per axial length"

VARIABLES: Mapping[str, Variable] = by_name(
    (
        Variable("y", _STRIPS, "m", "axial position", "static"),
        Variable("power", _DRAW, "W", "dissipated power of the contact", "record"),
        Variable("force_x", _DRAW, "N", "longitudinal force on the cylinder", "record"),
        Variable("force_y", _DRAW, "N", "lateral force on the cylinder", "record"),
        Variable("spin_moment", _DRAW, "N m", "spin moment on the cylinder", "record"),
        Variable("normal_force", _DRAW, "N", "normal force of a roller", "record"),
        Variable("longitudinal_creepage", _DRAW, "1", "mean longitudinal creepage", "record"),
        Variable("peak_pressure", _DRAW, "Pa", "greatest normal pressure", "record"),
        Variable(
            "adhesion_fraction", _DRAW, "1", "part of the contact area that adheres", "record"
        ),
        Variable("dissipation", ("kept", "y"), "W/m", _PER_LENGTH, "record"),
        *(
            Variable(
                f"dissipation_{ending}", _STRIPS, "W/m", f"{words}: {_PER_LENGTH}", "statistic"
            )
            for ending, words in (
                ("mean", "mean over all realisations"),
                ("std", "standard deviation over all realisations"),
                ("low", "2.5 % quantile over kept realisations"),
                ("high", "97.5 % quantile over kept realisations"),
            )
        ),
        Variable(
            "mean_problem_dissipation",
            _STRIPS,
            "W/m",
            f"{_PER_LENGTH}, every random input at its mean",
            "static",
        ),
    )
)

#: Schema without the random inputs, which differ between studies; see `with_random_inputs`.
DISSIPATION = Schema(
    "wearsim-dissipation",
    3,
    "realisations of one contact, from `wearsim dissipation`",
    by_name(
        (
            Axis("realisation", "realisation of the random inputs", 0),
            Axis("kept", "realisation whose dissipation per strip is stored", 0),
        )
    ),
    VARIABLES,
)
#: Probabilities that bound 95 % of the realisations.
BAND = (0.025, 0.975)
#: Probabilities of eq. 21 of Chevalier et al. (2005), where the labels P+ and P- are swapped.
PAPER_BAND = (0.05, 0.95)
SUMMARISED = ("power", "force_x", "force_y", "spin_moment", "normal_force", "peak_pressure")


@dataclass(frozen=True, eq=False, kw_only=True)
class DissipationData(StudyData):
    """Realisations of one contact, in SI, in addition to `StudyData`.

    Parameters
    ----------
    plan : str
        Name of the sampling design.
    inputs : list of dict
        Dotted key and SI unit of each drawn value.
    requested : int
        Requested number of realisations.
    strip_width : float
        Width of a strip [m].
    friction_grid : str
        Points and strips at which a friction field was evaluated; empty if there is none.
    mean_problem_power : float
        Dissipated power with every random input at its mean [W].
    variables : dict of str to ndarray
        Variables of `wearsim.studies.dissipation.result`, and the drawn values by dotted key.
    statistics : dict of str to object
        Estimates over the realisations, for other programs that read the file.
    solve_seconds : float
        Time spent on contact solves [s].
    replicates : int
        Number of independently scrambled Sobol sequences, to which the realisations belong in
        turn; 1 for other designs.
    """

    optional: ClassVar[frozenset[str]] = frozenset({"replicates"})

    plan: str
    inputs: list[dict[str, str]]
    requested: int
    strip_width: float
    friction_grid: str
    mean_problem_power: float
    variables: Arrays
    solve_seconds: float
    statistics: dict[str, Any] = field(default_factory=dict)
    replicates: int = 1

    base_schema: ClassVar[Schema] = DISSIPATION

    @property
    def schema(self) -> Schema:
        """Schema of the results file."""
        return with_random_inputs(DISSIPATION, self.inputs)

    @classmethod
    def schema_of(cls, attributes: Mapping[str, Any], names: Container[str]) -> Schema:
        """Return the schema of a file by its attributes and the names of its variables."""
        return with_random_inputs(DISSIPATION, attributes["inputs"])


def read_dissipation(path: str | Path) -> DissipationData:
    """Read the file of a dissipation study; errors as of `read_study`."""
    data: DissipationData = read_study(path, DissipationData)
    return data


@dataclass(frozen=True, eq=False)
class DissipationResult(StudyResult[DissipationData]):
    """Realisations of one contact, finished or not.

    Examples
    --------
    >>> friction = {"distribution": "uniform", "low": 0.08, "high": 0.12}
    >>> scenario = wearsim.load_scenario("rig.toml", {"friction.coefficient": friction})
    >>> study = wearsim.dissipation(scenario, 100)
    >>> study.power.shape, list(study.inputs)
    ((100,), ['friction.coefficient'])
    >>> print(f"{study.summaries['power'].std:.4f} W")
    0.0074 W
    """

    power = Stored("power", "Dissipated power P_d, shape (realisations,) [W].")
    y = Stored("y", "Axial position of the strips [m].")
    dissipation = Stored(
        "dissipation",
        "Dissipated power per axial length, shape (kept realisations, strips) [W/m].",
    )

    def __repr__(self) -> str:
        done = f"{self.count}" if self.finished else f"{self.count} of {self.raw.requested}"
        noun, power = f"realisation{'s' * (done != '1')}", self.summaries["power"]
        std = f", std {power.std:.4g} W" if power.count > 1 else ""
        return f"<DissipationResult '{self.title}': {done} {noun}, power {power.mean:.4g} W{std}>"

    def values(self, name: str) -> FloatArray:
        """Return a variable of the results file, or the drawn values of an input.

        Parameters
        ----------
        name : str
            Name or dotted key, such as "peak_pressure" or "load.normal_force".

        Raises
        ------
        UnknownNameError
            If there is none; it lists the known ones.

        Examples
        --------
        >>> friction = {"distribution": "uniform", "low": 0.08, "high": 0.12}
        >>> scenario = wearsim.load_scenario("rig.toml", {"friction.coefficient": friction})
        >>> wearsim.dissipation(scenario, 10).values("friction.coefficient").shape
        (10,)
        """
        if name not in self.raw.variables:
            raise unknown_name(name, "a variable of this study", self.raw.variables)
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
    def mean_problem_power(self) -> float:
        """Dissipated power with every random input at its mean [W]."""
        return self.raw.mean_problem_power

    @cached_property
    def summaries(self) -> dict[str, Summary]:
        """Estimates of power, forces, moment and pressure over the realisations, by variable."""
        return summaries(self.raw.variables, self.raw.plan, self.raw.replicates)

    def convergence(self, points: int = 200) -> Convergence:
        """Return mean and standard deviation of the power against the number of realisations.

        Parameters
        ----------
        points : int
            Approximate number of points, evenly spaced in the logarithm of the sample size.

        Examples
        --------
        >>> friction = {"distribution": "uniform", "low": 0.08, "high": 0.12}
        >>> scenario = wearsim.load_scenario("rig.toml", {"friction.coefficient": friction})
        >>> found = wearsim.dissipation(scenario, 100).convergence()
        >>> int(found.count[-1]), bool(found.mean_error[-1] < found.mean_error[5])
        (100, True)
        """
        counts = np.geomspace(1, self.count, min(points, self.count)).round()
        course = converge(self.power, np.unique(counts.astype(np.int64)))
        if self.raw.plan != "sobol":
            return course
        mean_error, std_error = np.array(
            [_replicated_errors(self.power[:count], self.raw.replicates) for count in course.count]
        ).T
        return replace(course, mean_error=mean_error, std_error=std_error)


def summaries(
    variables: Arrays, plan: str = "monte-carlo", replicates: int = 1
) -> dict[str, Summary]:
    """Return estimates over the realisations, for each variable of `SUMMARISED`.

    Parameters
    ----------
    variables : dict of str to ndarray
        Variables of a dissipation study.
    plan : str
        Its sampling design.
    replicates : int
        Number of independent Sobol sequences, to which the realisations belong in turn.

    Returns
    -------
    dict of str to Summary
    """
    probabilities = tuple(sorted({*BAND, *PAPER_BAND, 0.5}))
    return {name: _summary(variables[name], probabilities, plan, replicates) for name in SUMMARISED}


def _summary(
    values: FloatArray, probabilities: tuple[float, ...], plan: str, replicates: int
) -> Summary:
    """Return estimates with the errors and intervals of a sampling design."""
    from wearsim.uq.estimation.estimates import estimate  # noqa: PLC0415  (not of a run)

    design: Design = "sobol" if plan == "sobol" else "monte-carlo"
    summary = summarise(values, probabilities)
    known = estimate(values, probabilities, design, np.arange(len(values)) % replicates)
    summary = replace(summary, mean_interval=known.mean, std_interval=known.std)
    if design == "monte-carlo" or summary.is_constant:
        return summary
    mean_error, std_error = _replicated_errors(values, replicates)
    return replace(
        summary,
        mean=known.mean.value,
        std=known.std.value if math.isfinite(known.std.value) else summary.std,
        mean_error=mean_error,
        std_error=std_error,
        quantiles=tuple(
            Quantile(item.value, item.low, item.high, p) for p, item in known.quantiles
        ),
    )


def _replicated_errors(values: FloatArray, replicates: int) -> tuple[float, float]:
    """Return the standard errors of mean and standard deviation by independent sequences."""
    from wearsim.uq.estimation.standard_errors import Replicated  # noqa: PLC0415

    errors = Replicated(np.arange(len(values)) % replicates)
    std = float(values.std())
    if errors.degrees < 1 or std == 0.0:
        return math.nan, math.nan
    deviation = values - values.mean()
    return errors.error(deviation), errors.error(deviation**2) / (2.0 * std)


def as_numbers(estimates: dict[str, Summary]) -> dict[str, Any]:
    """Return estimates ready for JSON, with None where they are not finite."""
    return {name: plain(asdict(summary)) for name, summary in estimates.items()}

"""Content of the file of a dissipation study, as plain values and arrays."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, ClassVar

from wearsim.results.content import Arrays, StudyData
from wearsim.results.dissipation.schema import dissipation_schema
from wearsim.results.schema import Schema


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
        Variables of `wearsim.results.dissipation.schema`, and the drawn values by dotted key.
    statistics : dict of str to object
        Estimates over the realisations, for other programs that read the file.
    solve_seconds : float
        Time spent on contact solves [s].
    """

    separately_stored: ClassVar[frozenset[str]] = StudyData.separately_stored | {"variables"}

    plan: str
    inputs: list[dict[str, str]]
    requested: int
    strip_width: float
    friction_grid: str
    mean_problem_power: float
    variables: Arrays
    solve_seconds: float
    statistics: dict[str, Any] = field(default_factory=dict)

    @property
    def schema(self) -> Schema:
        """Schema of the results file."""
        return dissipation_schema(self.inputs)

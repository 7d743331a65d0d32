"""What the file of a dissipation study holds, as plain values and arrays."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, ClassVar

from wearsim.results.content import Arrays, Content, StudyData
from wearsim.results.dissipation.schema import with_inputs


@dataclass(frozen=True, eq=False, kw_only=True)
class DissipationData(StudyData):
    """All there is to know of realisations of one contact, in SI, beside `StudyData`.

    Parameters
    ----------
    plan : str
        Name of the sampling plan.
    inputs : list of dict
        Dotted key and SI unit of each value that was drawn.
    asked : int
        Realisations that were asked for.
    strip_width : float
        Width of a strip [m].
    friction_grid : str
        Points and strips at which a friction field was taken; empty where there is none.
    mean_problem_power : float
        Dissipated power with every input at its mean [W].
    variables : dict of str to ndarray
        Those of `wearsim.results.dissipation.schema`, and the drawn values by dotted key.
    statistics : dict of str to object
        Estimates made from them, for readers of the file.
    solve_seconds : float
        Time that the contacts took [s].
    """

    stored_apart: ClassVar[frozenset[str]] = StudyData.stored_apart | {"variables"}

    plan: str
    inputs: list[dict[str, str]]
    asked: int
    strip_width: float
    friction_grid: str
    mean_problem_power: float
    variables: Arrays
    solve_seconds: float
    statistics: dict[str, Any] = field(default_factory=dict)

    @property
    def content(self) -> Content:
        """What goes into its file."""
        layout = with_inputs(self.inputs)
        return Content(layout, self.about, self.scenario_text, self.files, self.variables, {})

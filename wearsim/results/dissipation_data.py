"""What the file of a dissipation study holds, as plain values and arrays."""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from typing import Any

from wearsim.results.data import Arrays, Content
from wearsim.results.dissipation_layout import with_inputs


@dataclass(frozen=True, eq=False, kw_only=True)
class DissipationData:
    """All there is to know of realisations of one contact, in SI; what their file holds.

    Parameters
    ----------
    scenario_text : str
        TOML of the scenario, overrides included.
    scenario_file : str
        Where the scenario came from.
    title, sha256, seed : str, str, int
        Of the scenario.
    files : dict of str to str
        Content of every file the scenario names, by the path as written.
    software : dict of str to str
        Version by package.
    plugins : list of dict
        Plugins in use: kind, name, distribution and version of each.
    model, plan : str
        Names of the contact model and of the sampling plan.
    inputs : list of dict
        Dotted key and SI unit of each value that was drawn.
    asked : int
        Realisations that were asked for.
    finished : bool
        Whether all of them are done.
    strip_width : float
        Width of a strip [m].
    friction_grid : str
        Points and strips at which a friction field was taken; empty where there is none.
    mean_problem_power : float
        Dissipated power with every input at its mean [W].
    notes, warnings : list of str
        What a user should know, of the scenario and of the study.
    variables : dict of str to ndarray
        Those of `wearsim.results.dissipation_layout`, and the drawn values by dotted key.
    statistics : dict of str to object
        Estimates made from them, for readers of the file.
    solve_seconds, wall_seconds : float
        Time that the contacts took, and all of it [s].
    created : str
        When the study began, ISO 8601.
    """

    scenario_text: str
    scenario_file: str
    title: str
    sha256: str
    seed: int
    model: str
    plan: str
    inputs: list[dict[str, str]]
    asked: int
    finished: bool
    strip_width: float
    friction_grid: str
    mean_problem_power: float
    variables: Arrays
    solve_seconds: float
    wall_seconds: float
    created: str
    files: dict[str, str] = field(default_factory=dict)
    software: dict[str, str] = field(default_factory=dict)
    plugins: list[dict[str, str]] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)
    statistics: dict[str, Any] = field(default_factory=dict)

    @property
    def about(self) -> dict[str, Any]:
        """Everything but arrays, the scenario's text and its files, by name."""
        return {name: getattr(self, name) for name in ABOUT}

    @property
    def content(self) -> Content:
        """What goes into its file."""
        layout = with_inputs(self.inputs)
        return Content(layout, self.about, self.scenario_text, self.files, self.variables, {})


_STORED_APART = {"scenario_text", "files", "variables"}
ABOUT = tuple(item.name for item in fields(DissipationData) if item.name not in _STORED_APART)

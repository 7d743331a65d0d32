"""What a results file holds, as plain values and arrays."""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from typing import Any

import numpy as np
import numpy.typing as npt

from wearsim.results.layout import REPLAY, Layout

Arrays = dict[str, npt.NDArray[Any]]


@dataclass(frozen=True, eq=False)
class Content:
    """What goes into a results file of any kind.

    Parameters
    ----------
    layout : Layout
        The kind of file.
    about : dict of str to object
        Everything but arrays and texts, ready for JSON.
    scenario_text : str
        TOML of the scenario.
    files : dict of str to str
        Content of every file the scenario names.
    variables : dict of str to ndarray
        Those of the layout.
    checkpoint : dict of str to ndarray
        The state to resume from; nothing where there is nothing to resume.
    """

    layout: Layout
    about: dict[str, Any]
    scenario_text: str
    files: dict[str, str]
    variables: Arrays
    checkpoint: Arrays


@dataclass(frozen=True, eq=False, kw_only=True)
class RunData:
    """All there is to know of a run, in SI; what a results file holds.

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
    model, stepper : str
        Names of the contact model and of the stepper in use.
    tolerance : float
        Relative error asked of the final depth and worn volume.
    width_threshold : float
        Worn depth from which on the width counts [m].
    total_passes : float
        Roller passes of the whole test.
    notes, warnings : list of str
        What a user should know, of the scenario and of the run.
    kinematics : dict of str to float
        rolling_speed [m/s], cylinder_radius, roller_radius, crown_radius [m], pass_rate [1/s],
        physical_rollers.
    static, history, records : dict of str to ndarray
        The variables of `wearsim.results.layout`, by kind and name.
    checkpoint : dict of str to ndarray
        The state to resume from.
    finished : bool
        Whether all passes are done.
    wall_seconds : float
        Time the run took so far [s].
    created : str
        When the run began, ISO 8601.
    drawn : dict of str to dict
        What was drawn in the place of random inputs, by the scenario's key: `values`, one for the
        test or one per roller, and their SI `unit`.
    """

    scenario_text: str
    scenario_file: str
    title: str
    sha256: str
    seed: int
    model: str
    stepper: str
    tolerance: float
    width_threshold: float
    total_passes: float
    kinematics: dict[str, float]
    static: Arrays
    history: Arrays
    records: Arrays
    checkpoint: Arrays
    finished: bool
    wall_seconds: float
    created: str
    drawn: dict[str, dict[str, Any]] = field(default_factory=dict)
    files: dict[str, str] = field(default_factory=dict)
    software: dict[str, str] = field(default_factory=dict)
    plugins: list[dict[str, str]] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)

    @property
    def variables(self) -> Arrays:
        """The variables of all kinds, by name."""
        return {**self.static, **self.history, **self.records}

    @property
    def about(self) -> dict[str, Any]:
        """Everything but arrays, the scenario's text and its files, by name."""
        return {name: getattr(self, name) for name in ABOUT}

    @property
    def content(self) -> Content:
        """What goes into its file."""
        return Content(
            REPLAY, self.about, self.scenario_text, self.files, self.variables, self.checkpoint
        )


_STORED_APART = {"scenario_text", "files", "static", "history", "records", "checkpoint"}
ABOUT = tuple(item.name for item in fields(RunData) if item.name not in _STORED_APART)


def as_plain(value: object) -> object:
    """Return a numpy scalar as the Python number it is, for `json.dumps`."""
    if isinstance(value, np.generic):
        return value.item()
    raise TypeError(f"{type(value).__name__} cannot be stored")


def differences(one: RunData, other: RunData) -> list[str]:
    """Return the names of all fields and arrays in which two runs differ, to the bit.

    Parameters
    ----------
    one, other : RunData
        The runs.

    Returns
    -------
    list of str
    """
    names = [
        name
        for name in (*ABOUT, "scenario_text", "files")
        if getattr(one, name) != getattr(other, name)
    ]
    for kind in ("static", "history", "records", "checkpoint"):
        mine, theirs = getattr(one, kind), getattr(other, kind)
        names += [
            f"{kind}.{name}"
            for name in sorted(mine.keys() | theirs.keys())
            if not _same(mine.get(name), theirs.get(name))
        ]
    return names


def _same(one: npt.NDArray[Any] | None, other: npt.NDArray[Any] | None) -> bool:
    if one is None or other is None:
        return False
    alike = one.dtype == other.dtype and one.shape == other.shape
    return alike and one.tobytes() == other.tobytes()

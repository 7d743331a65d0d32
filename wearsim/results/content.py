"""What the files of all studies have in common, as plain values and arrays."""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

from wearsim.results.schema import Layout

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
    reserved : frozenset of str
        Variables that are given a place and no values; only their shape and type count here.
    """

    layout: Layout
    about: dict[str, Any]
    scenario_text: str
    files: dict[str, str]
    variables: Arrays
    checkpoint: Arrays
    reserved: frozenset[str] = frozenset()


@dataclass(frozen=True, eq=False, kw_only=True)
class StudyData:
    """What there is to know of any study.

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
    model : str
        Name of the contact model in use.
    notes, warnings : list of str
        What a user should know, of the scenario and of the study.
    finished : bool
        Whether all that was asked for is done.
    wall_seconds : float
        Time the study took so far [s].
    created : str
        When the study began, ISO 8601.
    """

    stored_apart: ClassVar[frozenset[str]] = frozenset({"scenario_text", "files"})
    """Texts and arrays: what the file has a place of its own for."""

    scenario_text: str
    scenario_file: str
    title: str
    sha256: str
    seed: int
    model: str
    finished: bool
    wall_seconds: float
    created: str
    files: dict[str, str] = field(default_factory=dict)
    software: dict[str, str] = field(default_factory=dict)
    plugins: list[dict[str, str]] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)

    @classmethod
    def told(cls) -> tuple[str, ...]:
        """Return the names of what is told besides texts and arrays."""
        return tuple(item.name for item in fields(cls) if item.name not in cls.stored_apart)

    @property
    def about(self) -> dict[str, Any]:
        """Everything but arrays, the scenario's text and its files, by name."""
        return {name: getattr(self, name) for name in self.told()}


def as_plain(value: object) -> object:
    """Return a numpy scalar as the Python number it is, for `json.dumps`."""
    if isinstance(value, np.generic):
        return value.item()
    raise TypeError(f"{type(value).__name__} cannot be stored")

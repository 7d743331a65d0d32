"""Content common to the results files of all studies, as plain values and arrays."""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

Arrays = dict[str, npt.NDArray[Any]]

CHECKPOINT, INPUTS = "checkpoint", "inputs"
"""Groups of a results file."""
ABOUT, SCENARIO, FILES = "about", "scenario", "files"
"""Texts in the group of the inputs: the attributes, the scenario and its files."""
ERRORS = "surrogatepass"  # so that every Python string can be stored


@dataclass(frozen=True, eq=False, kw_only=True)
class StudyData:
    """Data common to all studies.

    Parameters
    ----------
    scenario_text : str
        TOML of the scenario, overrides included.
    scenario_file : str
        Path of the scenario file.
    title, sha256, seed : str, str, int
        Title, checksum and seed of the scenario.
    files : dict of str to str
        Content of every file named in the scenario, by the path as written there.
    software : dict of str to str
        Version by package.
    plugins : list of dict
        Plugins in use: kind, name, distribution and version of each.
    model : str
        Name of the contact model.
    notes, warnings : list of str
        Remarks on the scenario and on the computation.
    finished : bool
        Whether the study is complete.
    wall_seconds : float
        Wall time of the study so far [s].
    created : str
        Start of the study, ISO 8601.
    """

    separately_stored: ClassVar[frozenset[str]] = frozenset({"scenario_text", "files"})

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
    def attribute_names(cls) -> tuple[str, ...]:
        """Return the names of all fields except those stored separately (long texts, arrays)."""
        return tuple(item.name for item in fields(cls) if item.name not in cls.separately_stored)

    @property
    def attributes(self) -> dict[str, Any]:
        """Fields by name, without those stored separately."""
        return {name: getattr(self, name) for name in self.attribute_names()}


def as_plain(value: object) -> object:
    """Return a numpy scalar as a Python number, for `json.dumps`."""
    if isinstance(value, np.generic):
        return value.item()
    raise TypeError(f"{type(value).__name__} cannot be stored")

"""Content common to the results files of all studies, and properties common to their results."""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Generic, TypeVar

import numpy as np
import numpy.typing as npt

if TYPE_CHECKING:
    from wearsim.scenario import Scenario


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


Data = TypeVar("Data", bound=StudyData)


@dataclass(frozen=True, eq=False)
class StudyResult(Generic[Data]):
    """Result of a study, finished or not.

    Parameters
    ----------
    raw : RunData, DissipationData or EnsembleData
        Content of the results file, with all axes.
    path : Path, optional
        The results file, if there is one.
    """

    raw: Data
    path: Path | None = None

    @cached_property
    def scenario(self) -> Scenario:
        """The scenario, parsed from the text and the files stored with the results."""
        from wearsim.scenario import parse_scenario  # noqa: PLC0415  (reading results needs none)

        return parse_scenario(
            self.raw.scenario_text, self.raw.scenario_file, self.raw.files.__getitem__
        )

    @property
    def title(self) -> str:
        """Title of the scenario."""
        return self.raw.title

    @property
    def model(self) -> str:
        """Name of the contact model."""
        return self.raw.model

    @property
    def described_model(self) -> str:
        """The contact model with the options set in the scenario."""
        from wearsim.scenario import described_model  # noqa: PLC0415  (slow to import)

        return described_model(self.raw.model, self.raw.scenario_text)

    @property
    def finished(self) -> bool:
        """Whether the study is complete."""
        return self.raw.finished

    @property
    def notes(self) -> tuple[str, ...]:
        """Remarks on the scenario."""
        return tuple(self.raw.notes)

    @property
    def warnings(self) -> tuple[str, ...]:
        """Remarks on the computation, such as limits of accuracy."""
        return tuple(self.raw.warnings)

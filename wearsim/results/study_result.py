"""What the results of all studies tell alike."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Generic, TypeVar

from wearsim.results.content import StudyData

if TYPE_CHECKING:
    from wearsim.scenario import Scenario

Data = TypeVar("Data", bound=StudyData)


@dataclass(frozen=True, eq=False)
class StudyResult(Generic[Data]):
    """A study, finished or not.

    Parameters
    ----------
    raw : RunData or DissipationData
        All there is, every axis kept.
    path : Path, optional
        The results file, where there is one.
    """

    raw: Data
    path: Path | None = None

    @cached_property
    def scenario(self) -> Scenario:
        """The scenario, read from the text and files that are stored with the results."""
        from wearsim.scenario import parse_scenario  # noqa: PLC0415  (a results file needs none)

        raw = self.raw
        return parse_scenario(raw.scenario_text, raw.scenario_file, raw.files.__getitem__)

    @property
    def title(self) -> str:
        """What the scenario is, in a line."""
        return self.raw.title

    @property
    def model(self) -> str:
        """Name of the contact model in use."""
        return self.raw.model

    @property
    def described_model(self) -> str:
        """The contact model with the options that the scenario gives it."""
        from wearsim.scenario import described_model  # noqa: PLC0415  (slow to import)

        return described_model(self.raw.model, self.raw.scenario_text)

    @property
    def finished(self) -> bool:
        """Whether all that was asked for is done."""
        return self.raw.finished

    @property
    def notes(self) -> tuple[str, ...]:
        """What a user should know of the scenario."""
        return tuple(self.raw.notes)

    @property
    def warnings(self) -> tuple[str, ...]:
        """What a user should know of how it was computed."""
        return tuple(self.raw.warnings)

"""Properties common to the results of all studies."""

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

"""The scenario: immutable, validated, in SI, with its TOML text and its input files."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path, PurePath
from typing import TypeAlias

from wearsim.errors import Mistake, ScenarioError
from wearsim.scenario.random.model import RandomInput
from wearsim.scenario.tables.bodies import Cylinder, Roller
from wearsim.scenario.tables.plain import (
    CreepageTable,
    EvolutionTable,
    FrictionTable,
    OperationTable,
    OutputsTable,
    SamplingTable,
)
from wearsim.scenario.tables.plugin import ContactChoice, LoadChoice, WearChoice

Drawn: TypeAlias = float | tuple[float, ...]


@dataclass(frozen=True, eq=False)
class Scenario:
    """All inputs of a run, in SI.

    Parameters
    ----------
    file : str
        The file that it was read from.
    title : str
        One line of description.
    seed : int
        Seed of all random draws.
    text : str
        Its TOML, with the overrides applied.
    files : mapping of str to str
        Content of every file it names, by the path as written in the scenario.
    roller, cylinder, operation, load, friction, creepage, contact, evolution, outputs, sampling
        The tables; a random input is represented by its mean.
    wear : WearChoice, optional
        The wear law; optional in a scenario of a single contact.
    notes : tuple of str
        Notes for the user on the validity of the results.
    random : tuple of RandomInput
        The random inputs, in the order of their names.
    drawn : mapping of str to float or tuple of float
        Values that replace random inputs, by dotted key, in SI; a tuple has one value per roller.
    """

    file: str
    title: str
    seed: int
    text: str
    files: Mapping[str, str]
    roller: Roller
    cylinder: Cylinder
    operation: OperationTable
    load: LoadChoice
    friction: FrictionTable
    creepage: CreepageTable
    contact: ContactChoice
    wear: WearChoice | None
    evolution: EvolutionTable
    outputs: OutputsTable
    sampling: SamplingTable
    notes: tuple[str, ...] = ()
    random: tuple[RandomInput, ...] = ()
    drawn: Mapping[str, Drawn] = field(default_factory=dict)

    @property
    def name(self) -> str:
        """File name without folder and suffix."""
        return PurePath(self.file).stem

    @property
    def paths(self) -> tuple[Path, ...]:
        """Paths of the scenario's file and of the files it names, relative to its folder."""
        own = Path(self.file)
        return (own, *(own.parent / name for name in self.files))

    @property
    def sha256(self) -> str:
        """SHA-256 digest of the text and of every file's path and content."""
        digest = hashlib.sha256()
        for part in (self.text, *(part for item in sorted(self.files.items()) for part in item)):
            data = part.encode()
            digest.update(f"{len(data)}:".encode())
            digest.update(data)
        return digest.hexdigest()

    @property
    def rolling_speed(self) -> float:
        """Rolling velocity V, the cylinder's surface speed [m/s]."""
        return self.operation.speed * self.cylinder.radius

    @property
    def pass_rate(self) -> float:
        """Roller passes per unit of time, all rollers together [1/s]."""
        return self.operation.rollers * self.operation.speed / math.tau

    @property
    def total_passes(self) -> int:
        """Number of roller passes of the test, at least one; raises as `require_run`."""
        if self.operation.passes is not None:
            return self.operation.passes
        if self.operation.duration is None:
            raise ScenarioError(self.file, [_no_length()])
        return max(1, round(self.pass_rate * self.operation.duration))

    @property
    def total_time(self) -> float:
        """Simulated time of all roller passes [s]; raises as `require_run`."""
        return self.total_passes / self.pass_rate

    def per_roller(self, value: float | tuple[float, ...]) -> tuple[float, ...]:
        """Return one value per roller.

        Parameters
        ----------
        value : float or tuple of float
            One value for all rollers, or one per roller.
        """
        return value if isinstance(value, tuple) else (value,) * self.operation.rollers


def _no_length() -> Mistake:
    expected = 'one of them, such as duration = "450 min"'
    return Mistake("operation", "duration or passes", "is needed for a run", "none", expected)


def require_run(scenario: Scenario) -> None:
    """Check that a scenario has all that a run needs.

    Parameters
    ----------
    scenario : Scenario
        Any scenario, also one of a single contact.

    Raises
    ------
    ScenarioError
        If it has no duration or no wear law; both are reported together.
    """
    mistakes = []
    if scenario.operation.duration is None and scenario.operation.passes is None:
        mistakes.append(_no_length())
    if scenario.wear is None:
        expected = 'law = "archard-dissipation" and its options'
        mistakes.append(Mistake("wear", "", "the table is needed for a run", None, expected))
    if mistakes:
        raise ScenarioError(scenario.file, mistakes)

"""The scenario: immutable, validated, in SI, with its TOML text and its input files."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path, PurePath
from typing import Any, TypeAlias

from pydantic import BaseModel

from wearsim.errors import Mistake, ScenarioError
from wearsim.profiles import split_name
from wearsim.scenario.parse.fields import RandomInput
from wearsim.scenario.parse.mistakes import Mistakes, replace_numbers
from wearsim.scenario.tables.bodies import Cylinder, Roller
from wearsim.scenario.tables.plain import (
    CreepageTable,
    EvolutionTable,
    FrictionTable,
    OperationTable,
    OutputsTable,
    SamplingTable,
    check_angles,
    check_lists,
)
from wearsim.scenario.tables.plugin import ContactChoice, LoadChoice, WearChoice, check_load

Drawn: TypeAlias = float | tuple[float, ...]

_NO_LENGTH = Mistake(
    "operation",
    "duration or passes",
    "is needed for a run",
    "none",
    'one of them, such as duration = "450 min"',
)
_NO_WEAR = Mistake(
    "wear",
    "",
    "the table is needed for a run",
    None,
    'law = "archard-dissipation" and its options',
)


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
        return (own, *(own.parent / split_name(name)[0] for name in self.files))

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
            raise ScenarioError(self.file, [_NO_LENGTH])
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
    has_length = scenario.operation.duration or scenario.operation.passes
    mistakes = [*([] if has_length else [_NO_LENGTH]), *([] if scenario.wear else [_NO_WEAR])]
    if mistakes:
        raise ScenarioError(scenario.file, mistakes)


def realise(scenario: Scenario, values: Mapping[str, Drawn]) -> Scenario:
    """Return a scenario with values instead of random inputs.

    The values are recorded in `drawn`, and pass the checks that a value in the file would.

    Parameters
    ----------
    scenario : Scenario
        With random inputs.
    values : mapping of str to float or tuple of float
        In SI, by the dotted keys that the inputs set (`RandomInput.keys`); where a scenario may
        hold a list, a tuple is one value per roller.

    Returns
    -------
    Scenario
        Text, files and digest are those of the scenario given.

    Raises
    ------
    ValueError
        If a key is not set by any random input, or a joint input would be set in part.
    ScenarioError
        If a value is out of its bounds.
    """
    owners = {key: item for item in scenario.random for key in item.keys}
    unknown = [key for key in values if key not in owners]
    if unknown:
        raise ValueError(f"no random input sets {unknown[0]}; known: {', '.join(owners) or 'none'}")
    numbers: dict[str, dict[str, Any]] = {}
    for key, value in values.items():
        missing = [other for other in owners[key].keys if other not in values]
        if missing:
            raise ValueError(f"{owners[key].name} sets {missing[0]} too, which is not given")
        *tables, last = key.split(".")
        place: dict[str, Any] = numbers
        for table in tables:
            place = place.setdefault(table, {})
        place[last] = tuple(map(float, value)) if isinstance(value, tuple) else float(value)
    mistakes = Mistakes(scenario.file, scenario.files.__getitem__)
    sections = {
        table: _replaced(mistakes, getattr(scenario, table), keys, table)
        for table, keys in sorted(numbers.items())
    }
    check_lists(mistakes, {**numbers, "operation": {"rollers": scenario.operation.rollers}})
    mistakes.raise_any()
    if "creepage" in sections:
        check_angles(mistakes, sections["creepage"])
    if "load" in sections:
        check_load(mistakes, sections["load"])
    mistakes.raise_any()
    return replace(
        scenario,
        **sections,
        random=tuple(item for item in scenario.random if item.keys[0] not in values),
        drawn={**scenario.drawn, **values},
    )


def _replaced(mistakes: Mistakes, section: Any, numbers: dict[str, Any], table: str) -> Any:
    """Return a table's model, or the choice of a plugin, with numbers replaced."""
    if isinstance(section, BaseModel):
        return replace_numbers(mistakes, section, numbers, table)
    if isinstance(section, LoadChoice):
        inner = {term.name: numbers.pop(term.name, {}) for term in section.terms}
        terms = [
            _replaced(mistakes, term, inner[term.name], f"{table}.{term.name}")
            for term in section.terms
        ]
        section = replace(section, terms=tuple(terms))
    if not numbers:
        return section
    return replace(section, options=replace_numbers(mistakes, section.options, numbers, table))

"""The scenario: immutable, validated, in SI, with its TOML text and its input files."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path, PurePath
from typing import TypeAlias

from wearsim.errors import Mistake, ScenarioError, mistake_in
from wearsim.mechanics.hertz.elasticity import ElasticPair
from wearsim.plugins import Options
from wearsim.profiles import split_name
from wearsim.scenario.axial_gap import AxialGap
from wearsim.scenario.parse.fields import RandomInput
from wearsim.scenario.parse.overrides import flat
from wearsim.scenario.parse.toml import parse_fields, reader_in
from wearsim.scenario.tables.bodies import Cylinder, Roller
from wearsim.scenario.tables.cam import Cam, LubricantTable
from wearsim.scenario.tables.fatigue import FatigueChoice
from wearsim.scenario.tables.plain import (
    CreepageTable,
    EvolutionTable,
    FrictionTable,
    LimitTable,
    OperationTable,
    OutputsTable,
    SamplingTable,
)
from wearsim.scenario.tables.plugin import ContactChoice, LoadChoice, WearChoice
from wearsim.types import Material

Drawn: TypeAlias = float | tuple[float, ...]

DEEPEST = 0.1  # worn depth over the radius of the roller, up to which the surfaces are shallow
_NO_LENGTH = Mistake(
    "operation",
    "duration or passes",
    "is needed for a run",
    "none",
    'one of them, such as duration = "450 min"',
)
_NO_WEAR = Mistake(
    *("wear", "", "the table is needed for a run"),
    *(None, 'law = "archard-dissipation" and its options'),
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
    pair : ElasticPair
        Combined elastic constants of cylinder and roller.
    axial_gap : AxialGap
        Gap of roller and cylinder along the axis, without start profiles.
    limit : LimitTable
        Limits of wear.
    wear : WearChoice, optional
        The wear law; optional in a scenario of a single contact.
    fatigue : FatigueChoice, optional
        Rolling-contact fatigue of the bodies.
    cam : Cam, optional
        The cam; `cylinder` is then its base circle.
    lubricant : LubricantTable, optional
        Lubricant of the cam.
    notes : tuple of str
        Notes for the user on the validity of the results.
    random : tuple of RandomInput
        The random inputs, in the order of their names.
    drawn : mapping of str to float or tuple of float
        Values that replace random inputs, by dotted key, in SI; a tuple has one value per roller.
    tables : mapping of str to Options
        Tables that belong to plugins, by name.

    Examples
    --------
    >>> scenario = wearsim.load_scenario("rig.toml")
    >>> scenario
    <Scenario 'a wear test': 3 rollers, constant load, 1350000 passes, slender>
    >>> scenario.friction.coefficient, scenario.total_time
    (0.1, 27000.0)
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
    pair: ElasticPair
    axial_gap: AxialGap = field(repr=False)  # follows from the bodies
    limit: LimitTable = field(default_factory=LimitTable)
    fatigue: FatigueChoice | None = None
    cam: Cam | None = None
    lubricant: LubricantTable | None = None
    notes: tuple[str, ...] = ()
    random: tuple[RandomInput, ...] = ()
    drawn: Mapping[str, Drawn] = field(default_factory=dict)
    tables: Mapping[str, Options] = field(default_factory=dict)

    def _repr_html_(self) -> str:
        from wearsim.scenario.display import scenario_html  # noqa: PLC0415  (of notebooks)

        return scenario_html(self)

    @classmethod
    def from_toml(
        cls,
        text: str,
        overrides: Mapping[str, object] | None = None,
        *,
        folder: str | Path = ".",
        name: str = "scenario",
        confined: bool = False,
    ) -> Scenario:
        """Read a scenario from a text.

        Parameters
        ----------
        text : str
            TOML, as in a scenario file.
        overrides : mapping of str to object, optional
            Values by dotted key, {"load.normal_force": "350 N"}.
        folder : str or Path
            Folder of the files that the scenario names.
        name : str
            Name of the scenario in messages, and its title if it has none.
        confined : bool
            Refuse files outside the folder, for scenarios that somebody else writes.

        Returns
        -------
        Scenario

        Raises
        ------
        ScenarioError, PluginError
            As `load_scenario`.

        Examples
        --------
        >>> from pathlib import Path
        >>> text = Path("rig.toml").read_text()
        >>> wearsim.Scenario.from_toml(text, {"operation.rollers": 1}).total_passes
        450000
        """
        return parse_scenario(
            text, str(Path(folder) / name), reader_in(Path(folder), confined=confined), overrides
        )

    @classmethod
    def from_dict(
        cls, tables: Mapping[str, object], *, folder: str | Path = ".", name: str = "scenario"
    ) -> Scenario:
        """Make a scenario from tables.

        Parameters
        ----------
        tables : mapping of str to object
            Values by table and key, as in a scenario file; a dotted key leads into inner tables.
            ``cylinder.profile`` is a file, or a `Profile`.
        folder, name
            As in `from_toml`.

        Returns
        -------
        Scenario

        Raises
        ------
        ScenarioError, PluginError
            As `load_scenario`.

        Examples
        --------
        >>> steel = {"radius": "20 mm", "material": "steel"}
        >>> scenario = wearsim.Scenario.from_dict(
        ...     {
        ...         "roller": {**steel, "crown_radius": "500 mm"},
        ...         "cylinder": steel,
        ...         "operation": {"speed": "1000 rpm", "rollers": 1},
        ...         "load": {"kind": "constant", "normal_force": "300 N"},
        ...         "friction": {"coefficient": 0.1},
        ...         "creepage": {"longitudinal": 1e-3},
        ...     }
        ... )
        >>> print(f"{wearsim.solve_contact(scenario).power:.3f} W")
        0.061 W
        """
        return cls.from_toml("", dict(flat(tables)), folder=folder, name=name)

    def changed(self, overrides: Mapping[str, object]) -> Scenario:
        """Return a scenario with other values.

        Parameters
        ----------
        overrides : mapping of str to object
            Values by dotted key, {"load.normal_force": "350 N"}; an entry of a list has its number,
            {"cam.motion.2.law": "modified-sine"}.

        Returns
        -------
        Scenario

        Raises
        ------
        ScenarioError, PluginError
            As `load_scenario`.

        Examples
        --------
        >>> scenario = wearsim.load_scenario("rig.toml").changed({"operation.duration": "30 min"})
        >>> scenario.total_passes
        90000
        """
        read = reader_in(Path(self.file).parent)

        def read_again(name: str) -> str:
            return self.files[name] if name in self.files else read(name)

        return parse_scenario(self.text, self.file, read_again, overrides)

    def __repr__(self) -> str:
        rollers = self.operation.rollers
        length = f"{self.total_passes} passes" if self.has_length else "one contact"
        random = f", {len(self.random)} random" if self.random else ""
        return (
            f"<Scenario '{self.title}': {rollers} roller{'s' if rollers > 1 else ''},"
            f" {self.load.kind} load, {length}, {self.contact.model}{random}>"
        )

    @property
    def name(self) -> str:
        """File name without folder and suffix."""
        return PurePath(self.file).stem

    @property
    def paths(self) -> tuple[Path, ...]:
        """Paths of the scenario's file and of the files it names, relative to its folder."""
        file = Path(self.file)
        return (file, *(file.parent / split_name(name)[0] for name in self.files))

    @cached_property
    def sha256(self) -> str:
        """SHA-256 digest of the text and of every file's path and content."""
        digest = hashlib.sha256()
        for part in (self.text, *(part for item in sorted(self.files.items()) for part in item)):
            data = part.encode()
            digest.update(f"{len(data)}:".encode() + data)
        return digest.hexdigest()

    @cached_property
    def has_length(self) -> bool:
        """Whether a duration or a number of passes or turns is given."""
        operation = self.operation
        return bool(operation.passes or operation.turns or operation.duration)

    @cached_property
    def materials(self) -> tuple[Material, Material]:
        """Materials of cylinder and roller."""
        return self.cylinder.material, self.roller.material

    @cached_property
    def greatest_valid_depth(self) -> float:
        """Greatest depth for which models are valid, inf if deeper ones are allowed [m]."""
        return math.inf if self.evolution.allow_deep else DEEPEST * self.roller.radius

    @cached_property
    def rolling_speed(self) -> float:
        """Rolling velocity V, the surface speed of the cylinder or the base circle [m/s]."""
        return self.operation.speed * self.cylinder.radius

    @cached_property
    def pass_rate(self) -> float:
        """Roller passes per unit of time, all rollers together [1/s]."""
        return self.operation.rollers * self.operation.speed / math.tau

    @cached_property
    def life_unit(self) -> tuple[str, float]:
        """Unit in which the length of a test is counted, and the roller passes in it."""
        return ("turns", float(self.operation.rollers)) if self.cam else ("passes", 1.0)

    @cached_property
    def total_passes(self) -> int:
        """Number of roller passes of the test, at least one; raises as `require_run`."""
        if self.operation.passes is not None:
            return self.operation.passes
        if self.operation.turns is not None:
            return self.operation.turns * self.operation.rollers
        if self.operation.duration is None:
            raise ScenarioError(self.file, [_NO_LENGTH])
        return max(1, round(self.pass_rate * self.operation.duration))

    @cached_property
    def total_time(self) -> float:
        """Simulated time of all roller passes [s]; raises as `require_run`."""
        return self.total_passes / self.pass_rate

    def per_roller(self, value: float | tuple[float, ...]) -> tuple[float, ...]:
        """Return one value per roller, from one for all rollers or one per roller.

        Examples
        --------
        >>> scenario = wearsim.load_scenario("rig.toml")
        >>> scenario.per_roller(scenario.roller.offset)
        (0.0, 0.0, 0.0)
        """
        return value if isinstance(value, tuple) else (value,) * self.operation.rollers


def require_run(scenario: Scenario) -> None:
    """Check that a scenario, which may be one of a single contact, has all that a run needs.

    Raises
    ------
    ScenarioError
        If it has no duration or no wear law; both are reported together.
    """
    mistakes = [
        *([] if scenario.has_length else [_NO_LENGTH]),
        *([] if scenario.wear else [_NO_WEAR]),
    ]
    if mistakes:
        raise ScenarioError(scenario.file, mistakes)


def load_scenario(path: str | Path, overrides: Mapping[str, object] | None = None) -> Scenario:
    """Read a scenario from a TOML file.

    Parameters
    ----------
    path : str or Path
        The file; paths of files that it names are relative to its folder.
    overrides : mapping of str to object, optional
        Values by dotted key, {"load.normal_force": "350 N"}.

    Returns
    -------
    Scenario

    Raises
    ------
    ScenarioError
        With all mistakes of the scenario.
    PluginError
        If two plugins have the same name.

    Examples
    --------
    >>> wearsim.load_scenario("rig.toml", {"load.normal_force": "350 N", "operation.rollers": 1})
    <Scenario 'a wear test': 1 roller, constant load, 450000 passes, slender>
    """
    if not isinstance(path, str | Path):
        raise TypeError(
            f"scenario must be a Scenario or the path of its file, got a {type(path).__name__};"
            " Scenario.from_dict makes one from tables"
        )
    if "\n" in str(path):
        raise mistake_in(
            "scenario", "is a text, not the name of a file; Scenario.from_toml reads it"
        )
    path = Path(path)
    try:
        text = path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as error:
        what, shell, python = "is not text in UTF-8", "", ""
        if path.read_bytes().startswith(b"\x89HDF"):
            what = "is a results file, not a scenario"
            shell = f"show it with: wearsim show {path}"
            python = f'open it with wearsim.open_results("{path}")'
        raise ScenarioError(
            str(path), [Mistake("", "", what)], python=python, shell=shell
        ) from error
    except OSError as error:
        raise mistake_in(str(path), f"the file cannot be read ({error.strerror})") from error
    return parse_scenario(text, str(path), reader_in(path.parent), overrides)


def parse_scenario(
    text: str,
    name: str,
    read: Callable[[str], str],
    overrides: Mapping[str, object] | None = None,
) -> Scenario:
    """Return the scenario that a text holds; errors as `load_scenario`.

    Parameters
    ----------
    text : str
        TOML.
    name : str
        The scenario's file, for messages.
    read : callable
        Returns the content of a file that the scenario names; for a stored scenario,
        ``scenario.files.__getitem__``.
    overrides : mapping of str to object, optional
        Values by dotted key.
    """
    return Scenario(**parse_fields(text, name, read, overrides))


def as_scenario(scenario: Scenario | str | Path) -> Scenario:
    """Return a scenario, read from its file if a path is given; errors as `load_scenario`.

    Raises
    ------
    TypeError
        If it is something else.
    """
    return scenario if isinstance(scenario, Scenario) else load_scenario(scenario)

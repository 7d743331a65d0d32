"""Content common to the results files of all studies: axes, variables, schemas and attributes."""

from __future__ import annotations

from collections.abc import Container, Iterable, Mapping, Sequence, Set
from dataclasses import dataclass, field, fields, replace
from functools import cache, cached_property
from pathlib import Path
from types import UnionType
from typing import (
    TYPE_CHECKING,
    Any,
    ClassVar,
    Generic,
    Literal,
    TypeAlias,
    TypeVar,
    Union,
    cast,
    get_args,
    get_origin,
    get_type_hints,
)

import numpy as np
import numpy.typing as npt

from wearsim.errors import ResultsFileError, ScenarioError, unknown_name
from wearsim.report.frames import as_dataset
from wearsim.results.viewed import Viewed

if TYPE_CHECKING:
    import xarray

    from wearsim.scenario import Scenario


Kind: TypeAlias = Literal["static", "history", "record", "statistic"]
#: Groups of a results file.
CHECKPOINT, INPUTS = "checkpoint", "inputs"
#: Texts in the group of the inputs: the attributes, the scenario and its files.
ABOUT, SCENARIO, FILES = "about", "scenario", "files"
#: Attribute of an array of which a stored chunk has zeros only.
ZEROS = "zeros"
ERRORS = "surrogatepass"  # so that every Python string can be stored
Array: TypeAlias = npt.NDArray[Any]
Arrays: TypeAlias = dict[str, Array]


@dataclass(frozen=True)
class Axis:
    """A named dimension.

    Parameters
    ----------
    name : str
        Name in the file.
    long_name : str
        Description.
    first : int
        Number of the first entry.
    """

    name: str
    long_name: str
    first: int = 1


@dataclass(frozen=True)
class Variable:
    """A variable of a file.

    Parameters
    ----------
    name : str
        Name, in the file and in `RunData`.
    dims : tuple of str
        Axes, slowest first.
    unit : str
        SI unit; "1" for a plain number.
    long_name : str
        Description.
    kind : {"static", "history", "record", "statistic"}
        Stored once, once per step, once per record, or estimated over the realisations.
    """

    name: str
    dims: tuple[str, ...]
    unit: str
    long_name: str
    kind: Kind


Item = TypeVar("Item", Axis, Variable)


def of_present(
    groups: Mapping[str, Mapping[str, Variable]], present: Set[str]
) -> dict[str, Variable]:
    """Return the variables of the groups that apply.

    A name such as "cam fatigue" applies where "cam" and "fatigue" are both `present`.
    """
    chosen = (group for words, group in groups.items() if present >= set(words.split()))
    return {name: variable for group in chosen for name, variable in group.items()}


def by_name(items: Iterable[Item]) -> dict[str, Item]:
    """Return axes or variables by name."""
    return {item.name: item for item in items}


@dataclass(frozen=True)
class Schema:
    """Format, axes and variables of one kind of results file.

    Parameters
    ----------
    format : str
        Name of the format.
    version : int
        Number of the layout, the only one that is written and read.
    holds : str
        Content and the command that writes it, for messages.
    axes : mapping of str to Axis
        Axes by name, without those whose coordinate is a variable, such as y.
    variables : mapping of str to Variable
        Variables by name.
    """

    format: str
    version: int
    holds: str
    axes: Mapping[str, Axis]
    variables: Mapping[str, Variable]


def only_zeros(array: Array) -> bool:
    """Return whether an array holds zeros or empty texts only."""
    return not (array != b"" if array.dtype.kind == "S" else array).any()


def with_random_inputs(schema: Schema, inputs: Sequence[Mapping[str, str]]) -> Schema:
    """Return a schema extended by a variable for each drawn value.

    Parameters
    ----------
    schema : Schema
        The schema without drawn values.
    inputs : sequence of mapping
        Dotted key and SI unit of each drawn value, ``{"key": "load.normal_force", "unit": "N"}``,
        with ``"rollers": "each"`` where the rollers have separate values.

    Returns
    -------
    Schema
    """
    dims = {"": ("realisation",), "each": ("realisation", "roller")}
    drawn = by_name(
        Variable(item["key"], dims[item.get("rollers", "")], item["unit"], "drawn value", "record")
        for item in inputs
    )
    return replace(schema, variables={**schema.variables, **drawn})


def axis_lengths(
    shapes: Mapping[str, tuple[int, ...]], table: Mapping[str, Variable]
) -> dict[str, int]:
    """Return the length of every axis.

    Parameters
    ----------
    shapes : mapping of str to tuple of int
        Shape of every variable of the table, by name.
    table : mapping of str to Variable
        The variables of the schema.

    Returns
    -------
    dict of str to int

    Raises
    ------
    ValueError
        If a variable is missing or unknown, or has another length along an axis than the others.
    """
    if shapes.keys() != table.keys():
        missing = [name for name in table if name not in shapes]
        unknown = [name for name in shapes if name not in table]
        raise ValueError(f"missing variables {missing}, unknown variables {unknown}")
    lengths: dict[str, int] = {}
    for name, shape in shapes.items():
        dims = table[name].dims
        if len(shape) != len(dims):
            raise ValueError(f"{name} has {len(shape)} axes, expected {', '.join(dims)}")
        for dim, length in zip(dims, shape, strict=True):
            if lengths.setdefault(dim, length) != length:
                raise ValueError(f"{name} has {length} along {dim}, others have {lengths[dim]}")
    return lengths


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

    separately_stored: ClassVar[frozenset[str]] = frozenset({"scenario_text", "files", "variables"})
    #: fields that files of earlier versions lack
    optional: ClassVar[frozenset[str]] = frozenset()

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

    @classmethod
    def check_types(cls, attributes: Mapping[str, Any]) -> None:
        """Raise a ValueError unless fields that were read from a file have their types."""
        hints = _types_of(cls)  # type: ignore[arg-type]  # a class is hashable
        for name, value in attributes.items():
            if not _has_type(value, hints[name]):
                raise ValueError(f"{name} is a {type(value).__name__} of unknown content")

    #: schema of the file without variables that depend on the study
    base_schema: ClassVar[Schema]

    @property
    def schema(self) -> Schema:
        """Schema of the results file."""
        return self.base_schema

    @classmethod
    def schema_of(cls, attributes: Mapping[str, Any], names: Container[str]) -> Schema:
        """Return the schema of a file by its attributes and the names of its variables."""
        return cls.base_schema

    @classmethod
    def from_variables(
        cls, attributes: Mapping[str, Any], variables: Arrays, checkpoint: Arrays
    ) -> Any:
        """Return the content of a file from its fields, variables and checkpoint."""
        return cls(**attributes, variables=variables)  # type: ignore[call-arg]

    @property
    def labels(self) -> dict[str, Any]:
        """Format and short attributes, which other programs can read in the file."""
        about = {"format": self.schema.format, "format_version": self.schema.version}
        return about | {
            name: value
            for name, value in self.attributes.items()
            if isinstance(value, str | int | float | np.number | np.bool_)
        }

    @property
    def attributes(self) -> dict[str, Any]:
        """Fields by name, without those stored separately."""
        return {name: getattr(self, name) for name in self.attribute_names()}


@cache
def _types_of(data: type[StudyData]) -> dict[str, Any]:
    """Return the types of the fields of a class."""
    return get_type_hints(data)


def _has_type(value: Any, hint: Any) -> bool:
    """Return whether a value of JSON has a type, lists and tables with all they hold."""
    kind, parts = get_origin(hint), get_args(hint)
    if hint is Any:
        return True
    if kind in {Union, UnionType}:
        return any(_has_type(value, part) for part in parts)
    if kind is list:
        return isinstance(value, list) and all(_has_type(item, parts[0]) for item in value)
    if kind is dict:
        return isinstance(value, dict) and all(_has_type(v, parts[1]) for v in value.values())
    is_kind = isinstance(value, int | float if hint is float else hint)
    return is_kind and isinstance(value, bool) == (hint is bool)


def as_plain(value: object) -> object:
    """Return a numpy scalar as a Python number, for `json.dumps`."""
    if isinstance(value, np.generic):
        return value.item()
    raise TypeError(f"{type(value).__name__} cannot be stored")


Data = TypeVar("Data", bound=StudyData)


@dataclass(frozen=True, eq=False)
class StudyResult(Viewed, Generic[Data]):
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

    def __repr__(self) -> str:
        return f"<{type(self).__name__} '{self.title}'>"

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_") or name == "raw" or hasattr(type(self), name):
            return object.__getattribute__(self, name)  # raises the error of the attribute
        known = [known for known in dir(self) if not known.startswith("_")]
        kind = f"an attribute of {type(self).__name__}"
        message = str(unknown_name(name, kind, known))
        if name in self.raw.schema.variables:
            message = f"'{name}' is not {kind}; values('{name}') returns this variable of the file"
        raise AttributeError(message, name=name, obj=self)

    def to_xarray(self) -> xarray.Dataset:
        """Return all variables of the results file as a dataset of xarray.

        Returns
        -------
        xarray.Dataset
            In SI, with the axes, units and attributes of `xarray.open_dataset` on the file.

        Raises
        ------
        ModuleNotFoundError
            If xarray is not installed, which is part of the extra ``wearsim[data]``.

        Examples
        --------
        >>> dataset = wearsim.run("rig.toml").to_xarray()
        >>> dataset["cylinder_depth_profile"].dims
        ('record', 'station', 'realisation', 'y')
        """
        raw: Any = self.raw
        return as_dataset(raw.schema, raw.variables, raw.labels)

    @cached_property
    def scenario(self) -> Scenario:
        """The scenario, parsed from the text and the files stored with the results.

        Raises
        ------
        ResultsFileError
            If it has mistakes, as one of an earlier version or an altered file.
        """
        from wearsim.scenario import parse_scenario  # noqa: PLC0415  (reading results needs none)

        try:
            return parse_scenario(
                self.raw.scenario_text, self.raw.scenario_file, self.raw.files.__getitem__
            )
        except ScenarioError as error:
            first, *others = str(error).removeprefix(f"{self.raw.scenario_file}: ").splitlines()
            more = f", and {len(others)} more" if others else ""
            raise ResultsFileError(
                f"{self.path}: its scenario has mistakes: {first}{more}"
            ) from error

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


class Stored:
    """A variable of the results file as an attribute of the result.

    Parameters
    ----------
    name : str
        Name of the variable.
    text : str
        Description of the attribute.
    """

    def __init__(self, name: str, text: str) -> None:
        self._name = name
        self.__doc__ = text

    def __get__(self, result: Any, owner: type) -> Array:
        if result is None:
            return self  # type: ignore[return-value]  # for `help`
        return cast("Array", result.values(self._name))

"""Axes, variables and schemas of result files."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal, Protocol, TypeAlias, TypeVar

Kind: TypeAlias = Literal["static", "history", "record", "statistic"]


class Shaped(Protocol):
    """An object with the shape of an array."""

    @property
    def shape(self) -> tuple[int, ...]:
        """Length of each axis."""


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


def axis_lengths(arrays: Mapping[str, Shaped], table: Mapping[str, Variable]) -> dict[str, int]:
    """Return the length of every axis.

    Parameters
    ----------
    arrays : mapping of str to ndarray
        All variables of the table, by name, or other objects with their shapes.
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
    if arrays.keys() != table.keys():
        missing = [name for name in table if name not in arrays]
        unknown = [name for name in arrays if name not in table]
        raise ValueError(f"missing variables {missing}, unknown variables {unknown}")
    lengths: dict[str, int] = {}
    for name, array in arrays.items():
        dims = table[name].dims
        if len(array.shape) != len(dims):
            raise ValueError(f"{name} has {len(array.shape)} axes, expected {', '.join(dims)}")
        for dim, length in zip(dims, array.shape, strict=True):
            if lengths.setdefault(dim, length) != length:
                raise ValueError(f"{name} has {length} along {dim}, others have {lengths[dim]}")
    return lengths

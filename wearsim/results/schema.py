"""Axes, variables and layouts of result files."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal, Protocol, TypeAlias

Kind: TypeAlias = Literal["static", "history", "record", "statistic"]


class Shaped(Protocol):
    """An array, or the place of one."""

    @property
    def shape(self) -> tuple[int, ...]:
        """Its length along each axis."""


@dataclass(frozen=True)
class Axis:
    """A named dimension.

    Parameters
    ----------
    name : str
        Its name in the file.
    long_name : str
        What is counted along it.
    first : int
        Number of its first entry.
    """

    name: str
    long_name: str
    first: int = 1


@dataclass(frozen=True)
class Variable:
    """A variable of the file.

    Parameters
    ----------
    name : str
        Its name, in the file and in `RunData`.
    dims : tuple of str
        Its axes, slowest first.
    unit : str
        Its SI unit; "1" for a plain number.
    long_name : str
        What it is.
    kind : {"static", "history", "record", "statistic"}
        Given once, once per step, once per record, or taken over realisations.
    """

    name: str
    dims: tuple[str, ...]
    unit: str
    long_name: str
    kind: Kind


@dataclass(frozen=True)
class Layout:
    """What a kind of results file holds.

    Parameters
    ----------
    format : str
        Its name.
    version : int
        The version that is written, and the newest that can be read.
    holds : str
        What is in it and which command writes it, for messages.
    axes : mapping of str to Axis
        Every axis but those whose coordinate is a variable of their own, such as y.
    variables : mapping of str to Variable
        The table of variables, by name.
    """

    format: str
    version: int
    holds: str
    axes: Mapping[str, Axis]
    variables: Mapping[str, Variable]


def with_drawn(layout: Layout, inputs: Sequence[Mapping[str, str]]) -> Layout:
    """Return the layout of a study, a variable for each value that was drawn.

    Parameters
    ----------
    layout : Layout
        The layout without them.
    inputs : sequence of mapping
        Dotted key and SI unit of each drawn value, and ``"rollers": "each"`` where every roller
        has its own: ``{"key": "load.normal_force", "unit": "N"}``.

    Returns
    -------
    Layout
    """
    drawn = {}
    for item in inputs:
        each = ("roller",) if item.get("rollers") == "each" else ()
        key, dims = item["key"], ("realisation", *each)
        drawn[key] = Variable(key, dims, item["unit"], "drawn value", "record")
    return replace(layout, variables={**layout.variables, **drawn})


def axis_lengths(arrays: Mapping[str, Shaped], table: Mapping[str, Variable]) -> dict[str, int]:
    """Return the length of every axis.

    Parameters
    ----------
    arrays : mapping of str to ndarray
        All variables of the table, by name, or anything that has their shapes.
    table : mapping of str to Variable
        The table.

    Returns
    -------
    dict of str to int

    Raises
    ------
    ValueError
        If a variable is missing or unknown, or if one does not fit the axes of the others.
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

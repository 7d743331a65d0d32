"""The layout of a run's file: its format, its axes, and the one table of its variables."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal, Protocol, TypeAlias

FORMAT = "wearsim-replay"
VERSION = 1

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


AXES: Mapping[str, Axis] = {
    axis.name: axis
    for axis in (
        Axis("step", "row of the history; 0 is the fresh state", 0),
        Axis("record", "record of profiles and contacts"),
        Axis("station", "station around the cylinder"),
        Axis("roller", "roller; alike ones are merged"),
        Axis("realisation", "realisation of the random inputs"),
    )
}
"""Every axis but y, whose coordinate is a variable of its own."""

_FRESH = ("station", "roller", "realisation", "y")
_STEP = ("step",)
_TEST = ("step", "realisation")
_ROLLER = ("step", "roller", "realisation")
_CONTACT = ("record", "station", "roller", "realisation", "y")

VARIABLES: Mapping[str, Variable] = {
    variable.name: variable
    for variable in (
        Variable("y", ("y",), "m", "axial position", "static"),
        Variable("nominal_gap", _FRESH, "m", "gap before wear", "static"),
        Variable("start_height", ("y",), "m", "cylinder above nominal before wear", "static"),
        Variable("multiplicity", ("roller",), "1", "physical rollers behind a roller", "static"),
        Variable("passes", _STEP, "1", "roller passes done, all rollers together", "history"),
        Variable("time", _STEP, "s", "simulated time", "history"),
        Variable("step_passes", _STEP, "1", "passes of the step", "history"),
        Variable("depth", _TEST, "m", "greatest worn depth of the cylinder", "history"),
        Variable("width", _TEST, "m", "width of the cylinder's groove", "history"),
        Variable("worn_volume", _TEST, "m^3", "worn volume of the cylinder", "history"),
        Variable("roller_depth", _ROLLER, "m", "greatest worn depth of a roller", "history"),
        Variable(
            "roller_worn_volume", _ROLLER, "m^3", "worn volume of one physical roller", "history"
        ),
        Variable("dissipated_energy", _TEST, "J", "dissipated energy, all rollers", "history"),
        Variable("power", _TEST, "W", "dissipated power, all rollers", "history"),
        Variable("normal_force", _ROLLER, "N", "normal force of a roller", "history"),
        Variable("peak_pressure", _ROLLER, "Pa", "greatest normal pressure", "history"),
        Variable("approach", _ROLLER, "m", "approach of the bodies", "history"),
        Variable("longitudinal_creepage", _ROLLER, "1", "mean longitudinal creepage", "history"),
        Variable("adhesion_fraction", _ROLLER, "1", "part of the contact that adheres", "history"),
        Variable("depth_error", _TEST, "m", "estimated error of depth, on either body", "history"),
        Variable("volume_error", _TEST, "m^3", "estimated error of the volume worn off", "history"),
        Variable("rejected", _STEP, "1", "steps refused so far", "history"),
        Variable("solves", _STEP, "1", "contacts solved so far by the steps taken", "history"),
        Variable("full_solves", _STEP, "1", "passes solved in full so far", "history"),
        Variable("record_passes", ("record",), "1", "roller passes at a record", "record"),
        Variable("record_time", ("record",), "s", "simulated time at a record", "record"),
        Variable(
            "cylinder_profile",
            ("record", "station", "realisation", "y"),
            "m",
            "worn depth of the cylinder",
            "record",
        ),
        Variable(
            "roller_profile",
            ("record", "roller", "realisation", "y"),
            "m",
            "worn depth of a roller",
            "record",
        ),
        Variable("line_load", _CONTACT, "N/m", "normal force per axial length", "record"),
        Variable("half_length", _CONTACT, "m", "half-length of the contact", "record"),
        Variable("dissipation", _CONTACT, "W/m", "dissipated power per axial length", "record"),
    )
}
"""The table of variables, by name."""

REPLAY = Layout(FORMAT, VERSION, "a wear test, from `wearsim run`", AXES, VARIABLES)


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


def axis_lengths(
    arrays: Mapping[str, Shaped], table: Mapping[str, Variable] = VARIABLES
) -> dict[str, int]:
    """Return the length of every axis.

    Parameters
    ----------
    arrays : mapping of str to ndarray
        All variables of the table, by name, or anything that has their shapes.
    table : mapping of str to Variable
        The table; by default that of a run.

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

"""The layout of the file of an ensemble of wear tests: its axes and variables."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from wearsim.results.schema import Axis, Layout, Variable, with_drawn

FORMAT = "wearsim-ensemble"
VERSION = 1

PENDING, DONE, FAILED = 0, 1, 2
"""What the status of a realisation says."""
ERROR_BYTES = 400
"""Length of the text that says why a realisation failed, its final zero included."""
QUANTILES = (0.025, 0.05, 0.25, 0.5, 0.75, 0.95, 0.975)
"""Probabilities of the quantiles that stand in the file."""
MOST_KEPT = 4_000_000  # numbers of worn profiles that are kept; they take 32 MB

AXES: Mapping[str, Axis] = {
    axis.name: axis
    for axis in (
        Axis("realisation", "realisation of the random inputs", 0),
        Axis("record", "record of a test; 0 is the fresh state", 0),
        Axis("roller", "roller; alike ones are merged"),
        Axis("kept", "realisation whose worn profile is kept", 0),
    )
}

_EACH = ("realisation",)
_HISTORY = ("realisation", "record")
_RECORDS = ("record",)
_STRIPS = ("y",)
_ROWS = ("realisation", "kept")  # the axes along which a file is filled row by row


def _table(*variables: Variable) -> dict[str, Variable]:
    return {variable.name: variable for variable in variables}


OBSERVABLES: Mapping[str, Variable] = _table(
    Variable("depth", _HISTORY, "m", "greatest worn depth of the cylinder", "record"),
    Variable("width", _HISTORY, "m", "width of the cylinder's groove", "record"),
    Variable("worn_volume", _HISTORY, "m^3", "worn volume of the cylinder", "record"),
    Variable("roller_depth", _HISTORY, "m", "greatest worn depth of the rollers", "record"),
    Variable("total_roller_worn_volume", _HISTORY, "m^3", "worn volume of all rollers", "record"),
    Variable("dissipated_energy", _HISTORY, "J", "dissipated energy, all rollers", "record"),
    Variable("mean_power", _HISTORY, "W", "dissipated energy per time so far", "record"),
    Variable("power", _HISTORY, "W", "dissipated power, all rollers", "record"),
    Variable("normal_force", _HISTORY, "N", "mean normal force of a roller", "record"),
    Variable("peak_pressure", _HISTORY, "Pa", "greatest normal pressure, any roller", "record"),
)
"""What is followed through every test, by name."""

STATIC: Mapping[str, Variable] = _table(
    Variable("y", _STRIPS, "m", "axial position", "static"),
    Variable("multiplicity", ("roller",), "1", "physical rollers behind a roller", "static"),
    Variable("record_passes", _RECORDS, "1", "roller passes at a record", "static"),
    Variable("record_time", _RECORDS, "s", "simulated time at a record", "static"),
)
"""What all realisations have in common."""

_QUANTILE = Variable("quantile", ("quantile",), "1", "probability of a quantile", "static")

_OUTCOMES = _table(
    Variable("status", _EACH, "1", "0 pending, 1 done, 2 failed", "record"),
    Variable("error", _EACH, "1", "why the realisation failed", "record"),
    Variable("steps", _EACH, "1", "steps taken", "record"),
    Variable("solves", _EACH, "1", "contacts solved", "record"),
    Variable("depth_error", _EACH, "m", "estimated error of the final depth", "record"),
    Variable("volume_error", _EACH, "m^3", "estimated error of the final worn volume", "record"),
    Variable(
        "depth_profile", ("kept", "y"), "m", "worn depth of the cylinder at the end", "record"
    ),
)

_CONTROL = Variable("control", _EACH, "1", "control variate, in the unit of its own mean", "record")


def _statistics() -> dict[str, Variable]:
    found = []
    for name, of in OBSERVABLES.items():
        for ending, dims, what in (
            ("mean", _RECORDS, "mean"),
            ("std", _RECORDS, "standard deviation"),
            ("quantiles", ("quantile", "record"), "quantiles"),
        ):
            told = f"{what} over realisations: {of.long_name}"
            found.append(Variable(f"{name}_{ending}", dims, of.unit, told, "statistic"))
    for ending, what in (
        ("mean", "mean"),
        ("std", "standard deviation"),
        ("low", "2.5 % quantile"),
        ("high", "97.5 % quantile"),
    ):
        told = f"{what} over kept realisations: worn depth of the cylinder at the end"
        found.append(Variable(f"depth_profile_{ending}", _STRIPS, "m", told, "statistic"))
    return _table(*found)


STATISTICS: Mapping[str, Variable] = _statistics()
"""Estimates made from the realisations, for readers of the file; nan until they are made."""

ENSEMBLE = Layout(
    FORMAT,
    VERSION,
    "an ensemble of wear tests, from `wearsim ensemble`",
    AXES,
    {**STATIC, "quantile": _QUANTILE, **_OUTCOMES, **OBSERVABLES, **STATISTICS},
)
"""Without the drawn inputs, which differ from study to study, and without a control variate."""


def layout_of(inputs: Sequence[Mapping[str, str]], control: Mapping[str, Any]) -> Layout:
    """Return the layout of an ensemble.

    Parameters
    ----------
    inputs : sequence of mapping
        Key, unit and rollers of each drawn value; see `with_drawn`.
    control : mapping
        What is known of the control variate; empty where there is none.

    Returns
    -------
    Layout
    """
    layout = with_drawn(ENSEMBLE, inputs)
    if not control:
        return layout
    return replace(layout, variables={**layout.variables, "control": _CONTROL})


def is_row(variable: Variable) -> bool:
    """Tell whether a variable is filled row by row, as realisations finish.

    Parameters
    ----------
    variable : Variable
        Of an ensemble.
    """
    return variable.dims[0] in _ROWS


def type_of(variable: Variable) -> np.dtype[Any]:
    """Return the type in which a variable is stored.

    Parameters
    ----------
    variable : Variable
        Of an ensemble.
    """
    other = {"status": np.dtype(np.uint8), "error": np.dtype(f"S{ERROR_BYTES}")}
    return other.get(variable.name, np.dtype("<f8"))


def kept_profiles(asked: int, strips: int) -> int:
    """Return of how many realisations, the first ones, the worn profile is kept.

    Parameters
    ----------
    asked : int
        Realisations at most.
    strips : int
        Strips of a profile.
    """
    return min(asked, max(MOST_KEPT // strips, 1))

"""The layout of the file of a dissipation study: its axes and variables."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from wearsim.results.schema import Axis, Layout, Variable, with_drawn

FORMAT = "wearsim-dissipation"
VERSION = 1

AXES: Mapping[str, Axis] = {
    axis.name: axis
    for axis in (
        Axis("realisation", "realisation of the random inputs", 0),
        Axis("kept", "realisation whose dissipation is kept strip by strip", 0),
    )
}

_EACH = ("realisation",)
_STRIPS = ("y",)

VARIABLES: Mapping[str, Variable] = {
    variable.name: variable
    for variable in (
        Variable("y", _STRIPS, "m", "axial position", "static"),
        Variable("power", _EACH, "W", "dissipated power", "record"),
        Variable("force_x", _EACH, "N", "longitudinal force on the cylinder", "record"),
        Variable("force_y", _EACH, "N", "lateral force on the cylinder", "record"),
        Variable("spin_moment", _EACH, "N m", "spin moment on the cylinder", "record"),
        Variable("normal_force", _EACH, "N", "normal force", "record"),
        Variable("longitudinal_creepage", _EACH, "1", "mean longitudinal creepage", "record"),
        Variable("peak_pressure", _EACH, "Pa", "greatest normal pressure", "record"),
        Variable("adhesion_fraction", _EACH, "1", "part of the contact that adheres", "record"),
        Variable(
            "dissipation", ("kept", "y"), "W/m", "dissipated power per axial length", "record"
        ),
        Variable("dissipation_mean", _STRIPS, "W/m", "its mean over all", "statistic"),
        Variable("dissipation_std", _STRIPS, "W/m", "its std over all", "statistic"),
        Variable("dissipation_low", _STRIPS, "W/m", "its 2.5 % quantile over kept", "statistic"),
        Variable("dissipation_high", _STRIPS, "W/m", "its 97.5 % quantile over kept", "statistic"),
        Variable(
            "mean_problem_dissipation", _STRIPS, "W/m", "it with inputs at their mean", "static"
        ),
    )
}

DISSIPATION = Layout(
    FORMAT,
    VERSION,
    "realisations of one contact, from `wearsim dissipation`",
    AXES,
    VARIABLES,
)
"""Without the drawn inputs, which differ from study to study."""


def with_inputs(inputs: Sequence[Mapping[str, str]]) -> Layout:
    """Return the layout of a study, a variable for each value that was drawn.

    Parameters
    ----------
    inputs : sequence of mapping
        Dotted key and SI unit of each drawn value: ``{"key": "load.normal_force", "unit": "N"}``.

    Returns
    -------
    Layout
    """
    return with_drawn(DISSIPATION, inputs)

"""The layout of a run's file: its format, its axes, and the one table of its variables."""

from __future__ import annotations

from collections.abc import Mapping

from wearsim.results.schema import Axis, Layout, Variable

FORMAT = "wearsim-run"

VERSION = 1


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
            "cylinder_depth_profile",
            ("record", "station", "realisation", "y"),
            "m",
            "worn depth of the cylinder",
            "record",
        ),
        Variable(
            "roller_depth_profile",
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

RUN = Layout(FORMAT, VERSION, "a wear test, from `wearsim run`", AXES, VARIABLES)

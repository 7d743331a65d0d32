"""Axes and variables in the results file of one wear test."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from functools import cache

from wearsim.results.content import Axis, Schema, Variable, by_name, of_present

# every axis except y, whose coordinate is a variable
AXES: Mapping[str, Axis] = by_name(
    (
        Axis("step", "row of the history; row 0 is the start of the run", 0),
        Axis("record", "record of profiles and contacts"),
        Axis("station", "station around the cylinder"),
        Axis("roller", "roller; identical rollers are merged"),
        Axis("realisation", "realisation of the random inputs"),
    )
)

_STEP = ("step",)
_TEST = ("step", "realisation")
_ROLLER = ("step", "roller", "realisation")
_CYLINDER_PROFILE = ("record", "station", "realisation", "y")
_ROLLER_PROFILE = ("record", "roller", "realisation", "y")
_CONTACT = ("record", "station", "roller", "realisation", "y")

_ERRORS = {
    "depth": ("m", "the depth of either body"),
    "volume": ("m^3", "the volume worn off both bodies"),
    "profile": ("1", "all profiles, root mean square over that of the depths"),
}
#: further quantities with an estimated error, and what it is of
_ESTIMATED = {
    "width": "the width",
    "roller_depth": "the roller depth",
    "roller_worn_volume": "the worn volume of a roller",
    "dissipated_energy": "the dissipated energy",
    "power": "the power",
    "normal_force": "the normal force",
    "peak_pressure": "the peak pressure",
    "descent": "the worn descent",
    "elastic_approach": "the elastic approach",
    "lift_error": "the lift error",
    "depth_angle": "the angle of the depth",
    "peak_pressure_angle": "the angle of the peak pressure",
    "least_wear_angle": "the angle of the least wear",
    "greatest_wear_angle": "the angle of the greatest wear",
    "damage": "the effective damage",
}
#: their names; the name of the error ends on "_error"
ESTIMATED = tuple(_ESTIMATED)
#: ends of the names of errors, the sum first, and what they are due to
ERROR_PARTS = {"": "", "_by_steps": " due to the steps", "_by_strips": " due to the strips"}
_AT_STATIONS = {
    "depth": (_TEST, "m", "greatest depth of the cam"),
    "volume": (_TEST, "m^3", "volume worn off both bodies"),
    "peak_pressure": (_ROLLER, "Pa", "greatest peak pressure"),
}
_EXTREMES = {
    "lift_error": (_ROLLER, "m", "greatest less smallest change of the lift by wear"),
    "depth_angle": (_TEST, "rad", "angle of the greatest depth of the cam"),
    "peak_pressure_angle": (_ROLLER, "rad", "angle of the greatest peak pressure"),
    "least_wear_angle": (_ROLLER, "rad", "angle of the greatest change of the lift, with its sign"),
    "greatest_wear_angle": (
        _ROLLER,
        "rad",
        "angle of the smallest change of the lift, with its sign",
    ),
}
_CURVE = ("record", "station", "roller", "realisation")


def _with_errors(variables: Iterable[Variable]) -> Iterator[Variable]:
    """Yield variables, and the variables of their estimated errors."""
    for item in variables:
        yield item
        if item.name in _ESTIMATED:
            yield replace(
                item,
                name=f"{item.name}_error",
                long_name=f"estimated error of {_ESTIMATED[item.name]}",
            )


VARIABLES: Mapping[str, Variable] = by_name(
    _with_errors(
        (
            Variable("y", ("y",), "m", "axial position", "static"),
            Variable("nominal_gap", _CONTACT[1:], "m", "gap before wear", "static"),
            Variable(
                "start_height",
                ("y",),
                "m",
                "height of the cylinder above its nominal shape at the start of the run",
                "static",
            ),
            Variable(
                "multiplicity", ("roller",), "1", "physical rollers per computed roller", "static"
            ),
            Variable("passes", _STEP, "1", "roller passes, all rollers together", "history"),
            Variable("time", _STEP, "s", "simulated time", "history"),
            Variable("step_passes", _STEP, "1", "roller passes of the step", "history"),
            Variable(
                "depth",
                _TEST,
                "m",
                "greatest depth of the cylinder worn since the start of the run",
                "history",
            ),
            Variable("width", _TEST, "m", "width of the groove in the cylinder", "history"),
            Variable("worn_volume", _TEST, "m^3", "worn volume of the cylinder", "history"),
            Variable(
                "roller_depth",
                _ROLLER,
                "m",
                "greatest depth of a roller worn since the start of the run",
                "history",
            ),
            Variable(
                "roller_worn_volume",
                _ROLLER,
                "m^3",
                "worn volume of one physical roller",
                "history",
            ),
            Variable(
                "dissipated_energy",
                _TEST,
                "J",
                "energy dissipated by all rollers since the start of the run",
                "history",
            ),
            Variable("power", _TEST, "W", "dissipated power of all rollers", "history"),
            Variable("normal_force", _ROLLER, "N", "normal force of a roller", "history"),
            Variable("peak_pressure", _ROLLER, "Pa", "greatest normal pressure", "history"),
            Variable("approach", _ROLLER, "m", "approach of the bodies", "history"),
            Variable("descent", _ROLLER, "m", "worn descent of a roller", "history"),
            Variable(
                "elastic_approach",
                _ROLLER,
                "m",
                "elastic part of the approach of a roller",
                "history",
            ),
            Variable(
                "longitudinal_creepage", _ROLLER, "1", "mean longitudinal creepage", "history"
            ),
            Variable(
                "adhesion_fraction",
                _ROLLER,
                "1",
                "part of the contact area that adheres",
                "history",
            ),
            *(
                Variable(
                    f"{name}_error{end}", _TEST, unit, f"estimated error of {what}{by}", "history"
                )
                for end, by in ERROR_PARTS.items()
                for name, (unit, what) in _ERRORS.items()
            ),
            Variable("rejected", _STEP, "1", "rejected steps so far", "history"),
            Variable("solves", _STEP, "1", "contact solves of accepted steps so far", "history"),
            Variable("full_solves", _STEP, "1", "roller passes solved in full so far", "history"),
            Variable("record_passes", ("record",), "1", "roller passes at a record", "record"),
            Variable("record_time", ("record",), "s", "simulated time at a record", "record"),
            Variable(
                "cylinder_depth_profile",
                _CYLINDER_PROFILE,
                "m",
                "worn depth of the cylinder, positive down",
                "record",
            ),
            Variable(
                "roller_depth_profile",
                _ROLLER_PROFILE,
                "m",
                "worn depth of a roller, positive into the roller",
                "record",
            ),
            Variable("line_load", _CONTACT, "N/m", "normal force per axial length", "record"),
            Variable("half_length", _CONTACT, "m", "half-length of the contact", "record"),
            Variable("dissipation", _CONTACT, "W/m", "dissipated power per axial length", "record"),
        )
    )
)

#: further variables of the run of a cam
CAM_VARIABLES: Mapping[str, Variable] = by_name(
    _with_errors(
        (
            Variable(
                "station_angle", ("station",), "rad", "angle of the cam at a station", "static"
            ),
            Variable(
                "station_weight", ("station",), "rad", "angle that a station represents", "static"
            ),
            Variable(
                "station_length",
                ("station",),
                "m",
                "length of the cam's surface that a station represents",
                "static",
            ),
            Variable(
                "station_segment", ("station",), "1", "number of the segment of a station", "static"
            ),
            Variable(
                "pressure_angle", ("station",), "rad", "pressure angle at a station", "static"
            ),
            Variable("turns", _STEP, "1", "turns of the cam", "history"),
            Variable(
                "station_depth",
                ("step", "station", "realisation"),
                "m",
                "greatest depth of the cam at a station",
                "history",
            ),
            *(
                Variable(name, dims, unit, long_name, "history")
                for name, (dims, unit, long_name) in _EXTREMES.items()
            ),
            *(
                Variable(
                    f"{name}_error_by_stations",
                    dims,
                    unit,
                    f"estimated error of the {long_name} due to the stations",
                    "history",
                )
                for name, (dims, unit, long_name) in {**_AT_STATIONS, **_EXTREMES}.items()
            ),
            Variable("lift_error_curve", _CURVE, "m", "change of the lift by wear", "record"),
        )
    )
)

#: further variables of a run with the table [fatigue]
FATIGUE_VARIABLES: Mapping[str, Variable] = by_name(
    _with_errors(
        (
            Variable("damage", _TEST, "1", "effective damage of all bodies by fatigue", "history"),
            Variable("pitting", _TEST, "1", "probability of pitting", "history"),
            Variable("cylinder_damage", _TEST, "1", "greatest damage of the cylinder", "history"),
            Variable("roller_damage", _ROLLER, "1", "greatest damage of a roller", "history"),
            Variable(
                "damage_error_by_steps",
                _TEST,
                "1",
                "estimated error of the effective damage by its integration over the steps",
                "history",
            ),
            Variable(
                "cylinder_damage_profile",
                _CYLINDER_PROFILE,
                "1",
                "damage of the cylinder",
                "record",
            ),
            Variable("roller_damage_profile", _ROLLER_PROFILE, "1", "damage of a roller", "record"),
        )
    )
)
#: axes and variables of the run of a cam
CAM_FATIGUE_VARIABLES: Mapping[str, Variable] = by_name(
    (
        Variable(
            "station_damage",
            ("step", "station", "realisation"),
            "1",
            "greatest damage of the cam at a station",
            "history",
        ),
        Variable(
            "damage_angle", _TEST, "rad", "angle of the greatest damage of the cam", "history"
        ),
    )
)
#: "cam" or "fatigue", by the variable that only such runs have.
MARKS = {"station_angle": "cam", "damage": "fatigue"}
_FURTHER = {
    "cam": CAM_VARIABLES,
    "fatigue": FATIGUE_VARIABLES,
    "cam fatigue": CAM_FATIGUE_VARIABLES,
}
ALL_VARIABLES: Mapping[str, Variable] = {**VARIABLES, **of_present(_FURTHER, {"cam", "fatigue"})}

RUN = Schema("wearsim-run", 10, "a wear test, from `wearsim run`", AXES, VARIABLES)


@cache
def run_schema(present: frozenset[str]) -> Schema:
    """Return the schema of a run; with "cam" or "fatigue" present it has their variables."""
    return replace(RUN, variables={**VARIABLES, **of_present(_FURTHER, present)})

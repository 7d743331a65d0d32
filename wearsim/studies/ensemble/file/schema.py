"""Schema of the results file of an ensemble of wear tests: format, axes and variables."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from wearsim.results.content import (
    Axis,
    Schema,
    Variable,
    by_name,
    of_present,
    with_random_inputs,
)

#: Variables that are stored for the first realisations only.
KEPT = (
    "depth_profile",
    "lift_error_curve",
    "cylinder_damage_profile",
    "roller_damage_profile",
    "damage_curve",
)
#: Values of the status of a realisation.
PENDING, DONE, FAILED = 0, 1, 2
#: Length of the stored error message of a failed realisation, with its final zero.
ERROR_BYTES = 400
#: Probabilities of the quantiles stored in the file.
QUANTILES = (0.025, 0.05, 0.25, 0.5, 0.75, 0.95, 0.975)
MOST_KEPT = 4_000_000  # stored numbers of worn profiles, 32 MB

_DRAW = ("realisation",)
_HISTORY = ("realisation", "record")
_RECORDS = ("record",)
_STRIPS = ("y",)

#: Variables stored for every record of every realisation, by name.
OBSERVABLES: Mapping[str, Variable] = by_name(
    Variable(name, _HISTORY, unit, long_name, "record")
    for name, unit, long_name in (
        ("depth", "m", "greatest depth of the cylinder worn since the start of the run"),
        ("width", "m", "width of the groove in the cylinder"),
        ("worn_volume", "m^3", "worn volume of the cylinder"),
        ("roller_depth", "m", "greatest depth of a roller worn since the start of the run"),
        ("total_roller_worn_volume", "m^3", "worn volume of all rollers"),
        ("dissipated_energy", "J", "energy dissipated by all rollers since the start of the run"),
        ("mean_power", "W", "dissipated energy per time since the start of the run"),
        ("power", "W", "dissipated power of all rollers"),
        ("normal_force", "N", "normal force of a roller, mean over the rollers"),
        ("peak_pressure", "Pa", "greatest normal pressure, maximum over the rollers"),
    )
)

#: Further variables of every record of an ensemble of cams, by name.
CAM_OBSERVABLES: Mapping[str, Variable] = by_name(
    Variable(name, _HISTORY, unit, long_name, "record")
    for name, unit, long_name in (
        ("lift_error", "m", "greatest less smallest change of the lift by wear over the angle"),
        ("lift_error_angle", "rad", "angle of the greatest change of the lift by wear"),
        ("depth_angle", "rad", "angle of the greatest depth of the cam"),
        ("peak_pressure_angle", "rad", "angle of the greatest normal pressure"),
    )
)
#: Further variables of every record of an ensemble of tests with fatigue, by name.
FATIGUE_OBSERVABLES: Mapping[str, Variable] = by_name(
    Variable(name, _HISTORY, "1", long_name, "record")
    for name, long_name in (
        ("damage", "effective damage of all bodies by fatigue"),
        ("pitting", "probability of pitting"),
        ("cylinder_damage", "greatest damage of the cylinder"),
        ("roller_damage", "greatest damage of a roller"),
    )
)


def observables_of(*, cam: bool = True, fatigue: bool = True) -> dict[str, Variable]:
    """Return the observables of tests, of a cam or a cylinder, with or without fatigue."""
    groups = (True, OBSERVABLES), (cam, CAM_OBSERVABLES), (fatigue, FATIGUE_OBSERVABLES)
    return {n: v for given, group in groups if given for n, v in group.items()}


ALL_OBSERVABLES: Mapping[str, Variable] = observables_of()

#: Variables common to all realisations.
STATIC: Mapping[str, Variable] = by_name(
    (
        Variable("y", _STRIPS, "m", "axial position", "static"),
        Variable(
            "multiplicity", ("roller",), "1", "physical rollers per computed roller", "static"
        ),
        Variable("record_passes", _RECORDS, "1", "roller passes at a record", "static"),
        Variable("record_time", _RECORDS, "s", "simulated time at a record", "static"),
    )
)

#: Variable of an ensemble of cams that is common to all realisations.
ANGLE = Variable("angle", ("angle",), "rad", "angle of the cam", "static")

_QUANTILE = Variable("quantile", ("quantile",), "1", "probability of a quantile", "static")

_DEPTH_PROFILE = Variable(
    "depth_profile",
    ("kept", "y"),
    "m",
    "worn depth of the cylinder at the end, positive down",
    "record",
)

_LIFT_ERROR = Variable(
    "lift_error_curve",
    ("kept", "angle"),
    "m",
    "change of the lift by wear at the end",
    "record",
)

_DAMAGE_PROFILES = by_name(
    Variable(
        f"{body}_damage_profile", ("kept", "y"), "1", f"damage of {words} at the end", "record"
    )
    for body, words in (
        ("cylinder", "the cylinder, or of a cam where it is greatest,"),
        ("roller", "the most damaged roller"),
    )
)

_DAMAGE_CURVE = Variable(
    "damage_curve",
    ("kept", "angle"),
    "1",
    "greatest damage of the cam across the track at the end",
    "record",
)

_OUTCOMES = by_name(
    (
        Variable("status", _DRAW, "1", "0 pending, 1 done, 2 failed", "record"),
        Variable("error", _DRAW, "1", "error message of a failed realisation", "record"),
        Variable("steps", _DRAW, "1", "accepted steps", "record"),
        Variable("solves", _DRAW, "1", "contact solves of accepted steps", "record"),
        Variable(
            "depth_error",
            _DRAW,
            "m",
            "estimated error of the depth of either body at the end",
            "record",
        ),
        Variable(
            "volume_error",
            _DRAW,
            "m^3",
            "estimated error of the volume worn off both bodies at the end",
            "record",
        ),
        _DEPTH_PROFILE,
    )
)


#: Variables of an ensemble of tests that end at a limit.
LIFE = by_name(
    Variable(name, _DRAW, unit, long_name, "record")
    for name, unit, long_name in (
        ("life", "1", "roller passes until a limit is first reached; infinite if never"),
        ("life_low", "1", "least life by the numerical error"),
        ("life_high", "1", "greatest life by the numerical error"),
        ("first_limit", "1", "number of the limit that is reached first, from 0; -1 if none"),
        ("limit_angle", "rad", "angle of a cam at which the limit is reached"),
        ("score_mean", "1", "mean normal score of the wear factor given the other drawn values"),
        ("log_weight", "1", "logarithm of the weight of the drawn values in rare-event estimates"),
    )
)


_COURSE = Axis("course", "point of the course of a test with fatigue to its limit", 0)
#: Further ones of tests with fatigue.
LIFE_FATIGUE = by_name(
    (
        Variable("course_end", _DRAW, "1", "roller passes at the end of a course", "record"),
        Variable(
            "damage_course",
            ("realisation", "course"),
            "1",
            "effective damage along the test, at passes that rise by one factor to its end",
            "record",
        ),
        Variable("damage_per_pass", _DRAW, "1", "effective damage per pass before wear", "record"),
    )
)


def _statistics(
    observables: Mapping[str, Variable], curves: Sequence[Variable]
) -> Mapping[str, Variable]:
    """Return the estimates of some observables and of curves that are kept."""
    return by_name(
        [
            Variable(
                f"{of.name}_{ending}",
                dims,
                of.unit,
                f"{words} over realisations: {of.long_name}",
                "statistic",
            )
            for of in observables.values()
            for ending, dims, words in (
                ("mean", _RECORDS, "mean"),
                ("std", _RECORDS, "standard deviation"),
                ("quantiles", ("quantile", "record"), "quantiles"),
            )
        ]
        + [
            Variable(
                f"{kept.name}_{ending}",
                kept.dims[1:],
                kept.unit,
                f"{words} over kept realisations: {kept.long_name}",
                "statistic",
            )
            for kept in curves
            for ending, words in (
                ("mean", "mean"),
                ("std", "standard deviation"),
                ("low", "2.5 % quantile"),
                ("high", "97.5 % quantile"),
            )
        ]
    )


#: Estimates over the realisations; nan until the ensemble is finished.
STATISTICS: Mapping[str, Variable] = _statistics(OBSERVABLES, [_DEPTH_PROFILE])

#: Schema without the random inputs, which differ between studies, and the control variate.
ENSEMBLE = Schema(
    "wearsim-ensemble",
    3,
    "an ensemble of wear tests, from `wearsim ensemble`",
    by_name(
        (
            Axis("realisation", "realisation of the random inputs", 0),
            Axis("record", "record of a test; record 0 is the start of the run", 0),
            Axis("roller", "roller; identical rollers are merged"),
            Axis("kept", "realisation whose worn profile is stored", 0),
        )
    ),
    {**STATIC, "quantile": _QUANTILE, **_OUTCOMES, **OBSERVABLES, **STATISTICS},
)


_FURTHER = {
    "control": by_name(
        [Variable("control", _DRAW, "1", "control variate, in the unit of its mean", "record")]
    ),
    "life": LIFE,
    "cam": {
        **by_name([ANGLE, _LIFT_ERROR]),
        **CAM_OBSERVABLES,
        **_statistics(CAM_OBSERVABLES, [_LIFT_ERROR]),
    },
    "fatigue": {
        **FATIGUE_OBSERVABLES,
        **_DAMAGE_PROFILES,
        **_statistics(FATIGUE_OBSERVABLES, list(_DAMAGE_PROFILES.values())),
    },
    "fatigue life": LIFE_FATIGUE,
    "cam fatigue": {**by_name([_DAMAGE_CURVE]), **_statistics({}, [_DAMAGE_CURVE])},
}


def ensemble_schema(
    inputs: Sequence[Mapping[str, str]],
    control: Mapping[str, Any],
    life: Mapping[str, Any],
    cam: bool = False,
    fatigue: bool = False,
) -> Schema:
    """Return the schema of an ensemble, with its drawn values.

    Parameters
    ----------
    inputs : sequence of mapping
        Key, unit and rollers of each drawn value; see `with_random_inputs`.
    control : mapping
        Mean, std and number of draws of the control variate; empty if the plan has none.
    life : mapping
        Settings of tests that end at a limit; empty for others.
    cam : bool
        Whether the tests are of a cam.
    fatigue : bool
        Whether the bodies may pit.

    Returns
    -------
    Schema
    """
    schema = with_random_inputs(ENSEMBLE, inputs)
    given = {"control": control, "life": life, "cam": cam, "fatigue": fatigue}
    present = {name for name, value in given.items() if value}
    return replace(
        schema,
        axes={**schema.axes, **({_COURSE.name: _COURSE} if {"fatigue", "life"} <= present else {})},
        variables={**schema.variables, **of_present(_FURTHER, present)},
    )


def is_row(variable: Variable) -> bool:
    """Return whether a variable of an ensemble has one row per realisation.

    Parameters
    ----------
    variable : Variable
        A variable of `ENSEMBLE`.

    Returns
    -------
    bool
    """
    return variable.dims[0] in {"realisation", "kept"}


def type_of(variable: Variable) -> np.dtype[Any]:
    """Return the type in which a variable of an ensemble is stored.

    Parameters
    ----------
    variable : Variable
        A variable of `ENSEMBLE`.

    Returns
    -------
    numpy.dtype
    """
    other = {"status": np.dtype(np.uint8), "error": np.dtype(f"S{ERROR_BYTES}")}
    return other.get(variable.name, np.dtype("<f8"))


def kept_profiles(requested: int, strips: int) -> int:
    """Return for how many realisations, starting with the first, the worn profile is stored.

    Parameters
    ----------
    requested : int
        Requested number of realisations.
    strips : int
        Strips of a profile.
    """
    return min(requested, max(MOST_KEPT // strips, 1))

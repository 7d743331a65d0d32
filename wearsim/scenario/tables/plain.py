"""Tables without plugins, from [operation] to [sampling]."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Literal, TypeAlias

import numpy as np
from pydantic import BeforeValidator, Field, PlainValidator

from wearsim.plugins import Options
from wearsim.quantities import (
    Angle,
    NonNegativeTorque,
    PerRoller,
    PositiveDuration,
    PositiveLength,
    PositivePressure,
    PositiveRotationSpeed,
    Quantity,
)
from wearsim.scenario.parse.fields import RandomTarget
from wearsim.scenario.parse.mistakes import Mistakes, nearest
from wearsim.scenario.parse.random_inputs import validate
from wearsim.units import ANGLE, VOLUME, QuantityError, as_written
from wearsim.uq.sampling.sampler import GaussianCopula

DEFAULT_TOLERANCE, LEAST_TOLERANCE = 1e-3, 1e-7
DEFAULT_RECORDS = 20
LARGEST_ANGLE = 0.1  # rad; slip and shift are linear in the angles
#: keys that hold one value for all rollers, or one per roller
_LISTS = (("roller", "offset"), ("roller", "profile"), ("creepage", "yaw"), ("creepage", "tilt"))
CADENCES = ("records", "every_passes", "every")
#: keys of which at most one may be given; exactly one of a radius and a diameter
ALTERNATIVES = {
    "roller": (("radius", "diameter"), ("crown_radius", "crown_diameter", "axial_profile")),
    "cylinder": (("radius", "diameter"),),
    "operation": (("duration", "passes", "turns"),),
    "outputs": (CADENCES,),
}


class TopTable(Options):
    """Keys above the first table."""

    title: str | None = Field(default=None, description="One line of description.")
    seed: int = Field(default=1, ge=0, le=2**63 - 1, description="Seed of all random draws.")


def _whole(value: object) -> object:
    """Return a float without a fraction as an int: 20e6 is a whole number."""
    return int(value) if isinstance(value, float) and value.is_integer() else value


WholeNumber: TypeAlias = Annotated[int, BeforeValidator(_whole)]


class OperationTable(Options):
    """Speed, duration and number of rollers of the test."""

    speed: PositiveRotationSpeed = Field(description="Rotation speed of the cylinder.")
    duration: PositiveDuration | None = Field(
        default=None, description="Simulated time; a run needs it or the number of passes."
    )
    passes: WholeNumber | None = Field(
        default=None,
        gt=0,
        description="Number of roller passes of the whole test, all rollers together.",
    )
    turns: WholeNumber | None = Field(
        default=None, gt=0, description="Number of turns of a cam; passes are turns times rollers."
    )
    rollers: int = Field(default=1, ge=1, description="Number of rollers on the cylinder.")


class FrictionTable(Options):
    """Friction between roller and cylinder."""

    coefficient: float = Field(gt=0.0, description="Coefficient of friction.")
    creep_factor: float = Field(
        default=1.0,
        gt=0.0,
        le=1.0,
        description="Kalker's reduction factor, below 1 for a third body between the surfaces:"
        " initial slope of traction against creepage over that of ideal bodies.",
    )


def _refuse(value: object) -> None:
    """Reject a value: a random input is read before the validation."""
    raise QuantityError(
        "is not a random input",
        as_written(value),
        'a table such as {distribution = "disc", radius = "2 mrad"}',
    )


class CreepageTable(Options):
    """Creepage between rollers and cylinder."""

    drive: Literal["creepage", "free"] = Field(
        default="creepage",
        description="Prescribed quantity: the longitudinal creepage, or the bearing torque of a"
        " free roller, whose creepage follows from the torque balance.",
    )
    longitudinal: float | None = Field(
        default=None,
        description="Mean longitudinal creepage, 1e-3 for 0.1 %; for drive = creepage.",
    )
    bearing_torque: NonNegativeTorque | None = Field(
        default=None, description="Torque of a roller's bearing; for drive = free."
    )
    bearing_friction: float = Field(
        default=0.0,
        ge=0.0,
        description="Friction coefficient of the bearing on a cam, for drive = free: half of it"
        " times bearing_diameter and normal force is a further torque.",
    )
    bearing_diameter: PositiveLength | None = Field(
        default=None, description="Diameter at which bearing_friction acts."
    )
    yaw: PerRoller[Angle] = Field(
        default=0.0, description="Angle about the contact normal; causes lateral creepage."
    )
    tilt: PerRoller[Angle] = Field(
        default=0.0, description="Angle about the rolling direction; causes spin."
    )
    misalignment: Annotated[
        None,
        PlainValidator(_refuse),
        RandomTarget(Quantity(ANGLE), components=("yaw", "tilt")),
    ] = Field(default=None, description="A joint random input that sets yaw and tilt together.")
    differential_slip: bool = Field(
        default=False,
        description="Vary the longitudinal creepage with the rolling radii across the track.",
    )
    tilt_shifts_contact: bool = Field(
        default=True,
        description="Shift the contact axially over the crown when the roller is tilted.",
    )


class EvolutionTable(Options):
    """Time integration of the wear."""

    stepper: Literal["auto", "implicit", "stabilised", "explicit", "per-pass"] = Field(
        default="auto",
        description="Time integration method; auto is implicit if the contact model supports wear"
        " compliance, and stabilised otherwise.",
    )
    tolerance: float = Field(
        default=DEFAULT_TOLERANCE,
        ge=LEAST_TOLERANCE,
        le=0.1,
        description="Relative error of the final depth and volume; contacts are solved to 1e-8,"
        " which is not enough for a lower tolerance.",
    )
    step: int | None = Field(default=None, gt=0, description="Fixed step size, in roller passes.")
    allow_unstable: bool = Field(
        default=False, description="Allow a fixed explicit step size beyond the stability limit."
    )
    allow_deep: bool = Field(
        default=False,
        description="Allow grooves deeper than a tenth of the roller's radius, beyond the validity"
        " of the contact models; a run ends there otherwise.",
    )
    nodes: int | None = Field(
        default=None,
        ge=4,
        le=4096,
        multiple_of=4,
        description="Number of quadrature nodes for inputs that are drawn at every pass; chosen"
        " automatically by default.",
    )
    max_steps: int = Field(default=1_000_000, gt=0, description="Maximum number of steps.")
    strip_error: bool = Field(
        default=True,
        description="Estimate the error due to the strips, by a second test on strips of twice the"
        " width.",
    )


class OutputsTable(Options):
    """Records and their schedule."""

    records: int | None = Field(
        default=None,
        gt=0,
        description="Number of records over the test; 20 unless another schedule is given.",
    )
    spacing: Literal["even", "log"] = Field(
        default="even", description="Spacing of the records over the passes."
    )
    every_passes: WholeNumber | None = Field(
        default=None, gt=0, description="Number of passes between records."
    )
    every: PositiveDuration | None = Field(
        default=None, description="Simulated time between records."
    )
    width_threshold: PositiveLength = Field(
        default=1e-6, description="Worn depth at which the width of the groove is measured."
    )
    checkpoint_every: PositiveDuration = Field(
        default=30.0, description="Wall time between checkpoints."
    )


class LimitTable(Options):
    """Limits of wear; the first that is reached ends the life of a design."""

    depth: PositiveLength | None = Field(
        default=None, description="Worn depth of the cylinder or the cam."
    )
    roller_depth: PositiveLength | None = Field(default=None, description="Worn depth of a roller.")
    lift_error: PositiveLength | None = Field(
        default=None, description="Change of the lift of a cam by wear, peak to peak over a turn."
    )
    volume: Annotated[float, Quantity(VOLUME, "positive")] | None = Field(
        default=None, description="Worn volume of the cylinder or the cam."
    )
    width: PositiveLength | None = Field(
        default=None, description="Width of the groove, where it is deeper than the threshold."
    )
    peak_pressure: PositivePressure | None = Field(
        default=None, description="Greatest normal pressure."
    )
    clearance: PositiveLength | None = Field(
        default=None, description="Worn descent of a roller, by which the unloaded gap opens."
    )
    damage: float | None = Field(
        default=None, gt=0.0, description="Effective damage by fatigue; needs [fatigue]."
    )
    pitting: float | None = Field(
        default=None, gt=0.0, lt=1.0, description="Probability of pitting; needs [fatigue]."
    )

    @property
    def given(self) -> dict[str, float]:
        """The limits that are given, by key [SI]."""
        return {key: value for key, value in self if value is not None}


class SamplingTable(Options):
    """Sampling design of the random inputs."""

    plan: Literal["monte-carlo", "latin-hypercube", "sobol"] = Field(
        default="monte-carlo", description="Sampling design: independent or evenly spread draws."
    )
    realisation: int = Field(
        default=0, ge=0, description="Number of the realisation that a single run uses."
    )
    correlation: tuple[tuple[str, str, Annotated[float, Field(ge=-1.0, le=1.0)]], ...] = Field(
        default=(),
        description="Rank correlations, each with the names of two random inputs and a number.",
    )


def check_alternatives(mistakes: Mistakes, raw: Mapping[str, object], table: str) -> None:
    """Add a mistake for each group of alternative keys of which not exactly one is given."""
    for keys in ALTERNATIVES.get(table, ()):
        given = [key for key in keys if key in raw]
        if len(given) > 1 or (not given and table in {"roller", "cylinder"}):
            mistakes.add(
                table, " or ".join(keys), "exactly one is needed", " and ".join(given) or "none"
            )


def read_creepage(mistakes: Mistakes, raw: Mapping[str, object]) -> CreepageTable | None:
    """Return the table [creepage], or None after adding its mistakes."""
    drive = raw.get("drive", "creepage")
    if drive in ("creepage", "free"):
        keys = ("longitudinal", "bearing_torque")
        needed, refused = keys if drive == "creepage" else keys[::-1]
        if needed not in raw and not (drive == "free" and "bearing_friction" in raw):
            mistakes.add("creepage", needed, f'is needed with drive = "{drive}"', "none")
        if refused in raw:
            mistakes.add("creepage", refused, f'has no meaning with drive = "{drive}"')
        if ("bearing_friction" in raw) != ("bearing_diameter" in raw):
            mistakes.add(
                "creepage",
                "bearing_friction and bearing_diameter",
                "are needed together",
                "one of them",
            )
        elif "bearing_friction" in raw and drive != "free":
            mistakes.add("creepage", "bearing_friction", f'has no meaning with drive = "{drive}"')
    table = validate(mistakes, CreepageTable, raw, "creepage")
    if table is not None:
        check_angles(mistakes, table)
    return table


def check_angles(mistakes: Mistakes, table: CreepageTable) -> None:
    """Add a mistake for each angle for which the linearised kinematics does not hold."""
    angles = {"yaw": table.yaw, "tilt": table.tilt}
    greatest = {key: float(np.abs(angle).max()) for key, angle in angles.items()}
    for item in mistakes.random_inputs:
        if item.name.startswith("creepage.") and item.quantity == Quantity(ANGLE):
            greatest[item.name.removeprefix("creepage.")] = item.greatest
    for key, angle in greatest.items():
        if angle > LARGEST_ANGLE:
            mistakes.add(
                "creepage",
                key,
                "is too large an angle",
                f"{angle:.4g} rad",
                f"at most {LARGEST_ANGLE:g} rad (5.7 deg), since small angles are assumed",
            )


def read_outputs(mistakes: Mistakes, raw: Mapping[str, object]) -> OutputsTable | None:
    """Return the table [outputs], or None after adding its mistakes."""
    given = [key for key in CADENCES if key in raw]
    if not given:
        raw = {**raw, "records": DEFAULT_RECORDS}
    elif "spacing" in raw and "records" not in given:
        mistakes.add("outputs", "spacing", f"goes with records, not with {given[0]}")
    return validate(mistakes, OutputsTable, raw, "outputs")


def check_limits(mistakes: Mistakes, tables: Mapping[str, Any], limits: LimitTable | None) -> None:
    """Add the mistakes of limits that need a table which the scenario does not have."""
    if limits is None:
        return
    for key in () if "fatigue" in tables else ("damage", "pitting"):
        if (limit := getattr(limits, key)) is not None:
            mistakes.add(
                "limit",
                key,
                "needs the fatigue of the bodies",
                as_written(limit),
                "a table [fatigue]",
            )


def check_lists(mistakes: Mistakes, document: Mapping[str, Any]) -> None:
    """Add a mistake for each list of a document that does not have one value per roller."""
    tables = {table: keys for table, keys in document.items() if isinstance(keys, dict)}
    rollers = tables.get("operation", {}).get("rollers", 1)
    for table, key in _LISTS:
        value: Any = tables.get(table, {}).get(key)
        lists = isinstance(value, list | tuple) and isinstance(rollers, int)
        if lists and len(value) != rollers:
            mistakes.add(
                table,
                key,
                "a list has one value per roller",
                (f"{len(value)} values" if len(value) != 1 else "1 value"),
                f"{rollers}, the value of operation.rollers",
            )


def check_correlation(mistakes: Mistakes, table: SamplingTable | None) -> None:
    """Add the mistakes of the correlations; all random inputs must have been read."""
    known = {item.name: item for item in mistakes.random_inputs}
    rows = table.correlation if table else ()
    before = len(mistakes.entries)
    for count, row in enumerate(rows, start=1):
        key, names = f"correlation (entry {count})", row[:2]
        for name in names:
            if name not in mistakes.random:
                hint = nearest(name, known) or f" (known: {', '.join(sorted(known)) or 'none'})"
                mistakes.add("sampling", key, f"'{name}' is not a random input{hint}")
        pair = [known[name] for name in names if name in known]
        if len(pair) < len(names):
            continue  # an input that has mistakes itself adds none here
        for item in [item for item in pair if item.role != "scalar"]:
            mistakes.add(
                "sampling",
                key,
                f"'{item.name}' is a {item.role}, and only single numbers can be correlated",
                as_written(item.kind),
            )
        first, second = (item.persistence for item in pair)
        if first != second:
            mistakes.add(
                "sampling",
                key,
                "needs two random inputs of the same persistence",
                f"{first} and {second}",
            )
    if (
        rows
        and len(mistakes.entries) == before
        and known.keys() >= {n for r in rows for n in r[:2]}
    ):
        try:
            GaussianCopula(rows, {item.name: item.dimension for item in known.values()})
        except ValueError as error:
            mistakes.add("sampling", "correlation", str(error))

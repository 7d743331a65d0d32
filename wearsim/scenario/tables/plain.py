"""The tables with no plugin behind them: operation, friction, creepage, evolution and outputs."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from wearsim.quantities import (
    Angle,
    NonNegativeTorque,
    PerRoller,
    PositiveDuration,
    PositiveLength,
    PositiveRotationSpeed,
    Quantity,
)
from wearsim.scenario.parse.mistakes import Report, Table
from wearsim.scenario.parse.validate import validate
from wearsim.scenario.random.targets import Joint
from wearsim.units import ANGLE

DEFAULT_TOLERANCE = 1e-3


class TopTable(Table):
    """The keys that stand above the tables."""

    title: str | None = Field(default=None, description="What the scenario is, in a line.")
    seed: int = Field(default=1, ge=0, le=2**63 - 1, description="Seed of every random draw.")


class OperationTable(Table):
    """How fast, how long and with how many rollers the test runs."""

    speed: PositiveRotationSpeed = Field(description="Rotation speed of the cylinder.")
    duration: PositiveDuration | None = Field(
        default=None, description="Simulated time; a run needs it or the passes."
    )
    passes: int | None = Field(
        default=None, gt=0, description="Roller passes of the whole test, all rollers together."
    )
    rollers: int = Field(default=1, ge=1, description="Number of rollers on the cylinder.")


class FrictionTable(Table):
    """Friction between roller and cylinder."""

    coefficient: float = Field(gt=0.0, description="Coefficient of friction.")


SLACK = Joint(("yaw", "tilt"), Quantity(ANGLE), '{distribution = "disc", radius = "2 mrad"}')


class CreepageTable(Table):
    """How the rollers slip on the cylinder."""

    drive: Literal["creepage", "free"] = Field(
        default="creepage",
        description="What is held: the longitudinal creepage, or the bearing torque of a roller"
        " that is free to find its own creepage.",
    )
    longitudinal: float | None = Field(
        default=None, description="Mean longitudinal creepage; for drive = creepage."
    )
    bearing_torque: NonNegativeTorque | None = Field(
        default=None, description="Torque of a roller's bearing; for drive = free."
    )
    yaw: PerRoller[Angle] = Field(
        default=0.0, description="Angle about the contact normal, the lateral creepage."
    )
    tilt: PerRoller[Angle] = Field(
        default=0.0, description="Angle about the rolling direction, the source of spin."
    )
    misalignment: Annotated[None, SLACK] = Field(
        default=None, description="A joint random input that sets yaw and tilt together."
    )
    differential_slip: bool = Field(
        default=False, description="Let the creepage follow the rolling radii across the track."
    )
    tilt_shifts_contact: bool = Field(
        default=True, description="Let a tilt also move the contact sideways over the crown."
    )


class EvolutionTable(Table):
    """How the wear is stepped through the passes."""

    stepper: Literal["auto", "implicit", "stabilised", "explicit", "per-pass"] = Field(
        default="auto",
        description="How a step is taken; auto is implicit where the contact model takes wear"
        " compliance, else stabilised.",
    )
    tolerance: float = Field(
        default=DEFAULT_TOLERANCE,
        gt=0.0,
        le=0.1,
        description="Relative error of the final depth and volume.",
    )
    step: int | None = Field(default=None, gt=0, description="Force every step to so many passes.")
    allow_unstable: bool = Field(
        default=False, description="Take a forced explicit step beyond its stability limit."
    )
    nodes: int | None = Field(
        default=None,
        ge=4,
        le=4096,
        multiple_of=4,
        description="Contacts that stand for the passes of a roller whose inputs are drawn at every"
        " pass; chosen if left out.",
    )
    max_steps: int = Field(default=1_000_000, gt=0, description="Stop after so many steps.")


class OutputsTable(Table):
    """What is recorded, and when."""

    records: int | None = Field(
        default=None,
        gt=0,
        description="Number of records over the test, 20 unless another cadence is given.",
    )
    spacing: Literal["even", "log"] = Field(
        default="even", description="Spacing of those records over the passes."
    )
    every_passes: int | None = Field(default=None, gt=0, description="Record every so many passes.")
    every: PositiveDuration | None = Field(
        default=None, description="Record at every such interval of simulated time."
    )
    width_threshold: PositiveLength = Field(
        default=1e-6, description="Worn depth from which on the width of the groove counts."
    )
    checkpoint_every: PositiveDuration = Field(
        default=30.0, description="Wall time between two checkpoints."
    )


DEFAULT_RECORDS = 20
LARGEST_ANGLE = 0.1  # rad; the kinematics of slip and shift are those of small angles
CADENCES = ("records", "every_passes", "every")


def read_operation(raw: Mapping[str, object], report: Report) -> OperationTable | None:
    """Return the table [operation], or None after noting its mistakes."""
    if "duration" in raw and "passes" in raw:
        report.exactly_one(raw, "operation", ("duration", "passes"))
    return validate(report, OperationTable, raw, "operation")


def read_friction(raw: Mapping[str, object], report: Report) -> FrictionTable | None:
    """Return the table [friction], or None after noting its mistakes."""
    return validate(report, FrictionTable, raw, "friction")


def read_creepage(raw: Mapping[str, object], report: Report) -> CreepageTable | None:
    """Return the table [creepage], or None after noting its mistakes."""
    needed, refused = "longitudinal", "bearing_torque"
    drive = raw.get("drive", "creepage")
    if drive == "free":
        needed, refused = refused, needed
    if drive in {"creepage", "free"}:
        if needed not in raw:
            report.add("creepage", needed, f'is needed with drive = "{drive}"', "none")
        if refused in raw:
            report.add("creepage", refused, f'has no meaning with drive = "{drive}"')
    table = validate(report, CreepageTable, raw, "creepage")
    if table is not None:
        _check_angles(table, report)
    return table


def _check_angles(table: CreepageTable, report: Report) -> None:
    """Note angles past which slip and shift are no longer in proportion to them."""
    sizes = {"yaw": np.abs(np.atleast_1d(table.yaw)), "tilt": np.abs(np.atleast_1d(table.tilt))}
    greatest = {f"creepage.{key}": float(values.max()) for key, values in sizes.items()}
    for item in report.random:
        if item.name.startswith("creepage.") and item.quantity == Quantity(ANGLE):
            greatest[item.name] = item.greatest
    for name, angle in greatest.items():
        if angle > LARGEST_ANGLE:
            key = name.removeprefix("creepage.")
            expected = (
                f"at most {LARGEST_ANGLE:g} rad (5.7 deg), as small angles are taken for granted"
            )
            report.add("creepage", key, "is too large an angle", f"{angle:.4g} rad", expected)


def read_evolution(raw: Mapping[str, object], report: Report) -> EvolutionTable | None:
    """Return the table [evolution], or None after noting its mistakes."""
    return validate(report, EvolutionTable, raw, "evolution")


def read_outputs(raw: Mapping[str, object], report: Report) -> OutputsTable | None:
    """Return the table [outputs], or None after noting its mistakes."""
    given = [key for key in CADENCES if key in raw]
    if not given:
        raw = {**raw, "records": DEFAULT_RECORDS}
    elif len(given) > 1:
        report.exactly_one(raw, "outputs", CADENCES)
    elif "spacing" in raw and given != ["records"]:
        report.add("outputs", "spacing", f"goes with records, not with {given[0]}")
    return validate(report, OutputsTable, raw, "outputs")

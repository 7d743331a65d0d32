"""Tables [cam] and [follower]: motion over a turn, geometry and inertia of the follower."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, Literal

from pydantic import Field, ValidationError, ValidatorFunctionWrapHandler, WrapValidator

from wearsim.mechanics.cam import Follower, Motion
from wearsim.plugins import Options
from wearsim.quantities import InputFile, Length, PositiveLength, Quantity
from wearsim.scenario.parse.mistakes import Mistakes
from wearsim.scenario.tables.axial import DESCRIPTION, AxialKey, read_axial
from wearsim.scenario.tables.bodies import Cylinder, MaterialField, Roller
from wearsim.scenario.tables.cam_motion import SHAPES, read_motion
from wearsim.scenario.tables.cam_points import MeasuredPoints
from wearsim.scenario.tables.start_profiles import read_start_surface
from wearsim.units import COMPRESSIBILITY, INERTIA, MASS, VISCOSITY, as_written

_MOST_STATIONS = 1000  # on a part; far more than results need, and matrices of this size


def _as_stations(value: object, read: ValidatorFunctionWrapHandler) -> object:
    """Validate a number of stations with one message for all mistakes."""
    try:
        return read(value)
    except ValidationError as error:
        raise ValueError(
            f"is neither 'auto' nor a whole number from 1 to {_MOST_STATIONS}"
        ) from error


Stations = Annotated[
    Literal["auto"] | Annotated[int, Field(ge=1, le=_MOST_STATIONS)], WrapValidator(_as_stations)
]


class CamTable(Options):
    """Cam, instead of a cylinder; motion, lift, profile or shape gives its form."""

    base_radius: PositiveLength = Field(description="Radius of the base circle.")
    material: MaterialField = Field(description="Name of a material, or a table of its constants.")
    motion: tuple[dict[str, object], ...] | None = Field(
        default=None, description="Motion laws, in the order of the angle; they sum to 360 deg."
    )
    lift: InputFile | None = Field(
        default=None, description="CSV file with columns 'angle [deg]' and 'lift [mm]' over a turn."
    )
    profile: InputFile | None = Field(
        default=None,
        description="CSV file of the cam's surface over a turn: columns 'angle [deg]' and 'radius"
        " [mm]', or 'x [mm]' and 'y [mm]'; the point at an angle passes the roller as the cam has"
        " turned by about that angle.",
    )
    columns: tuple[str, str] | None = Field(
        default=None,
        description="Names of the columns of angle and lift, angle and radius, or x and y.",
    )
    units: tuple[str, str] | None = Field(
        default=None, description="Units of these columns where the header has none."
    )
    lift_tolerance: str | None = Field(
        default=None,
        description='Standard deviation of the noise of lift or profile, "2 um", or an angle of an'
        " arm; estimated by default. 0 follows every point.",
    )
    shape: Literal["eccentric", "tangent", "three-arc"] | None = Field(
        default=None, description="Cam of circular arcs and straight lines."
    )
    eccentricity: PositiveLength | None = Field(
        default=None, description="Distance of the circle's centre; for shape = eccentric."
    )
    nose_radius: PositiveLength | None = Field(
        default=None, description="Radius of the nose; for shape = tangent or three-arc."
    )
    nose_distance: PositiveLength | None = Field(
        default=None, description="Distance of the nose's centre from the axis; as nose_radius."
    )
    flank_radius: PositiveLength | None = Field(
        default=None, description="Radius of the convex flanks; for shape = three-arc."
    )
    axial_profile: AxialKey | None = Field(
        default=None, description=f"{DESCRIPTION} By default straight."
    )
    start_profile: InputFile | None = Field(
        default=None,
        description="Worn surface at the start: a CSV file with columns 'angle [deg]', 'y [mm]' and"
        " 'height [um]', or depth, of the same positions y at every angle; or without angle.",
    )
    stations: Stations = Field(
        default="auto",
        description="Stations on each part of a moving segment; auto chooses by the tolerance.",
    )


class FollowerTable(Options):
    """Follower of a cam."""

    kind: Literal["translating", "swinging"] = Field(
        default="translating", description="Path of the roller's centre."
    )
    offset: Length = Field(
        default=0.0,
        description="Offset of a translating follower; positive lowers the pressure angle of the"
        " rise.",
    )
    centre_distance: PositiveLength | None = Field(
        default=None, description="Distance of the axes of cam and arm; for kind = swinging."
    )
    arm_length: PositiveLength | None = Field(
        default=None, description="From the pivot to the roller's centre; for kind = swinging."
    )
    rotation: Literal["away", "towards"] = Field(
        default="away",
        description="Whether the cam's surface at the roller runs away from the pivot or towards"
        " it; for kind = swinging.",
    )
    mass: Annotated[float, Quantity(MASS, "not negative")] = Field(
        default=0.0, description="Moving mass with the roller; for kind = translating."
    )
    inertia: Annotated[float, Quantity(INERTIA, "not negative")] = Field(
        default=0.0, description="Moment of inertia about the pivot; for kind = swinging."
    )
    contact: Literal["outer", "groove"] = Field(
        default="outer", description="Roller on the cam's outside, or between two flanks."
    )
    clearance: PositiveLength | None = Field(
        default=None, description="Clearance of the roller in the groove; for contact = groove."
    )


class LubricantTable(Options):
    """Lubricant of a cam, for the film thickness that `wearsim cam` prints; wear ignores it."""

    viscosity: Annotated[float, Quantity(VISCOSITY, "positive")] = Field(
        description="Dynamic viscosity at ambient pressure."
    )
    pressure_viscosity: Annotated[float, Quantity(COMPRESSIBILITY, "positive")] = Field(
        default=20e-9, description="Exponent of the viscosity with pressure."
    )
    roughness: PositiveLength | None = Field(
        default=None, description="Root mean square of both surfaces, for the ratio lambda."
    )


@dataclass(frozen=True)
class Cam:
    """A cam with its follower.

    Parameters
    ----------
    base_radius : float
        Radius of the base circle [m].
    follower : Follower
        Geometry of the follower.
    motion : Motion
        Lift over a turn.
    inertia : float
        Moving mass [kg], or moment of inertia of an arm [kg m^2].
    groove : bool
        Whether the roller runs between two flanks.
    clearance : float
        Clearance in the groove [m].
    stations : int, optional
        Stations on each part of a moving segment, chosen by the tolerance if None.
    measured : MeasuredPoints, optional
        Noise of the table from which the motion was smoothed.
    """

    base_radius: float
    follower: Follower
    motion: Motion
    inertia: float = 0.0
    groove: bool = False
    clearance: float = 0.0
    stations: int | None = None
    measured: MeasuredPoints | None = None

    @property
    def lift_unit(self) -> str:
        """SI unit of the lift."""
        return "rad" if self.follower.swings else "m"


_NO_MEANING = "has no meaning without [cam]"
#: Keys that require [cam]: table, key, the message without [cam], and the remedy.
_OF_CAMS = (
    ("operation", "turns", _NO_MEANING, None),
    ("roller", "inertia", _NO_MEANING, None),
    (
        *("creepage", "bearing_friction"),
        *("is only for [cam], whose load differs along the angle", "bearing_torque"),
    ),
    ("limit", "lift_error", "is a quantity of cams", "depth or clearance"),
)


def refuse_cylinder(mistakes: Mistakes, data: Mapping[str, object]) -> None:
    """Add the mistakes of tables that go with a cam only, or with a cylinder only."""
    if "cam" in data:
        if "cylinder" in data:
            mistakes.add(
                "cylinder", "", "a test has either a cylinder or a cam", None, "one of them"
            )
        if "follower" not in data:
            mistakes.add("follower", "", "the table is missing", None, "it goes with [cam]")
    else:
        if "cylinder" not in data:
            mistakes.add("cylinder", "", "the table is missing")
        for table in [name for name in ("follower", "lubricant") if name in data]:
            mistakes.add(table, "", _NO_MEANING)
        for table, key, what, expected in _OF_CAMS:
            keys = data.get(table)
            if isinstance(keys, dict) and keys.get(key):
                mistakes.add(table, key, what, None, expected)
        load = data.get("load")
        if isinstance(load, dict) and str(load.get("kind", "")).startswith("follower"):
            mistakes.add(
                "load", "kind", "needs the follower of a cam", as_written(load["kind"]), "[cam]"
            )


def read_cam(
    mistakes: Mistakes, table: CamTable, follower: FollowerTable | None, roller: Roller | None
) -> tuple[Cylinder, Cam] | None:
    """Return the worn body and the cam, or None after adding the mistakes of [cam] and [follower].

    Parameters
    ----------
    mistakes : Mistakes
    table, follower, roller
        The tables that have been read; None after mistakes.
    """
    given = [
        key for key in ("motion", "lift", "profile", "shape") if getattr(table, key) is not None
    ]
    if len(given) != 1:
        mistakes.add(
            "cam",
            "motion",
            "exactly one of motion, lift, profile and shape is needed",
            " and ".join(given) or "none",
        )
    _check_shape(mistakes, table)
    if follower is None or roller is None or len(given) != 1:
        return None
    built = _read_follower(mistakes, table, follower, roller)
    if built is None:
        return None
    if given[0] not in {"lift", "profile"}:
        for key in ("columns", "units", "lift_tolerance"):
            if getattr(table, key) is not None:
                mistakes.add("cam", key, "has no meaning without lift or profile")
    motion, measured = read_motion(mistakes, table, given[0], built)
    if motion is None:
        return None
    cam = Cam(
        table.base_radius,
        built,
        motion,
        follower.inertia if built.swings else follower.mass,
        follower.contact == "groove",
        follower.clearance or 0.0,
        table.stations if isinstance(table.stations, int) else None,
        measured,
    )
    form = read_axial(mistakes, table.axial_profile, "cam")
    start = read_start_surface(mistakes, table.start_profile)
    if form is None:
        return None
    body = Cylinder(
        table.base_radius, table.material, axial_profile=form, start_surface=start, name="cam"
    )
    return body, cam


def _check_shape(mistakes: Mistakes, table: CamTable) -> None:
    """Add a mistake for each dimension that the shape lacks or does not have."""
    needed = SHAPES[table.shape][1] if table.shape else ()
    for key in ("eccentricity", "nose_radius", "nose_distance", "flank_radius"):
        is_given = getattr(table, key) is not None
        if key in needed and not is_given:
            mistakes.add("cam", key, f'is needed with shape = "{table.shape}"', "none")
        elif is_given and key not in needed:
            given = f'shape = "{table.shape}"' if table.shape else "no shape"
            mistakes.add("cam", key, f"has no meaning with {given}")


def _read_follower(
    mistakes: Mistakes, cam: CamTable, table: FollowerTable, roller: Roller
) -> Follower | None:
    """Return the follower, or None after adding the mistakes of the table [follower]."""
    before, swings = len(mistakes.entries), table.kind == "swinging"
    for key in ("centre_distance", "arm_length"):
        if swings and getattr(table, key) is None:
            mistakes.add("follower", key, 'is needed with kind = "swinging"', "none")
    refused = (
        ("offset", "mass")
        if swings
        else (*("centre_distance", "arm_length", "rotation", "inertia"),)
    )
    for key in [key for key in refused if key in table.model_fields_set]:
        mistakes.add("follower", key, f'has no meaning with kind = "{table.kind}"')
    if table.contact == "groove" and table.clearance is None:
        mistakes.add("follower", "clearance", 'is needed with contact = "groove"', "none")
    if table.contact == "outer" and table.clearance is not None:
        mistakes.add("follower", "clearance", 'has no meaning with contact = "outer"')
    if len(mistakes.entries) > before:
        return None
    try:
        return Follower(
            cam.base_radius,
            roller.radius,
            table.kind,
            table.offset,
            table.centre_distance or 0.0,
            table.arm_length or 0.0,
            table.rotation == "towards",
        )
    except ValueError as error:
        mistakes.add("follower", "arm_length" if swings else "offset", str(error))
        return None


def of_follower(data: dict[str, Any]) -> dict[str, Any]:
    """Return the tables with the load that the follower's kind determines."""
    load, follower = data.get("load"), data.get("follower")
    swings = isinstance(follower, dict) and follower.get("kind") == "swinging"
    if swings and isinstance(load, dict) and load.get("kind") == "follower":
        return {**data, "load": {**load, "kind": "follower-arm"}}
    return data


def assemble_cam(mistakes: Mistakes, sections: dict[str, Any]) -> None:
    """Replace the tables [cam] and [follower] by the cam and its base circle.

    Parameters
    ----------
    mistakes : Mistakes
    sections : dict
        The tables that have been read; None after mistakes in them.
    """
    table, follower = sections["cam"], sections.pop("follower")
    if table is not None:
        read = read_cam(mistakes, table, follower, sections["roller"])
        sections |= dict(zip(("cylinder", "cam"), read or (None, None), strict=True))

"""Reading of the motion over a turn: laws, a table of the lift, a surface, or a shape."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
from pydantic import Field

from wearsim.errors import ScenarioError
from wearsim.mechanics.cam import (
    Follower,
    Motion,
    Segment,
    eccentric_cam,
    motion_mistakes,
    shape_motion,
    tangent_cam,
    three_arc_cam,
)
from wearsim.plugins import MotionLaw, MotionLawSpec, Options
from wearsim.plugins.checked_laws import CheckedMotionLaw
from wearsim.plugins.manager import built_plugin
from wearsim.quantities import Quantity
from wearsim.scenario.parse.mistakes import Mistakes, split_keys, validate_options
from wearsim.scenario.parse.random_inputs import validate
from wearsim.scenario.tables.cam_lift import motion_of_lift
from wearsim.scenario.tables.cam_points import LARGE, POINTS, MeasuredPoints, beside
from wearsim.scenario.tables.cam_surface import motion_of_profile
from wearsim.units import ANGLE, LENGTH, QuantityError, as_written

if TYPE_CHECKING:
    from wearsim.scenario.tables.cam import CamTable

#: function of a shape's profile, and the dimensions that it takes after the base radius
SHAPES = {
    "eccentric": (eccentric_cam, ("eccentricity",)),
    "tangent": (tangent_cam, ("nose_radius", "nose_distance")),
    "three-arc": (three_arc_cam, ("nose_radius", "nose_distance", "flank_radius")),
}


class MotionTable(Options):
    """Entry of `cam.motion`: a motion law over an angle; other keys are its options."""

    law: str = Field(description="Name of the motion law.")
    angle: Annotated[float, Quantity(ANGLE, "positive")] = Field(
        description="Angle of the cam's turn that it takes."
    )
    rise: str | None = Field(
        default=None,
        description='Rise of the follower, negative for a return: "8 mm", or "10 deg" of an arm.',
    )


def read_motion(
    mistakes: Mistakes, table: CamTable, way: str, follower: Follower
) -> tuple[Motion | None, MeasuredPoints | None]:
    """Return the motion of the follower, and the noise of its table if it was smoothed.

    The motion is None after adding the mistakes.
    """
    unit = "rad" if follower.swings else "m"
    try:
        if table.motion is not None:
            motion = _from_laws(mistakes, table.motion, unit)
            if motion is not None and unit == "m":
                _check_rises(mistakes, motion, table.base_radius)
            return motion, None
        if table.shape is not None:
            return _from_shape(table, follower), None
        read = motion_of_lift if way == "lift" else motion_of_profile
        motion, measured = read(mistakes.notes, table, follower)
        if measured is not None:
            noise = f"{1e6 * measured.noise:.2g} u{measured.unit}"
            mistakes.notes.append(
                f"{measured.file}: its noise of {noise} is smoothed; wearsim cam shows residuals"
            )
        return motion, measured
    except ScenarioError as error:
        mistakes.add_file(error, "cam", way)
    except QuantityError as error:
        mistakes.add("cam", "lift_tolerance", *_parts(error))
    except ValueError as error:
        mistakes.add("cam", way, str(error))
    return None, None


def _from_shape(table: CamTable, follower: Follower) -> Motion | None:
    profile, keys = SHAPES[table.shape or ""]
    sizes = [getattr(table, key) for key in keys]
    if None in sizes:
        return None  # a mistake has been added
    build: Any = profile
    return shape_motion(build(table.base_radius, *sizes), follower)


def _check_rises(mistakes: Mistakes, motion: Motion, base_radius: float) -> None:
    """Add a mistake if the lift is so large for the base circle that a unit must be wrong."""
    greatest = float(np.ptp(motion.lift(np.linspace(0.0, math.tau, POINTS))[0]))
    if greatest > LARGE * base_radius:
        mistakes.add(
            "cam",
            "motion",
            "lifts the follower far beyond the base circle: the unit of a rise is probably wrong",
            beside(greatest, base_radius),
            "mm as unit, not m",
        )


def _rise(value: str | None, unit: str) -> float:
    return 0.0 if value is None else Quantity(ANGLE if unit == "rad" else LENGTH).parse(value)


def _from_laws(
    mistakes: Mistakes, entries: tuple[dict[str, object], ...], unit: str
) -> Motion | None:
    """Return the motion of the laws, or None after adding the mistakes of the entries."""
    segments = []
    before = len(mistakes.entries)
    if not entries:
        mistakes.add(
            "cam", "motion", "has no entries", None, 'at least one, such as {law = "dwell", ...}'
        )
        return None
    for number, raw in enumerate(entries, start=1):
        segment = _from_law(mistakes, f"cam.motion (entry {number})", raw, unit)
        segments += [segment] if segment else []
    if len(mistakes.entries) > before:
        return None

    def show(lift: float) -> str:
        return f"{math.degrees(lift):.6g} deg" if unit == "rad" else f"{1e3 * lift:.6g} mm"

    for _, what, got, expected in motion_mistakes(segments, show):
        mistakes.add("cam", "motion", what, got, expected)
    return None if len(mistakes.entries) > before else Motion(tuple(segments))


def _from_law(mistakes: Mistakes, place: str, raw: dict[str, object], unit: str) -> Segment | None:
    """Return the segment of an entry, or None after adding its mistakes."""
    keys, rest = split_keys(raw, MotionTable)
    entry = validate_options(mistakes, MotionTable, keys, place)
    name = keys.get("law")
    spec = (
        mistakes.find_plugin(MotionLawSpec, name, place, "law") if isinstance(name, str) else None
    )
    options = spec and validate(mistakes, spec.options, rest, place, MotionTable)
    if entry is None or spec is None or options is None:
        return None
    if spec.rise == "required" and entry.rise is None:
        mistakes.add(place, "rise", f"is needed with law = {as_written(entry.law)}", "none")
        return None
    if spec.rise != "required" and entry.rise is not None:
        mistakes.add(place, "rise", f"has no meaning with law = {as_written(entry.law)}")
        return None
    try:
        rise = _rise(entry.rise, unit)
    except QuantityError as error:
        mistakes.add(place, "rise", *_parts(error))
        return None
    try:
        law = built_plugin(
            spec,
            MotionLaw,
            lambda law, name: CheckedMotionLaw(law, name, entry.angle),
            options,
            entry.angle,
            rise,
            unit,
        )
    except QuantityError as error:
        mistakes.add(place, "", *_parts(error))
    except ScenarioError as error:
        mistakes.add_file(error, place, "file")
    except ValueError as error:
        mistakes.add(place, "", str(error))
    else:
        return Segment(entry.law, entry.angle, law.lift, tuple(law.breaks), spec.rise == "none")
    return None


def _parts(error: QuantityError) -> tuple[str, str | None, str | None]:
    return error.what, error.got, error.expected

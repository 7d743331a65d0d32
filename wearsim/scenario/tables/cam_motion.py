"""Reading of the motion over a turn: laws, a table of the lift, a surface, or a shape."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
from pydantic import Field

from wearsim.csv_tables import column_names, read_columns
from wearsim.errors import Mistake, ScenarioError
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
from wearsim.models.motion import LiftSpline, kinks, read_lift, refuse_kinks
from wearsim.plugins import MotionLawSpec, Options
from wearsim.quantities import InputFile, Quantity
from wearsim.scenario.parse.mistakes import Mistakes, split_keys, validate_options
from wearsim.scenario.parse.random_inputs import validate
from wearsim.types import FloatArray
from wearsim.units import ANGLE, LENGTH, QuantityError, shown

if TYPE_CHECKING:
    from wearsim.scenario.tables.cam import CamTable

#: function of a shape's profile, and the dimensions that it takes after the base radius
SHAPES = {
    "eccentric": (eccentric_cam, ("eccentricity",)),
    "tangent": (tangent_cam, ("nose_radius", "nose_distance")),
    "three-arc": (three_arc_cam, ("nose_radius", "nose_distance", "flank_radius")),
}
_SURFACE_POINTS = 1440  # of a cam given by its surface, to which the motion is fitted


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


def read_motion(mistakes: Mistakes, table: CamTable, way: str, follower: Follower) -> Motion | None:
    """Return the motion of the follower, or None after adding the mistakes."""
    unit = "rad" if follower.swings else "m"
    try:
        if table.motion is not None:
            return _from_laws(mistakes, table.motion, unit)
        if table.shape is not None:
            return _from_shape(table, follower)
        file = table.lift or table.profile
        if file is None:
            return None
        if way == "lift":
            angle, lift = read_lift(file.text, file.path, unit)
        else:
            angle, lift = _lift_of_surface(file, follower)
        return _from_points(mistakes, file.path, angle, lift, way)
    except ScenarioError as error:
        mistakes.add_file(error, "cam", way)
    except ValueError as error:
        mistakes.add("cam", way, str(error))
    return None


def _from_shape(table: CamTable, follower: Follower) -> Motion | None:
    profile, keys = SHAPES[table.shape or ""]
    sizes = [getattr(table, key) for key in keys]
    if None in sizes:
        return None  # a mistake has been added
    build: Any = profile
    return shape_motion(build(table.base_radius, *sizes), follower)


def _rise(value: str | None, unit: str) -> float:
    kind = ANGLE if unit == "rad" else LENGTH
    return 0.0 if value is None else Quantity(kind).parse(value)


def _from_laws(
    mistakes: Mistakes, entries: tuple[dict[str, object], ...], unit: str
) -> Motion | None:
    """Return the motion of the laws, or None after adding the mistakes of the entries."""
    segments = []
    before = len(mistakes.entries)
    if not entries:
        example = 'at least one, such as {law = "dwell", ...}'
        mistakes.add("cam", "motion", "has no entries", None, example)
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
    own, rest = split_keys(raw, MotionTable)
    entry = validate_options(mistakes, MotionTable, own, place)
    name = own.get("law")
    spec = (
        mistakes.find_plugin(MotionLawSpec, name, place, "law") if isinstance(name, str) else None
    )
    options = spec and validate(mistakes, spec.options, rest, place, MotionTable)
    if entry is None or spec is None or options is None:
        return None
    if spec.rise == "required" and entry.rise is None:
        mistakes.add(place, "rise", f"is needed with law = {shown(entry.law)}", "none")
        return None
    if spec.rise != "required" and entry.rise is not None:
        mistakes.add(place, "rise", f"has no meaning with law = {shown(entry.law)}")
        return None
    try:
        rise = _rise(entry.rise, unit)
    except QuantityError as error:
        mistakes.add(place, "rise", *_parts(error))
        return None
    try:
        law = spec.factory(options, entry.angle, rise, unit)
    except QuantityError as error:
        mistakes.add(place, "", *_parts(error))
    except ScenarioError as error:
        mistakes.add_file(error, place, "file")
    except ValueError as error:
        mistakes.add(place, "", str(error))
    else:
        dwell = spec.rise == "none"
        return Segment(entry.law, entry.angle, law.lift, tuple(law.breaks), dwell)
    return None


def _parts(error: QuantityError) -> tuple[str, str | None, str | None]:
    return error.what, error.got, error.expected


def _from_points(
    mistakes: Mistakes, path: str, angle: FloatArray, lift: FloatArray, name: str
) -> Motion:
    """Return the motion of a table over a turn, a closed quintic spline."""
    turn = angle[-1] - angle[0]
    if abs(turn - math.tau) > 1e-9:
        step = angle[-1] - angle[-2]
        if abs(turn + step - math.tau) > 1e-6:
            got = f"{math.degrees(angle[0]):.6g} to {math.degrees(angle[-1]):.6g} deg"
            what = "the angles do not span a turn"
            raise ScenarioError(path, [Mistake("", "", what, got, "0 to 360 deg")])
        angle, lift = np.append(angle, angle[0] + math.tau), np.append(lift, lift[0])
    scale = float(np.ptp(lift))
    if abs(lift[-1] - lift[0]) > 1e-9 * scale:
        got = f"{lift[0]:.6g} and {lift[-1]:.6g}"
        what = "the lift does not close: its first and last value differ"
        raise ScenarioError(path, [Mistake("", "", what, got, "equal values at 0 and 360 deg")])
    lift = np.append(lift[:-1], lift[0])
    around = np.concatenate([angle, angle[1:5] + math.tau])
    closed = np.concatenate([lift, lift[1:5]])
    refuse_kinks(path, around, closed)
    steps = np.unique(np.round(np.degrees(kinks(around, closed)[1]) % 360.0, 6))
    if len(steps):
        at = ", ".join(f"{place:.6g} deg" for place in steps[:5])
        mistakes.notes.append(f"{path}: the acceleration of the follower jumps at about {at}")
    spline = LiftSpline(angle, lift, closed=True)
    return Motion((Segment(name, math.tau, _Turned(spline, angle[0], lift[0])),), float(lift[0]))


@dataclass(frozen=True)
class _Turned:
    """Lift of a closed spline above that at its first angle."""

    spline: LiftSpline
    start: float
    base: float

    def __call__(self, angle: FloatArray) -> FloatArray:
        """Return lift and derivatives, shape (3, points)."""
        lift = self.spline(self.start + np.asarray(angle))
        lift[0] -= self.base
        return lift


def _lift_of_surface(file: InputFile, follower: Follower) -> tuple[FloatArray, FloatArray]:
    """Return angles [rad] and lifts of the follower on a cam given by points of its surface."""
    from scipy.interpolate import make_interp_spline  # noqa: PLC0415  (slow to import)

    names = column_names(file.text)
    if "radius" in names:
        units = {"angle": "rad", "radius": "m"}
        columns = read_columns(file.text, file.path, units, rising="angle")
        angle, radius = columns["angle"], columns["radius"]
        x, y = radius * np.cos(angle), radius * np.sin(angle)
    else:
        columns = read_columns(file.text, file.path, {"x": "m", "y": "m"})
        x, y = columns["x"], columns["y"]
        if (x * np.roll(y, -1) - y * np.roll(x, -1)).sum() < 0.0:
            x, y = x[::-1], y[::-1]
    if math.hypot(x[0] - x[-1], y[0] - y[-1]) < 1e-9:
        x, y = x[:-1], y[:-1]
    if len(x) < 16:
        what = "too few points of the surface"
        raise ScenarioError(file.path, [Mistake("", "", what, str(len(x)), "at least 16")])
    # along the length of the surface, which a spline follows at any spacing of the points
    length = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(x), np.diff(y)))])
    length = np.append(length, length[-1] + math.hypot(x[0] - x[-1], y[0] - y[-1]))
    points = np.stack([np.append(x, x[0]), np.append(y, y[0])], axis=1)
    spline = make_interp_spline(length, points, k=5, bc_type="periodic")
    along = np.linspace(0.0, length[-1], 4 * _SURFACE_POINTS, endpoint=False)
    (px, py), (dx, dy), (ax, ay) = (spline(along, order).T for order in range(3))
    size = np.hypot(dx, dy)
    curvature = (dx * ay - dy * ax) / size**3
    tight = curvature * follower.roller_radius < -1.0
    if tight.any():
        place = int(np.argmin(curvature))
        at = math.degrees(math.atan2(py[place], px[place])) % 360.0
        got = f"{-1e3 / curvature[place]:.4g} mm at {at:.4g} deg"
        expected = f"more than {1e3 * follower.roller_radius:.6g} mm, the radius of the roller"
        what = "a concave arc is tighter than the roller: its radius is"
        raise ScenarioError(file.path, [Mistake("", "", what, got, expected)])
    cx = px + follower.roller_radius * dy / size
    cy = py - follower.roller_radius * dx / size
    centre, polar = np.hypot(cx, cy), np.unwrap(np.arctan2(cy, cx))
    # the angle of a point counts against the turn of the cam
    if follower.swings:
        c, arm = follower.centre_distance, follower.arm_length
        cosine = (centre**2 + c * c - arm * arm) / (2.0 * centre * c)
        if (np.abs(cosine) >= 1.0).any():
            raise ScenarioError(file.path, [Mistake("", "", "the arm does not reach the cam")])
        sense = 1.0 if not follower.towards else -1.0
        theta = polar + sense * np.arccos(cosine)
        lift = np.arccos((c * c + arm * arm - centre**2) / (2.0 * c * arm)) - follower.rest
    else:
        theta = polar - np.arcsin(follower.offset / centre)
        lift = np.sqrt(centre**2 - follower.offset**2) - follower.rest
    if (np.diff(theta) <= 0.0).any():
        place = int(np.argmin(np.diff(theta)))
        got = f"{math.degrees(theta[place]) % 360.0:.4g} deg"
        what = "the follower does not follow the surface at"
        raise ScenarioError(file.path, [Mistake("", "", what, got)])
    closed = make_interp_spline(
        np.append(theta, theta[0] + math.tau), np.append(lift, lift[0]), k=5, bc_type="periodic"
    )
    angle = np.linspace(0.0, math.tau, _SURFACE_POINTS + 1)
    found = closed(theta[0] + (angle - theta[0]) % math.tau)
    found[-1] = found[0]
    return angle, found

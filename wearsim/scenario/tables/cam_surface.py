"""Reading of a cam's surface, as the motion of a follower over a turn."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from wearsim.csv_tables import column_names, read_columns, units_of_columns
from wearsim.errors import mistake_in
from wearsim.mechanics.cam import Follower, Motion
from wearsim.mechanics.cam.smoothing import SmoothedCurve, scatter_through_points
from wearsim.models.motion import ANGLE_NAMES, LiftSpline, refuse_kinks
from wearsim.quantities import InputFile, Quantity
from wearsim.scenario.tables.cam_lift import motion_of_table
from wearsim.scenario.tables.cam_points import (
    CHOICE,
    POINTS,
    MeasuredPoints,
    has_dimension,
    motion_of,
    refuse_few,
    refuse_unit,
    smoothed_points,
)
from wearsim.types import FloatArray
from wearsim.units import LENGTH

if TYPE_CHECKING:
    from wearsim.scenario.tables.cam import CamTable

_FEWEST = 16  # points
_LEAST = 0.05  # greatest radius over that of the base circle, below which its unit must be wrong
_DRAWS = 4  # for the error of the acceleration
RADIUS_NAMES = ("r", "rho", "halbmesser")


def motion_of_profile(
    notes: list[str], table: CamTable, follower: Follower
) -> tuple[Motion, MeasuredPoints | None]:
    """Return the motion on a surface given by points, and its noise if it was smoothed.

    Parameters
    ----------
    notes : list of str
        Gets a note of jumps of the acceleration.
    table : CamTable
        With `profile`.
    follower : Follower

    Raises
    ------
    ScenarioError, QuantityError
        If the file or the tolerance cannot be used.
    """
    assert table.profile is not None
    text, length = table.lift_tolerance, Quantity(LENGTH, "not negative")
    tolerance = None if text is None else length.parse(text)
    path = table.profile.path
    angle, radius, x, y = _surface_table(table.profile, table)
    curve = None
    if (np.diff(angle) > 0.0).all() and angle[-1] - angle[0] < math.tau:
        curve = smoothed_points(angle - angle[0], radius, tolerance)
    if curve is not None:
        refuse_kinks(path, angle, radius, curve.noise, "radius")
        return _of_surface(path, curve, angle[0], follower, tolerance)
    theta, lift = lift_of_surface(path, *_spline_through(x, y), follower)
    closed = LiftSpline(
        np.append(theta, theta[0] + math.tau), np.append(lift, lift[0]), closed=True
    )
    even = np.linspace(0.0, math.tau, POINTS + 1)
    radii = closed(theta[0] + (even - theta[0]) % math.tau)[0]
    radii[-1] = radii[0]
    return motion_of_table(notes, path, even, radii, "rad" if follower.swings else "m", 0.0)


def _surface_table(
    file: InputFile, table: CamTable
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return polar angle, radius, x and y of points of a surface, against the turn of the cam."""
    given, path = table.columns, file.path
    choice = CHOICE.format("RADIUS") + ', or columns = ["X", "Y"]'
    names = given or ("angle", "radius")
    aliases = {} if given else dict(zip(names, (ANGLE_NAMES, RADIUS_NAMES), strict=True))
    units = dict(zip(names, table.units or (), strict=False))
    heads = units_of_columns(file.text, {name: aliases.get(name, ()) for name in names})
    if given:
        polar = has_dimension(units.get(names[0]) or heads.get(names[0]), "rad")
    else:
        polar = "radius" in heads
        given_columns = column_names(file.text)
        if not polar and not {"x", "y"} & set(given_columns):
            raise mistake_in(
                path,
                "has neither the columns angle and radius, nor x and y",
                ", ".join(given_columns),
                choice,
            )
    if polar:
        columns = read_columns(
            file.text,
            path,
            {names[0]: "rad", names[1]: "m"},
            aliases=aliases,
            units=units,
            rising=names[0],
            either_way=True,
            choice=choice,
        )
        angle, radius = columns[names[0]], columns[names[1]]
        if abs(angle[-1] - angle[0] - math.tau) < 1e-9:
            angle, radius = angle[:-1], radius[:-1]
        x, y = radius * np.cos(angle), radius * np.sin(angle)
    else:
        names = given or ("x", "y")
        units = dict(zip(names, table.units or (), strict=False))
        heads = units_of_columns(file.text, dict.fromkeys(names, ()))
        columns = read_columns(
            file.text, path, dict.fromkeys(names, "m"), units=units, choice=choice
        )
        x, y = (columns[name] for name in names)
        if (x * np.roll(y, -1) - y * np.roll(x, -1)).sum() < 0.0:
            x, y = x[::-1], y[::-1]
        if math.hypot(x[0] - x[-1], y[0] - y[-1]) < 1e-9:
            x, y = x[:-1], y[:-1]
        angle, radius = np.unwrap(np.arctan2(y, x)), np.hypot(x, y)
    refuse_few(path, len(x), _FEWEST, "points of the surface")
    name = names[1] if polar else names[0]
    unit = units.get(name) or heads.get(name)
    refuse_unit(path, name, unit, float(radius.max()), table.base_radius, _LEAST)
    return angle, radius, x, y


def _spline_through(x: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return points of the surface and two derivatives, each of shape (2, points)."""
    from scipy.interpolate import make_interp_spline  # noqa: PLC0415  (slow to import)

    # along the length of the surface, which a spline follows at any spacing of the points
    length = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(x), np.diff(y)))])
    length = np.append(length, length[-1] + math.hypot(x[0] - x[-1], y[0] - y[-1]))
    spline = make_interp_spline(
        length, np.stack([np.append(x, x[0]), np.append(y, y[0])], axis=1), k=5, bc_type="periodic"
    )
    along = np.linspace(0.0, length[-1], 4 * POINTS, endpoint=False)
    first, second, third = (spline(along, order).T for order in range(3))
    return first, second, third


def _of_polar(angle: FloatArray, radius: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return points and two derivatives of a surface by its radius and derivatives (3, points)."""
    along = np.stack([np.cos(angle), np.sin(angle)])
    across = np.stack([-along[1], along[0]])
    r, first, second = radius
    return r * along, first * along + r * across, (second - r) * along + 2.0 * first * across


def lift_of_surface(
    path: str, point: FloatArray, first: FloatArray, second: FloatArray, follower: Follower
) -> tuple[FloatArray, FloatArray]:
    """Return angles [rad] and lifts at which the roller touches points of a surface.

    Parameters
    ----------
    path : str
        Name of the file, for messages.
    point, first, second : ndarray, shape (2, points)
        Points of the surface against the turn of the cam, and derivatives along it.
    follower : Follower

    Raises
    ------
    ScenarioError
        If the roller cannot touch each of them.
    """
    (px, py), (dx, dy), (ax, ay) = point, first, second
    size = np.hypot(dx, dy)
    curvature = (dx * ay - dy * ax) / size**3
    if (curvature * follower.roller_radius < -1.0).any():
        place = int(np.argmin(curvature))
        at = math.degrees(math.atan2(py[place], px[place])) % 360.0
        raise mistake_in(
            path,
            "a concave arc is tighter than the roller: its radius is",
            f"{-1e3 / curvature[place]:.4g} mm at {at:.4g} deg",
            f"more than {1e3 * follower.roller_radius:.6g} mm, the radius of the roller",
        )
    cx = px + follower.roller_radius * dy / size
    cy = py - follower.roller_radius * dx / size
    centre, polar = np.hypot(cx, cy), np.unwrap(np.arctan2(cy, cx))
    # the angle of a point counts against the turn of the cam
    if follower.swings:
        c, arm = follower.centre_distance, follower.arm_length
        cosine = (centre**2 + c * c - arm * arm) / (2.0 * centre * c)
        if (np.abs(cosine) >= 1.0).any():
            raise mistake_in(path, "the arm does not reach the cam")
        theta = polar + (-1.0 if follower.towards else 1.0) * np.arccos(cosine)
        lift = np.arccos((c * c + arm * arm - centre**2) / (2.0 * c * arm)) - follower.rest
    else:
        theta = polar - np.arcsin(follower.offset / centre)
        lift = np.sqrt(centre**2 - follower.offset**2) - follower.rest
    if (np.diff(theta) <= 0.0).any():
        raise mistake_in(
            path,
            "the follower does not follow the surface at",
            f"{math.degrees(theta[np.argmin(np.diff(theta))]) % 360.0:.4g} deg",
        )
    return theta, lift


@dataclass(frozen=True)
class _Parts:
    """Lift over a turn of arcs between dwells, or of one closed spline.

    Parameters
    ----------
    splines : tuple of (float, float, LiftSpline)
        Start and length of each arc [rad], and its lift from there.
    dwells : tuple of (float, float, float)
        Start and length of each dwell [rad], and its lift.
    """

    splines: tuple[tuple[float, float, LiftSpline], ...]
    dwells: tuple[tuple[float, float, float], ...] = ()

    def __call__(self, angle: FloatArray) -> FloatArray:
        """Return lift and derivatives by the angle, shape (3, points)."""
        angle = np.asarray(angle)
        values = np.zeros((3, len(angle)))
        for start, length, level in self.dwells:
            values[0, np.mod(angle - start, math.tau) <= length] = level
        for start, length, spline in self.splines:
            within = np.mod(angle - start, math.tau)
            inside = within < length
            values[:, inside] = spline(within[inside])
        return values


def _parts(
    path: str,
    curve: SmoothedCurve,
    start: float,
    follower: Follower,
    coefficients: FloatArray | None = None,
) -> tuple[_Parts, tuple[tuple[float, float], ...]]:
    """Return the lift on a surface of smoothed radius, and the dwells by the turn of the cam."""

    def arc(low: float, high: float, points: int) -> tuple[FloatArray, FloatArray]:
        polar = np.linspace(low, high, points)
        return lift_of_surface(
            path, *_of_polar(polar + start, curve(polar, coefficients)), follower
        )

    if not curve.dwells:
        theta, lift = arc(0.0, math.tau, POINTS + 1)
        lift[-1], theta[-1] = lift[0], theta[0] + math.tau
        closed = LiftSpline(theta - theta[0], lift, closed=True)
        return _Parts(((float(theta[0]), math.tau, closed),)), ()
    splines, ends = [], []
    for low, high in curve.arcs:
        theta, lift = arc(low, high, max(32, round((high - low) / math.tau * POINTS)))
        splines.append(
            (float(theta[0]), float(theta[-1] - theta[0]), LiftSpline(theta - theta[0], lift))
        )
        ends.append((float(theta[-1]), float(lift[-1])))
    dwells = tuple(
        (stop % math.tau, (after[0] - stop) % math.tau, level)
        for (stop, level), after in zip(ends, [*splines[1:], splines[0]], strict=True)
    )
    return _Parts(tuple(splines), dwells), tuple((low, low + size) for low, size, _ in dwells)


def _of_surface(
    path: str,
    curve: SmoothedCurve,
    start: float,
    follower: Follower,
    tolerance: float | None,
) -> tuple[Motion, MeasuredPoints]:
    """Return the motion on a smoothed surface, and its noise."""
    parts, dwells = _parts(path, curve, start, follower)
    even = np.linspace(0.0, math.tau, POINTS, endpoint=False)
    drawn = (_parts(path, curve, start, follower, curve.drawn(seed))[0] for seed in range(_DRAWS))
    best = parts(even)[2]
    squares = [float(((other(even)[2] - best) ** 2).mean()) for other in drawn]
    lever = follower.arm_length if follower.swings else 1.0
    scatter = scatter_through_points(curve.angle, curve.noise) / lever
    polar = np.mod(curve.angle + start, math.tau)
    order = np.argsort(polar)
    measured = MeasuredPoints(
        path,
        "radius",
        "m",
        curve.noise,
        tolerance,
        polar[order],
        curve.residual[order],
        scatter,
        math.sqrt(sum(squares) / _DRAWS),
        float(np.abs(best).max()),
    )
    return motion_of("profile", parts, dwells), measured

"""Motion of a follower on a cam of circular arcs and straight lines.

Coordinates of the cam have their origin on its axis and x through the nose. On an arc the roller's
centre keeps its distance rho from the centre C of the arc, F = |R - C|^2 - rho^2 = 0; on a line it
keeps its distance h from the axis along the normal n, F = n R - h = 0. R is a function of the
follower's position, and C and n turn with the cam. Differentiation of F = 0 by the angle once and
twice gives the derivatives of the position.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from wearsim.mechanics.cam.follower import Follower
from wearsim.mechanics.cam.motion import Motion, Segment
from wearsim.types import FloatArray


@dataclass(frozen=True)
class Arc:
    """Convex circular arc of a cam's surface.

    Parameters
    ----------
    name : str
        Part of the cam.
    centre : tuple of float
        Centre in the coordinates of the cam [m].
    radius : float
        Radius [m].
    end : float
        Direction of the outward normal where the arc ends, against the turn of the cam [rad].
    """

    name: str
    centre: tuple[float, float]
    radius: float
    end: float


@dataclass(frozen=True)
class Line:
    """Straight flank of a cam.

    Parameters
    ----------
    name : str
        Part of the cam.
    distance : float
        Distance of the line from the axis [m].
    normal : float
        Direction of its outward normal [rad].
    """

    name: str
    distance: float
    normal: float


def eccentric_cam(base_radius: float, eccentricity: float) -> list[Arc | Line]:
    """Return the profile of an eccentric circle; theta = 0 has its centre below the roller."""
    return [Arc("eccentric", (eccentricity, 0.0), base_radius + eccentricity, -math.pi)]


def tangent_cam(base_radius: float, nose_radius: float, nose_distance: float) -> list[Arc | Line]:
    """Return the profile of a cam with straight flanks between base circle and nose.

    Raises
    ------
    ValueError
        If no line touches both circles, or the nose is within the base circle.
    """
    ratio = (base_radius - nose_radius) / nose_distance
    if not -1.0 < ratio < 1.0:
        raise ValueError("the nose is within the base circle, or the base circle within the nose")
    phi = math.acos(ratio)
    return [
        Arc("nose", (nose_distance, 0.0), nose_radius, -phi),
        Line("flank", base_radius, -phi),
        Arc("base circle", (0.0, 0.0), base_radius, phi - math.tau),
        Line("flank", base_radius, phi),
    ]


def three_arc_cam(
    base_radius: float, nose_radius: float, nose_distance: float, flank_radius: float
) -> list[Arc | Line]:
    """Return the profile of a cam with convex circular flanks between base circle and nose.

    Raises
    ------
    ValueError
        If no arc of this radius encloses and touches both circles.
    """
    to_axis, to_nose = flank_radius - base_radius, flank_radius - nose_radius
    x = (to_axis**2 - to_nose**2 + nose_distance**2) / (2.0 * nose_distance)
    if min(to_axis, to_nose) <= 0.0 or abs(x) >= to_axis:
        raise ValueError("no flank of this radius touches both the base circle and the nose")
    y = math.sqrt(to_axis**2 - x * x)
    at_base, at_nose = math.atan2(y, -x), math.atan2(y, nose_distance - x)
    if not at_nose < at_base:
        raise ValueError("the nose does not reach beyond the base circle")
    return [
        Arc("nose", (nose_distance, 0.0), nose_radius, -at_nose),
        Arc("flank", (x, y), flank_radius, -at_base),
        Arc("base circle", (0.0, 0.0), base_radius, at_base - math.tau),
        Arc("flank", (x, -y), flank_radius, at_nose),
    ]


def shape_motion(profile: Sequence[Arc | Line], follower: Follower) -> Motion:
    """Return the motion of a follower on a cam of arcs and lines, from theta = 0.

    At theta = 0 the nose points along the motion of a translating follower, or from the cam's axis
    to the pivot of an arm.

    Parameters
    ----------
    profile : sequence of Arc or Line
        In the order in which they pass the roller where the cam turns towards positive angles.
    follower : Follower

    Raises
    ------
    ValueError
        If the follower cannot follow the profile.
    """
    if follower.sense < 0.0:  # the cam turns the other way
        profile = [_mirrored(part) for part in profile]
    if len(profile) == 1:
        return _motion(profile[0].name, [(profile[0], 0.0, math.tau)], follower)
    ends = [_end_angle(profile, number, follower) for number in range(len(profile))]
    spans = [
        (part, ends[number - 1] % math.tau, (ends[number] - ends[number - 1]) % math.tau)
        for number, part in enumerate(profile)
    ]
    if not math.isclose(sum(span for *_, span in spans), math.tau, rel_tol=1e-9):
        raise ValueError("the parts of the cam do not follow one another with this follower")
    spans.sort(key=lambda item: item[1])
    part, start, span = spans.pop()  # contains theta = 0
    pieces = [(part, 0.0, start + span - math.tau), *spans, (part, start, math.tau - start)]
    return _motion("", [piece for piece in pieces if piece[2] > 1e-12], follower)


def _mirrored(part: Arc | Line) -> Arc | Line:
    """Return a part of a cam mirrored at the line through axis and nose."""
    if isinstance(part, Line):
        return Line(part.name, part.distance, -part.normal)
    return Arc(part.name, (part.centre[0], -part.centre[1]), part.radius, -part.end)


def _motion(
    name: str, pieces: Sequence[tuple[Arc | Line, float, float]], follower: Follower
) -> Motion:
    """Return the motion over parts of a cam, each with its start and its span."""
    lifts = [_Lift(part, follower, start) for part, start, _ in pieces]
    segments = tuple(
        Segment(
            name or part.name,
            span,
            lift,
            dwell=isinstance(part, Arc) and part.centre == (0.0, 0.0),
        )
        for lift, (part, _, span) in zip(lifts, pieces, strict=True)
    )
    return Motion(segments, lifts[0].base)


class _Lift:
    """Lift over a part of the cam, from the angle at which it begins."""

    def __init__(self, part: Arc | Line, follower: Follower, start: float) -> None:
        self.part, self.follower, self.start = part, follower, start
        self.base = 0.0
        self.base = float(self(np.zeros(1))[0, 0])

    def __call__(self, angle: FloatArray) -> FloatArray:
        """Return lift and derivatives, shape (3, points)."""
        follower, part = self.follower, self.part
        turned = follower.sense * (self.start + np.asarray(angle))
        turned = turned + (0.0 if follower.swings else 0.5 * math.pi)
        lift = self._on_arc(part, turned) if isinstance(part, Arc) else self._on_line(part, turned)
        if not np.isfinite(lift).all():
            raise ValueError(f"the follower loses the {part.name} of the cam")
        lift[0] -= follower.rest + self.base
        return lift

    def _position(self, at: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return the roller's centre and its derivatives by the follower's position."""
        follower = self.follower
        if not follower.swings:
            e, ones, zeros = np.full_like(at, follower.offset), np.ones_like(at), np.zeros_like(at)
            return np.stack([e, at]), np.stack([zeros, ones]), np.stack([zeros, zeros])
        c, arm = follower.centre_distance, follower.arm_length
        cosine, sine = arm * np.cos(at), arm * np.sin(at)
        return np.stack([c - cosine, sine]), np.stack([sine, cosine]), np.stack([cosine, -sine])

    def _on_arc(self, part: Arc, turned: FloatArray) -> FloatArray:
        follower, rho = self.follower, part.radius + self.follower.roller_radius
        distance, angle = math.hypot(*part.centre), math.atan2(part.centre[1], part.centre[0])
        x, y = distance * np.cos(angle + turned), distance * np.sin(angle + turned)
        centre, along = np.stack([x, y]), follower.sense * np.stack([-y, x])
        with np.errstate(invalid="ignore"):
            if follower.swings:
                c, arm = follower.centre_distance, follower.arm_length
                to_centre = np.hypot(c - x, y)
                cosine = (to_centre**2 + arm**2 - rho**2) / (2.0 * to_centre * arm)
                at = np.arctan2(y, c - x) + np.arccos(cosine)
            else:
                at = y + np.sqrt(rho**2 - (follower.offset - x) ** 2)
        place, first, second = self._position(at)
        normal = place - centre
        lever = (normal * first).sum(axis=0)
        slope = (normal * along).sum(axis=0) / lever
        speed = first * slope - along
        rest = (speed**2).sum(axis=0) + (normal * (second * slope**2 + centre)).sum(axis=0)
        return np.stack([at, slope, -rest / lever])

    def _on_line(self, part: Line, turned: FloatArray) -> FloatArray:
        follower, height = self.follower, part.distance + self.follower.roller_radius
        x, y = np.cos(part.normal + turned), np.sin(part.normal + turned)
        normal, along = np.stack([x, y]), follower.sense * np.stack([-y, x])
        with np.errstate(invalid="ignore", divide="ignore"):
            if follower.swings:
                cosine = (follower.centre_distance * x - height) / follower.arm_length
                at = np.arccos(cosine) - np.arctan2(y, x)
            else:
                at = (height - x * follower.offset) / y
        place, first, second = self._position(at)
        lever = (normal * first).sum(axis=0)
        slope = -(along * place).sum(axis=0) / lever
        rest = (normal * (second * slope**2 - place)).sum(axis=0)
        rest = rest + 2.0 * slope * (along * first).sum(axis=0)
        return np.stack([at, slope, -rest / lever])


def _end_angle(profile: Sequence[Arc | Line], number: int, follower: Follower) -> float:
    """Return the cam's angle at which the roller leaves a part of the profile [rad]."""
    part, after = profile[number], profile[(number + 1) % len(profile)]
    arc = part if isinstance(part, Arc) else after
    if not isinstance(arc, Arc):
        raise ValueError("two straight parts of a cam meet at a corner")
    normal = part.end if isinstance(part, Arc) else part.normal
    # the roller's centre where it touches the end
    reach = arc.radius + follower.roller_radius
    x, y = arc.centre[0] + reach * math.cos(normal), arc.centre[1] + reach * math.sin(normal)
    radius, direction = math.hypot(x, y), math.atan2(y, x)
    if not follower.swings:
        return -math.asin(follower.offset / radius) - direction
    c, arm = follower.centre_distance, follower.arm_length
    cosine = (radius**2 + c * c - arm * arm) / (2.0 * radius * c)
    if not -1.0 < cosine < 1.0:
        raise ValueError("the arm does not reach the cam")
    return follower.sense * (math.acos(cosine) - direction)

"""Drawings of a cam with its follower: roller, arm and pivot, and the turning worn cam."""

from __future__ import annotations

import math

import numpy as np

from wearsim.mechanics.cam import Follower, surface_points
from wearsim.report.animation import Animation
from wearsim.report.panels import (
    BLACK,
    GREY,
    ORANGE,
    Axis,
    Line,
    Mark,
    Panel,
    Patch,
    Text,
    dots,
)
from wearsim.report.surfaces import CHORD, Sampling
from wearsim.report.text import shown
from wearsim.studies.cam.surface import worn_outlines
from wearsim.studies.cam.turn import CamTurn, unchecked_turn_of
from wearsim.studies.run.result import Result
from wearsim.types import FloatArray

MAGNIFIED = 0.2  # greatest depth in the drawing of a worn cam, of the base radius
_FRAMES = 72  # of a turn
_AROUND = np.linspace(0.0, math.tau, 181)


def factor_for(turn: CamTurn, depth: float) -> float:
    """Return the factor by which depths are magnified in a drawing, with one digit."""
    value = MAGNIFIED * turn.cam.base_radius / max(depth, 1e-12)
    scale = 10.0 ** math.floor(math.log10(value))
    return math.floor(value / scale) * scale


def axis_mark() -> Line:
    """Return the axis of the cam."""
    return dots([0.0], [0.0], "+", size=8.0, colour=BLACK)


def circle(radius: float, centre: complex = 0.0) -> tuple[FloatArray, FloatArray]:
    """Return x and y of a circle [m]."""
    points = centre + radius * np.exp(1j * _AROUND)
    return points.real, points.imag


def rotation_marks(radius: float) -> list[Mark]:
    """Return an arrow around the axis in the direction in which the cam turns, clockwise."""
    around = radius * np.exp(1j * np.radians(np.linspace(150.0, 35.0, 40)))
    tip = radius * np.exp(1j * np.radians(15.0))
    ends = np.array([tip, *(around[-1] * (1.0 + side) for side in (0.18, -0.18))])
    return [
        Line(around.real, around.imag, width=1.2, colour=BLACK),
        Patch(ends.real, ends.imag, colour=BLACK),
    ]


def centre_of(follower: Follower, lift: float) -> complex:
    """Return the roller's centre at a lift, x + i y in the frame of the machine [m]."""
    position = follower.rest + lift
    if not follower.swings:
        return complex(position, follower.offset)
    sense = -1.0 if follower.towards else 1.0
    arm = follower.arm_length
    return complex(
        follower.centre_distance - arm * math.cos(position), -sense * arm * math.sin(position)
    )


def follower_marks(
    follower: Follower, lift: float, radius: float, reach: float, label: str = "roller"
) -> list[Mark]:
    """Return the roller, and its arm with the pivot, or the stem of a translating follower.

    Parameters
    ----------
    follower : Follower
    lift : float
        [m or rad].
    radius : float
        Radius of the roller that is drawn [m].
    reach : float
        Distance from the cam's axis at which a stem ends [m].
    label : str
        Label of the roller.
    """
    centre = centre_of(follower, lift)
    marks: list[Mark] = [Line(*circle(radius, centre), width=1.2, colour=ORANGE, label=label)]
    if follower.swings:
        pivot = follower.centre_distance
        ends = [centre.real, pivot], [centre.imag, 0.0]
        return [
            *marks,
            Line(*ends, marker="o", size=3.0, width=2.0, colour=ORANGE, label="arm"),
            dots([pivot], [0.0], "^", size=9.0, colour=BLACK, label="pivot"),
        ]
    ends = [centre.real, max(reach, centre.real)], [centre.imag, centre.imag]
    return [*marks, Line(*ends, width=2.0, colour=ORANGE)]


def turning(result: Result) -> Animation:
    """Return the animation of a turn of a worn cam, its wear magnified.

    The roller follows the magnified lift error, and is drawn with its magnified depth.
    """
    turn = unchecked_turn_of(result.scenario)
    follower, stations = turn.cam.follower, turn.stations
    worn_roller = float(np.max(result.roller_depth[-1]))
    factor = factor_for(turn, max(float(np.max(result.depth[-1])), worn_roller))
    curve = np.asarray(result.raw.records["lift_error_curve"])[-1].mean(axis=(1, 2))
    theta = math.tau * np.arange(_FRAMES) / _FRAMES
    errors = stations.values_at_angles(curve, theta)
    lifts = turn.at_angles(theta).kinematics.lift
    moved = lifts + factor * errors / follower.lever
    places = worn_outlines(result, Sampling(20.0 * CHORD))
    outlines = [(unworn, unworn + factor * (worn - unworn)) for unworn, worn in places]
    starts = turn.cam.motion.starts[:-1]
    edges = surface_points(follower, turn.at_angles(starts).kinematics, starts)[1]
    rays = edges[0] + 1j * edges[1]
    reach = 0.0 if follower.swings else 1.3 * (follower.rest + float(lifts.max()))
    limits = _limits(turn, outlines, moved, reach)
    radius = turn.scenario.roller.radius - factor * worn_roller
    title = f"{result.title}: wear x {factor:g}"

    def frame(number: int) -> Panel:
        turned, marks = np.exp(-1j * theta[number]), list[Mark]()
        for unworn, worn in outlines:
            fresh, cut = (np.append(outline, outline[0]) * turned for outline in (unworn, worn))
            marks += [
                *([] if turn.cam.groove else [Patch(cut.real, cut.imag, alpha=0.12)]),
                Line(fresh.real, fresh.imag, width=0.9, colour=GREY, label="unworn"),
                Line(cut.real, cut.imag, width=1.5, label=f"worn, wear x {factor:g}"),
            ]
        text = f"{math.degrees(theta[number]):.0f} deg, lift error {shown(errors[number], 'um', 3)}"
        marks += [
            *(
                Line([0.0, ray.real], [0.0, ray.imag], dash=":", width=0.6, colour=GREY)
                for ray in rays * turned
            ),
            *follower_marks(follower, float(moved[number]), radius, reach),
            axis_mark(),
            *rotation_marks(0.4 * turn.cam.base_radius),
            Text(limits[0][0], 0.02, text, parts="y", size=10.0, offset=(6.0, 0.0)),
        ]
        x, y = (Axis(name, "mm", limits=ends) for name, ends in zip("xy", limits, strict=True))
        return Panel(title, x, y, marks, legend="upper left", equal=True)

    return Animation(frame, _FRAMES, 18)


def _limits(
    turn: CamTurn, outlines: list[tuple[FloatArray, FloatArray]], lifts: FloatArray, reach: float
) -> list[tuple[float, float]]:
    """Return the ends of both axes that hold the cam and the follower at all angles [m]."""
    radius, follower = turn.scenario.roller.radius, turn.cam.follower
    greatest = max(float(np.abs(unworn).max()) for unworn, _ in outlines)
    centres = np.array([centre_of(follower, lift) for lift in lifts.tolist()])
    high = follower.centre_distance if follower.swings else reach
    x = -greatest, max(greatest, high, float(centres.real.max()) + radius)
    y = (
        min(-greatest, float(centres.imag.min()) - radius),
        max(greatest, float(centres.imag.max()) + radius),
    )
    margin = 0.06 * (x[1] - x[0])
    return [(low - margin, end + margin) for low, end in (x, y)]

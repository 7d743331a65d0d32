"""Motion of a follower over a turn of the cam: segments, and panels on which it is smooth."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple, TypeAlias

import numpy as np

from wearsim.types import FloatArray, IntArray

#: lift and its two derivatives, shape (3, points), at angles from the start of a segment [rad]
Lift: TypeAlias = Callable[[FloatArray], FloatArray]

_CLOSURE = 1e-9  # of the lift and of a turn
_KINK = 1e-6  # jump of s', of its greatest value
_FIVE, _JERK_STEP = np.arange(-2.0, 3.0), 2e-3  # nodes of the jerk, and their distance [rad]


class Panel(NamedTuple):
    """Part of a segment in which all derivatives of the lift are continuous.

    Parameters
    ----------
    segment : int
        Number of the segment.
    start, stop : float
        Angles of the cam [rad].
    dwell : bool
        Whether the lift is constant.
    """

    segment: int
    start: float
    stop: float
    dwell: bool


@dataclass(frozen=True)
class Segment:
    """Motion over a part of a turn.

    Parameters
    ----------
    name : str
        Motion law, or name of the part of the cam's profile.
    angle : float
        Angle of the cam that it takes [rad].
    lift : callable
        Lift above that at the segment's start and its derivatives by the angle from there.
    breaks : tuple of float
        Angles from its start where a derivative of the lift above the second jumps [rad].
    dwell : bool
        Whether the lift is constant.
    """

    name: str
    angle: float
    lift: Lift
    breaks: tuple[float, ...] = ()
    dwell: bool = False

    @cached_property
    def ends(self) -> FloatArray:
        """Lift and derivatives at start and end, shape (3, 2)."""
        return np.asarray(self.lift(np.array([0.0, self.angle])))


@dataclass(frozen=True)
class Motion:
    """Lift of a follower over a turn, from theta = 0.

    Parameters
    ----------
    segments : tuple of Segment
        In the order of the angle; they sum to a turn.
    base : float
        Lift at theta = 0 [m or rad].
    """

    segments: tuple[Segment, ...]
    base: float = 0.0

    @cached_property
    def starts(self) -> FloatArray:
        """Angle at which each segment starts, and the end of the turn [rad]."""
        angles = np.concatenate([[0.0], np.cumsum([part.angle for part in self.segments])])
        angles[-1] = math.tau
        return angles

    @cached_property
    def bases(self) -> FloatArray:
        """Lift at the start of each segment [m or rad]."""
        rises = [part.ends[0, 1] for part in self.segments]
        return self.base + np.concatenate([[0.0], np.cumsum(rises)])

    @cached_property
    def panels(self) -> tuple[Panel, ...]:
        """Smooth parts, in the order of the angle."""
        spans = itertools.pairwise(self.starts.tolist())
        return tuple(
            Panel(number, *edges, part.dwell)
            for number, (part, (start, stop)) in enumerate(zip(self.segments, spans, strict=True))
            for edges in itertools.pairwise([start, *(start + at for at in part.breaks), stop])
        )

    def segment_label(self, number: int) -> str:
        """Return the number and the name of a segment, "segment 2 (cycloidal)"."""
        return f"segment {number + 1} ({self.segments[number].name})"

    def lift_in(self, segments: int | IntArray, theta: FloatArray) -> FloatArray:
        """Return lift and derivatives, shape (3, ...), at angles [rad] within segments by number.

        The segments broadcast to the shape of the angles.
        """
        lift = np.empty((3, *theta.shape))
        for number in np.unique(segments).tolist():
            part, chosen = self.segments[number], np.broadcast_to(segments == number, theta.shape)
            inside = np.clip(theta[chosen] - self.starts[number], 0.0, part.angle)
            lift[:, chosen] = part.lift(inside)
            lift[0, chosen] += self.bases[number]
        return lift

    def segment_at(self, theta: FloatArray) -> IntArray:
        """Return the number of the segment at each angle; at a boundary the one that follows."""
        # an angle written in degrees is at the boundary to a few roundings
        places = np.searchsorted(self.starts, np.mod(theta, math.tau) + 1e-13, side="right") - 1
        return np.asarray(np.where(places == len(self.segments), 0, places))

    def lift(self, theta: FloatArray) -> FloatArray:
        """Return lift and derivatives at any angles [rad], shape (3, points)."""
        theta = np.mod(np.atleast_1d(np.asarray(theta, dtype=np.float64)), math.tau)
        return self.lift_in(self.segment_at(theta), theta)

    def jerk(self, theta: FloatArray) -> FloatArray:
        """Return the third derivative of the lift at any angles [rad], shape (points,).

        It is that of a polynomial through five values of the second one, within a smooth part; at
        a boundary of parts that of the following one.
        """
        turned = np.mod(np.atleast_1d(np.asarray(theta, dtype=np.float64)), math.tau)
        starts = np.array([panel.start for panel in self.panels])
        places = np.searchsorted(starts, turned + 1e-13, side="right") - 1
        jerk = np.empty(len(turned))
        for number in np.unique(places):
            panel, chosen = self.panels[number], places == number
            step = min(_JERK_STEP, 0.125 * (panel.stop - panel.start))
            middle = np.clip(turned[chosen], panel.start + 2.0 * step, panel.stop - 2.0 * step)
            nodes = (middle[:, None] + step * _FIVE).ravel()
            values = self.lift_in(panel.segment, nodes)[2].reshape(-1, len(_FIVE))
            polynomial = values @ np.linalg.inv(np.vander(_FIVE, increasing=True)).T
            powers = np.vander((turned[chosen] - middle) / step, len(_FIVE) - 1, increasing=True)
            jerk[chosen] = (polynomial[:, 1:] * np.arange(1.0, 5.0) * powers).sum(axis=1) / step
        return jerk


def motion_mistakes(
    segments: Sequence[Segment], show: Callable[[float], str]
) -> list[tuple[int, str, str | None, str | None]]:
    """Return the mistakes of a motion: segment, what, got and expected.

    Parameters
    ----------
    segments : sequence of Segment
    show : callable
        Returns a lift as text.
    """
    mistakes: list[tuple[int, str, str | None, str | None]] = []
    last, motion = len(segments) - 1, Motion(tuple(segments))
    total = sum(part.angle for part in segments)
    if abs(total - math.tau) > _CLOSURE * math.tau:
        missing = math.degrees(math.tau - total + segments[-1].angle)
        remedy = f", with {missing:.6g} deg for {motion.segment_label(last)}" if missing > 0 else ""
        what = "the angles of the segments do not sum to a turn"
        mistakes.append((last, what, f"{math.degrees(total):.9g} deg", f"360 deg{remedy}"))
    ends = np.array([part.ends for part in segments])
    rises = np.cumsum(ends[:, 0, 1])
    if abs(rises[-1]) > _CLOSURE * float(np.abs(rises).max()):
        got = f"{show(float(rises[-1]))} after {motion.segment_label(last)}"
        mistakes.append(
            (last, "the lift does not return to its start", got, "rises that sum to zero")
        )
    inside = [np.abs(part.lift(np.linspace(0.0, part.angle, 65))[1]).max() for part in segments]
    greatest = float(max(inside))
    for number in range(last + 1):
        follower = (number + 1) % (last + 1)
        before, after = ends[number, 1, 1], ends[follower, 1, 0]
        if abs(after - before) > _KINK * greatest:
            what = f"the slope of the lift jumps before {motion.segment_label(follower)}"
            got = f"from {show(float(before))} to {show(float(after))} per rad"
            mistakes.append((number, what, got, "laws with equal slopes where they meet"))
    return mistakes

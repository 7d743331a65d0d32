"""Surface of a cam, unworn and worn, as closed curves: outer and inner flank of a groove apart."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from wearsim.mechanics.cam import (
    Stations,
    angles_by_chord,
    angles_by_number,
    surface_points,
)
from wearsim.mechanics.cam.outline import Points
from wearsim.mechanics.cam.stations import interpolation
from wearsim.report.surfaces import Curve, Sampling, Surface
from wearsim.report.view import Column
from wearsim.studies.cam.turn import CamTurn, unchecked_turn_of
from wearsim.studies.run.result import Result
from wearsim.types import BoolArray, FloatArray

_DOUBLED = 1e-9  # m, distance of points that are one
_SAMPLES = 801  # of a part, at which the distance of the chords is computed


def worn_surface(result: Result, sampling: Sampling) -> Surface:
    """Return the surface of a cam at the end of a run.

    Parameters
    ----------
    result : Result
        Run of a cam.
    sampling : Sampling
    """
    return _worn(result, sampling).surface(sampling)


def worn_outlines(result: Result, sampling: Sampling) -> list[tuple[FloatArray, FloatArray]]:
    """Return the outlines of all flanks of a cam, unworn and worn at the same angles, x + i y [m].

    Parameters
    ----------
    result : Result
        Run of a cam.
    sampling : Sampling
    """
    return [(points[0], points[1]) for *_, points in _worn(result, sampling).flanks(sampling)]


def _worn(result: Result, sampling: Sampling) -> _Outlines:
    turn = unchecked_turn_of(result.scenario)
    depth = np.asarray(result.raw.history["station_depth"])[-1, :, 0]
    if sampling.position is not None:
        profiles = np.asarray(result.raw.records["cylinder_depth_profile"])[-1, :, 0]
        depth = np.array(
            [np.interp(sampling.position, result.y, profile, 0.0, 0.0) for profile in profiles]
        )
    return _Outlines(turn, turn.stations, depth)


def unworn_surface(turn: CamTurn, sampling: Sampling) -> Surface:
    """Return the surface of a cam before wear."""
    return _Outlines(turn, turn.stations, None).surface(sampling)


@dataclass(frozen=True)
class _Outlines:
    """Surface of a cam at any angle.

    Parameters
    ----------
    turn : CamTurn
    stations : Stations
    depth : ndarray, shape (stations,), optional
        Worn depth [m]; None for the unworn surface alone.
    """

    turn: CamTurn
    stations: Stations
    depth: FloatArray | None

    def surface(self, sampling: Sampling) -> Surface:
        """Return the closed curves of all flanks."""
        curves, tables, away = list[Curve](), [], 0.0
        for flank, parts, angle, points in self.flanks(sampling):
            away = max(away, _away(parts, angle, points))
            for name, places in zip(("unworn", "worn"), points, strict=False):
                label = f"{flank}, {name}" if flank else name
                # the depth can jump between segments, where the unworn curve has one point
                kept = _distinct(places[None])
                curves.append(Curve(label, places[kept].real, places[kept].imag))
            tables.append((flank, angle, points))
        return Surface(self.turn.scenario.title, curves, _columns(tables), away)

    def flanks(
        self, sampling: Sampling
    ) -> Iterator[tuple[str, list[tuple[Points, float, float]], FloatArray, FloatArray]]:
        """Yield name, parts, angles and points of each flank, the points as of `_points`."""
        flanks = (False, True) if self.turn.cam.groove else (False,)
        for inner in flanks:
            flank = ("inner flank" if inner else "outer flank") if len(flanks) > 1 else ""
            parts = list(self._parts(inner))
            yield flank, parts, *_points(parts, _angles(parts, sampling))

    def _parts(self, inner: bool) -> Iterator[tuple[Points, float, float]]:
        """Yield the points of each panel at its angles, first unworn, then worn."""
        turn, first = self.turn, self.stations.first
        touches = turn.is_inner(self.stations.panels) == inner
        for number, (panel, touched) in enumerate(zip(self.stations.panels, touches, strict=True)):
            values = None
            if self.depth is not None:
                begin, count = int(first[number]), self.stations.numbers[number]
                values = self.depth[begin : begin + count] * touched

            def points(theta: FloatArray, panel=panel, values=values) -> FloatArray:  # type: ignore[no-untyped-def]
                kinematics = turn.cam.follower.kinematics(
                    turn.cam.motion.lift_in(panel.segment, theta), np.full(len(theta), inner)
                )
                depths: list[FloatArray | float] = [0.0]
                if values is not None:
                    place = np.clip((theta - panel.start) / (panel.stop - panel.start), 0.0, 1.0)
                    depths.append(np.maximum(interpolation(len(values), place) @ values, 0.0))
                curves = [
                    surface_points(turn.cam.follower, kinematics, theta, depth)[1]
                    for depth in depths
                ]
                return np.array([x + 1j * y for x, y in curves])

            yield points, panel.start, panel.stop


def _angles(parts: list[tuple[Points, float, float]], sampling: Sampling) -> list[FloatArray]:
    if sampling.points is not None:
        return angles_by_number(parts, sampling.points)
    return [angles_by_chord(*part, sampling.chord) for part in parts]


def _points(
    parts: list[tuple[Points, float, float]], angles: list[FloatArray]
) -> tuple[FloatArray, FloatArray]:
    """Return angles and points, shape (curves, points), none of them twice."""
    curves = [part[0](angle) for part, angle in zip(parts, angles, strict=True)]
    angle, points = np.concatenate(angles), np.concatenate(curves, axis=1)
    kept = _distinct(points)
    return angle[kept], points[:, kept]


def _distinct(points: FloatArray) -> BoolArray:
    """Return which points, the last axis, differ from the following one in any curve.

    Of two equal points the one at the start of a segment is kept, not the one at 360 deg.
    """
    return np.asarray((np.abs(np.roll(points, -1, axis=1) - points) > _DOUBLED).any(axis=0))


def _away(parts: list[tuple[Points, float, float]], angle: FloatArray, points: FloatArray) -> float:
    """Return the greatest distance of the chords, which may span parts, from the surface [m]."""
    chord = np.roll(points, -1, axis=1) - points
    length = np.maximum(np.abs(chord), np.finfo(float).tiny)
    samples = max(_SAMPLES, 10 * len(angle) // len(parts))
    worst = 0.0
    for part, start, stop in parts:
        theta = start + (stop - start) * (np.arange(samples) + 0.5) / samples
        place = np.searchsorted(angle, theta, side="right") - 1  # -1 is the last chord
        away = (part(theta) - points[:, place]) * np.conj(chord[:, place])
        worst = max(worst, float(np.abs(away.imag / length[:, place]).max()))
    return worst


def _columns(tables: list[tuple[str, FloatArray, FloatArray]]) -> list[Column]:
    """Return the table of the points of all flanks."""
    flank = [name for name, angle, _ in tables for _ in angle]
    angle = np.concatenate([angle for _, angle, _ in tables])
    points = np.concatenate([points for *_, points in tables], axis=1)
    degree, mm, um = np.radians(1.0), 1e-3, 1e-6
    return [
        *([Column("flank", flank)] if any(flank) else []),
        Column("angle", angle, "deg", degree),
        *(
            Column(f"{axis} {name}", part, "mm", mm)
            for name, places in zip(("unworn", "worn"), points, strict=False)
            for axis, part in (("x", places.real), ("y", places.imag))
        ),
        *(Column("depth", np.abs(worn - points[0]), "um", um) for worn in points[1:]),
    ]

"""Panels of cams: motion and loads before wear, and depth, shape and lift error of a worn one."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from wearsim.levelling import Measured
from wearsim.mechanics.cam import Motion, Stations, surface_points
from wearsim.report.panels import (
    BLACK,
    GREEN,
    GREY,
    ORANGE,
    RED,
    Axis,
    Image,
    Line,
    Mark,
    Panel,
    Patch,
    Records,
    Sheet,
    Span,
    Text,
    dots,
    measured_marks,
)
from wearsim.report.text import OBSERVABLES, PER_SI, shown, with_error
from wearsim.scenario.tables.cam_points import MeasuredPoints
from wearsim.studies.cam.drawing import (
    axis_mark,
    circle,
    factor_for,
    follower_marks,
    rotation_marks,
)
from wearsim.studies.cam.grooves import grooves_at
from wearsim.studies.cam.point import Point
from wearsim.studies.cam.study import CamStudy, peak_pressures
from wearsim.studies.cam.turn import CamTurn, unchecked_turn_of
from wearsim.studies.fatigue.panels import pitting_panel
from wearsim.studies.fatigue.view import with_source_lines
from wearsim.studies.run.panels import (
    HEIGHT,
    caption,
    depth_panel,
    pressure_panel,
    record_texts,
    track_axis,
)
from wearsim.studies.run.result import Result
from wearsim.studies.run.setup import Setup
from wearsim.types import FloatArray

DEG = PER_SI["deg"]
ANGLE = Axis(
    "angle", "deg", limits=(0.0, 2.0 * np.pi), ticks=[0.25 * np.pi * place for place in range(9)]
)
_PLANE = Axis("x", "mm"), Axis("y", "mm")
_SAMPLES = 97  # of a panel of the turn between its stations


def cam_sheet(study: CamStudy, measured: Sequence[Measured] = ()) -> Sheet:
    """Return the panels of a cam: its shape, motion, pressure angle, speeds, and loads."""
    turn = study.turn
    fine = _fine(turn)
    lift, unit = ("arm", "deg") if turn.cam.follower.swings else ("lift", "mm")
    kinematics, angle, point = fine.kinematics, fine.angle, study.point
    shaded = " (skids shaded)" if study.skids else ""
    gapped = between_flanks(angle, fine)

    def over_angle(values: FloatArray, **style: Any) -> Line:
        """Return values over the angle, with gaps where the flank changes."""
        return Line(gapped, between_flanks(values, fine), **style)

    right: dict[str, Any] = {"dash": "--", "right": True, "colour": ORANGE}

    pressures = peak_pressures(Setup(turn.scenario), fine)
    skids = [Span(skid.start, skid.stop, colour=RED, alpha=0.12) for skid in study.skids]
    names, edges = segment_marks(turn.cam.motion), segment_marks(turn.cam.motion, names=False)
    margin = (0.1, 0.0)  # the names of the segments lie below
    inner = Axis(limits=ANGLE.limits, ticks=ANGLE.ticks, unit="deg")
    panels = {
        "shape": shape_panel(turn),
        "motion": Panel(
            "Motion of the follower",
            inner,
            Axis(f"{lift} and its derivatives", per_si=PER_SI[unit], margin=(0.18, 0.18)),
            [
                Line(angle, kinematics.lift, label=f"{lift} [{unit}]"),
                Line(angle, kinematics.lift_per_rad, label=f"velocity [{unit}/rad]", colour=ORANGE),
                Line(
                    angle,
                    kinematics.lift_per_rad2,
                    label=f"acceleration [{unit}/rad$^2$]",
                    colour=GREEN,
                ),
                *names,
            ],
            "Lift, velocity and acceleration of the follower over a turn.",
            legend="upper right",
            columns=3,
        ),
        "pressure": Panel(
            "Pressure angle, and curvature of the cam",
            inner,
            Axis("pressure angle", "deg"),
            [
                Line(angle, kinematics.pressure_angle),
                over_angle(kinematics.curvature, **right),
                *edges,
            ],
            "Pressure angle of the follower, and curvature of the surface of the cam.",
            right=_right("curvature", "1/mm", kinematics.curvature, 1.0 / PER_SI["mm"]),
        ),
        "load": Panel(
            f"Normal force, and peak pressure{shaded}",
            ANGLE,
            Axis("normal force", "N", margin=margin),
            [
                Line(angle, fine.normal_force),
                dots(point.angle, point.normal_force, "."),
                over_angle(pressures, **right),
                dots(point.angle, study.peak_pressure, ".", colour=ORANGE, right=True),
                *names,
                *skids,
            ],
            "Force between roller and cam, and peak pressure of the fresh contact.",
            right=_right("peak pressure", "MPa", pressures, PER_SI["MPa"], margin),
        ),
        "speed": Panel(
            f"Rolling speed, and roller/cam speed{shaded}",
            ANGLE,
            Axis("rolling speed", "m/s"),
            [
                over_angle(turn.speed * kinematics.travel),
                over_angle(kinematics.spin, **right),
                *edges,
                *skids,
            ],
            "Speed at which the contact rolls, and speed of the roller over that of the cam.",
            right=_right("roller/cam speed", "1", kinematics.spin, 1.0),
        ),
    }
    rows = [["shape", "motion"], ["shape", "pressure"], ["load", "speed"]]
    height = 8.6
    if (points := turn.cam.measured) is not None:
        panels["residuals"] = _residuals(turn.cam.motion, points)
        rows, height = [*rows, ["residuals", "residuals"]], 10.8
    return Sheet(
        turn.scenario.title, panels, rows, (12.0, height), widths=[1.0, 1.25], main="motion"
    )


def _fine(turn: CamTurn) -> Point:
    """Return the state at many angles of every smooth part of the turn."""
    samples = (61 + round(2.0 * DEG * (part.stop - part.start)) for part in turn.panels)
    return turn.at_stations(Stations(turn.panels, tuple(samples)))


def _right(
    name: str,
    unit: str,
    values: FloatArray,
    per_si: float,
    margin: tuple[float, float] = (0.0, 0.0),
) -> Axis:
    """Return the axis at the right, which reaches around a constant."""
    low, high = float(np.nanmin(values)), float(np.nanmax(values))
    limits: tuple[float | None, float | None] = (None, None)
    if high - low <= 1e-6 * abs(high):  # constant but for rounding
        around = 0.2 * abs(high) or 1.0
        limits = (low - around * (1.0 + 2.4 * margin[0]), high + around)
    return Axis(name, unit, per_si, limits=limits, margin=margin)


def segment_marks(motion: Motion, *, names: bool = True) -> list[Mark]:
    """Return the boundaries of the segments of a turn, and their names."""
    marks: list[Mark] = []
    for part, start, stop in zip(motion.segments, motion.starts, motion.starts[1:], strict=False):
        marks.append(Span(stop, dash=":", width=0.6, colour=GREY))
        if names and stop - start > 0.15:
            marks.append(
                Text(
                    *(0.5 * (start + stop), 0.02, part.name, "y"),
                    anchor="center",
                    size=7.0,
                    colour=GREY,
                )
            )
    return marks


def between_flanks(values: FloatArray, point: Point) -> FloatArray:
    """Return values, last axis points, with a gap where the flank of a groove changes."""
    gaps = np.flatnonzero(np.diff(point.inner.astype(np.int64))) + 1
    return np.insert(values, gaps, np.nan, axis=-1)


def _curve(places: FloatArray, **options: Any) -> Line:
    """Return a curve in the plane of the cam; places have shape (2, points)."""
    return Line(places[0], places[1], **options)


def shape_panel(turn: CamTurn) -> Panel:
    """Return the cam, its pitch curve and the follower at the start of the turn."""
    point, follower, base = _fine(turn), turn.cam.follower, turn.cam.base_radius
    centre, surface = surface_points(follower, point.kinematics, point.angle)
    reach = 1.25 * float(np.hypot(*centre).max())
    start = float(turn.at_angles(np.zeros(1)).kinematics.lift[0])
    return Panel(
        "Cam, turning clockwise",
        *_PLANE,
        [
            _curve(between_flanks(surface, point), width=1.6, label="cam"),
            _curve(centre, width=0.8, dash="--", colour=GREY, label="pitch curve"),
            Line(*circle(base), width=0.6, dash=":", colour=GREY, label="base circle"),
            *follower_marks(follower, start, turn.scenario.roller.radius, reach, "roller at 0 deg"),
            axis_mark(),
            *rotation_marks(0.5 * base),
        ],
        "The cam, the path of the roller's centre, and the follower at the start of a turn.",
        legend="below",
        columns=3,
        equal=True,
    )


def cam_run_sheet(result: Result, measured: Sequence[Measured] = ()) -> Sheet:
    """Return the panels of the run of a cam; measured profiles lie over the deepest groove."""
    turn = unchecked_turn_of(result.scenario)
    panels = {
        "map": _map(turn, result, "depth", "Worn depth of the cam", "the cam is deepest"),
        "shape": _worn_shape(turn, result),
        "lift": _lift_error(turn, result),
        "groove": _groove(result, measured),
        "depth": depth_panel(result),
        "roller": _roller(result),
        "pressure": pressure_panel(result),
    }
    rows = [["map", "map", "shape"], ["lift", "lift", "shape"], ["depth", "groove", "roller"]]
    heights = [1.2, 0.9, 1.1]
    if result.raw.fatigue:
        where = "the damage of the cam is greatest"
        panels |= {
            "damage": _map(turn, result, "damage", "Damage of the cam by fatigue", where),
            "pitting": pitting_panel(result),
        }
        rows.insert(2, ["damage", "damage", "pitting"])
        heights.insert(2, 1.2)
    return Sheet(
        with_source_lines(f"{result.title}\n{_caption(result)}", result),
        panels,
        rows,
        (12.5, 3.0 * sum(heights)),
        heights=heights,
        scale_beside=["roller"],
        steps=record_texts(result),
        main="groove",
    )


def _caption(result: Result) -> str:
    final = result.final
    turns, stated = float(np.max(final["turns"])), float(np.max(final["lift_error_error_m"]))
    place = float(np.max(final["depth_angle_rad"])) * DEG
    return (
        f"{turns:,.0f} turns, {caption(result)} at {place:.4g} deg,"
        f" lift error {with_error(np.asarray(final['lift_error_m']), stated, 'um')} peak to peak"
    )


def _map(turn: CamTurn, result: Result, quantity: str, title: str, where: str) -> Panel:
    """Return depth or damage of a cam at the end as a map over angle and width.

    Parameters
    ----------
    turn : CamTurn
    result : Result
    quantity : {"depth", "damage"}
    title, where : str
        Title of the panel, and what is at the angle of the greatest value.
    """
    axis = Axis(quantity, OBSERVABLES[quantity].unit)
    angle, values = turn.stations.values_at(
        np.asarray(result.raw.records[f"cylinder_{quantity}_profile"])[-1, :, 0], _SAMPLES
    )
    greatest = values.max(axis=0)
    extent = result.y[greatest > 1e-3 * greatest.max()] if greatest.max() > 0.0 else result.y
    course = result.depth if quantity == "depth" else result.values("cylinder_damage")
    place = float(np.max(result.final[f"{quantity}_angle_rad"])) * DEG
    return Panel(
        title,
        ANGLE,
        # the names of the segments lie below
        Axis("y across the track", "mm", limits=(1.25 * extent[0], 1.05 * extent[-1])),
        [
            # interpolation overshoots next to an edge
            Image(angle, result.y, np.maximum(values, 0.0).T, axis, "magma_r"),
            *segment_marks(turn.cam.motion),
        ],
        f"At the end {where} at {place:.4g} deg: {shown(float(np.max(course[-1])), axis.unit)}.",
    )


def _worn_shape(turn: CamTurn, result: Result) -> Panel:
    stations, follower = turn.stations, turn.cam.follower
    point = turn.at_stations(Stations(stations.panels, (_SAMPLES,) * len(stations.panels)))
    places = 0.5 - 0.5 * np.cos(np.pi * np.arange(_SAMPLES) / (_SAMPLES - 1))
    deepest = np.asarray(result.raw.records["cylinder_depth_profile"])[-1, :, 0].max(axis=1)
    factor = factor_for(turn, float(deepest.max()))
    fresh, cut = (
        surface_points(follower, point.kinematics, point.angle, depth)[1]
        for depth in (0.0, factor * stations.values_between(deepest, places))
    )
    starts = np.asarray(turn.cam.motion.starts[:-1])
    edges = fresh[:, np.abs(point.angle - starts[:, None]).argmin(axis=1)]
    marks: list[Mark] = [
        *([] if turn.cam.groove else [Patch(*cut, alpha=0.12)]),
        _curve(between_flanks(fresh, point), width=0.9, colour=GREY, label="unworn"),
        _curve(between_flanks(cut, point), width=1.4, label=f"worn, depth x {factor:g}"),
        *(Line([0.0, x], [0.0, y], dash=":", width=0.6, colour=GREY) for x, y in edges.T),
        axis_mark(),
    ]
    return Panel(
        "Worn cam",
        *_PLANE,
        marks,
        f"The cam before wear, and at the end with its depth magnified {factor:g} times.",
        legend="below",
        columns=2,
        equal=True,
    )


def _lift_error(turn: CamTurn, result: Result) -> Panel:
    curves = np.asarray(result.raw.records["lift_error_curve"])[:, :, 0, 0]
    angles, values = zip(
        *(turn.stations.values_at(curve, _SAMPLES) for curve in curves), strict=True
    )
    error = shown(float(np.max(result.final["lift_error_m"])), "um")
    return Panel(
        "Lift error against the unworn cam",
        ANGLE,
        Axis("lift error", "um"),
        [
            Records(angles[0], np.array(values), result.record_passes, most=8),
            dots(turn.stations.angle, curves[-1], ".", size=3.5, colour=BLACK, label="stations"),
            *segment_marks(turn.cam.motion, names=False),
        ],
        f"At the end it varies by {error} over a turn.",
        legend="upper right",
    )


def _groove(result: Result, measured: Sequence[Measured]) -> Panel:
    given = measured[0].angle if measured else None
    worn, angle = grooves_at(result, given)
    return Panel(
        f"{'Deepest groove, at' if given is None else 'Groove at'} {angle * DEG:.4g} deg",
        track_axis(result.y, worn.max(axis=0), *(profile.y for profile in measured)),
        HEIGHT,
        [
            Records(result.y, result.start_height - worn, result.record_passes),
            *measured_marks(measured),
        ],
        f"Height across the track; it is {shown(float(worn[-1].max()), 'um')} deep.",
    )


def _residuals(motion: Motion, measured: MeasuredPoints) -> Panel:
    """Return the residuals of a table about its smoothing spline, along the angle."""
    noise = 2.0 * measured.noise
    return Panel(
        f"Residuals of the {measured.quantity}, and twice its noise (shaded)",
        ANGLE,
        Axis("measured less spline", "um" if measured.unit == "m" else "mrad"),
        [
            Span(-noise, noise, across="y", colour=GREY, alpha=0.15),
            dots(measured.angle, measured.residual, ".", size=3.0),
            *segment_marks(motion, names=False),
        ],
        "What was measured, less the spline that smooths it.",
    )


def _roller(result: Result) -> Panel:
    profiles = np.asarray(result.raw.records["roller_depth_profile"])[:, 0, 0]
    marks: list[Mark] = [Records(result.y, -profiles, result.record_passes)]
    text = f"The roller is {shown(float(profiles[-1].max()), 'um')} deep at the end."
    if not profiles.any():
        marks.append(Line([], [], colour=ORANGE, label="the roller does not wear"))
        text = "The roller does not wear."
    return Panel(
        "Worn profile of the roller",
        track_axis(result.y, profiles.max(axis=0)),
        HEIGHT,
        marks,
        text,
        legend="lower center",
    )

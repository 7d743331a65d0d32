"""Figure of a cam before wear: motion, profile, kinematics, load and contact along the angle."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from wearsim.mechanics.cam import Motion, Stations, surface_points
from wearsim.report.parts import BLUE, GREEN, GREY, ORANGE, RED, name_axes, titled_figure
from wearsim.report.text import PER_SI
from wearsim.scenario.tables.cam_points import MeasuredPoints
from wearsim.studies.cam.point import Point
from wearsim.studies.cam.study import CamStudy, peak_pressures
from wearsim.studies.cam.turn import CamTurn
from wearsim.types import FloatArray

MM, DEG, MPA = PER_SI["mm"], PER_SI["deg"], PER_SI["MPa"]


def cam_figure(study: CamStudy, title: str) -> Figure:
    """Return the figure of a cam.

    Parameters
    ----------
    study : CamStudy
    title : str

    Returns
    -------
    Figure
        Five panels: the cam with its roller, the motion, pressure angle and curvature, speeds, and
        normal force with peak pressure; a sixth has the residuals of a smoothed table.
    """
    turn = study.turn
    samples = tuple(61 + round(2.0 * DEG * (part.stop - part.start)) for part in turn.panels)
    fine = turn.at_stations(Stations(turn.panels, samples))
    lift, unit = ("arm", "deg") if turn.cam.follower.swings else ("lift", "mm")
    scale = PER_SI[unit]
    found, angle = fine.kinematics, fine.angle * DEG
    shaded = " (skids shaded)" if study.skids else ""

    def broken(one: FloatArray, other: FloatArray) -> tuple[FloatArray, FloatArray]:
        return between_flanks(one, fine), between_flanks(other, fine)

    rows: list[Any] = [["shape", "motion"], ["shape", "pressure"], ["load", "speed"]]
    measured = turn.cam.measured
    if measured is not None:
        rows.append(["residuals", "residuals"])
    with titled_figure(12.0, 8.6 + 2.2 * (len(rows) - 3), title) as figure:
        panels = figure.subplot_mosaic(rows, width_ratios=[1.0, 1.25])
        if measured is not None:
            draw_residuals(panels["residuals"], turn.cam.motion, measured)
        draw_shape(panels["shape"], turn, fine)
        axes = panels["motion"]
        axes.plot(angle, found.lift * scale, color=BLUE, label=f"{lift} [{unit}]")
        velocity, acceleration = f"velocity [{unit}/rad]", f"acceleration [{unit}/rad$^2$]"
        axes.plot(angle, found.lift_per_rad * scale, color=ORANGE, label=velocity)
        axes.plot(angle, found.lift_per_rad2 * scale, color=GREEN, label=acceleration)
        name_axes(axes, "Motion of the follower", "", f"{lift} and its derivatives")
        axes.margins(y=0.18)
        axes.legend(loc="upper right", ncols=3)
        axes = panels["pressure"]
        axes.plot(angle, found.pressure_angle * DEG, color=BLUE)
        name_axes(axes, "Pressure angle, and curvature of the cam", "", "pressure angle [deg]")
        _second(axes, *broken(angle, found.curvature / MM), "curvature [1/mm]")
        axes = panels["speed"]
        axes.plot(*broken(angle, turn.speed * found.travel), color=BLUE)
        title = f"Rolling speed, and roller/cam speed{shaded}"
        name_axes(axes, title, "angle [deg]", "rolling speed [m/s]")
        _second(axes, *broken(angle, found.spin), "roller/cam speed")
        axes = panels["load"]
        axes.plot(angle, fine.normal_force, color=BLUE)
        axes.plot(study.point.angle * DEG, study.point.normal_force, ".", color=BLUE, ms=4.0)
        title = f"Normal force, and peak pressure{shaded}"
        name_axes(axes, title, "angle [deg]", "normal force [N]")
        curve = peak_pressures(turn.scenario, fine)
        other = _second(axes, *broken(angle, curve * MPA), "peak pressure [MPa]")
        other.plot(study.point.angle * DEG, study.peak_pressure * MPA, ".", color=ORANGE, ms=4.0)
        for each in (axes, other):
            low, high = each.get_ylim()
            each.set_ylim(low - 0.1 * (high - low), high)  # the names of the segments lie below
        for name in ("motion", "pressure", "speed", "load"):
            name_segments(panels[name], turn.cam.motion, names=name in {"motion", "load"})
        for skid in study.skids:
            for name in ("speed", "load"):
                panels[name].axvspan(skid.start * DEG, skid.stop * DEG, color=RED, alpha=0.12, lw=0)
    return figure


def draw_residuals(axes: Axes, motion: Motion, measured: MeasuredPoints) -> None:
    """Draw the residuals of a table about its smoothing spline, along the angle."""
    unit = "um" if measured.unit == "m" else "mrad"
    scale = PER_SI[unit]
    axes.axhspan(*(scale * measured.noise * np.array([-2.0, 2.0])), color=GREY, alpha=0.15, lw=0)
    axes.plot(measured.angle * DEG, measured.residual * scale, ".", color=BLUE, ms=3.0)
    title = f"Residuals of the {measured.quantity}, and twice its noise (shaded)"
    name_axes(axes, title, "angle [deg]", f"measured less spline [{unit}]")
    name_segments(axes, motion, names=False)


def _second(axes: Axes, angle: FloatArray, values: FloatArray, label: str) -> Axes:
    """Draw values on a second axis at the right, and return it."""
    other = axes.twinx()
    other.plot(angle, values, color=ORANGE, ls=(0, (4, 2)))  # may coincide with the first
    low, high = np.nanmin(values), np.nanmax(values)
    if high - low <= 1e-6 * abs(high):  # constant but for rounding
        around = 0.2 * abs(high) or 1.0
        other.set_ylim(low - around, high + around)
    other.set_ylabel(label, color=ORANGE)
    other.spines["right"].set_visible(True)
    other.grid(visible=False)
    return other


def name_segments(axes: Axes, motion: Motion, *, names: bool) -> None:
    """Mark the segments of a turn on an axis of the angle in degrees, with their names."""
    axes.set(xlim=(0.0, 360.0), xticks=np.arange(0.0, 361.0, 45.0))
    for part, start, stop in zip(motion.segments, motion.starts, motion.starts[1:], strict=False):
        axes.axvline(stop * DEG, color=GREY, lw=0.6, ls=":")
        if names and stop - start > 0.15:
            axes.text(
                0.5 * (start + stop) * DEG,
                0.02,
                part.name,
                transform=axes.get_xaxis_transform(),
                ha="center",
                va="bottom",
                fontsize=7.0,
                color=GREY,
            )


def between_flanks(values: FloatArray, point: Point) -> FloatArray:
    """Return values, last axis points, with a gap where the flank of a groove changes."""
    gaps = np.flatnonzero(np.diff(point.inner.astype(np.int64))) + 1
    return np.insert(values, gaps, np.nan, axis=-1)


def draw_shape(axes: Axes, turn: CamTurn, point: Point) -> None:
    """Draw the cam, its pitch curve and the roller at the start of the turn."""
    radius = turn.scenario.roller.radius
    centre, surface = surface_points(turn.cam.follower, point.kinematics, point.angle)
    surface = between_flanks(surface, point)
    axes.plot(*(surface * MM), color=BLUE, lw=1.6, label="cam")
    axes.plot(*(centre * MM), color=GREY, lw=0.8, ls="--", label="pitch curve")
    around = np.linspace(0.0, 2.0 * np.pi, 181)
    roller = centre[:, :1] + radius * np.stack([np.cos(around), np.sin(around)])
    axes.plot(*(roller * MM), color=ORANGE, lw=1.2, label="roller at 0 deg")
    base = turn.cam.base_radius * np.stack([np.cos(around), np.sin(around)])
    axes.plot(*(base * MM), color=GREY, lw=0.6, ls=":", label="base circle")
    axes.plot(0.0, 0.0, "+", color="black", ms=8.0)
    axes.set_aspect("equal")
    axes.set_anchor("N")
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.11), ncols=4, columnspacing=1.2)
    name_axes(axes, "Cam", "x [mm]", "y [mm]")

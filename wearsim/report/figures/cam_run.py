"""Figure of the run of a cam: depth map, worn cam, lift error, roller and deepest groove."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from wearsim.mechanics.cam import Stations, surface_points
from wearsim.report.figures.cam import between_flanks, name_segments
from wearsim.report.figures.run import Colours, caption, draw_depth
from wearsim.report.measured import Measured, grooves_at
from wearsim.report.parts import (
    BLUE,
    GREY,
    ORANGE,
    draw_measured,
    evenly_spaced,
    name_axes,
    titled_figure,
)
from wearsim.report.summary import with_error
from wearsim.report.text import PER_SI
from wearsim.results import Result
from wearsim.studies.cam.turn import CamTurn
from wearsim.types import FloatArray

UM, MM, DEG = PER_SI["um"], PER_SI["mm"], PER_SI["deg"]
_MAGNIFIED = 0.2  # greatest depth in the drawing of the worn cam, of the base radius
_SAMPLES = 97  # of a panel between its stations


def cam_run_figure(result: Result, measured: tuple[Measured, ...] = ()) -> Figure:
    """Return the figure of the run of a cam.

    Parameters
    ----------
    result : Result
    measured : tuple of Measured
        Profiles drawn over the groove at their angle, by default the deepest.

    Returns
    -------
    Figure
        Six panels: depth over angle and width, the worn cam with its depth magnified, lift error
        over the angle, depth against passes, deepest groove and roller profile.
    """
    turn = CamTurn(result.scenario)
    stations = turn.stations
    depth = np.asarray(result.raw.records["cylinder_depth_profile"])[-1, :, 0]
    colours = Colours(result.record_passes)
    with titled_figure(12.5, 9.6, f"{result.title}\n{_caption(result)}") as figure:
        panels = figure.subplot_mosaic(
            [["map", "map", "shape"], ["lift", "lift", "shape"], ["depth", "groove", "roller"]],
            height_ratios=[1.2, 0.9, 1.1],
        )
        _draw_map(figure, panels["map"], turn, stations, depth, result.y)
        _draw_shape(panels["shape"], turn, stations, depth)
        _draw_lift(panels["lift"], turn, stations, result, colours)
        draw_depth(panels["depth"], result)
        panels["depth"].legend(loc="lower right", fontsize=7.0, handlelength=1.0)
        _draw_groove(panels["groove"], result, measured[0].angle if measured else None, colours)
        draw_measured(panels["groove"], measured)
        _draw_roller(panels["roller"], result, colours)
        colours.draw_bar(figure, [panels["roller"]])
    return figure


def _caption(result: Result) -> str:
    final = result.final
    turns, stated = float(np.max(final["turns"])), float(np.max(final["lift_error_error_m"]))
    place = float(np.max(final["depth_angle_rad"])) * DEG
    return (
        f"{turns:,.0f} turns, {caption(result)} at {place:.4g} deg,"
        f" lift error {with_error(np.asarray(final['lift_error_m']), stated, 'um')} peak to peak"
    )


def _draw_map(
    figure: Figure,
    axes: Axes,
    turn: CamTurn,
    stations: Stations,
    depth: FloatArray,
    y: FloatArray,
) -> None:
    angle, values = stations.values_at(depth, _SAMPLES)
    worn = values.max(axis=0) > 0.0
    extent = y[worn] if worn.any() else y
    values = np.maximum(values, 0.0)  # interpolation overshoots next to an edge
    mesh = axes.pcolormesh(angle * DEG, y * MM, values.T * UM, shading="nearest", cmap="magma_r")
    mesh.set_rasterized(True)
    axes.set_ylim(1.25 * extent[0] * MM, 1.05 * extent[-1] * MM)  # the names of segments lie below
    axes.grid(visible=False)
    figure.colorbar(mesh, ax=axes, label="depth [um]", pad=0.01, aspect=30)
    name_axes(axes, "Worn depth of the cam", "angle [deg]", "y across the track [mm]")
    name_segments(axes, turn.cam.motion, names=True)


def _draw_shape(axes: Axes, turn: CamTurn, stations: Stations, depth: FloatArray) -> None:
    fine = Stations(stations.panels, (_SAMPLES,) * len(stations.panels))
    places = 0.5 - 0.5 * np.cos(np.pi * np.arange(_SAMPLES) / (_SAMPLES - 1))
    deepest = depth.max(axis=1)
    worn = stations.values_between(deepest, places)
    point = turn.at_stations(fine)
    factor = _round(_MAGNIFIED * turn.cam.base_radius / max(float(deepest.max()), 1e-12))
    follower, found = turn.cam.follower, point.kinematics
    fresh = surface_points(follower, found, point.angle)[1]
    cut = surface_points(follower, found, point.angle, factor * worn)[1]
    if not turn.cam.groove:
        axes.fill(*(cut * MM), color=BLUE, alpha=0.12, lw=0)
    axes.plot(*(between_flanks(fresh, point) * MM), color=GREY, lw=0.9, label="unworn")
    axes.plot(
        *(between_flanks(cut, point) * MM), color=BLUE, lw=1.4, label=f"worn, depth x {factor:g}"
    )
    for start in turn.cam.motion.starts[:-1]:
        edge = fresh[:, np.argmin(np.abs(point.angle - start))] * MM
        axes.plot([0.0, edge[0]], [0.0, edge[1]], color=GREY, lw=0.6, ls=":")
    axes.plot(0.0, 0.0, "+", color="black", ms=8.0)
    axes.set_aspect("equal")
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.14), ncols=2)
    name_axes(axes, "Worn cam", "x [mm]", "y [mm]")


def _round(value: float) -> float:
    """Return a value rounded down to one digit."""
    scale = 10.0 ** np.floor(np.log10(value))
    return float(np.floor(value / scale) * scale)


def _draw_lift(
    axes: Axes, turn: CamTurn, stations: Stations, result: Result, colours: Colours
) -> None:
    curves = np.asarray(result.raw.records["lift_error_curve"])[:, :, 0, 0]
    for record in colours.records[evenly_spaced(len(colours.records), 8)]:
        angle, values = stations.values_at(curves[record], _SAMPLES)
        axes.plot(angle * DEG, values * UM, color=colours.of(record), lw=1.2)
    axes.plot(stations.angle * DEG, curves[-1] * UM, ".", color="black", ms=3.5, label="stations")
    axes.legend(loc="upper right")
    name_axes(axes, "Lift error against the unworn cam", "angle [deg]", "lift error [um]")
    name_segments(axes, turn.cam.motion, names=False)


def _draw_groove(axes: Axes, result: Result, angle: float | None, colours: Colours) -> None:
    profiles, at = grooves_at(result, angle)
    _draw_profiles(axes, result.y, profiles, colours)
    which = "Deepest groove, at" if angle is None else "Groove at"
    name_axes(axes, f"{which} {at * DEG:.4g} deg", "y [mm]", "height [um]")


def _draw_roller(axes: Axes, result: Result, colours: Colours) -> None:
    profiles = np.asarray(result.raw.records["roller_depth_profile"])[:, 0, 0]
    _draw_profiles(axes, result.y, profiles, colours)
    if not profiles.any():
        axes.plot([], [], color=ORANGE, label="the roller does not wear")
        axes.legend(loc="lower center")
    name_axes(axes, "Worn profile of the roller", "y [mm]", "height [um]")


def _draw_profiles(axes: Axes, y: FloatArray, profiles: FloatArray, colours: Colours) -> None:
    for record in colours.records:
        axes.plot(y * MM, -profiles[record] * UM, color=colours.of(record), lw=1.0)
    worn = profiles.max(axis=0) > 0.0
    if worn.any():
        axes.set_xlim(1.15 * y[worn][0] * MM, 1.15 * y[worn][-1] * MM)

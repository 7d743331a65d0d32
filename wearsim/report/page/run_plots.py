"""Interactive figures of a run."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from bokeh.models.annotations import Band, ColorBar
from bokeh.models.mappers import LinearColorMapper
from bokeh.models.ranges import Range1d
from bokeh.palettes import Viridis256

from wearsim.mechanics.cam import Stations
from wearsim.report.measured import Measured, grooves_at
from wearsim.report.page.plots import (
    COLOURS,
    DEG,
    MIN,
    MM,
    MOST_POINTS,
    UM,
    W_MM,
    Plot,
    add_measured,
    axes,
    columns,
    hover,
    in_degrees,
    legend,
    pass_axes,
    worn_range,
)
from wearsim.report.parts import BLUE, ORANGE, evenly_spaced
from wearsim.report.text import PER_SI, count, shown
from wearsim.results import Result
from wearsim.studies.cam.turn import CamTurn
from wearsim.types import FloatArray

MOST_RECORDS = 60
LEAST_SAMPLES = 361  # points of a cam over a turn
RECORD = "record"  # start of the names of the sources that the slider of the page changes


def run_plots(result: Result, measured: Sequence[Measured]) -> list[Plot]:
    """Return the figures of a run; of a cam first its depth map and lift error."""
    profile, depth = _profile(result, measured), _depth(result)
    pressure = _history(result, "peak_pressure", "peak pressure", "MPa")
    if "station_angle" in result.raw.static:
        stations = CamTurn(result.scenario).stations
        of_cam = _map(result, stations), _lift_error(result, stations)
        return [*of_cam, profile, depth, pressure]
    force = _history(result, "normal_force", "normal force", "N")
    return [profile, depth, _dissipation(result), force, pressure]


def records_of(result: Result) -> list[int]:
    """Return the numbers of the records that the slider shows."""
    return [int(number) for number in evenly_spaced(len(result.record_passes), MOST_RECORDS)]


def _by_record(name: str, values: FloatArray, records: Sequence[int], **arrays: Any) -> Any:
    """Return a source whose column `shown` is that of a record; the others are kept beside it."""
    each = {str(place): values[record] for place, record in enumerate(records)}
    source = columns(**arrays, **each, shown=values[records[-1]])
    source.name = f"{RECORD} {name}"
    return source


def _profile(result: Result, measured: Sequence[Measured]) -> Plot:
    """Return the worn profile at the record of the slider, of a cam where it is deepest."""
    records, y = records_of(result), result.y * MM
    worn = np.asarray(result.raw.records["cylinder_depth_profile"])[:, :, 0]
    body, where, groove = "cylinder", "", worn[:, 0]
    if "station_angle" in result.raw.static:
        given = measured[0].angle if measured else None
        groove, angle = grooves_at(result, given)
        body, where = "cam", f" at {angle * DEG:.4g} deg"
        where += ", where it is deepest" if given is None else ""
    extent = worn_range(result.y, groove[-1])
    plot = axes("y [mm]", "height above nominal [um]", x_range=extent)
    height = (result.start_height - groove) * UM
    source = _by_record("profile", height, records, y=y)
    line = plot.line("y", "shown", source=source, color=BLUE, width=2, legend_label=body)
    hover(plot, [line], ("y", "@y{0.000} mm"), ("height", "@shown{0.000} um"))
    rollers = np.asarray(result.raw.records["roller_depth_profile"])[:, :, 0]
    for number, colour in zip(range(rollers.shape[1]), COLOURS[1:], strict=False):
        if rollers[-1, number].any():
            name = "roller" if rollers.shape[1] == 1 else f"roller {number + 1}"
            source = _by_record(name, -rollers[:, number] * UM, records, y=y)
            style = {"color": colour, "width": 2, "line_dash": "dashed", "legend_label": name}
            line = plot.line("y", "shown", source=source, **style)
            hover(plot, [line], ("y", "@y{0.000} mm"), (name, "@shown{0.000} um"))
    add_measured(plot, measured)
    legend(plot)
    deepest = shown(float(np.max(result.depth[-1])), "um")
    text = f"Height across the track; at the end the {body} is {deepest} deep."
    return Plot(f"Worn profile of the {body}{where}", text, plot)


def _depth(result: Result) -> Plot:
    """Return depth against roller passes with its estimated error."""
    whole = np.asarray(result.depth, dtype=float)
    plot, drawn, unit = pass_axes(result.passes, whole, "depth [um]")
    passes, depth, error, time = (
        values[drawn] for values in (result.passes, whole, result.depth_error, result.time)
    )
    source = columns(
        x=passes / unit,
        passes=passes,
        minutes=time * MIN,
        depth=depth * UM,
        error=error * UM,
        low=np.maximum(depth - error, 1e-3 * depth) * UM,
        high=(depth + error) * UM,
    )
    style: dict[str, Any] = {"fill_color": ORANGE, "fill_alpha": 0.4, "line_alpha": 0.0}
    plot.add_layout(Band(base="x", lower="low", upper="high", source=source, **style))
    plot.line("x", "depth", source=source, color=BLUE, width=2)
    points = plot.scatter("x", "depth", source=source, color=BLUE, size=5)
    tips = ("depth", "@depth{0.000} um"), ("estimated error", "@error{0.0000} um")
    hover(plot, [points], ("passes", "@passes{0,0}"), ("time", "@minutes{0.0} min"), *tips)
    first, last = (shown(float(value), "um") for value in (depth[0], depth[-1]))
    text = f"The depth grows from {first} at pass {count(passes[0])} to {last} at the end."
    return Plot("Depth against roller passes", text, plot)


def _dissipation(result: Result) -> Plot:
    """Return the dissipated power per length at the record of the slider."""
    power = np.asarray(result.dissipation).reshape(len(result.record_passes), -1, len(result.y))
    extent = worn_range(result.y, power[-1].max(axis=0))
    plot = axes("y [mm]", "dissipated power per length [W/mm]", x_range=extent)
    for number, (colour, label) in enumerate(_styles(power.shape[1])):
        values = power[:, number] * W_MM
        source = _by_record(f"power {number}", values, records_of(result), y=result.y * MM)
        line = plot.line("y", "shown", source=source, color=colour, width=2, **label)
        hover(plot, [line], ("y", "@y{0.000} mm"), ("power", "@shown{0.00000} W/mm"))
    legend(plot)
    text = "Power across the track: high and narrow on fresh bodies, low and wide in a groove."
    return Plot("Dissipated power per length", text, plot)


def _styles(rollers: int) -> list[tuple[str, dict[str, str]]]:
    """Return colour and label of each roller; a single line needs no label."""
    if rollers == 1:
        return [(BLUE, {})]
    labels = [{"legend_label": f"roller {number}"} for number in range(1, rollers + 1)]
    return [(COLOURS[number % len(COLOURS)], label) for number, label in enumerate(labels)]


def _history(result: Result, name: str, words: str, unit: str) -> Plot:
    """Return a quantity of the rollers against time."""
    values = np.asarray(result.raw.history[name])[..., 0] * PER_SI[unit]
    plot = axes("time [min]", f"{words} [{unit}]")
    every = evenly_spaced(len(values), MOST_POINTS)
    for number, (colour, label) in enumerate(_styles(values.shape[1])):
        source = columns(
            time=result.time[every] * MIN, passes=result.passes[every], value=values[every, number]
        )
        plot.line("time", "value", source=source, width=2, color=colour, **label)
        points = plot.scatter("time", "value", source=source, size=4, color=colour)
        tips = ("passes", "@passes{0,0}"), (words, f"@value{{0.00}} {unit}")
        hover(plot, [points], ("time", "@time{0.0} min"), *tips)
    if np.ptp(values) < 0.02 * values.max():  # shows a constant as such
        plot.y_range = Range1d(start=0.0, end=1.25 * float(values.max()))
    legend(plot)
    first, last = f"{values[0].max():.4g} {unit}", f"{values[-1].max():.4g} {unit}"
    text = f"It is {first} at the start and {last} at the end."
    return Plot(f"{words.capitalize()} of the rollers", text, plot)


def _map(result: Result, stations: Stations) -> Plot:
    """Return the worn depth of a cam at the end over angle and width."""
    worn = np.asarray(result.raw.records["cylinder_depth_profile"])[-1, :, 0]
    angle, depth = _over_a_turn(stations, worn)
    inside = worn.max(axis=0) > 1e-3 * worn.max()
    inside = inside if inside.any() else np.ones_like(inside)
    y, regular = result.y[inside] * MM, np.linspace(0.0, 360.0, 361)
    image = np.array([np.interp(regular, angle * DEG, row) for row in depth[:, inside].T]) * UM
    plot = axes("angle of the cam [deg]", "y [mm]", y_range=Range1d(start=y[0], end=y[-1]))
    in_degrees(plot)
    mapper = LinearColorMapper(palette=Viridis256[::-1], low=0.0, high=float(image.max()) or 1.0)
    extent = {"x": 0, "y": float(y[0]), "dw": 360, "dh": float(y[-1] - y[0])}
    picture = plot.image(image=[image.astype(np.float32)], color_mapper=mapper, **extent)
    style: dict[str, Any] = {"title": "depth [um]", "title_text_font_style": "normal"}
    plot.add_layout(ColorBar(color_mapper=mapper, width=12, **style), "right")
    tips = ("angle", "$x{0.0} deg"), ("y", "$y{0.00} mm"), ("depth", "@image{0.00} um")
    hover(plot, [picture], *tips)
    place = float(np.max(result.final["depth_angle_rad"])) * DEG
    deepest = shown(float(np.max(result.depth[-1])), "um")
    text = f"At the end the cam is deepest at {place:.4g} deg: {deepest}."
    return Plot("Worn depth over angle and width", text, plot)


def _over_a_turn(stations: Stations, values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return angles [rad] of a turn, at least one a degree, and values between the stations."""
    return stations.values_at(values, LEAST_SAMPLES // len(stations.panels) + 1)


def _lift_error(result: Result, stations: Stations) -> Plot:
    """Return the lift error of a cam over the angle, at the record of the slider."""
    curves = np.asarray(result.raw.records["lift_error_curve"])[:, :, 0, 0]
    records = records_of(result)
    angle, _ = _over_a_turn(stations, curves[0])
    values = np.zeros((len(curves), len(angle)))
    for record in records:
        values[record] = _over_a_turn(stations, curves[record])[1] * UM
    plot = axes("angle of the cam [deg]", "lift error [um]")
    in_degrees(plot)
    source = _by_record("lift error", values, records, angle=angle * DEG)
    line = plot.line("angle", "shown", source=source, color=BLUE, width=2)
    hover(plot, [line], ("angle", "@angle{0.0} deg"), ("lift error", "@shown{0.000} um"))
    error = shown(float(np.max(result.final["lift_error_m"])), "um")
    text = f"At the end it varies by {error} over a turn."
    return Plot("Lift error over the angle", text, plot)

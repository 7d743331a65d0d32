"""Panels of a run: profiles, depth, dissipated power, normal force and peak pressure."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import cycle
from typing import Any

import numpy as np

from wearsim.errors import WearsimError
from wearsim.levelling import Measured
from wearsim.report.panels import (
    COLOURS,
    DASHES,
    GREY,
    ORANGE,
    Axis,
    Band,
    Line,
    Panel,
    Records,
    Sheet,
    depth_axes,
    measured_marks,
    worn_limits,
)
from wearsim.report.text import count, shown, simulated
from wearsim.report.view import width_row
from wearsim.studies.fatigue.panels import damage_panel, pitting_panel, rollers_at_end
from wearsim.studies.fatigue.view import with_source_lines
from wearsim.studies.run.result import Result
from wearsim.types import FloatArray

Y = "y"
HEIGHT = Axis("height above nominal", "um")


def run_sheet(result: Result, measured: Sequence[Measured] = ()) -> Sheet:
    """Return the panels of a run; measured profiles are drawn over the computed ones."""
    power = np.asarray(result.dissipation).reshape(-1, len(result.y)).max(axis=0)
    across = track_axis(result.y, power, *(profile.y for profile in measured))
    panels = {
        "profiles": _profiles(result, across, measured),
        "depth": depth_panel(result),
        "dissipation": _dissipation(result, across),
        "load": _normal_force(result),
        "pressure": pressure_panel(result),
    }
    rows, height = [["profiles", "depth"], ["dissipation", "load"]], 7.6
    if result.raw.fatigue:
        panels |= {"damage": damage_panel(result), "pitting": pitting_panel(result)}
        rows, height = [*rows, ["damage", "pitting"]], 11.0
    return Sheet(
        with_source_lines(f"{result.title}\n{caption(result)}", result),
        panels,
        rows,
        (11.0, height),
        widths=[1.15, 1.0],
        scale_beside=["profiles", "dissipation"],
        steps=record_texts(result),
    )


def track_axis(y: FloatArray, worn: FloatArray, *others: FloatArray) -> Axis:
    """Return the axial axis, limited to the worn part; parameters as of `worn_limits`."""
    return Axis(Y, "mm", limits=worn_limits(y, worn, *others))


def record_texts(result: Result) -> list[str]:
    """Return passes and time of each record, for the slider of a page."""
    return [
        f"pass {count(passes)}, {simulated(time)}"
        for passes, time in zip(result.record_passes, result.record_time, strict=True)
    ]


def caption(result: Result) -> str:
    """Return passes, time, model, depth and width of a run in words."""
    depth = f"depth {shown(float(np.max(result.depth[-1])), 'um')}"
    if result.start_height.any():
        depth += (
            " worn since the start, depth below nominal"
            f" {shown(float(np.max(result.depth_below_nominal[-1])), 'um')}"
        )
    unfinished = "" if result.finished else ", failed" if result.failure else ", unfinished"
    if result.until:
        unfinished = f", stopped at {result.until}"
    return (
        f"{count(float(result.passes[-1]))} roller passes in"
        f" {simulated(float(result.time[-1]))}"
        f" ({result.described_model}, {result.stepper}{unfinished})\n"
        f"{depth}, width {width_row(np.max(result.width[-1]), result.raw.width_threshold).text}"
    )


def _profiles(result: Result, across: Axis, measured: Sequence[Measured]) -> Panel:
    worn, passes = np.asarray(result.profiles), result.record_passes
    rollers = np.asarray(result.roller_profiles).reshape(len(passes), -1, len(result.y))
    return Panel(
        "Worn profile of the cylinder (black: start of the run)",
        across,
        HEIGHT,
        [
            Records(result.y, result.start_height - worn, passes),
            *rollers_at_end(result.y, -rollers[-1]),
            *measured_marks(measured),
        ],
        "Height across the track; at the end the cylinder is"
        f" {shown(float(worn[-1].max()), 'um')} deep.",
        legend="lower right",
    )


def depth_panel(result: Result) -> Panel:
    """Return the depth against the roller passes, with its estimated error."""
    title = "Depth worn since the start" if result.start_height.any() else "Depth"
    drawn, x, y = depth_axes(result.passes, result.depth, title.lower())
    passes, depth, error, time = (
        values[drawn] for values in (result.passes, result.depth, result.depth_error, result.time)
    )
    estimate = f"estimated error {shown(float(error[-1]), 'um', 2)} at the end"
    low = np.maximum(depth - error, 0.05 * depth) if y.log else depth - error
    band = Band(passes, low, depth + error, label=estimate, colour=ORANGE, alpha=0.35)
    is_visible = bool((error > 0.05 * depth).any())
    marker, label = "", "depth"
    if result.stepper == "per-pass":
        estimate = "no stepping error: every roller pass is solved"
    elif len(passes) <= 80:
        marker, label = "o", "depth, one dot per step"
    label += "" if is_visible else f"\n({estimate})"
    first, last = (shown(float(value), "um") for value in (depth[0], depth[-1]))
    return Panel(
        title,
        x,
        y,
        [
            *([band] if is_visible else []),
            Line(
                passes,
                depth,
                marker=marker,
                size=2.6,
                label=label,
                more={"time": (time, "min"), "estimated error": (error, "um")},
            ),
        ],
        f"The depth grows from {first} at pass {count(passes[0])} to {last} at the end.",
        legend="upper left",
    )


def _dissipation(result: Result, across: Axis) -> Panel:
    power = np.asarray(result.dissipation).reshape(len(result.record_passes), -1, len(result.y))
    rollers = power.shape[1]
    return Panel(
        "Dissipated power per length (black: start of the run)",
        across,
        Axis("$P_l$", "W/mm", limits=(0.0, None)),
        [
            Records(
                result.y,
                power[:, number],
                result.record_passes,
                dash=DASHES[number % len(DASHES)],
                most=10 if rollers == 1 else 5,
                label="" if rollers == 1 else f"roller {number + 1}",
                colour=COLOURS[number % len(COLOURS)],
            )
            for number in range(rollers)
        ],
        "Power across the track: high and narrow on fresh bodies, low and wide in a groove.",
        legend="upper right",
    )


def _normal_force(result: Result) -> Panel:
    force, base = _by_roller(result.normal_force), _base_load(result)
    # between the steps, a line would contradict the load; at many of them, the dots are a line
    style: dict[str, Any] = {} if base is None else {"dash": "", "marker": "o", "size": 2.6}
    return Panel(
        "Normal force of one roller",
        Axis("time", "min", margin=(0.02, 0.02)),
        _force_axis("normal force", "N", force if base is None else np.array([0.0, 1.0])),
        [
            *([Line(*base, width=0.8, colour=GREY, label="without feedback")] if base else []),
            *_lines(result, force, "" if base is None else "at the steps", **style),
        ],
        _first_and_last(force, "N"),
    )


def pressure_panel(result: Result) -> Panel:
    """Return the peak pressure of the rollers against time."""
    values = _by_roller(result.peak_pressure)
    return Panel(
        "Peak pressure of the rollers",
        Axis("time", "min"),
        _force_axis("peak pressure", "MPa", values),
        _lines(result, values),
        _first_and_last(values, "MPa"),
    )


def _lines(result: Result, values: FloatArray, alone: str = "", **style: Any) -> list[Line]:
    """Return the history of each roller, or of all if there is one column, with its label."""
    more, rollers = {"passes": (result.passes, "1")}, values.shape[1]
    labels = [alone] if rollers == 1 else [f"roller {number + 1}" for number in range(rollers)]
    return [
        Line(result.time, column, label=label, colour=colour, more=more, **style)
        for column, label, colour in zip(values.T, labels, cycle(COLOURS), strict=False)
    ]


def _force_axis(name: str, unit: str, values: FloatArray) -> Axis:
    """Return the axis of values, which shows a constant as such."""
    greatest = float(values.max())
    constant = np.ptp(values) < 0.02 * greatest
    return Axis(name, unit, limits=(0.0, 1.25 * greatest) if constant else (None, None))


def _by_roller(values: FloatArray) -> FloatArray:
    """Return a history by roller, or one column if it is the same on all."""
    columns = np.asarray(values).reshape(len(values), -1)
    return columns[:, :1] if np.ptp(columns, axis=1).max() < 1e-6 * columns.max() else columns


def _first_and_last(values: FloatArray, unit: str) -> str:
    first, last = (shown(float(row.max()), unit) for row in (values[0], values[-1]))
    return f"It is {first} at the start and {last} at the end."


def _base_load(result: Result) -> tuple[FloatArray, FloatArray] | None:
    """Return times [s] and the load without feedback [N], or None if constant or unknown."""
    times = np.linspace(0.0, float(result.time[-1]), 2001)
    try:
        force = result.scenario.load.built.force(times)
    except WearsimError:  # a plugin of the scenario is not installed
        return None
    return (times, force) if np.ptp(force) > 1e-3 * force.max() else None
